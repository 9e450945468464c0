"""Backbones in the axes of responses: modes, phase resonances and peaks over a parameter."""

from typing import Any, Unpack

import numpy as np
import xarray as xr

from symhbm.plot.curves import check_curves, of_harmonic, shown_amplitude
from symhbm.plot.drawing import (
    MOST_LEGEND_ENTRIES,
    check_anything,
    one_solution,
    point_of,
    scale_of,
)
from symhbm.plot.lines import MARK, curved
from symhbm.plot.looks import Named, compared
from symhbm.plot.picture import Axis, Panel, Picture
from symhbm.plot.places import Shown, chosen
from symhbm.results import Description, check_dataset, check_present
from symhbm.results.reading import amplitude_of

_LOOK: Any = dict(color=np.array([0.0, 0.0, 0.0, 1.0]), linestyle="-", linewidth=1.0)
_RESONANCE = "phase resonance"


@compared
def backbone(
    dataset: xr.Dataset,
    *,
    place: Shown = None,
    harmonic: int | None = None,
    scale: str = "decibel",
    unit: str = "m",
    **common: Unpack[Named],
) -> Picture:
    """Draw amplitude over frequency of resonances, to go with `response` in one picture.

    Of nonlinear modes it is the largest displacement over their frequency. Of a sweep of responses
    these are its phase resonances, where they were located, or else the highest peak of each
    curve; of `symhbm.peak_curve` the leading peak over the parameter. Lines go through what was
    computed.

    Parameters
    ----------
    dataset
        A result of `symhbm.nonlinear_modes`, `symhbm.frf` or `symhbm.peak_curve`; of an output of
        `symhbm.frf` what `symhbm.datasets.output` makes of it.
    place, harmonic, scale, unit
        As of `response`, by default dB re 1 m.
    common
        As of all pictures.

    Raises
    ------
    TypeError, KeyError, ValueError
        For other datasets, one without a point, and bad arguments.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce(), (1, 3))
    >>> modes = sh.nonlinear_modes(problem, progress=False)
    >>> with sh.plot.panels() as (figure, ax):
    ...     drawn = sh.plot.response(sh.frf(problem, (14, 25)), label="1 N", ax=ax)
    ...     drawn = sh.plot.backbone(modes, label="nonlinear mode", ax=ax)
    >>> figure.savefig("backbone.png")
    """
    check_dataset("dataset", dataset, unforced=True)
    found, along = _resonances(dataset)
    found = found if harmonic is None else of_harmonic(found, harmonic)
    check_anything(found, "amplitude")
    shown, where = scale_of(scale, unit, found), chosen(dataset, place)
    words = where.words if harmonic is None else f"harmonic {harmonic}, {where.words}"
    across = Axis("frequency $f$ [Hz]")  # of modes and of responses, in whose axes this is drawn
    panel = Panel(across, shown.axis(words))
    amplitude = shown_amplitude(found, where)
    order = *(dim for dim in amplitude.dims if dim != along), along
    frequency = found["frequency"].broadcast_like(amplitude)
    each = (of.transpose(*order).values for of in (frequency, amplitude))
    rows = [of.reshape(-1, of.shape[-1]) for of in each]
    few = rows[0].shape[1] <= MOST_LEGEND_ENTRIES
    known = np.isfinite(rows[1])
    # Where some curves have fewer resonances, it is not known which belong together.
    joined = not few or bool(np.all(known.all(axis=1) == known.any(axis=1)))
    for x, y in zip(*rows, strict=True):
        if joined:
            panel.line(*curved(x, shown.of(y)), **_LOOK)
        if few:
            panel.line(x, shown.of(y), **MARK | dict(marker="<", color=_LOOK["color"]))
    return Picture([panel])


def _resonances(dataset: xr.Dataset) -> tuple[xr.Dataset, str]:
    """Frequency, amplitude and coefficients of resonances, and the dimension that joins them."""
    moves, names = Description(dataset).moving, ["frequency", "amplitude", "coefficient"]
    stored, kinds = names, dataset.get("event_kind", xr.DataArray(""))
    if Description(dataset).unforced == "nonlinear mode":
        along, stored = "point" if "point" in dataset.dims else moves, [*names]
        stored[1] = "largest_displacement"
        one = one_solution(dataset).reset_coords("amplitude", drop=True)
    elif "peak_frequency" in dataset and dataset["peak_frequency"].dims == (moves,):
        along, names = moves, ["frequency", "coefficient"]
        stored, one = [f"peak_{name}" for name in names], dataset.drop_vars(names, errors="ignore")
    else:
        inner = check_curves(dataset, None)[0].along, "dof", "solution"
        swept = [str(dim) for dim in dataset["amplitude"].dims if dim not in inner]
        along, one = [*swept, "curve"][0], point_of(dataset, "peak")
        if inner[0] == "point" and (kinds == _RESONANCE).any():
            at = dataset["event_frequency"].where(kinds == _RESONANCE).transpose(..., "event")
            at = at.copy(data=np.sort(at.values, axis=-1)).dropna("event", how="all")
            apart = abs(dataset["frequency"] - at).fillna(np.inf).transpose(..., "point")
            of_points = dataset[[*names]].drop_dims("event", errors="ignore")
            one = of_points.isel(point=apart.argmin("point")).where(at.notnull())
    check_present(one, *stored)
    result = one[stored].rename(dict(zip(stored, names, strict=True)))
    if "amplitude" not in result:
        result["amplitude"] = amplitude_of(result["coefficient"])
    return (result if along in result.dims else result.expand_dims(along)), along
