"""Maxima followed as parameters move: against closed forms and frequency responses."""

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from studies.closed_form import EXACT_DIGITS, OneBlade
from symhbm.balance.second_order import SecondOrder
from symhbm.peaks.survey import survey
from symhbm.peaks.tracking import branches
from symhbm.peaks.tracking.envelope import UpperEnvelope
from symhbm.peaks.tracking.interpolation import _deviation
from symhbm.peaks.tracking.leading_branches import LeadingBranches
from symhbm.peaks.tracking.step import problems_between, verified
from symhbm.peaks.tracking.track import TrackStatus, retrack, track
from tests.designs import BAND, blade, mistuned

SINGLE = blade()


def exact_peak(load):
    exact = OneBlade(1.0, 0.5, 1e4, 1e4, 0.5 * load, 1.0, 1.0)
    return exact.peak(), exact.largest_contact_force() / 0.5


def with_load(problem, load):
    return problem.with_parameters(normal_load=load)


def followed(start, end, names, maximum, bands=()):
    """The maximum over all parameters between two problems that differ."""
    solved = verified(SecondOrder(start, names), maximum)
    assert solved is not None
    return track(solved, problems_between(start, end, names), bands)


@pytest.mark.parametrize(("first", "last"), [(1.0, 1000.0), (1000.0, 1.0)])
def test_one_blade_through_full_stick(first, last):
    start, end = with_load(SINGLE, first), with_load(SINGLE, last)
    names = ["normal_load"]
    highest = survey(start, [BAND]).maxima[0]
    tracked = followed(start, end, names, highest)
    assert tracked.status == TrackStatus.REACHED_END
    assert tracked.steps[-1][0] == 1
    loads = [first * (last / first) ** s for s, _ in tracked.steps]
    heights = [conditions.maximum.amplitude for _, conditions in tracked.steps]
    np.testing.assert_allclose(heights, [exact_peak(at)[0][0] for at in loads], rtol=EXACT_DIGITS)
    # The only event is full stick, for which there is a closed form.
    (event,) = tracked.events
    assert loads[event] == pytest.approx(exact_peak(1.0)[1], rel=1e-9)


def test_corners_and_changes_of_kind():
    problem, names = mistuned(5, 2), ["normal_load"]
    start, end = with_load(problem, 3.0), with_load(problem, 6.0)
    highest = survey(start, [(5.0, 400.0)]).maxima[0]
    assert highest.kind == "corner"
    at = problems_between(start, end, names)
    tracked = followed(start, end, names, highest)
    assert tracked.events
    assert len({conditions.maximum.kind for _, conditions in tracked.steps}) == 2
    # Each step is a maximum of the frequency response at its parameters.
    events = np.array([tracked.steps[event][0] for event in tracked.events])
    # Close to an event a maximum and a kink of the response need not be resolved.
    clear = [step for step in tracked.steps if np.all(np.abs(step[0] - events) > 0.03)]
    for s, conditions in clear[::3]:
        frequency = conditions.maximum.frequency / (2 * np.pi)
        maxima = survey(at(s), [(0.999 * frequency, 1.001 * frequency)]).maxima
        same_dof = [neighbour for neighbour in maxima if neighbour.dof == conditions.maximum.dof]
        # Both are solved for; a smooth maximum or a corner determines the height well.
        assert min(
            abs(neighbour.amplitude / conditions.maximum.amplitude - 1) for neighbour in same_dof
        ) == pytest.approx(0, abs=EXACT_DIGITS)


def test_track_ends_at_the_end_of_its_band():
    start, end = with_load(SINGLE, 2.5), with_load(SINGLE, 5.0)
    names, limits = ["normal_load"], (2 * np.pi * 18, 2 * np.pi * 19)
    highest = survey(start, [(18.0, 19.0)]).maxima[0]
    tracked = followed(start, end, names, highest, [limits])
    assert tracked.status == TrackStatus.LEFT_BAND
    load = 2.5 * 2 ** tracked.steps[-1][0]
    assert exact_peak(load)[0][1] == pytest.approx(19, rel=1e-7)


def test_retrack_over_several_parameters():
    names = ["normal_load", "contact_stiffness", "mass"]
    highest = survey(SINGLE, [BAND]).maxima[0]
    start = verified(SecondOrder(SINGLE, names), highest)
    assert start is not None
    target = SINGLE.with_parameters(normal_load=14.0, contact_stiffness=2e4, mass=1.3)
    result = retrack(start, target)
    assert result is not None
    expected = OneBlade(1.3, 0.5, 1e4, 2e4, 0.5 * 14, 1.0, 1.0).peak()[0]
    assert result.maximum.amplitude == pytest.approx(expected, rel=EXACT_DIGITS)
    assert result.maximum.problem is target


def test_parameters_vary_linearly_where_a_value_is_zero():
    start, end = with_load(SINGLE, 0.0), with_load(SINGLE, 4.0)
    assert problems_between(start, end, ["normal_load"])(0.25).parameters["normal_load"] == 1.0
    start = with_load(SINGLE, 1.0)
    assert problems_between(start, end, ["normal_load"])(0.5).parameters["normal_load"] == 2.0


@pytest.mark.parametrize(("first", "last"), [(1.0, 2.0), (2.0, 1.0)])
def test_an_event_is_within_the_interval_that_changes(first, last, monkeypatch):
    # Of two steps at one value the first is before the event, whichever way they go.
    steps = [(0.0, "far before"), (0.5, "before"), (0.5, "behind"), (1.0, "far behind")]
    tracked = SimpleNamespace(steps=steps, events=[1], status=TrackStatus.REACHED_END)
    monkeypatch.setattr(branches, "track", lambda *_: tracked)
    found = branches.FollowedBranches(branches.Parameter(SINGLE, "normal_load", None, 0, 2), [])
    found.follow("far before", first, last)  # type: ignore[arg-type]
    (branch,) = found.branches
    for number, ends in enumerate(pairwise(branch.conditions)):
        before, after = ("before" in str(end) for end in ends)
        assert (branch.event_after(number) is not None) == (before != after)


def test_heights_end_where_the_peak_is_unbounded():
    branch = SimpleNamespace(heights=lambda values: values)
    followed: Any = SimpleNamespace(branches=[branch, branch])
    heights = UpperEnvelope(followed, [(1.0, 3.0)])._heights(np.array([0.5, 1, 2, 3, 4]))
    assert heights.tolist() == 2 * [[0.5, 1, -np.inf, 3, 4]]


@pytest.mark.parametrize(
    ("slope", "through", "reveals"), [(9.0, [], True), (0.0, [], False), (9.0, [0], False)]
)
def test_maxima_that_may_lead_nearby_reveal_a_leader(slope, through, reveals):
    def candidate(height, slope, through):
        return SimpleNamespace(maximum=SimpleNamespace(amplitude=height), slope=slope, on=through)

    leading: Any = SimpleNamespace(parameter=SimpleNamespace(slope=lambda found: found.slope))
    leading.followed = SimpleNamespace(branches_through=lambda found, value: found.on)
    candidates: Any = [candidate(2.0, 0.0, [1]), candidate(1.5, slope, through)]
    values: Any = [SimpleNamespace(value=v, candidates=candidates) for v in (1.0, 1.1, 1.2)]
    assert LeadingBranches._reveals_leader(leading, *values) == reveals


@pytest.mark.parametrize(("power", "deviation"), [(3, 0.0), (4, 1.0)])
def test_points_are_as_dense_as_cubics_are_off_in_the_middle(power, deviation):
    height = np.polynomial.Polynomial([0] * power + [1])
    parameter: Any = SimpleNamespace(coordinate=float)
    parameter.rates = lambda value, _: (height.deriv()(value), height.deriv(2)(value))
    maxima = [SimpleNamespace(amplitude=np.exp(height(value))) for value in (1, 3)]
    ends: Any = [SimpleNamespace(maximum=maximum) for maximum in maxima]
    assert _deviation(parameter, 1.0, 3.0, *ends) == pytest.approx(deviation, abs=1e-12)
