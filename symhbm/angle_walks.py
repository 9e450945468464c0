"""A band with the switching angles as unknowns: walked in parts where the form does not apply all over.

Where a path ends because a contact begins to reverse while it slips, the form may apply again
beyond. Each part is entered from a start of its own, walked back to where it begins, and from there
to where it ends.
"""

from collections.abc import Sequence

from symhbm.angle_corrector import AngleCorrector
from symhbm.curve import Curve
from symhbm.fourier import FloatArray
from symhbm.newton import NewtonResult
from symhbm.status import Status
from symhbm.walk import Walk

_PLACES = (1.0, 1 / 2, 1 / 4, 3 / 4, 1 / 8, 3 / 8, 5 / 8, 7 / 8)
"""Shares of the way from the end of the first path to that of the band at which parts are looked
for, in this order."""
_BEYOND = 1e-5
"""Distance beyond the end of a path, relative, at which it is asked why it ended."""
ANGLES_ENDED = (Status.ANGLES_DO_NOT_APPLY, Status.ANGLES_NOT_CONVERGED)


class AngleWalk(Walk):
    """A path with the switching angles as unknowns; see `Walk`."""

    corrector: AngleCorrector

    def _corrector_of(self, curve: Curve) -> AngleCorrector:
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
            beyond = last[-1] + self._heading * min(_BEYOND * self.curve.scale(last)[-1], abs(end - last[-1]))
        applies = self.corrector.applies(float(beyond))
        if applies is not None:
            self.status = Status.ANGLES_NOT_CONVERGED if applies else Status.ANGLES_DO_NOT_APPLY

    def _solve_anew(self, value: float) -> NewtonResult:
        return self.corrector.anew(value)


def angle_walks(
    curve: Curve, band: tuple[float, float], max_points: int, each: bool
) -> list[AngleWalk]:
    """The parts of a band in which the form applies, in the order of the band.

    The first begins where the band does; it has no points where the form does not apply there.
    """
    first = AngleWalk(curve, band, max_points, each)
    if first.status not in ANGLES_ENDED:
        return [first]
    heading = 1 if band[1] > band[0] else -1
    begin = first.points[-1].value if first.points else band[0]
    rest, parts = [(begin, band[1])], []
    for share in _PLACES:
        value = begin + share * (band[1] - begin)
        span = next((s for s in rest if 0 < (value - s[0]) * heading <= (s[1] - s[0]) * heading), None)
        if span is None:
            continue
        back = AngleWalk(curve, (value, span[0]), max_points, each)
        first.corrector.solves += back.corrector.solves
        first.rejected += back.rejected
        if not back.points:
            continue
        edge = back.points[-1]
        part = AngleWalk(curve, (edge.value, span[1]), max_points, each, edge.unknowns)
        if len(part.points) < 2:
            continue
        parts.append(part)
        ends = span[0], edge.value, part.points[-1].value, span[1]
        rest.remove(span)
        rest += [s for s in (ends[:2], ends[2:]) if s[0] != s[1]]
    return [first, *sorted(parts, key=lambda part: heading * part.points[0].value)]


def covered(walks: Sequence[Walk], unit: float, band: tuple[float, float]) -> float:
    """Share of a band, in a ``unit`` of its values, over which walks have points."""
    if all(walk.status == Status.REACHED_END for walk in walks):
        return 1.0
    ways = [abs(walk.points[-1].value - walk.points[0].value) for walk in walks if walk.points]
    return sum(ways) / (unit * abs(band[1] - band[0]))
