"""Calls that write archives, stopped after some of their parameter sets."""

import pytest

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
