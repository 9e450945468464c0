"""Crossings of two branches: branch points as a system of equations, and both tangents there.

At a crossing the derivative ``A`` of the balance by unknowns and parameter (n, n + 1) has a left
null vector ``w``. The crossing solves ``r + e w = 0``, ``A^T w = 0``, ``w^T w = 1``: as many
equations as there are unknowns, point, ``w`` and the defect ``e``, and regular where two branches
cross at an angle. Where they come close but do not meet, the defect is not zero.

In the null space ``N`` of ``A`` tangents are the directions ``N a`` with ``a^T B a = 0``, where
``B = N^T H N`` and ``H`` holds the second derivatives of ``w^T r`` (algebraic bifurcation
equation), by the unknowns and the moving parameter.

Between two branch points within one step of a path the determinant of the derivatives and the
tangent has the other sign. Where its smallest singular value dips between two points of a path, the
bottom of the dip tells.

Reference: R. Seydel, Practical Bifurcation and Stability Analysis, Springer (2010), chapter 5.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from symhbm.balance import Evaluation, HarmonicBalance, SecondOrder
from symhbm.continuation.correctors import Corrector
from symhbm.continuation.newton import TOLERANCE
from symhbm.continuation.point import UNBOUNDED_AMPLIFICATION, PathPoint
from symhbm.continuation.problem import (
    ContinuationProblem,
    Corrected,
    FrequencyProblem,
    ParameterProblem,
)
from symhbm.continuation.segment import PathState, Segment
from symhbm.model import MANY
from symhbm.numerics import FloatArray, full, length_of


class Curvature:
    """Second derivatives of the balance of a curve, weighted by multipliers.

    Raises TypeError, ValueError or NotImplementedError where they are not known, as `SecondOrder`.
    """

    def __init__(self, curve: FrequencyProblem | ParameterProblem):
        self._curve = curve
        names = (curve.name,) if isinstance(curve, ParameterProblem) else ()
        made = curve.problem.equations.once
        self._second_order = made(("bends", *names), lambda: SecondOrder(curve.problem, names))

    def __call__(
        self,
        point: FloatArray,
        evaluation: Evaluation,
        multipliers: FloatArray,
        switches: NDArray[np.bool_],
    ) -> FloatArray:
        """Second derivatives (n_unknowns + 1, n_unknowns + 1) of the balance times multipliers.

        At a ``point`` (n_unknowns + 1,), unknowns and parameter, with its ``evaluation``;
        ``multipliers`` (n_unknowns,).
        """
        problem, frequency = self._curve.at(float(point[-1]))
        given = problem, point[:-1], frequency, multipliers, switches, evaluation
        hessian = full(self._second_order(*given).hessian)
        n = len(multipliers)
        along = np.zeros((len(hessian), n + 1))
        along[:n, :n] = np.eye(n)
        along[self._moving(problem), n] = self._weights(problem)
        return along.T @ hessian @ along

    def _moving(self, problem: HarmonicBalance) -> slice:
        """Where the moving parameter is among the variables."""
        if isinstance(self._curve, FrequencyProblem):
            return slice(problem.n_unknowns, problem.n_unknowns + 1)
        return self._second_order.places[self._curve.name]

    def _weights(self, problem: HarmonicBalance) -> FloatArray:
        """How much each of its entries moves."""
        if isinstance(self._curve, FrequencyProblem):
            return np.ones(1)
        return np.atleast_1d(self._curve.chosen(problem))


def curvature_of(curve: ContinuationProblem) -> Curvature | None:
    """The second derivatives of a curve; None where they are not known, or take minutes."""
    known = isinstance(curve, FrequencyProblem | ParameterProblem)
    if not known or curve.problem.n_unknowns > MANY:
        return None
    try:
        return Curvature(curve)
    except (TypeError, ValueError, NotImplementedError):
        return None


_MAX_ITERATIONS = 15
_LAST_STEP = 1e-9
"""Last step, relative to the response, from which the next one is round-off: its square."""
_RADIUS = 1.0
"""Longest step relative to the response; beyond it the crossing is another one."""
_SINGULAR = 1e-9
"""Singular value, over the largest one, below which more than two branches may meet."""
_FLAT = 1e-9
"""Determinant of the algebraic bifurcation equation, relative, below which tangents coincide."""
_NEXT = 1e-3
"""Smallest singular value over the next one, and distance, next to a branch point."""
_DIP = 0.7
"""Smallest singular value over that elsewhere in a step, below which it may vanish in between."""
_BESIDE = 0.5
"""Largest distance of a branch point from a step that passes it, over the length of that."""
_SAME = 1e-6
"""Distance, relative to the response, up to which two branch points are one."""
_NORMAL = 1e-6
"""Component of a tangent along the parameter up to which the branch turns back there: within its
square, relative to the parameter."""


class Crossing(NamedTuple):
    """A crossing at a ``state`` (n_unknowns + 1,), unknowns and parameter.

    ``tangents`` (2, n_unknowns + 1) are those of both branches, unit vectors of scaled variables,
    None where there are not two; ``norm`` is the residual norm, by which the branches miss each
    other.
    """

    state: FloatArray
    tangents: FloatArray | None
    norm: float

    @property
    def meets(self) -> bool:
        """Whether the branches meet: the crossing itself is a solution."""
        return self.norm <= TOLERANCE


def is_crossing(
    corrector: Corrector, fold: PathState, between: tuple[PathPoint, PathPoint]
) -> bool:
    """Whether a fold between two points is where the path turns back at a branch point.

    A branch point next to the fold that is one of both points, or beyond them, does not count.
    """
    (left, right), state = between, fold.state
    if _regularity(corrector, fold, left)[0] > _NEXT:
        return False
    crossing = _crossing_between(corrector, state, left, right.state)
    return crossing is not None and length_of((crossing - state) / left.scale) <= _NEXT


def leaves(corrector: Corrector, base: PathPoint, ahead: Corrected) -> bool:
    """Whether a step leaves the branch at a branch point, so that the sign stays the same.

    Also where nothing is found half-way.
    """
    ends = PathState(base.state, base.after), PathState(ahead.point, ahead.direction * base.scale)
    segment = Segment(corrector, *ends, base.switches, base.scale)
    middle = segment.solve(0.5)
    if middle is None:
        return True
    states = ends[0], middle, ends[1]
    sizes = [_regularity(corrector, at, base)[1] for at in states]
    if min(sizes) > _DIP * max(sizes):
        return False
    guess = states[int(np.argmin(sizes))].state
    crossing = _crossing_between(corrector, guess, base, ahead.point)
    if crossing is None:
        return False
    [near], _ = segment.interpolate(np.array([segment.share_of(crossing)]))
    return length_of((near - crossing) / base.scale) <= _BESIDE * segment.length


def _regularity(corrector: Corrector, at: PathState, base: PathPoint) -> tuple[float, float]:
    """The smallest singular value of derivatives and tangent over the next one, and itself."""
    matrix = with_tangent(corrector, at, base.scale, base.switches)
    sizes = np.linalg.svd(matrix, compute_uv=False)
    return float(sizes[-1] / sizes[-2]), float(sizes[-1])


def with_tangent(
    corrector: Corrector, at: PathState, scale: FloatArray, switches: NDArray[np.bool_]
) -> FloatArray:
    """Scaled derivatives and unit tangent at a solution, (n_unknowns + 1, n_unknowns + 1)."""
    evaluation = corrector.curve.evaluate(at.state[:-1], at.state[-1], switches)
    slope, tangent = _slope(evaluation) * scale, at.direction / scale
    return np.vstack([slope / (evaluation.magnitude or 1.0), tangent / length_of(tangent)])


def _crossing_between(
    corrector: Corrector, guess: FloatArray, base: PathPoint, end: FloatArray
) -> FloatArray | None:
    """The state of a branch point from a ``guess``, strictly between a point and an ``end``."""
    curvature = curvature_of(corrector.curve)
    if curvature is None:
        return None
    crossing = solve_crossing(corrector, curvature, guess, base.scale, base.switches)
    if crossing is None or not crossing.meets:
        return None
    found, whole = (crossing.state - base.state) / base.scale, (end - base.state) / base.scale
    inside = 0 < np.dot(found, whole) < np.dot(whole, whole)
    inside &= min(length_of(found), length_of(found - whole)) > _SAME
    return crossing.state if inside else None


def several_meet(corrector: Corrector, point: PathPoint) -> bool:
    """Whether a path that cannot go on ends next to a point where more than two branches meet."""
    curve, scale = corrector.curve, point.scale
    if curve.single_valued or curve.problem.n_unknowns > MANY:
        return False
    evaluation = curve.evaluate(point.unknowns, point.value, point.switches)
    sizes = np.linalg.svd(_slope(evaluation) * scale, compute_uv=False)
    return len(sizes) > 2 and bool(sizes[-2] < _NEXT * sizes[-3])


def solve_crossing(
    corrector: Corrector,
    curvature: Curvature,
    guess: FloatArray,
    scale: FloatArray,
    switches: NDArray[np.bool_],
) -> Crossing | None:
    """The crossing near a ``guess`` (n_unknowns + 1,), None where Newton's method finds none.

    Lengths are relative to ``scale`` (n_unknowns + 1,), the states of contacts are held.
    """
    n = len(guess) - 1
    point, weights, defect = guess.copy(), np.zeros(n), 0.0
    last, found = np.inf, False
    try:
        for _ in range(_MAX_ITERATIONS):
            evaluation = corrector.curve.evaluate(point[:-1], point[-1], switches)
            force = evaluation.magnitude or 1.0
            slope = _slope(evaluation) * scale / force
            if not weights.any():
                weights = np.linalg.svd(slope)[0][:, -1]
            bend = curvature(point, evaluation, weights, switches) * np.outer(scale, scale) / force
            if found:
                tangents = _tangents(slope, bend)
                return Crossing(point, tangents, evaluation.norm)
            corrector.solves += 1
            step = _step(evaluation.residual / force, slope, bend, weights, defect)
            length = length_of(step[: n + 1])
            if not length < _RADIUS or (last < 1e-3 and length > last > _LAST_STEP):
                return None
            point = point + step[: n + 1] * scale
            weights = weights + step[n + 1 : 2 * n + 1]
            defect += float(step[-1])
            found, last = length <= _LAST_STEP, length
    except (ArithmeticError, np.linalg.LinAlgError):
        pass
    return None


def _step(
    residual: FloatArray, slope: FloatArray, bend: FloatArray, weights: FloatArray, defect: float
) -> NDArray:
    """Newton's step (2 n + 2,) of point, weights and defect; LinAlgError where it is singular."""
    n = len(weights)
    blocks = [
        [slope, defect * np.eye(n), weights[:, None]],
        [bend, slope.T, np.zeros((n + 1, 1))],
        [np.zeros((1, n + 1)), 2 * weights[None], np.zeros((1, 1))],
    ]
    values = [residual + defect * weights, slope.T @ weights, [weights @ weights - 1]]
    return np.linalg.solve(np.block(blocks), -np.concatenate(values))


def _slope(evaluation: Evaluation) -> FloatArray:
    """Derivative of the balance by unknowns and parameter, (n, n + 1)."""
    return np.column_stack([full(evaluation.jacobian), evaluation.by_parameter])


def _tangents(slope: FloatArray, bend: FloatArray) -> FloatArray | None:
    """Unit tangents (2, n + 1) of both branches; None where there are not two."""
    sizes, rows = np.linalg.svd(slope)[1:]
    if len(sizes) > 1 and sizes[-2] <= _SINGULAR * sizes[0]:
        return None
    null = rows[-2:].T
    values, vectors = np.linalg.eigh(null.T @ bend @ null)
    if not -values[0] * values[1] > _FLAT**2 * np.abs(bend).max() ** 2:
        return None
    both = np.array([[np.sqrt(values[1]), side * np.sqrt(-values[0])] for side in (1, -1)])
    tangents = both @ vectors.T @ null.T
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    tangents[np.abs(tangents[:, -1]) < _NORMAL, -1] = 0.0
    return tangents


_SHARES = (0.02, 0.25, 0.5, 0.75, 0.98)
"""Shares of a segment at which the singular value is known at first."""
_MOST_STEPS = 12
"""Most steps towards the bottom of a dip."""


def passed_pairs(points: Sequence[PathPoint], corrector: Corrector) -> dict[int, float]:
    """Values between two branch points that were passed over, by the number of the point before."""
    passed = {}
    for number, (left, right) in enumerate(pairwise(points)):
        amplification = max(left.amplification, right.amplification)
        if left.value == right.value or amplification > UNBOUNDED_AMPLIFICATION:
            continue
        try:
            value = _other_sign(Segment.of(corrector, left, right))
        except (ArithmeticError, np.linalg.LinAlgError):
            continue
        low, high = sorted((left.value, right.value))
        if value is not None and low < value < high:
            passed[number] = value
    return passed


def _other_sign(segment: Segment) -> float | None:
    """A value within a segment at which the sign differs from that at both ends, None without."""
    known: dict[float, tuple[float, float]] = {}

    def size(share: float) -> float:
        known[share] = _signed(segment, share)
        return known[share][1] * heading

    heading = 1.0
    heading = np.sign(size(_SHARES[0]))
    sizes = [size(share) for share in _SHARES]
    if sizes[-1] < 0:
        return None  # one branch point, or another path
    for k in range(1, len(_SHARES) - 1):
        if 0 < sizes[k] < min(sizes[k - 1], sizes[k + 1]):
            bounds = _SHARES[k - 1], _SHARES[k + 1]
            scipy.optimize.minimize_scalar(  # type: ignore
                size, bounds=bounds, method="bounded", options={"maxiter": _MOST_STEPS}
            )
    lowest, value = min((found * heading, value) for value, found in known.values())
    return value if lowest < 0 else None


def _signed(segment: Segment, share: float) -> tuple[float, float]:
    """The parameter at a share of a segment, and the smallest singular value with the sign.

    Of the derivatives and the unit tangent. Raises ArithmeticError where there is no solution.
    """
    solution = segment.at(share)
    matrix = with_tangent(segment.corrector, solution, segment.scale, segment.switches)
    matrix[-1] *= np.sign(matrix[-1] @ segment.normal)
    smallest = np.linalg.svd(matrix, compute_uv=False)[-1]
    return float(solution.state[-1]), float(np.linalg.slogdet(matrix)[0] * smallest)
