"""Pseudo-arclength continuation with contact states held over each step.

The friction force has a corner where a contact begins or ends to slip, and the path may turn by
more than 90 degrees there. Each step therefore keeps the contact states of its start, on equations
that continue smoothly past the limits. A step that takes a contact beyond its limit ends on that
limit instead; the state flips, and the path continues along the tangent of the far side.

Lengths are relative to the response and to the parameter at the start of the step, so that they
mean the same in any units.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from symhbm.continuation.correctors import Corrector, Hyperplane, corrector_of, unit_parameter
from symhbm.continuation.events import (
    BEYOND_CORNER,
    LARGEST_PREDICTION_ERROR,
    SMALLEST_STEP,
    ResonanceFinder,
    after_onset,
    beside_limit,
    beyond_limits,
    brief_crossing,
    end_of_slip,
    find_branch_point,
    find_folds,
    first_limit,
    is_crossing,
    leaves,
    several_meet,
    step_over_corner,
    turns_back,
)
from symhbm.continuation.newton import TOLERANCE
from symhbm.continuation.point import (
    UNBOUNDED_AMPLIFICATION,
    Event,
    EventKind,
    PathPoint,
    Predictor,
    switched,
)
from symhbm.continuation.problem import ContinuationProblem, Corrected
from symhbm.continuation.segment import Segment
from symhbm.continuation.status import Status
from symhbm.numerics import FloatArray
from symhbm.numerics.loops import Loop

FIRST_STEP = 0.02
"""Arc length of the first step, predicted along a straight line."""
LARGEST_STEP = 0.5
"""Longest arc length of a step: half of the response or of the parameter."""
PREDICTION_ERROR = 0.02
"""Distance between predicted and corrected point that step control aims at."""
_DOUBTED = 0.25
"""Share of that distance from which on the middle of a step without a force is looked at."""
MAX_AIMS = 5
"""Attempts to end a step at a resonance inside it; one is enough where the path is straight."""
MAX_FULL_AIMS = 2
"""Number of them that end where the modes at both ends of the step place the resonance."""
STEEP = 1e-3
"""Component of a tangent along the parameter below which the tangent is computed again."""
SMALLEST_CORNER_STEP = 1e-3
"""Smallest first step across a corner that event location missed."""
SHRINKAGE = 1 / 50
"""Step over the usual one below which a corner that event location missed is assumed to be near."""


class Path:
    """Iterator over the points of a curve from ``start``, where ``unknowns`` solve it, to ``end``.

    ``base`` may be a point of another path to continue from, in its contact states, ``begin`` the
    other end of the band where that is not ``start``; ``careful`` steps do not end on a branch that
    they cross. Folds, branch points, onsets and ends of slip are points. ``status`` tells why the
    path ended, ``rejected`` counts the rejected steps.
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
        begin: float | None = None,
        careful: bool = False,
    ):
        self.corrector = corrector or corrector_of(curve)
        self.status = Status.NOT_STARTED
        self.rejected = 0
        self._curve = curve
        self._start = np.append(unknowns, float(start)) if base is None else base.state
        self._base = base
        self._begin = float(self._start[-1]) if begin is None else begin
        self._careful = careful
        self._end = float(end)
        self._heading = 1 if end > start else -1
        self._max_points = max_points
        self._orientation = 0  # sign of ``det [J; t^T]``, which the path keeps
        self._predictor = Predictor.straight(len(self._start))
        self._onset: PathPoint | None = None
        self._resonance_finder = ResonanceFinder(curve)
        self._solves_before = self.corrector.solves

    def __iter__(self) -> Iterator[PathPoint]:
        point = self._first()
        if point is None:
            self.status = Status.NO_START
            return
        yield point
        step = usual = FIRST_STEP
        accepted = 1
        while accepted < self._max_points:
            attempt = self._with_folds(point, self._advance(point, step))
            if attempt is None:
                attempt = self._with_folds(point, self._end_of_slip(point, step))
                self.rejected += 1
                step /= 4
                stuck = step < max(SHRINKAGE * usual, SMALLEST_STEP)
                may_cross = self._curve.single_valued and self._curve.angles is None
                if attempt is None and stuck and may_cross:
                    after = self._after_onset(point)
                    if after is not None:
                        point, step, usual = after, usual, 0.0
                        continue
                    # A step that shrank from corner to corner does not suit the path beyond.
                    corner_step = max(usual, SMALLEST_CORNER_STEP)
                    beyond, length = self._cross_corner(point, corner_step)
                    attempt = self._with_folds(point, beyond)
                    # Where there is no corner, the path turns: only a shorter step follows it.
                    step, usual = (step, 0.0) if attempt is None else (length, usual)
                elif attempt is None and stuck and not self._curve.single_valued:
                    attempt = self._with_folds(point, self._acute_corner(point, 4 * step))
                    step = step if attempt is None else usual
            if attempt is None:
                if step < SMALLEST_STEP:
                    self.status = Status.MINIMUM_STEP
                    if not self.corrector.defined:
                        self.status = Status.UNDEFINED_FORCE
                    elif several_meet(self.corrector, point):
                        self.status = Status.SEVERAL_MEET
                    return
                continue
            base, (point, error, folds) = point, attempt
            self.corrector.defined = True
            yield from folds
            accepted += 1 + len(folds)
            self._predictor = Predictor.through(base, point)
            usual = max(step, usual / 2)
            if any(event.kind == EventKind.BRANCH for event in point.events):
                self._orientation = -self._orientation
            yield point
            if point.value == self._end:
                self.status = Status.REACHED_END
                return
            if point.value == self._begin:
                self.status = Status.TURNED_BACK
                return
            if point.amplification > max(base.amplification, UNBOUNDED_AMPLIFICATION):
                self.status = Status.UNBOUNDED
                return
            growth = (PREDICTION_ERROR / max(error, 1e-12)) ** (1 / 3)
            step = min(step * min(max(growth, 0.3), 2.0), LARGEST_STEP)
        self.status = Status.MAXIMUM_POINTS

    def end(self) -> PathPoint | None:
        """Its last point, followed to there; None where it does not reach its end."""
        points = list(self)
        return points[-1] if self.status == Status.REACHED_END else None

    def _with_folds(
        self, base: PathPoint, attempt: tuple[PathPoint, float] | None
    ) -> tuple[PathPoint, float, list[PathPoint]] | None:
        """A point and the error of its prediction with the folds before it, None as of `_folds`."""
        folds = None if attempt is None else self._folds(base, *attempt)
        return None if attempt is None or folds is None else (*attempt, folds)

    def _folds(self, base: PathPoint, point: PathPoint, error: float) -> list[PathPoint] | None:
        """The folds between two points, None if the points are too far apart to locate them.

        ``error`` is that of the prediction of the second point.
        """
        if self._curve.single_valued:
            return []
        # No force tells where a harmonic meets a mode: there a path leaves the step and comes back,
        # or passes so close to another one that a step ends on that.
        if error > _DOUBTED * PREDICTION_ERROR and not self._curve.driven:
            middle = Segment.of(self.corrector, base, point).corrected(0.5)
            if middle is None or not middle.error <= PREDICTION_ERROR:
                return None
        folds = find_folds(self.corrector, base, point)
        if folds is None:
            return None
        points = []
        for fold in folds:
            scale = self._curve.scale(fold.state)
            if is_crossing(self.corrector, fold, (base, point)):
                return None  # a branch turns back where it crosses another: a branch point
            tangent = self.corrector.tangent(
                fold.state, scale, fold.direction / scale, base.switches
            )
            if tangent is None:
                return None
            tangent, event = tangent.oriented(self._orientation), (Event(EventKind.FOLD),)
            points.append(self._accept(tangent, scale, base.switches, event))
        return points

    def _first(self) -> PathPoint | None:
        if self._base is not None:
            base = self._base
            tangent = self._tangent_at(base)
            self._orientation = 0 if tangent is None else tangent.sign
            return None if tangent is None else base
        evaluation = self._curve.evaluate(self._start[:-1], self._start[-1])
        if evaluation.norm > TOLERANCE:
            return None
        scale = self._curve.scale(self._start)
        row = self._heading * unit_parameter(len(scale))
        tangent = self.corrector.tangent(self._start, scale, row, evaluation.states.switches)
        if tangent is None:
            return None
        self._orientation = tangent.sign
        return self._accept(tangent, scale, evaluation.states.switches)

    def _advance(self, base: PathPoint, step: float) -> tuple[PathPoint, float] | None:
        """Next point and the error of its prediction, None if the step must be shorter."""
        start, scale = base.state, base.scale
        # A path that turned back at a fold may return to its start.
        target = self._end if base.after[-1] * self._heading > 0 else self._begin
        to_end = (target - base.value) / base.after[-1] if base.after[-1] != 0 else -1.0
        at_end = 0 < to_end <= step
        length = to_end if at_end else step
        attempt = self._attempt(base, length, target if at_end else None)
        if attempt is None:
            return None
        solution, error = attempt
        for aim in range(MAX_AIMS):
            share = self._resonance_finder.first_passed(base, solution)
            if share is None or share * length < SMALLEST_STEP:
                break
            # End the step at a resonance that neither of its ends shows. Where that was too far
            # twice, half of the step tells more of where the resonance is.
            at_end = False
            length *= share if aim < MAX_FULL_AIMS else min(share, 0.5)
            attempt = self._attempt(base, length, None)
            if attempt is None:
                return None
            solution = attempt[0]  # the error of the whole step controls the next one
        travel = solution.point[-1] - base.value
        band_end = self._end_of_band(float(solution.point[-1]))
        if not at_end and band_end is not None and base.value != band_end:
            guess = start + (band_end - base.value) / travel * (solution.point - start)
            solution = self._correct(base, guess, unit_parameter(len(scale)), band_end)
            if solution is None:
                return None
        solution = solution.oriented(self._orientation)
        forward, beyond = _senses(start, base.after, solution.point, solution.direction, scale)
        if forward and not beyond and not self._curve.single_valued:
            return None  # a part of the path that was there before, close to this one
        past_limit = solution
        if not solution.crosses:
            past_limit = brief_crossing(self.corrector, base, solution)
        if past_limit is not None:
            point = self._locate_limit(base, past_limit)
            return None if point is None else (point, error)
        if self._curve.single_valued and travel * self._heading <= 0:
            return None
        steep = not self._curve.single_valued and abs(solution.direction[-1]) < STEEP
        if steep or not forward:
            # The tangent belongs to the iterate before: too inaccurate on a steep flank.
            tangent = self.corrector.tangent(
                solution.point, scale, base.after / scale, base.switches
            )
            if tangent is None:
                return None
            if tangent.sign != self._orientation:
                # Another path, unless this one continues straight through a branch point.
                beyond = find_branch_point(self.corrector, base, tangent)
                if beyond is None:
                    return None
                events = (Event(EventKind.BRANCH),)
                if beyond.direction[-1] == 0:
                    events += (Event(EventKind.FOLD),)
                return self._accept(beyond, scale, base.switches, events), error
            solution = tangent
        if self._careful and leaves(self.corrector, base, solution):
            return None
        return self._accept(solution, scale, base.switches), error

    def _attempt(
        self, base: PathPoint, length: float, end: float | None
    ) -> tuple[Corrected, float] | None:
        """Point at an arc length or at an ``end`` of the band, and the error of its prediction."""
        scale, guess = base.scale, self._predictor.at(base, length)
        normal = base.after / scale if end is None else unit_parameter(len(scale))
        solution = self._correct(base, guess, normal, end)
        if solution is None:
            return None
        return None if solution.error > LARGEST_PREDICTION_ERROR else (solution, solution.error)

    def _end_of_band(self, value: float) -> float | None:
        """The end of the band at or beyond which a value lies."""
        if (value - self._end) * self._heading >= 0:
            return self._end
        beyond = (value - self._begin) * self._heading <= 0
        return self._begin if beyond and not self._curve.single_valued else None

    def _cross_corner(
        self, base: PathPoint, step: float
    ) -> tuple[tuple[PathPoint, float] | None, float]:
        """Next point beyond a corner that event location missed, and the length of that step."""
        crossing = step_over_corner(self.corrector, base, self._end, step / 4)
        for _ in range(MAX_AIMS):
            if crossing is None:
                break
            share = self._resonance_finder.first_passed(base, crossing.solution)
            if share is None:
                break
            # What looks like a corner may be the flank of a narrow resonance.
            nearer = step_over_corner(self.corrector, base, self._end, share * crossing.length)
            if nearer is None:
                break  # the path continues although the shorter step failed
            crossing = nearer
        if crossing is None:
            return None, 0.0
        self._orientation = crossing.solution.sign
        events = switched(self._curve.problem, base.switches, crossing.switches)
        point = self._accept(crossing.solution, base.scale, crossing.switches, events)
        return (point, crossing.error), crossing.length

    def _acute_corner(self, base: PathPoint, step: float) -> tuple[PathPoint, float] | None:
        """The acute corner within a step that failed, None where there is none."""
        if not turns_back(self.corrector, base, step, self._orientation):
            return None
        near, error, low = base, 0.0, 0.0
        while step - low > SMALLEST_STEP:
            middle = (low + step) / 2
            attempt = self._advance(base, middle)
            if attempt is None:
                step = middle
            else:
                low, (near, error) = middle, attempt
        ahead = turns_back(self.corrector, near, BEYOND_CORNER, self._orientation)
        if near.events or ahead is None:
            return None if near is base else (near, error)
        solution = self._tangent_at(near)
        if solution is None:
            return None
        events = (Event(EventKind.CORNER),)
        if solution.direction[-1] * ahead.direction[-1] < 0:
            events += (Event(EventKind.FOLD),)
        return self._accept(solution, near.scale, near.switches, events, ahead), error

    def _tangent_at(self, point: PathPoint) -> Corrected | None:
        row = point.after / point.scale
        return self.corrector.tangent(point.state, point.scale, row, point.switches)

    def _correct(self, base: PathPoint, guess, normal, end: float | None) -> Corrected | None:
        if end is not None:
            guess[-1] = end
            self._curve.settle(guess, base.switches)  # relative residuals do not converge to zero
        plane = Hyperplane(guess, base.scale, normal)
        solution = self.corrector.correct(guess, plane, base.switches)
        if solution is not None and end is not None:
            solution.point[-1] = end
        return solution

    def _locate_limit(self, base: PathPoint, past_limit: Corrected) -> PathPoint | None:
        """The point on the first limit crossed before ``past_limit``, in the states beyond it."""
        limit = first_limit(self.corrector, base, past_limit, self._orientation)
        if limit is None:
            return None
        solution, limits = limit[0].oriented(self._orientation), limit[1]
        beyond = beyond_limits(self.corrector, base, solution, limits, self._orientation)
        if beyond is None:
            return None
        far_side, switches = beyond
        far_side = beside_limit(self.corrector, base, solution, far_side, switches, limits)
        return self._at_limit(base, solution, far_side, switches)

    def _after_onset(self, point: PathPoint) -> PathPoint | None:
        """A point at which a contact begins to slip, with another tangent; once for each point."""
        after = (
            None if point is self._onset else after_onset(self.corrector, point, self._orientation)
        )
        if after is not None:
            self._onset, self._predictor = after, Predictor.straight(len(after.state))
        return after

    def _end_of_slip(self, base: PathPoint, step: float) -> tuple[PathPoint, float] | None:
        """The point within a step that failed at which a contact sticks again, None without one."""
        found = end_of_slip(self.corrector, base, step, self._orientation)
        if found is None or (found[0].point[-1] - self._end) * self._heading > 0:
            return None
        return self._at_limit(base, *found), 0.0

    def _at_limit(
        self,
        base: PathPoint,
        near_side: Corrected,
        far_side: Corrected,
        switches: NDArray[np.bool_],
    ) -> PathPoint:
        """The point on a limit, from its solutions on both sides, in the states beyond it."""
        events = switched(self._curve.problem, base.switches, switches)
        if near_side.direction[-1] * far_side.direction[-1] < 0 and not self._curve.single_valued:
            events += (Event(EventKind.FOLD),)
        return self._accept(near_side, base.scale, switches, events, far_side)

    def _accept(
        self,
        solution: Corrected,
        scale: FloatArray,
        switches: NDArray[np.bool_],
        events: tuple[Event, ...] = (),
        far_side: Corrected | None = None,
    ) -> PathPoint:
        """A point of the path; ``far_side`` has the tangent after an event where that differs."""
        solves = self.corrector.solves - self._solves_before
        self._solves_before = self.corrector.solves
        return PathPoint.of(self._curve, solution, scale, switches, solves, events, far_side)


@Loop
def _senses(start, after, point, direction, scale) -> tuple[bool, bool]:
    """Whether a scaled direction goes on along the path, and away from the point before."""
    along = away = 0.0
    for i in range(len(scale)):
        along += direction[i] * after[i] / scale[i]
        away += direction[i] * (point[i] - start[i]) / scale[i]
    return along > 0, away > 0
