"""Damping of modes that rub: one blade, the ring of the paper and a disk by finite elements.

A nonlinear mode tells the frequency and the damping ratio of free vibrations by their amplitude.
Its frequency is the backbone of the responses to all forces: each of them is a quarter of a period
late where it crosses the backbone, next to its peak. The damping ratio has a maximum, at an
amplitude that grows as the normal load. So for a given amplitude there is a load that damps most.

With one harmonic all of this is a closed form for one blade, and for the ring, whose blades move
alike in a wave. The exact mode of the blade is marched in time between reversals and onsets of
slip. The disk has 24 sectors with a damper between platforms of neighbours; its sector is reduced
by Craig and Bampton. Under one harmonic its mode is also an eigenvalue of all 1,200 equations with
the damper as a complex stiffness, and the peaks are those of all equations, condensed exactly. Its
damper touches the lowest family of modes little: it adds at most 1.6 per mille of damping ratio.

Reference: M. Krack, Nonlinear modal analysis of nonconservative systems: Extension of the periodic
motion concept, Computers and Structures 154 (2015), 59-71.
"""

from collections.abc import Callable
from importlib.metadata import version
from typing import Any, NamedTuple

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import minimize_scalar

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig09_contact_stiffness as fig09
from studies.landmark import Landmark, Source
from studies.open_sector import COARSE, RADII, THICKNESS, open_sector
from studies.open_sector_contacts import CONTACT_STIFFNESS, DAMPER_SPEED, FRICTION, ORDER, PLATFORM
from studies.open_sector_modes import TWIST
from studies.run import run
from studies.unforced import InTime, Wave, WholeSector

NAME = "damping_of_modes"
MODES, INTERFACE_MODES = 12, 16
DAMPING = 4e-7
"""Damping matrix of the disk over its stiffness matrix [s]."""
NORMAL_LOAD = 40.0
"""Of dampers of the disk [N]."""
REDUCED = (1500.0, 2200.0)
"""Band [Hz] that the reduction is certified in."""
MANY = tuple(range(1, 22, 2))
"""Harmonics of the mode that is compared with the exact one."""
CHECKED = 9
"""Number of amplitudes at which modes are compared."""
DRAWN = 181
"""Number of frequencies at which responses are drawn, beside the points of their paths."""
ROUND_OFF = 1e-9
OPTIMUM = 1e-5
"""Of the best load: half of the digits, as damping hardly changes there."""
TRUNCATION = 1e-5
"""Of frequency and damping ratio with harmonics up to 21, of which damping is the less exact."""
REDUCTION = 5e-4
"""What the reduction of the sector changes."""
TOLD = 0.02
"""Of the amplitude of a peak: what one mode does not tell of it with several harmonics."""


class Case(NamedTuple):
    """A structure: balances by harmonics, its force [N], and where its mode is looked at.

    ``mode`` is that of one harmonic, computed without the library, from an amplitude [m], a normal
    load [N] and a frequency [Hz] near.
    """

    name: str
    model: Any
    force: Callable[[float], Any]
    harmonics: tuple[int, ...]
    amplitudes: tuple[float, float]
    design: float
    loads: tuple[float, float]
    band: tuple[float, float]
    forces: tuple[float, ...]
    mode: Callable[[float, float, float], tuple[float, float]]
    nodal_diameter: int | None = None
    dof: Any = 0

    def problem(self, harmonics: tuple[int, ...] | None = None) -> sh.HarmonicBalance:
        """The balance without a force."""
        return sh.HarmonicBalance(self.model, harmonics=harmonics or self.harmonics)

    @property
    def place(self) -> int:
        """Where results have what the mode is told by."""
        kept = getattr(self.model, "kept", None)
        if kept is None:
            return self.dof
        return int(np.flatnonzero(kept == self.model.number_of(self.dof))[0])

    @property
    def options(self) -> dict[str, Any]:
        """How its mode is asked for."""
        return dict(place=self.dof, nodal_diameter=self.nodal_diameter, progress=False, throw=True)


class Disk(NamedTuple):
    """The disk with dampers: all equations, the ``reduced`` one and what the mode is told by."""

    whole: sh.Sector
    reduced: sh.Sector
    tip: str
    contact: dict[str, float]
    next_contact: dict[str, float]

    def wave(self, nodal_diameter: int) -> WholeSector:
        """All equations of a wave."""
        ends = self.contact, self.next_contact
        return WholeSector(self.whole, nodal_diameter, *ends, CONTACT_STIFFNESS, self.tip)


def disk(grid: tuple[int, int, int, int] = COARSE) -> Disk:
    """A disk of 24 sectors with a damper of one direction between platforms."""
    sector = open_sector(grid, twist=TWIST).damped(DAMPING).at(DAMPER_SPEED)
    tip = f"{sector.near(RADII[2], 0.0, THICKNESS / 2)}:y"
    at = np.arcsin(RADII[1] * np.tan(np.pi / 72) / PLATFORM)
    one, other = (sector.near(PLATFORM, side * at, THICKNESS / 2) for side in (1, -1))
    damper = sh.Friction(
        tangential=(f"{one}:x", sh.next_sector(f"{other}:x")),
        contact_stiffness=CONTACT_STIFFNESS,
        friction_coefficient=FRICTION,
        normal_load=NORMAL_LOAD,
    )
    whole = sector.disk.with_contacts(damper=damper)
    options: dict[str, Any] = dict(interface_modes=INTERFACE_MODES, places=[tip])
    reduced: Any = sh.craig_bampton(whole, MODES, REDUCED, **options)
    # What moves along x of the first sector, in the axes of the next one.
    turn = 2 * np.pi / whole.n_sectors
    ends = {f"{one}:x": 1.0}, {f"{other}:x": -np.cos(turn), f"{other}:y": np.sin(turn)}
    return Disk(whole, reduced, tip, *ends)


def wave(model: Any, nodal_diameter: int | None, load: float) -> Wave:
    """One blade of a ring, or one alone, under a normal load [N]."""
    value = {name: float(np.mean(each)) for name, each in model.parameters.items()}
    ratio = 1.0
    if nodal_diameter is not None:
        ratio = 2 * abs(np.sin(np.pi * nodal_diameter / model.n_dof))
    mass, damping, stiffness, contact_stiffness = (
        value[name] for name in ("mass", "damping", "stiffness", "contact_stiffness")
    )
    limit = value["friction_coefficient"] * load
    return Wave(mass, damping, stiffness, contact_stiffness, limit, ratio)


def cases() -> list[Case]:
    """The three structures."""
    blade = fig03.problem().model.with_parameters(normal_load=3.0)
    ring = fig09.problem().model.with_parameters(contact_stiffness=1e4)
    found = disk()
    whole = found.wave(-6)
    return [
        Case(
            "one blade", blade, lambda f: sh.forces.PointForce(amplitude=f), (1, 3, 5),
            (5e-5, 1e-2), 3e-4, (0.3, 20), (12, 27), (0.3, 0.8, 1.2, 1.6),
            lambda a, load, _: wave(blade, None, load).mode(a),
        ),
        Case(
            "ring of 13 blades, 3 nodal diameters", ring,
            lambda f: sh.forces.EngineOrder(3, amplitude=f), (1, 3, 5),
            (1e-4, 3e-2), 1e-3, (1, 100), (12, 34), (1, 3, 5, 6.5),
            lambda a, load, _: wave(ring, 3, load).mode(a), 3,
        ),
        Case(
            "disk by finite elements, 6 nodal diameters", found.reduced,
            lambda f: sh.forces.EngineOrder(ORDER, pattern={found.tip: f}), (1, 3),
            (2e-6, 2e-4), 2e-5, (2, 600), (1920, 1965), (0.6, 1.5, 3, 6),
            lambda a, load, near: whole.mode(a, FRICTION * load, near), -6, found.tip,
        ),
    ]  # fmt: skip


def compute(progress: bool = True) -> xr.Dataset:
    """Modes, responses and best loads of the three structures."""
    found = cases()
    datasets = [_of_case(case) for case in found]
    for one in datasets:
        for dim in one.dims:
            # Numbered, so that shorter ones are filled up.
            one[dim] = np.arange(one.sizes[dim])
    names = xr.DataArray([case.name for case in found], dims="structure", name="structure")
    dataset = xr.concat(datasets, names, join="outer")
    dataset = dataset.merge(_blade_in_time(found[0])).merge(_all_equations(found[2]))
    for name, (units, long_name) in DESCRIBED.items():
        dataset[name].attrs.update(units=units, long_name=long_name)
    return dataset.assign_attrs(
        title="Damping of modes of three structures that rub",
        references="M. Krack, Computers and Structures 154 (2015), 59-71",
        symhbm_schema=1,
        symhbm_version=version("symhbm"),
    )


def _of_case(case: Case) -> xr.Dataset:
    problem, one = case.problem(), case.problem((1,))
    load = float(np.mean(problem.parameters["normal_load"]))
    modes = sh.nonlinear_modes(problem, band=case.amplitudes, **case.options)
    best, best_of_one = (
        sh.maximise_damping(each, "normal_load", case.loads, amplitude=case.design, **case.options)
        for each in (problem, one)
    )
    chosen = problem.with_parameters(normal_load=best.design_value.item())
    of_best = sh.nonlinear_modes(chosen, band=case.amplitudes, **case.options)
    # With one harmonic, beside what is computed without the library.
    grid = np.geomspace(*case.amplitudes, CHECKED)
    of_one = sh.nonlinear_modes(one, at=grid, band=case.amplitudes, **case.options)
    of_one = of_one.isel(solution=0)
    expected = [case.mode(a, load, f) for a, f in zip(grid, of_one.frequency.values, strict=True)]
    value = best_of_one.design_value.item()
    near = best_of_one.frequency.mean().item()
    return xr.Dataset(
        {
            "amplitude": ("point", modes.amplitude.values),
            "frequency": ("point", modes.frequency.values),
            "damping_ratio": ("point", modes.damping_ratio.values),
            "best_amplitude": ("best_point", of_best.amplitude.values),
            "best_damping_ratio": ("best_point", of_best.damping_ratio.values),
            "normal_load": load,
            "design_amplitude": case.design,
            "normal_loads": ("load_point", best.normal_load.values),
            "load_damping_ratio": ("load_point", best.damping_ratio.values),
            "design_load": best.design_value.item(),
            "design_damping_ratio": best.design_damping_ratio.item(),
            "one_design_load": value,
            "one_design_damping_ratio": best_of_one.design_damping_ratio.item(),
            "expected_design": ("told", _expected_design(case, value, near)),
            "checked_amplitude": ("checked", grid),
            "checked_frequency": ("checked", of_one.frequency.values),
            "checked_damping_ratio": ("checked", of_one.damping_ratio.values),
            "expected_frequency": ("checked", [f for f, _ in expected]),
            "expected_damping_ratio": ("checked", [d for _, d in expected]),
        }
    ).merge(_responses(case, modes))


def _expected_design(case: Case, near: float, frequency: float) -> list[float]:
    """The load [N] with most damping, by a search without the library, and that damping."""
    found: Any = minimize_scalar(
        lambda log: -case.mode(case.design, float(np.exp(log)), frequency)[1],
        bounds=(np.log(near) - 1, np.log(near) + 1),
        method="bounded",
        options={"xatol": 1e-8},
    )
    return [float(np.exp(found.x)), -float(found.fun)]


def _responses(case: Case, modes: xr.Dataset) -> xr.Dataset:
    """Responses to all forces, their peaks, and those that the mode tells."""
    curves = []
    for size in case.forces:
        problem = sh.HarmonicBalance(case.model, case.force(size), case.harmonics)
        found = sh.frf(problem, case.band, phase_resonances=True, progress=False, throw=True)
        # Lines between the points of a path are chords.
        dense = np.union1d(found.frequency.values, np.linspace(*case.band, DRAWN))
        drawn = sh.frf(problem, case.band, at=dense, progress=False, throw=True)
        told = sh.datasets.synthesised_response(modes, case.force(size))
        at, level = first_peak(found, case.place)
        resonance = found.event_frequency.values[found.event_kind.values == "phase resonance"]
        curve = xr.Dataset(
            {
                "swept_frequency": ("swept", drawn.frequency.values),
                "response": ("swept", first_harmonic(drawn.coefficient, case.place)),
                "peak_frequency": at,
                "peak_amplitude": level,
                "told_frequency": told.peak_frequency.item(),
                "told_amplitude": told.peak_amplitude.item(),
                "phase_frequency": resonance[0] if len(resonance) else np.nan,
            }
        )
        curves.append(curve.assign_coords(swept=np.arange(curve.sizes["swept"])))
    joined: Any = xr.concat(curves, "curve", join="outer")
    return joined.assign(force=("curve", list(case.forces)))


def first_harmonic(coefficient: xr.DataArray, place: int) -> Any:
    """Amplitudes [m] of the first harmonic of the degree of freedom at a place in the result."""
    one = coefficient.sel(harmonic=1).isel(dof=place)
    return np.hypot(one.sel(component="cos").values, one.sel(component="sin").values)


def first_peak(found: xr.Dataset, place: int) -> tuple[float, float]:
    """Frequency [Hz] and first harmonic [m] of the highest peak."""
    levels = first_harmonic(found.peak_coefficient, place)
    highest = int(np.nanargmax(levels))
    return float(found.peak_frequency[highest]), float(levels[highest])


def _blade_in_time(case: Case) -> xr.Dataset:
    """The mode of the blade with many harmonics, and the exact one, at the amplitude of design."""
    at = [case.design]
    found = sh.nonlinear_modes(
        case.problem(MANY), at=at, band=case.amplitudes, **case.options
    ).isel(solution=0, amplitude=0)
    load = float(np.mean(case.problem().parameters["normal_load"]))
    one = wave(case.model, None, load)
    values = one.mass, one.damping, one.stiffness, one.contact_stiffness, one.limit
    exact = InTime(*values).mode(case.design)
    told = [found.frequency.item(), found.damping_ratio.item()]
    return xr.Dataset({"blade_mode": ("told", told), "blade_in_time": ("told", [*exact])})


def _all_equations(case: Case) -> xr.Dataset:
    """Peaks of the disk that is condensed exactly."""
    found = disk()
    peaks = []
    for size in case.forces:
        force = sh.forces.EngineOrder(ORDER, pattern={found.tip: size})
        small = sh.condense(
            found.whole, force, case.band, case.harmonics, places=[found.tip], progress=False
        )
        response = sh.frf(
            sh.HarmonicBalance(small, force, case.harmonics), case.band, progress=False, throw=True
        )
        at = int(np.flatnonzero(small.dofs == found.whole.number_of(found.tip))[0])
        peaks.append(first_peak(response, at))
    return xr.Dataset({"whole_peak": (("curve", "told"), np.array(peaks))})


_EXPECTED = "one harmonic, without the library"
_PEAK = "the highest peak"
DESCRIBED = {
    "amplitude": ("m", "amplitude of the first harmonic"),
    "frequency": ("Hz", "frequency of the mode"),
    "damping_ratio": ("1", "damping ratio of the mode"),
    "best_amplitude": ("m", "amplitude of the first harmonic, under the best load"),
    "best_damping_ratio": ("1", "damping ratio of the mode under the best load"),
    "normal_load": ("N", "normal load of responses"),
    "design_amplitude": ("m", "amplitude that damping is chosen for"),
    "normal_loads": ("N", "normal load that is chosen"),
    "load_damping_ratio": ("1", "damping ratio at the amplitude that it is chosen for"),
    "design_load": ("N", "normal load with most damping"),
    "design_damping_ratio": ("1", "most damping"),
    "one_design_load": ("N", "normal load with most damping, one harmonic"),
    "one_design_damping_ratio": ("1", "most damping, one harmonic"),
    "expected_design": ("1", f"load [N] with most damping, and that ratio, {_EXPECTED}"),
    "checked_amplitude": ("m", "amplitudes where modes of one harmonic are compared"),
    "checked_frequency": ("Hz", "frequency of the mode, one harmonic"),
    "checked_damping_ratio": ("1", "damping ratio of the mode, one harmonic"),
    "expected_frequency": ("Hz", f"frequency of the mode, {_EXPECTED}"),
    "expected_damping_ratio": ("1", f"damping ratio of the mode, {_EXPECTED}"),
    "swept_frequency": ("Hz", "excitation frequency"),
    "response": ("m", "amplitude of the first harmonic of the response"),
    "peak_frequency": ("Hz", f"frequency of {_PEAK}"),
    "peak_amplitude": ("m", f"first harmonic at {_PEAK}"),
    "told_frequency": ("Hz", f"frequency of {_PEAK} that the mode tells"),
    "told_amplitude": ("m", f"first harmonic at {_PEAK} that the mode tells"),
    "phase_frequency": ("Hz", "where the response is a quarter of a period late"),
    "force": ("N", "amplitude of the force"),
    "blade_mode": ("1", "frequency [Hz] and damping ratio of the blade, harmonics up to 21"),
    "blade_in_time": ("1", "frequency [Hz] and damping ratio of the blade, exact in time"),
    "whole_peak": ("1", f"frequency [Hz] and first harmonic [m] of {_PEAK}, all equations"),
    "structure": ("1", "structure and wave"),
}


def draw(dataset: xr.Dataset) -> Figure:
    """Draw responses with the backbone, damping over the amplitude, and over the normal load."""
    with plt.rc_context(sh.plot.STYLE):
        figure, axes = plt.subplots(3, 3, figsize=(14.5, 12.0), layout="constrained")
        for column, name in zip(axes.T, dataset.structure.values, strict=True):
            one = dataset.sel(structure=name)
            _draw_responses(column[0], one)
            column[0].set_title(str(name))
            _draw_damping(column[1], one)
            _draw_loads(column[2], one)
        figure.suptitle("Modes that rub: backbones, damping over the amplitude, and the best load")
    return figure


def _draw_responses(ax: Axes, one: xr.Dataset) -> None:
    shades = plt.get_cmap("viridis")(np.linspace(0.1, 0.85, one.sizes["curve"]))
    for i, color in enumerate(shades):
        curve = one.isel(curve=i)
        label = f"{float(curve.force):g} N"
        ax.semilogy(curve.swept_frequency, 1e3 * curve.response, color=color, label=label)
    ax.semilogy(one.frequency, 1e3 * one.amplitude, "k", linewidth=2, label="mode: backbone")
    look: dict[str, Any] = dict(markeredgecolor="k", color="w", markersize=6, zorder=4)
    ax.semilogy(one.peak_frequency, 1e3 * one.peak_amplitude, "o", label="peaks", **look)
    swept = one.swept_frequency.values
    top = 1e3 * float(one.peak_amplitude.max())
    ax.set_xlim(np.nanmin(swept), np.nanmax(swept))
    ax.set_ylim(8e2 * float(one.response.min()), 1.6 * top)
    ax.set(xlabel="frequency [Hz]", ylabel="amplitude [mm]")
    ax.legend(fontsize=8)


def _draw_damping(ax: Axes, one: xr.Dataset) -> None:
    for prefix, load, color in (
        ("", "normal_load", "tab:blue"),
        ("best_", "design_load", "tab:red"),
    ):
        told = 1e3 * one[f"{prefix}amplitude"], 100 * one[f"{prefix}damping_ratio"]
        words = ", best" if prefix else ""
        ax.semilogx(*told, color=color, label=f"normal load {float(one[load]):.3g} N{words}")
    checked = 1e3 * one.checked_amplitude, 100 * one.expected_damping_ratio
    ax.semilogx(*checked, "k.", markersize=5, label=_EXPECTED)
    at = 1e3 * float(one.design_amplitude)
    ax.axvline(at, color="0.5", linestyle=":", label=f"to be damped: {at:g} mm")
    ax.set(xlabel="amplitude [mm]", ylabel="damping ratio [%]", ylim=(0, None))
    ax.legend(fontsize=8, loc="upper right")
    ax.set_ylim(0, 1.35 * ax.get_ylim()[1])


def _draw_loads(ax: Axes, one: xr.Dataset) -> None:
    ax.semilogx(one.normal_loads, 100 * one.load_damping_ratio, color="0.3")
    best = float(one.design_load), 100 * float(one.design_damping_ratio)
    label = f"best: {best[1]:.3g} % with {best[0]:.3g} N"
    ax.plot(*best, "*", color="tab:red", markersize=14, label=label)
    amplitude = 1e3 * float(one.design_amplitude)
    ax.set(xlabel="normal load [N]", ylabel=f"damping ratio at {amplitude:g} mm [%]")
    ax.set_ylim(0, 1.25 * best[1])
    ax.legend(fontsize=8, loc="upper left")


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Modes, best loads and peaks beside closed forms, exact motion and all equations."""
    rows = []
    for i, name in enumerate(map(str, dataset.structure.values)):
        one = dataset.isel(structure=i)
        short = name.partition(",")[0]
        whole = i == len(dataset.structure) - 1
        source = Source.EXACT if whole else Source.CLOSED_FORM
        tolerance, of_load = (REDUCTION, 10 * REDUCTION) if whole else (ROUND_OFF, OPTIMUM)
        for what in ("frequency", "damping_ratio"):
            told, expected = (one[f"{kind}_{what}"].values for kind in ("checked", "expected"))
            errors = np.abs(told / expected - 1)
            text = f"{short}: {what.replace('_', ' ')} with one harmonic, largest difference"
            rows.append(Landmark(text, float(errors.max()), 0.0, "", source, tolerance))
        load, damping = one.expected_design.values
        found = float(one.one_design_load), float(one.one_design_damping_ratio)
        text = f"{short}: best load with one harmonic"
        rows.append(Landmark(text, found[0], float(load), "N", source, of_load))
        text = f"{short}: most damping with one harmonic"
        rows.append(Landmark(text, found[1], float(damping), "", source, tolerance))
        if not whole:
            of_peak, told = one.peak_amplitude.values, one.told_amplitude.values
            error = float(np.abs(told / of_peak - 1).max())
            text = f"{short}: peaks that the mode tells, largest difference"
            rows.append(Landmark(text, error, 0.0, "", Source.EXACT, TOLD))
    disk = dataset.isel(structure=-1)
    peaks = dataset.whole_peak.values.T
    for what, row, limit in (
        ("frequency", peaks[0], REDUCTION),
        ("amplitude", peaks[1], REDUCTION),
    ):
        errors = np.abs(disk[f"told_{what}"].values / row - 1)
        text = f"disk: {what} of peaks that the mode tells, against all equations"
        rows.append(Landmark(text, float(errors.max()), 0.0, "", Source.EXACT, limit))
    told = zip(("frequency", "damping ratio"), ("Hz", ""), strict=True)
    for i, (what, unit) in enumerate(told):
        found, expected = float(dataset.blade_mode[i]), float(dataset.blade_in_time[i])
        text = f"one blade: {what} of the exact mode"
        rows.append(Landmark(text, found, expected, unit, Source.EXACT, TRUNCATION))
    return rows


if __name__ == "__main__":
    run(NAME, compute, draw)
