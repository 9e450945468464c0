"""Fig. 4: friction force over the angle, and the hysteresis loop of one blade at 3 N and 20 Hz.

The force of a truncated motion is that of the slider marched over it: ``k_d x`` and an offset while
it sticks, ``+-mu F_n`` while it slips, between the located angles. The balance itself sees only the
first terms of its Fourier series. Its loop is over ``x`` of Eq. (1), the displacement of the mass;
``y = x - z`` of the source is what the spring of the contact is stretched by, the force over `k_d`.

The source does not say how many harmonics its `MHBM` has: 1, 3 and 5 are a reading. Its axis of the
displacement reaches from -1 to 1 mm; with the stated 3 N and 20 Hz the loop has 0.30 mm to either
side.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 4.
"""

from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies.closed_form import EXACT_DIGITS
from studies.landmark import Landmark, Source
from studies.run import run
from studies.source_axes import Ticks, set_ticks

NAME = "fig04_hysteresis_loop"
NORMAL_LOAD = 3.0  # N
FREQUENCY = 20.0  # Hz
HARMONICS = ((1,), (1, 3, 5))
N_ANGLES = 4096
ANGLES = 2 * np.pi * np.arange(N_ANGLES) / N_ANGLES
MARKS = ("A", "B", "C", "D")
FORCE_TICKS: tuple[Ticks, Ticks] = (-2, 2, 1), (-2, 2, 0.5)
"""Ticks of the source over the angle and over the displacement [N]."""
DISPLACEMENT_TICKS: Ticks = (-1e-3, 1e-3, 1e-3)
"""Ticks of the source [m]."""
SOURCE_NAMES = ("1HBM: harmonic 1", "MHBM: harmonics 1, 3, 5 (a reading)", "Time: exact motion")
LINES: tuple[dict[str, Any], ...] = (
    dict(color="black", linewidth=1.3, zorder=3),
    dict(color="#d55e00", linewidth=1.5, linestyle=(0, (5, 2)), zorder=4),
    dict(color="0.75", linewidth=5, zorder=2),
)


def compute(progress: bool = True) -> xr.Dataset:
    """Motion, force, series of the force, switching angles and dissipation, by motion."""
    problems = [fig03.problem(h).with_parameters(normal_load=NORMAL_LOAD) for h in HARMONICS]
    model = problems[0].model
    limit = float(model.friction_coefficient[0] * model.normal_load[0])
    stiffness = float(model.contact_stiffness[0])
    rows = [_balanced(problem, limit, stiffness) for problem in problems]
    rows.append(_exact(problems[0]))
    stacked = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    over_angle = ("motion", "angle")
    described = {
        "displacement": (over_angle, "m", "relative displacement of the contact"),
        "friction_force": (over_angle, "N", "friction force of the slider on this motion"),
        "series": (over_angle, "N", "friction force, the harmonics that the balance sees"),
        "theta_0": ("motion", "rad", "angle of the largest displacement"),
        "theta_star": ("motion", "rad", "angle where slip begins after it"),
        "mark_angle": (("motion", "mark"), "rad", "angle of A, B, C and D"),
        "mark_displacement": (("motion", "mark"), "m", "relative displacement at A, B, C and D"),
        "mark_force": (("motion", "mark"), "N", "friction force at A, B, C and D"),
        "amplitude": ("motion", "m", "largest displacement"),
        "dissipation": ("motion", "J", "energy dissipated by the contact per cycle"),
        "loop_area": ("motion", "J", "area of the hysteresis loop, trapezoids"),
    }
    scalars = {
        "limit": (limit, "N", "friction limit mu F_n"),
        "contact_stiffness": (stiffness, "N m-1", "stiffness of the contact"),
        "normal_load": (NORMAL_LOAD, "N", "normal load of the contact"),
        "frequency": (FREQUENCY, "Hz", "excitation frequency"),
    }
    variables = {
        name: (dims, stacked[name], {"units": units, "long_name": long_name})
        for name, (dims, units, long_name) in described.items()
    }
    variables |= {
        name: ((), value, {"units": units, "long_name": long_name})
        for name, (value, units, long_name) in scalars.items()
    }
    labels = ["one harmonic", *("harmonics " + ", ".join(map(str, h)) for h in HARMONICS[1:])]
    coordinates = {
        "motion": ("motion", [*labels, "exact"], {"units": "1", "long_name": "kind of motion"}),
        "mark": ("mark", list(MARKS), {"units": "1", "long_name": "point of the loop"}),
        "angle": ("angle", ANGLES, {"units": "rad", "long_name": "angle of the period"}),
    }
    attributes = {
        "title": "Friction force and hysteresis loop of one blade",
        "references": "E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013, hal-00941429",
        "symhbm_schema": 1,
        "symhbm_version": version("symhbm"),
    }
    return xr.Dataset(variables, coordinates, attributes)


def _balanced(problem: sh.HarmonicBalance, limit: float, stiffness: float) -> dict:
    """Motion of the balance and the force of the slider marched over it."""
    found = sh.solve(problem, FREQUENCY, throw=True)
    unknowns = found.coefficient.values.ravel()
    theta_0, theta_star = float(found.theta_0[0]), float(found.theta_star[0])
    # Both angles are given within one turn; slip begins within half a turn of the reversal.
    theta_star = theta_0 + (theta_star - theta_0) % (2 * np.pi)

    def motion(angle: np.ndarray) -> np.ndarray:
        return problem.layout.relative(unknowns)[0] @ problem.basis.values(angle).T

    def force(angle: np.ndarray) -> np.ndarray:
        turned = (angle - theta_0) % (2 * np.pi)
        # Odd harmonics only: the second half of the period is the first with the other sign.
        sign = np.where(turned < np.pi, 1.0, -1.0)
        highest = motion(np.array([theta_0]))[0]
        stuck = limit + stiffness * (sign * motion(angle) - highest)
        return sign * np.where(turned % np.pi < theta_star - theta_0, stuck, -limit)

    law = problem.locate(unknowns, 0.0).groups["friction"].details
    seen = stiffness * law.matrix[0] @ problem.layout.relative(unknowns)[0] + limit * law.vector[0]
    marks = _marks(theta_0, theta_star)
    return dict(
        displacement=motion(ANGLES),
        friction_force=force(ANGLES),
        series=seen @ problem.basis.values(ANGLES).T,
        theta_0=theta_0,
        theta_star=theta_star,
        mark_angle=marks,
        mark_displacement=motion(marks),
        mark_force=force(marks),
        amplitude=float(found.amplitude[0]),
        dissipation=float(found.dissipation[0]),
        loop_area=_area(motion(ANGLES), force(ANGLES)),
    )


def _exact(problem: sh.HarmonicBalance) -> dict:
    """The exact motion, which has no series to cut."""
    found = sh.periodic_motion(problem, FREQUENCY, n_angles=N_ANGLES, throw=True)
    kind, event = found.event_kind.values, found.event_angle.values
    displacement = found.displacement.values[:, 0]
    force = found.friction_force.values[:, 0]
    # Slip ends twice per period, where the displacement is largest and where it is lowest.
    ends = event[kind == "end of slip"]
    theta_0 = ends[np.argmax(np.interp(ends, ANGLES, displacement, period=2 * np.pi))]
    theta_star = theta_0 + np.min((event[kind == "onset of slip"] - theta_0) % (2 * np.pi))
    marks = _marks(theta_0, theta_star)
    limit = float(found.friction_coefficient[0] * found.normal_load[0])
    return dict(
        displacement=displacement,
        friction_force=force,
        series=np.full(N_ANGLES, np.nan),
        theta_0=theta_0,
        theta_star=theta_star,
        mark_angle=marks,
        # Between angles 2 pi / 4096 apart a line is 3e-7 of the amplitude off.
        mark_displacement=np.interp(marks, ANGLES, displacement, period=2 * np.pi),
        mark_force=limit * np.array([1.0, -1.0, -1.0, 1.0]),
        amplitude=float(found.amplitude[0]),
        dissipation=float(found.dissipation[0]),
        loop_area=_area(displacement, force),
    )


def _marks(theta_0: float, theta_star: float) -> np.ndarray:
    return np.array([theta_0, theta_star, theta_0 + np.pi, theta_star + np.pi])


def _area(displacement: np.ndarray, force: np.ndarray) -> float:
    """Area within a closed line, by trapezoids."""
    return float(
        ((force + np.roll(force, -1)) / 2 * np.diff(displacement, append=displacement[0])).sum()
    )


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the force over the angle and over the displacement, side by side."""
    with sh.plot.panels(1, 2, sharey=True, size=(10.5, 5.0), width_ratios=(1.25, 1)) as (
        figure,
        (left, right),
    ):
        _draw_force(left, dataset)
        _draw_loop(right, dataset)
        limit = float(dataset.limit)
        for ax in (left, right):
            for level in (-limit, limit):
                ax.axhline(level, color="0.4", linewidth=0.9, linestyle=(0, (1, 2)), zorder=1)
            ax.set_ylim(-1.42 * limit, 1.42 * limit)
        handles, labels = left.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4, handlelength=3)
        figure.suptitle(
            f"One blade, $F_n$ = {float(dataset.normal_load):g} N, "
            f"{float(dataset.frequency):g} Hz: where the friction contact sticks and slips"
        )
    return figure


def draw_on_source_axes(dataset: xr.Dataset) -> Figure:
    """Draw the force over the angle and over the displacement, on the axes of the source."""
    with sh.plot.panels(1, 2, size=(11.0, 5.0)) as (figure, (left, right)):
        for number, name in enumerate(SOURCE_NAMES):
            row = dataset.isel(motion=number)
            force, displacement = (row[n].values for n in ("friction_force", "displacement"))
            left.plot(
                np.append(ANGLES, 2 * np.pi),
                np.append(force, force[0]),
                label=name,
                **LINES[number],
            )
            closed = [np.append(values, values[0]) for values in (displacement, force)]
            right.plot(*closed, **LINES[number])
        one = dataset.isel(motion=0)
        theta_0, theta_star = float(one.theta_0), float(one.theta_star)
        _draw_marks(left, one.mark_angle.values % (2 * np.pi), one.mark_force.values)
        _draw_marks(right, one.mark_displacement.values, one.mark_force.values)
        left.set_xticks(
            [0, theta_0, theta_star, theta_0 + np.pi, 2 * np.pi],
            ["0", r"$\theta_0$", r"$\theta^*$", r"$\theta_0+\pi$", r"$2\pi$"],
        )
        left.set(xlim=(0, 2 * np.pi), xlabel=r"angle $\theta$ [rad]", ylabel="friction force [N]")
        set_ticks(right.xaxis, DISPLACEMENT_TICKS)
        right.ticklabel_format(axis="x", style="sci", scilimits=(-3, -3), useMathText=True)
        right.set_xlabel("displacement $x(t)$ [m]")
        for ax, ticks in zip((left, right), FORCE_TICKS, strict=True):
            set_ticks(ax.yaxis, ticks)
        reach = 1e3 * float(one.amplitude)
        right.set_title(f"loop of ±{reach:.2f} mm on the axis of ±1 mm", fontsize=9)
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        figure.suptitle(
            f"Fig. 4: one blade, $F_n$ = {float(dataset.normal_load):g} N, "
            f"{float(dataset.frequency):g} Hz"
        )
    return figure


def _draw_force(ax: Axes, dataset: xr.Dataset) -> None:
    one = dataset.isel(motion=0)
    limit = float(dataset.limit)
    first = float(one.theta_0) - np.pi / 4
    # A turn from a little before A, so that A, B, C and D follow each other.
    angle = first + (dataset.angle.values - first) % (2 * np.pi)
    order = np.argsort(angle)
    for number, label in enumerate(dataset.motion.values):
        force = dataset.friction_force.values[number]
        ax.plot(angle[order], force[order], label=label, **LINES[number])
    series = one.series.values[order]
    label = "first harmonic of the force: what one harmonic balances"
    ax.plot(angle[order], series, color="black", linewidth=0.7, linestyle=":", label=label)
    _draw_marks(ax, one.mark_angle.values, one.mark_force.values)
    names = (r"$\theta_0$", r"$\theta^*$", r"$\theta_0+\pi$", r"$\theta^*+\pi$")
    bottom = -1.42 * limit
    for at, force, name in zip(one.mark_angle.values, one.mark_force.values, names, strict=True):
        ax.plot([at, at], [bottom, force], color="0.4", linewidth=0.8, linestyle="--", zorder=1)
        ax.annotate(name, (at, bottom), (3, 4), textcoords="offset points", fontsize=10)
    ticks = np.pi / 2 * np.arange(1, 6)
    ax.set_xticks(ticks, ["π/2", "π", "3π/2", "2π", "5π/2"])
    ax.set_xlim(first, first + 2 * np.pi)
    ax.set_xlabel(r"angle $\tau = \omega t$ [rad]")
    ax.set_ylabel("friction force [N]")
    for level, name, side in ((limit, r"$+\mu F_n$", "bottom"), (-limit, r"$-\mu F_n$", "top")):
        ax.annotate(
            name,
            (first + 2 * np.pi if level < 0 else first, level),
            (-3 if level < 0 else 3, 3 if side == "bottom" else -3),
            textcoords="offset points",
            ha="right" if level < 0 else "left",
            va=side,
        )
    stick = 100 * (float(one.theta_star) - float(one.theta_0)) / np.pi
    ax.set_title(f"sticks from A to B and C to D: {stick:.0f} % of the period", fontsize=9)


def _draw_loop(ax: Axes, dataset: xr.Dataset) -> None:
    for number in range(dataset.sizes["motion"]):
        row = dataset.isel(motion=number)
        closed = [
            1e3 * np.append(row.displacement.values, row.displacement.values[0]),
            np.append(row.friction_force.values, row.friction_force.values[0]),
        ]
        ax.plot(*closed, **LINES[number])
    one = dataset.isel(motion=0)
    ax.fill(1e3 * one.displacement.values, one.friction_force.values, color="0.95", zorder=0)
    _draw_marks(ax, 1e3 * one.mark_displacement.values, one.mark_force.values)
    x, force = 1e3 * one.mark_displacement.values, one.mark_force.values
    beside: dict[str, Any] = dict(textcoords="offset points", fontsize=9, color="0.25")
    for a, b, side in ((0, 1, 1), (2, 3, -1)):
        middle = (x[a] + x[b]) / 2, (force[a] + force[b]) / 2
        align = "left" if side > 0 else "right"
        ax.annotate("sticks,\nslope $k_d$", middle, (12 * side, 0), ha=align, va="center", **beside)
    for a, b, side in ((3, 0, 1), (1, 2, -1)):
        middle = (x[a] + x[b]) / 2, force[a]
        align = "bottom" if side > 0 else "top"
        ax.annotate("slips", middle, (0, 6 * side), ha="center", va=align, **beside)
    ax.set_xlabel("displacement $x$ of the mass [mm]")
    areas = [
        f"{1e3 * float(row.loop_area):.4f} mJ ({str(row.motion.values).removeprefix('harmonics ')})"
        for row in (dataset.isel(motion=number) for number in range(dataset.sizes["motion"]))
    ]
    ax.set_title(
        "the area of the loop is the energy dissipated per cycle:\n" + ", ".join(areas), fontsize=9
    )
    ax.margins(x=0.1)


def _draw_marks(ax: Axes, x: np.ndarray, force: np.ndarray) -> None:
    """Mark A, B, C and D, with names outside of the loop."""
    ax.plot(x, force, "o", color="white", markeredgecolor="black", markersize=6, zorder=6)
    for name, at, level in zip(MARKS, x, force, strict=True):
        up = level > 0
        ax.annotate(
            name,
            (at, level),
            (-5 if name in "BD" else 5, 6 if up else -6),
            textcoords="offset points",
            ha="right" if name in "BD" else "left",
            va="bottom" if up else "top",
            fontweight="bold",
            zorder=7,
        )


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Onset of slip, dissipation and area of the loop, and the error of the amplitude."""
    one, limit = dataset.isel(motion=0), float(dataset.limit)
    amplitude, travel = float(one.amplitude), limit / float(dataset.contact_stiffness)
    onset, turn = float(one.theta_star - one.theta_0), float(np.arccos(1 - 2 * travel / amplitude))
    lost, area = float(one.dissipation), 4 * limit * (amplitude - travel)
    closed, exact = Source.CLOSED_FORM, Source.EXACT
    rows = [
        Landmark("angle from A to B, one harmonic", onset, turn, "rad", closed, EXACT_DIGITS),
        Landmark("energy dissipated, one harmonic", lost, area, "J", closed, EXACT_DIGITS),
    ]
    for motion in dataset.motion.values:
        area, lost = (float(dataset[n].sel(motion=motion)) for n in ("loop_area", "dissipation"))
        # Trapezoids over 4096 angles.
        name = f"area of the loop beside the energy dissipated, {motion}"
        rows.append(Landmark(name, area, lost, "J", exact, 1e-5))
    # One harmonic is 1e-3 off at this point, three are 1e-5 off.
    for number, allowed in enumerate((2e-3, 2e-5)):
        found, true = (float(dataset.amplitude[n]) for n in (number, -1))
        name = f"amplitude, {dataset.motion.values[number]}"
        rows.append(Landmark(name, found, true, "m", exact, allowed))
    return rows


if __name__ == "__main__":
    run(NAME, compute, draw, draw_on_source_axes)
