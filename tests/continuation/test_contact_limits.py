"""Limits of several contacts at one point of a path: which of them begin or end to slip there."""

import numpy as np

import symhbm as sh
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
