"""The points of an archive and the problems they were computed from."""

import json
from typing import Any

import numpy as np
import xarray as xr

from symhbm import check
from symhbm.archive import ArchiveError, rebuild
from symhbm.audit import FIGURES, larger_set, point_figures, relative_difference, unknowns_of
from symhbm.fourier import FloatArray
from symhbm.names import VARIABLES
from symhbm.periodic_motion import periodic_motion
from symhbm.point import RADIANS
from symhbm.residual import HarmonicBalance

_STORED = ("coefficient", "amplitude", "contact_state", "stick_fraction", "dissipation")
_STORED += ("reversals", "converged", "residual_norm")


class StoredPoints:
    """The points of a dataset and their problems; an index has one entry per dimension of them."""

    def __init__(self, dataset: xr.Dataset):
        if not isinstance(dataset, xr.Dataset):
            raise TypeError(f"dataset={check.shown(dataset)}: expected an xarray Dataset")
        self.problem = rebuild(dataset)
        missing = [name for name in (*_STORED, "frequency") if name not in dataset.variables]
        if missing:
            raise ArchiveError(
                f"dataset: expected a result of frf, follow or solve with all it is verified by, "
                f"got one without {', '.join(missing)}"
            )
        self.followed = json.loads(dataset.attrs.get("followed", '{"name": "frequency"}'))
        inner = ("point", self.followed["name"], "solution")
        dims = [str(dim) for dim in dataset["converged"].dims]
        self.outer = [dim for dim in dims if dim not in inner]
        self.dims = (*self.outer, *(dim for dim in inner if dim in dims))
        self.dataset = dataset
        try:
            self.stored = {
                name: dataset[name].transpose(*self.dims, *VARIABLES[name].inner).values
                for name in _STORED
            }
            self.moving = {
                name: dataset[name].broadcast_like(dataset["converged"]).transpose(*self.dims)
                for name in dict.fromkeys(("frequency", self.followed["name"]))
            }
        except ValueError as error:
            raise ArchiveError(f"dataset: dimensions are missing ({error})") from error
        n_dof, harmonics = self.problem.model.n_dof, self.problem.harmonics
        expected = {"dof": n_dof, "harmonic": len(harmonics), "component": 2}
        sizes = {name: dataset["coefficient"].sizes[name] for name in expected}
        if sizes != expected or tuple(dataset["harmonic"].values.tolist()) != harmonics:
            raise ArchiveError(f"dataset: expected coefficients of sizes {expected}, got {sizes}")
        # Flags do not hide what is stored.
        finite = np.isfinite(self.stored["coefficient"]).any(axis=(-3, -2, -1))
        self.solved = np.asarray(self.stored["converged"], dtype=bool) | finite
        self._highest = dataset.get("highest_harmonic")
        if self._highest is not None:
            self._highest = self._highest.transpose(*self.dims).values
        self._sets: dict[tuple[int, ...], HarmonicBalance] = {harmonics: self.problem}
        self.place: tuple[int, ...] | None = None

    def problem_at(self, index: tuple[int, ...]) -> tuple[HarmonicBalance, float]:
        """The problem and the angular frequency of one point."""
        place = index[: len(self.outer)]
        if place != self.place:
            chosen = dict(zip(self.outer, place, strict=True))
            self.problem, self.place = rebuild(self.dataset.isel(chosen)), place
        problem, name = self.problem, self.followed["name"]
        if name != "frequency":
            values = np.array(problem.parameters[name], dtype=float)
            each = self.followed["index"]
            values[... if each is None else each] = self.moving[name].values[index]
            problem = problem.with_parameters(**{name: values})
        return problem, RADIANS * float(self.moving["frequency"].values[index])

    def figures(self, index: tuple[int, ...]) -> dict[str, float]:
        """All figures of one point but the exact difference; infinite where there is none."""
        figures = dict.fromkeys(name for name in FIGURES if name != "exact_difference")
        harmonics = self._harmonics(index)
        stored = {name: values[index] for name, values in self.stored.items()}
        stored["coefficient"] = stored["coefficient"][:, : len(harmonics)]
        # Damaged numbers lead anywhere: to no parameter set, no motion, or out of range.
        try:
            with np.errstate(all="ignore"):
                problem, omega = self.problem_at(index)
                same, larger = (
                    self._with(problem, each) for each in (harmonics, larger_set(harmonics))
                )
                figures |= point_figures(stored, same, larger, omega)
        except (ValueError, ArithmeticError):
            pass
        return {k: np.inf if v is None or np.isnan(v) else float(v) for k, v in figures.items()}

    def _harmonics(self, index: tuple[int, ...]) -> tuple[int, ...]:
        """The harmonics of one point: it may have fewer than the dataset."""
        harmonics = self.problem.harmonics
        if self._highest is None or self._highest[index] not in harmonics:
            return harmonics
        return tuple(n for n in harmonics if n <= self._highest[index])

    def _with(self, problem: HarmonicBalance, harmonics: tuple[int, ...]) -> HarmonicBalance:
        """A problem with other harmonics."""
        if harmonics == problem.harmonics:
            return problem
        if harmonics not in self._sets:
            self._sets[harmonics] = HarmonicBalance(problem.model, problem.excitation, harmonics)
        return self._sets[harmonics].with_parameters(**problem.parameters)

    def exact_difference(self, index: tuple[int, ...]) -> float:
        """Difference from the exact amplitude; NaN where no exact motion is found.

        What is stored chooses among the motions that cubic springs make, and tells nothing else.
        """
        try:
            problem, omega = self.problem_at(index)
            near = None
            if problem.model.has_cubic_springs:
                balance, coefficient = problem.located(), self.stored["coefficient"][index]
                near = balance, unknowns_of(balance.basis, balance.harmonics, coefficient)
            motion = periodic_motion(problem, omega, near)
        except (ValueError, ArithmeticError):
            return np.nan
        if not motion.converged:
            return np.nan
        return relative_difference(self.stored["amplitude"][index], motion.amplitude)

    def ranked(self, points: list[tuple], scores: tuple[FloatArray, ...]) -> list[tuple]:
        """Points in the order of interest: the highest score of each curve, then the others."""
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

    def worst(self, values: FloatArray, bound: float | None) -> dict[str, Any]:
        """Largest value, where it is, and whether it breaks its bound, as JSON takes them."""
        entry: dict[str, Any] = {"worst": None, "bound": bound, "at": {}, "n_broken": 0}
        # What was not checked does not pass.
        entry["broken"] = bound is not None
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
        # JSON knows no infinity.
        plain = {
            k: v if not isinstance(v, float) or np.isfinite(v) else str(v)
            for k, v in labels.items()
        }
        return entry | {"worst": worst if np.isfinite(worst) else str(worst), "at": plain}
