"""Dry friction over the instants of a period: without truncation for pictures, sampled as a check.

The motion between two events of a contact is a truncated Fourier series; the force follows it
through the spring while the contact sticks, and is on its limit while it slips.

By sampling (alternating frequency and time) the slider is marched over equidistant samples of the
relative displacement ``y``, from each to the next ``f + k_d dy`` clipped to ``+-g``. Each sample is
then on ``+-g`` or sticks since a sample that was, so that the coefficients have the closed form of
`symhbm.model.contacts.coulomb.state` with sums in place of integrals.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.coulomb.state import ContactState
from symhbm.model.contacts.motions import SMALLEST_MOTION, Behaviour, History
from symhbm.numerics import FloatArray, FourierBasis, check


def history_of(
    basis: FourierBasis,
    motion: FloatArray,
    stiffness: float,
    limit: float,
    begin: FloatArray,
    end: FloatArray,
    n_angles: int,
) -> History:
    """Of a motion (n_components,) that sticks from each ``begin`` to each ``end`` [rad]."""
    period = 2 * np.pi
    first = begin[0] if len(begin) else 0.0
    angle = first + period * np.arange(n_angles + 1) / n_angles
    angle = np.sort(np.concatenate([angle, begin, end]))
    y, limits = basis.values(angle) @ motion, np.full(len(angle), limit)
    if not len(begin):
        # A force that never reaches its limit is centred between its extremes.
        force = stiffness * (y - (y.max() + y.min()) / 2) if limit > 0 else np.zeros(len(y))
        state = np.full(len(angle), Behaviour.STICKS if limit > 0 else Behaviour.SLIPS)
        return History(angle, y[None], force[None], limits, state)
    start = basis.values(begin) @ motion
    side = -np.sign(basis.values(begin, 2) @ motion)
    interval = np.searchsorted(begin, angle, side="right") - 1
    # Slip goes on in the direction in which it ends.
    force = np.where(
        angle <= end[interval],
        side[interval] * limit + stiffness * (y - start[interval]),
        limit * np.roll(side, -1)[interval],
    )
    state = np.where(angle < end[interval], Behaviour.STICKS, Behaviour.SLIPS)
    # The last angle is the first of the next period.
    force[-1], state[-1] = force[0], state[0]
    return History(angle, y[None], force[None], limits, state)


def locate_sampled(
    basis: FourierBasis,
    coefficients: FloatArray,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
    slip: NDArray[np.bool_] | None = None,
    *,
    samples: int,
) -> ContactState:
    """Events of friction contacts and their force coefficients by marching over samples.

    Parameters
    ----------
    basis
        The harmonic set.
    coefficients : (n_contacts, n_components)
        Relative displacement [m].
    contact_stiffness : (n_contacts,)
        ``k_d`` [N/m].
    slip_limit : (n_contacts,)
        ``g = mu F_n`` [N].
    slip : (n_contacts,)
        State to impose, as of `symhbm.model.contacts.coulomb.located.locate`; the extremes of ``y``
        are those of its samples.
    samples
        Number of samples per period, at least ``2 highest + 1``. Extremes, reversals, angles and
        the share of stick in the result are those of the samples.

    Raises
    ------
    TypeError, ValueError
        For a number of samples that is no integer or too small for the harmonics.
    FloatingPointError
        For coefficients that are not finite.
    """
    # Coefficients are sums of products of two basis functions, of harmonics up to 2 highest.
    # Harmonic k is summed exactly unless it is a multiple of ``samples``; with fewer, full stick
    # would not give the spring.
    samples = check.integer("samples", samples, minimum=2 * basis.highest + 1)
    if not np.all(np.isfinite(coefficients)):
        raise FloatingPointError("the coefficients of a motion are not finite")
    at_sample, sum_per_integral = _tables(basis, samples)
    step, rows = 2 * np.pi / samples, np.arange(len(coefficients))
    # Without its mean, so that a small motion about a large one keeps its digits.
    motion = _monotone_branches(np.where(basis.order > 0, coefficients, 0.0) @ at_sample.T)
    y_end = np.take_along_axis(motion.value, motion.end, axis=1)
    lowest = np.argmin(y_end, axis=1)
    spread = motion.value[:, 0] - y_end[rows, lowest]
    margin, state = _slip_margins(spread, contact_stiffness, slip_limit, slip)

    n_stick, sign, origin = _march(motion, lowest, contact_stiffness, slip_limit)
    boundary = np.zeros((len(rows), 2 * motion.end.shape[1] + 1))
    boundary[:, 2::2] = motion.end
    boundary[:, 1::2] = boundary[:, 0:-1:2] + n_stick
    # A sample stands for half a step on either side; branches begin after a turning sample.
    angle = (motion.first[:, None] + boundary + 0.5) * step
    moments = basis.moments(angle) * sum_per_integral
    on_interval = basis.integrals(moments)
    run_start = at_sample[(motion.first[:, None] + origin) % samples]
    matrix = basis.products(moments[:, 0::2].sum(axis=1))
    matrix -= np.einsum("cki,ckj->cij", on_interval[:, 0::2], run_start)
    vector = np.einsum("ck,cki->ci", sign, on_interval)

    high = at_sample[motion.first]
    low = at_sample[(motion.first + motion.end[rows, lowest]) % samples]
    moves = motion.reversals > 0
    held = ~state
    matrix[held] = _full_stick(basis, high[held], low[held], moves[held])
    # Without a spring nothing pulls the slider, whatever its limit.
    vector[held | ~moves | (contact_stiffness == 0)] = 0.0

    simple, sticking = motion.reversals == 2, n_stick.sum(axis=1) / samples
    theta_star = (motion.first + n_stick[:, 0] + 1) % samples * step
    theta_0 = np.where(simple, motion.first * step, np.nan)
    theta_star = np.where(simple & state, theta_star, np.nan)
    sticks = np.where(state, sticking, 1.0)
    columns = matrix.transpose(0, 2, 1).reshape(vector.shape[0], vector.shape[1] ** 2)
    return ContactState(
        events=np.column_stack([columns, vector, np.where(state, sticking, 0.0)]),
        slip_margin_gradient=(high - low)
        / np.where(spread > SMALLEST_MOTION, spread, np.inf)[:, None],
        figures=np.array([state, margin, theta_0, theta_star, sticks, motion.reversals], float).T,
        stick=np.empty((len(matrix), 2, 0)),
    )


def _slip_margins(
    spread: FloatArray,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
    slip: NDArray[np.bool_] | None,
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """``ln(k_d spread / (2 g))`` and whether each contact slips, all of shape (n_contacts,).

    ``spread`` is ``y_max - y_min`` [m]; ``slip`` imposes a state where there is a limit to reach.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        slip_margin = np.log(contact_stiffness * spread) - np.log(2 * slip_limit)
    slip_margin[slip_limit == 0] = np.inf
    free = slip_margin > 0
    return slip_margin, free if slip is None else np.where(np.isinf(slip_margin), free, slip)


def _full_stick(
    basis: FourierBasis, high: FloatArray, low: FloatArray, moves: NDArray[np.bool_]
) -> FloatArray:
    """``A`` of contacts that never slip, (n_contacts, n_components, n_components).

    Their undetermined static force is centred between the limits. ``high`` and ``low``
    (n_contacts, n_components) are the basis functions at the maximum and the minimum of ``y``;
    ``moves`` (n_contacts,) tells which contacts have any.
    """
    matrix = np.empty((len(moves), *basis.identity.shape))
    matrix[:] = basis.identity
    if basis.order[0] == 0:
        matrix[:, 0] -= np.where(moves[:, None], (high + low) / 2, basis.identity[0])
    return matrix


@lru_cache(maxsize=64)
def _tables(basis: FourierBasis, samples: int) -> tuple[FloatArray, FloatArray]:
    """Basis functions at the samples, and per moment the ratio of its sum to its integral.

    The sum of ``cos(k tau)`` over the samples of an interval, times the step ``h``, is its integral
    times ``(k h / 2) / sin(k h / 2)``, when the interval begins and ends halfway between samples.
    """
    at_sample = basis.values(np.arange(samples) * (2 * np.pi / samples))
    half = np.arange(2 * basis.highest + 1) * (np.pi / samples)
    ratio = np.append(1.0, half[1:] / np.sin(half[1:]))
    tables = at_sample, np.concatenate([ratio, ratio])
    for table in tables:
        table.setflags(write=False)
    return tables


@dataclass(frozen=True)
class _Branches:
    """Sampled motions from their highest sample, number 0, to the same one a period later.

    ``first`` (n_motions,) is where number 0 stands in the period, ``value`` (n_motions,
    samples + 1) the displacement [m], ``rises`` (n_motions, samples) the direction of the step to
    each next sample. ``end`` (n_motions, n_branches) holds the numbers of the samples that end a
    branch: falling and rising ones alternate, empty ones fill up. ``reversals`` (n_motions,) is
    their number, 0 without motion.
    """

    first: NDArray[np.int_]
    value: FloatArray
    rises: NDArray[np.bool_]
    end: NDArray[np.int_]
    reversals: NDArray[np.int_]


def _monotone_branches(history: FloatArray) -> _Branches:
    samples = history.shape[1]
    first = np.argmax(history, axis=1)
    number = np.arange(samples + 1)
    value = np.take_along_axis(history, (first[:, None] + number) % samples, axis=1)
    change = np.diff(value, axis=1)
    # Equal neighbours go on in the direction of the step before; the highest sample falls.
    last_change = np.maximum.accumulate(np.where(change == 0, 0, number[:-1]), axis=1)
    rises = np.take_along_axis(change, last_change, axis=1) > 0
    turns = rises[:, 1:] != rises[:, :-1]
    n_turns = np.cumsum(turns, axis=1)
    end = np.full((len(first), int(n_turns[:, -1].max(initial=0)) + 1), samples)
    contact, place = np.nonzero(turns)
    end[contact, n_turns[contact, place] - 1] = place + 1
    reversals = np.where(np.any(change != 0, axis=1), n_turns[:, -1] + 1, 0)
    return _Branches(first, value, rises, end, reversals)


def _march(
    motion: _Branches,
    lowest: NDArray[np.intp],
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
) -> tuple[NDArray[np.int_], FloatArray, NDArray[np.int_]]:
    """March the slider once around the period, from the highest sample, where ``f = g``.

    A contact that slips is on ``g`` there, whatever its force a period before. Returns how many
    samples stick on each branch (n_contacts, n_branches), before the others slip; the sign of the
    limit of its sticking and of its slipping samples (n_contacts, 2 n_branches); the number of the
    sample at which its stick run began (n_contacts, n_branches).
    """
    end, samples = motion.end, motion.rises.shape[1]
    n_contacts, n_branches = end.shape
    length = np.diff(end, axis=1, prepend=0)
    start = end - length
    y_start, y_end = (np.take_along_axis(motion.value, i, axis=1) for i in (start, end))
    reaches = (end == samples) & (length > 0)
    reaches[np.arange(n_contacts), lowest] = True
    sign, origin = np.ones(n_contacts), np.zeros(n_contacts, dtype=int)
    force, forces = slip_limit, np.empty(end.shape)
    signs, origins = np.empty((n_contacts, 2 * n_branches)), np.empty(end.shape, dtype=int)
    for k in range(n_branches):
        direction = 1.0 if k % 2 else -1.0
        forces[:, k], signs[:, 2 * k], origins[:, k] = force, sign, origin
        trial = force + contact_stiffness * (y_end[:, k] - y_start[:, k])
        slips = (direction * trial >= slip_limit) | reaches[:, k]
        force = np.where(slips, direction * slip_limit, trial)
        signs[:, 2 * k + 1] = sign = np.where(slips, direction, sign)
        origin = np.where(slips, end[:, k], origin)

    force, y = (
        np.repeat(at_start.ravel(), length.ravel()).reshape(n_contacts, samples)
        for at_start in (forces, y_start)
    )
    trial = force + contact_stiffness[:, None] * (motion.value[:, 1:] - y)
    sticks = np.where(motion.rises, trial, -trial) < slip_limit[:, None]
    total = np.pad(np.cumsum(sticks, axis=1), ((0, 0), (1, 0)))
    n_stick = np.take_along_axis(total, end, axis=1) - np.take_along_axis(total, start, axis=1)
    return np.where(reaches, np.minimum(n_stick, length - 1), n_stick), signs, origins
