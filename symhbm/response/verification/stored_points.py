"""Points and peaks of a dataset that are verified one by one, and the problems they are of."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from typing import Any, ClassVar

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance, ValueOf
from symhbm.continuation import FrequencyProblem
from symhbm.continuation.angles import AngleCorrector
from symhbm.model.contacts import ContactLaw
from symhbm.numerics import (
    RADIANS,
    FloatArray,
    larger_set,
    largest_displacement,
    relative_difference,
    unknowns_of,
)
from symhbm.response.describe import variables_of_laws
from symhbm.response.verification.figures import (
    CONTACT,
    FIGURES,
    amplitude_difference,
    point_figures,
)
from symhbm.results import OF_PEAKS, VARIABLES, Description, meaning, records_of_problem
from symhbm.results.archive import ArchiveError, rebuild
from symhbm.time_domain import exact_motion_of


def not_checked(bound: float | None) -> dict[str, Any]:
    """JSON entries of a figure that was not computed: it does not pass."""
    empty = {"worst": None, "bound": bound, "at": {}, "n_broken": 0}
    return empty | {"broken": bound is not None}


class StoredGroup(ABC):
    """Some of what a dataset stores; an index has one entry per dimension of ``dims``.

    ``kind`` names what is counted, ``prefix`` begins the names of the figures; ``solved`` tells
    where there is something, and ``moving`` what labels it beside the coordinates.
    """

    dataset: xr.Dataset
    kind: str
    prefix: str = ""
    dims: tuple[str, ...]
    solved: np.ndarray
    moving: dict[str, xr.DataArray]

    @property
    @abstractmethod
    def available(self) -> list[str]:
        """Names of the figures that can be computed."""

    @abstractmethod
    def figures(self, index: tuple[int, ...]) -> dict[str, float]:
        """All figures but the exact difference; those not computable are infinite."""

    def worst(self, values: FloatArray, bound: float | None) -> dict[str, Any]:
        """Largest value, the place it is at, and whether it breaks its bound, as JSON entries."""
        entry = not_checked(bound)
        if np.isnan(values).all():
            return entry
        index = np.unravel_index(int(np.nanargmax(values)), values.shape)
        labels = {
            dim: self.dataset[dim].values[i].item() if dim in self.dataset.coords else int(i)
            for dim, i in zip(self.dims, index, strict=True)
        }
        labels |= {name: float(value.values[index]) for name, value in self.moving.items()}
        worst = float(values[index])
        if bound is not None:
            entry["n_broken"] = int(np.sum(values > bound))
            entry["broken"] = worst > bound
        at = {name: _for_json(label) for name, label in labels.items()}
        return entry | {"worst": _for_json(worst), "at": at}


def _for_json(value: Any) -> Any:
    """A value as JSON has it, which has no infinity."""
    return str(value) if isinstance(value, float) and not np.isfinite(value) else value


OF_POINTS = ("coefficient", "amplitude", *CONTACT)
"""Variables that verify points."""
WITHOUT_EXACT = (
    "not against the exact motion: the structure is condensed to the harmonics of its responses; "
    "symhbm.craig_bampton reduces it to one that has exact motions"
)
_COEFFICIENT = VARIABLES["coefficient"].inner


def axes_of(moving: str, prefix: str) -> dict[str, str]:
    """Names of the variables of the frequency and of the moving parameter, by parameter."""
    return {"frequency": "frequency"} | {moving: prefix + moving}


class StoredPoints(StoredGroup):
    """The points of a dataset and their problems; an index has one entry per dimension.

    ``prefix`` is ``"peak_"`` for the peaks of the dataset, else empty. Raises ArchiveError where
    dimensions are missing or of other sizes than the problem has.
    """

    keys: ClassVar[tuple[str, ...]] = OF_POINTS

    def __init__(
        self,
        dataset: xr.Dataset,
        problem: HarmonicBalance,
        prefix: str = "",
        laws: Iterable[ContactLaw] = (),
    ):
        self.problem, self.dataset, self.prefix, self._laws = problem, dataset, prefix, laws
        self.kind = "peaks" if prefix else "points"
        self.description = Description(dataset)
        moving = self.description.moving
        outputs = [f"{name}_amplitude" for name in problem.model.outputs]
        keys = OF_PEAKS if prefix else (*self.keys, *variables_of_laws(problem))
        keys = (*keys, *outputs)
        names = {key: prefix + key for key in keys if prefix + key in dataset.variables}
        records = {**VARIABLES, **records_of_problem(problem), **self.description.records}
        coefficient, axes = dataset[names["coefficient"]], axes_of(moving, prefix)
        inner = ("peak",) if prefix else ("point", moving, "solution")
        dims = [str(dim) for dim in coefficient.dims if dim not in _COEFFICIENT]
        self.outer = [dim for dim in dims if dim not in inner]
        self.dims = (*self.outer, *(dim for dim in inner if dim in dims))
        try:
            like = coefficient.isel(dict.fromkeys(_COEFFICIENT, 0), drop=True)
            self.stored = {
                key: dataset[name]
                .broadcast_like(like)
                .transpose(*self.dims, *meaning(name, records).inner)
                .values
                for key, name in names.items()
            }
            self.moving = {
                parameter: dataset[name].broadcast_like(like).transpose(*self.dims)
                for parameter, name in axes.items()
            }
        except ValueError as error:
            raise ArchiveError(f"dataset: dimensions are missing ({error})") from error
        n_dof, harmonics = problem.model.n_dof, problem.harmonics
        expected = {"dof": n_dof, "harmonic": len(harmonics), "component": 2}
        sizes = {name: coefficient.sizes[name] for name in expected}
        if sizes != expected or tuple(dataset["harmonic"].values.tolist()) != harmonics:
            raise ArchiveError(f"dataset: expected coefficients of sizes {expected}, got {sizes}")
        # All that is stored is verified, whatever the flags tell.
        self.solved = np.asarray(np.isfinite(self.stored["coefficient"]).any(axis=(-3, -2, -1)))
        if not prefix and "converged" in dataset.variables:
            converged = dataset["converged"].transpose(*self.dims).values
            self.solved |= np.asarray(converged, dtype=bool)
        self._highest = dataset.get(f"{prefix}highest_harmonic")
        if self._highest is not None:
            self._highest = self._highest.transpose(*self.dims).values
        self._sets: dict[tuple[int, ...], HarmonicBalance] = {harmonics: problem}
        self._outer_index: tuple[int, ...] | None = None

    @property
    def available(self) -> list[str]:
        """Names of the figures that can be computed."""
        names = [name for name, figure in FIGURES.items() if {*figure.needs} <= self.stored.keys()]
        if self._larger(self.problem.harmonics) is None:
            names.remove("residual_larger")
        if self.without_exact is not None and "exact_difference" in names:
            names.remove("exact_difference")
        return [n for n in names if n != "angles_difference" or self.description.angles]

    @property
    def without_exact(self) -> str | None:
        """Why no point is compared with its exact motion, None where some are."""
        return None if self.problem.model.has_matrices else WITHOUT_EXACT

    @property
    def amplitude(self) -> FloatArray:
        """The largest stored amplitude of each point, 0 where none is stored."""
        if "amplitude" not in self.stored:
            return np.zeros(self.solved.shape)
        values = self.stored["amplitude"]
        return values if self.prefix else values.max(axis=-1, initial=0.0)

    def problem_at(self, index: tuple[int, ...]) -> tuple[HarmonicBalance, float]:
        """The problem and the angular frequency of one point."""
        outer_index = index[: len(self.outer)]
        if outer_index != self._outer_index:
            chosen = dict(zip(self.outer, outer_index, strict=True))
            self.problem = rebuild(self.dataset.isel(chosen), self._laws)
            self._outer_index = outer_index
        problem = self._moved(self.problem, index)
        return problem, RADIANS * float(self.moving["frequency"].values[index])

    def _moved(self, problem: HarmonicBalance, index: tuple[int, ...]) -> HarmonicBalance:
        """The problem with the moving parameter of a point."""
        name = self.description.moving
        if name == "frequency":
            return problem
        values = np.array(problem.parameters[name], dtype=float)
        number = self.description.index
        values[... if number is None else number] = self.moving[name].values[index]
        return problem.with_parameters(**{name: values})

    def figures(self, index: tuple[int, ...]) -> dict[str, float]:
        """All figures of one point but the exact difference; those not computable are infinite."""
        figures = dict.fromkeys(name for name in self.available if name != "exact_difference")
        harmonics = self._harmonics(index)
        stored = {name: values[index] for name, values in self.stored.items()}
        stored["coefficient"] = stored["coefficient"][:, : len(harmonics)]
        # Damaged numbers may give invalid parameters, no motion, or values out of range.
        try:
            with np.errstate(all="ignore"):
                problem, omega = self.problem_at(index)
                same, more = self._with(problem, harmonics), self._larger(harmonics)
                larger = None if more is None else self._with(problem, more)
                if "residual_larger" not in figures:
                    larger = None
                figures |= point_figures(stored, same, larger, omega)
                figures |= {
                    name: own(stored, same, omega)
                    for name, own in self._own().items()
                    if name in figures
                }
        except (ValueError, ArithmeticError, IndexError):
            pass
        return {k: np.inf if v is None or np.isnan(v) else float(v) for k, v in figures.items()}

    def _own(self) -> dict[str, Callable[[dict[str, Any], HarmonicBalance, float], float]]:
        """Further figures of what is stored of a point, its problem and its angular frequency."""
        return {
            "amplitude_mismatch": self._amplitude_mismatch,
            "angles_difference": self._angles_difference,
        }

    def _amplitude_mismatch(
        self, stored: dict[str, Any], problem: HarmonicBalance, omega: float
    ) -> float:
        """Relative difference of stored amplitudes from those of the coefficients."""
        basis = problem.basis
        unknowns = unknowns_of(basis, basis.harmonics, stored["coefficient"])
        peaking = problem if self.prefix else problem.with_peaks_of(None)
        if peaking.goal is None:
            largest = largest_displacement(basis, peaking.peaking.of(unknowns))[0]
        else:
            states = problem.locate(unknowns, omega)
            largest = np.array([ValueOf.at(peaking.goal, problem, unknowns, omega, states).value])
        each = [amplitude_difference(stored, largest)]
        for name in problem.model.outputs:
            if f"{name}_amplitude" in stored:
                found = largest_displacement(basis, problem.observed[name].of(unknowns))[0]
                each.append(relative_difference(np.atleast_1d(stored[f"{name}_amplitude"]), found))
        return max(each)

    def _angles_difference(
        self, stored: dict[str, Any], problem: HarmonicBalance, omega: float
    ) -> float:
        """Relative difference from the solution with the switching angles as unknowns."""
        # A problem with other parameters shares the compiled functions.
        problem = self._sets[problem.harmonics].with_parameters(**problem.parameters)
        basis = problem.basis
        unknowns = unknowns_of(basis, basis.harmonics, stored["coefficient"])
        solver = self.description.angles
        assert solver is not None
        corrector = AngleCorrector(FrequencyProblem(problem), solver)
        result = corrector.free(unknowns, omega)
        return relative_difference(unknowns, result.unknowns) if result.converged else np.inf

    def _harmonics(self, index: tuple[int, ...]) -> tuple[int, ...]:
        """The harmonics of one point, which may be fewer than those of the dataset."""
        harmonics = self.problem.harmonics
        if self._highest is None or self._highest[index] not in harmonics:
            return harmonics
        return tuple(n for n in harmonics if n <= self._highest[index])

    def _larger(self, harmonics: tuple[int, ...]) -> tuple[int, ...] | None:
        """A larger set, of harmonics that the structure is made for; None without any."""
        known = self.problem.model.harmonics
        larger = tuple(n for n in larger_set(harmonics) if known is None or n in known)
        return None if larger == harmonics else larger

    def _with(self, problem: HarmonicBalance, harmonics: tuple[int, ...]) -> HarmonicBalance:
        """The problem with other harmonics."""
        if harmonics == problem.harmonics:
            return problem
        if harmonics not in self._sets:
            self._sets[harmonics] = problem.located().with_harmonics(harmonics)
        return self._sets[harmonics].with_parameters(**problem.parameters)

    def exact_difference(self, index: tuple[int, ...]) -> float:
        """Difference from the exact amplitude; NaN where no exact motion is found.

        Where cubic springs make several motions, it is the one closest to the stored response.
        """
        try:
            problem, omega = self.problem_at(index)
            nearby = None
            if problem.curved_groups or problem.model.groups.many_valued():
                balance, coefficient = problem.located(), self.stored["coefficient"][index]
                nearby = balance, unknowns_of(balance.basis, balance.harmonics, coefficient)
            motion = exact_motion_of(problem, omega, nearby)
        except (ValueError, ArithmeticError):
            return np.nan
        if not motion.converged or (self.prefix and problem.peaks_of is not None):
            return np.nan
        stored = {key: values[index] for key, values in self.stored.items()}
        return amplitude_difference(stored, motion.amplitude)

    def ranked(self, points: list[tuple], scores: tuple[FloatArray, ...]) -> list[tuple]:
        """Points in order of interest: those of highest score on each curve first."""
        best: list[list[tuple]] = []
        for score in scores:
            order = sorted(points, key=lambda index: -np.nan_to_num(score[index]))
            leaders: dict[tuple, tuple] = {}
            for index in order:
                leaders.setdefault(index[: len(self.outer)], index)
            best.append([*leaders.values()])
        mixed = [index for pair in zip(*best, strict=True) for index in pair]
        rest = sorted(points, key=lambda index: -scores[0][index])
        return list(dict.fromkeys([*mixed, *rest]))
