"""All maxima of the response between two frequencies: located peaks and the ends of the band."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Branch, FrequencyProblem, Status
from symhbm.continuation.between import Peak, PeakKind
from symhbm.model import find_symmetry
from symhbm.numerics import RADIANS, largest_displacement
from symhbm.peaks.maximum import Maximum

COMPLETE = (Status.REACHED_END, Status.OTHER_SOLUTIONS, Status.BRANCH_POINTS)
"""Ends of complete curves."""


@dataclass(frozen=True)
class Survey:
    """Maxima of each degree of freedom over a frequency response, the highest first.

    ``unbounded`` are peaks that nothing limits; ``status`` tells how the curve ended.
    """

    summits: list[Maximum]
    unbounded: list[Peak]
    status: Status

    @property
    def complete(self) -> bool:
        """Whether the whole band was followed."""
        return self.status in COMPLETE

    @property
    def height(self) -> float:
        """The largest response found [m], infinite where a peak is unbounded or none was found."""
        if self.unbounded or not self.summits:
            return np.inf
        return self.summits[0].amplitude


def sector_of(problem: HarmonicBalance) -> HarmonicBalance:
    """The equations of one sector where all are alike, else the problem itself."""
    if not problem.single_valued or problem.symmetry is not None:
        return problem
    symmetry = find_symmetry(problem.model, problem.excitation, problem.basis)
    if symmetry is None:
        return problem
    return problem.of_sector(symmetry)


def survey(
    problem: HarmonicBalance, bands: Sequence[tuple[float, float]], max_points: int = 5000
) -> Survey:
    """All maxima in ``bands`` [Hz], by frequency responses over each of them."""
    summits: list[Maximum] = []
    unbounded: list[Peak] = []
    status = Status.REACHED_END
    for band in bands:
        ends = RADIANS * band[0], RADIANS * band[1]
        walk = Branch(FrequencyProblem(problem), ends, max_points, per_dof=True)
        if walk.status not in COMPLETE:
            status = walk.status
        unbounded += [peak for peak in walk.peaks if peak.kind == PeakKind.UNBOUNDED]
        bounded = [peak for peak in walk.peaks if peak.kind != PeakKind.UNBOUNDED]
        summits += [Maximum.at_peak(problem, peak) for peak in bounded]
        for point in {id(p): p for p in (walk.points[:1] + walk.points[-1:])}.values():
            if point.value in ends:
                summits += _edges(problem, point.unknowns, point.value)
    summits.sort(key=lambda summit: -summit.amplitude)
    return Survey(summits, unbounded, status)


def _edges(problem: HarmonicBalance, unknowns, frequency: float) -> list[Maximum]:
    """The responses of all degrees of freedom at an end of the band."""
    amplitude, _ = largest_displacement(problem.basis, problem.coefficients(unknowns))
    top = amplitude.max(initial=0.0)
    dofs = np.flatnonzero(amplitude >= 0.5 * top) if top > 0 else []
    return [Maximum.at_edge(problem, unknowns, frequency, int(dof)) for dof in dofs]
