"""Measurements as a dataset: one real number a row, with where, when and how it was taken."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from symhbm.numerics import FloatArray, check

MEASURED = "measured_value"
"""Variable of the values, along ``measurement``, in SI units."""
_UNITS = {
    **{"m": ("displacement", 1.0), "mm": ("displacement", 1e-3), "um": ("displacement", 1e-6)},
    **{"m s-1": ("velocity", 1.0), "mm s-1": ("velocity", 1e-3)},
    **{"m s-2": ("acceleration", 1.0), "g": ("acceleration", 9.80665)},
}
"""Units of motions: the quantity that they are of, and how much of SI units each is."""
_ANGLES = {"rad": 1.0, "deg": np.pi / 180}
_QUANTITIES = {"displacement": "m", "velocity": "m s-1", "acceleration": "m s-2"}
_FORMS = ("complex", "magnitude", "phase")
_SWEEPS = ("up", "down")


def measured(
    frequency: Any,
    response: Any,
    *,
    units: str,
    place: Any = 0,
    form: str = "complex",
    quantity: str | None = None,
    harmonic: Any = 1,
    deviation: Any = None,
    sweep: Any = "up",
    left_out: Any = False,
    table: pd.DataFrame | Mapping[str, Any] | str | os.PathLike[str] | None = None,
    **known: Any,
) -> xr.Dataset:
    """Measured responses as a dataset that `symhbm.identify` fits.

    All but ``units``, ``form`` and ``quantity`` may be arrays, whose shapes broadcast: levels in
    rows and frequencies in columns, for example. With a ``table``, text that names one of its
    columns stands for that column.

    Parameters
    ----------
    frequency
        Frequencies [Hz].
    response
        What was measured there. Complex amplitudes turn as ``exp(i omega t)``: the displacement is
        the real part of ``response exp(i harmonic omega t)``. With a ``table`` also the names of
        two columns, of the real and the imaginary part.
    units
        Those of the response: ``"m"``, ``"mm"``, ``"um"``, ``"m s-1"``, ``"mm s-1"``, ``"m s-2"``,
        ``"g"``, of phases ``"rad"`` or ``"deg"``, of an output of the model its own.
    place
        Which degree of freedom, by number or name as ``"tip:y"``; of an output which row.
    form
        ``"complex"``, ``"magnitude"`` (no less than 0, half of peak to peak) or ``"phase"``.
    quantity
        ``"displacement"``, ``"velocity"``, ``"acceleration"`` or the name of an output of the
        model; by default what ``units`` are of, and of phases the displacement.
    harmonic
        Which harmonic of the excitation frequency it is of.
    deviation
        Standard deviation of the response in ``units``, of real and imaginary part each. By default
        one that is common to all measurements and not known: the fit estimates it.
    sweep
        ``"up"`` or ``"down"``: how the frequency was led, where responses jump.
    left_out
        True for points that stay in the dataset and out of fits.
    table
        A table of pandas, a mapping from names to columns, or the path of a ``.csv`` or a MATLAB
        file, ``.mat``.
    **known
        Parameters of the problem that were set in the test, as ``force_amplitude=[0.5, 1, 2]``.

    Returns
    -------
    Dataset along ``measurement``, a real number a row (two of a complex one), in SI units.

    Raises
    ------
    TypeError, ValueError, KeyError
        For bad arguments, each named with its value and what is allowed.

    Examples
    --------
    >>> import symhbm as sh
    >>> data = sh.datasets.measured(
    ...     [10, 15, 20], [[0.1 - 0.01j, 0.13 - 0.02j, 0.4 - 0.3j]], units="mm",
    ...     deviation=0.002, force_amplitude=[[1.0]],
    ... )
    >>> data.sizes["measurement"], data.measured_value.values[:2]
    (6, array([ 1.e-04, -1.e-05]))
    """
    columns = _columns(table)
    check.one_of("form", form, _FORMS)
    scale, quantity, units = _scale(check.text("units", units), form, quantity)
    values = scale * _response(response, columns, form)
    given = {
        "frequency": _numbers("frequency", frequency, columns, "positive"),
        "harmonic": _numbers("harmonic", harmonic, columns, "non-negative"),
        "deviation": _deviation(deviation, columns, scale),
        "place": np.asarray(_column(place, columns)),
        "sweep": np.asarray(_column(sweep, columns)),
        "left_out": np.asarray(_column(left_out, columns)),
    }
    given |= {name: _numbers(name, value, columns) for name, value in known.items()}
    try:
        values, *arrays = np.broadcast_arrays(values, *given.values())
    except ValueError:
        shapes = {"response": values.shape} | {name: of.shape for name, of in given.items()}
        told = ", ".join(f"{name} {shape}" for name, shape in shapes.items() if shape)
        raise ValueError(f"response: expected shapes that go together, got {told}") from None
    flat = {name: array.ravel() for name, array in zip(given, arrays, strict=True)}
    values = values.ravel()
    if flat["left_out"].dtype.kind != "b":
        raise TypeError(f"left_out={check.shown(left_out)}: expected True or False")
    if bad := sorted({*map(str, np.unique(flat["sweep"]))} - {*_SWEEPS}):
        raise ValueError(f"sweep={check.shown(bad[0])}: expected one of 'up', 'down'")
    if np.any(flat["harmonic"] % 1):
        raise ValueError(f"harmonic={check.shown(harmonic)}: expected integers")
    if not values.size:
        raise ValueError("response: expected at least one value, got none")
    unknown = ~np.isfinite(values) & ~flat["left_out"]
    if unknown.any():
        first = flat["frequency"][unknown][0]
        raise ValueError(
            f"response: expected numbers, {unknown.sum()} of {values.size} are not finite, the "
            f"first at {first:g} Hz; left_out=~np.isfinite(response) keeps them in the dataset and "
            "leaves them out of fits"
        )
    if form == "magnitude" and np.any(values[~flat["left_out"]] < 0):
        raise ValueError("response: expected magnitudes of no less than 0")
    repeats = 2 if form == "complex" else 1
    flat = {name: np.repeat(array, repeats) for name, array in flat.items()}
    forms = np.full(len(values), form, dtype=object)
    if form == "complex":
        values = np.column_stack([np.real(values), np.imag(values)]).ravel()
        forms = np.tile(np.array(["real", "imaginary"], dtype=object), len(values) // 2)
    return _labelled(values, forms, (quantity, units), flat, tuple(known))


def _labelled(
    values: FloatArray,
    forms: np.ndarray,
    of: tuple[str, str],
    flat: Mapping[str, np.ndarray],
    known: tuple[str, ...],
) -> xr.Dataset:
    """The dataset of as many rows; ``of`` are the quantity and its unit."""
    quantity, units = of
    texts = {name: flat[name].astype(str).astype(object) for name in ("place", "sweep")}
    table = {
        MEASURED: (values, units, "measured value"),
        "measured_deviation": (flat["deviation"], units, "standard deviation, NaN where unknown"),
        "measured_frequency": (flat["frequency"], "Hz", "excitation frequency of the measurement"),
        "measured_harmonic": (flat["harmonic"].astype(np.int32), "1", "harmonic that was measured"),
        "measured_form": (forms, "1", "real, imaginary, magnitude or phase"),
        "measured_quantity": (np.full(len(values), quantity, dtype=object), "1", "what it is of"),
        "measured_units": (np.full(len(values), units, dtype=object), "1", "unit of the value"),
        "measured_place": (texts["place"], "1", "where it was measured"),
        "measured_sweep": (texts["sweep"], "1", "up or down: how the frequency was led"),
        "measured_left_out": (flat["left_out"].astype(np.int8), "1", "1 where fits leave it out"),
    }
    table |= {f"measured_at_{n}": (flat[n], "SI units", f"{n} of the test") for n in known}
    variables = {
        name: ("measurement", value, {"units": unit, "long_name": meaning})
        for name, (value, unit, meaning) in table.items()
    }
    return xr.Dataset(variables, attrs={"title": "Measured responses"})


def _columns(table: Any) -> Mapping[str, Any]:
    """The columns of a table by name."""
    if table is None:
        return {}
    if isinstance(table, (str, os.PathLike)):
        path = Path(table)
        if path.suffix.lower() == ".mat":
            from scipy.io import loadmat

            found = loadmat(path, squeeze_me=True)
            return {name: of for name, of in found.items() if not name.startswith("__")}
        if path.suffix.lower() != ".csv":
            raise ValueError(f"table={str(table)!r}: expected the path of a .csv or a .mat file")
        table = pd.read_csv(path, skipinitialspace=True)
    if isinstance(table, pd.DataFrame):
        return {str(name): table[name].to_numpy() for name in table.columns}
    if not isinstance(table, Mapping):
        raise TypeError(f"table={check.shown(table)}: expected a table of pandas, or a path")
    return table


def _column(value: Any, columns: Mapping[str, Any]) -> Any:
    """The column that a text names, else the value itself."""
    return columns[value] if isinstance(value, str) and value in columns else value


def _numbers(name: str, value: Any, columns: Mapping[str, Any], bound: str = "any") -> FloatArray:
    if isinstance(value, str):
        check.known(value, columns, f"column of the table ({name})")
    return check.array(name, _column(value, columns), bound)


def _response(response: Any, columns: Mapping[str, Any], form: str) -> np.ndarray:
    """The values of a response, complex ones of two columns, too."""
    if isinstance(response, (list, tuple)) and all(isinstance(one, str) for one in response):
        if len(response) != 2 or form != "complex":
            raise ValueError(
                f"response={check.shown(response)}: expected the names of two columns, of the real "
                "and the imaginary part of a complex one"
            )
        real, imaginary = (_response(name, columns, "") for name in response)
        return real + 1j * imaginary
    if isinstance(response, str):
        check.known(response, columns, "column of the table (response)")
    values = np.asarray(_column(response, columns))
    if values.dtype.kind not in "iufc":
        raise TypeError(f"response={check.shown(response)}: expected numbers")
    if values.dtype.kind == "c" and form != "complex":
        raise ValueError(
            f"form={form!r}: expected real values, got complex ones; use form='complex'"
        )
    return values.astype(complex if form == "complex" else float)


def _deviation(deviation: Any, columns: Mapping[str, Any], scale: float) -> FloatArray:
    if deviation is None:
        return np.array(np.nan)
    return scale * _numbers("deviation", deviation, columns, "positive")


def _scale(units: str, form: str, quantity: str | None) -> tuple[float, str, str]:
    """How much of SI units a unit is, the quantity that was measured, and its unit."""
    if form == "phase":
        if units not in _ANGLES:
            raise ValueError(f"units={units!r}: expected those of phases, 'rad' or 'deg'")
        return _ANGLES[units], quantity or "displacement", "rad"
    if units not in _UNITS:
        if quantity is None or quantity in _QUANTITIES:
            allowed = ", ".join(map(repr, _UNITS))
            raise ValueError(
                f"units={units!r}: expected one of {allowed}, or those of an output with "
                "quantity= its name"
            )
        return 1.0, quantity, units
    own, scale = _UNITS[units]
    if quantity in _QUANTITIES and quantity != own:
        raise ValueError(f"units={units!r}: expected those of a {quantity}, these are of a {own}")
    return scale, quantity or own, _QUANTITIES[own]
