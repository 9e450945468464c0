"""Stored points and events of nonlinear modes and limit cycles, and the problems they solve."""

from collections.abc import Callable, Iterable
from typing import Any, ClassVar

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance, matrices_in, unforced
from symhbm.continuation import EventKind
from symhbm.continuation.unforced import first_harmonic, last_fold
from symhbm.model.contacts import ContactLaw
from symhbm.model.cyclic import Sector
from symhbm.numerics import FloatArray, largest_displacement, relative_difference, unknowns_of
from symhbm.response.unforced import free_problem
from symhbm.response.verification.stored_points import OF_POINTS, StoredGroup, StoredPoints
from symhbm.results import recall
from symhbm.time_domain import cycle_growth, free_motion, verdict

_OTHER_WAVES = (
    "not against the exact motion: it is that of all sectors, whose matrices one sector does not "
    "have; describe the whole disk by a Model"
)
_NOT_LINEAR = (
    "not against the exact motion: of motions without a force it is known between events, where "
    "springs and sliders are linear, not for {}"
)


class UnforcedPoints(StoredPoints):
    """The points of a dataset of motions that no force drives.

    Waves around a disk of equal sectors are verified by the equations of all sectors.
    """

    keys: ClassVar = (
        *OF_POINTS,
        "largest_displacement",
        "damping_ratio",
        "modal_amplitude",
        "growth_rate",
        "stability",
    )

    def __init__(
        self, dataset: xr.Dataset, problem: HarmonicBalance, laws: Iterable[ContactLaw] = ()
    ):
        self.request = recall(dataset, problem)[1]
        # All points of a nonlinear mode are of one problem.
        self._last: tuple[HarmonicBalance, HarmonicBalance] | None = None
        self._larger_of: dict[tuple[int, ...], tuple[HarmonicBalance, HarmonicBalance]] = {}
        super().__init__(dataset, problem, "", laws)
        kept = problem.model.kept
        numbers = [*range(problem.n_dof)] if kept is None else kept.tolist()
        assert self.request.dof is not None
        self.dof = numbers.index(self.request.dof)

    @property
    def without_exact(self) -> str | None:
        """As of any points."""
        problem = self.problem
        if not problem.model.has_matrices:
            return _OTHER_WAVES
        laws = {repr(group.law) for group in problem.curved_groups + problem.planar_groups}
        return _NOT_LINEAR.format(", ".join(sorted(laws))) if laws else None

    @property
    def amplitude(self) -> FloatArray:
        """The stored amplitude of each point."""
        return self.stored.get("amplitude", np.zeros(self.solved.shape))

    def _moved(self, problem: HarmonicBalance, index: tuple[int, ...]) -> HarmonicBalance:
        """The problem of all sectors without a force, with the parameter of a point."""
        if self.description.moving != "amplitude":
            return self._alone(super()._moved(problem, index))
        if self._last is None or self._last[0] is not problem:
            self._last = problem, self._alone(problem)
        return self._last[1]

    def _alone(self, problem: HarmonicBalance) -> HarmonicBalance:
        is_sector = isinstance(problem.model, Sector)
        return unforced(problem, self.request.nodal_diameter if is_sector else None)

    def _with(self, problem: HarmonicBalance, harmonics: tuple[int, ...]) -> HarmonicBalance:
        """As of any points; static loads are those of the problem."""
        if harmonics == problem.harmonics:
            return problem
        last = self._larger_of.get(harmonics)
        if last is None or last[0] is not problem:
            same = super()._with(problem, harmonics).with_excitation(problem.excitation)
            last = self._larger_of[harmonics] = problem, same
        return last[1]

    def _own(self) -> dict[str, Callable[[dict[str, Any], HarmonicBalance, float], float]]:
        return super()._own() | {"stability_mismatch": self._stability_mismatch}

    def _amplitude_mismatch(
        self, stored: dict[str, Any], problem: HarmonicBalance, omega: float
    ) -> float:
        """Largest relative difference of all kinds of stored amplitudes."""
        unknowns = unknowns_of(problem.basis, problem.harmonics, stored["coefficient"])
        coefficients = problem.layout.coefficients(unknowns)
        first = np.hypot(*(first_harmonic(problem, self.dof) @ unknowns))
        known: dict[str, Any] = {"amplitude": first}
        known["largest_displacement"] = largest_displacement(problem.basis, coefficients)[0]
        if "modal_amplitude" in stored:
            known["modal_amplitude"] = modal_amplitude(problem, unknowns)
        return max(
            relative_difference(np.asarray(stored[name]), np.asarray(value))
            for name, value in known.items()
            if name in stored
        )

    def _stability_mismatch(
        self, stored: dict[str, Any], problem: HarmonicBalance, omega: float
    ) -> float:
        """Difference of the growth rate over the frequency, 1 where the verdict is another one."""
        alone, dof, _ = free_problem(problem, self.request)
        assert dof is not None
        coefficient = stored["coefficient"][: alone.n_dof]
        unknowns = unknowns_of(alone.basis, alone.harmonics, coefficient)
        phase = first_harmonic(alone, dof)[1]
        rate, known = cycle_growth(alone, omega, unknowns, phase).rate, stored["growth_rate"]
        if verdict(rate, omega) != stored["stability"] or np.isnan(rate) != np.isnan(known):
            return 1.0
        return 0.0 if np.isnan(rate) else float(abs(rate - known) / omega)

    def exact_difference(self, index: tuple[int, ...]) -> float:
        """Difference from the exact free motion; NaN where none is found nearby.

        Of a nonlinear mode it has the displacement of the stored one at the instant at which the
        first harmonic of the degree of freedom is largest.
        """
        try:
            problem, omega = self.problem_at(index)
            stored = {key: values[index] for key, values in self.stored.items()}
            unknowns = unknowns_of(problem.basis, problem.harmonics, stored["coefficient"])
            ratio = stored.get("damping_ratio")
            motion = free_motion(problem, omega, unknowns, self.dof, ratio)
        except (ValueError, ArithmeticError, np.linalg.LinAlgError):
            return np.nan
        if motion is None:
            return np.nan
        coefficients = problem.layout.coefficients(unknowns)
        largest = largest_displacement(problem.basis, coefficients)[0]
        differences = [relative_difference(largest, motion.amplitude)]
        differences.append(abs(omega / motion.frequency - 1))
        if ratio is not None:
            differences.append(abs(ratio - motion.damping_ratio))
        return float(max(differences))


_AT_POINT = 1e-6
"""Distance of an event from a point, relative, up to which it is that of the point."""
_ZERO = 1e-6
"""Margin of a switch over those at the points beside it that is 0 but for round-off."""
_TURNS = {EventKind.FOLD: None, EventKind.DAMPING_TURNS: "damping_ratio"}
"""What turns at an event, None for the moving parameter."""


class StoredEvents(StoredGroup):
    """The events along paths: each is at a stored point, where its kind says what happens."""

    kind = "events"

    def __init__(self, points: UnforcedPoints):
        self.points, self.dataset = points, points.dataset
        self.dims = (*points.outer, "event")
        kinds = self.dataset["event_kind"].transpose(*self.dims)
        self.solved = kinds.values.astype(str) != ""
        self._kinds = kinds.values
        moving = points.description.moving
        names = ("frequency", moving, "amplitude", "damping_ratio", "modal_amplitude")
        known = {*self.dataset.variables}
        both = [name for name in names if {name, f"event_{name}"} <= known]
        self._along = {name: self.dataset[name].transpose(*points.dims).values for name in both}
        self._at = {name: self.dataset[f"event_{name}"].transpose(*self.dims) for name in both}
        self.moving = {name: self._at[name] for name in (moving, "frequency") if name in self._at}

    @property
    def available(self) -> list[str]:
        """The one figure of events."""
        return ["event_mismatch"]

    def figures(self, index: tuple[int, ...]) -> dict[str, float]:
        """Distance of an event from its point, 1 where its kind is not what happens there."""
        *outer, _ = index
        along = {name: values[(*outer,)] for name, values in self._along.items()}
        distance = np.zeros(len(along["frequency"]))
        for name, values in along.items():
            value = float(self._at[name].values[index])
            unit = 1.0 if name == "damping_ratio" else np.maximum(np.abs(values), abs(value))
            # What is not a number is no point.
            apart = np.abs(values - value) / np.where(unit > 0, unit, 1.0)
            distance = np.maximum(distance, np.where(np.isnan(apart), np.inf, apart))
        point = int(np.argmin(distance))
        if not distance[point] <= _AT_POINT:
            return {"event_mismatch": 1.0 if np.isinf(distance[point]) else distance[point]}
        try:
            happens = self._happens(index, point, along)
        except (ValueError, ArithmeticError, IndexError):
            happens = False
        return {"event_mismatch": float(distance[point]) if happens else 1.0}

    def _happens(self, index: tuple[int, ...], point: int, along: dict[str, FloatArray]) -> bool:
        """Whether what the kind of an event says happens at a point."""
        kind = str(self._kinds[index])
        if kind in _TURNS:
            name = _TURNS[EventKind(kind)] or self.points.description.moving
            beside = self._beside(index, point)
            if len(beside) < 2:
                return True
            before, after = np.diff(along[name][[beside[0], point, beside[1]]])
            return bool(before * after <= 0)
        if kind in list(EventKind):
            return True
        contact = int(self.dataset["event_contact"].transpose(*self.dims).values[index])
        here = self._margins(index, point, contact, kind)
        beside = [self._margins(index, i, contact, kind) for i in self._beside(index, point)]
        scale = np.max([np.abs(margins) for margins, _ in beside or [here]], axis=0)
        zero = np.abs(here[0]) <= _ZERO * scale
        if len(beside) == 2:
            # What begins was off before: its margin rises.
            zero &= (beside[1][0] > beside[0][0]) == here[1]
        return bool(zero.any())

    def _beside(self, index: tuple[int, ...], point: int) -> list[int]:
        """Numbers of the points before and after another one, on its branch."""
        outer = index[:-1]
        solved = self.points.solved[outer]
        branch = np.zeros(len(solved), dtype=int)
        if "cycle_branch" in self.dataset.variables:
            branch = self.dataset["cycle_branch"].transpose(*self.points.dims).values[outer]
        return [
            i
            for i in (point - 1, point + 1)
            if 0 <= i < len(solved) and solved[i] and branch[i] == branch[point]
        ]

    def _margins(
        self, index: tuple[int, ...], point: int, contact: int, kind: str
    ) -> tuple[FloatArray, np.ndarray]:
        """Margins at a point of the switches that an event of a contact and a kind is of.

        And whether they begin by it.
        """
        at = (*index[:-1], point)
        problem, omega = self.points.problem_at(at)
        coefficient = self.points.stored["coefficient"][at]
        states = problem.locate(unknowns_of(problem.basis, problem.harmonics, coefficient), omega)
        margins, begin = [], []
        for number in np.flatnonzero(problem.contacts.of_switches == contact).tolist():
            group, _, place = problem.contacts.switch(number)
            names = group.law.switches[place]
            if kind in (names.begins, names.ends):
                margins.append(states.margins[number])
                begin.append(kind == names.begins)
        return np.array(margins), np.array(begin, dtype=bool)


class StoredFold(StoredGroup):
    """Values of a parameter beyond which no cycle was found, one of each curve."""

    kind = "folds"

    def __init__(self, points: UnforcedPoints):
        self.points, self.dataset, self.dims = points, points.dataset, (*points.outer,)
        name = f"fold_{points.description.moving}"
        self._value = self.dataset[name].transpose(*self.dims)
        self.moving = {name: self._value}
        self.solved = np.ones(self._value.shape, dtype=bool)

    @property
    def available(self) -> list[str]:
        """The one figure of folds, where there are events to compare with."""
        return ["fold_mismatch"] if "event_kind" in self.dataset.variables else []

    def figures(self, index: tuple[int, ...]) -> dict[str, float]:
        """Distance from the fold that events and points tell, 1 where only one of both is one.

        On a grid points between its values are not stored: the value is that of a fold, and no
        point is beyond it.
        """
        moving, chosen = self.points.description.moving, dict(zip(self.dims, index, strict=True))
        part, value = self.dataset.isel(chosen), float(self._value.values[index])
        is_fold = part["event_kind"].values.ravel().astype(str) == EventKind.FOLD
        folds = part[f"event_{moving}"].values.ravel()[is_fold]
        values = self.points.moving[moving].values[index][self.points.solved[index]]
        if self.points.description.on_grid:
            if np.isnan(value):
                return {"fold_mismatch": 0.0}
            folds = folds[np.argsort(np.abs(folds - value))][:1]
        expected = last_fold(folds, np.append(values.ravel(), folds))
        if np.isnan(expected) or np.isnan(value):
            return {"fold_mismatch": float(np.isnan(expected) != np.isnan(value))}
        return {"fold_mismatch": abs(value - expected) / (max(abs(value), abs(expected)) or 1.0)}


def modal_amplitude(problem: HarmonicBalance, unknowns: FloatArray) -> float:
    """Root of the sum of ``X_n^H M X_n`` over the harmonics above 0 [kg^1/2 m]."""
    phasors, square = problem.basis.phasors(problem.layout.coefficients(unknowns)), 0.0
    for n, phasor in zip(problem.harmonics, phasors.T, strict=True):
        if n:
            square += float((phasor.conj() @ (matrices_in(problem, n).mass_matrix @ phasor)).real)
    return float(np.sqrt(max(square, 0.0)))
