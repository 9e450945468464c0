"""Figures that verify one stored point: residuals, energy balance and friction law.

They are recomputed from the coefficients alone, the friction by a slider marched from reversal to
reversal instead of the closed forms. Contacts whose load moves or that slide in a plane are marched
over samples: their results count as wrong by what exceeds the error of that march.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from symhbm.balance import Evaluation, HarmonicBalance, losses, matrices_in
from symhbm.model.contacts import NormalLaw, marched
from symhbm.numerics import (
    FloatArray,
    Table,
    relative_difference,
    turning_points,
    unknowns_of,
)
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
    unknowns = unknowns_of(basis, basis.harmonics, coefficient)
    evaluation, ratio = problem.evaluate(unknowns, omega), float(stored.get("damping_ratio", 0.0))
    sustains, size = sustaining_force(problem, unknowns, omega, ratio)
    evaluation = _with_force(evaluation, sustains, size)
    force = problem.force(omega) + sustains
    point = unknowns[None], np.array([omega]), evaluation.states
    results = {name: of[0] for name, of in results_of_contacts([problem], *point).items()}
    of_law, scale = _marched(problem, unknowns, omega, results)
    sampled = _sampled(problem, unknowns, omega)
    dissipation = stored.get("dissipation", of_law)
    figures = {
        "residual_stored": evaluation.norm,
        "energy_error": _energy_error(
            problem, unknowns, omega, force, dissipation, evaluation.magnitude
        ),
    }
    if larger is not None:
        embedded = unknowns_of(larger.basis, basis.harmonics, coefficient)
        sustains, size = sustaining_force(larger, embedded, omega, ratio)
        figures["residual_larger"] = _with_force(
            larger.evaluate(embedded, omega), sustains, size
        ).norm
    if stored.keys() >= {*CONTACT}:
        sizes = _sizes_of_contacts(problem, unknowns, omega)
        mismatch = _contact_mismatch(problem, evaluation, results, stored, of_law, scale, sizes)
        beyond, error = _beyond(sampled, stored, scale, sizes)
        figures["contact_mismatch"] = max(mismatch, beyond)
        figures["march_error"] = error
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


def modal_amplitude(problem: HarmonicBalance, unknowns: FloatArray) -> float:
    """Root of the sum of ``X_n^H M X_n`` over the harmonics above 0 [kg^1/2 m]."""
    phasors, square = problem.basis.phasors(problem.layout.coefficients(unknowns)), 0.0
    for n, phasor in zip(problem.harmonics, phasors.T, strict=True):
        if n:
            square += float((phasor.conj() @ (matrices_in(problem, n).mass_matrix @ phasor)).real)
    return float(np.sqrt(max(square, 0.0)))


def _with_force(evaluation: Evaluation, force: FloatArray, size: float) -> Evaluation:
    """An evaluation with one more force whose largest terms have a ``size`` [N]."""
    residual = evaluation.residual - force.ravel()
    return replace(evaluation, residual=residual, magnitude=evaluation.magnitude + size)


def amplitude_difference(stored: dict[str, Any], amplitude: FloatArray) -> float:
    """Relative difference of the stored amplitudes, or that of one ``dof``, from computed ones."""
    return relative_difference(stored["amplitude"], amplitude[stored.get("dof", slice(None))])


def _energy_error(
    problem: HarmonicBalance,
    unknowns: FloatArray,
    omega: float,
    force: FloatArray,
    dissipation: FloatArray,
    magnitude: float,
) -> float:
    """Work of the force minus the energy dissipated, over the sum of absolute work terms.

    ``force`` (n_dof, n_components) [N]. Of a condensed structure, work on what is kept, and what
    goes from there into the inside.
    """
    model, basis = problem.model, problem.basis
    x = problem.layout.coefficients(unknowns)
    # Divided by the norm, products of coefficients are integrals over a period.
    rate = x @ basis.derivative_matrix.T / basis.norm
    viscous = losses(model, basis, x, omega)
    dissipated = float(np.sum(viscous * rate)) + dissipation.sum()
    largest = np.abs(force * rate).sum() + np.abs(viscous * rate).sum() + np.abs(dissipation).sum()
    largest += _FORCE_SHARE * magnitude * np.abs(rate).sum()
    return float(abs(np.sum(force * rate) - dissipated) / (largest or 1.0))


def _marched(
    problem: HarmonicBalance, unknowns: FloatArray, frequency: float, results: Table
) -> tuple[FloatArray, FloatArray]:
    """Dissipation of each contact by a slider marched over its reversals, and its scale [J]."""
    dissipation, scale = np.zeros((2, problem.n_contacts))
    contact, rows, stiffness, limit = problem.contacts.sliders(frequency)
    others = np.setdiff1d(np.arange(problem.n_contacts), contact)
    dissipation[others] = results["dissipation"][others]
    scale[others] = _work_of_contacts(problem, unknowns, frequency)[others]
    if not len(contact):
        return dissipation, scale
    points = turning_points(problem.basis, problem.layout.relative(unknowns)[rows])
    # The force starts at its limit at the global maximum; each step is clipped by Coulomb's law.
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
        lost = results["dissipation"][contact]
    dissipation[contact] = lost
    scale[contact] = spread * (2 * limit + _SPRING_SHARE * stiffness * spread)
    return dissipation, scale


def _sampled(
    problem: HarmonicBalance, unknowns: FloatArray, frequency: float
) -> list[tuple[np.ndarray, Any, Any]]:
    """Contacts whose load moves or that slide in a plane: numbers, a march, and its errors."""
    result, relative = [], problem.layout.relative(unknowns)
    for group in problem.contacts.groups:
        values = problem.contacts.values_of(group)
        if group.law.sliders(frequency, values) is None:
            found = marched(group.law, problem.contacts.at(group, relative, frequency))
            if found is not None:
                result.append((group.contacts, *found))
    return result


class _Sizes(NamedTuple):
    """What round-off of contacts scales with: forces [N], motions [m] and works [J], (n,) each."""

    force: FloatArray
    motion: FloatArray
    work: FloatArray

    def of(self, units: str) -> FloatArray:
        """That of results in some units; 1 of shares."""
        return {"N": self.force, "m": self.motion, "J": self.work}.get(
            units, np.ones(len(self.force))
        )


def _sizes_of_contacts(problem: HarmonicBalance, unknowns: FloatArray, frequency: float) -> _Sizes:
    """Sizes of contacts under loads that vary, which may hardly touch; 0 of others."""
    force, length = np.zeros((2, problem.n_contacts))
    relative = problem.layout.relative(unknowns)
    for group in problem.contacts.groups:
        if isinstance(group.law, NormalLaw):
            values = problem.contacts.values_of(group)
            motion = np.abs(problem.contacts.motions(group, relative)).sum(axis=1)
            springs = [values[n] for n in ("normal_stiffness", "contact_stiffness") if n in values]
            load = np.abs(group.law.load(frequency, values))
            force[group.contacts] = load + np.max(springs, axis=0) * motion
            length[group.contacts] = motion
    return _Sizes(force, length, force * length)


def _beyond(
    sampled: list[tuple[np.ndarray, Any, Any]], stored: dict, scale: FloatArray, sizes_of: _Sizes
) -> tuple[float, float]:
    """How far stored results are beyond the errors of marches, and the largest of these errors."""
    beyond, largest = [0.0], [0.0]
    for contacts, found, errors in sampled:
        least, least_work = _GRAZING * sizes_of.force[contacts], _GRAZING * sizes_of.work[contacts]
        force = np.maximum(found.largest_normal_force, least)
        force = np.where(force > 0, force, 1.0)
        work = np.maximum(scale[contacts], least_work)
        work = np.where(work > 0, work, 1.0)
        sizes = dict(dissipation=work, open_fraction=np.ones(len(contacts)))
        largest.append(np.max(errors.dissipation / work, initial=0.0))
        for name, value in found._asdict().items():
            if name in stored:
                distance = np.abs(stored[name][contacts] - value) - getattr(errors, name)
                beyond.append(np.max(distance / sizes.get(name, force), initial=0.0))
    return float(np.max(beyond)), float(np.max(largest))


def _work_of_contacts(
    problem: HarmonicBalance, unknowns: FloatArray, frequency: float
) -> FloatArray:
    """Sum of the absolute work terms of each contact (n_contacts,) [J]."""
    result, relative = np.zeros(problem.n_contacts), problem.layout.relative(unknowns)
    states = problem.locate(unknowns, frequency)
    for group in problem.contacts.groups:
        at = problem.contacts.at(group, relative, frequency)
        force = group.law.forces(at, states.groups[group.name])
        turned = problem.basis.derivative_matrix.T / problem.basis.norm
        shape = group.n, len(group.law.directions), problem.basis.n_components
        rate = at.motion.reshape(shape) @ turned
        result[group.contacts] += np.abs(force.reshape(rate.shape) * rate).sum(axis=(1, 2))
    return result


def _contact_mismatch(
    problem: HarmonicBalance,
    evaluation: Evaluation,
    results: Table,
    stored: dict,
    dissipation: FloatArray,
    scale: FloatArray,
    sizes: _Sizes,
) -> float:
    """Largest difference of state (1), reversals, stick fraction, and dissipation over a scale.

    Of what laws tell beside these, relative to the largest of all contacts. Where contacts hardly
    touch nothing is relative to less than a share of their loads and springs.
    """
    if not problem.n_contacts:
        return 0.0
    near = np.zeros(problem.n_contacts, dtype=bool)
    near[problem.contacts.of_switches[np.abs(evaluation.states.margins) < _EDGE]] = True
    # What slips or touches for a moment does so for the root of round-off.
    share = np.where(near, 1.0, _GRAZING)
    work = np.maximum(scale, share * sizes.work)
    stick, stored_stick = np.nan_to_num([results["stick_fraction"], stored["stick_fraction"]])
    mismatch = [
        (results["contact_state"] != stored["contact_state"]) & ~near,
        results["reversals"] != stored["reversals"],
        np.abs(stick - stored_stick),
        np.abs(dissipation - stored["dissipation"]) / np.where(work > 0, work, 1.0),
        *(
            _difference(stored[name], results[name], share * sizes.of(units))
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
