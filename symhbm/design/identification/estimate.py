"""The best values: least squares with exact Jacobians from several starts, then Newton steps."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.special import chdtrc

from symhbm.design.identification.objective import Objective, Point
from symhbm.design.identification.unknowns import Unknowns
from symhbm.design.kept import KeptDesigns
from symhbm.numerics import FloatArray

LOSSES = ("linear", "soft_l1", "huber", "cauchy", "arctan")
_TOLERANCE = 1e-9
"""Relative decrease of the sum of squares, and relative step, at which SciPy's solver ends."""
_ROUND_OFF = 1e-13
"""Distance from an optimum, in standard errors, that Newton steps do not make smaller."""
_ROUGH = 1e-7
"""The same of fits along a profile."""
_SHORT, _MOST = 30, 100
"""Points of one descent of several, and of the one that goes on from where the best has ended."""
_FAR = 1e3
"""Residuals where no response is found, over the largest at the start: such steps are refused."""
_EXACT = 1e-10
"""Norm of residuals relative to that of the motion below which no other start does better."""
_SPREAD = np.log(10.0)
"""How far beside the given start others are, in logarithms."""
_SCREENED, _OF_FOLLOWED, _SHARP = 12, 4, 10.0
"""Starts that are looked at for each one that is descended from, fewer where responses are followed
each time; and how strictly."""
_LIKELY = 1e-3
"""Probability of residuals as large by noise alone, above which no better optimum is looked for."""
_STATIONARY = 1e-6
"""Distance from the optimum, in standard errors, of a point that is one."""
_AT_BOUND = 1e-9
"""Distance of a variable from its bound, over that between the bounds, at which it is there."""


@dataclass(frozen=True)
class Descent:
    """Where a search from one ``start`` ended: a point, and how far from stationary it is.

    ``distance`` is that in standard errors, by Newton's step; ``failed`` tells why there is none.
    """

    start: FloatArray
    point: Point | None
    distance: float
    failed: str = ""

    @property
    def value(self) -> float:
        """Half the sum of squares, infinite where the start has no response."""
        return np.inf if self.point is None else self.point.value

    @property
    def converged(self) -> bool:
        """Whether the point is an optimum."""
        return self.distance <= _STATIONARY


def descend(
    objective: Objective,
    start: FloatArray,
    loss: str = "linear",
    free: np.ndarray | None = None,
    tick: Callable[[], Any] = lambda: None,
    precise: bool = True,
    keep: Callable[[FloatArray], Any] = lambda x: None,
    scale: float = 1.0,
    most: int = _MOST,
) -> Descent:
    """The optimum that a start leads to; ``free`` are the variables that move, by default all.

    ``keep`` takes each of at ``most`` so many points on the way; a loss counts residuals over a
    ``scale``. One that is not ``precise`` is as close as sums of squares need to be compared.
    """
    free = np.arange(len(start)) if free is None else free
    lower, upper = objective.unknowns.bounds
    inside = np.clip(start, lower, upper)

    def whole(part: FloatArray) -> FloatArray:
        x = inside.copy()
        x[free] = part
        return x

    try:
        first = objective.at(inside)
        refused = np.full(len(first.residuals), _FAR * float(np.abs(first.residuals).max() or 1.0))
    except ArithmeticError as error:
        return Descent(start, None, np.inf, str(error))

    def residuals(part: FloatArray) -> FloatArray:
        tick()
        try:
            return objective.at(whole(part)).residuals
        except ArithmeticError:
            return refused

    def jacobian(part: FloatArray) -> FloatArray:
        point = objective.at(whole(part))
        objective.remember(point)
        keep(point.x)
        return point.jacobian[:, free]

    # SciPy wants starts strictly inside the bounds.
    within = 1e-10 * (upper - lower)
    x, tolerance = inside, _TOLERANCE if precise else _ROUGH
    if len(free):
        found = least_squares(
            residuals,
            np.clip(inside[free], (lower + within)[free], (upper - within)[free]),
            jacobian,  # pyright: ignore[reportArgumentType]
            (lower[free], upper[free]),
            x_scale="jac",
            loss=loss,
            f_scale=scale,
            ftol=tolerance,
            xtol=tolerance,
            gtol=tolerance,
            max_nfev=most,
        )
        x = whole(found.x)
    try:
        point = objective.at(x)
        if not precise:
            return Descent(start, point, np.nan)
        return Descent(start, *polished(objective, point, free, loss))
    except ArithmeticError as error:
        return Descent(start, None, np.inf, str(error))


def polished(
    objective: Objective, point: Point, free: np.ndarray, loss: str
) -> tuple[Point, float]:
    """A point after Newton steps with the exact Hessian, and its distance from the optimum."""
    distance = _distance(point, free, loss)
    for _ in range(3):
        inner = inside(objective.unknowns, point.x)[free]
        if loss != "linear" or distance <= _ROUND_OFF or not inner.any():
            break
        moved = free[inner]
        hessian = point.hessian[np.ix_(moved, moved)]
        if not np.isfinite(hessian).all() or np.linalg.eigvalsh(hessian)[0] <= 0:
            break
        x = point.x.copy()
        x[moved] -= np.linalg.solve(hessian, point.gradient[moved])
        x = np.clip(x, *objective.unknowns.bounds)
        objective.remember(point)
        try:
            other = objective.at(x)
            nearer = _distance(other, free, loss)
        except ArithmeticError:
            break
        if nearer >= distance or other.value > point.value * (1 + 1e-12):
            break
        point, distance = other, nearer
    return point, distance


def inside(unknowns: Unknowns, x: FloatArray) -> np.ndarray:
    """Which variables are not at one of their bounds, (n,)."""
    lower, upper = unknowns.bounds
    near = _AT_BOUND * (upper - lower)
    return (x > lower + near) & (x < upper - near)


def weights_of(residuals: FloatArray, loss: str) -> FloatArray:
    """Square roots of the slopes of a loss over squared residuals: how much each row counts."""
    square = residuals**2
    slopes = {
        "linear": np.ones_like(square),
        "soft_l1": (1 + square) ** -0.5,
        "huber": np.minimum(1.0, np.maximum(square, 1e-300) ** -0.5),
        "cauchy": 1 / (1 + square),
        "arctan": 1 / (1 + square**2),
    }
    return np.sqrt(slopes[loss])


def _distance(point: Point, free: np.ndarray, loss: str) -> float:
    """Length of the step to the optimum of a linear model, in standard errors of known noise.

    Variables at a bound that the sum of squares falls beyond do not count.
    """
    weights = weights_of(point.residuals, loss)
    jacobian, residuals = weights[:, None] * point.jacobian[:, free], weights * point.residuals
    inner = inside(point.objective.unknowns, point.x)[free]
    left, singular, _ = np.linalg.svd(jacobian[:, inner], full_matrices=False)
    seen = singular > 1e-10 * max(point.size, singular.max(initial=0.0))
    return float(np.linalg.norm(left.T[seen] @ residuals))


def starts_of(unknowns: Unknowns, n_starts: int) -> list[FloatArray]:
    """The given start, and others spread evenly around it within the bounds."""
    first = unknowns.start
    lower, upper = unknowns.bounds
    near = np.array([_SPREAD if one.logarithmic else np.inf for one in unknowns.each])
    low, high = np.maximum(lower, first - near), np.minimum(upper, first + near)
    # Multiples of powers of a root of x^(n+1) = x + 1 spread evenly in n dimensions.
    root = 2.0
    for _ in range(50):
        root = (1 + root) ** (1 / (unknowns.n + 1))
    steps = root ** -np.arange(1, unknowns.n + 1)
    shares = np.outer(np.arange(1, n_starts), steps)
    return [first, *(low + (0.5 + shares) % 1 * (high - low))]


def search(
    objective: Objective,
    n_starts: int,
    loss: str,
    tick: Callable[[], Any] = lambda: None,
    kept: KeptDesigns | None = None,
) -> list[Descent]:
    """Descents from the given start and from others that promise most, the best first.

    No more follow one that leaves nothing to explain. What is ``kept`` of a descent is where it
    goes on.
    """
    kept = kept or KeptDesigns("")

    def from_start(start: FloatArray, around: bool = False, most: int = _SHORT) -> Descent:
        name = "-".join(start.astype(str))
        begin = kept.designs.get(name, start)
        if around and name not in kept.designs:
            # Where far points count little, narrow resonances that pass measured ones block less.
            scale = _size(objective) / _SHARP
            given: Any = dict(tick=tick, precise=False, scale=scale, most=_SHORT)
            near = descend(objective, start, "cauchy", **given).point
            begin = start if near is None else near.x
        found = descend(objective, begin, loss, tick=tick, keep=partial(kept.add, name), most=most)
        return replace(found, start=start)

    followed = any(curve.followed for curve in objective.curves)
    starts = starts_of(objective.unknowns, (_OF_FOLLOWED if followed else _SCREENED) * n_starts)
    descents = [from_start(starts[0])]
    if n_starts > 1 and not _explains(descents[0]):
        tick()
        others = sorted(starts[1:], key=lambda start: _misfit(objective, start))
        for start in others[: n_starts - 1]:
            descents.append(from_start(start, around=not followed))
            if _explains(descents[-1]):
                break
    descents.sort(key=lambda descent: descent.value)
    best = descents[0]
    if best.point is not None and not best.converged and not _explains(best):
        descents[0] = from_start(best.start, most=_MOST)
    return descents


def _explains(descent: Descent) -> bool:
    """Whether the residuals are round-off, or no more than their known noise explains."""
    point = descent.point
    if point is None:
        return False
    if np.linalg.norm(point.residuals) <= _EXACT * point.size:
        return True
    n = len(point.residuals) - len(point.x)
    return point.objective.rows.has_noise and n > 0 and chdtrc(n, 2 * point.value) > _LIKELY


def _misfit(objective: Objective, start: FloatArray) -> float:
    """How badly a start fits, counting factors: far responses count little more than near ones."""
    try:
        residuals = objective.at(start).residuals
    except ArithmeticError:
        return np.inf
    return float(np.sum(np.log1p((_SHARP * residuals / _size(objective)) ** 2)))


def _size(objective: Objective) -> float:
    """Root mean square of all measurements over their scales."""
    rows = objective.rows
    return float(np.sqrt(np.mean((rows.value / rows.scales)[rows.kept] ** 2))) or 1.0
