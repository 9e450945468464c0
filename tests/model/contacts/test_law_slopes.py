"""First and second derivatives of all laws that have events, by motions and values."""

from functools import partial

import numpy as np
import pytest

import symhbm as sh
from symhbm.model.contacts import Motions
from symhbm.numerics import FourierBasis
from tests.law_slopes import OneContact, difference
from tests.quick import quick_first

LAWS = {
    "coulomb": sh.laws.Coulomb(),
    "varying": sh.laws.VariableLoadFriction(),
    "varying, gap": sh.laws.VariableLoadFriction("gap", "coupled"),
    "stop": sh.laws.UnilateralSpring("gap"),
    "planar": sh.laws.PlanarFriction("constant"),
    "pressed": sh.laws.PlanarFriction(preload="coupled"),
    "pressed, gap": sh.laws.PlanarFriction("gap"),
}


STICKS, SLIPS, OPENS = range(3)
STATES = {name: {STICKS, SLIPS, OPENS} for name in LAWS}
STATES |= {"coulomb": {STICKS, SLIPS}, "planar": {STICKS, SLIPS}, "stop": {STICKS, OPENS}}


def drawn(law, basis, rng, **given):
    """A motion and values of a law, one after the other."""
    motion = rng.normal(size=(len(law.directions), basis.n_components))
    motion *= np.maximum(basis.order, 1) ** -1.5
    values = dict(
        contact_stiffness=rng.uniform(0.3, 2),
        normal_stiffness=rng.uniform(0.3, 2),
        friction_coefficient=rng.uniform(0.2, 2),
        normal_load=10 ** rng.uniform(-1, 0.3),
        gap=rng.uniform(-2, 0.5),
    )
    return np.concatenate([motion.ravel(), [(values | given)[name] for name in law.parameters]])


def direction_at(point, size, rng):
    level = np.where(np.arange(len(point)) < size, np.abs(point[:size]).max(), point)
    return rng.uniform(-1, 1, len(point)) * level


def errors_of(law, basis, point, rng, step):
    """Errors of first and second derivatives against differences over a step, and the contact.

    Relative to the largest derivative, beyond the round-off that differences have.
    """
    here = OneContact(law, basis, point)
    direction, weights = direction_at(point, here.size, rng), rng.normal(size=here.size)

    def of(name):
        return lambda point: getattr(OneContact(law, basis, point), name)

    force = difference(of("force"), point, direction, step)
    slope = weights @ difference(of("slope"), point, direction, step)
    level = np.abs(here.slope).max() * np.abs(weights).sum()
    errors = []
    for exact, measured, size in (
        (here.slope @ direction, force, np.abs(here.force).max() + 1e-3),
        (here.bend(weights) @ direction, slope, level),
    ):
        error = np.abs(measured - exact).max() - 2e-15 * size / step
        errors.append(max(error, 0.0) / max(np.abs(exact).max(), 1e-300))
    return errors, here


@pytest.mark.parametrize("harmonics", quick_first([((1,),), ((0, 1, 2),), ((1, 3),)], 2))
@pytest.mark.parametrize("name", LAWS)
def test_derivatives(name, harmonics):
    law, basis, rng = LAWS[name], FourierBasis(harmonics), np.random.default_rng(10)
    found = [errors_of(law, basis, drawn(law, basis, rng), rng, 3e-5) for _ in range(40)]
    errors = np.array([errors for errors, _ in found])
    assert (np.median(errors, axis=0) < 1e-9).all()
    assert (errors.max(axis=0) < [1e-9, 1e-5]).all()
    states = {here.figures["contact_state"] for _, here in found}
    assert states >= STATES[name]
    if name == "varying":
        pieces = {int(kind) for _, here in found for kind in here.located.details.pieces[0, :, 0]}
        assert pieces == {*range(6)}


ONSETS = [
    ("coulomb", 0), ("varying", 0), ("varying", 1), ("varying, gap", 2), ("stop", 0), ("planar", 0),
    ("pressed", 0), ("pressed", 1), ("pressed, gap", 0), ("pressed, gap", 2),
]  # fmt: skip


def onset(law, basis, point, switch):
    """The point with its motion scaled to where a margin passes zero, None where it does not."""
    size = basis.n_components * len(law.directions)

    def at(scale):
        return np.concatenate([scale * point[:size], point[size:]])

    def beyond(scale):
        return OneContact(law, basis, at(scale)).margins[switch] > 0

    scales = np.geomspace(1e-3, 1e3, 31)
    positive = np.array([beyond(scale) for scale in scales])
    change = np.flatnonzero(positive[1:] != positive[:-1])
    if not change.size:
        return None
    low, high = scales[change[0]], scales[change[0] + 1]
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if beyond(middle) == positive[change[0]] else (low, middle)
    return at(low)


@pytest.mark.parametrize("distance", quick_first([1e-1, -1e-1, 1e-3, -1e-3, 1e-6, -1e-6], 3))
@pytest.mark.parametrize(("name", "switch"), ONSETS)
def test_derivatives_beside_onsets(name, switch, distance):
    law, basis, rng = LAWS[name], FourierBasis((0, 1, 2)), np.random.default_rng(3)
    near, planar = abs(distance) < 1e-5, "across" in law.directions
    errors = []
    while len(errors) < 4:
        gap = 0.5 if switch == 2 or name == "stop" else -1.2
        point = onset(law, basis, drawn(law, basis, rng, normal_load=1.2, gap=gap), switch)
        if point is None:
            continue
        point[: basis.n_components * len(law.directions)] *= 1 + distance
        errors.append(errors_of(law, basis, point, rng, 2e-3 * abs(distance))[0])
    bounds = [1e-5 if near and planar else 1e-7, 1e-5 if near else 1e-7]
    assert (np.max(errors, axis=0) < bounds).all()


def expansion(law, basis, switch, point):
    """A margin and its first and second derivatives by all of the point."""
    n = basis.n_components * len(law.directions)
    values = dict(zip(law.parameters, point[n:, None], strict=True))
    at = Motions(basis, point[None, :n], 1.0, values)
    margin, first, second = law.margin_expansion(at, switch)
    return margin, np.delete(first, n), np.delete(np.delete(second, n, 0), n, 1)


@pytest.mark.parametrize("name", LAWS)
def test_margins_to_second_order(name):
    law, basis, rng = LAWS[name], FourierBasis((0, 1, 2)), np.random.default_rng(6)
    for _ in range(8):
        point = drawn(law, basis, rng)
        here = OneContact(law, basis, point)
        if name != "coulomb":  # by samples
            estimate = law.margins_within(here.at, np.zeros((1, len(here.margins))))[0]
            np.testing.assert_allclose(estimate, here.margins, rtol=1e-12, atol=1e-13)
        assert not law.margin_slopes(here.located, 1.0, here.by_name)[0].any()
        for switch, known in enumerate(here.margins):
            margin, first, second = expansion(law, basis, switch, point)
            assert margin == pytest.approx(known, rel=1e-12, abs=1e-13)
            np.testing.assert_allclose(first, here.margin_slope[switch], rtol=0, atol=1e-11)
            direction = direction_at(point, here.size, rng)
            of_switch = partial(expansion, law, basis, switch)
            slope = difference(lambda p, e=of_switch: e(p)[0], point, direction, 1e-5)
            np.testing.assert_allclose(first @ direction, slope, atol=1e-8)
            bend = difference(lambda p, e=of_switch: e(p)[1], point, direction, 2e-6)
            error = (1e-5 if "across" in law.directions else 1e-6) * max(np.abs(bend).max(), 1)
            np.testing.assert_allclose(second @ direction, bend, rtol=0, atol=error)
