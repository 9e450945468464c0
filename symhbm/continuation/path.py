"""Pseudo-arclength continuation with contact states held over each step.

The friction force has a corner where a contact begins or ends to slip, and the path may turn by
more than 90 degrees there. Each step therefore keeps the contact states of its start, on equations
that continue smoothly past the limits; a contact found beyond its limit ends the step on the exact
onset, its state flips, and the path goes on along the tangent of the far side.

Lengths are measured relative to the response and to the parameter at the start of the step, so
that they mean the same in any units.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.correctors import Corrected, Corrector, Hyperplane, unit_parameter
from symhbm.continuation.events import (
    LARGEST_PREDICTION_ERROR,
    SMALLEST_STEP,
    ResonanceFinder,
    brief_crossing,
    find_branch_point,
    find_folds,
    first_limit,
    step_over_corner,
)
from symhbm.continuation.newton import TOLERANCE
from symhbm.continuation.point import (
    UNBOUNDED_AMPLIFICATION,
    Event,
    EventKind,
    PathPoint,
    state_changes,
)
from symhbm.continuation.predictor import Predictor
from symhbm.continuation.problem import ContinuationProblem
from symhbm.continuation.status import Status
from symhbm.numerics import FloatArray

FIRST_STEP = 0.02
LARGEST_STEP = 0.5
PREDICTION_ERROR = 0.02
"""Distance between predicted and corrected point aimed at, relative to the response."""
MAX_LOOKS = 5
"""Attempts to end a step at a resonance inside it; one is enough where the path is straight."""
AIMED_LOOKS = 2
"""Number of them that end where the modes at both ends of the step say that it is."""
STEEP = 1e-3
"""Part of a tangent along the parameter below which its sign is worth a tangent of its own."""
SMALLEST_HOP = 1e-3
"""First step tried over a corner that nobody located."""
SHRUNK = 1 / 50
"""Fall of the step, against those before, at which a corner nobody located is taken to be near."""


class Path:
    """Iterator over the points of a curve from ``start`` to ``end``, from known ``unknowns``.

    ``base`` may be a point of another path to go on from, in its contact states. Folds, branch
    points, onsets and ends of slip are points of their own. ``status`` tells why it ended,
    ``rejected`` counts the steps tried in vain.
    """

    def __init__(
        self,
        curve: ContinuationProblem,
        unknowns: FloatArray,
        start: float,
        end: float,
        corrector: Corrector | None = None,
        max_points: int = 5000,
        base: PathPoint | None = None,
    ):
        self.corrector = corrector or Corrector(curve)
        self.status = Status.NOT_STARTED
        self.rejected = 0
        self._curve = curve
        self._begin = np.append(unknowns, float(start)) if base is None else base.state
        self._base = base
        self._end = float(end)
        self._heading = 1 if end > start else -1
        self._max_points = max_points
        self._orientation = 0
        self._predictor = Predictor.straight(len(self._begin))
        self._lookout = ResonanceFinder(curve)
        self._counted = self.corrector.solves

    def __iter__(self) -> Iterator[PathPoint]:
        point = self._first()
        if point is None:
            self.status = Status.NO_START
            return
        yield point
        step = usual = FIRST_STEP
        accepted = 1
        while accepted < self._max_points:
            attempt = self._advance(point, step)
            folds = None if attempt is None else self._folds(point, attempt[0])
            if attempt is None or folds is None:
                attempt = None
                self.rejected += 1
                step /= 4
                stuck = step < max(SHRUNK * usual, SMALLEST_STEP)
                hops = self._curve.single_valued and self._curve.angles is None
                if stuck and hops:
                    # Steps that shrank from corner to corner tell nothing of what lies beyond.
                    attempt, step = self._hop(point, max(usual, SMALLEST_HOP))
            if attempt is None:
                if step < SMALLEST_STEP:
                    self.status = Status.MINIMUM_STEP
                    return
                continue
            base, (point, error) = point, attempt
            yield from folds or ()
            accepted += len(folds or ())
            self._predictor = Predictor.through(base, point)
            accepted += 1
            usual = max(step, usual / 2)
            if any(event.kind == EventKind.BRANCH for event in point.events):
                self._orientation = -self._orientation
            yield point
            if point.value == self._end:
                self.status = Status.REACHED_END
                return
            if point.value == self._begin[-1]:
                self.status = Status.TURNED_BACK
                return
            if point.amplification > max(base.amplification, UNBOUNDED_AMPLIFICATION):
                self.status = Status.UNBOUNDED
                return
            growth = np.cbrt(PREDICTION_ERROR / max(error, 1e-12))
            step = min(step * np.clip(growth, 0.3, 2.0), LARGEST_STEP)
        self.status = Status.MAXIMUM_POINTS

    def _folds(self, base: PathPoint, point: PathPoint) -> list[PathPoint] | None:
        """The folds between two points, None if the points are too far apart to tell."""
        if self._curve.single_valued:
            return []
        folds = find_folds(self.corrector, base, point)
        if folds is None:
            return None
        accepted = []
        for fold in folds:
            scale = self._curve.scale(fold.state)
            found = self.corrector.tangent(fold.state, scale, fold.direction / scale, base.slip)
            if found is None:
                return None
            event = (Event(EventKind.FOLD),)
            accepted.append(self._accept(self._orient(found), scale, base.slip, event))
        return accepted

    def _first(self) -> PathPoint | None:
        if self._base is not None:
            base = self._base
            row = base.after / base.scale
            found = self.corrector.tangent(base.state, base.scale, row, base.slip)
            self._orientation = 0 if found is None else found.sign
            return None if found is None else base
        evaluation = self._curve.evaluate(self._begin[:-1], self._begin[-1])
        if evaluation.norm > TOLERANCE:
            return None
        scale = self._curve.scale(self._begin)
        row = self._heading * unit_parameter(len(scale))
        found = self.corrector.tangent(self._begin, scale, row, evaluation.friction.slip)
        if found is None:
            return None
        self._orientation = found.sign
        return self._accept(found, scale, evaluation.friction.slip)

    def _advance(self, base: PathPoint, step: float) -> tuple[PathPoint, float] | None:
        """Next point and the error of its prediction, None if the step must be shorter."""
        start, scale = base.state, base.scale
        # A path that turned back at a fold may come back to where it began.
        ahead = self._end if base.after[-1] * self._heading > 0 else float(self._begin[-1])
        to_end = (ahead - base.value) / base.after[-1] if base.after[-1] != 0 else -1.0
        at_end = 0 < to_end <= step
        attempt = self._predict(base, to_end if at_end else step, ahead if at_end else None)
        if attempt is None:
            return None
        found, error = attempt
        length = to_end if at_end else step
        for look in range(MAX_LOOKS):
            share = self._lookout.first_passed(base, found)
            if share is None or share * length < SMALLEST_STEP:
                break
            # A resonance that neither end of the step shows: look at it. Where aim was taken too
            # far twice, half of the way tells more of where it is.
            at_end = False
            length *= share if look < AIMED_LOOKS else min(share, 0.5)
            attempt = self._predict(base, length, None)
            if attempt is None:
                return None
            found = attempt[0]  # the error of the whole step tells how long the next one may be
        travel = found.point[-1] - base.value
        passed = self._passed(float(found.point[-1]))
        if not at_end and passed is not None and base.value != passed:
            guess = start + (passed - base.value) / travel * (found.point - start)
            found = self._correct(guess, scale, unit_parameter(len(scale)), base.slip, passed)
            if found is None:
                return None
        found = self._orient(found)
        over = found if found.crosses else brief_crossing(self.corrector, base, found, scale)
        if over is not None:
            point = self._land(base, over, scale)
            return None if point is None else (point, error)
        if self._curve.single_valued and travel * self._heading <= 0:
            return None
        steep = not self._curve.single_valued and abs(found.direction[-1]) < STEEP
        if steep or np.dot(found.direction, base.after / scale) <= 0:
            # The tangent is that of the iterate before: on a steep flank that may not do.
            anew = self.corrector.tangent(found.point, scale, base.after / scale, base.slip)
            if anew is None:
                return None
            if anew.sign != self._orientation:
                # Another path, unless it goes straight on through a branch point.
                beyond = find_branch_point(self.corrector, base, anew, scale)
                if beyond is None:
                    return None
                events = (Event(EventKind.BRANCH),)
                return self._accept(beyond, scale, base.slip, events), error
            found = anew
        return self._accept(found, scale, base.slip), error

    def _predict(
        self, base: PathPoint, length: float, end: float | None
    ) -> tuple[Corrected, float] | None:
        """Point at a distance or at an ``end`` of the band, and the error of its prediction."""
        scale, guess = base.scale, self._predictor.at(base, length)
        normal = base.after / scale if end is None else unit_parameter(len(scale))
        found = self._correct(guess, scale, normal, base.slip, end)
        if found is None:
            return None
        return None if found.error > LARGEST_PREDICTION_ERROR else (found, found.error)

    def _passed(self, value: float) -> float | None:
        """The end of the band at or beyond which a value lies."""
        if (value - self._end) * self._heading >= 0:
            return self._end
        begin = float(self._begin[-1])
        beyond = (value - begin) * self._heading <= 0
        return begin if beyond and not self._curve.single_valued else None

    def _hop(self, base: PathPoint, step: float) -> tuple[tuple[PathPoint, float] | None, float]:
        """Next point beyond a corner nobody located, and the length of that step."""
        found = step_over_corner(self.corrector, base, self._end, step / 4)
        for _ in range(MAX_LOOKS):
            share = None if found is None else self._lookout.first_passed(base, found.found)
            if found is None or share is None:
                break
            # What looks like a corner may be the flank of a narrow resonance.
            nearer = step_over_corner(self.corrector, base, self._end, share * found.length)
            if nearer is None:
                break  # a look that fails is no reason to end where the path goes on
            found = nearer
        if found is None:
            return None, 0.0
        self._orientation = found.found.sign
        events = state_changes(base.slip, found.slip)
        point = self._accept(found.found, base.scale, found.slip, events)
        return (point, found.error), found.length

    def _correct(self, guess, scale, normal, slip, end: float | None) -> Corrected | None:
        if end is not None:
            guess[-1] = end
            if self._curve.is_at_rest(end, slip):
                guess[:-1] = 0.0  # no iteration of relative residuals gets there
        found = self.corrector.correct(guess, scale, Hyperplane(guess, scale, normal), slip)
        if found is not None and end is not None:
            found.point[-1] = end
        return found

    def _land(self, base: PathPoint, over: Corrected, scale: FloatArray) -> PathPoint | None:
        """Solve for the first limit crossed between ``base`` and ``over``, and flip the state."""
        found = first_limit(self.corrector, base, over, scale, self._orientation)
        if found is None:
            return None
        landed, flipped = found
        slip = base.slip ^ flipped
        landed = self._orient(landed)
        beyond = self.corrector.tangent(landed.point, scale, landed.direction, slip)
        if beyond is None:
            return None
        beyond = self._orient(beyond)
        events = state_changes(base.slip, slip)
        if landed.direction[-1] * beyond.direction[-1] < 0 and not self._curve.single_valued:
            events += (Event(EventKind.FOLD),)
        return self._accept(landed, scale, slip, events, beyond)

    def _orient(self, found: Corrected) -> Corrected:
        """Point the tangent so that ``det [J; t^T]`` keeps the sign it had at the start."""
        return found if found.sign == self._orientation else found.turned()

    def _accept(
        self,
        found: Corrected,
        scale: FloatArray,
        slip: NDArray[np.bool_],
        events: tuple[Event, ...] = (),
        beyond: Corrected | None = None,
    ) -> PathPoint:
        """A point of the path; ``beyond`` has the tangent after it where that is another."""
        solves, self._counted = self.corrector.solves - self._counted, self.corrector.solves
        return PathPoint.of(self._curve, found, scale, slip, solves, events, beyond)
