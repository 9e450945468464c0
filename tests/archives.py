"""Problems for archives, calls that are stopped after some sets, archives to the bit; commands."""

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

import symhbm as sh
from symhbm.cli import main
from symhbm.response import ensemble


def two_masses(back=-5.0):
    """Contacts between both and to the ground, forces of several harmonics and a static one.

    Springs whose force ``back`` is another one do work around a cycle.
    """
    model = sh.Model(
        [[2.0, 0.1], [0.1, 1.0]],
        [[0.2, -0.1], [-0.1, 0.3]],
        [[20.0, -5.0], [back, 10.0]],
        contacts=[(0, 1), (1,)],
        contact_stiffness=[3.0, 5.0],
        friction_coefficient=0.3,
        normal_load=[1.0, 2.0],
    )
    cosine = {0: [0.2, 0.0], 1: [1.0, 0.5]}
    force = sh.forces.HarmonicForce(cosine=cosine, sine={2: [0.0, 0.3]}, amplitude=1.5)
    return sh.HarmonicBalance(model, force, harmonics=(0, 1, 2))


def three_rings():
    """Loads and stiffnesses of three blades each, as what to sweep."""
    rng = np.random.default_rng(2013)
    loads = xr.DataArray(
        rng.uniform(2, 4, (3, 3)), dims=("sample", "contact"), coords={"sample": [4, 5, 6]}
    )
    stiffness = xr.DataArray(rng.uniform(0.9e4, 1.1e4, (3, 3)), dims=("sample", "dof"))
    return {"normal_load": loads, "stiffness": stiffness}


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
