"""Contacts one after the other: where they stick within a period, and what force that makes.

The slider is marched over the turning points of the relative displacement ``y``, between which it
is monotone: on such a branch the contact follows its spring until the force is at a limit, and
slips from there to the next turning point. A run is a stretch of stick up to an onset of slip.
Between the points of a path the range of a motion alone gives an estimate of its slip margin.
"""

import math

import numpy as np

from symhbm.model.contacts.motions import SMALLEST_MOTION
from symhbm.numerics import FloatArray, FourierBasis
from symhbm.numerics.loops import Loop, fourier, series

FREE, STICKS, SLIPS = -1, 0, 1
"""What is imposed: of a contact, whether it slips at all, of a branch, whether it does there."""
BEGIN, END, JUMP = range(3)
"""Columns of a run: its ends [rad], and by how much the sign of the limit changes at its end."""
SLIP, MARGIN, THETA_0, THETA_STAR, STICK_FRACTION, REVERSALS = range(6)
"""Columns of ``figures``, see `symhbm.model.contacts.coulomb.state.ContactState`."""


@Loop
def locate(basis, motions, sliders, held, events, margins, gradients, details) -> int:
    """Locate the events of contacts, see `symhbm.model.contacts.motions.EventLoop`.

    ``motions`` (n, K) [m]; ``sliders`` (n, 2), ``k_d`` and ``g``; ``events`` (n, K^2 + K + 1).
    ``details`` are of each contact figures (6), and where stretches of stick begin and end [rad],
    (2, 2 H), NaN behind them. What fails is as of `symhbm.numerics.loops.fourier`.
    """
    order, is_sine, norm = basis
    size, most, mirrors = len(order), 2 * order[len(order) - 1], True
    for i in range(size):
        mirrors = mirrors and order[i] % 2 == 1
    area = size * size
    waves, points = np.empty((2, order[size - 1] + 1)), np.empty((2, most + 1))
    forced, runs = np.empty(most, dtype=np.int64), np.empty((most, 3))
    for j in range(len(motions)):
        figures, stick = details[j, :6], details[j, 6:].reshape((2, most))
        _series(order, is_sine, motions[j], waves)
        angle, value = points[0], points[1]
        status, count, low = fourier.turning_points(waves[0], waves[1], mirrors, angle, value)
        if status != fourier.DONE:
            return status
        stiffness, limit, imposed = sliders[j, 0], sliders[j, 1], held[j]
        spread = value[0] - value[low] if count else 0.0
        margin = _margin(stiffness * spread, 2 * limit)
        slips = margin > 0
        if imposed != FREE and math.isfinite(margin):
            slips = imposed == SLIPS
        figures[SLIP], figures[REVERSALS] = slips, count
        figures[MARGIN] = margins[j, 0] = margin
        figures[STICK_FRACTION] = 0.0 if slips else 1.0
        figures[THETA_0] = angle[0] % (2 * math.pi) if count == 2 else np.nan
        figures[THETA_STAR] = np.nan
        stick[:] = np.nan
        matrix = events[j, :area].reshape((size, size))
        vector = events[j, area : area + size]
        extremes = angle[0], angle[low], spread
        _unless_slipping(order, is_sine, extremes, slips, matrix, vector, gradients[j, 0])
        events[j, area + size] = 0.0
        if not (slips and count):
            continue
        # The last branch ends where the first one begins; where motions mirror the march does.
        angle[count], value[count] = angle[0] + 2 * math.pi, value[0]
        branches = low if mirrors else count
        for k in range(branches):
            forced[k] = FREE
        # Whatever round-off says of the extremes, the force reaches its limits there.
        forced[low - 1] = forced[branches - 1] = SLIPS
        used, _ = runs_of(waves, angle, value, forced[:branches], 1, stiffness, limit, runs)
        add_force(order, is_sine, norm, runs[:used], 2.0 if mirrors else 1.0, matrix, vector)
        if stiffness == 0.0:  # nothing pulls the slider, whatever its limit
            vector[:] = 0.0
        share = 0.0
        for i in range(used):
            share += runs[i, END] - runs[i, BEGIN]
        share /= math.pi if mirrors else 2 * math.pi
        figures[STICK_FRACTION] = events[j, area + size] = share
        if count == 2:
            figures[THETA_STAR] = runs[0, END] % (2 * math.pi)
        if margin <= 0:  # held in slip short of its limit: it never leaves its stretch of stick
            continue
        for i in range(used):
            stick[0, i], stick[1, i] = runs[i, BEGIN], runs[i, END]
            if mirrors:
                stick[0, used + i] = runs[i, BEGIN] + math.pi
                stick[1, used + i] = runs[i, END] + math.pi
    return fourier.DONE


@Loop
def _series(order, is_sine, motion, waves) -> None:
    """Write a motion as a series without its mean, and without the rest where it is too small."""
    fourier.as_series(order, is_sine, motion, waves[0], waves[1])
    waves[0, 0] -= waves[0, 0]  # no number stays none
    bound = 0.0
    for h in range(1, waves.shape[1]):
        bound += h * (abs(waves[0, h]) + abs(waves[1, h]))
    if bound < SMALLEST_MOTION:
        for h in range(1, waves.shape[1]):
            waves[0, h] = waves[1, h] = 0.0


@Loop
def _margin(travel: float, way: float) -> float:
    """``ln(travel / way)``, infinite without a way to go, and where nothing goes it."""
    if way == 0.0:
        return np.inf
    if travel == 0.0:
        return -np.inf
    return math.log(travel) - math.log(way)


@Loop
def _unless_slipping(
    order, is_sine, extremes: tuple[float, float, float], slips: bool, matrix, vector, gradient
) -> None:
    """Write the gradient of the margin, and ``A`` and ``b`` of a contact that sticks, else zeros.

    ``extremes`` are the angles of the maximum and the minimum, and their distance [m]; ``matrix``
    is ``A`` transposed. The undetermined static force of contacts that stick is centred between
    the limits.
    """
    size, (highest, lowest, spread) = len(order), extremes
    for i in range(size):
        for k in range(size):
            matrix[i, k] = 1.0 if i == k and not slips else 0.0
    fourier.functions_at(order, is_sine, highest, 0, vector)
    fourier.functions_at(order, is_sine, lowest, 0, gradient)
    for i in range(size):
        high, low = vector[i], gradient[i]
        if order[0] == 0 and not slips:
            # Of a motion that is none the mean is all.
            matrix[i, 0] -= (high + low) / 2 if spread > 0 or i == 0 else 0.0
        vector[i], gradient[i] = 0.0, (high - low) / spread if spread > 0 else 0.0


@Loop
def runs_of(
    waves, angle, value, forced, side: int, stiffness: float, limit: float, runs
) -> tuple[int, int]:
    """March a slider over as many branches as ``forced`` has.

    Results are the number of ``runs``, and of the turning point up to which the last one slips.
    ``waves`` (2, H + 1) is the series of its motion, ``angle`` and ``value`` (one more than
    branches) its turning points, on the first of which the force is at the limit of sign ``side``.
    ``forced`` tells of each branch what is imposed there.
    """
    start, force, count = 0, side * limit, 0
    for k in range(len(forced)):
        step = stiffness * (value[k + 1] - value[k])
        trial = force + step
        slips = abs(trial) > limit if forced[k] == FREE else forced[k] == SLIPS
        if not slips:
            force = trial
            continue
        goal = 1 if value[k + 1] > value[k] else -1
        change = goal * limit - force
        share = 0.0
        # Where the spring takes the contact no farther than its force changes, that is all the way.
        if change * goal > 0.0 and step != 0.0:
            share = change / step if abs(change) < abs(step) else 1.0
        runs[count, BEGIN], runs[count, JUMP] = angle[start], goal - side
        runs[count, END] = _onset(
            waves, angle[k], angle[k + 1], value[k], value[k + 1], share, goal > 0
        )
        start, force, side, count = k + 1, goal * limit, goal, count + 1
    return count, start


@Loop
def _onset(
    waves, left: float, right: float, low: float, high: float, share: float, rises: bool
) -> float:
    """Where ``y`` has gone a ``share`` of its way between two turning points, of those values."""
    if share <= 0.0 or share >= 1.0:
        return left if share <= 0.0 else right
    way = share * (high - low)
    near = series.gone(waves[0], waves[1], left, way)
    if near > 0.0:
        return min(left + near, right)
    guess = left + (right - left) * (2 / math.pi) * math.asin(math.sqrt(share))
    return series.crossing_near(waves[0], waves[1], low + way, left, right, guess, rises)


@Loop
def add_force(order, is_sine, norm, runs, times: float, matrix, vector) -> None:
    """Add ``A``, to its transposed ``matrix``, and ``b`` of these runs, that many times each."""
    size, n_moments = len(order), 2 * order[len(order) - 1] + 1
    sums, of_run = np.zeros((2, n_moments)), np.empty((2, n_moments))
    row = np.empty(size)
    for k in range(len(runs)):
        fourier.moments(runs[k, BEGIN], runs[k, END], of_run)
        for h in range(n_moments):
            sums[0, h] += times * of_run[0, h]
            sums[1, h] += times * of_run[1, h]
        fourier.functions_at(order, is_sine, runs[k, BEGIN], 0, row)
        for i in range(size):
            share = norm[i] * of_run[1 if is_sine[i] else 0, order[i]]
            for m in range(size):
                matrix[m, i] -= times * share * row[m]
        # The integral of the sign, by parts: functions are integrals of their slopes over -n^2.
        fourier.functions_at(order, is_sine, runs[k, END], 1, row)
        for i in range(size):
            part = -row[i] / (order[i] * order[i]) if order[i] else runs[k, END]
            vector[i] -= times * norm[i] * runs[k, JUMP] * part
    if order[0] == 0:
        vector[0] += times
    fourier.add_products(sums, order, is_sine, norm, matrix)


_SAMPLES = 16
"""Angles per period of the highest harmonic at which the range of a motion is taken."""


def range_margins(basis: FourierBasis, motion: FloatArray, error: FloatArray) -> FloatArray:
    """Logarithm of half the range of each motion (n, K), with an ``error`` (n, 1) [m], (n, 1).

    Samples of it give the range where it has several harmonics.
    """
    margins = np.empty((len(motion), 1))
    motion = np.ascontiguousarray(motion)
    if basis.has_one_harmonic and basis.n_components == 2:
        _of_one_harmonic(motion, error, margins)
    else:
        count = _SAMPLES * basis.highest
        values = basis.values(2 * np.pi * np.arange(count) / count)
        _of_samples(np.ascontiguousarray(values), motion, error, margins)
    return margins


@Loop
def _of_one_harmonic(motion, error, margins) -> None:
    """Write the margins of motions with a cosine and a sine alone."""
    for i in range(len(motion)):
        size = math.sqrt(motion[i, 0] * motion[i, 0] + motion[i, 1] * motion[i, 1]) + error[i, 0]
        margins[i, 0] = math.log(size) if size > 0 else -math.inf


@Loop
def _of_samples(values, motion, error, margins) -> None:
    """Write the margins over samples, from the ``values`` (s, K) of the components at them."""
    for i in range(len(motion)):
        lowest, highest = math.inf, -math.inf
        for h in range(len(values)):
            at = 0.0
            for k in range(values.shape[1]):
                at += values[h, k] * motion[i, k]
            lowest, highest = min(lowest, at), max(highest, at)
        size = (highest - lowest) / 2 + error[i, 0]
        margins[i, 0] = math.log(size) if size > 0 else -math.inf
