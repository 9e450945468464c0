"""Samples of parameters as a labelled dataset, and the parameters that may be drawn."""

import json
from collections.abc import Collection
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.model import BLADE_PARAMETERS, CONTACT_PARAMETERS, PARAMETERS, Structure
from symhbm.numerics import FloatArray, check
from symhbm.results import DRAWN, SCHEMA_VERSION

# The position of a name is the number of its random stream: add names at the end only.
_FIRST = (*CONTACT_PARAMETERS, *BLADE_PARAMETERS, "force_amplitude")
_NOT_HERE = {name for name, about in PARAMETERS.items() if about.per == "blade"} | {"engine_order"}
DRAWABLE = (*_FIRST, *(name for name in PARAMETERS if name not in {*_FIRST, *_NOT_HERE}))


def nominal_values(
    problem: Structure | HarmonicBalance, names: Collection[str]
) -> dict[str, FloatArray]:
    """Nominal values of the named parameters, without an axis where they are scalar.

    Raises TypeError, ValueError and KeyError for anything that cannot be drawn.
    """
    if not isinstance(problem, Structure | HarmonicBalance):
        raise TypeError(f"problem={check.shown(problem)}: expected a Model or a HarmonicBalance")
    allowed = [name for name in problem.parameters if name != "engine_order"]
    if not names:
        raise ValueError(f"expected at least one parameter by name of {', '.join(allowed)}")
    own = [problem.parameter_name(name, allowed, "parameter that can be drawn") for name in names]
    return {name: np.asarray(problem.parameters[name], dtype=float) for name in own}


def labelled_samples(
    problem: Structure | HarmonicBalance,
    values: dict[str, FloatArray],
    drawn: dict[str, dict[str, Any]],
) -> xr.Dataset:
    """Dataset of samples (n_samples, ...) by parameter, and the description of each draw."""
    n_samples = len(next(iter(values.values())))
    model = problem if isinstance(problem, Structure) else problem.model
    variables = {}
    for name, array in values.items():
        units, long_name = model.about(name)[:2]
        attributes = {"units": units, "long_name": long_name, DRAWN: json.dumps(drawn[name])}
        variables[name] = (("sample", *model.dims_of(name)), array, attributes)
    sample = ("sample", np.arange(n_samples), {"long_name": "sample", "units": "1"})
    attributes = {
        "title": "Draws of mistuned parameters",
        "symhbm_schema": SCHEMA_VERSION,
        "symhbm_version": version("symhbm"),
    }
    return xr.Dataset(variables, {"sample": sample}, attributes)
