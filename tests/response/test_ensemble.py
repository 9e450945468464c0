"""Mistuned rings: every curve complete, every peak that of an independent dense scan.

The ensemble is that of the source's Fig. 12: 13 blades, every contact with its own friction
coefficient, stiffness and normal load. All rings are seeded; a failure names its sample.
"""

from functools import lru_cache

import numpy as np
import pytest
from dense_scan import TWO_PI, Ring, Top, scan, tops

import symhbm as sh
from symhbm.continuation.correctors import corrector_of
from symhbm.continuation.path import Path
from symhbm.continuation.problem import FrequencyProblem
from symhbm.continuation.start import solve_point
from symhbm.continuation.status import Status
from tests.problems import ring_of_blades
from tests.quick import quick_first

BLADES = 13
MASS, DAMPING, STIFFNESS = 1.0, 0.5, 1e4
BAND = (50.0, 350.0)
REACHED_END = "the end of the band was reached"

SAME_PLACE = 1e-6
"""Required, relatively; both sides solve for the slope, so that they agree to 1e-10."""
ROUND_OFF = 1e-9
"""Prominence below which a maximum may be found or not, and of any kind: balances of 1e-16 of
forces that exceed f0 by up to 1e4 (contact stiffness over damping force) fix an amplitude to about
1e-11 and its slope to less."""


@lru_cache
def tuned():
    disk = ring_of_blades(
        BLADES,
        mass=MASS,
        stiffness=STIFFNESS,
        damping=DAMPING,
        contact_stiffness=1e6,
        normal_load=10.0,
    )
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(3, amplitude=1.0), (1,))


def mistuned(sample, load=10.0, contact_stiffness=1e6, engine_order=3):
    """Uniform and independent per contact: k_d +-20 %, mu +-40 %, F_n +-30 %."""
    rng = np.random.default_rng([1949, sample])
    stiffness, friction, loads = (
        nominal * (1 + width * rng.uniform(-1, 1, BLADES))
        for nominal, width in ((contact_stiffness, 0.2), (0.5, 0.4), (load, 0.3))
    )
    return tuned().with_parameters(
        contact_stiffness=stiffness,
        friction_coefficient=friction,
        normal_load=loads,
        engine_order=engine_order,
    )


def rewritten(problem):
    """The equations of a ring, written anew."""
    parameters = problem.parameters
    limit = np.broadcast_to(parameters["friction_coefficient"] * parameters["normal_load"], BLADES)
    stiffness = np.broadcast_to(parameters["contact_stiffness"], BLADES)
    order = int(parameters["engine_order"])
    return Ring(stiffness, limit, order, MASS, DAMPING, STIFFNESS)


def peaks_of(curve):
    """Peaks of a curve as (frequency, amplitude, kind)."""
    return [
        (float(hz), float(level), str(kind))
        for hz, level, kind in zip(
            curve.peak_frequency.values,
            curve.peak_amplitude.values,
            curve.peak_kind.values,
            strict=True,
        )
    ]


def differences(located, expected: list[Top]) -> list[str]:
    """What tells located peaks from those of a scan, in words; nothing if they are the same."""
    words, left = [], list(located)
    for top in expected:
        near = [peak for peak in left if abs(peak[0] / top.hz - 1) < SAME_PLACE]
        if not near:
            if top.prominence > ROUND_OFF:
                words.append(f"missed: {top}")
            continue
        peak = min(near, key=lambda peak: abs(peak[0] - top.hz))
        left.remove(peak)
        if top.prominence <= ROUND_OFF:
            continue
        if abs(peak[1] / top.level - 1) > 1e-6:  # required
            words.append(f"another value: {peak}, {top}")
        if peak[2] != top.kind:
            words.append(f"another kind: {peak}, {top}")
    return words + [f"invented: {peak}" for peak in left]


def assert_complete(curve):
    assert str(curve.status.values) == REACHED_END
    assert curve.converged.all()
    heading = np.sign(curve.frequency.values[-1] - curve.frequency.values[0])
    assert np.all(np.diff(curve.frequency.values) * heading > 0)


def work(problem):
    """Points, rejected steps and linear solves of the path, without peaks."""
    curve = FrequencyProblem(problem)
    corrector = corrector_of(curve)
    start, end = (TWO_PI * hz for hz in BAND)
    path = Path(curve, solve_point(problem, start).unknowns, start, end, corrector)
    points = list(path)
    assert path.status == Status.REACHED_END
    return len(points), path.rejected, corrector.solves


def assert_peaks_of_the_scan(problem, band, spacing=0.005, followed=BAND):
    curve = sh.frf(problem, followed, progress=False)
    assert_complete(curve)
    ring = rewritten(problem)
    points = scan(ring, band, spacing=spacing)
    inside = [peak for peak in sorted(peaks_of(curve)) if band[0] < peak[0] < band[1]]
    expected = tops(ring, points)
    assert expected
    assert differences(inside, expected) == []


@pytest.mark.slow
@pytest.mark.parametrize(("sample", "band"), quick_first([(0, (70, 90)), (1, (285, 325))], 1))
def test_peaks_of_one_harmonic(sample, band):
    """A part of the band at the resolution of the whole."""
    assert_peaks_of_the_scan(mistuned(sample), band)


@pytest.mark.parametrize(
    ("sample", "band", "followed"),
    [
        (41, (78.83, 78.87), BAND),
        (41, (78.83, 78.87), BAND[::-1]),
        (1, (273.2, 273.4), BAND[::-1]),
        (52, (196.0, 196.9), BAND[::-1]),
        (63, (77.24, 77.29), BAND[::-1]),
    ],
)
def test_peaks_next_to_an_onset_of_slip(sample, band, followed):
    """The slope changes by the root of the distance, which no cubic between two points follows."""
    assert_peaks_of_the_scan(mistuned(sample), band, followed=followed)


@pytest.mark.slow
@pytest.mark.parametrize("sample", range(100))
def test_all_peaks_of_one_harmonic(sample):
    """0.005 Hz over the band, 0.0005 Hz wherever a maximum may hide."""
    assert_peaks_of_the_scan(mistuned(sample), BAND)


def test_the_scan_solves_the_equations_of_the_library():
    """Written twice: the forces of either balance at the other's solution."""
    problem, hz = mistuned(0), np.array([60.0, 77.3, 148.66, 196.0, 292.0])
    points = rewritten(problem).solve(hz)
    assert points.slip.any()
    for i in range(len(hz)):
        # x = Re(X exp(i tau)): the sine coefficient is minus the imaginary part.
        unknowns = np.tile([1, -1], BLADES) * points.unknowns[i]
        evaluation = problem.evaluate(unknowns, TWO_PI * hz[i])
        assert evaluation.norm <= 1e-12  # the tolerance of the library
        np.testing.assert_array_equal(evaluation.states.switches, points.slip[i])


@pytest.mark.parametrize(
    "n_rings",
    [pytest.param(10, id="ten rings"), pytest.param(100, id="all", marks=pytest.mark.slow)],
)
def test_work_of_a_curve(n_rings):
    """Few points, few steps in vain, few linear solves, with all onsets and ends of slip."""
    points, rejected, solves = np.median([work(mistuned(i)) for i in range(n_rings)], axis=0)
    assert points <= 230
    assert rejected <= 15
    assert solves <= 1250


def assorted(sample):
    """Loads, engine orders and contact stiffnesses far from the ensemble's."""
    rng = np.random.default_rng([1862, sample])
    return mistuned(
        sample,
        load=float(rng.choice([1, 3, 30, 100])),
        engine_order=int(rng.choice([1, 2, 6])),
        contact_stiffness=float(10 ** rng.uniform(4, 9)),
    )


@pytest.mark.parametrize(
    "sample",
    [pytest.param(i, marks=[pytest.mark.slow] if i >= 2 else []) for i in range(60)],
)
def test_assorted_rings_reach_the_end(sample):
    curve = sh.frf(assorted(sample), BAND, progress=False)
    assert_complete(curve)
    assert curve.frequency.values[[0, -1]].tolist() == list(BAND)
