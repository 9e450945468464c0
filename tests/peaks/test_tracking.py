"""Maxima followed as parameters move: against closed forms and frequency responses."""

from typing import Any

import numpy as np
import pytest

import symhbm as sh
from studies.closed_form import EXACT_DIGITS, OneBlade
from symhbm.balance.second_order import SecondOrder
from symhbm.peaks.survey import survey
from symhbm.peaks.tracking.step import between, verified
from symhbm.peaks.tracking.track import TrackStatus, retrack, track

BLADE = dict(mass=1, stiffness=1e4, damping=0.5, friction_coefficient=0.5)
SINGLE = sh.HarmonicBalance(
    sh.single_blade(**BLADE, contact_stiffness=1e4, normal_load=10), sh.PointForce(amplitude=1.0)
)
BAND = (5.0, 40.0)


def exact(load):
    blade = OneBlade(1.0, 0.5, 1e4, 1e4, 0.5 * load, 1.0, 1.0)
    return blade.peak(), blade.largest_contact_force() / 0.5


def loaded(problem, load):
    return problem.with_parameters(normal_load=load)


def mistuned():
    disk = sh.bladed_disk(5, **BLADE, contact_stiffness=1e6, normal_load=10)
    spreads: dict[str, Any] = dict(friction_coefficient=0.4, contact_stiffness=0.2)
    draws = sh.mistuning.uniform(disk, n_samples=1, seed=2013, **spreads)
    problem = sh.HarmonicBalance(disk, sh.EngineOrder(2))
    return problem.with_parameters(**{name: draws[name].values[0] for name in spreads})


@pytest.mark.parametrize(("first", "last"), [(1.0, 1000.0), (1000.0, 1.0)])
def test_one_blade_through_full_stick(first, last):
    start, end = loaded(SINGLE, first), loaded(SINGLE, last)
    names = ["normal_load"]
    top = survey(start, [BAND]).summits[0]
    found = track(SecondOrder(start, names), top, between(start, end, names))
    assert found.status == TrackStatus.REACHED_END
    assert found.end == 1
    loads = [first * (last / first) ** s for s, _ in found.steps]
    heights = [conditions.summit.amplitude for _, conditions in found.steps]
    np.testing.assert_allclose(heights, [exact(at)[0][0] for at in loads], rtol=EXACT_DIGITS)
    # The one event is full stick, which the closed form has too.
    (event,) = found.events
    assert loads[event] == pytest.approx(exact(1.0)[1], rel=1e-9)


def test_corners_and_changes_of_kind():
    problem, names = mistuned(), ["normal_load"]
    start, end = loaded(problem, 3.0), loaded(problem, 6.0)
    second_order = SecondOrder(problem, names)
    top = survey(start, [(5.0, 400.0)]).summits[0]
    assert top.kind == "corner"
    at = between(start, end, names)
    found = track(second_order, top, at)
    assert found.events
    assert len({conditions.summit.kind for _, conditions in found.steps}) == 2
    # Each step is a maximum that the frequency response has there.
    events = np.array([found.steps[event][0] for event in found.events])
    # Close to an event a response has a maximum beside a kink, which need not be told apart.
    clear = [step for step in found.steps if np.all(np.abs(step[0] - events) > 0.03)]
    for s, conditions in clear[::3]:
        frequency = conditions.summit.frequency / (2 * np.pi)
        near = survey(at(s), [(0.999 * frequency, 1.001 * frequency)]).summits
        alike = [other for other in near if other.dof == conditions.summit.dof]
        # Both are solved for; the height is flat or a corner that two curves cross in.
        assert min(
            abs(other.amplitude / conditions.summit.amplitude - 1) for other in alike
        ) == pytest.approx(0, abs=EXACT_DIGITS)


def test_a_band_is_not_left():
    start, end = loaded(SINGLE, 2.5), loaded(SINGLE, 5.0)
    names, limits = ["normal_load"], (2 * np.pi * 18, 2 * np.pi * 19)
    top = survey(start, [(18.0, 19.0)]).summits[0]
    at = between(start, end, names)
    found = track(SecondOrder(start, names), top, at, bands=[limits])
    assert found.status == TrackStatus.LEFT_BAND
    load = 2.5 * 2**found.end
    assert exact(load)[0][1] == pytest.approx(19, rel=1e-7)


def test_many_parameters_at_once():
    names = ["normal_load", "contact_stiffness", "mass"]
    top = survey(SINGLE, [BAND]).summits[0]
    here = verified(SecondOrder(SINGLE, names), top)
    assert here is not None
    target = SINGLE.with_parameters(normal_load=14.0, contact_stiffness=2e4, mass=1.3)
    found = retrack(here.second_order, here, target)
    assert found is not None
    blade = OneBlade(1.3, 0.5, 1e4, 2e4, 0.5 * 14, 1.0, 1.0)
    assert found.summit.amplitude == pytest.approx(blade.peak()[0], rel=EXACT_DIGITS)
    assert found.summit.problem is target


def test_the_way_is_a_line_where_a_value_is_zero():
    start, end = loaded(SINGLE, 0.0), loaded(SINGLE, 4.0)
    assert between(start, end, ["normal_load"])(0.25).parameters["normal_load"] == 1.0
    start = loaded(SINGLE, 1.0)
    assert between(start, end, ["normal_load"])(0.5).parameters["normal_load"] == 2.0
