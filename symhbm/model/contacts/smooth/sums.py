"""Fourier coefficients of a force by sums over a period, with their derivatives and their error.

Equidistant samples of a smooth force converge faster than any power of their number: it is doubled
until the coefficients stop moving. Where the slope of the force jumps, sums over the whole period
converge slowly: the break points cut it, and each piece has nodes of Gauss and Legendre.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from symhbm.model.contacts.motions import Events
from symhbm.model.contacts.smooth.breaks import Angles, Breaks, Motion, find_breaks
from symhbm.model.contacts.smooth.expression import Force
from symhbm.numerics import FloatArray, FourierBasis

TOLERANCE = 1e-12
"""Change of coefficients over the mean size of the force at which sums have converged."""
MOST_SAMPLES = 2**14
"""Samples of a period at most."""
_MANY = 512
"""Samples from which a sum that still moves by a `_ROUGH` share of the force has no limit."""
_ROUGH = 0.05
_FIRST_NODES = 8
"""Nodes of a piece to begin with."""
_MOST_NODES = 512
"""Nodes of a piece at most."""
_JUMP = 1e-6
"""Share of a force by which it may differ on both sides of a break point."""
_BESIDE = 1e-12
"""Distance of both sides from a break point [rad]."""
_GRAZING = 1e-9
"""Rate of a break function over its largest, below which a break has no second derivative."""
_TOGETHER = 32
"""Motions whose sums are formed at once: bounded memory."""


@dataclass(frozen=True)
class Details:
    """How the forces of ``n`` motions were summed.

    ``error`` (n, m K) [N] bounds that of their coefficients, ``count`` (n,) are the samples of a
    period, or of each piece between ``breaks``.
    """

    error: FloatArray
    count: np.ndarray
    breaks: list[Breaks]

    def split(self, count: int) -> list["Details"]:
        """Those of as many points."""
        size = len(self.breaks) // count
        parts = [self.breaks[i * size : (i + 1) * size] for i in range(count)]
        each = zip(np.split(self.error, count), np.split(self.count, count), parts, strict=True)
        return [Details(*part) for part in each]


@dataclass(frozen=True)
class Nodes(Angles):
    """Angles of motions whose periods have as many pieces, with their weights (n or 1, N).

    ``ends`` (2, N / pieces) extrapolate values at the nodes of a piece to its left and right end.
    """

    weight: FloatArray
    pieces: int
    ends: FloatArray

    @cached_property
    def analysis(self) -> FloatArray:
        """What makes coefficients of values, (n or 1, K, N)."""
        return np.swapaxes(self.weight[:, :, None] * self.functions * self.basis.norm, 1, 2)


def nodes_of(basis: FourierBasis, breaks: Sequence[Breaks], count: int) -> Nodes:
    """``count`` equidistant samples, or nodes of Gauss of each piece."""
    pieces = len(breaks[0].angle)
    if not pieces:
        return _equidistant(basis, count)
    place, weight, ends = _gauss(count)
    left = np.array([each.angle for each in breaks])
    width = np.diff(left, append=left[:, :1] + 2 * np.pi)
    tau = left[:, :, None] + width[:, :, None] * place
    weights = (width[:, :, None] * weight).reshape(len(left), -1)
    return Nodes(basis, tau.reshape(len(left), -1), weights, pieces, ends)


@lru_cache(maxsize=16)
def _equidistant(basis: FourierBasis, count: int) -> Nodes:
    tau = 2 * np.pi * np.arange(count) / count
    return Nodes(basis, tau[None], np.full((1, count), 2 * np.pi / count), 0, np.zeros((2, 0)))


@lru_cache(maxsize=16)
def _gauss(count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Nodes and weights on [0, 1], and the rows that extrapolate to 0 and 1.

    They are those of Gauss in ``s``, with the place ``s^2 (3 - 2 s)``: a force that begins with the
    root of the distance from its break point, or a power of it, is then smooth.
    """
    nodes, weights = np.polynomial.legendre.leggauss(count)
    degree, s = np.arange(count), (nodes + 1) / 2
    polynomials = np.polynomial.legendre.legvander(nodes, count - 1) * (degree + 0.5)
    ends = np.array([(-1.0) ** degree, np.ones(count)]) @ polynomials.T * weights
    return s**2 * (3 - 2 * s), 3 * s * (1 - s) * weights, ends


def coefficients(
    force: Force, basis: FourierBasis, motion: Motion
) -> tuple[FloatArray, FloatArray, Details]:
    """Coefficients (n, m K) [N] of forces, their derivatives (n, m K, v), and how they were summed.

    Derivatives are by motion (m K), frequency and parameters. NaN where the force is no number, has
    no slope, or jumps at a break point.
    """
    n, size, n_variables = len(motion), motion.coefficients.shape[1], motion.n_variables
    value, error = np.zeros((2, n, size))
    slope, mean, count = np.zeros((n, size, n_variables)), np.zeros(n), np.zeros(n, dtype=int)
    breaks = find_breaks(force, basis, motion)
    for own in _alike([len(each.angle) for each in breaks]):
        cut = [breaks[i] for i in own]
        value[own], error[own], mean[own], count[own] = _doubled(force, basis, motion.of(own), cut)
        for number in np.unique(count[own]).tolist():
            same = own[count[own] == number]
            nodes = nodes_of(basis, [breaks[i] for i in same], number)
            slope[same] = _slopes(force, motion.of(same), nodes)
    bad = ~(np.isfinite(value).all(axis=1) & np.isfinite(slope).all(axis=(1, 2)))
    jump = [_jump(force, basis, motion.of([j]), each) for j, each in enumerate(breaks)]
    bad |= np.array(jump) > _JUMP * mean
    value[bad], slope[bad] = np.nan, np.nan
    return value, slope, Details(error, count, breaks)


def _jump(force: Force, basis: FourierBasis, motion: Motion, breaks: Breaks) -> float:
    """Largest difference of the force on both sides of a break point [N]."""
    if not len(breaks.angle):
        return 0.0
    beside = (breaks.angle + _BESIDE * np.array([[-1], [1]])).reshape(1, -1)
    before, after = np.split(force.force(motion.arguments(Angles(basis, beside)))[0], 2)
    return float(np.abs(after - before).max())


def _alike(numbers: list[int]) -> list[np.ndarray]:
    """Positions of equal numbers, few together."""
    array, result = np.array(numbers), []
    for number in np.unique(array):
        where = np.flatnonzero(array == number)
        result += [where[i : i + _TOGETHER] for i in range(0, len(where), _TOGETHER)]
    return result


def _doubled(
    force: Force, basis: FourierBasis, motion: Motion, breaks: list[Breaks]
) -> tuple[FloatArray, FloatArray, FloatArray, np.ndarray]:
    """Coefficients, how far the last doubling moved them, mean forces, and samples or nodes.

    Of as many motions; ``breaks`` are as many of each.
    """
    n, pieces = len(motion), len(breaks[0].angle)
    number = _FIRST_NODES if pieces else 1 << (2 * basis.highest + 1).bit_length()
    most = min(_MOST_NODES, MOST_SAMPLES // pieces) if pieces else MOST_SAMPLES
    value, error = (np.zeros(motion.coefficients.shape) for _ in range(2))
    mean, count, left = np.zeros(n), np.zeros(n, dtype=int), np.arange(n)
    before = _summed(force, motion, nodes_of(basis, breaks, number))[0]
    while len(left):
        number *= 2
        nodes = nodes_of(basis, [breaks[i] for i in left], number)
        now, size = _summed(force, motion.of(left), nodes)
        change = np.abs(now - before)
        moved = change.max(axis=1)
        if number * max(pieces, 1) >= max(_MANY, 64 * basis.highest):
            now[moved > _ROUGH * size] = np.nan
        done = (moved <= TOLERANCE * size) | ~np.isfinite(now).all(axis=1) | (2 * number > most)
        settled = left[done]
        value[settled], error[settled] = now[done], change[done]
        mean[settled], count[settled] = size[done], number
        left, before = left[~done], now[~done]
    return value, error, mean, count


def _summed(force: Force, motion: Motion, nodes: Nodes) -> tuple[FloatArray, FloatArray]:
    """Coefficients (n, m K) [N] and the mean size (n,) of the force."""
    values = force.force(motion.arguments(nodes))
    result = np.swapaxes(nodes.analysis @ values, 1, 2)
    size = (nodes.weight[:, :, None] * np.abs(values)).sum(axis=(1, 2)) / (2 * np.pi)
    return result.reshape(len(result), -1), size


def _at_ends(values: FloatArray, nodes: Nodes) -> FloatArray:
    """Values (n, N, ...) at the nodes of pieces extrapolated to their ends, (2, n, pieces, ...)."""
    by_piece = values.reshape(len(values), nodes.pieces, -1, *values.shape[2:])
    return np.tensordot(nodes.ends, by_piece, axes=(1, 2))


def _slopes(force: Force, motion: Motion, nodes: Nodes) -> FloatArray:
    """Derivatives (n, m K, v) of coefficients at fixed break points, which do not count."""
    _, slope = force.slopes(motion.arguments(nodes))
    analysis, velocity = nodes.analysis, motion.rates(nodes)
    m, omega = force.sizes.directions, motion.frequency[:, None, None]
    rows = []
    for i in range(m):
        by_motion = [
            slope[:, :, i, j, None] * nodes.functions
            + omega * slope[:, :, i, m + j, None] * nodes.rates
            for j in range(m)
        ]
        by_frequency = (slope[:, :, i, m : 2 * m] * velocity[:, :, :m]).sum(axis=-1)[..., None]
        parts = [*by_motion, by_frequency, slope[:, :, i, 2 * m :]]
        rows.append(np.concatenate([analysis @ part for part in parts], axis=-1))
    return np.concatenate(rows, axis=1)


def damping(force: Force, basis: FourierBasis, motion: Motion, details: Details) -> FloatArray:
    """Coefficients of the force by those of a velocity beside the motion, (n, m K, m K) [N s/m]."""
    n, size = motion.coefficients.shape
    m, result = force.sizes.directions, np.zeros((n, size, size))
    for i in range(n):
        nodes, part = nodes_of(basis, details.breaks[i : i + 1], details.count[i]), motion.of([i])
        _, slope = force.slopes(part.arguments(nodes))
        functions, analysis = nodes.functions[0], nodes.analysis[0]
        blocks = [
            [analysis @ (slope[0, :, i, m + j, None] * functions) for j in range(m)]
            for i in range(m)
        ]
        result[i] = np.block(blocks)
    return result


def bends(
    force: Force, basis: FourierBasis, motion: Motion, details: Details, weights: FloatArray
) -> FloatArray:
    """Second derivatives (n, v, v) of coefficients times ``weights`` (n, m K) at fixed breaks."""
    m, result = force.sizes.directions, np.zeros((len(motion), *[motion.n_variables] * 2))
    for j, own in enumerate(details.breaks):
        part, nodes = motion.of([j]), nodes_of(basis, [own], details.count[j])
        arguments = part.arguments(nodes)[0]
        by_variables = part.by_variables(nodes)[0]
        test = (nodes.functions[0] * basis.norm) @ weights[j].reshape(m, -1).T
        weighted = nodes.weight[0][:, None] * test
        second = force.bends(arguments, weighted)
        result[j] = np.einsum("nai,nab,nbj->ij", by_variables, second, by_variables, optimize=True)
        _, slope = force.slopes(arguments)
        # A velocity is the frequency times a slope: one more derivative by both.
        by_velocity = np.einsum("ni,nia->na", weighted, slope[:, :, m : 2 * m])
        mixed = np.einsum("na,nak->ak", by_velocity, np.repeat(nodes.rates[0][:, None], m, axis=1))
        place = m * basis.n_components
        result[j][:place, place] += mixed.ravel()
        result[j][place, :place] += mixed.ravel()
    return result


def moving(force: Force, basis: FourierBasis, motion: Motion, details: Details) -> Events:
    """The break points of motions, at which slopes of the force jump."""
    size, m = motion.n_variables, force.sizes.directions
    none = np.zeros(0, dtype=int), np.zeros((0, size)), np.zeros((0, m, size))
    parts = [Events(*none, np.zeros((0, basis.n_components)))]
    for j, own in enumerate(details.breaks):
        if not len(own.angle):
            continue
        part, nodes = motion.of([j]), nodes_of(basis, [own], details.count[j])
        _, slope = force.slopes(part.arguments(nodes)[0])
        rates = np.einsum("nia,na->ni", slope, part.rates(nodes)[0])
        left, right = _at_ends(rates[None], nodes)[:, 0]
        at_break = Angles(basis, own.angle[None])
        _, by_argument = force.margins(part.arguments(at_break)[0])
        of_break = by_argument[np.arange(len(own.angle)), own.function]
        rate = np.einsum("ba,ba->b", of_break, part.rates(at_break)[0])
        along = np.einsum("ba,bav->bv", of_break, part.by_variables(at_break)[0])
        grazing = np.abs(rate) <= _GRAZING * own.fastest
        moves = -along / np.where(grazing, np.inf, rate)[:, None]
        # The jump of the derivative by a variable is that of the rate times how the break moves.
        jump = (left - np.roll(right, 1, axis=0))[:, :, None] * moves[:, None]
        share = at_break.functions[0] * basis.norm
        parts.append(Events(np.full(len(moves), j), moves, jump, share))
    return Events.joined(*parts)
