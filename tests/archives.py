"""Calls that write archives, stopped after some of their sets; archives to the bit; commands."""

import pytest
import xarray as xr
from click.testing import CliRunner

from symhbm.cli import main
from symhbm.response import ensemble


def counted(patch, stop=None):
    """The problems of the curves computed from now on; of one too many, the user's interrupt."""
    made, compute = [], ensemble.compute_curve

    def counting(problem, task):
        if len(made) == stop:
            raise KeyboardInterrupt
        made.append(problem)
        return compute(problem, task)

    patch.setattr(ensemble, "compute_curve", counting)
    return made


def interrupt(after, verb, *arguments, **options):
    """Stop a call once some of its curves are computed."""
    with pytest.MonkeyPatch.context() as patch:
        made = counted(patch, after)
        with pytest.raises(KeyboardInterrupt):
            verb(*arguments, progress=False, **options)
    assert len(made) == after


def assert_same(found, expected):
    """Datasets agree in all they are, to the order of variables and every bit, but in origin."""
    one, other = (each.assign_attrs(merged_from="") for each in (found, expected))
    xr.testing.assert_identical(one, other)
    assert [*one.variables] == [*other.variables]
    for name, variable in other.variables.items():
        values, bits = variable.values, one.variables[name].values
        assert bits.dtype == values.dtype, name
        is_same = values.dtype.kind == "O" or bits.tobytes() == values.tobytes()
        assert is_same, name  # by itself: pytest would look for long in what differs


def run(*arguments):
    """Exit code and outputs of a command."""
    done = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert isinstance(done.exception, SystemExit | None), done.exception
    return done.exit_code, done.stdout, done.stderr
