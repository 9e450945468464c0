"""Results at solution points as plain arrays by the names of the dataset."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.balance import ContactStates, HarmonicBalance, check_each, motions_at_each
from symhbm.continuation import ACCEPTED, newton
from symhbm.numerics import (
    RADIANS,
    Factorisation,
    FloatArray,
    Table,
    by_harmonic,
    largest_displacement,
    watching,
)
from symhbm.results import OF_LAWS, VARIABLES, tables, values_of, variables_of
from symhbm.time_domain import Growth, growth, verdict

_OF_CONTACTS = dict(
    theta_0=np.nan,
    theta_star=np.nan,
    stick_fraction=np.nan,
    dissipation=0.0,
    contact_state=-1,
    reversals=-1,
)
"""Results of contacts, and what those have whose law does not tell."""
_BESIDE = 1e-6
"""Relative distance of a solution that differs by the round-off of a root."""
_COUNTS = ("contact_state", "reversals")
_BATCH = 4000
"""Degrees of freedom and contacts described at once: few calls, bounded memory."""


def describe_each(
    problems: Sequence[HarmonicBalance],
    unknowns: FloatArray,
    frequencies: FloatArray,
    iterations: Sequence[int],
    stability: bool = False,
    machine_code: bool = False,
    tangents: FloatArray | None = None,
    norms: FloatArray | None = None,
    held: NDArray[np.bool_] | None = None,
) -> Table:
    """All results at points with ``unknowns`` (n_points, n_unknowns) [m], one problem each.

    The problems are of one structure, ``frequencies`` (n_points,) in Hz. Points that do not solve
    the equations become NaN. ``stability`` adds the growth rates of perturbations;
    ``machine_code`` evaluates the equations where there is some. ``tangents`` (n_points, 2,
    n_unknowns + 1), derivatives of unknowns and parameter along the path before and after each
    point, 0 of the parameter at folds, add the slopes of amplitudes by the parameter. ``norms``
    (n_points,) are those of the equations where these are not the balance alone. ``held``
    (n_points,) tells points that were solved with the states of their contacts held: they are
    corrected where their contacts, once free, do not balance. Beside growth rates ``doubling``
    (n_points,), as of `Growth`, is for the search between points: no result.
    """
    first, omegas, unknowns = problems[0], RADIANS * frequencies, unknowns.copy()
    size = max(1, _BATCH // (first.n_dof + first.n_contacts))
    batches = [slice(i, i + size) for i in range(0, len(problems), size)]

    def within(values: Any, batch: slice) -> Any:
        return None if values is None else values[batch]

    given = problems, unknowns, omegas, norms, held
    asked = watching().counting("points described", len(problems)), stability, machine_code
    parts = [_described(*asked, *(within(of, b) for of in given)) for b in batches]
    table: Table = {"iterations": np.array(iterations)}
    table |= {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    amplitudes = _amplitudes(first, unknowns, tangents)
    amplitudes = {name: _where(table["converged"], of, np.nan) for name, of in amplitudes.items()}
    table, layout = amplitudes | table, _layout(first, stability)
    kinds = {name: dtype for name, (dtype, _) in layout.items()} | dict.fromkeys(amplitudes, float)
    kinds |= dict.fromkeys(("doubling",) if stability else (), float)
    return {name: table[name].astype(kind, copy=False) for name, kind in kinds.items()}


def describe(
    problem: HarmonicBalance,
    unknowns: FloatArray,
    frequency: float,
    iterations: int = 0,
    stability: bool = False,
) -> Table:
    """All results at one point, as from `describe_each`."""
    table = describe_each([problem], unknowns[None], np.array([frequency]), [iterations], stability)
    return {name: values[0] for name, values in table.items()}


def unsolved(problem: HarmonicBalance, n_points: int, stability: bool = False) -> Table:
    """Results of points without a solution: NaN, -1 or False, and no iterations."""
    layout = _layout(problem, stability).items()
    table = {name: tables.blank(dtype, (n_points, *shape)) for name, (dtype, shape) in layout}
    table["iterations"][:] = 0
    return table


def _layout(problem: HarmonicBalance, stability: bool) -> tables.Layout:
    """Type and shape of the results of one point."""
    model = problem.model
    sizes = {"dof": model.n_dof, "contact": model.n_contacts}
    sizes |= {"harmonic": len(problem.harmonics), "component": 2}
    kinds: dict[str, type] = dict.fromkeys(("coefficient", "amplitude"), float)
    kinds |= dict.fromkeys(("theta_0", "theta_star", "stick_fraction", "dissipation"), float)
    kinds["residual_norm"] = float
    if _sums_samples(problem):
        kinds["sampling_error"] = float
    if stability:
        kinds |= dict(growth_rate=float, stability=np.int8, stability_method=np.int8)
    kinds |= dict(contact_state=np.int8, reversals=np.int32)
    kinds |= dict(converged=bool, contact_model_valid=bool)
    kinds |= dict.fromkeys(variables_of_laws(problem), float)
    kinds["iterations"] = np.int32
    inner = {name: VARIABLES[name].inner if name in VARIABLES else OF_LAWS for name in kinds}
    for output in model.outputs.values():
        sizes |= dict.fromkeys(output.inner, int(output.rows.shape[0]))
    of_outputs = variables_of(model.outputs)
    kinds |= dict.fromkeys(of_outputs, float)
    inner |= {name: about.inner for name, about in of_outputs.items()}
    return {
        name: (np.dtype(kind), tuple(sizes[dim] for dim in inner[name]))
        for name, kind in kinds.items()
    }


def _described(
    tell: Callable[[], None],
    stability: bool,
    machine_code: bool,
    problems: Sequence[HarmonicBalance],
    unknowns: FloatArray,
    frequencies: FloatArray,
    norms: FloatArray | None,
    held: NDArray[np.bool_] | None,
) -> Table:
    """Results at points but the iterations; ``frequencies`` in rad/s."""
    first, basis = problems[0], problems[0].basis
    norm, located = check_each(problems, unknowns, frequencies, machine_code)
    norm = norm if norms is None else norms
    if held is not None and (off := held & (norm > ACCEPTED)).any():
        for i in np.flatnonzero(off).tolist():
            unknowns[i] = _freed(problems[i], unknowns[i], float(frequencies[i]))
        norm, located = check_each(problems, unknowns, frequencies, machine_code)
    converged = norm <= ACCEPTED
    contacts = results_of_contacts(problems, unknowns, frequencies, located)
    table: Table = dict(
        coefficient=by_harmonic(basis, first.layout.everywhere(unknowns)),
        **{name: of for name, of in contacts.items() if name not in _COUNTS},
    )
    for name, output in first.model.outputs.items():
        table |= values_of(output, basis, first.observed[name].of(unknowns))
    arguments = [*zip(problems, unknowns, frequencies.tolist(), strict=True)]
    if _sums_samples(first):
        table["sampling_error"] = np.array([_sampling_error(*point) for point in arguments])
    if not converged.all():
        table = {name: _where(converged, values, np.nan) for name, values in table.items()}
    if stability:
        found = []
        for (of, at, omega), solved in zip(arguments, converged, strict=True):
            found.append(growth(of, omega, of.evaluate(at, omega), at) if solved else Growth())
            tell()
        rates = [of.rate for of in found]
        table["growth_rate"] = np.array(rates)
        table["doubling"] = np.array([of.doubling for of in found])
        table["stability_method"] = np.array([of.method for of in found], dtype=np.int8)
        table["stability"] = np.array(
            [verdict(*point) for point in zip(rates, frequencies, strict=True)]
        )
    for name in _COUNTS:
        table[name] = _where(converged, contacts[name], -1)
    flags = dict(converged=converged, contact_model_valid=converged)
    return _of_all_contacts(first, table) | flags | dict(residual_norm=norm)


def _freed(problem: HarmonicBalance, unknowns: FloatArray, omega: float) -> FloatArray:
    """The solution with free contacts beside one whose contacts were held, or that itself."""
    result = newton(lambda at: problem.evaluate(at, omega), unknowns)
    beside = np.linalg.norm(result.unknowns - unknowns) <= _BESIDE * np.linalg.norm(unknowns)
    return result.unknowns if result.converged and beside else unknowns


def results_of_contacts(
    problems: Sequence[HarmonicBalance],
    unknowns: FloatArray,
    frequencies: FloatArray,
    located: ContactStates,
) -> Table:
    """Results of the contacts (n_points, n_contacts), added where several laws act on one."""
    first, shape = problems[0], (len(problems), problems[0].n_contacts)
    otherwise = _OF_CONTACTS | dict.fromkeys(variables_of_laws(first), np.nan)
    table: Table = {name: np.full(shape, nothing) for name, nothing in otherwise.items()}
    relative, contacts = first.layout.relative(unknowns), [each.contacts for each in problems]
    for group in first.groups:
        if not group.n or group.name not in located.groups:
            continue
        at = motions_at_each(contacts, group, relative, frequencies)
        for name, result in group.law.results(at, located.groups[group.name]).items():
            by_point = result.reshape(len(problems), group.n)
            if name == "dissipation":
                table[name][:, group.contacts] += by_point
            else:
                table[name][:, group.contacts] = by_point
    return table


def variables_of_laws(problem: HarmonicBalance) -> list[str]:
    """Names of the variables that contact laws tell beside those of all datasets."""
    return [name for group in problem.groups for name in group.law.variables]


def _where(condition: np.ndarray, values: np.ndarray, otherwise: float) -> np.ndarray:
    """Values (n_points, ...) where a condition (n_points,) holds, a number elsewhere."""
    return np.where(condition.reshape(-1, *[1] * (values.ndim - 1)), values, otherwise)


def _amplitudes(
    problem: HarmonicBalance, unknowns: FloatArray, tangents: FloatArray | None
) -> Table:
    """Largest displacements (n_points, n_dof) of the structure, whose sectors move alike.

    And their derivatives by the parameter, infinite at folds, where the parameter turns back.
    """
    basis, shape = problem.basis, (len(unknowns), problem.n_dof)
    n_sectors = problem.model.n_dof // problem.n_dof
    motions = unknowns.reshape(-1, basis.n_components)
    amplitude, angle = largest_displacement(basis, motions)
    table: Table = dict(amplitude=np.tile(amplitude.reshape(shape), n_sectors))
    if tangents is None:
        return table
    # The angle of a maximum moves, but the displacement is stationary in it.
    row = basis.values(angle)
    row *= np.sign(np.einsum("dm,dm->d", row, motions))[:, None]
    along = tangents[..., :-1].reshape(len(unknowns), 2, problem.n_dof, -1)
    slope = np.einsum("pdm,psdm->psd", row.reshape(*shape, -1), along)
    at_rest = (amplitude == 0).reshape(shape)
    if at_rest.any():
        # At rest the amplitude is minimal: it falls before the point and rises after it.
        rise = largest_displacement(basis, along.reshape(-1, basis.n_components))[0]
        rise = rise.reshape(slope.shape) * np.array([-1.0, 1.0])[:, None]
        slope = np.where(at_rest[:, None], rise, slope)
    still = tangents[..., -1:] == 0
    slope = np.where(still, np.inf, slope / np.where(still, 1.0, tangents[..., -1:]))
    before, after = np.tile(slope, n_sectors).transpose(1, 0, 2)
    return table | dict(amplitude_slope=after, amplitude_slope_before=before)


def _of_all_contacts(problem: HarmonicBalance, table: Table) -> Table:
    """Results of the contacts of one sector repeated for all sectors, with their phase lags."""
    symmetry = problem.symmetry
    if symmetry is None:
        return table
    lags = symmetry.contact_lags()
    angles = ("theta_0", "theta_star")
    spread = {
        name: symmetry.spread_contacts(table[name].T).T
        for name in (*_OF_CONTACTS, *variables_of_laws(problem))
    }
    for name in angles:
        spread[name] = (spread[name] + lags) % (2 * np.pi)
    return table | spread


def _sums_samples(problem: HarmonicBalance) -> bool:
    return problem.samples is not None or any(group.law.sums_samples for group in problem.groups)


def _sampling_error(problem: HarmonicBalance, unknowns: FloatArray, frequency: float) -> float:
    """Relative error by samples: one Newton step of the error of the forces of contacts.

    Where there may be folds it is that of response and frequency together.
    """
    located = problem.located()
    exact = located.evaluate(unknowns, frequency)
    error = exact.residual if problem.samples is not None else np.zeros(len(unknowns))
    for group in located.contacts.groups:
        if group.law.sums_samples:
            of_force = group.law.sampling_errors(exact.states.groups[group.name])
            error = error + located.equations.spreads(group)[0].T @ of_force.ravel()
    factors, size = Factorisation(exact.jacobian), float(np.linalg.norm(unknowns)) or 1.0
    step = factors.solve(error)
    if step is None:
        return np.nan
    if not problem.single_valued:
        # At a fold the error at one frequency is unbounded: the nearest point of the curve counts.
        along = factors.solve(exact.by_parameter * frequency / size)
        assert along is not None
        share = float(step @ along / (1 + along @ along))
        return float(np.hypot(np.linalg.norm(step - share * along), share)) / size
    return float(np.linalg.norm(step)) / size
