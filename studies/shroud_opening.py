"""Two blades with a shroud between them that opens at resonance, and what its preload changes.

The blades move along the shroud, `x1` and `x2`, and across it, `y1` and `y2`. The contact rubs with
`|T| <= mu N` while its normal load moves with the blades, `N = max(N0 + k_n (y1 - y2), 0)`. Under
the preload of 4 N it opens at a resonance across; a larger preload holds it closed there, and moves
the opening to where the blades part most.

As long as it is closed nothing but linear springs act across the shroud, whatever rubs along it.
So it opens where the linear response has `k_n |y1 - y2| = N0`, a closed form. The sizes of the
first harmonics at three frequencies are those of exact motions in time.
"""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import brentq

import symhbm as sh
from studies.landmark import Landmark, Source
from studies.run import run
from studies.smooth import DASHES, along
from symhbm.numerics import FloatArray

NAME = "shroud_opening"
STIFFNESS = (1e4, 2.25e4, 1.04e4, 2.3e4)  # N/m, of x1, y1, x2, y2
DAMPING = (2.0, 3.0, 2.0, 3.0)  # N s/m
TANGENTIAL_STIFFNESS, NORMAL_STIFFNESS, FRICTION = 1e4, 2e4, 0.4  # N/m, N/m
COSINE, SINE = (10.0, 5.0, 0.0, 0.0), (0.0, 0.0, 10.0, -5.0)  # N
PRELOADS = (4.0, 8.0, 16.0)  # N
BAND = (12.0, 40.0)
HIGHEST = 5
SETS = (3, 9, 15)
"""Highest harmonics of the balances that are compared with exact motions."""
EXACT = {
    18: (2.978847459e-03, 3.658048564e-04, 4.663666485e-03, 3.578433826e-04),
    24: (6.776783322e-04, 7.965289136e-03, 9.527626428e-04, 7.660482700e-03),
    27: (4.895305432e-04, 6.070035867e-04, 6.408151716e-04, 5.795608754e-04),
}
"""Sizes of the first harmonics [m] of exact motions under 4 N, by frequency [Hz]."""
TRUNCATION = 1e-5
"""Largest relative error by the harmonics above 15."""
LOOP = 24.0  # Hz
N_ANGLES = 4096
ANGLES = 2 * np.pi * np.arange(N_ANGLES) / N_ANGLES


def problem(highest: int = HIGHEST, preload: float = PRELOADS[0]) -> sh.HarmonicBalance:
    """Return the balance of both blades with harmonics from 0 to a highest one."""
    shroud = sh.Friction(
        tangential=(0, 2),
        normal={1: 1.0, 3: -1.0},
        contact_stiffness=TANGENTIAL_STIFFNESS,
        normal_stiffness=NORMAL_STIFFNESS,
        friction_coefficient=FRICTION,
        normal_load=preload,
    )
    matrices = np.eye(4), np.diag(DAMPING), np.diag(STIFFNESS)
    blades = sh.Model(*matrices, contacts={"shroud": shroud})
    force = sh.forces.HarmonicForce(cosine={1: COSINE}, sine={1: SINE})
    return sh.HarmonicBalance(blades, force, range(highest + 1))


def parting(frequency: float) -> float:
    """Largest `k_n |y1 - y2|` [N] over a period of the blades with the shroud closed."""
    omega, across = 2 * np.pi * frequency, [1, 3]
    own = np.diag(STIFFNESS)[np.ix_(across, across)] - omega**2 * np.eye(2)
    lossy = own + 1j * omega * np.diag(DAMPING)[np.ix_(across, across)]
    spring = NORMAL_STIFFNESS * np.array([[1, -1], [-1, 1]])
    force = (np.array(COSINE) - 1j * np.array(SINE))[across]
    y = np.linalg.solve(lossy + spring, force)
    return float(NORMAL_STIFFNESS * abs(y[0] - y[1]))


def openings(preload: float) -> list[float]:
    """Frequencies [Hz] in the band at which the closed shroud is about to open, ascending."""

    def excess(frequency: float) -> float:
        return np.log(parting(frequency) / preload)

    grid = np.linspace(*BAND, 500)
    signs = np.sign([excess(one) for one in grid])
    changes = np.flatnonzero(np.diff(signs))
    found: list[Any] = [brentq(excess, grid[i], grid[i + 1], xtol=1e-13) for i in changes]
    return found


def compute(progress: bool = True) -> xr.Dataset:
    """Responses by preload, a loop, and balances beside exact motions by their harmonics."""
    over = {"normal_load": list(PRELOADS)}
    response = sh.frf(problem(), BAND, over=over, progress=progress, throw=True)
    sizes = np.array(
        [[first_harmonics(highest, frequency) for frequency in EXACT] for highest in SETS]
    )
    loop = sh.solve(problem(), LOOP, throw=True)
    motion = loop.coefficient.values.reshape(4, HIGHEST + 1, 2)
    described = (
        ("sliding", "m", "tangential displacement x1 - x2"),
        ("friction_force", "N", "friction force of the slider on this motion"),
        ("normal_force", "N", "normal force of the contact on this motion"),
    )
    added: dict[str, tuple] = {
        name: ("angle", values, {"units": units, "long_name": long_name})
        for (name, units, long_name), values in zip(described, march(motion), strict=True)
    }
    added["loop_dissipation"] = ((), loop.dissipation.item(), loop.dissipation.attrs)
    added["first_harmonic"] = (
        ("highest_harmonic", "exact_frequency", "dof"),
        sizes,
        {"units": "m", "long_name": "size of the first harmonic"},
    )
    coordinates = {
        "angle": ("angle", ANGLES, {"units": "rad", "long_name": "angle of the period"}),
        "highest_harmonic": (
            "highest_harmonic",
            list(SETS),
            {"units": "1", "long_name": "highest harmonic"},
        ),
        "exact_frequency": (
            "exact_frequency",
            np.array([*EXACT], dtype=float),
            {"units": "Hz", "long_name": "frequency of an exact motion"},
        ),
    }
    response = response.assign_coords(coordinates).assign(added)
    return response.assign_attrs(title="Two blades with a shroud that opens at resonance")


def first_harmonics(highest: int, frequency: float) -> FloatArray:
    """Sizes (4,) of the first harmonics [m] under the first preload."""
    found = sh.solve(problem(highest), frequency, throw=True)
    return np.hypot(*found.coefficient.sel(harmonic=1).values.reshape(4, 2).T)


def march(motion: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Sliding, friction and normal force over a period of a motion (4, n_harmonics, 2).

    The slider moves only as far as its limit makes it, from sample to sample; within a period it
    forgets where it started.
    """
    orders = np.arange(motion.shape[1])
    x = motion[..., 0] @ np.cos(np.outer(orders, ANGLES))
    x += motion[..., 1] @ np.sin(np.outer(orders, ANGLES))
    u, p = x[0] - x[2], PRELOADS[0] + NORMAL_STIFFNESS * (x[1] - x[3])
    normal = np.maximum(p, 0)
    pull, limit = TANGENTIAL_STIFFNESS * u, FRICTION * normal
    slider, force = pull[0], np.empty(N_ANGLES)
    for _ in range(2):
        for i in range(N_ANGLES):
            slider = min(max(slider, pull[i] - limit[i]), pull[i] + limit[i])
            force[i] = pull[i] - slider
    return u, force, normal


def area(dataset: xr.Dataset) -> float:
    """Area [J] of the loop, by trapezoids."""
    force, u = dataset.friction_force.values, dataset.sliding.values
    return float(((force + np.roll(force, -1)) / 2 * np.diff(u, append=u[0])).sum())


STATES = {0: ("sticks", "0.75"), 1: ("slips", "tab:blue"), 2: ("opens", "tab:orange")}


def states(row: xr.Dataset) -> FloatArray:
    """States between the points of a response; at an event a contact is in both."""
    frequency, state = row.frequency.values, row.contact_state.values[:, 0]
    at_event = np.isin(frequency, row.event_frequency.values)
    return np.where(at_event[:-1], state[1:], state[:-1])


def draw(dataset: xr.Dataset) -> Figure:
    """Draw responses across the shroud, its states over the band, and a loop with its limit."""
    with sh.plot.panels(0, size=(11.5, 6.0)) as (figure, _):
        heights = 3, 1
        axes = figure.subplot_mosaic("RL;SL", width_ratios=(1.3, 1), height_ratios=heights)
        _draw_responses(axes["R"], dataset)
        _draw_states(axes["S"], dataset)
        axes["S"].sharex(axes["R"])
        _draw_loop(axes["L"], dataset)
        figure.suptitle("Two blades and a shroud that opens where they resonate across it")
    return figure


def _draw_responses(ax: Axes, dataset: xr.Dataset) -> None:
    looks = ("black", "-"), ("tab:green", "--"), ("tab:purple", DASHES)
    for preload, (color, style) in zip(dataset.normal_load.values, looks, strict=True):
        row = dataset.sel(normal_load=preload)
        frequency, amplitude, stretch = along(row, place=1)
        look: Any = dict(color=color, linestyle=style, label=f"{preload:g} N")
        ax.semilogy(frequency, 1e3 * amplitude, linewidth=1.2, **look)
        opens = (states(row) == 2)[stretch]
        ends = np.append(opens, False) | np.append(False, opens)
        shown = np.where(ends, 1e3 * amplitude, np.nan)
        ax.semilogy(frequency, shown, color=color, linewidth=4, alpha=0.3)
    ax.plot([], [], color="0.5", linewidth=4, alpha=0.4, label="opens")
    ax.set(ylabel="largest displacement $y_1$ across [mm]", xlim=BAND)
    ticks = 0.2, 0.5, 1, 2, 5
    ax.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.minorticks_off()
    ax.legend(loc="upper right", title="preload")


def _draw_states(ax: Axes, dataset: xr.Dataset) -> None:
    for place, preload in enumerate(dataset.normal_load.values):
        row = dataset.sel(normal_load=preload)
        frequency, state = row.frequency.values, states(row)
        for value, (_, color) in STATES.items():
            for i in np.flatnonzero((state == value) & np.isfinite(frequency[1:])):
                ends, height = frequency[i : i + 2], place + 0.12 * (value - 1)
                ax.plot(ends, [height, height], color=color, linewidth=5, solid_capstyle="butt")
    for label, color in STATES.values():
        ax.plot([], [], color=color, linewidth=5, label=label)
    ax.set_yticks(range(len(PRELOADS)), [f"{preload:g} N" for preload in PRELOADS])
    ax.set_ylim(-0.6, len(PRELOADS) - 0.4)
    ax.set_xlabel("excitation frequency [Hz]")
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.42), ncols=3)


def _draw_loop(ax: Axes, dataset: xr.Dataset) -> None:
    u, force, limit = (
        np.append(values, values[0])
        for values in (
            1e3 * dataset.sliding.values,
            dataset.friction_force.values,
            FRICTION * dataset.normal_force.values,
        )
    )
    for sign in (1, -1):
        label = r"limit $\pm\mu N$" if sign > 0 else None
        ax.plot(u, sign * limit, "--", color="tab:red", linewidth=1, label=label)
    ax.fill(u, force, color="0.93", zorder=0)
    ax.plot(u, force, color="black", linewidth=1.6, label="friction force")
    open_ = np.where(limit == 0, 0.0, np.nan)
    ax.plot(u, open_, color="tab:orange", linewidth=4, alpha=0.6, label="open")
    ax.set(xlabel="sliding $x_1 - x_2$ [mm]", ylabel="friction force [N]")
    ax.set_title(f"{PRELOADS[0]:g} N, {LOOP:g} Hz: the limit moves with the normal force")
    ax.legend(loc="upper left", fontsize=9)


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Exact motions, where the shroud opens, and the energy of the loop."""
    rows = []
    for frequency, expected in EXACT.items():
        finest = dataset.first_harmonic.sel(exact_frequency=frequency).isel(highest_harmonic=-1)
        error = np.abs(finest.values / expected - 1).max()
        name = f"first harmonics at {frequency} Hz, largest difference from an exact motion"
        rows.append(Landmark(name, float(error), 0.0, "", Source.EXACT, TRUNCATION))
    for preload in dataset.normal_load.values:
        row, expected = dataset.sel(normal_load=preload), np.array(openings(preload))
        for kind, found in zip(row.event_kind.values, row.event_frequency.values, strict=True):
            if kind in ("onset of opening", "end of opening"):
                closest = expected[np.argmin(np.abs(expected - found))]
                name = f"{kind} under {preload:g} N, frequency"
                rows.append(Landmark(name, found, closest, "Hz", Source.CLOSED_FORM, 1e-9))
    dissipated = float(dataset.loop_dissipation)
    name = "energy dissipated per cycle at 24 Hz, from the loop"
    # Samples miss where the contact closes by up to one of them.
    rows.append(Landmark(name, area(dataset), dissipated, "J", Source.SAMPLED, 1e-3))
    return rows


if __name__ == "__main__":
    run(NAME, compute, draw)
