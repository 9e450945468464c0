"""Phase resonances along a path: where the response lags the force by a quarter of its period.

There the force does work alone, and stores nothing in the mean: over all force levels these points
are the backbone of a resonance.

Reference: S. Peter, R.I. Leine, Excitation power quantities in phase resonance testing of nonlinear
systems with phase-locked-loop excitation, Mechanical Systems and Signal Processing 96 (2017),
139-158.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import scipy

from symhbm.balance import HarmonicBalance
from symhbm.continuation import ContinuationProblem, Corrector, EventKind, PathState, slope_of
from symhbm.numerics import FloatArray
from symhbm.time_domain import Change, Known, held_between

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
        ends = left.after, right.before
        stored, after = (_in_phase(curve, end) for end in ends)
        if not stored * after < 0:
            continue
        segment = held_between(corrector, *ends)

        def solved(share: float, segment=segment, ends=ends) -> PathState:
            found = ends[int(share)] if share in (0.0, 1.0) else segment.solve(share)
            if found is None:
                raise ArithmeticError("the path between two points cannot be solved for")
            return found

        try:
            share = scipy.optimize.brentq(  # type: ignore[attr-defined]
                lambda share, solved=solved: _in_phase(curve, solved(share)), 0, 1, xtol=1e-14
            )
            state = solved(float(share))
        except ArithmeticError:
            lost += 1
            continue
        if _is_resonance(curve, state):
            changes.append(Change(number, EventKind.PHASE, state))
    return changes, lost


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
    basis, force = problem.basis, problem.force(frequency)
    moved = problem.layout.coefficients(motion)
    for harmonic in sorted(n for n in problem.harmonics if n > 0):
        columns = [basis.component(harmonic, sine) for sine in (False, True)]
        exciting, moving = (part[:, columns] @ [1, -1j] for part in (force, moved))
        if exciting.any():
            size = np.linalg.norm(exciting) * np.linalg.norm(moving)
            return complex(np.vdot(exciting, moving)), float(size)
    return 0j, 0.0
