"""`recover`: the response of all degrees of freedom of a condensed structure."""

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance, check_problem
from symhbm.model import PARAMETERS, Model
from symhbm.model.condensation import LONG, CondensedModel, dynamic_stiffness, factorised, refined
from symhbm.model.cyclic import Sector, components, phasors
from symhbm.numerics import (
    RADIANS,
    Factorisation,
    FloatArray,
    by_harmonic,
    largest_displacement,
    length_of,
    unknowns_of,
)
from symhbm.results import check_dataset, meaning, of_places, values_of, variables_of


def recover(
    problem: HarmonicBalance, point: xr.Dataset, structure: Model | Sector | None = None
) -> xr.Dataset:
    """Response of all degrees of freedom of a condensed structure at one point of a result.

    Each harmonic takes one direct factorisation of the interior, which the kept degrees of freedom
    move.

    Parameters
    ----------
    problem
        What was solved, of a condensed structure.
    point
        One point of a result of `frf`, `follow` or `solve`, ``response.isel(point=3)``, or one
        of its peaks, ``response.drop_dims("point").isel(peak=0)``. Swept parameters have their
        values at this point.
    structure
        The whole structure, for a problem rebuilt from an archive, which holds a checksum of it.

    Returns
    -------
    Dataset with ``coefficient`` (dof, harmonic, component) and ``amplitude`` (dof) [m] of all
    degrees of freedom, outputs of the structure, ``frequency`` [Hz], and two errors in all
    equations of the whole structure, contacts included. ``residual_norm`` is their largest residual
    over the largest sum of absolute force terms. ``condensation_error`` is the length of a Newton
    step of the kept degrees of freedom over that of their response: the error of this response by
    condensation. Places of the
    structure are coordinates.

    Raises
    ------
    TypeError, ValueError
        If the problem is not condensed, or was rebuilt and lacks the whole structure, if that is
        another one, if the dataset is not one point or has no solution, and if
        a harmonic of the force resonates with the interior while the kept degrees of freedom are
        fixed.

    Examples
    --------
    A chain of 200 masses, and the response of all of them at the peak of the two that were kept:

    >>> import scipy.sparse as sp
    >>> import symhbm as sh
    >>> M = sp.eye_array(200)
    >>> K = 1e4 * (2 * M - sp.eye_array(200, k=1) - sp.eye_array(200, k=-1))
    >>> chain = sh.Model(
    ...     M, 0.5 * M + 1e-5 * K, K, contacts=[(199,)],
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=0.5,
    ... )
    >>> force = sh.forces.PointForce(place=99)
    >>> small = sh.condense(chain, force, frequency_band=(0.2, 1), places=[99])
    >>> problem = sh.HarmonicBalance(small, force)
    >>> response = sh.frf(problem, (0.2, 1))
    >>> whole = sh.datasets.recover(problem, response.drop_dims("point").isel(peak=0))
    >>> whole.amplitude.sizes["dof"], bool(whole.residual_norm < 1e-8)
    (200, True)
    """
    check_problem(problem)
    if not isinstance(problem.model, CondensedModel):
        raise TypeError("problem: expected one of a condensed structure; others have all responses")
    check_dataset("point", point)
    if structure is not None:
        problem = problem.with_model(problem.model.of_structure(structure))
    unknowns, frequency = _unknowns(problem, point)
    stored = {
        name: point[name].values
        for name, value in problem.parameters.items()
        if name in point.variables and point[name].shape in ((), np.shape(value))
    }
    problem = problem.with_parameters(**stored)
    coefficients, norm, error = recovered(problem, unknowns, RADIANS * frequency)
    basis = problem.basis
    variables = {
        "coefficient": by_harmonic(basis, coefficients),
        "amplitude": largest_displacement(basis, coefficients)[0],
        "residual_norm": np.float64(norm),
        "condensation_error": np.float64(error),
        "frequency": np.float64(frequency),
    }
    dataset, whole = xr.Dataset(), problem.model.structure
    kept = problem.layout.coefficients(unknowns)
    for output in problem.model.outputs.values():
        variables |= values_of(output, basis, output.rows @ kept)  # what they read is kept
    records = variables_of(problem.model.outputs)
    for name, value in variables.items():
        inner, units, long_name, _ = meaning(name, PARAMETERS | records)
        dataset[name] = inner, value, {"units": units, "long_name": long_name}
    coordinates: dict = {name: point[name].variable for name in ("harmonic", "component")}
    of_dofs = of_places(whole.structure if isinstance(whole, Sector) else whole)
    coordinates |= {name: part for name, part in of_dofs.items() if part[0] == "dof"}
    if isinstance(whole, Sector):  # what `sector_response` needs
        if "engine_order" in point:
            dataset["engine_order"] = point["engine_order"].variable
        dataset.attrs["problem"] = point.attrs["problem"]
    return dataset.set_coords("frequency").assign_coords(coordinates)


def recovered(
    problem: HarmonicBalance, unknowns: FloatArray, frequency: float
) -> tuple[FloatArray, float, float]:
    """Coefficients (n_dof of all, n_components) [m], residual norm and error, see `recover`.

    From the ``unknowns`` (n_unknowns,) [m] of a condensed problem at an angular ``frequency``.
    """
    model, basis = problem.model, problem.basis
    assert isinstance(model, CondensedModel)
    structure, masters = model.structure, model.masters
    slaves = np.setdiff1d(np.arange(structure.n_dof), masters)
    force = structure.felt_coefficients(problem.excitation, basis, frequency)
    contacts = problem.contact_forces(unknowns, frequency)
    magnitude = np.abs(force)
    magnitude[masters] += np.abs(contacts)
    force[masters] -= contacts
    motion = np.zeros_like(force)
    motion[masters] = problem.layout.coefficients(unknowns)
    residual = np.zeros_like(force)
    whole = []
    for n in basis.harmonics:
        first = basis.component(n)
        at = slice(first, first + 1 + (n > 0))
        s = n * frequency
        wave = structure.wave(n)
        mass, damping, rigidity = structure.matrices(wave)
        if n and structure.loss_factor:
            rigidity = rigidity + 1j * structure.loss_stiffness(wave)
        matrices = rigidity, damping, mass
        exact = [m.tocsr().astype(np.result_type(m.dtype, LONG)) for m in matrices]
        stiffness = dynamic_stiffness(exact, LONG(s)).astype(np.clongdouble)
        x, right = phasors(motion[:, at]).astype(np.clongdouble), phasors(force[:, at])
        rows = stiffness[slaves]
        interior = rows[:, slaves]
        try:
            factors = factorised(interior.astype(complex))
        except RuntimeError:
            raise ValueError(
                f"point: {s / RADIANS:g} Hz is a resonance of the structure with what is kept held"
            ) from None
        imposed = right[slaves] - rows[:, masters] @ x[masters]
        x[slaves] = refined(factors, interior, imposed[:, None])[:, 0]
        motion[:, at] = components(x, n)
        residual[:, at] = components(stiffness @ x - right, n)
        terms = [abs(matrix) @ np.abs(motion[:, at]) for matrix in matrices]
        magnitude[:, at] += terms[0] + s * terms[1][:, ::-1] + s**2 * terms[2]
        whole.append(components(structure.expanded(phasors(motion[:, at]), wave), n))
    norm = float(np.abs(residual).max() / (magnitude.max() or 1.0))
    jacobian = problem.evaluate(unknowns, frequency).jacobian
    step = Factorisation(jacobian).solve(residual[masters].ravel())
    size = length_of(unknowns) or 1.0
    return np.hstack(whole), norm, np.nan if step is None else length_of(step) / size


def _unknowns(problem: HarmonicBalance, point: xr.Dataset) -> tuple[FloatArray, float]:
    """Unknowns (n_unknowns,) [m] and frequency [Hz] of a dataset of one point."""
    basis, sizes = problem.basis, {"dof": problem.n_dof, "harmonic": None, "component": 2}
    for prefix in ("", "peak_"):
        name = f"{prefix}coefficient"
        if name in point and {*point[name].dims} == {*sizes}:
            frequency = point.get(f"{prefix}frequency", point.get("frequency"))
            break
    else:
        raise ValueError(
            "point: expected one point of a result, with coefficients of the dimensions "
            f"{tuple(sizes)}, for example response.isel(point=0)"
        )
    harmonics = tuple(point["harmonic"].values.tolist())
    values = point[name].transpose(*sizes).values
    if len(values) != problem.n_dof or basis.harmonics != harmonics:
        raise ValueError(
            f"point: expected {problem.n_dof} degrees of freedom and the harmonics "
            f"{basis.harmonics} of the problem, got {len(values)} and {harmonics}"
        )
    if frequency is None or frequency.ndim or not np.isfinite(values).all():
        raise ValueError("point: expected a point with one frequency and a solution, got NaN")
    return unknowns_of(basis, harmonics, values), float(frequency)
