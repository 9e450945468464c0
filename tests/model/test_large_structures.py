"""Large sparse structures that are not condensed: nothing grows faster than their entries."""

import time
import warnings

import numpy as np
import pytest
import scipy.sparse as sp

import symhbm as sh
from symhbm.model import plausibility
from symhbm.model.linear import natural_band
from symhbm.time_domain import linear_motion
from tests.problems import rub
from tests.quick import quick_first


def banded(n, half_width, n_contacts=2):
    """A structure whose masses are joined to all others within a distance."""
    offsets = range(1, half_width + 1)
    ties = sp.diags_array([-1e4 * np.ones(n - k) for k in offsets], offsets=offsets, shape=(n, n))
    ties = ties + ties.T
    stiffness = ties - sp.diags_array(ties.sum(axis=1)) + 1e3 * sp.eye_array(n)
    mass = sp.eye_array(n)
    return sh.Model(
        mass,
        0.5 * mass + 1e-6 * stiffness,
        stiffness,
        contacts=[(i,) for i in range(n_contacts)],
        **rub(1e3, 0.5, 1.0),
    )


def effort(call):
    """Time of a call over that of two million plain operations in the same run."""

    def seconds(timed):
        start = time.process_time()
        timed()
        return time.process_time() - start

    return seconds(call) / seconds(lambda: sum(i * i % 7 for i in range(2_000_000)))


@pytest.mark.slow
@pytest.mark.parametrize("harmonics", quick_first([((1,),), ((1, 3),)], 1))
def test_compiling_traces_no_matrix(harmonics):
    # By rule 5 to 10; traced symbolically, the Jacobian alone took 30 to 50.
    force, model = sh.forces.PointForce(0), banded(250, 40)
    sh.HarmonicBalance(banded(20, 4), force, harmonics)
    assert effort(lambda: sh.HarmonicBalance(model, force, harmonics)) < 20


@pytest.mark.slow
def test_a_curve_of_a_sparse_structure_takes_little():
    # Its first correction took as long to compile as many factorisations of it.
    model = banded(300, 25)
    problem = sh.HarmonicBalance(model, sh.forces.PointForce(0, amplitude=10.0))
    sh.frf(sh.HarmonicBalance(banded(20, 4), sh.forces.PointForce(0)), (4, 5), progress=False)
    found = []
    assert effort(lambda: found.append(sh.frf(problem, (4, 5), progress=False))) < 40
    assert found[0].status == "the end of the band was reached"
    assert found[0].n_events > 0


@pytest.mark.slow
def test_what_takes_minutes_is_told_of_condense(monkeypatch):
    problem = sh.HarmonicBalance(banded(60, 2), sh.forces.PointForce(0, amplitude=10.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sh.solve(problem, 4.5, stability=True)
    monkeypatch.setattr(plausibility, "MANY", 100)
    with pytest.warns(UserWarning, match=r"120 unknowns; .* 2 degrees .*\(.*stability=True\)"):
        sh.solve(problem, 4.5, stability=True)
    for verb in (sh.peak_curve, sh.minimise_peak):
        with (
            pytest.warns(UserWarning, match=r"derivatives take minutes for 120 .*condense\("),
            pytest.raises(TypeError, match="at most"),
        ):
            verb(problem, "normal_load", (1, 2), throw="at most")
    with pytest.warns(UserWarning, match="frequency=None: a band that holds all of .* 501 reso"):
        natural_band([banded(501, 1)])


def test_exact_motions_of_large_structures_name_the_other_reduction(monkeypatch):
    monkeypatch.setattr(linear_motion, "_MOST", 30)
    problem = sh.HarmonicBalance(banded(31, 2), sh.forces.PointForce(0))
    with pytest.raises(ValueError, match=r"at most 30 degrees of freedom.*symhbm\.craig_bampton"):
        sh.periodic_motion(problem, 4.5)


def test_a_large_structure_is_told_of_condense(monkeypatch):
    monkeypatch.setattr(plausibility, "LARGE", 1000)
    with pytest.warns(UserWarning, match=r"60 degrees of freedom.*touch 2,.*symhbm.condense\("):
        sh.HarmonicBalance(banded(60, 20), sh.forces.PointForce(0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sh.HarmonicBalance(banded(60, 20, n_contacts=30), sh.forces.PointForce(0))
        sh.HarmonicBalance(banded(60, 4), sh.forces.PointForce(0))
        force = sh.forces.PointForce(0)
        small = sh.condense(banded(60, 20), force, (4, 8))
        sh.HarmonicBalance(small, force)
