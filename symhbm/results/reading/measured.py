"""Measurements as a dataset: one real number a row, with where, when and how it was taken."""

from __future__ import annotations

import inspect
import os
from collections.abc import Mapping
from difflib import get_close_matches
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
_FORMS = ("complex", "magnitude", "phase", "peak", "mode")
_PAIRS = {
    "complex": ("real", "imaginary"),
    "peak": ("peak_frequency", "peak_amplitude"),
    "mode": ("mode_frequency", "mode_damping"),
}
"""Forms of two real numbers each."""
_SWEEPS = ("up", "down")
_MISTYPED = 0.8
"""Likeness of a name to that of an argument from which it is one that was mistyped."""


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
    frequency_deviation: Any = None,
    band: tuple[Any, Any] | None = None,
    amplitude: Any = None,
    mode: Any = 0,
    nodal_diameter: Any = None,
    sweep: Any = "up",
    left_out: Any = False,
    table: pd.DataFrame | Mapping[str, Any] | str | os.PathLike[str] | None = None,
    **known: Any,
) -> xr.Dataset:
    """Measured responses, peaks or modes as a dataset that `symhbm.identify` fits.

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
        two columns, of the real and the imaginary part. Of modes the damping ratio; None of peaks
        and modes of which the frequency alone was measured.
    units
        Those of the response: ``"m"``, ``"mm"``, ``"um"``, ``"m s-1"``, ``"mm s-1"``, ``"m s-2"``,
        ``"g"``, of phases ``"rad"`` or ``"deg"``, of an output of the model its own; of modes
        those of their ``amplitude``.
    place
        Which degree of freedom, by number or name as ``"tip:y"``; of an output which row.
    form
        ``"complex"``, ``"magnitude"`` (no less than 0, half of peak to peak) or ``"phase"``;
        ``"peak"``, the frequency and magnitude of the highest peak in a ``band``; ``"mode"``,
        the frequency and damping ratio of a free motion of some ``amplitude``, as tests in phase
        resonance and decays tell them.
    quantity
        ``"displacement"``, ``"velocity"``, ``"acceleration"`` or the name of an output of the
        model; by default what ``units`` are of, and of phases the displacement.
    harmonic
        Which harmonic of the excitation frequency it is of.
    deviation
        Standard deviation of the response in ``units``, of real and imaginary part each. By default
        one that is common to all measurements and not known: the fit estimates it.
    frequency_deviation
        Standard deviation [Hz] of the frequencies of peaks and modes.
    band
        Frequencies [Hz] between which a peak is the highest, by default half and twice its own.
    amplitude
        Of modes, that of the first harmonic at the place, in ``units`` [m]; by default motions are
        small, and contacts stick: natural frequencies and modal damping.
    mode, nodal_diameter
        Which mode, as in `symhbm.nonlinear_modes`.
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
    for name in known:
        if near := get_close_matches(name, inspect.signature(measured).parameters, 1, _MISTYPED):
            raise TypeError(f"{name}: expected a parameter of the problem; did you mean {near[0]}?")
    columns = _columns(table)
    check.one_of("form", form, _FORMS)
    scale, quantity, units = _scale(check.text("units", units), form, quantity)
    if form == "mode" and quantity != "displacement":
        raise ValueError(f"units={units!r}: expected those of the amplitude of modes, of a length")
    values = (1.0 if form == "mode" else scale) * _response(response, columns, form)
    given = {
        "frequency": _numbers("frequency", frequency, columns, "positive"),
        "harmonic": _numbers("harmonic", harmonic, columns, "non-negative"),
        "deviation": _deviation(deviation, columns, 1.0 if form == "mode" else scale),
        "place": np.asarray(_column(place, columns)),
        "sweep": np.asarray(_column(sweep, columns)),
        "left_out": np.asarray(_column(left_out, columns)),
    }
    own = {"frequency_deviation": frequency_deviation, "band": band}
    own |= {"amplitude": amplitude, "nodal_diameter": nodal_diameter, "mode": mode or None}
    if form in ("peak", "mode"):
        given |= _of_motion(form, own, columns, given["frequency"], scale)
    elif bad := [name for name, value in own.items() if value is not None]:
        raise ValueError(f"{bad[0]}: expected None, it is of peaks or modes, got form={form!r}")
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
    unknown = ~np.isfinite(values) & ~flat["left_out"] & (response is not None)
    if unknown.any():
        first = flat["frequency"][unknown][0]
        raise ValueError(
            f"response: expected numbers, {unknown.sum()} of {values.size} are not finite, the "
            f"first at {first:g} Hz; left_out=~np.isfinite(response) keeps them in the dataset and "
            "leaves them out of fits"
        )
    if form in ("magnitude", "peak") and np.any(values[~flat["left_out"]] < 0):
        raise ValueError("response: expected magnitudes of no less than 0")
    pair = _PAIRS.get(form, (form,))
    flat = {name: np.repeat(array, len(pair)) for name, array in flat.items()}
    forms = np.tile(np.array(pair, dtype=object), len(values))
    units_of = np.full(len(forms), units, dtype=object)
    if form == "complex":
        values = np.column_stack([np.real(values), np.imag(values)]).ravel()
    elif len(pair) == 2:
        values = np.column_stack([flat["frequency"][::2], values]).ravel()
        flat["left_out"][1::2] |= response is None
        flat["deviation"][::2] = flat.pop("frequency_deviation")[::2]
        units_of[::2] = "Hz"
        units_of[1::2] = "1" if form == "mode" else units
    return _labelled(values, forms, (quantity, units_of), flat, tuple(known))


def _labelled(
    values: FloatArray,
    forms: np.ndarray,
    of: tuple[str, np.ndarray],
    flat: Mapping[str, np.ndarray],
    known: tuple[str, ...],
) -> xr.Dataset:
    """The dataset of as many rows; ``of`` are the quantity and the unit of each."""
    quantity, each = of
    units = each[0] if len({*each}) == 1 else "measured_units"
    texts = {name: flat[name].astype(str).astype(object) for name in ("place", "sweep")}
    table = {
        MEASURED: (values, units, "measured value"),
        "measured_deviation": (flat["deviation"], units, "standard deviation, NaN where unknown"),
        "measured_frequency": (flat["frequency"], "Hz", "excitation frequency of the measurement"),
        "measured_harmonic": (flat["harmonic"].astype(np.int32), "1", "harmonic that was measured"),
        "measured_form": (forms, "1", "what of a response, a peak or a mode"),
        "measured_quantity": (np.full(len(values), quantity, dtype=object), "1", "what it is of"),
        "measured_units": (each, "1", "unit of the value"),
        "measured_place": (texts["place"], "1", "where it was measured"),
        "measured_sweep": (texts["sweep"], "1", "up or down: how the frequency was led"),
        "measured_left_out": (flat["left_out"].astype(np.int8), "1", "1 where fits leave it out"),
    }
    table |= {f"measured_{n}": (flat[n], *of) for n, of in _OF_MOTIONS.items() if n in flat}
    table |= {f"measured_at_{n}": (flat[n], "SI units", f"{n} of the test") for n in known}
    variables = {
        name: ("measurement", value, {"units": unit, "long_name": meaning})
        for name, (value, unit, meaning) in table.items()
    }
    return xr.Dataset(variables, attrs={"title": "Measured responses"})


_OF_MOTIONS = {
    "lowest": ("Hz", "frequency from which on a peak is the highest"),
    "highest": ("Hz", "frequency up to which a peak is the highest"),
    "amplitude": ("m", "amplitude of a mode, NaN of small motions"),
    "mode": ("1", "number of a mode"),
    "nodal_diameter": ("1", "nodal diameters of a mode, NaN where it is no wave"),
}
"""What peaks and modes are given with: units, and what it is."""


def _of_motion(
    form: str, own: dict[str, Any], columns: Mapping[str, Any], frequency: FloatArray, scale: float
) -> dict[str, FloatArray]:
    """What peaks and modes are given with, as arrays; raises for what the other is given with."""
    own = dict(own)
    deviation, band = own.pop("frequency_deviation"), own.pop("band")
    result = {"frequency_deviation": _deviation(deviation, columns, 1.0)}
    if form == "peak":
        if bad := [name for name, value in own.items() if value is not None]:
            raise ValueError(f"{bad[0]}: expected None, it is of modes, got form='peak'")
        low, high = (0.5 * frequency, 2 * frequency) if band is None else band
        low, high = (_numbers("band", end, columns, "positive") for end in (low, high))
        if np.any((low > frequency) | (frequency > high)):
            raise ValueError(f"band={check.shown(band)}: expected the frequencies of peaks in it")
        return result | {"lowest": low, "highest": high}
    if band is not None:
        raise ValueError("band: expected None, it is of peaks, got form='mode'")
    bounds = {"amplitude": "positive", "mode": "non-negative", "nodal_diameter": "any"}
    for name, bound in bounds.items():
        missing = np.array(0.0 if name == "mode" else np.nan)
        value = own[name]
        result[name] = missing if value is None else _numbers(name, value, columns, bound)
    return result | {"amplitude": scale * result["amplitude"]}


def _columns(table: Any) -> Mapping[str, Any]:
    """The columns of a table by name."""
    if table is None:
        return {}
    if isinstance(table, (str, os.PathLike)):
        path = Path(table)
        if path.suffix.lower() not in (".csv", ".mat"):
            raise ValueError(f"table={str(table)!r}: expected the path of a .csv or a .mat file")
        if not path.exists():
            raise FileNotFoundError(f"table={str(table)!r}: expected a file, there is none")
        if path.suffix.lower() == ".mat":
            from scipy.io import loadmat

            found = loadmat(path, squeeze_me=True)
            return {name: of for name, of in found.items() if not name.startswith("__")}
        table = pd.read_csv(path, skipinitialspace=True)
    if isinstance(table, pd.DataFrame):
        return {str(name): table[name].to_numpy() for name in table.columns}
    check.instance("table", table, Mapping, "a table of pandas, or a path")
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
    if response is None and form in ("peak", "mode"):
        return np.array(np.nan)
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
