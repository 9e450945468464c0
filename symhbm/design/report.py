"""An optimal design as a labelled dataset, beside its frequency response."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from symhbm.design.cases import Cases
from symhbm.design.influence import influence
from symhbm.design.program import Program
from symhbm.design.search import SearchResult
from symhbm.model.contacts import Parameter
from symhbm.numerics import RADIANS
from symhbm.results import meaning


def report(
    program: Program, cases: Cases, search_result: SearchResult, shape: Mapping[str, int]
) -> xr.Dataset:
    """All variables of a design but its response; ``shape`` are the dimensions of the cases."""
    variables, design, active = program.variables, search_result.design, search_result.active
    n = variables.n_variables
    stationary = np.nan if active is None else active.stationarity
    curvature = np.nan if active is None else active.curvature
    bound_multipliers = (
        np.zeros(n) if active is None else np.where(active.free, 0.0, active.bound_multipliers)
    )
    records = cases.problem.records
    units = [records[group.parameter].units for group in variables.groups]
    table: dict[str, Any] = {
        "variable": (
            "variable",
            np.array([group.label for group in variables.groups], dtype=object),
        ),
        "variable_units": ("variable", np.array(units, dtype=object)),
        "design_value": ("variable", variables.values(design.x)),
        "design_lower": ("variable", np.exp(variables.lower)),
        "design_upper": ("variable", np.exp(variables.upper)),
        "design_bound_multiplier": ("variable", bound_multipliers),
        "design_amplitude": ((), np.exp(design.value)),
        "design_optimality": ((), stationary),
        "design_curvature": ((), curvature),
        "case_amplitude": (
            tuple(shape),
            np.exp([state.height for state in design.states]).reshape(tuple(shape.values())),
        ),
        "start_value": (
            ("start", "variable"),
            np.array([variables.values(s.x) for s in search_result.starts]),
        ),
        "start_amplitude": ("start", np.exp([s.value for s in search_result.starts])),
        "n_surveys": ((), np.int32(cases.surveys)),
        "n_followed": ((), np.int32(cases.follows)),
    }
    descents = search_result.descents
    table |= {
        "descent_value": (
            ("descent", "variable"),
            np.array([variables.values(d.design.x) for d in descents]).reshape(-1, n),
        ),
        "descent_amplitude": ("descent", np.exp([d.design.value for d in descents])),
        "descent_converged": ("descent", np.array([d.converged for d in descents], dtype=bool)),
    }
    table |= _active(search_result)
    if active is not None:
        for name, (slope, moved) in influence(cases, active).items():
            table[f"design_amplitude_by_{name}"] = ((), slope)
            if name not in variables.names:  # whose nominal value has no influence
                table[f"design_value_by_{name}"] = ("variable", moved)
    return xr.Dataset({name: (*value, _attributes(name, records)) for name, value in table.items()})


def _active(search_result: SearchResult) -> dict[str, Any]:
    active = search_result.active
    maxima = [] if active is None else [followed.maximum for followed in active.maxima]
    amplitudes = [] if active is None else [followed.amplitude for followed in active.maxima]
    columns = {
        "active_case": np.array([] if active is None else active.cases, dtype=np.int32),
        "active_frequency": np.array([maximum.frequency / RADIANS for maximum in maxima]),
        "active_amplitude": np.array(amplitudes, dtype=float),
        "active_dof": np.array([maximum.dof for maximum in maxima], dtype=np.int32),
        "active_kind": np.array([str(maximum.kind) for maximum in maxima], dtype=object),
        "active_multiplier": np.array([] if active is None else active.weights, dtype=float),
    }
    return {name: ("active", column) for name, column in columns.items()}


def _attributes(name: str, records: Mapping[str, Parameter]) -> dict[str, Any]:
    for prefix, units, words in (
        ("design_amplitude_by_", "m", "derivative of the optimal response"),
        ("design_value_by_", "", "derivative of the optimal value"),
    ):
        if name.startswith(prefix):
            parameter = name.removeprefix(prefix)
            of, long_name = records[parameter][:2]
            # The unit of a variable's value is that of variable_units.
            unit = units or "variable_units"
            return {
                "units": unit if of == "1" else f"{unit} / ({of})",
                "long_name": f"{words} by the {long_name}, all alike",
            }
    entry = meaning(name)
    return {"units": entry.units, "long_name": entry.long_name}
