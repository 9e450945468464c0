"""Measurements of signals over time, and of files that test programs write."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from symhbm.numerics import RADIANS, check
from symhbm.results.reading.measured import measured

_TYPES = {8: "m", 11: "m s-1", 12: "m s-2"}
"""SI units of what functions of universal files are of."""
_LABELS = {"m/s": "m s-1", "mm/s": "mm s-1", "m/s2": "m s-2", "m/s^2": "m s-2", "m/s**2": "m s-2"}
_FREQUENCY_RESPONSE, _SPECTRUM, _FORCES = 4, 12, (9, 13)
_DIRECTIONS = ("", ":x", ":y", ":z")


def measured_signal(
    time: Any,
    signal: Any,
    frequency: float,
    *,
    harmonics: Sequence[int] = (1,),
    highest: int | None = None,
    **test: Any,
) -> xr.Dataset:
    """The harmonics of a steady signal over time, as measurements that `symhbm.identify` fits.

    A mean and all harmonics up to ``highest`` are fitted to the signal by least squares; what they
    leave tells the standard deviations.

    Parameters
    ----------
    time, signal
        Instants [s], at any spacing, and what was measured there.
    frequency
        The frequency of the excitation [Hz]; at instant 0 its cosine is largest.
    harmonics
        Those that become measurements.
    highest
        Up to which harmonic all are fitted, so that none passes for noise; by default twice the
        highest of ``harmonics``, and 5 at least.
    **test
        As of `symhbm.datasets.measured`: ``units``, ``place``, ``quantity`` and parameters of the
        test.

    Returns
    -------
    Dataset as that of `symhbm.datasets.measured`.

    Raises
    ------
    TypeError, ValueError
        For bad arguments, and a signal that does not tell so many harmonics.

    Examples
    --------
    >>> import numpy as np
    >>> import symhbm as sh
    >>> time = np.linspace(0, 0.5, 501)
    >>> signal = 3 * np.cos(2 * np.pi * 20 * time) + 0.1 * np.sin(2 * np.pi * 60 * time)
    >>> data = sh.datasets.measured_signal(time, signal, 20.0, harmonics=(1, 3), units="m s-2")
    >>> data.measured_value.values.round(9) + 0.0
    array([ 3. ,  0. ,  0. , -0.1])
    """
    at, values = check.array("time", time), check.array("signal", signal)
    if at.ndim != 1 or at.shape != values.shape:
        raise ValueError(f"signal: expected as many values as instants, got {values.shape}")
    rate = RADIANS * check.scalar("frequency", frequency, "positive")
    wanted = np.array([check.integer("harmonics", n, minimum=1) for n in harmonics])
    if highest is None:
        highest = max(2 * int(wanted.max()), 5)
    highest = check.integer("highest", highest, minimum=int(wanted.max()))
    turns = np.outer(at, rate * np.arange(1, highest + 1))
    columns = np.column_stack([np.ones(len(at)), np.cos(turns), np.sin(turns)])
    found, _, rank, _ = np.linalg.lstsq(columns, values)
    whole = len(at) > 1 and np.ptp(at) * len(at) / (len(at) - 1) >= (1 - 1e-9) / frequency
    if rank < columns.shape[1] or len(at) == rank or not whole:
        raise ValueError(
            f"time: expected a period of {1 / frequency:g} s at least, and instants that tell "
            f"{highest} harmonics apart, got {len(at)} from {at.min():g} to {at.max():g} s"
        )
    left = values - columns @ found
    variances = np.linalg.inv(columns.T @ columns).diagonal() * (left @ left / (len(at) - rank))
    # Real and imaginary part have one standard deviation.
    deviation = np.sqrt((variances[wanted] + variances[highest + wanted]) / 2)
    floor = np.finfo(float).eps * float(np.abs(values).max() or 1.0)
    amplitude, given = found[wanted] - 1j * found[highest + wanted], np.maximum(deviation, floor)
    return measured(frequency, amplitude, harmonic=wanted, deviation=given, **test)


def measured_functions(
    path: str | os.PathLike[str],
    *,
    places: Mapping[str, Any] | None = None,
    units: str | None = None,
    force_amplitude: float | None = None,
    **test: Any,
) -> xr.Dataset:
    """Frequency responses and spectra of a Universal File Format file (58), as measurements.

    Needs the package pyuff, ``pip install symhbm[uff]``.

    Parameters
    ----------
    path
        The file. Time responses and others than frequency responses and spectra are left out.
    places
        Places of the model by those in the file, ``"7:x"`` for node 7 in direction x; by default
        they have the same names. With it, others are left out.
    units
        Those of the responses, forces being in N; by default what labels of axes say, or else the
        units of the file (data set 164) and the types of the functions.
    force_amplitude
        Amplitude [N] of the force of the test, by which frequency responses are multiplied.
    **test
        As of `symhbm.datasets.measured`: ``deviation`` in those units, or as many as there are
        frequencies, ``sweep`` and parameters of the test.

    Returns
    -------
    Dataset as that of `symhbm.datasets.measured`. What points along a negative axis changes its
    sign, of the response and of the reference.

    Raises
    ------
    TypeError, ValueError, KeyError, ImportError
        For bad arguments, files without such functions, units that are missing or contradict, and
        if pyuff is not installed.

    Examples
    --------
    >>> import symhbm as sh
    >>> data = sh.datasets.measured_functions(
    ...     "sweep.uff", places={"7:x": 0}, force_amplitude=2.0, deviation=1e-3
    ... )  # doctest: +SKIP
    """
    try:
        import pyuff  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise ImportError("pyuff is needed to read these files: pip install symhbm[uff]") from None
    if not os.path.exists(path):
        raise ValueError(f"path={str(path)!r}: expected the path of a file, there is none")
    found = pyuff.UFF(str(path)).read_sets()
    sets = [found] if isinstance(found, dict) else list(found)
    system: Any = next((one for one in sets if one["type"] == 164), None)
    parts, force = [], force_amplitude
    if force is not None:
        force = check.scalar("force_amplitude", force, "positive")
        test["force_amplitude"] = force
    for one in sets:
        if one["type"] != 58 or one["func_type"] not in (_FREQUENCY_RESPONSE, _SPECTRUM):
            continue
        directions = int(one.get("rsp_dir", 0)), int(one.get("ref_dir", 0))
        said = f"{int(one.get('rsp_node', 0))}{_DIRECTIONS[min(abs(directions[0]), 3)]}"
        if places is not None and said not in places:
            continue
        values = np.asarray(one["data"]) * np.where(np.array(directions) < 0, -1, 1).prod()
        if one["func_type"] == _FREQUENCY_RESPONSE:
            if force is None:
                raise ValueError("force_amplitude: expected that of the test, the file has ratios")
            values = values * (force * _force_unit(one, system, said))
        own, factor = (units, 1.0) if units is not None else _units_of(one, system, said)
        place, at = said if places is None else places[said], np.asarray(one["x"], dtype=float)
        moving = at > 0  # a spectrum may begin at 0 Hz
        parts.append(measured(at[moving], factor * values[moving], units=own, place=place, **test))
    if not parts:
        raise ValueError(f"path={str(path)!r}: expected frequency responses or spectra, got none")
    joined: Any = xr.concat(parts, "measurement", combine_attrs="override")
    return joined


def _label(function: Mapping[str, Any], axis: str) -> str:
    """The label of the units of an axis, empty where there is none."""
    label = str(function.get(f"{axis}_axis_units_lab") or "").strip(" ()[]")
    return "" if label.upper() == "NONE" else label


def _units_of(function: Mapping[str, Any], system: Any, said: str) -> tuple[str, float]:
    """Units of a function, and the factor to them; raises where nothing tells them."""
    label = _label(function, "ordinate").removesuffix("/N")
    of_label = _LABELS.get(label, label)
    if of_label in ("m", "mm", "um", "g", *_LABELS.values()):
        return of_label, 1.0
    of_type = _TYPES.get(int(function.get("ordinate_spec_data_type") or 0))
    if system is None or label or of_type is None:
        raise ValueError(
            f"units: expected those of the response at {said!r}, the file does not tell them "
            f"(label {label!r})"
        )
    return of_type, 1 / float(system["length"])


def _force_unit(function: Mapping[str, Any], system: Any, said: str) -> float:
    """What one over the unit of force of a frequency response is in 1/N; raises for others."""
    label, kind = _label(function, "orddenom"), int(function.get("orddenom_spec_data_type") or 0)
    if kind not in (0, *_FORCES) or label not in ("", "N"):
        raise ValueError(
            f"path: expected frequency responses over forces in N, that at {said!r} is over "
            f"{label or f'the type {kind}'!r}"
        )
    if system is None or label or _label(function, "ordinate").endswith("/N"):
        return 1.0
    return float(system["force"])
