"""What contacts do over the interface that they lie in."""

from typing import Any, Unpack

import numpy as np
import xarray as xr

from symhbm.plot.contact.states import LOOKS
from symhbm.plot.drawing import (
    check_variables,
    moving,
    nothing_to_draw,
    point_of,
    point_text,
    scaled,
)
from symhbm.plot.looks import Look, pictured
from symhbm.plot.picture import Axis, Colours, Panel, Picture
from symhbm.results import Description, meaning
from symhbm.results.reading import At

_AXES = "xyz"


@pictured
def contact_map(
    dataset: xr.Dataset,
    variable: str = "contact_state",
    *,
    at: At | None = None,
    **common: Unpack[Look],
) -> Picture:
    """Draw what contacts do where they are: the state, a force or a loss over an interface.

    The picture is the plane of the two axes along which contacts lie farthest apart.

    Parameters
    ----------
    dataset
        A curve or a point of a result of a structure whose places have coordinates; some contacts
        of it, as ``.isel(contact=slice(20))``, are one interface of several.
    variable
        A variable with one value per contact: ``"contact_state"``, ``"dissipation"``,
        ``"stick_fraction"``, or those of a law, for example ``"open_fraction"``.
    at
        Which point of a curve, as of `symhbm.datasets.at`, by default its highest peak.
    common
        As of all pictures.

    Raises
    ------
    TypeError, KeyError, ValueError
        For a dataset without places of contacts or without the variable, for more than one point,
        and where no value is known.

    Examples
    --------
    >>> import numpy as np
    >>> import symhbm as sh
    >>> places = sh.Places(
    ...     node=[1, 2], direction="x", coordinates=[[0, 0, 0], [0, 0.01, 0]], label=["tip", ""]
    ... )
    >>> blade = sh.Model(
    ...     np.eye(2), np.eye(2), 1e4 * np.eye(2), contacts=[("1:x",), ("2:x",)],
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=[0.1, 5], places=places,
    ... )
    >>> point = sh.solve(sh.HarmonicBalance(blade, sh.forces.PointForce("tip:x")), 19)
    >>> figure = sh.plot.contact_map(point)
    >>> figure.savefig("contacts.png")
    """
    check_variables(dataset, variable, "contact_state")
    check_variables(dataset, *(f"contact_{axis}" for axis in _AXES))
    if at is not None or moving(dataset).along in dataset[variable].dims:
        dataset = point_of(dataset, at)
        if variable not in dataset.variables:
            raise KeyError(
                f"{variable!r} is not known of a peak between the values of a grid; give at= one "
                "of these, or 'largest'"
            )
    values = dataset[variable]
    if values.dims != ("contact",):
        raise ValueError(
            f"dataset: expected one value of {variable} per contact, it is along "
            f"{', '.join(map(str, values.dims)) or 'nothing'}; select one parameter set"
        )
    where = np.column_stack([dataset[f"contact_{axis}"].values for axis in _AXES])
    axes = sorted(np.argsort(-np.ptp(where, axis=0), kind="stable")[:2].tolist())
    known = values.values >= 0 if variable == "contact_state" else np.isfinite(values.values)
    if not known.any():
        raise nothing_to_draw(dataset)
    factor, unit = scaled(float(np.abs(where[:, axes]).max()), "m")
    x, y = factor * where[:, axes].T
    across, upward = (Axis(f"${_AXES[k]}$ [{unit}]", room=0.08) for k in axes)
    panel = Panel(across, upward, even="datalim", title=point_text(dataset))
    look: Any = dict(linewidths=0.4, edgecolors="black", zorder=3)
    if not known.all():
        panel.add("dots", x, y, ~known, facecolors="none", **look)
    shown = values.values[known]
    if variable == "contact_state":
        colors = [LOOKS[state][0] for state in shown.tolist()]
        panel.add("dots", x, y, known, c=colors, **look)
        for state in sorted({*shown.tolist()}):
            color, words = LOOKS[state]
            panel.entry(words.removeprefix("open; "), facecolor=color)
    else:
        about = meaning(variable, Description(dataset).records)
        factor, unit = 1.0, "" if about.units == "1" else about.units
        if unit:
            factor, unit = scaled(float(np.abs(shown).max()), unit)
        shown, label = factor * shown, f"{about.long_name} [{unit}]" if unit else about.long_name
        panel.bar = Colours("viridis", shown.min(), shown.max(), label=label)
        panel.add("dots", x, y, known, c=shown, cmap=panel.bar.map, **look)
    return Picture([panel], (6.4, 4.2))
