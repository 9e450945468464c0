"""One response curve as plain arrays: what a worker computes for one parameter set."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from symhbm.continuation import Path
from symhbm.corrector import Corrector, hyperplane, natural_scale, unit_parameter
from symhbm.curve import FrequencyCurve
from symhbm.events import PathPoint
from symhbm.extremes import largest_displacement
from symhbm.fourier import FloatArray
from symhbm.hermite import cubic
from symhbm.newton import ACCEPTED, NewtonResult, newton
from symhbm.peaks import Peak, find_peaks, unbounded_peak
from symhbm.residual import HarmonicBalance
from symhbm.start import solve_point
from symhbm.status import Status

RADIANS = 2 * np.pi

Table = dict[str, Any]


@dataclass
class Branch:
    """A response curve.

    ``points``, ``peaks`` and ``events`` hold arrays by the names of the dataset, each with the
    point, peak or event as the first axis; ``counts``, one number each.
    """

    points: Table
    peaks: Table
    events: Table
    status: str
    counts: dict[str, int] = field(default_factory=dict)


def describe(problem: HarmonicBalance, unknowns: FloatArray, frequency: float) -> Table:
    """All results at one point; ``frequency`` in Hz. A point that is no solution becomes NaN."""
    evaluation = problem.evaluate(unknowns, RADIANS * frequency)
    friction, model = evaluation.friction, problem.model
    coefficients = problem.coefficients(unknowns)
    relative = problem.relative(unknowns)
    force = model.contact_stiffness[:, None] * np.einsum("cij,cj->ci", friction.matrix, relative)
    force += (model.friction_coefficient * model.normal_load)[:, None] * friction.vector
    # Work of the friction force over a period: the integral of f dy.
    velocity = relative @ problem.basis.derivative_matrix.T
    converged = bool(evaluation.norm <= ACCEPTED)
    result = dict(
        frequency=np.float64(frequency),
        coefficient=_by_harmonic(problem, coefficients),
        amplitude=largest_displacement(problem.basis, coefficients)[0],
        theta_0=friction.theta_0,
        theta_star=friction.theta_star,
        stick_fraction=friction.stick_fraction,
        dissipation=np.einsum("ci,ci->c", force, velocity / problem.basis.norm),
        residual_norm=np.float64(evaluation.norm),
    )
    if not converged:
        result = {
            name: value if name in ("frequency", "residual_norm") else np.full_like(value, np.nan)
            for name, value in result.items()
        }
    state = friction.slip if converged else np.full(model.n_contacts, -1)
    reversals = friction.reversals if converged else np.full(model.n_contacts, -1)
    return result | dict(
        contact_state=state.astype(np.int8),
        reversals=reversals.astype(np.int32),
        converged=np.bool_(converged),
        contact_model_valid=np.bool_(converged),
    )


def compute_branch(
    problem: HarmonicBalance,
    band: tuple[float, float],
    at: FloatArray | None,
    max_points: int,
) -> Branch:
    """Follow the response over the ``band`` (Hz), with points on the grid ``at`` (Hz) if given."""
    walk = _Walk(problem, band, max_points)
    walk.go()
    if at is None:
        points = [
            describe(problem, p.unknowns, walk.hertz(p.value)) | {"iterations": np.int32(p.solves)}
            for p in walk.points
        ]
    else:
        points = [walk.at(float(frequency)) for frequency in at]
    if walk.status == Status.REACHED_END and not all(point["converged"] for point in points):
        walk.status = Status.POINTS_MISSING
    events = [
        dict(event_frequency=walk.hertz(p.value), event_kind=e.kind, event_contact=e.contact)
        for p in walk.points
        for e in p.events
    ]
    counts = dict(
        n_points=len(walk.points),
        n_peaks=len(walk.peaks),
        n_events=len(events),
        rejected_steps=walk.rejected,
        linear_solves=walk.corrector.solves,
    )
    return Branch(
        points=_columns(points, walk.missing(band[0])),
        peaks=_columns([_peak(problem, p) for p in walk.peaks], _peak(problem, walk.no_peak())),
        events=_columns(events, dict(event_frequency=0.0, event_kind="", event_contact=0)),
        status=str(walk.status),
        counts=counts,
    )


class _Walk:
    """A path over a band, taken up again beyond each resonance that nothing bounds."""

    def __init__(self, problem: HarmonicBalance, band: tuple[float, float], max_points: int):
        self.problem = problem
        self.curve = FrequencyCurve(problem)
        self.corrector = Corrector(self.curve)
        self.band = band
        self.points: list[PathPoint] = []
        self.peaks: list[Peak] = []
        self.rejected = 0
        self.status = Status.NO_START
        self._max_points = max_points
        self._ends = {RADIANS * edge: edge for edge in band}

    def hertz(self, value: float) -> float:
        """Frequency in Hz; the edges of the band come back as they were given."""
        return self._ends.get(value, value / RADIANS)

    def go(self) -> None:
        start, end = (RADIANS * edge for edge in self.band)
        lost = 0
        found = solve_point(self.problem, start)
        self.corrector.solves += found.iterations
        if found.status == Status.SYSTEM_SINGULAR:
            self.status = found.status
        while found.converged and start < end:
            # A path that cannot be taken up beyond its pole keeps the status it ended with.
            room = self._max_points - len(self.points)
            path = Path(self.curve, found.unknowns, start, end, self.corrector, room)
            segment = list(path)
            self.points += segment
            self.rejected += path.rejected
            self.status = path.status
            peaks, missing = find_peaks(self.curve, segment, self.corrector)
            self.peaks += peaks
            lost += missing
            if path.status != Status.UNBOUNDED:
                break
            peak = unbounded_peak(self.problem, segment[-1])
            if not segment[-1].value < peak.value < end:
                break  # the band ends on the way up: an edge
            self.peaks.append(peak)
            for distance in np.array([1, 10, 100, 1000]) * (peak.value - segment[-1].value):
                start = peak.value + distance
                found = self._newton(-segment[-1].unknowns, start)
                if not found.converged:
                    found = solve_point(self.problem, start)
                if found.converged:
                    break
        if lost and self.status == Status.REACHED_END:
            self.status = Status.PEAK_NOT_LOCATED

    def at(self, frequency: float) -> Table:
        """The response at one frequency (Hz) of the band, from the path around it."""
        value = RADIANS * frequency
        before = self.corrector.solves
        unknowns = self._from_path(value)
        if unknowns is not None and self.problem.evaluate(unknowns, value).norm > ACCEPTED:
            # A contact changes its state for a moment between two points of the path.
            found = self._newton(unknowns, value)
            unknowns = found.unknowns if found.converged else None
        if unknowns is None and self.points:
            found = solve_point(self.problem, value)
            self.corrector.solves += found.iterations
            unknowns = found.unknowns if found.converged else None
        solves = self.corrector.solves - before
        if unknowns is None:
            return self.missing(frequency) | {"iterations": np.int32(solves)}
        return describe(self.problem, unknowns, frequency) | {"iterations": np.int32(solves)}

    def _newton(self, unknowns: FloatArray, value: float) -> NewtonResult:
        found = newton(lambda trial: self.problem.evaluate(trial, value), unknowns)
        self.corrector.solves += found.iterations
        return found

    def _from_path(self, value: float) -> FloatArray | None:
        values = [point.value for point in self.points]
        right = int(np.searchsorted(values, value))
        if right < len(values) and values[right] == value:
            return self.points[right].unknowns
        if not 0 < right < len(values):
            return None
        here, there = self.points[right - 1], self.points[right]
        share = (value - here.value) / (there.value - here.value)
        guess = np.append(_between(here, there, share), value)
        scale = natural_scale(guess)
        plane = hyperplane(guess, scale, unit_parameter(len(scale)))
        found = self.corrector.correct(guess, scale, plane, here.slip)
        return None if found is None else found.point[:-1]

    def missing(self, frequency: float) -> Table:
        """The entry of a frequency without a solution."""
        nothing = describe(self.problem, np.zeros(self.problem.n_unknowns), frequency)
        blank = {
            name: np.full_like(value, np.nan) if value.dtype.kind == "f" else value * 0 - 1
            for name, value in nothing.items()
            if value.dtype.kind != "b"
        }
        flags = dict(converged=np.bool_(False), contact_model_valid=np.bool_(False))
        return (
            nothing | blank | flags | dict(frequency=np.float64(frequency), iterations=np.int32(0))
        )

    def no_peak(self) -> Peak:
        """A peak that stands for the shapes of an empty table."""
        nothing = np.zeros(self.problem.n_unknowns)
        return Peak(0.0, 0.0, 0, "", nothing, 0.0)  # type: ignore[arg-type]


def _between(here: PathPoint, there: PathPoint, share: float) -> FloatArray:
    """Unknowns between two points of a path by cubic interpolation over the parameter."""
    length, step = there.value - here.value, there.unknowns - here.unknowns
    left, right = (
        length * point[:-1] / point[-1] if point[-1] * length > 0 else step
        for point in (here.after, there.before)
    )
    return cubic(here.unknowns, there.unknowns, (left, right), share)


def _by_harmonic(problem: HarmonicBalance, coefficients: FloatArray) -> FloatArray:
    """Coefficients as (n_dof, n_harmonics, 2); the sine of harmonic 0 is 0."""
    result = np.zeros((len(coefficients), len(problem.harmonics), 2))
    at = np.searchsorted(problem.harmonics, problem.basis.order)
    result[:, at, problem.basis.is_sine.astype(int)] = coefficients
    return result


def _peak(problem: HarmonicBalance, peak: Peak) -> Table:
    return dict(
        peak_frequency=np.float64(peak.value / RADIANS),
        peak_amplitude=np.float64(peak.amplitude),
        peak_dof=np.int32(peak.dof),
        peak_kind=str(peak.kind),
        peak_residual_norm=np.float64(peak.residual_norm),
        peak_coefficient=_by_harmonic(problem, problem.coefficients(peak.unknowns)),
    )


def _columns(rows: list, like: dict) -> Table:
    """Rows of named values as named arrays; ``like`` gives names and shapes where there is none."""
    table = {}
    for name, value in like.items():
        dtype = object if isinstance(value, str) else np.asarray(value).dtype
        table[name] = np.empty((len(rows), *np.shape(value)), dtype=dtype)
        for i, row in enumerate(rows):
            table[name][i] = row[name]
    return table
