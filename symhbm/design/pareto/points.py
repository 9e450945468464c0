"""The designs of a front: the optimum of each aim, and designs between them.

Between the ends a front is met by lines across it (normal-boundary intersection, I. Das, J. Dennis,
SIAM J. Optim. 8 (1998), 631-657): in logarithms of both aims, over their ranges between the ends,
the design is looked for that is best in the worse of both aims relative to a point of the chord
from end to end. Every point of a front is met by such a line, where the front is not convex, too.
"""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from symhbm.continuation import Status
from symhbm.design import tolerances
from symhbm.design.cases import Cases
from symhbm.design.kept import KeptDesigns, told_of
from symhbm.design.outcome import status_of
from symhbm.design.program import Aim, Limits, Program
from symhbm.design.search import SearchResult, again, best_of, search
from symhbm.design.task import Task
from symhbm.numerics import FloatArray


def signature(task: Task, aims: Sequence[Aim], n_points: int, n_starts: int | None) -> str:
    """Digest of all that a front depends on."""
    told: list[Any] = [n_points, n_starts, str(task.statistic), repr(task.variables.groups)]
    for peak in task.peaks:
        told += [*told_of(peak.problem, task.sweep), peak.name, peak.bands, peak.dof]
    told += [text for aim in aims for text in (aim.name, aim.logarithm.serialize())]
    told += [task.limits.low.tolist(), task.limits.high.tolist(), task.limits.function.serialize()]
    return hashlib.sha256(json.dumps(told).encode()).hexdigest()


END, BETWEEN = "end", "between"
_SAME = 1e-7
"""Largest difference of logarithms of aims of one point of a front."""
_NEAR_OPTIMUM = 1e-6
"""Share of an optimum that is given up for the other aim where several designs have it."""
_FAR = 10.0
"""Logarithm by which no aim is better."""
FLAT = (Status.DESIGN_ON_PLATEAU, Status.DESIGN_WITHOUT_EFFECT)
"""Statuses of designs whose aim is as good around them."""
_ACCEPTED = (
    Status.DESIGN_OPTIMAL,
    Status.DESIGN_AT_BOUND,
    Status.DESIGN_AT_EDGE,
    Status.DESIGN_WITHOUT_PEAK,
    Status.DESIGN_BESIDE_FAILURES,
    *FLAT,
)
"""Statuses of designs that satisfy the conditions of an optimum."""


@dataclass(frozen=True, eq=False)
class FrontPoint:
    """One design: how it was found, both aims as logarithms (2,), and its status.

    ``along`` tells where its line crosses the chord, 0 at the optimum of the first aim and 1 at
    that of the second; ``removed`` why it is not on the front, "" if it is. An end is the optimum
    of one aim ``up_to`` a share.
    """

    along: float
    kind: str
    found: SearchResult
    aims: FloatArray
    status: Status
    removed: str = ""
    up_to: float = 0.0

    @property
    def x(self) -> FloatArray:
        """The design variables."""
        return self.found.design.x


def points_of(
    program: Program,
    aims: tuple[Aim, Aim],
    cases: Cases,
    n_points: int,
    n_starts: int | None,
    kept: KeptDesigns,
) -> list[FrontPoint]:
    """Both ends and as many points between them as make ``n_points``, from the first aim's end.

    Designs that are ``kept`` are solved for again from there, others are searched and kept.
    """
    searches = _Searches(program, aims, cases, n_starts, kept)
    first, last = (searches.end(number) for number in (0, 1))
    if not np.all(np.isfinite([first.aims, last.aims])) or n_points == 2:
        return [first, last]
    corner = np.abs(first.aims - last.aims)
    if np.any(corner <= tolerances.AGREE):
        return [first, last]
    shares = np.linspace(0, 1, n_points)[1:-1].tolist()
    points = [first]
    for share in shares:
        points.append(searches.between(first, last, share, [points[-1].x]))
    points.append(last)
    # A design that another line led to may be better on this one.
    for number, share in enumerate(shares, start=1):
        offsets = _chord(first, last, share)
        worst = [float(np.max((point.aims - offsets) / corner)) for point in points]
        best = int(np.argmin(worst))
        if worst[best] < worst[number] - tolerances.AGREE:
            better = searches.between(first, last, share, [points[best].x], "again")
            if better.found.design.value < points[number].found.design.value:
                points[number] = better
    return points


def on_front(points: list[FrontPoint]) -> list[FrontPoint]:
    """The points with reasons why some are not on the front."""
    return [replace(point, removed=_why_removed(point, points)) for point in points]


def _why_removed(point: FrontPoint, points: list[FrontPoint]) -> str:
    """Why a point is not on the front, "" if it is."""
    if not np.all(np.isfinite(point.aims)) or point.status not in _ACCEPTED:
        return str(point.status)
    number = points.index(point)
    for other_number, other in enumerate(points):
        difference = other.aims - point.aims
        known = bool(np.all(np.isfinite(other.aims))) and other.status in _ACCEPTED
        if other_number == number or not known:
            continue
        if np.all(np.abs(difference) <= _SAME):
            # Of equal ones an end stays, else the first.
            if (other.kind != END, other_number) < (point.kind != END, number):
                return "the same as another point"
        elif np.all(difference <= tolerances.AGREE):
            return "dominated: another design is better in one aim, and no worse in the other"
    return ""


def _chord(first: FrontPoint, last: FrontPoint, share: float) -> FloatArray:
    return (1 - share) * first.aims + share * last.aims


@dataclass(frozen=True)
class _Searches:
    """Searches for points of the front of two aims."""

    program: Program
    aims: tuple[Aim, Aim]
    cases: Cases
    n_starts: int | None
    kept: KeptDesigns

    def end(self, number: int) -> FrontPoint:
        """The optimum of one aim; of several designs that have it the best in the other aim."""
        program = replace(self.program, aims=(self.aims[number],))
        name = f"end {number}"
        found = self._found(name, program)
        point = self._point(float(number), END, program, found)
        active = point.found.active
        strict = active is not None and active.curvature > tolerances.LEVEL
        if strict or not np.all(np.isfinite(point.aims)):
            return point
        if not self.aims[number].uses.any():
            return self._best_of_equal(number, point)
        # Where the optimum is not isolated, all but a millionth of it is kept: so much rises as
        # far as the other aim, from far below, is better.
        other, far = 1 - number, np.array([_FAR, _FAR])
        scales, offsets = far.copy(), point.aims - far
        scales[number], offsets[number] = _NEAR_OPTIMUM, point.aims[number]
        both = self._both(offsets, scales)
        starts = [point.x, self.program.variables.lower, self.program.variables.upper]
        found = self._found(f"{name}, the best in the other aim", both, starts)
        better = self._point(float(number), END, both, found)
        gained = better.aims[other] < point.aims[other] - tolerances.AGREE
        kept = better.aims[number] <= point.aims[number] + 10 * _NEAR_OPTIMUM
        if not (gained and kept):
            return point
        # Slopes of so steep a sum are no measure: it is an optimum of one aim, up to that share.
        found = replace(found, active=None)
        return replace(better, found=found, status=point.status, up_to=_NEAR_OPTIMUM)

    def _best_of_equal(self, number: int, point: FrontPoint) -> FrontPoint:
        """The design that is best in the other aim, of those as good in one without peaks."""
        aim, other, n = self.aims[number], 1 - number, len(point.x)
        row = Limits.of_aim(aim, float(point.aims[number]) + tolerances.AGREE, n)
        program = replace(
            self.program, aims=(self.aims[other],), limits=self.program.limits.joined(row)
        )
        found = self._found(f"end {number}, the best in the other aim", program, [point.x])
        better = self._point(float(number), END, program, found)
        gained = better.aims[other] < point.aims[other] - tolerances.AGREE
        return better if gained else point

    def between(
        self,
        first: FrontPoint,
        last: FrontPoint,
        share: float,
        near: list[FloatArray],
        run: str = "first",
    ) -> FrontPoint:
        """The point of the line across the chord at a share of it, in a ``run`` of several."""
        corner = np.abs(first.aims - last.aims)
        # Tolerances hold for logarithms of aims: a narrow range is not stretched.
        program = self._both(_chord(first, last, share), corner / corner.min())
        starts = [*near, (1 - share) * first.x + share * last.x]
        found = self._found(f"between {share!r} {run}", program, starts, self.n_starts or 1)
        return self._point(share, BETWEEN, program, found)

    def _found(
        self, name: str, program: Program, starts: Sequence[FloatArray] = (), n_starts: int = 1
    ) -> SearchResult:
        """What a search finds, or the design that is kept of it, solved for again.

        It descends from ``starts`` and from the best of ``n_starts`` designs spread over the
        bounds; without ``starts`` it is the full search.
        """
        x = self.kept.designs.get(name)
        if x is not None:
            return again(program, self.cases, x)
        if starts:
            found = best_of(program, self.cases, [*starts], n_starts, 1)
        else:
            found = search(program, self.cases, [], None)
        if np.isfinite(found.design.value):
            self.kept.add(name, found.design.x)
        return found

    def _both(self, offsets: FloatArray, scales: FloatArray) -> Program:
        pairs = zip(self.aims, offsets.tolist(), scales.tolist(), strict=True)
        aims = tuple(replace(aim, offset=offset, scale=scale) for aim, offset, scale in pairs)
        return replace(self.program, aims=aims)

    def _point(self, along: float, kind: str, program: Program, found: SearchResult) -> FrontPoint:
        states, x = found.design.states, found.design.x
        peaks = program.levels(np.array([state.height for state in states]))
        aims = np.array([aim.value(peaks, x) for aim in self.aims])
        status = status_of(program, found, self.cases.failed)
        return FrontPoint(along, kind, found, aims, status)
