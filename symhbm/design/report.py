"""An optimal design as a labelled dataset, beside its frequency response."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from symhbm.design.cases import Cases
from symhbm.design.influence import influence
from symhbm.design.program import Program
from symhbm.design.search import Found
from symhbm.model import PARAMETERS
from symhbm.numerics import RADIANS
from symhbm.results import meaning


def report(program: Program, cases: Cases, found: Found, shape: Mapping[str, int]) -> xr.Dataset:
    """Everything about a design but its response; ``shape`` are the dimensions of the cases."""
    space, design, held = program.space, found.design, found.held
    n = space.n_variables
    stationary = np.nan if held is None else held.stationarity
    curvature = np.nan if held is None else held.curvature
    pull = np.zeros(n) if held is None else np.where(held.free, 0.0, held.pull)
    units = [PARAMETERS[group.parameter].units for group in space.groups]
    table: dict[str, Any] = {
        "variable": ("variable", np.array([group.label for group in space.groups], dtype=object)),
        "variable_units": ("variable", np.array(units, dtype=object)),
        "design_value": ("variable", space.values(design.x)),
        "design_lower": ("variable", np.exp(space.lower)),
        "design_upper": ("variable", np.exp(space.upper)),
        "design_bound_multiplier": ("variable", pull),
        "design_amplitude": ((), np.exp(design.value)),
        "design_optimality": ((), stationary),
        "design_curvature": ((), curvature),
        "case_amplitude": (
            tuple(shape),
            np.exp([state.height for state in design.states]).reshape(tuple(shape.values())),
        ),
        "start_value": (("start", "variable"), np.array([space.values(s.x) for s in found.starts])),
        "start_amplitude": ("start", np.exp([s.value for s in found.starts])),
        "n_surveys": ((), np.int32(cases.surveys)),
        "n_followed": ((), np.int32(cases.follows)),
    }
    descents = found.descents
    table |= {
        "descent_value": (
            ("descent", "variable"),
            np.array([space.values(d.design.x) for d in descents]).reshape(-1, n),
        ),
        "descent_amplitude": ("descent", np.exp([d.design.value for d in descents])),
        "descent_converged": ("descent", np.array([d.converged for d in descents], dtype=bool)),
    }
    table |= _active(found)
    if held is not None:
        for name, (slope, moved) in influence(cases, held).items():
            table[f"design_amplitude_by_{name}"] = ((), slope)
            if name not in space.names:  # whose nominal value has no influence
                table[f"design_value_by_{name}"] = ("variable", moved)
    return xr.Dataset({name: (*value, _about(name)) for name, value in table.items()})


def _active(found: Found) -> dict[str, Any]:
    held = found.held
    summits = [] if held is None else [piece.summit for piece in held.pieces]
    amplitudes = [] if held is None else [piece.amplitude for piece in held.pieces]
    columns = {
        "active_case": np.array([] if held is None else held.cases, dtype=np.int32),
        "active_frequency": np.array([summit.frequency / RADIANS for summit in summits]),
        "active_amplitude": np.array(amplitudes, dtype=float),
        "active_dof": np.array([summit.dof for summit in summits], dtype=np.int32),
        "active_kind": np.array([str(summit.kind) for summit in summits], dtype=object),
        "active_multiplier": np.array([] if held is None else held.weights, dtype=float),
    }
    return {name: ("active", column) for name, column in columns.items()}


def _about(name: str) -> dict[str, Any]:
    for prefix, units, words in (
        ("design_amplitude_by_", "m", "derivative of the optimal response"),
        ("design_value_by_", "", "derivative of the optimal value"),
    ):
        if name.startswith(prefix):
            parameter = name.removeprefix(prefix)
            of, long_name = PARAMETERS[parameter][:2]
            # The unit of a variable's value is that of variable_units.
            own = units or "variable_units"
            return {
                "units": own if of == "1" else f"{own} / ({of})",
                "long_name": f"{words} by the {long_name}, all alike",
            }
    about = meaning(name)
    return {"units": about.units, "long_name": about.long_name}
