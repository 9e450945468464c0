"""Events of contacts that reverse twice: the compiled form against the march in general."""

from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import symhbm as sh
from symhbm.model.contacts.coulomb import located as coulomb_located
from symhbm.model.contacts.coulomb import two_reversals as coulomb_two_reversals
from symhbm.model.contacts.coulomb.state import ContactState
from symhbm.numerics import roots
from symhbm.numerics.fourier import FourierBasis

SETS = [(1, 3), (1, 3, 5), (1, 3, 5, 7, 9), (0, 1, 2, 3), (1, 2)]
ANGLES = ("theta_0", "theta_star")


def in_general(monkeypatch, *arguments):
    with monkeypatch.context() as patch:
        patch.setattr(coulomb_located, "locate_two_reversals", lambda *_: None)
        return coulomb_located.locate(*arguments)


def motions(basis, rng, n_motions, decay):
    """Motions of which most reverse twice."""
    size = np.maximum(basis.order, 1) ** -decay
    return rng.normal(size=(n_motions, basis.n_components)) * size


@pytest.mark.parametrize("harmonics", SETS)
@pytest.mark.parametrize("imposed", [False, True])
def test_agrees_with_the_march(harmonics, imposed, monkeypatch):
    basis, rng = FourierBasis(harmonics), np.random.default_rng(7)
    simple = seen = 0
    for wave in motions(basis, rng, 120, 4.0):
        stiffness = 10 ** rng.uniform(-2, 2, 1) * (rng.random() < 0.95)
        reach = np.exp(coulomb_located.locate(basis, wave[None], stiffness, np.ones(1)).slip_margin)
        limit = reach * rng.uniform(0.01, 1.3, 1) * (rng.random() < 0.95)
        slip = rng.random(1) < 0.5 if imposed else None
        arguments = basis, wave[None], stiffness, limit, slip
        motion = roots.Motions(basis, wave[None])
        cells = coulomb_located.turning_cells(motion)
        assert cells is not None
        fast = coulomb_two_reversals.locate_two_reversals(motion, cells, *arguments[2:])
        general = in_general(monkeypatch, *arguments)
        simple += int(general.reversals[0] == 2)
        if fast is None:
            continue
        assert general.reversals[0] == 2
        seen += 1
        for field in fields(ContactState):
            mine, other = getattr(fast, field.name), getattr(general, field.name)
            mine = mine[~np.isnan(mine)] if mine.dtype.kind == "f" else mine
            other = other[~np.isnan(other)] if other.dtype.kind == "f" else other
            if field.name in ANGLES:
                mine, other = np.exp(1j * mine), np.exp(1j * other)
            # Angles are good to round-off over the slope of the motion, which vanishes with the
            # root of the distance to the limit, one per cent and more here.
            np.testing.assert_allclose(mine, other, rtol=1e-12, atol=1e-12, err_msg=field.name)
    # Few guesses are so poor that the steps do not settle.
    assert seen >= 0.9 * simple > 60


@settings(deadline=None, max_examples=100)
@given(
    seed=st.integers(0, 2**32 - 1),
    harmonics=st.sampled_from(SETS),
    distance=st.floats(-14, -2),
    sign=st.sampled_from([-1, 1]),
)
def test_agrees_at_the_limit(seed, harmonics, distance, sign):
    """The force is regular there, the angles are good to the root of round-off."""
    basis, rng = FourierBasis(harmonics), np.random.default_rng(seed)
    wave, stiffness = motions(basis, rng, 1, 4.0), np.ones(1)
    limit = np.exp(coulomb_located.locate(basis, wave, stiffness, np.ones(1)).slip_margin)
    limit *= 1 + sign * 10**distance
    patch = pytest.MonkeyPatch()
    for slip in (None, np.array([True]), np.array([False])):
        fast = coulomb_located.locate(basis, wave, stiffness, limit, slip)
        general = in_general(patch, basis, wave, stiffness, limit, slip)
        forces = [f.matrix[0] @ wave[0] + limit * f.vector[0] for f in (fast, general)]
        np.testing.assert_allclose(*forces, rtol=0, atol=1e-13 * np.abs(wave).max())
        assert fast.slip == general.slip


def test_a_motion_that_reverses_more_often_is_none_of_these():
    basis = FourierBasis((1, 3))
    wave = np.array([[1.0, 0.0, 1.0, 0.2], [1.0, 0.0, 0.01, 0.0]])
    motion = roots.Motions(basis, wave)
    cells = coulomb_located.turning_cells(motion)
    assert cells is not None
    assert coulomb_two_reversals.locate_two_reversals(motion, cells, np.ones(2), np.ones(2)) is None
    found = coulomb_located.locate(basis, wave, np.ones(2), np.full(2, 0.1))
    assert found.reversals.tolist() == [6, 2]


def test_a_batch_gives_what_each_motion_gives():
    """Motions of all kinds at once: some at rest, some without limit, some with many reversals."""
    for harmonics in ((1, 3, 5), (0, 1, 2, 3)):
        basis, rng = FourierBasis(harmonics), np.random.default_rng(4)
        waves = motions(basis, rng, 40, 1.0)
        waves[::7], waves[3::7] = 0.0, waves[3::7] * 1e-120
        stiffness, limit = 10 ** rng.uniform(-1, 1, 40), rng.uniform(0.1, 3, 40)
        stiffness[5::9], limit[6::9] = 0.0, 0.0
        together = coulomb_located.locate(basis, waves, stiffness, limit)
        for i in range(40):
            each = slice(i, i + 1)
            alone = coulomb_located.locate(basis, waves[each], stiffness[each], limit[each])
            for name in ("matrix", "vector", "stick_fraction", "theta_0", "theta_star"):
                # Round-off of angles, and of what is summed in another order.
                np.testing.assert_allclose(
                    getattr(together, name)[i], getattr(alone, name)[0], rtol=0, atol=1e-11
                )
            assert together.slip[i] == alone.slip[0]
            assert together.reversals[i] == alone.reversals[0]


def test_motions_of_equal_periods_are_those_of_one():
    """Harmonics (3, 9) with the coefficients of (1, 3): the same force, three times as often."""
    rng = np.random.default_rng(2)
    waves, stiffness = rng.normal(size=(10, 4)), np.ones(10)
    limit = np.full(10, 0.4)
    once, thrice = (
        coulomb_located.locate(FourierBasis(h), waves, stiffness, limit) for h in ((1, 3), (3, 9))
    )
    np.testing.assert_array_equal(once.matrix, thrice.matrix)
    np.testing.assert_array_equal(3 * once.reversals, thrice.reversals)
    contact_once, begin, end = once.stick_intervals
    contact_thrice, begin_thrice, end_thrice = thrice.stick_intervals
    np.testing.assert_array_equal(np.repeat(contact_once, 3), np.sort(contact_thrice))
    # Round-off of angles up to two turns.
    assert (end - begin).sum() == pytest.approx((end_thrice - begin_thrice).sum(), rel=1e-13)


def test_work_along_a_response(monkeypatch):
    """A tuned ring needs neither the march nor a bracket anywhere along its response."""
    disk = sh.bladed_disk(
        13,
        mass=1,
        stiffness=1e4,
        damping=0.5,
        contact_stiffness=1e6,
        friction_coefficient=0.5,
        normal_load=10,
    )
    problem = sh.HarmonicBalance(disk, sh.EngineOrder(3), (1, 3, 5))
    calls = dict.fromkeys(("march", "bracket", "all"), 0)

    def counted(name, function):
        def call(*arguments, **named):
            calls[name] += 1
            return function(*arguments, **named)

        return call

    monkeypatch.setattr(coulomb_located, "_march", counted("march", coulomb_located._march))
    bracketed = counted("bracket", roots.monotone_root)
    monkeypatch.setattr(roots, "monotone_root", bracketed)
    found = counted("all", coulomb_two_reversals.locate_two_reversals)
    monkeypatch.setattr(coulomb_located, "locate_two_reversals", found)
    sh.frf(problem, (150, 280), progress=False)
    assert calls["all"] > 100
    assert calls["march"] <= 0.02 * calls["all"]
    assert calls["bracket"] == 0
