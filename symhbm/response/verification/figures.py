"""Figures that verify one stored point: residuals, energy balance and friction law.

They are recomputed from the coefficients alone, the friction by a slider marched from reversal to
reversal instead of the closed forms. Contacts whose load moves or that slide in a plane are marched
over samples: their results count as wrong by what exceeds the error of that march.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from symhbm.balance import Evaluation, HarmonicBalance, losses, matrices_in
from symhbm.model.contacts import NormalLaw, marched
from symhbm.numerics import FloatArray, Table, relative_difference, turning_points, unknowns_of
from symhbm.response.describe import results_of_contacts


class Figure(NamedTuple):
    """A figure of a verification.

    Its default ``bound``, its meaning, the variables it needs, and what to do where it is broken.
    """

    bound: float | None
    long_name: str
    needs: tuple[str, ...] = ()
    remedy: str = "the stored values are not those of the stored problem: compute them again"


_MORE_HARMONICS = "harmonics are left out that matter: give more of them, or accuracy="
CONTACT = ("contact_state", "stick_fraction", "dissipation", "reversals")
"""Contact results of a point, verified together."""
FIGURES = {
    "residual_stored": Figure(1e-9, "residual of the stored coefficients, recomputed, relative"),
    "residual_larger": Figure(
        None, "residual on a larger harmonic set, relative", remedy=_MORE_HARMONICS
    ),
    "energy_error": Figure(1e-9, "work of the force less dissipation per cycle, relative"),
    # At the onset of slip the stick fraction moves with the root of round-off.
    "contact_mismatch": Figure(
        1e-6, "stored contact results against the recomputed friction law", CONTACT
    ),
    "march_error": Figure(
        None,
        "estimated error of dissipation marched over samples, relative",
        CONTACT,
        "the march that checks the contacts is too coarse there: lift the bound",
    ),
    "amplitude_mismatch": Figure(
        1e-9, "stored amplitude against the recomputed one, relative", ("amplitude",)
    ),
    "stability_mismatch": Figure(
        1e-6,
        "stored growth rate against the recomputed one, over the angular frequency",
        ("growth_rate", "stability"),
    ),
    "event_mismatch": Figure(
        1e-9, "event against the stored point it is at; 1 where that is none", ("event_kind",)
    ),
    "fold_mismatch": Figure(
        1e-9, "fold of a parameter against its events; 1 where cycles are beyond it", ("fold",)
    ),
    "angles_difference": Figure(
        1e-9,
        "response solved again with the switching angles as unknowns, relative difference",
        remedy="another solution is near: solve with smaller steps, or without angles=",
    ),
    "exact_difference": Figure(
        None,
        "against the exact periodic motion, relative: amplitude, without a force also frequency "
        "and damping ratio",
        ("amplitude",),
        _MORE_HARMONICS,
    ),
}
"""The figures of a verification, all dimensionless; all need the coefficients."""

_EDGE = 1e-12
"""Distance from the limit of slip, in logarithms, within which round-off decides the state."""
_GRAZING = 1e-9
"""Share of loads and springs that forces and works of contacts are relative to at least: those of
contacts that touch for a moment are round-off of these."""
_FORCE_SHARE = 1e-2
"""Share of the work of the largest force term that energies are relative to at least: solutions are
accepted with residuals of 1e-11 of that term, which then stay below the bound."""
_SPRING_SHARE = 1e-6
"""The same share for contact springs, whose large forces leave round-off in closed forms."""


def point_figures(
    stored: dict[str, Any], problem: HarmonicBalance, larger: HarmonicBalance | None, omega: float
) -> dict[str, float]:
    """Figures of one point at the angular frequency ``omega``, by its equations and contacts.

    ``stored`` holds its variables by the names of the dataset, as far as they are there; with a
    ``damping_ratio``, the force of `sustaining_force` acts as well. ``larger`` is the same problem
    with the harmonics of `larger_set`, None where its structure has no more. Amplitudes are left to
    those who know of what.
    """
    coefficient, basis = stored["coefficient"], problem.basis
    ratio = float(stored.get("damping_ratio", 0.0))
    point = _Point(problem, unknowns_of(basis, basis.harmonics, coefficient), omega, ratio)
    figures = {
        "residual_stored": point.evaluation.norm,
        "energy_error": point.energy_error(stored.get("dissipation", point.dissipation)),
    }
    if larger is not None:
        embedded = unknowns_of(larger.basis, basis.harmonics, coefficient)
        figures["residual_larger"] = _Point(larger, embedded, omega, ratio).evaluation.norm
    if stored.keys() >= {*CONTACT}:
        beyond, figures["march_error"] = point.beyond(stored)
        figures["contact_mismatch"] = max(point.contact_mismatch(stored), beyond)
    return figures


def sustaining_force(
    problem: HarmonicBalance, unknowns: FloatArray, omega: float, damping_ratio: float
) -> tuple[FloatArray, float]:
    """The force ``2 D omega M x'`` (n_dof, n_components) [N], and the size of its largest terms.

    By the mass matrix of each harmonic, apart from what solves for nonlinear modes.
    """
    basis, size = problem.basis, 0.0
    phasors = basis.phasors(problem.layout.coefficients(unknowns))
    momentum = 2 * damping_ratio * omega**2 * np.array(basis.harmonics) * phasors
    for k, n in enumerate(basis.harmonics if damping_ratio else ()):
        if n:
            mass = matrices_in(problem, n).mass_matrix
            size = max(size, float(np.max(abs(mass) @ np.abs(momentum[:, k]))))
            momentum[:, k] = mass @ momentum[:, k]
    return basis.of_phasors(1j * momentum), size


def amplitude_difference(stored: dict[str, Any], amplitude: FloatArray) -> float:
    """Relative difference of the stored amplitudes, or that of one ``dof``, from computed ones."""
    return relative_difference(stored["amplitude"], amplitude[stored.get("dof", slice(None))])


@dataclass(frozen=True)
class _Point:
    """A solution of a problem, its ``unknowns`` at the angular frequency ``omega``, and its ratio.

    That of the damping of a nonlinear mode, which `sustaining_force` balances.
    """

    problem: HarmonicBalance
    unknowns: FloatArray
    omega: float
    ratio: float

    @cached_property
    def _relative(self) -> FloatArray:
        return self.problem.layout.relative(self.unknowns)

    @cached_property
    def _sustained(self) -> tuple[FloatArray, float]:
        return sustaining_force(self.problem, self.unknowns, self.omega, self.ratio)

    @cached_property
    def evaluation(self) -> Evaluation:
        """The equations with the sustaining force."""
        evaluation = self.problem.evaluate(self.unknowns, self.omega)
        force, size = self._sustained
        residual = evaluation.residual - force.ravel()
        return replace(evaluation, residual=residual, magnitude=evaluation.magnitude + size)

    def energy_error(self, dissipation: FloatArray) -> float:
        """Work of the force minus the energy dissipated, over the sum of absolute work terms.

        Of a condensed structure, work on what is kept, and what goes from there into the inside.
        """
        problem, basis = self.problem, self.problem.basis
        force = problem.force(self.omega) + self._sustained[0]
        x = problem.layout.coefficients(self.unknowns)
        # Divided by the norm, products of coefficients are integrals over a period.
        rate = x @ basis.derivative_matrix.T / basis.norm
        viscous = losses(problem.model, basis, x, self.omega)
        dissipated = float(np.sum(viscous * rate)) + dissipation.sum()
        largest = sum(np.abs(term).sum() for term in (force * rate, viscous * rate, dissipation))
        largest += _FORCE_SHARE * self.evaluation.magnitude * np.abs(rate).sum()
        return float(abs(np.sum(force * rate) - dissipated) / (largest or 1.0))

    @cached_property
    def _results(self) -> Table:
        """Results of the contacts."""
        point = self.unknowns[None], np.array([self.omega]), self.evaluation.states
        return {n: of[0] for n, of in results_of_contacts([self.problem], *point).items()}

    @property
    def dissipation(self) -> FloatArray:
        """Dissipation of each contact [J], of sliders by a march over their reversals."""
        return self._marched[0]

    @cached_property
    def _marched(self) -> tuple[FloatArray, FloatArray]:
        """That dissipation, and its scale [J]."""
        problem = self.problem
        dissipation, scale = np.zeros((2, problem.n_contacts))
        contact, rows, stiffness, limit = problem.contacts.sliders(self.omega)
        others = np.setdiff1d(np.arange(problem.n_contacts), contact)
        dissipation[others] = self._results["dissipation"][others]
        scale[others] = self._work[others]
        if not len(contact):
            return dissipation, scale
        points = turning_points(problem.basis, self._relative[rows])
        # The force starts at its limit at the global maximum; Coulomb's law clips each step.
        value = np.column_stack([points.value, points.value[:, 0]])
        force, slipped = limit.copy(), np.zeros(len(limit))
        for step in np.diff(value, axis=1).T:
            trial = force + stiffness * step
            force = np.clip(trial, -limit, limit)
            slipped += np.abs(trial - force)
        spread = value.max(axis=1) - value.min(axis=1)
        rubs = stiffness > 0
        lost = np.where(rubs, limit * slipped / np.where(rubs, stiffness, 1.0), 0.0)
        if problem.samples is not None:
            lost = self._results["dissipation"][contact]
        dissipation[contact] = lost
        scale[contact] = spread * (2 * limit + _SPRING_SHARE * stiffness * spread)
        return dissipation, scale

    @property
    def _work(self) -> FloatArray:
        """Sum of the absolute work terms of each contact (n_contacts,) [J]."""
        problem, result = self.problem, np.zeros(self.problem.n_contacts)
        states = problem.locate(self.unknowns, self.omega)
        for group in problem.contacts.groups:
            at = problem.contacts.at(group, self._relative, self.omega)
            force = group.law.forces(at, states.groups[group.name])
            turned = problem.basis.derivative_matrix.T / problem.basis.norm
            shape = group.n, len(group.law.directions), problem.basis.n_components
            rate = at.motion.reshape(shape) @ turned
            result[group.contacts] += np.abs(force.reshape(rate.shape) * rate).sum(axis=(1, 2))
        return result

    @cached_property
    def _sizes(self) -> dict[str, FloatArray]:
        """What round-off of results scales with by units, 1 of shares.

        Of contacts under loads that vary, which may hardly touch; 0 of others.
        """
        contacts, (force, length) = self.problem.contacts, np.zeros((2, self.problem.n_contacts))
        for group in contacts.groups:
            if isinstance(group.law, NormalLaw):
                values = contacts.values_of(group)
                motion = np.abs(contacts.motions(group, self._relative)).sum(axis=1)
                names = ("normal_stiffness", "contact_stiffness")
                springs = [values[name] for name in names if name in values]
                load = np.abs(group.law.load(self.omega, values))
                force[group.contacts] = load + np.max(springs, axis=0) * motion
                length[group.contacts] = motion
        return {"N": force, "m": length, "J": force * length, "1": np.ones(len(force))}

    def beyond(self, stored: dict[str, Any]) -> tuple[float, float]:
        """How far stored results are beyond the errors of marches, and the largest of these errors.

        Of contacts whose load moves or that slide in a plane.
        """
        contacts, beyond, largest = self.problem.contacts, [0.0], [0.0]
        for group in contacts.groups:
            if group.law.sliders(self.omega, contacts.values_of(group)) is not None:
                continue
            march = marched(group.law, contacts.at(group, self._relative, self.omega))
            if march is None:
                continue
            own, (found, errors) = group.contacts, march
            force = np.maximum(found.largest_normal_force, _GRAZING * self._sizes["N"][own])
            force = np.where(force > 0, force, 1.0)
            work = np.maximum(self._marched[1][own], _GRAZING * self._sizes["J"][own])
            work = np.where(work > 0, work, 1.0)
            sizes = dict(dissipation=work, open_fraction=np.ones(len(own)))
            largest.append(np.max(errors.dissipation / work, initial=0.0))
            for name, value in found._asdict().items():
                if name in stored:
                    distance = np.abs(stored[name][own] - value) - getattr(errors, name)
                    beyond.append(np.max(distance / sizes.get(name, force), initial=0.0))
        return float(np.max(beyond)), float(np.max(largest))

    def contact_mismatch(self, stored: dict[str, Any]) -> float:
        """Largest difference of state (1), reversals, stick fraction, dissipation over its scale.

        Of what laws tell beside these, relative to the largest of all contacts. Where contacts
        hardly touch nothing is relative to less than a share of their loads and springs.
        """
        problem, results = self.problem, self._results
        if not problem.n_contacts:
            return 0.0
        near = np.zeros(problem.n_contacts, dtype=bool)
        near[problem.contacts.of_switches[np.abs(self.evaluation.states.margins) < _EDGE]] = True
        # What slips or touches for a moment does so for the root of round-off.
        share = np.where(near, 1.0, _GRAZING)
        work = np.maximum(self._marched[1], share * self._sizes["J"])
        stick, stored_stick = np.nan_to_num([results["stick_fraction"], stored["stick_fraction"]])
        mismatch = [
            (results["contact_state"] != stored["contact_state"]) & ~near,
            results["reversals"] != stored["reversals"],
            np.abs(stick - stored_stick),
            np.abs(self.dissipation - stored["dissipation"]) / np.where(work > 0, work, 1.0),
            *(
                _difference(
                    stored[name], results[name], share * self._sizes.get(units, self._sizes["1"])
                )
                for group in problem.groups
                for name, (units, _) in group.law.variables.items()
                if name in stored
            ),
        ]
        return float(np.max(np.array(mismatch, dtype=float)))


def _difference(stored: FloatArray, results: FloatArray, sizes: FloatArray) -> FloatArray:
    """Relative difference of values (n_contacts,), 1 where only one of both is a number."""
    known = np.isfinite(results)
    size = np.maximum(np.abs(results[known]).max(initial=0.0), sizes)
    difference = np.abs(np.where(known, results - stored, 0.0)) / np.where(size > 0, size, 1.0)
    return np.where(known == np.isfinite(stored), difference, 1.0)
