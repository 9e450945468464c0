"""Results of contacts over the interface that they lie in."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from symhbm.model.contacts import Behaviour
from symhbm.numerics import FloatArray
from symhbm.plot.contact.states import LOOKS
from symhbm.plot.drawing import (
    OUTSIDE,
    canvas,
    check_variables,
    colorbar,
    figure_of,
    nothing_to_draw,
    scaled,
)
from symhbm.results import Description, meaning

_AXES = "xyz"
_DOT = 0.6
"""Size of a contact over its distance to the next one."""
_WORDS = {Behaviour.NEVER_TOUCHES: "never touches"}


def contact_map(
    dataset: xr.Dataset, variable: str = "contact_state", *, ax: Axes | None = None
) -> Figure:
    """Draw what contacts do where they are: the state, a force or a loss over an interface.

    The picture is the plane of the two axes along which contacts lie farthest apart.

    Parameters
    ----------
    dataset
        One point of a result of a structure whose places have coordinates, as
        ``response.isel(point=3)``; some contacts of it, as ``.isel(contact=slice(20))``, are one
        interface of several.
    variable
        A variable with one value per contact: ``"contact_state"``, ``"dissipation"``,
        ``"stick_fraction"``, or those of a law, for example ``"open_fraction"``.
    ax
        Axes to draw into; by default a new figure.

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
    >>> point = sh.solve(sh.HarmonicBalance(blade, sh.PointForce("tip:x")), 19)
    >>> figure = sh.plot.contact_map(point)
    >>> figure.savefig("contacts.png")
    """
    check_variables(dataset, variable, "contact_state")
    check_variables(dataset, *(f"contact_{axis}" for axis in _AXES))
    values = dataset[variable]
    if values.dims != ("contact",):
        raise ValueError(
            f"dataset: expected one value of {variable} per contact, it is along "
            f"{', '.join(map(str, values.dims)) or 'nothing'}; select one point, as "
            "dataset.isel(point=0)"
        )
    at = np.column_stack([dataset[f"contact_{axis}"].values for axis in _AXES])
    one, two = sorted(np.argsort(-np.ptp(at, axis=0), kind="stable")[:2].tolist())
    known = values.values >= 0 if variable == "contact_state" else np.isfinite(values.values)
    if not known.any():
        raise nothing_to_draw(dataset)
    factor, unit = scaled(float(np.abs(at[:, [one, two]]).max()), "m")
    across, along = factor * at[:, one], factor * at[:, two]
    with canvas(ax, (6.4, 4.2)) as ax:
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_xlabel(f"${_AXES[one]}$ [{unit}]")
        ax.set_ylabel(f"${_AXES[two]}$ [{unit}]")
        ax.margins(0.08)
        ax.plot(across, along, linestyle="none")  # limits, which tell how large a dot is
        size = _size(ax, np.column_stack([across, along]))
        look: Any = dict(s=size, linewidths=0.4, edgecolors="black", zorder=3)
        if not known.all():
            ax.scatter(across[~known], along[~known], facecolors="none", **look)
        if variable == "contact_state":
            states = values.values[known]
            colors = [LOOKS[state][0] for state in states.tolist()]
            ax.scatter(across[known], along[known], c=colors, **look)
            handles = [
                Patch(color=LOOKS[state][0], label=_WORDS.get(state, LOOKS[state][1]))
                for state in sorted({*states.tolist()})
            ]
            ax.legend(handles=handles, **OUTSIDE)
        else:
            about = meaning(variable, Description(dataset).records)
            shown = values.values[known]
            factor, unit = 1.0, "" if about.units == "1" else about.units
            if unit:
                factor, unit = scaled(float(np.abs(shown).max()), unit)
            dots = ax.scatter(across[known], along[known], c=factor * shown, **look)
            colorbar(ax, dots, f"{about.long_name} [{unit}]" if unit else about.long_name)
    return figure_of(ax)


def _size(ax: Axes, points: FloatArray) -> float:
    """Area of a dot [points^2] that leaves neighbours apart."""
    from scipy.spatial import KDTree  # slow to import

    pixels = ax.transData.transform(points)
    apart = (
        72 / figure_of(ax).dpi * KDTree(pixels).query(pixels, 2)[0][:, 1] if len(points) > 1 else 24
    )
    return float(np.clip(_DOT * np.median(apart), 3.0, 24.0) ** 2)
