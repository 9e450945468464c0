"""Variables of linear outputs in datasets, and their values from coefficients of a response."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from symhbm.model import Output
from symhbm.numerics import (
    FloatArray,
    FourierBasis,
    Table,
    by_harmonic,
    largest_displacement,
    turning_points,
)
from symhbm.results.variables import Variable

_COMPONENTS = ("harmonic", "component")


def variables_of(outputs: Mapping[str, Output]) -> dict[str, Variable]:
    """Meanings of the variables of outputs, by name."""
    result = {}
    for name, output in outputs.items():
        units, words = output.units, name.replace("_", " ")
        result[f"{name}_amplitude"] = Variable(
            output.inner, units, f"largest absolute {words} over the period"
        )
        result[f"{name}_peak_to_peak"] = Variable(
            output.inner, units, f"largest less smallest {words} over the period"
        )
        result[f"{name}_coefficient"] = Variable(
            (*output.inner, *_COMPONENTS), units, f"Fourier coefficient of the {words}"
        )
    return result


def histories_of(outputs: Mapping[str, Output]) -> dict[str, Variable]:
    """Meanings of outputs over the period, by name."""
    return {
        name: Variable(output.inner, output.units, name.replace("_", " "))
        for name, output in outputs.items()
    }


def of_peaks(output: Output | None) -> dict[str, Variable]:
    """Meanings of the variables of peaks of an output, where they are not of displacements."""
    if output is None:
        return {}
    words, units = output.name.replace("_", " "), output.units
    return {
        "peak_amplitude": Variable((), units, f"{words} at the peak"),
        "peak_dof": Variable((), "1", f"row of the {words} that peaks"),
        "peaking_dof": Variable((), "1", f"row of the {words} whose peak it is"),
        "peak_amplitude_slope": Variable((), units, f"derivative of the {words} by the parameter"),
        "minimum_amplitude": Variable((), units, f"largest {words} where that is lowest"),
        "case_amplitude": Variable((), units, f"largest {words} of the case"),
        "active_amplitude": Variable((), units, f"{words} at the active maximum"),
        "active_dof": Variable((), "1", f"row of the {words} of the active maximum"),
        **{
            name: Variable((), units, f"{what} of the largest {words}")
            for name, what in (
                ("design_amplitude", "statistic at the optimum"),
                ("start_amplitude", "statistic at a start of the search"),
                ("descent_amplitude", "statistic at the end of a descent"),
                ("fresh_case_amplitude", "case not designed for: value"),
                ("fresh_amplitude", "statistic of cases not designed for"),
            )
        },
    }


def values_of(output: Output, basis: FourierBasis, coefficients: FloatArray) -> Table:
    """Results of an output from its coefficients (.., n_rows, n_components), by names of datasets.

    Without the axis of rows where the output has one value.
    """
    shape, rows = coefficients.shape[:-1], coefficients.reshape(-1, basis.n_components)
    known = np.isfinite(rows).all(axis=1)
    largest, spread = np.full((2, len(rows)), np.nan)
    if known.any():
        largest[known] = largest_displacement(basis, rows[known])[0]
        spread[known] = _range(basis, rows[known])
    values: dict[str, Any] = {
        "amplitude": largest.reshape(shape),
        "peak_to_peak": spread.reshape(shape),
        "coefficient": by_harmonic(basis, coefficients),
    }
    at = slice(None) if output.several else 0
    axis = len(shape) - 1
    pick = (slice(None),) * axis + (at,)
    return {f"{output.name}_{name}": of[pick] for name, of in values.items()}


def _range(basis: FourierBasis, rows: FloatArray) -> FloatArray:
    points = turning_points(basis, rows)
    lowest = np.take_along_axis(points.value, points.lowest[:, None], axis=1)
    return points.value[:, 0] - lowest[:, 0]
