"""Loops between two points of a path against formulas on whole arrays, compiled and as Python."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from symhbm.continuation.between import doubts
from symhbm.continuation.between import slopes as slopes_of_path
from symhbm.continuation.between.segments import OF_SLOPE, Segments, write_errors
from symhbm.continuation.between.slopes import FLAT_SLOPE, TIE, _of_one_harmonic
from symhbm.continuation.point import Event, PathPoint
from symhbm.continuation.segment import PathState, _measure, measure
from symhbm.numerics.loops.interpolation import amplitude_between, cubic_slope

SEEDS = st.integers(0, 2**32 - 1)
FEW = settings(max_examples=40)


def plain(loop):
    """The same lines run by Python."""
    return loop.__wrapped__


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def ahead_of(direction, normal, scale):
    return np.maximum((normal * direction / scale).sum(axis=-1, keepdims=True), 1e-3)


def four_solutions(rng, n=5, size=5):
    """Solutions beside and at the ends of segments; some are missing, some tangents turn back."""
    scale = 10 ** rng.uniform(-3, 2, (n, size))
    first = rng.normal(size=(n, size))
    states = [scale * (first * k + 0.2 * rng.normal(size=(n, size))) for k in range(4)]
    directions = [scale * (first + 0.5 * rng.normal(size=(n, size))) for _ in range(4)]
    directions[1][rng.random(n) < 0.3] *= -1
    for k in (0, 3):
        missing = rng.random(n) < 0.3
        states[k][missing] = directions[k][missing] = np.nan
    return tuple(states), tuple(directions), scale


@FEW
@given(seed=SEEDS, single_valued=st.booleans())
def test_normals_and_lengths(seed, single_valued):
    states, directions, scale = four_solutions(np.random.default_rng(seed))
    left, right = (PathState(states[k], directions[k]) for k in (1, 2))
    first, last = (unit(at.direction / scale) for at in (left, right))
    chord = (right.state - left.state) / scale
    opposite = np.linalg.norm(first + last, axis=1, keepdims=True) < 1
    normal = unit(np.where(opposite, first, first + last))
    length = (normal * chord).sum(axis=1, keepdims=True)
    if single_valued:
        sharp = opposite | (length < np.linalg.norm(chord, axis=1, keepdims=True) / 2)
        heading = np.sign(left.direction[:, -1:])
        normal = np.where(sharp, heading * np.eye(len(scale[0]))[-1], normal)
        length = np.where(sharp, heading * chord[:, -1:], length)
    slopes = [length * at.direction / ahead_of(at.direction, normal, scale) for at in (left, right)]
    expected = normal, length, *slopes
    found = measure(single_valued, left, right, scale)
    by_python = [np.empty(array.shape) for array in found]
    given = left.state, left.direction, right.state, right.direction
    plain(_measure)(single_valued, *given, scale, *by_python)
    alone = measure(single_valued, left[0], right[0], scale[0])
    for k, reference in enumerate(expected):
        np.testing.assert_allclose(found[k], reference, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(by_python[k], reference, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(alone[k], reference[0], rtol=1e-9, atol=1e-12)


def extrapolated(states, directions, values, rates, normal, length, scale):
    """Larger error of the slopes that both neighbours predict, or that without a neighbour."""
    errors = []
    for side, order in ((1, (0, 1, 2)), (-1, (3, 2, 1))):
        beside, near, _ = order
        distance = side * (normal * (states[near] - states[beside]) / scale).sum(1, keepdims=True)
        tangent = directions[beside] / scale
        valid = (normal * tangent).sum(1, keepdims=True) > 0.3 * np.linalg.norm(
            tangent, axis=1, keepdims=True
        )
        distance = np.where(valid & (distance > 0), distance, np.nan)
        slopes = [side * rates[k] / ahead_of(directions[k], normal, scale) for k in order]
        tangents = distance * slopes[0], distance * slopes[1]
        at = 1 + length / distance
        expected = cubic_slope(values[beside], values[near], tangents, at) / distance
        reach = length**2 / ((length + distance) * (2 * length + distance))
        errors.append(np.abs(reach * (slopes[2] - expected)))
    ends = [rates[k] / ahead_of(directions[k], normal, scale) for k in (1, 2)]
    alone = 1.5 * ((values[2] - values[1]) / length - (ends[0] + ends[1]) / 2)
    largest = np.fmax(*errors)
    return np.where(np.isnan(largest), 0.5 / OF_SLOPE * np.abs(alone), largest)


@FEW
@given(seed=SEEDS)
def test_errors_of_interpolation(seed):
    rng = np.random.default_rng(seed)
    states, directions, scale = four_solutions(rng)
    ends = (PathState(states[k], directions[k]) for k in (1, 2))
    measured = measure(False, *ends, scale)
    metric = measured.normal, measured.length, scale
    own = [tuple(np.ascontiguousarray(a[:, :-1]) for a in each) for each in (states, directions)]
    for each in (own, [tuple(rng.normal(size=(5, 3)) for _ in range(4)) for _ in range(2)]):
        expected = extrapolated(states, directions, *each, *metric)
        for loop in (write_errors, plain(write_errors)):
            error = np.empty(expected.shape)
            loop(np.array([*states, *directions]), np.array([*each[0], *each[1]]), *metric, error)
            np.testing.assert_allclose(error, expected, rtol=1e-8, atol=1e-14)


@FEW
@given(seed=SEEDS)
def test_amplitudes_of_one_harmonic(seed):
    rng = np.random.default_rng(seed)
    motions, rates = rng.normal(size=(2, 7, 2))
    motions[0] = 0.0
    size = np.hypot(*motions.T)
    slopes = (motions * rates).sum(axis=1) / np.where(size > 0, size, 1.0)
    for loop in (_of_one_harmonic, plain(_of_one_harmonic)):
        amplitude, slope = np.empty((2, 7))
        loop(motions, rates, amplitude, slope)
        np.testing.assert_allclose(amplitude, size, rtol=1e-14)
        np.testing.assert_allclose(slope, slopes, rtol=1e-12, atol=1e-15)


def judged(ends, amplitudes, slopes, inside, error, length, switch_events, per_dof):
    """Which amplitudes turn, and of which that is in doubt."""
    levels = np.concatenate([ends[0][:, None], amplitudes, ends[1][:, None]], axis=1)
    reserve = np.zeros(levels.shape)
    reserve[:, 1:-1] = (error * length)[:, None]
    leads = np.any(levels + reserve >= 0.95 * levels.max(axis=2, keepdims=True), axis=1) | per_dof
    for i, j in np.argwhere(leads):
        first = int(np.argmax(leads[i]))
        tied = [abs(e[i, j] - e[i, first]) <= TIE * e[i].max() for e in ends]
        leads[i, j] &= j == first or not all(tied)
    first, last, largest = slopes[:, 0], slopes[:, -1], np.abs(slopes).max(axis=1)
    constant = FLAT_SLOPE * np.maximum(*ends)
    signed = np.where((first > 0)[:, None], slopes, -slopes)
    share = np.linspace(0, 1, slopes.shape[1])[:, None]
    margin = 4 * share * (1 - share) * error[:, None]
    negative, positive = signed < margin, signed > -margin
    changes = (first > 0) != (last > 0)
    span = slopes.shape[1] - 1 - np.argmax(positive[:, ::-1], axis=1) - np.argmax(negative, axis=1)
    doubtful = np.where(changes, span > 4, negative[:, 1:-1].any(axis=1))
    near = np.where(switch_events[..., None], signed[:, [0, -1]], np.inf).min(axis=1)
    doubtful |= ~changes & (near < 0.1 * largest)
    of_states = np.concatenate([slopes[:, :1], inside, slopes[:, -1:]], axis=1)
    for each in (slopes, of_states):
        doubtful |= np.count_nonzero(np.diff(each > 0, axis=1), axis=1) > changes
    leads &= largest > constant
    return leads & (first > constant) & (last <= constant), leads & doubtful


@FEW
@given(seed=SEEDS, per_dof=st.booleans())
def test_what_turns_and_what_is_in_doubt(seed, per_dof):
    rng = np.random.default_rng(seed)
    n, n_dof = 6, 3
    amplitudes = 1 + 0.1 * rng.random((n, 15, n_dof))
    ends = tuple(1 + 0.1 * rng.random((2, n, n_dof)))
    for end in ends:
        end[:2, 2] = end[:2, 1]
    share = np.linspace(0, 1, 17)[:, None]
    begin, slant, wave = rng.normal(size=(3, n, 1, n_dof)) * [[[[1]]], [[[3]]], [[[0.3]]]]
    slopes = begin + slant * share + wave * np.sin(9 * share)
    slopes[rng.random(n) < 0.2] = 0.0
    error = 10 ** rng.uniform(-3, 0.5, (n, n_dof))
    length, switch_events = 0.1 * rng.random((n, 1)), rng.random((n, 2)) < 0.3
    inside = slopes[:, 1:-1] + 0.1 * rng.normal(size=(n, 15, n_dof))
    case = ends, amplitudes, slopes, inside, error, length, switch_events, per_dof
    expected = judged(*case)
    for loop in (slopes_of_path._judge, plain(slopes_of_path._judge)):
        turns, is_doubtful = np.empty((2, n, n_dof), dtype=bool)
        loop(*case, turns, is_doubtful)
        np.testing.assert_array_equal(turns, expected[0])
        np.testing.assert_array_equal(is_doubtful, expected[1])


@FEW
@given(seed=SEEDS)
def test_slopes_next_to_a_slip_event(seed):
    """With ends and mean: ``a + c t + d t^2``, its integral over the distance is the rise."""
    rng = np.random.default_rng(seed)
    scale, normal = np.ones((4, 3)), np.tile([0.0, 0.0, 1.0], (4, 1))
    tangents = tuple(rng.uniform(0.2, 1.0, (2, 4, 3)))
    ends, end_slopes = tuple(rng.random((2, 4, 2))), tuple(rng.normal(size=(2, 4, 2)))
    length, inside = rng.uniform(0.5, 2, (4, 1)), rng.normal(size=(4, 15, 2))
    switch_events = np.array([[False, False], [True, True], [True, False], [False, True]])
    for loop in (slopes_of_path._write_slopes, plain(slopes_of_path._write_slopes)):
        slopes = np.empty((4, 17, 2))
        loop(ends, end_slopes, tangents, normal, length, scale, inside, switch_events, slopes)
        for k, end in ((0, 0), (1, -1)):
            expected = end_slopes[k] / tangents[k][:, 2:]
            np.testing.assert_allclose(slopes[:, end], expected, rtol=1e-12)
        np.testing.assert_allclose(slopes[:2, 1:-1], inside[:2] / length[:2, None], rtol=1e-12)
        root = np.linspace(0, 1, 17)
        for i in (2, 3):
            along = slopes[i] if i == 2 else slopes[i, ::-1]
            fit = np.polyfit(root, along, 2)
            np.testing.assert_allclose(
                np.array([np.polyval(c, root) for c in fit.T]).T, along, atol=1e-9
            )
            # The distance is the root squared.
            mean = fit[2] + 2 / 3 * fit[1] + fit[0] / 2
            np.testing.assert_allclose(mean, (ends[1] - ends[0])[i] / length[i], atol=1e-9)


@FEW
@given(seed=SEEDS)
def test_where_a_margin_is_the_farthest_beyond(seed):
    rng = np.random.default_rng(seed)
    n, switches = 6, 3
    within = rng.normal(size=(n, 15, switches)) - 1.5
    first, last = 0.1 * rng.normal(size=(2, n, switches))
    first[0, 0], last[1, 1] = -np.inf, np.nan
    begin, width, held = rng.random(n), rng.random(n), rng.random((n, switches)) < 0.2
    at = begin[:, None] + width[:, None] * np.arange(1, 16) / 16
    with np.errstate(invalid="ignore"):
        margins = within - first[:, None] - at[..., None] * (last - first)[:, None]
    outward = np.where(held, -1.0, 1.0)[:, None] * margins
    outward = np.where(np.isfinite(first + last)[:, None], outward, -np.inf).max(axis=2)
    expected = np.where(outward.max(axis=1) > 1e-11, (outward.argmax(axis=1) + 1) / 16, 0.0)
    for loop in (doubts._most_beyond, plain(doubts._most_beyond)):
        shares = np.zeros(n)
        loop(within, first, last, begin, width, held, shares)
        np.testing.assert_array_equal(shares, expected)


@FEW
@given(seed=SEEDS, per_dof=st.booleans())
def test_where_a_drawn_amplitude_is_the_farthest_off(seed, per_dof):
    rng = np.random.default_rng(seed)
    n, n_dof = 5, 2
    sides = [
        (rng.normal(size=(n, 3)) + 4 * k, *rng.uniform(0.1, 1, (2, n, 3)), rng.normal(size=(n, 3)))
        for k in range(2)
    ]
    sides = [(s, d, a[:, :n_dof].copy(), r[:, :n_dof].copy()) for s, d, a, r in sides]
    folds = rng.random((n, 2)) < 0.2
    states = sides[0][0][:, None] + rng.random((n, 3, 3)) * 4
    expected = rng.uniform(0.1, 1, (n, 3, n_dof))
    if rng.random() < 0.3:
        expected[:] = sides[0][2][:, None]
    begin, width = sides[0][0][:, -1:], sides[1][0][:, -1:] - sides[0][0][:, -1:]
    slopes = tuple(
        np.where(folds[:, k : k + 1], np.inf, width * side[3] / side[1][:, -1:])[:, None]
        for k, side in enumerate(sides)
    )
    share = np.clip((states[..., -1] - begin) / width, 0, 1)[..., None]
    drawn = amplitude_between(*(side[2][:, None] for side in sides), slopes, share)
    top = expected.max(axis=2)
    error = np.abs(drawn.max(axis=2) - top) / (0.005 * top)
    if per_dof:
        reference = 0.01 * np.maximum(expected, 1e-3 * top[..., None])
        error = np.maximum(error, (np.abs(drawn - expected) / reference).max(axis=2))
    at = np.where(error.max(axis=1) > 1, np.array([0.25, 0.5, 0.75])[error.argmax(axis=1)], 0.0)
    loop = doubts._largest_error
    for kind in (loop, plain(loop)):
        largest, shares = np.zeros((2, n))
        kind(*sides, folds, states, expected, per_dof, largest, shares)
        np.testing.assert_allclose(largest, error.max(axis=1), rtol=1e-9)
        assert shares.tolist() == pytest.approx(at.tolist())


def point_of(k, *events):
    """Point number ``k`` of a path along a line, with events there."""
    state, ahead, one = np.array([0.0, k]), np.array([0.0, 1.0]), np.ones(1)
    return PathPoint(
        state, np.ones(2), ahead, ahead, one > 0, one, one, 0.0, 1.0, None, 1, events=events
    )


def test_ends_of_segments_where_slip_begins_and_ends():
    """A segment knows the onset before it and the end of slip after it, and no others."""
    onset, end, other = Event("slip", 0, True), Event("stick", 0, False), Event("branch point")
    path = [point_of(0), point_of(1, onset), point_of(2, other), point_of(3, end), point_of(4)]
    found = Segments.of(path).switch_events.tolist()
    assert found == [[False, False], [True, False], [False, True], [False, False]]
