"""Phases of responses over the parameter that moves."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from symhbm.model import Place
from symhbm.numerics import check
from symhbm.plot.curves import check_curves
from symhbm.plot.drawing import (
    Family,
    check_anything,
    check_variables,
    one_solution,
    parameter_axis,
)
from symhbm.plot.lines import mark_ends
from symhbm.plot.picture import Axis, Panel, Picture
from symhbm.plot.rendering import pictured
from symhbm.results.reading import motion

_UNITS = {"deg": 180 / np.pi, "rad": 1.0}


@pictured
def phase(
    dataset: xr.Dataset,
    *,
    place: Place = 0,
    harmonic: int | None = None,
    unit: str = "deg",
    ax: Axes | None = None,
) -> Picture:
    """Draw the phase lag of a harmonic over the moving parameter, a line per parameter set.

    It is positive where the harmonic ``n`` comes later than ``cos(n omega t)``, as of
    `symhbm.datasets.motion`, and runs on beyond half a turn along a curve. A red cross is where a
    curve ends that is not complete.

    Parameters
    ----------
    dataset
        A result of `symhbm.frf` or `symhbm.follow` with ``coefficient``.
    place
        The degree of freedom to show: its number, ``"blade 3"``, or its name as ``"tip:y"``.
    harmonic
        The harmonic; by default the lowest one above 0.
    unit
        ``"deg"`` or ``"rad"``.
    ax
        Axes to draw into; by default a new figure.

    Raises
    ------
    TypeError, KeyError, ValueError
        If the dataset holds no curve or no coefficients, no point converged, there are several
        solutions at a value, or ``place``, ``harmonic`` or ``unit`` are unknown.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> figure = sh.plot.phase(sh.frf(problem, (10, 30), over={"normal_load": [1, 3]}))
    >>> figure.savefig("phase.png")
    """
    parameter, where = check_curves(dataset, place)
    number = where.alone
    if number is None:
        raise ValueError(
            f"place={check.shown(place)}: expected one degree of freedom, this is {len(where.dofs)}"
        )
    check_variables(dataset, "coefficient")
    factor = _UNITS[check.one_of("unit", unit, _UNITS)]
    known = [n for n in dataset["harmonic"].values.tolist() if n > 0]
    harmonic = known[0] if harmonic is None else check.integer("harmonic", harmonic, 1)
    if harmonic not in known:
        raise ValueError(f"harmonic={harmonic}: expected one of {known}")
    check_anything(dataset, "amplitude")
    dataset = one_solution(dataset)
    lag = motion(dataset.isel(dof=number))["phase_lag"].sel(harmonic=harmonic)
    turn = r"\omega t" if harmonic == 1 else rf"{harmonic} \omega t"
    which = where.words.removeprefix("response of ")
    panel = Panel(
        parameter_axis(dataset, parameter.name, room=0),
        Axis(rf"phase lag of {which} behind $\cos({turn})$ [{unit}]"),
    )
    family = Family(dataset, [str(dim) for dim in lag.dims if dim != parameter.along])
    for member, one in family.curves():
        value, angle = one[parameter.name].values, lag.isel(member.position).values
        inside = np.isfinite(value) & np.isfinite(angle)
        shown = np.full(len(value), np.nan)
        shown[inside] = factor * np.unwrap(angle[inside])
        panel.line(value, shown, **member.look)
        mark_ends(panel, one, parameter.name, shown)
    family.explain(panel)
    return Picture([panel])
