"""What a dataset tells of the problem behind it: parameters, record, request and versions."""

import json
from collections.abc import Iterable
from functools import cache
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.model.cyclic import speed_order
from symhbm.model.excitation import motions_of_base
from symhbm.results.dataset_parts import (
    DRAWN,
    LABELS,
    LARGEST_OF,
    OF_STRUCTURE,
    SPEED_ORDER,
    DatasetParts,
)
from symhbm.results.description import check_names
from symhbm.results.places import of_places
from symhbm.results.problem import NUMBERS, record_of
from symhbm.results.request import Request
from symhbm.results.sweep import Sweep

SCHEMA_VERSION = 1
REFERENCE = (
    "E. Chatelet, D. Rade, G. Jacquet-Richardet, Dynamic Behavior of Cyclic Symmetrical N DOF "
    "System in the Presence of Dry Friction, DINAME 2013, hal-00941429"
)
DISPLACEMENTS = "displacements"
"""Attribute of datasets of what a moving base drives: which displacements they hold."""
SEEN = {"relative": "relative to the moving base", "absolute": "absolute"}
EVALUATED_BY = "equations_evaluated_by"
"""Attribute of curves that tells what evaluates the equations, to the same bits."""
_EVALUATORS = {1: "machine code", 0: "the virtual machine of CasADi"}
LEFT_OUT = "force_left_out"
"""Attribute of motions that no force drives, of a problem with one."""


def _searched(request: Request) -> str:
    """Where limit cycles were looked for, and where not."""
    assert request.amplitudes is not None
    assert request.mode is not None
    modes = ", ".join(map(str, np.atleast_1d(request.mode)))
    low, high = request.amplitudes
    wave = "" if request.nodal_diameter is None else f" of {request.nodal_diameter} nodal diameters"
    at = "" if request.name == "amplitude" else (
        f"; at both ends and in the middle of the band of {request.name} and at its nominal value, "
        "where none is found there between them, and along the branches found"
    )  # fmt: skip
    return (
        f"modes {modes}{wave}, for amplitudes of {low:g} to {high:g} m of the first harmonic at "
        f"degree of freedom {request.dof}, where the damping ratio of the nonlinear mode is 0{at}; "
        "motions that lie on no such mode, and motions of several frequencies, were not looked for"
    )


def with_provenance(
    variables: dict[str, Any],
    coordinates: dict[str, Any],
    problem: HarmonicBalance,
    sweep: Sweep,
    request: Request | None = None,
    harmonics: tuple[int, ...] | None = None,
) -> DatasetParts:
    """Variables and coordinates with the parameters, the problem and the versions behind them.

    ``harmonics`` are those of the coefficients, by default those of the problem.

    Raises ValueError for parameters of contacts that are called as results are.
    """
    check_names(problem)
    variables, coordinates = dict(variables), dict(coordinates)
    for name, value in problem.parameters.items():
        about = problem.records[name]
        long_name, attributes = about.meaning, {"units": about.units, "long_name": about.meaning}
        dims = () if np.ndim(value) == 0 else problem.model.dims_of(name)
        if name in sweep.values:
            swept = sweep.values[name]
            drawn = {DRAWN: swept.attrs[DRAWN]} if DRAWN in swept.attrs else {}
            target = coordinates if swept.dims == (name,) else variables
            target[name] = (swept.dims, swept.values, attributes | drawn)
            for label, coordinate in swept.coords.items():
                if label not in (name, *LABELS, *coordinates):
                    defaults = {"long_name": str(label), "units": "1"}
                    labelled = coordinate.assign_attrs(defaults | coordinate.attrs)
                    coordinates[str(label)] = (
                        labelled.variable
                    )  # its own coordinate has no attributes
        nominal = name in sweep.values or (request and name == request.name)
        if nominal:
            attributes = attributes | {"long_name": f"{long_name}, nominal value"}
        stored_name = f"{name}_nominal" if nominal else name
        variables[stored_name] = (dims, np.array(value), attributes)
    coordinates |= of_places(problem.model)
    if problem.model.kept is not None:
        attributes = {"long_name": "degree of freedom of the whole structure", "units": "1"}
        coordinates[OF_STRUCTURE] = ("dof", problem.model.kept, attributes)
    told, numbers = record_of(problem)
    attributes = {"long_name": "numbers of structure and excitation, as the problem lays them out"}
    variables[NUMBERS] = (f"{NUMBERS}_entry",), numbers, attributes | {"units": "1"}
    global_attributes = {
        "title": "Forced response of a structure with dry friction by multi-harmonic balance",
        "references": REFERENCE,
        "symhbm_schema": SCHEMA_VERSION,
        "symhbm_version": _version("symhbm"),
        "casadi_version": _version("casadi"),
        "problem": json.dumps(told),
        "swept": json.dumps(list(sweep.values)),
    }
    if request and request.unforced is not None:
        kind = request.unforced.capitalize()
        global_attributes["title"] = f"{kind} of a structure by multi-harmonic balance"
        if request.unforced == "limit cycle":
            global_attributes["searched"] = _searched(request)
        if problem.excitation.amplitude:
            global_attributes[LEFT_OUT] = "what of the force oscillates; static loads act"
    if request:
        global_attributes |= evaluated_by([request.machine_code])
        global_attributes["followed"] = json.dumps(request.to_json(problem.harmonics))
        if request.accuracy is not None:
            global_attributes["accuracy"] = request.accuracy
    model = problem.model
    for motion in motions_of_base(problem.excitation):
        global_attributes[DISPLACEMENTS] = SEEN[motion]
    if (order := speed_order(model)) is not None:
        global_attributes[SPEED_ORDER] = order
    if model.kept is not None:
        between = int(np.count_nonzero(model.kept >= model.n_whole))
        told = f"{model.n_dof - between} degrees of freedom kept of {model.n_whole}"
        beside = f" and {between} displacements of contacts" if between else ""
        global_attributes[LARGEST_OF] = told + beside
    sizes = model.n_dof, model.n_contacts, harmonics or problem.harmonics
    return DatasetParts(variables, coordinates, global_attributes, sizes)


def evaluated_by(by_machine_code: Iterable[int]) -> dict[str, str]:
    """The attribute that tells what evaluated curves: 1 for machine code, 0 without, -1 for none.

    It may be both, as workers on other machines may have no compiler. Empty for no curves.
    """
    found = {int(each) for each in by_machine_code}
    by = [text for state, text in _EVALUATORS.items() if state in found]
    return {EVALUATED_BY: " and ".join(by)} if by else {}


def states_of(dataset: xr.Dataset) -> list[int]:
    """What evaluated some of its curves, as `evaluated_by` takes it."""
    told = dataset.attrs.get(EVALUATED_BY, "").split(" and ")
    return [state for state, text in _EVALUATORS.items() if text in told]


@cache
def _version(package: str) -> str:
    return version(package)
