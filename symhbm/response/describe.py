"""All results at one point or many, as plain arrays by the names of the dataset."""

from collections.abc import Sequence

import numpy as np

from symhbm.balance import HarmonicBalance, check_each
from symhbm.continuation import ACCEPTED
from symhbm.numerics import (
    RADIANS,
    Factorisation,
    FloatArray,
    Table,
    by_harmonic,
    largest_displacement,
)
from symhbm.time_domain import growth_rate, verdict

_BATCH = 1000
"""Motions of degrees of freedom and contacts that are described at once."""


def describe_each(
    problems: Sequence[HarmonicBalance],
    unknowns: FloatArray,
    frequencies: FloatArray,
    iterations: Sequence[int],
    stability: bool = False,
) -> Table:
    """All results at points (n_points, n_unknowns) of problems of one structure, point by point.

    ``frequencies`` (n_points,) in Hz. A point that is no solution becomes NaN. ``stability`` adds
    the growth of small motions beside the responses.
    """
    first = problems[0]
    table = nothing(first, len(problems), stability)
    table["iterations"][:] = iterations
    size = max(1, _BATCH // (first.n_dof + first.n_contacts))
    for i in range(0, len(problems), size):
        part = slice(i, i + size)
        found = _described(problems[part], unknowns[part], RADIANS * frequencies[part], stability)
        for name, values in found.items():
            table[name][part] = values
    return table


def describe(
    problem: HarmonicBalance,
    unknowns: FloatArray,
    frequency: float,
    iterations: int = 0,
    stability: bool = False,
) -> Table:
    """All results at one point, as of `describe_each`."""
    table = describe_each([problem], unknowns[None], np.array([frequency]), [iterations], stability)
    return {name: values[0] for name, values in table.items()}


def nothing(problem: HarmonicBalance, n_points: int, stability: bool = False) -> Table:
    """The entries of points without a solution."""
    n_dof, n_contacts = problem.model.n_dof, problem.model.n_contacts

    def unknown(*shape: int) -> FloatArray:
        return np.full((n_points, *shape), np.nan)

    def none(kind: type, *shape: int) -> np.ndarray:
        return np.full((n_points, *shape), -1, dtype=kind)

    table: Table = dict(
        coefficient=unknown(n_dof, len(problem.harmonics), 2),
        amplitude=unknown(n_dof),
        theta_0=unknown(n_contacts),
        theta_star=unknown(n_contacts),
        stick_fraction=unknown(n_contacts),
        dissipation=unknown(n_contacts),
        residual_norm=unknown(),
    )
    if problem.samples is not None:
        table["sampling_error"] = unknown()
    if stability:
        table |= dict(growth_rate=unknown(), stability=none(np.int8))
    return table | dict(
        contact_state=none(np.int8, n_contacts),
        reversals=none(np.int32, n_contacts),
        converged=np.zeros(n_points, dtype=bool),
        contact_model_valid=np.zeros(n_points, dtype=bool),
        iterations=np.zeros(n_points, dtype=np.int32),
    )


def _described(
    problems: Sequence[HarmonicBalance],
    unknowns: FloatArray,
    frequencies: FloatArray,
    stability: bool,
) -> Table:
    """Results at points but their iterations; ``frequencies`` in rad/s."""
    first, basis = problems[0], problems[0].basis
    norm, friction = check_each(problems, unknowns, frequencies)
    converged = norm <= ACCEPTED
    points = len(problems), first.n_contacts

    def each(values: np.ndarray) -> np.ndarray:
        """Values of all contacts, point by point."""
        return values.reshape(points + values.shape[1:])

    stiffness = np.array([problem.contact_stiffness for problem in problems])
    limit = np.array([problem.slip_limit for problem in problems])
    relative = first.relative(unknowns)
    force = stiffness[..., None] * np.einsum("pcij,pcj->pci", each(friction.matrix), relative)
    force += limit[..., None] * each(friction.vector)
    # Work of the friction force over a period: the integral of f dy.
    velocity = relative @ basis.derivative_matrix.T / basis.norm
    table: Table = dict(
        coefficient=by_harmonic(basis, first.everywhere(unknowns)),
        amplitude=_amplitude(first, unknowns),
        theta_0=each(friction.theta_0),
        theta_star=each(friction.theta_star),
        stick_fraction=each(friction.stick_fraction),
        dissipation=np.einsum("pci,pci->pc", force, velocity),
    )
    at = [*zip(problems, unknowns, frequencies.tolist(), strict=True)]
    if first.samples is not None:
        table["sampling_error"] = np.array([_sampling_error(*point) for point in at])
    if not converged.all():
        table = {name: _where(converged, values, np.nan) for name, values in table.items()}
    if stability:
        rates = [
            _growth(*point) if found else np.nan for point, found in zip(at, converged, strict=True)
        ]
        table["growth_rate"] = np.array(rates)
        table["stability"] = np.array(
            [verdict(*point) for point in zip(rates, frequencies, strict=True)]
        )
    rubs = converged[:, None] & (stiffness > 0)
    table["contact_state"] = np.where(rubs, each(friction.slip), -1)
    table["reversals"] = _where(converged, each(friction.reversals), -1)
    flags = dict(converged=converged, contact_model_valid=converged)
    return _of_all_contacts(first, table) | flags | dict(residual_norm=norm)


def _where(condition: np.ndarray, values: np.ndarray, other: float) -> np.ndarray:
    """Values (n_points, ...) where a condition (n_points,) holds."""
    return np.where(condition.reshape(-1, *[1] * (values.ndim - 1)), values, other)


def _amplitude(problem: HarmonicBalance, unknowns: FloatArray) -> FloatArray:
    """Largest displacements (n_points, n_dof) of the structure; sectors move alike."""
    basis = problem.basis
    motions = unknowns.reshape(-1, basis.n_components)
    amplitude = largest_displacement(basis, motions)[0].reshape(len(unknowns), -1)
    return np.tile(amplitude, problem.model.n_dof // problem.n_dof)


def amplitude_slopes(
    problem: HarmonicBalance, unknowns: FloatArray, tangents: FloatArray
) -> FloatArray:
    """Derivatives (n_points, 2, n_dof) of amplitudes by the parameter, before and after points.

    ``unknowns`` (n_points, n_unknowns), and ``tangents`` (n_points, 2, n_unknowns + 1), derivatives
    of unknowns and parameter along the path. Infinite where the parameter stands still.
    """
    basis, shape = problem.basis, (len(unknowns), 2, problem.n_dof)
    motions = unknowns.reshape(-1, basis.n_components)
    amplitude, angle = largest_displacement(basis, motions)
    # The angle of a maximum moves, but the derivative by it vanishes there.
    row = basis.values(angle)
    row *= np.sign(np.einsum("dm,dm->d", row, motions))[:, None]
    along = tangents[..., :-1].reshape(*shape, -1)
    slope = np.einsum("pdm,psdm->psd", row.reshape(len(unknowns), shape[-1], -1), along)
    at_rest = (amplitude == 0).reshape(len(unknowns), shape[-1])
    if at_rest.any():
        # Any motion comes from and goes to a larger amplitude.
        rise = largest_displacement(basis, along.reshape(-1, basis.n_components))[0]
        rise = rise.reshape(shape) * np.array([-1.0, 1.0])[:, None]
        slope = np.where(at_rest[:, None], rise, slope)
    still = tangents[..., -1:] == 0
    slope = np.where(still, np.inf, slope / np.where(still, 1.0, tangents[..., -1:]))
    return np.tile(slope, problem.model.n_dof // problem.n_dof)


def _growth(problem: HarmonicBalance, unknowns: FloatArray, frequency: float) -> float:
    return growth_rate(problem, frequency, problem.evaluate(unknowns, frequency), unknowns)


def _of_all_contacts(problem: HarmonicBalance, table: Table) -> Table:
    """Results of the contacts of one sector as those of all: each lags, and does the same."""
    symmetry = problem.symmetry
    if symmetry is None:
        return table
    lags = symmetry.contact_lags()
    angles = ("theta_0", "theta_star")
    spread = {
        name: symmetry.spread_contacts(table[name].T).T
        for name in ("stick_fraction", "dissipation", "contact_state", "reversals", *angles)
    }
    for name in angles:
        spread[name] = (spread[name] + lags) % (2 * np.pi)
    return table | spread


def _sampling_error(problem: HarmonicBalance, unknowns: FloatArray, frequency: float) -> float:
    """Error of a response with sampled friction: one Newton step with located angles."""
    exact = problem.located().evaluate(unknowns, frequency)
    step = Factorisation(exact.jacobian).solve(exact.residual)
    if step is None:
        return np.nan
    return float(np.linalg.norm(step) / (np.linalg.norm(unknowns) or 1.0))
