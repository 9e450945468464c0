"""A band with the switching angles as unknowns, walked in the parts where the form applies.

Where a path ends because a contact begins to reverse while it slips, the form may apply again
beyond. Each part is entered by a solution of its own, walked back to where it begins, and from
there to where it ends.
"""

from collections.abc import Sequence

from symhbm.continuation.angles.corrector import AngleCorrector
from symhbm.continuation.branch import Branch
from symhbm.continuation.newton import NewtonResult
from symhbm.continuation.problem import ContinuationProblem
from symhbm.continuation.status import Status
from symhbm.numerics import FloatArray

_FIRST, _FARTHER, _IN_VAIN = 1e-3, 1.5, 4
"""Distance beyond the end of a part, relative, at which the next is looked for, and how that grows
where the form does not apply and, beside, where nothing is found though it does."""
_MOST = 12
"""Parts of a band."""
_BEYOND = 1e-5
"""Distance beyond the end of a path, relative, at which it is asked why it ended."""
ANGLES_ENDED = (Status.ANGLES_DO_NOT_APPLY, Status.ANGLES_NOT_CONVERGED)


class AngleWalk(Branch):
    """A path with the switching angles as unknowns; see `Branch`."""

    corrector: AngleCorrector

    def _corrector_of(self, curve: ContinuationProblem) -> AngleCorrector:
        assert curve.angles is not None
        return AngleCorrector(curve, curve.angles)

    def _go(self, start: float, end: float, max_points: int, guess: FloatArray | None) -> None:
        super()._go(start, end, max_points, guess)
        if self.status not in (Status.NO_START, Status.MINIMUM_STEP):
            return
        # Located friction tells whether there is anything to be found where nothing was.
        beyond = start
        if self.points:
            last = self.points[-1].state
            distance = min(_BEYOND * self.curve.scale(last)[-1], abs(end - last[-1]))
            beyond = last[-1] + self._heading * distance
        applies = self.corrector.applies(float(beyond))
        if applies is not None:
            self.status = Status.ANGLES_NOT_CONVERGED if applies else Status.ANGLES_DO_NOT_APPLY

    def _solve_anew(self, value: float) -> NewtonResult:
        return self.corrector.anew(value)


def angle_branches(
    curve: ContinuationProblem, band: tuple[float, float], max_points: int, each: bool
) -> list[AngleWalk]:
    """The parts of a band in which the form applies, in the order of the band.

    The first begins where the band does; it has no points where the form does not apply there.
    """
    walks = [AngleWalk(curve, band, max_points, each)]
    while walks[-1].status in ANGLES_ENDED and len(walks) < _MOST:
        part = _next(walks[-1], band, max_points)
        if part is None:
            break
        walks.append(part)
    return walks


def _next(walk: AngleWalk, band: tuple[float, float], max_points: int) -> AngleWalk | None:
    """The part after that of a walk, None where nothing is found up to the end of the band."""
    curve, corrector = walk.curve, walk.corrector
    begin, end = walk.points[-1].value if walk.points else band[0], band[1]
    heading = 1 if end > begin else -1
    distance = _FIRST * max(abs(begin), curve.smallest)
    value = begin
    while value != end:
        value = begin + heading * min(distance, abs(end - begin))
        distance *= _FARTHER
        if corrector.applies(value) is False:
            continue
        found = corrector.free(walk.points[-1].unknowns, value) if walk.points else None
        if found is None or not found.converged:
            found = corrector.anew(value)
        if not found.converged:
            distance *= _IN_VAIN
            continue
        back = AngleWalk(curve, (value, begin), max_points, walk.each, found.unknowns)
        corrector.solves += back.corrector.solves
        edge = back.points[-1] if back.points else None
        if edge is None or edge.value == end:
            continue
        part = AngleWalk(curve, (edge.value, end), max_points, walk.each, edge.unknowns)
        if part.points and (part.points[-1].value - begin) * heading > 0:
            return part
        corrector.solves += part.corrector.solves
    return None


def covered(walks: Sequence[Branch], unit: float, band: tuple[float, float]) -> float:
    """Share of a band, in a ``unit`` of its values, over which walks have points."""
    if all(walk.status == Status.REACHED_END for walk in walks):
        return 1.0
    ways = [abs(walk.points[-1].value - walk.points[0].value) for walk in walks if walk.points]
    return sum(ways) / (unit * abs(band[1] - band[0]))
