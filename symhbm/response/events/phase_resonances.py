"""Phase resonances along a path: where the response lags the force by a quarter of its period.

There the force does work alone, and stores nothing in the mean: over all force levels these points
are the backbone of a resonance.

Reference: S. Peter, R.I. Leine, Excitation power quantities in phase resonance testing of nonlinear
systems with phase-locked-loop excitation, Mechanical Systems and Signal Processing 96 (2017),
139-158.
"""

from collections.abc import Sequence
from functools import partial
from itertools import pairwise

import numpy as np

from symhbm.balance import HarmonicBalance
from symhbm.continuation import ContinuationProblem, Corrector, EventKind, PathState, slope_of
from symhbm.numerics import FloatArray
from symhbm.time_domain import Change, Known, held_between

_SHARES = np.arange(1, 8) / 8
"""Shares of a step at which the lag is estimated."""
_ALL = [0.0, *_SHARES.tolist(), 1.0]
_ROUND_OFF = 1e-9
"""Work of a force that is round-off, over that of as large a response in phase with it."""


def phase_resonances(
    corrector: Corrector, points: Sequence[Known | None]
) -> tuple[list[Change], int]:
    """The phase resonances between the points of one path, and how many were not located.

    A point that is None interrupts it.
    """
    curve, changes, lost = corrector.curve, list[Change](), 0
    for number, (left, right) in enumerate(pairwise(points)):
        if left is None or right is None:
            continue
        try:
            found = _quarters(corrector, left.after, right.before)
        except ArithmeticError:
            lost += 1
            continue
        resonances = (state for state in found if _is_resonance(curve, state))
        changes += [Change(number, EventKind.PHASE, state) for state in resonances]
    return changes, lost


def _quarters(corrector: Corrector, left: PathState, right: PathState) -> list[PathState]:
    """The solutions between two points that lag by a quarter of the period, or are a quarter ahead.

    A resonance and an antiresonance within one step are separated by a cubic between the points.
    Raises ArithmeticError where the path cannot be solved for.
    """
    curve = corrector.curve
    segment = held_between(corrector, left, right)
    states, slopes = segment.interpolate(_SHARES)
    inner = map(PathState, states, slopes)
    signs = [_in_phase(curve, at) > 0 for at in (left, *inner, right)]
    if len({*signs}) == 1:
        return []

    turns = [i for i, (sign, other) in enumerate(pairwise(signs)) if sign != other]
    # Between two turns of the cubic the path itself tells.
    middles = [(_ALL[i + 1] + _ALL[j]) / 2 for i, j in pairwise(turns)]
    shares = [0.0, *middles, 1.0]
    values = [_in_phase(curve, segment.at(share)) for share in shares]
    return [
        segment.zero(partial(_in_phase, curve), *between)
        for between, (low, high) in zip(pairwise(shares), pairwise(values), strict=True)
        if low * high < 0
    ]


def _in_phase(curve: ContinuationProblem, at: PathState) -> float:
    """Share of the response in phase with the force: the cosine of the lag of a single force."""
    problem, frequency = curve.at(float(at.state[-1]))
    work, size = _work(problem, frequency, at.state[:-1])
    return work.real / abs(work) if abs(work) > _ROUND_OFF * size else 0.0


def _is_resonance(curve: ContinuationProblem, at: PathState) -> bool:
    """Whether the lag grows with the frequency, and the point is no antiresonance."""
    problem, frequency = curve.at(float(at.state[-1]))
    slope = slope_of(problem.evaluate(at.state[:-1], frequency))
    return _work(problem, frequency, slope)[0].real < 0


def _work(problem: HarmonicBalance, frequency: float, motion: FloatArray) -> tuple[complex, float]:
    """``F^H X`` in the lowest harmonic above 0 that is excited [N m], and the sizes of both.

    Forces and motions are ``a - i b``; ``motion`` (n_unknowns,) [m].
    """
    parts = problem.force(frequency), problem.layout.coefficients(motion)
    forces, motions = (problem.basis.phasors(part).T for part in parts)
    for harmonic, exciting, moving in zip(problem.harmonics, forces, motions, strict=True):
        if harmonic and exciting.any():
            size = np.linalg.norm(exciting) * np.linalg.norm(moving)
            return complex(np.vdot(exciting, moving)), float(size)
    return 0j, 0.0
