"""The stored points of nonlinear modes and limit cycles, and the problems they solve."""

from collections.abc import Callable, Iterable
from typing import Any, ClassVar

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance, unforced
from symhbm.continuation.unforced import first_harmonic
from symhbm.model.contacts import ContactLaw
from symhbm.model.cyclic import Sector
from symhbm.numerics import (
    FloatArray,
    largest_displacement,
    relative_difference,
    unknowns_of,
)
from symhbm.response.unforced import free_problem
from symhbm.response.verification.figures import modal_amplitude
from symhbm.response.verification.stored_points import OF_POINTS, StoredPoints
from symhbm.results import recall
from symhbm.time_domain import curved, cycle_growth_rate, free_motion, in_plane, verdict

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
        if not self.problem.model.has_matrices:
            return _OTHER_WAVES
        laws = {repr(group.law) for group in curved(self.problem) + in_plane(self.problem)}
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
        rate, known = cycle_growth_rate(alone, omega, unknowns, phase), stored["growth_rate"]
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
