"""Branches with the switching angles as unknowns, over the parts of a band where these apply.

Where a branch ends because a contact begins to reverse while it slips, the form may apply again
beyond. A solution there starts the next branch, which is followed back to its first point and from
there to its last.
"""

from collections.abc import Sequence
from dataclasses import replace

from symhbm.continuation.angles.corrector import AngleCorrector
from symhbm.continuation.branch import Branch
from symhbm.continuation.following import follow_with
from symhbm.continuation.problem import ContinuationProblem
from symhbm.continuation.restarts import chained
from symhbm.continuation.status import Status
from symhbm.numerics import FloatArray

_BEYOND = 1e-5
"""Distance beyond the end of a branch, relative, at which located friction tells why it ended."""
ANGLES_ENDED = (Status.ANGLES_DO_NOT_APPLY, Status.ANGLES_NOT_CONVERGED)


def angle_branches(
    curve: ContinuationProblem, band: tuple[float, float], max_points: int, per_dof: bool
) -> list[Branch]:
    """The branches over the parts of a band in which the form applies, in the order of the band.

    The first begins where the band does; it has no points where the form does not apply there.
    """

    def follow(part: tuple[float, float], guess: FloatArray | None) -> Branch:
        return _angle_branch(curve, part, max_points, per_dof, guess)

    def applies(branch: Branch, value: float) -> bool | None:
        assert isinstance(branch.corrector, AngleCorrector)
        return branch.corrector.applies(value)

    return chained(follow, band, ANGLES_ENDED, applies)


def _angle_branch(
    curve: ContinuationProblem,
    band: tuple[float, float],
    max_points: int,
    per_dof: bool,
    guess: FloatArray | None = None,
) -> Branch:
    """One branch; arguments as of `follow_branch`."""
    assert curve.angles is not None
    corrector = AngleCorrector(curve, curve.angles)
    branch = follow_with(corrector, corrector.solve_from_scratch, band, max_points, per_dof, guess)
    if branch.status not in (Status.NO_START, Status.MINIMUM_STEP):
        return branch
    # Located friction tells whether the form applies where the branch ends.
    start, end = band
    value = start
    if branch.points:
        last = branch.points[-1].state
        distance = min(_BEYOND * curve.scale(last)[-1], abs(end - last[-1]))
        value = last[-1] + (distance if end > start else -distance)
    applies = corrector.applies(float(value))
    if applies is None:
        return branch
    ended = Status.ANGLES_NOT_CONVERGED if applies else Status.ANGLES_DO_NOT_APPLY
    return replace(branch, status=ended)


def covered(branches: Sequence[Branch], unit: float, band: tuple[float, float]) -> float:
    """Share of a band, in a ``unit`` of its values, that branches cover with points."""
    if all(branch.status == Status.REACHED_END for branch in branches):
        return 1.0
    ends = [
        (branch.points[0].value, branch.points[-1].value) for branch in branches if branch.points
    ]
    lengths = [abs(last - first) for first, last in ends]
    return sum(lengths) / (unit * abs(band[1] - band[0]))
