"""What a dataset tells of its problem, its request, its verification and its linear outputs."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.model import PARAMETERS, Output, is_pattern
from symhbm.model.contacts import Parameter
from symhbm.model.records import plain, unpack
from symhbm.numerics import (
    FloatArray,
    FourierBasis,
    Table,
    by_harmonic,
    largest_displacement,
    turning_points,
    unknowns_of,
)
from symhbm.results.variables import (
    OF_LAWS,
    OF_PLACES,
    OF_UNFORCED,
    OWN_DIMENSIONS,
    VARIABLES,
    Variable,
    in_units,
)

_COMPONENTS = ("harmonic", "component")


def variables_of(outputs: Mapping[str, Output]) -> dict[str, Variable]:
    """Meanings of the variables of outputs, by name."""
    result = {}
    for name, output in outputs.items():
        words = name.replace("_", " ")
        sizes = {
            f"{name}_amplitude": f"largest absolute {words} over the period",
            f"{name}_peak_to_peak": f"largest less smallest {words} over the period",
        }
        coefficient = {f"{name}_coefficient": f"Fourier coefficient of the {words}"}
        result |= in_units(output.units, output.inner, **sizes)
        result |= in_units(output.units, (*output.inner, *_COMPONENTS), **coefficient)
    return result


def of_peaks(words: str, units: str) -> dict[str, Variable]:
    """Meanings of the variables of peaks of an output or a goal, in ``words`` and its units."""
    rows = in_units(
        "1",
        peak_dof=f"row of the {words} that peaks",
        peaking_dof=f"row of the {words} whose peak it is",
        active_dof=f"row of the {words} of the active maximum",
    )
    return rows | in_units(
        units,
        peak_amplitude=f"{words} at the peak",
        peak_amplitude_slope=f"derivative of the {words} by the parameter",
        minimum_amplitude=f"largest {words} where that is lowest",
        case_amplitude=f"largest {words} of the case",
        active_amplitude=f"{words} at the active maximum",
        design_amplitude=f"statistic at the optimum of the largest {words}",
        start_amplitude=f"statistic at a start of the search of the largest {words}",
        descent_amplitude=f"statistic at the end of a descent of the largest {words}",
        fresh_case_amplitude=f"case not designed for: value of the largest {words}",
        fresh_amplitude=f"statistic of cases not designed for of the largest {words}",
    )


def values_of(output: Output, basis: FourierBasis, coefficients: FloatArray) -> Table:
    """Results of an output from its coefficients (.., n_rows, n_components), by names of datasets.

    Without the axis of rows where the output has one value.
    """
    values: dict[str, Any] = {
        "amplitude": largest_of(basis, coefficients),
        "peak_to_peak": spread_of(basis, coefficients),
        "coefficient": by_harmonic(basis, coefficients),
    }
    at = slice(None) if output.several else 0
    pick = (slice(None),) * (coefficients.ndim - 2) + (at,)
    return {f"{output.name}_{name}": of[pick] for name, of in values.items()}


def motions_of(coefficient: xr.DataArray) -> tuple[FourierBasis, FloatArray]:
    """The basis and the coefficients (.., n_components) of a variable (.., harmonic, component)."""
    harmonics = tuple(np.atleast_1d(coefficient["harmonic"].values).tolist())
    basis, values = FourierBasis(harmonics), coefficient.values
    rows = unknowns_of(basis, harmonics, values.reshape(-1, len(harmonics), 2))
    return basis, rows.reshape(*values.shape[:-2], basis.n_components)


def largest_of(basis: FourierBasis, motions: FloatArray) -> FloatArray:
    """Largest absolute value of motions (.., n_components), NaN where they are not known."""
    return _of_known(lambda known: largest_displacement(basis, known)[0], motions)


def amplitude_of(coefficient: xr.DataArray) -> xr.DataArray:
    """Largest absolute value of motions by their coefficients."""
    motions = coefficient.transpose(..., "harmonic", "component")
    like = motions.isel(harmonic=0, component=0, drop=True)
    return like.copy(data=largest_of(*motions_of(motions)))


def spread_of(basis: FourierBasis, motions: FloatArray) -> FloatArray:
    """Largest less smallest value of motions (.., n_components), NaN where they are not known."""

    def spread(known: FloatArray) -> FloatArray:
        points = turning_points(basis, known)
        lowest = np.take_along_axis(points.value, points.lowest[:, None], axis=1)
        return points.value[:, 0] - lowest[:, 0]

    return _of_known(spread, motions)


def _of_known(function: Callable[[FloatArray], FloatArray], motions: FloatArray) -> FloatArray:
    known = np.isfinite(motions).all(axis=-1)
    result = np.full(known.shape, np.nan)
    if known.any():
        result[known] = function(motions[known])
    return result


_NONE = np.zeros(0)
"""The numbers of what JSON tells whole."""
OUTPUT = "output"
"""Attribute of results in which an output takes the place of displacements: its name."""


class Description:
    """The problem, the request and the verification of a dataset, as far as its attributes tell."""

    def __init__(self, dataset: xr.Dataset):
        self._attributes = dataset.attrs

    def _read(self, name: str, otherwise: Any) -> Any:
        return json.loads(self._attributes[name]) if name in self._attributes else otherwise

    @property
    def problem(self) -> dict[str, Any]:
        """Structure, contacts, force and harmonics."""
        return self._read("problem", {})

    @property
    def records(self) -> dict[str, Parameter | Variable]:
        """What its parameters are, and the variables of its contact laws."""
        return records_of(self.problem) | OF_UNFORCED.get(self.unforced or "", {})

    @property
    def parameters(self) -> dict[str, Parameter]:
        """What its parameters are."""
        return parameters_of(self.problem)

    @property
    def contacts(self) -> tuple[Any, ...]:
        """The ends of each contact, of several directions in tuples."""
        return unpack(self.problem.get("contacts", []), _NONE)

    @property
    def groups(self) -> dict[str, dict[str, Any]]:
        """Groups of contacts that have names, with their law, places and parameters."""
        return self.problem.get("groups", {})

    @property
    def outputs(self) -> dict[str, Output]:
        """Linear outputs by name."""
        return outputs_of(self.problem)

    @property
    def lumped(self) -> bool:
        """Whether every degree of freedom is a blade."""
        return bool(self.problem.get("lumped"))

    @property
    def forces(self) -> list[dict[str, Any]]:
        """The excitation, part by part where it is a sum."""
        force = plain(self.problem.get("excitation", {}))
        return force.get("parts", [force])

    @property
    def condensed_from(self) -> int | None:
        """Degrees of freedom of what a condensed structure was made from, None for a whole one."""
        return self.problem.get("n_whole")

    @property
    def request(self) -> dict[str, Any]:
        """Entries of `Request.to_json`; those of a single point tell the frequency alone."""
        return self._read("followed", {"name": "frequency"})

    @property
    def moving(self) -> str:
        """Name of the parameter along which a response was followed."""
        return self.request["name"]

    @property
    def band(self) -> list[float] | None:
        """First and last value of the moving parameter, None where they are not known."""
        return self.request.get("band")

    @property
    def index(self) -> int | None:
        """Number of the one contact or blade whose parameter was followed, None for all."""
        return self.request["index"]

    @property
    def angles(self) -> str | None:
        """The solver with the switching angles as unknowns, None without one."""
        return self.request.get("angles")

    @property
    def unforced(self) -> str | None:
        """What was followed without a force, None for responses."""
        return self.request.get("unforced")

    @property
    def on_grid(self) -> bool:
        """Whether the response is on a grid of the moving parameter."""
        return self.request["grid"]

    @property
    def per_dof(self) -> bool:
        """Whether peaks are those of each degree of freedom."""
        return self.request.get("peaks") == "each"

    @property
    def output(self) -> str | None:
        """The output that amplitudes are of, None for displacements."""
        return self._attributes.get(OUTPUT)

    @property
    def peaks_of_amplitude(self) -> bool:
        """Whether peaks are those of the amplitudes, and not of another output."""
        return self.problem.get("peaks_of") == self.output

    @property
    def swept(self) -> list[str]:
        """Names of the swept parameters, which differ between curves."""
        return self._read("swept", [])

    @property
    def left_out(self) -> list[str]:
        """Names of results that were computed and not kept."""
        return self._read("left_out", [])

    @property
    def verification(self) -> dict[str, Any] | None:
        """The report of `symhbm.verify`, None for a dataset that was not verified."""
        return self._read("verification", None)


def records_of(description: dict[str, Any]) -> dict[str, Parameter | Variable]:
    """What the parameters of a described problem are, and the variables of its contact laws."""
    laws = [entry["variables"] for entry in description.get("groups", {}).values()]
    outputs, peaking = outputs_of(description), description.get("peaking")
    return _records(parameters_of(description), laws, outputs, peaking)


def parameters_of(description: dict[str, Any]) -> dict[str, Parameter]:
    """What the parameters of a described problem are."""
    own = description.get("parameters", {})
    return PARAMETERS | {name: Parameter(*record) for name, record in own.items()}


def outputs_of(description: dict[str, Any]) -> dict[str, Output]:
    """The linear outputs of a described problem by name."""
    return {name: unpack(told, _NONE) for name, told in description.get("outputs", {}).items()}


def check_names(problem: HarmonicBalance) -> None:
    """Raise ValueError for parameters or variables of contact laws that are called as results."""
    for name in problem.model.records.keys() - {*PARAMETERS}:
        if name in {*VARIABLES, *OWN_DIMENSIONS, *OF_PLACES} or is_pattern(name):
            raise ValueError(
                f"problem: the parameter {name!r} of a contact law needs a name of its own, "
                f"{name!r} is the result's"
            )
    taken = {*VARIABLES, *OWN_DIMENSIONS, *OF_PLACES, *problem.parameters}
    for output in problem.model.outputs.values():
        for name in ({output.name, *output.inner, *variables_of({output.name: output})}) & taken:
            raise ValueError(
                f"outputs: {output.name!r} needs a name of its own, {name!r} is the result's"
            )
    for group in problem.groups:
        for name in group.law.variables:
            if name in VARIABLES:
                raise ValueError(
                    f"variables: {name!r} of a contact law is a variable of all datasets"
                )


def records_of_problem(problem: HarmonicBalance) -> dict[str, Parameter | Variable]:
    """The same of a problem; ValueError for a name that all datasets have."""
    check_names(problem)
    laws = [group.law.variables for group in problem.groups]
    peaking = None if problem.peaks_of is None else problem.peaking_words
    return _records(problem.records, laws, problem.model.outputs, peaking)


def _records(
    parameters: Mapping[str, Parameter],
    laws: Iterable[Mapping[str, Sequence[str]]],
    outputs: Mapping[str, Output],
    peaking: Sequence[str] | None,
) -> dict[str, Parameter | Variable]:
    of_laws = {
        name: Variable(OF_LAWS, about[0], about[1]) for law in laws for name, about in law.items()
    }
    histories = {
        name: Variable(output.inner, output.units, name.replace("_", " "))
        for name, output in outputs.items()
    }
    of_peaking = {} if peaking is None else of_peaks(*peaking)
    return {**parameters, **of_laws, **of_peaking, **variables_of(outputs), **histories}
