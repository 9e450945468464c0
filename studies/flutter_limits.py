"""Flutter limits: how much negative damping friction holds, and which normal loads hold most.

The flutter limit of a disturbance is the negative damping ratio under which it stays below an
allowed amplitude. Dampers of too small a load have let go at the disturbance already, those of too
large a load still stick at the allowed amplitude. In between, all loads hold as much: with friction
under a constant load the amplitude with most damping grows as the load, and that damping is the
same. One harmonic, of one blade, of the least stable wave of the ring of the paper and of that of
a disk by finite elements.

Beside them are the amplitude with most damping in closed form, and of the disk that of all
equations, where the damper is a complex stiffness.

Reference: M. Krack, Nonlinear modal analysis of nonconservative systems: Extension of the periodic
motion concept, Computers and Structures 154 (2015), 59-71.
"""

from importlib.metadata import version
from typing import Any, NamedTuple

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import minimize_scalar

import symhbm as sh
from studies import damping_of_modes as damping
from studies import fig09_contact_stiffness as fig09
from studies.flutter import FLAT, LEAST, REDUCTION, ROUND_OFF, blade
from studies.landmark import Landmark, Source
from studies.open_sector_contacts import FRICTION
from studies.run import run

NAME = "flutter_limits"
N_LOADS = 25
"""Loads at which the limit of the larger disturbance is computed."""
OF_RING = 2
"""Nodal diameters of the least stable wave of the ring."""


class Limit(NamedTuple):
    """A flutter limit: problem, disturbance and allowed amplitude [m], loads [N], wave."""

    name: str
    problem: sh.HarmonicBalance
    amplitude: tuple[float, float]
    loads: tuple[float, float]
    nodal_diameter: int | None = None
    dof: Any = 0


def compute(progress: bool = True) -> xr.Dataset:
    """Limits over the load with two disturbances, best loads, and what tells these without."""
    found = damping.disk()
    all_limits = limits(found)
    datasets = [_of_limit(one, found) for one in all_limits]
    names = xr.DataArray([one.name for one in all_limits], dims="structure", name="structure")
    dataset = xr.concat(datasets, names, join="outer").drop_vars("limit_point")
    for name, (units, long_name) in DESCRIBED.items():
        dataset[name].attrs.update(units=units, long_name=long_name)
    return dataset.assign_attrs(
        title="Flutter limits of three structures over the normal load",
        references="M. Krack, Computers and Structures 154 (2015), 59-71",
        symhbm_schema=1,
        symhbm_version=version("symhbm"),
    )


def limits(found: damping.Disk) -> list[Limit]:
    """The flutter limits: of the blade with its own damping, and of a wave without air."""
    model = fig09.problem().model.with_parameters(contact_stiffness=1e4)
    still, whole = (sh.HarmonicBalance(each, harmonics=(1,)) for each in (model, found.reduced))
    return [
        Limit("one blade", blade((1,), 0.5), (1e-4, 4e-4), (0.3, 10)),
        Limit("ring of 13 blades", still, (5e-4, 2e-3), (1, 100), OF_RING),
        Limit("disk by finite elements", whole, (5e-6, 2e-5), (5, 200), LEAST, found.tip),
    ]


def _of_limit(one: Limit, found: damping.Disk) -> xr.Dataset:
    """Limits of one structure."""
    low, high = one.amplitude
    middle = float(np.sqrt(low * high))
    options: dict[str, Any] = dict(
        place=one.dof, nodal_diameter=one.nodal_diameter, progress=False, throw=True
    )
    best = sh.maximise_flutter_limit(
        one.problem, "normal_load", one.loads, one.amplitude, **options | dict(throw=False)
    )
    larger = sh.flutter_limit(
        one.problem, "normal_load", one.loads, np.geomspace(*one.loads, N_LOADS),
        amplitudes=one.amplitude, disturbance=middle, **options,
    )  # fmt: skip
    load = float(np.mean(one.problem.parameters["normal_load"]))
    amplitude, ratio = _most_damped(one, found, load, best)
    part = xr.Dataset(
        {
            "limit_load": ("limit_point", best.normal_load.values),
            "flutter_limit": ("limit_point", best.flutter_limit.values[:, 0]),
            "larger_load": ("larger_point", larger.normal_load.values),
            "larger_limit": ("larger_point", larger.flutter_limit.values[:, 0]),
            "limit_amplitudes": ("told", [low, high]),
            "best_loads": ("told", _range(best)),
            "best_limit": best.design_damping_ratio.item(),
            # Amplitudes scale with the load, damping does not.
            "expected_loads": ("told", load * np.array([low, high]) / amplitude),
            "expected_limit": ratio,
        }
    )
    return part.assign_coords(limit_point=np.arange(part.sizes["limit_point"]))


def _range(best: xr.Dataset) -> list[float]:
    """First and last of the best loads [N]."""
    return [float(best[name].values[0]) for name in ("design_from", "design_to")]


def _most_damped(
    one: Limit, found: damping.Disk, load: float, best: xr.Dataset
) -> tuple[float, float]:
    """Amplitude [m] with most damping under a load [N], and that ratio, without the library."""
    if one.dof == 0:
        wave = damping.wave(one.problem.model, one.nodal_diameter, load)
        return wave.most_damped(100 * one.amplitude[1])
    assert one.nodal_diameter is not None
    whole, frequency = found.wave(one.nodal_diameter), float(best.limit_frequency.mean())
    low, high = np.log(one.amplitude)
    found_at: Any = minimize_scalar(
        lambda log: -whole.mode(float(np.exp(log)), FRICTION * load, frequency)[1],
        bounds=(low - 1, high + 1),
        method="bounded",
        options={"xatol": 1e-7},
    )
    return float(np.exp(found_at.x)), -float(found_at.fun)


DESCRIBED = {
    "structure": ("1", "structure of a flutter limit"),
    "limit_load": ("N", "normal load"),
    "flutter_limit": ("1", "flutter limit for the smaller disturbance"),
    "larger_load": ("N", "normal load"),
    "larger_limit": ("1", "flutter limit for the larger disturbance"),
    "limit_amplitudes": ("m", "smaller disturbance and allowed amplitude; the larger is between"),
    "best_loads": ("N", "first and last of the best loads"),
    "best_limit": ("1", "largest flutter limit"),
    "expected_loads": ("N", "first and last of the best loads, without the library"),
    "expected_limit": ("1", "largest damping ratio, without the library"),
}


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the limits over the load, one structure beside the other."""
    with plt.rc_context(sh.plot.STYLE):
        figure, axes = plt.subplots(1, 3, figsize=(14.5, 4.6), layout="constrained")
        for ax, name in zip(axes, dataset.structure.values, strict=True):
            _draw_limit(ax, dataset.sel(structure=name))
            ax.set_title(str(name))
        figure.suptitle("How much negative damping friction holds")
    return figure


def _draw_limit(ax: Axes, one: xr.Dataset) -> None:
    low, high = one.limit_amplitudes.values
    sizes = low, np.sqrt(low * high)
    lines = ("limit_load", "flutter_limit", "-"), ("larger_load", "larger_limit", "--")
    for size, (load, limit, style) in zip(sizes, lines, strict=True):
        label = f"disturbance of {1e3 * size:.3g} mm"
        ax.semilogx(one[load], 100 * one[limit], style, color="0.2", label=label)
    ends = one.best_loads.values
    label = f"best: {ends[0]:.3g} to {ends[1]:.3g} N"
    ax.axvspan(*ends, color="tab:green", alpha=0.2, label=label)
    ax.set(xlabel="normal load [N]")
    ax.set_ylabel(f"negative damping ratio held\nbelow {1e3 * high:g} mm [%]")
    ax.set_ylim(0, 140 * float(one.best_limit))
    ax.legend(fontsize=8, loc="upper left")


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Largest limits and the best loads, in closed form or by all equations."""
    closed, exact = Source.CLOSED_FORM, Source.EXACT
    rows: list[Any] = []
    for i, name in enumerate(map(str, dataset.structure.values)):
        one = dataset.isel(structure=i)
        whole = i == len(dataset.structure) - 1
        source, allowed = (exact, REDUCTION) if whole else (closed, ROUND_OFF)
        rows.append((f"{name}: largest flutter limit", one.best_limit, one.expected_limit, "",
                     source, allowed))  # fmt: skip
        for k, end_of in enumerate(("first", "last")):
            rows.append((f"{name}: {end_of} of the best loads", one.best_loads[k],
                         one.expected_loads[k], "N", source, max(allowed, FLAT)))  # fmt: skip
    return [
        Landmark(text, float(value), float(known), *others) for text, value, known, *others in rows
    ]


if __name__ == "__main__":
    run(NAME, compute, draw)
