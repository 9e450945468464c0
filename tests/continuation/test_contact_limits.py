"""Limits of several contacts at one point of a path: which of them begin or end to slip there."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import symhbm as sh
from symhbm.continuation.events import brief_crossing
from symhbm.continuation.events.contact_limits import _first_limit
from tests.designs import ring


def test_of_contacts_that_reach_their_limits_together_one_may_relieve_the_other():
    """All stuck, the contacts of a tuned ring move alike; once one slips, its neighbour does not.

    With a third contact of another load the ring is not symmetric beyond.
    """
    problem = ring(3, 1e4, 1, normal_load=[5, 5, 6])
    up, down = (sh.frf(problem, band, throw=True) for band in [(10, 40), (40, 10)])
    told = [*zip(up.event_kind.values, up.event_contact.values, strict=True)]
    begins, ends = "onset of slip", "end of slip"
    assert told == [(begins, 0), (begins, 2), (begins, 1), (ends, 2), (ends, 0), (ends, 1)]
    np.testing.assert_allclose(up.event_frequency, down.event_frequency[::-1], rtol=1e-9)
    np.testing.assert_allclose(up.peak_frequency, down.peak_frequency, rtol=1e-9)
    # What `solve` finds without a path slips between the same events.
    edges = [10, *up.event_frequency.values, 40]
    slips = [(), (0,), (0, 2), (0, 1, 2), (0, 1), (1,), ()]
    for low, high, of_contacts in zip(edges[:-1], edges[1:], slips, strict=True):
        at = sh.solve(problem, (low + high) / 2, throw=True)
        assert tuple(np.flatnonzero(at.contact_state == 1)) == of_contacts


@pytest.mark.parametrize("least", [1e-3, -1e-4])
def test_what_is_solved_for_within_a_step_tells_of_all_contacts(least):
    """Five margins that come back short of their limits, or one that passes it, at one point."""
    offsets, asked = least * np.array([2, 1.5, 1.2, 1.1, 1.0]), []
    offsets[:-1] = np.abs(offsets[:-1])

    def at(value):
        margins = -offsets - 4 * (value - 0.5) ** 2 * (1 + value)
        rates = np.full(5, -8 * (value - 0.5) * (1 + value) - 4 * (value - 0.5) ** 2)
        point, direction = np.array([0.0, value]), np.array([0.0, 1.0])
        return SimpleNamespace(point=point, direction=direction, margins=margins, rate=rates)

    def correct(guess, plane, switches):
        asked.append(float(guess[-1]))
        return at(guess[-1])

    states, begin = np.zeros(5, dtype=bool), at(0.0)
    base: Any = SimpleNamespace(state=begin.point, after=begin.direction, switches=states)
    base.scale = np.ones(2)
    base.margins, base.rate = begin.margins, begin.rate
    corrector: Any = SimpleNamespace(correct=correct)
    found = brief_crossing(corrector, base, at(1.0))  # type: ignore[arg-type]
    assert (found is None) == (least > 0)
    if found is not None:
        assert found.margins[-1] > 0
    # One after the other, each of the five would ask for it.
    assert asked == [0.5]


def test_first_limit_of_a_cubic_step_is_where_it_says():
    end = np.array([2.0, 1.0]) / np.sqrt(5)  # along the path (t^2, t) with the margin t^3 - 0.3
    stuck, rates = np.zeros(1, dtype=bool), (np.zeros(1), 3 * end[1:])
    base = np.zeros(2), np.array([0.0, 1.0]), stuck, np.array([-0.3]), rates[0]
    normal, guess = np.empty((2, 2))
    ahead = np.ones(2), end, np.array([0.7]), rates[1]
    assert _first_limit(base, ahead, np.ones(2), False, normal, guess) == (0, 1.0)
    np.testing.assert_allclose(guess, [0.3 ** (2 / 3), 0.3 ** (1 / 3)], rtol=1e-8)
