"""Measured amplitudes beside computed ones, and what to measure next.

The latter is how sure each of some candidates would make the estimates of a fit.
"""

from typing import Any, Unpack

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from symhbm.numerics import RADIANS, FloatArray, check
from symhbm.plot.drawing import LINE_STYLES, axis_label, is_wide, shades
from symhbm.plot.looks import Look, pictured
from symhbm.plot.picture import Axis, Panel, Picture
from symhbm.plot.places import Chosen, chosen
from symhbm.results import check_dataset, check_present
from symhbm.results.reading import MEASURED

_POWERS = {"displacement": 0, "velocity": 1, "acceleration": 2}
_LOOK: Any = dict(marker="o", markersize=3.5, markerfacecolor="none", linestyle="")
_ALIKE = 1e-9
"""Relative difference up to which a parameter of a test is that of a curve."""
_CANDIDATE = "candidate_"


def check_measured(dataset: xr.Dataset, measured: Any) -> xr.Dataset | None:
    """The measurements to draw, by default those that a fit holds; TypeError for other things."""
    if measured is None:
        return dataset if MEASURED in getattr(dataset, "variables", ()) else None
    if not isinstance(measured, xr.Dataset) or MEASURED not in measured.variables:
        raise TypeError(
            f"measured={check.shown(measured)}: expected a dataset of symhbm.datasets.measured"
        )
    return measured


def place_of(measured: xr.Dataset | None, place: Any) -> Any:
    """What to show: what is asked for, else the one place where there are measurements."""
    if measured is None or place is not None:
        return place
    places = {*measured["measured_place"].values.tolist()}
    return _place(places.pop()) if len(places) == 1 else None


def draw_measured(
    panel: Panel, measured: xr.Dataset, curve: xr.Dataset, where: Chosen, scale: Any, color: Any
) -> None:
    """Draw the amplitudes that were measured under the parameters of a curve, as hollow circles."""
    frequency, amplitude = measured_points(measured, curve, where)
    panel.line(frequency, scale.of(amplitude), **(_LOOK | {"color": color}))


def measured_points(
    measured: xr.Dataset, curve: xr.Dataset, where: Chosen
) -> tuple[FloatArray, FloatArray]:
    """Frequencies [Hz] and amplitudes [m] that were measured under the parameters of a curve.

    Of complex ones it is the magnitude; velocities and accelerations become displacements.
    """
    frequency, amplitude = amplitudes(measured)
    here = np.isin(measured["measured_place"].values, _names(measured, curve, where))
    here &= np.isfinite(amplitude) & of_test(measured, curve)
    return frequency[here], amplitude[here]


def draw_modes(panel: Panel, measured: xr.Dataset, curve: xr.Dataset, name: str, look: Any) -> None:
    """Draw measured frequencies or damping ratios of modes over their amplitudes."""
    panel.line(*mode_points(measured, curve, name), **(_LOOK | {"color": look}))


def mode_points(
    measured: xr.Dataset, curve: xr.Dataset, name: str
) -> tuple[FloatArray, FloatArray]:
    """Amplitudes [m] of measured modes, and their ``frequency`` [Hz] or ``damping_ratio``."""
    form = {"frequency": "mode_frequency", "damping_ratio": "mode_damping"}[name]
    here = (measured["measured_form"].values == form) & of_test(measured, curve)
    return measured["measured_amplitude"].values[here], measured[MEASURED].values[here]


def of_test(measured: xr.Dataset, curve: xr.Dataset) -> NDArray[np.bool_]:
    """Which rows were measured under the parameters of a curve, and are not left out."""
    here = measured["measured_left_out"].values == 0
    for name in measured.variables:
        parameter = str(name).removeprefix("measured_at_")
        if parameter != name and parameter in curve.variables and not curve[parameter].ndim:
            known = measured[name].values
            alike = np.isclose(known, curve[parameter].item(), rtol=_ALIKE, atol=0.0)
            here &= alike | np.isnan(known)
    return here


def amplitudes(measured: xr.Dataset) -> tuple[FloatArray, FloatArray]:
    """Frequencies [Hz] and amplitudes [m] of all rows, NaN of those that tell none."""
    form, value = measured["measured_form"].values, measured[MEASURED].values
    amplitude = np.where(np.isin(form, ("magnitude", "peak_amplitude")), value, np.nan)
    real = np.flatnonzero(form == "real")
    # The imaginary part of a complex value is the row after its real part.
    amplitude[real] = np.hypot(value[real], value[real + 1])
    frequency = measured["measured_frequency"].values
    omega = RADIANS * frequency * measured["measured_harmonic"].values
    quantity = measured["measured_quantity"].values
    power = np.array([_POWERS.get(one, np.nan) for one in quantity])
    return frequency, amplitude / omega**power


def _names(measured: xr.Dataset, curve: xr.Dataset, where: Chosen) -> list[str]:
    """Names of the places of measurements that are shown."""
    names = dict.fromkeys(measured["measured_place"].values.tolist())
    if where.every:
        return [*names]
    return [name for name in names if {*chosen(curve, _place(name)).dofs} <= {*where.dofs}]


def _place(name: str) -> Any:
    return int(name) if name.isdecimal() else name


@pictured
def next_measurements(dataset: xr.Dataset, **common: Unpack[Look]) -> Picture:
    """Draw the standard errors of estimates after each of some measurements, relative to these.

    Over the one parameter that candidates differ by, or else over their rank; thin lines are the
    errors of the fit as it is, and the filled marks are those of the best candidate.

    Parameters
    ----------
    dataset
        A result of `symhbm.design.identification.next_measurements`.
    common
        As of all pictures.

    Returns
    -------
    The figure.

    Raises
    ------
    TypeError, KeyError, ValueError
        For no dataset, one without candidates, and axes that are none.

    Examples
    --------
    >>> import numpy as np
    >>> import symhbm as sh
    >>> from symhbm.design.identification import next_measurements
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> response = sh.solve(problem, 20.0).coefficient.values.ravel() @ [1, -1j]
    >>> data = sh.datasets.measured(20.0, response, units="m", deviation=1e-6)
    >>> fit = sh.identify(problem, data, ["normal_load", "contact_stiffness"], progress=False)
    >>> candidates = sh.datasets.measured(
    ...     20.0, 0j, units="m", deviation=1e-6, force_amplitude=[0.5, 1, 2]
    ... )
    >>> sh.plot.next_measurements(next_measurements(fit, candidates)).savefig("next.png")
    """
    check_dataset("dataset", dataset)
    if "expected_error" not in dataset.variables:
        raise TypeError("dataset: expected a result of next_measurements")
    check_present(dataset, "unknown", "estimate", "standard_error")
    size, label = dataset.sizes["candidate"], "rank"
    values = np.arange(1.0, size + 1)
    names = [str(name) for name in dataset.variables if str(name).startswith(_CANDIDATE)]
    differ = [name for name in names if len({*dataset[name].values.tolist()}) > 1]
    if len(differ) == 1:
        values = dataset[differ[0]].values.astype(float)
        label = axis_label(dataset, differ[0].removeprefix(_CANDIDATE))
    errors = dataset["expected_error"].values / np.abs(dataset["estimate"].values)
    known = dataset["standard_error"].values / np.abs(dataset["estimate"].values)
    drawn = np.concatenate([errors.ravel(), known])
    drawn = drawn[np.isfinite(drawn)]
    panel = Panel(
        Axis(label, log=is_wide(values)), Axis("standard error, relative", log=is_wide(drawn))
    )
    order = np.argsort(values, kind="stable")
    ends = values[order[[0, -1]]]
    labels = [str(one).replace("_", " ") for one in dataset["unknown"].values]
    for number, (text, color) in enumerate(zip(labels, shades(len(labels)), strict=True)):
        look: Any = dict(color=color, linestyle=LINE_STYLES[number % len(LINE_STYLES)])
        mark: Any = dict(marker="o", markersize=5)
        white = look | mark | dict(markerfacecolor="white")
        panel.line(values[order], errors[order, number], text, **white)
        panel.line(values[:1], errors[:1, number], color=color, linestyle="", **mark)
        panel.line(ends, np.full(2, known[number]), linewidth=0.6, **look)
    return Picture([panel])
