"""Flutter that friction holds: one blade, the ring of the paper and a disk by finite elements.

Air that feeds vibrations is negative damping. Friction takes more than it feeds between two
amplitudes: the smaller one is a limit cycle that is stable, at the larger one friction lets go.
Both meet at a fold, beyond which nothing holds the blade. Of one blade cycles, their stability and
the fold are closed forms with one harmonic, and exact from reversal to reversal in time.

The blades of a disk feel the air that their neighbours move, by influence coefficients. It damps
waves that run one way and feeds those that run the other way, each of them to another amount. The
least stable wave need not be the one that the disk ends in: on the ring it has two nodal diameters,
but its limit cycle is unstable against other waves. A march of all blades in time, from a small
disturbance of no order, leaves two nodal diameters and ends in the limit cycle with three.

Reference: M. Krack, Nonlinear modal analysis of nonconservative systems: Extension of the periodic
motion concept, Computers and Structures 154 (2015), 59-71.
"""

from dataclasses import replace
from importlib.metadata import version
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import minimize_scalar

import symhbm as sh
from studies import damping_of_modes as damping
from studies import fig03_single_blade as fig03
from studies import fig09_contact_stiffness as fig09
from studies.claim import Finding
from studies.landmark import Landmark, Source
from studies.open_sector_contacts import FRICTION
from studies.run import run
from studies.unforced import InTime, Wave, WholeSector, march, root
from symhbm.numerics import FloatArray

NAME = "flutter"
SHOWN = -5.0
"""Damping of the blade whose two cycles are shown [N s/m]."""
BAND = (-30.0, 0.0)  # N s/m
EXACT_AT = (-25.0, -20.0, -15.0, -10.0, -5.0, -2.0)
"""Damping [N s/m] at which cycles of the blade are marched in time."""
MANY = tuple(range(1, 22, 2))
HARMONICS = (1, 3, 5)
WIDEST = 1.0
"""Largest amplitude [m] that cycles of blades are looked for at."""
N_BLADES, RING_LOAD = 13, 10.0  # N
DRAG, CIRCULATION = 2.0, 600.0
"""Air of the ring: damping of a blade by its own motion [N s/m], stiffness by neighbours [N/m]."""
FROM_BEHIND, DISK_WIDEST = 5.7e4, 5e-4
"""Air of the disk: stiffness along tips by neighbours [N/m]; largest amplitude of cycles [m]."""
DISK_DRAG, DISK_FREQUENCY = 1.4e4, 1940.0
"""By the own motion of a tip, the imaginary part [N/m], at a frequency [Hz]."""
STUCK = 1e-9
"""Amplitude of small motions [m]."""
SECONDS, STEPS, SEED = 12.0, 7000, 1
"""Of the march: its length [s], steps in a second and where its disturbance is drawn from."""
DISTURBED = 1e-4
"""Standard deviation of that disturbance [m]."""
WINDOW = 0.2
"""Length [s] of the parts of the march that waves are read from."""
MARKED = 2e-5
"""Amplitude [m] of waves of the march that are shown."""
ROUND_OFF, TRUNCATION = 1e-9, 3e-5
FLAT = 1e-5
"""Of what lies at a maximum: half of the digits."""
RATIOS = 1e-5
"""Of damping ratios, what the reduction changes where they are some per mille."""
MARCHED = 1e-3
"""Of the wave that the march ends in: others are still dying away, and steps."""
LEAST = 6
"""Nodal diameters of the least stable wave of the disk."""
REDUCTION = 2e-3
"""Of amplitudes, what the reduction of the sector changes."""


def blade(harmonics: tuple[int, ...], value: float = SHOWN) -> sh.HarmonicBalance:
    """The blade of the paper under 3 N, with a damping [N s/m]."""
    model = fig03.problem().model.with_parameters(normal_load=3.0, damping=value)
    return sh.HarmonicBalance(model, harmonics=harmonics)


def alone(value: float) -> Wave:
    """The same for closed forms."""
    return replace(damping.wave(blade((1,)).model, None, 3.0), damping=value)


def in_time(value: float) -> InTime:
    """The same in time."""
    one = alone(value)
    return InTime(one.mass, value, one.stiffness, one.contact_stiffness, one.limit)


def ring_matrices() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mass, damping and stiffness of the blades of the ring and the air between them."""
    one = np.eye(N_BLADES)
    ahead, behind = (np.roll(one, k, axis=1) for k in (1, -1))
    value = ring_wave(1)
    stiffness = value.stiffness * one + CIRCULATION * (ahead - behind)
    return value.mass * one, (value.damping + DRAG) * one, stiffness


def ring(harmonics: tuple[int, ...] = HARMONICS) -> sh.HarmonicBalance:
    """The ring of the paper under 10 N with that air."""
    value = ring_wave(1)
    n = N_BLADES
    rubs = sh.Friction(
        tangential=[{j: 1.0, (j + 1) % n: -1.0} for j in range(n)],
        contact_stiffness=value.contact_stiffness,
        friction_coefficient=0.5,
        normal_load=RING_LOAD,
    )
    return sh.HarmonicBalance(sh.Model(*ring_matrices(), contacts={"r": rubs}), harmonics=harmonics)


def ring_wave(nodal_diameter: int) -> Wave:
    """A blade of it in a wave, for closed forms."""
    still = fig09.problem().model.with_parameters(contact_stiffness=1e4)
    turn = 2 * np.pi * nodal_diameter / N_BLADES
    # Of the blades ahead and behind, which lag and lead.
    air = CIRCULATION * (np.exp(-1j * turn) - np.exp(1j * turn))
    return replace(damping.wave(still, nodal_diameter, RING_LOAD), air=complex(air), drag=DRAG)


def disk_air() -> dict[int, complex]:
    """Influence coefficients along the tips of the disk [N/m]."""
    return {-1: -FROM_BEHIND, 0: DISK_DRAG * 1j, 1: FROM_BEHIND}


def disk_air_of_wave(whole: WholeSector) -> tuple[complex, complex]:
    """Stiffness [N/m] and damping [N s/m] of the air in a wave."""
    circulation = FROM_BEHIND * (whole.lag - 1 / whole.lag)
    return complex(circulation), DISK_DRAG / (2 * np.pi * DISK_FREQUENCY)


def compute(progress: bool = True) -> xr.Dataset:
    """Cycles of the three structures, and the march of the ring."""
    found = damping.disk()
    parts = [_blade(), _ring(), _disk(found)]
    dataset = xr.merge(parts)
    for name, (units, long_name) in DESCRIBED.items():
        dataset[name].attrs.update(units=units, long_name=long_name)
    return dataset.assign_attrs(
        title="Flutter that friction holds, of three structures",
        references="M. Krack, Computers and Structures 154 (2015), 59-71",
        seed=SEED,
        symhbm_schema=1,
        symhbm_version=version("symhbm"),
    )


def _blade() -> xr.Dataset:
    """Cycles of the blade over its damping, its mode at one, and exact cycles."""
    options: dict[str, Any] = dict(amplitudes=(1e-6, WIDEST), progress=False, throw=True)
    over = sh.limit_cycles(blade(HARMONICS), "damping", BAND, stability=True, **options)
    of_one, of_many = (
        sh.limit_cycles(blade(one), "damping", BAND, **options) for one in ((1,), MANY)
    )
    folded = of_one.event_kind.values == "fold"
    on_grid = sh.limit_cycles(blade(MANY), "damping", BAND, at=[*EXACT_AT], **options)
    told = sh.limit_cycles(blade(MANY, EXACT_AT[-1]), **options)
    modes = sh.nonlinear_modes(blade(HARMONICS), band=(1e-5, 1e-1), progress=False)
    closed: Any = minimize_scalar(
        _cycle_damping, bounds=np.log([2e-4, 6e-4]), method="bounded", options={"xatol": 1e-10}
    )
    exact_fold = in_time(0.0).fold(2e-4, 6e-4)
    onset = 1.5e-4
    exact = [
        [
            in_time(value).cycle(*ends)
            for ends in ((onset * 1.0001, exact_fold[1]), (exact_fold[1], 1))
        ]
        for value in EXACT_AT
    ]
    return xr.Dataset(
        {
            "cycle_damping": ("cycle_point", over.damping.values),
            "cycle_amplitude": ("cycle_point", over.amplitude.values),
            "cycle_stability": ("cycle_point", over.stability.values),
            "mode_amplitude": ("mode_point", modes.amplitude.values),
            "mode_damping_ratio": ("mode_point", modes.damping_ratio.values),
            "fold_damping": of_one.fold_damping.item(),
            "fold_amplitude": of_one.event_amplitude.values[folded].item(),
            "closed_fold": ("told", [float(closed.fun), float(np.exp(closed.x))]),
            "many_fold_damping": of_many.fold_damping.item(),
            "exact_fold_damping": exact_fold[0],
            "exact_damping": ("exact", [*EXACT_AT]),
            "exact_amplitude": (("exact", "told"), [[a for a, _, _ in row] for row in exact]),
            "exact_slope": (("exact", "told"), [[s for _, _, s in row] for row in exact]),
            "many_amplitude": (("exact", "told"), np.sort(on_grid.amplitude.values[:, :2])),
            "told_stability": ("told", told.stability.values),
        }
    )


def _cycle_damping(logarithm: float) -> float:
    """Damping [N s/m] of the cycle of the blade of an amplitude, one harmonic."""
    frequency, ratio = alone(0.0).mode(float(np.exp(logarithm)))
    return -2 * alone(0.0).mass * 2 * np.pi * frequency * ratio


def _ring() -> xr.Dataset:
    """Cycles of the ring by nodal diameters, closed forms, and the march."""
    waves = np.arange(-(N_BLADES // 2), N_BLADES // 2 + 1)
    cycles = np.full((len(waves), 2), np.nan)
    of_one, closed = cycles.copy(), cycles.copy()
    stable, linear = np.full(len(waves), -1), np.zeros(len(waves))
    frequency = np.full(len(waves), np.nan)
    for i, n in enumerate(waves.tolist()):
        one = ring_wave(n)
        linear[i] = one.damping_ratio(STUCK)
        for problem, values in ((ring(), cycles), (ring((1,)), of_one)):
            several = problem.harmonics == HARMONICS
            found = sh.limit_cycles(
                problem,
                nodal_diameter=n,
                amplitudes=(1e-6, WIDEST),
                stability=several,
                progress=False,
                throw=True,
            )
            # The smaller one is missing where small motions decay.
            at = [0, 1] if found.sizes["point"] == 2 else [1]
            if found.sizes["point"]:
                values[i, at] = found.amplitude.values
                if several and at == [0, 1]:
                    stable[i], frequency[i] = found.stability.values[0], found.frequency.values[0]
        if n:
            expected = one.cycles(WIDEST)
            closed[i, 2 - len(expected) :] = expected
    time, sizes, heard = _march()
    return xr.Dataset(
        {
            "ring_damping_ratio": ("ring_wave", linear),
            "ring_amplitude": (("ring_wave", "told"), cycles),
            "ring_one_amplitude": (("ring_wave", "told"), of_one),
            "ring_closed_amplitude": (("ring_wave", "told"), closed),
            "ring_stability": ("ring_wave", stable),
            "ring_frequency": ("ring_wave", frequency),
            "march_amplitude": (("march_time", "ring_wave"), sizes),
            "march_frequency": heard,
        },
        {"ring_wave": waves, "march_time": time},
    )


def _march() -> tuple[Any, FloatArray, float]:
    """Times [s], amplitudes of waves [m] and the frequency at the end [Hz], blade by blade."""
    start = DISTURBED * np.random.default_rng(SEED).standard_normal(N_BLADES)
    one = ring_wave(1)
    count, step = int(SECONDS * STEPS), 1 / STEPS
    found = march(ring_matrices(), one.contact_stiffness, one.limit, start, step, count)
    # At each instant waves of both senses add up to one complex number; they turn in opposite ways.
    waves = np.fft.ifft(found, axis=1) * 2
    length = int(WINDOW * STEPS)
    parts = waves[: count // length * length].reshape(-1, length, N_BLADES)
    order = np.arange(-(N_BLADES // 2), N_BLADES // 2 + 1)
    sizes = _forwards(parts)[:, order % N_BLADES]
    last = int(np.argmax(sizes[-1]))
    end = waves[-10 * length :, order[last] % N_BLADES]
    slope = np.polyfit(np.arange(len(end)) * step, np.unwrap(np.angle(end)), 1)[0]
    return (np.arange(len(parts)) + 0.5) * WINDOW, sizes, abs(float(slope)) / (2 * np.pi)


def _forwards(parts: Any) -> FloatArray:
    """Amplitudes (part, wave) of what turns forwards in parts (part, time, wave) of a march."""
    length = parts.shape[1]
    fades = np.hanning(length)  # so that little of one sense is taken for the other
    turning = np.fft.fft(parts * fades[:, None], axis=1)[:, 1 : length // 2] / length
    return np.sqrt(np.sum(np.abs(turning) ** 2, axis=1) / np.mean(fades**2))


def _disk(found: damping.Disk) -> xr.Dataset:
    """Cycles of the disk by nodal diameters, and by all equations."""
    half = found.whole.n_sectors // 2
    waves = np.arange(1 - half, half + 1)
    wind = sh.Influence({found.tip: 1.0}, disk_air(), frequency=DISK_FREQUENCY)
    model = found.reduced.with_influences(wind)
    many, single = (sh.HarmonicBalance(model, harmonics=one) for one in ((1, 3), (1,)))
    span: dict[str, Any] = dict(amplitudes=(1e-7, DISK_WIDEST))
    ratios, stuck = np.zeros((2, len(waves)))
    whole_ratio = np.zeros(len(waves))
    cycles = np.full((len(waves), 2), np.nan)
    options: dict[str, Any] = dict(place=found.tip, progress=False, throw=True)
    for i, n in enumerate(waves.tolist()):
        small = sh.nonlinear_modes(
            single, at=[STUCK], band=(STUCK, 1e-8), nodal_diameter=n, **options
        )
        ratios[i], stuck[i] = (small[name].item() for name in ("damping_ratio", "frequency"))
        whole = found.wave(n)
        limit = FRICTION * damping.NORMAL_LOAD
        whole_ratio[i] = whole.mode(STUCK, limit, stuck[i], disk_air_of_wave(whole))[1]
        if ratios[i] < 0:
            at = sh.limit_cycles(many, nodal_diameter=n, **span, **options)
            cycles[i, : at.sizes["point"]] = at.amplitude.values
    least = int(waves[np.argmin(ratios)])
    at = sh.limit_cycles(single, nodal_diameter=least, **span, **options)
    told = [
        _whole_cycle(found.wave(least), amplitude, frequency)
        for amplitude, frequency in zip(at.amplitude.values, at.frequency.values, strict=True)
    ]
    return xr.Dataset(
        {
            "disk_damping_ratio": ("disk_wave", ratios),
            "disk_whole_damping_ratio": ("disk_wave", whole_ratio),
            "disk_stuck_frequency": ("disk_wave", stuck),
            "disk_amplitude": (("disk_wave", "told"), cycles),
            "disk_one_amplitude": ("told", at.amplitude.values),
            "disk_whole_amplitude": ("told", told),
        },
        {"disk_wave": waves},
    )


def _whole_cycle(whole: WholeSector, amplitude: float, frequency: float) -> float:
    """Amplitude [m] of a cycle by all equations, near one of the reduced ones."""
    limit, air = FRICTION * damping.NORMAL_LOAD, disk_air_of_wave(whole)
    ratio = lambda a: whole.mode(a, limit, frequency, air)[1]  # noqa: E731
    return root(ratio, 0.95 * amplitude, 1.05 * amplitude)


_CYCLES = "amplitudes of the limit cycles, the stable one first"
_SMALL = "damping ratio of small motions with the air"
DESCRIBED = {
    "cycle_damping": ("N s m-1", "damping of the blade with a limit cycle"),
    "cycle_amplitude": ("m", "amplitude of the limit cycle of the blade"),
    "cycle_stability": ("1", "1 where it is stable, 0 where not, -1 unknown"),
    "mode_amplitude": ("m", "amplitude of the mode of the blade"),
    "mode_damping_ratio": ("1", f"damping ratio of the mode of the blade with {SHOWN:g} N s/m"),
    "fold_damping": ("N s m-1", "damping of the fold, one harmonic"),
    "fold_amplitude": ("m", "amplitude of the fold, one harmonic"),
    "closed_fold": ("1", "damping [N s/m] and amplitude [m] of the fold, closed form"),
    "many_fold_damping": ("N s m-1", "damping of the fold, harmonics up to 21"),
    "exact_fold_damping": ("N s m-1", "damping of the fold, exact in time"),
    "exact_damping": ("N s m-1", "damping of the blade whose cycles are exact"),
    "exact_amplitude": ("m", f"{_CYCLES}, blade, exact in time"),
    "exact_slope": ("1", "growth of a disturbance of an exact cycle over half a period"),
    "many_amplitude": ("m", f"{_CYCLES}, blade, harmonics up to 21"),
    "told_stability": ("1", f"stability of both cycles with {EXACT_AT[-1]:g} N s/m"),
    "ring_wave": ("1", "nodal diameters of the ring"),
    "ring_damping_ratio": ("1", f"{_SMALL}, ring"),
    "ring_amplitude": ("m", f"{_CYCLES}, ring"),
    "ring_one_amplitude": ("m", f"{_CYCLES}, ring, one harmonic"),
    "ring_closed_amplitude": ("m", f"{_CYCLES}, ring, closed form"),
    "ring_stability": ("1", "stability of the smaller cycle against all waves, -1 without one"),
    "ring_frequency": ("Hz", "frequency of the smaller cycle"),
    "march_time": ("s", "time since the disturbance"),
    "march_amplitude": ("m", "amplitude of a wave of the march"),
    "march_frequency": ("Hz", "frequency at the end of the march"),
    "disk_wave": ("1", "nodal diameters of the disk"),
    "disk_damping_ratio": ("1", f"{_SMALL}, disk"),
    "disk_whole_damping_ratio": ("1", f"{_SMALL}, disk, all equations"),
    "disk_stuck_frequency": ("Hz", "frequency of small motions of the disk"),
    "disk_amplitude": ("m", f"{_CYCLES}, disk"),
    "disk_one_amplitude": ("m", f"{_CYCLES}, least stable wave of the disk, one harmonic"),
    "disk_whole_amplitude": ("m", f"{_CYCLES}, least stable wave, all equations"),
}


def draw(dataset: xr.Dataset) -> Figure:
    """Draw what air feeds, the cycles, and the march of the ring."""
    with plt.rc_context(sh.plot.STYLE):
        figure = plt.figure(figsize=(14.5, 11.5), layout="constrained")
        axes = figure.subplot_mosaic("brd\nBRD\nTTT")
        names = "one blade", "ring of 13 blades", "disk by finite elements"
        for place, name in zip("brd", names, strict=True):
            axes[place].set_title(name)
        _draw_balance(axes["b"], dataset)
        _draw_blade(axes["B"], dataset)
        for small, large, name in (("r", "R", "ring"), ("d", "D", "disk")):
            _draw_ratios(axes[small], dataset, name)
            _draw_waves(axes[large], dataset, name)
        _draw_march(axes["T"], dataset)
        figure.suptitle("Flutter that friction holds")
    return figure


def _draw_balance(ax: Axes, dataset: xr.Dataset) -> None:
    """Damping of the mode: where it is negative, amplitudes grow."""
    amplitude, ratio = 1e3 * dataset.mode_amplitude, 100 * dataset.mode_damping_ratio
    ax.semilogx(amplitude, ratio, "k")
    ax.axhline(0, color="0.5", linewidth=0.8)
    grows: dict[str, Any] = dict(color="tab:red", alpha=0.15, label="amplitudes grow")
    ax.fill_between(amplitude, ratio, 0, where=ratio.values < 0, **grows)
    shrinks: dict[str, Any] = dict(color="tab:blue", alpha=0.15, label="friction: they shrink")
    ax.fill_between(amplitude, ratio, 0, where=ratio.values > 0, **shrinks)
    ax.set(xlabel="amplitude [mm]", ylabel=f"damping ratio with {SHOWN:g} N s/m [%]")
    ax.set_xlim(float(amplitude.min()), 30)
    ax.legend(fontsize=8, loc="upper right")


def _draw_blade(ax: Axes, dataset: xr.Dataset) -> None:
    order = np.argsort(dataset.cycle_amplitude.values)
    feeds = -dataset.cycle_damping.values[order]
    level = 1e3 * dataset.cycle_amplitude.values[order]
    stable = dataset.cycle_stability.values[order] == 1
    first = int(np.flatnonzero(stable)[-1]) + 1
    ax.semilogy(feeds[: first + 1], level[: first + 1], color="tab:blue", label="held: stable")
    ax.semilogy(feeds[first:], level[first:], "--", color="tab:red", label="beyond: lost")
    exact = (
        np.repeat(-dataset.exact_damping.values, 2),
        1e3 * dataset.exact_amplitude.values.ravel(),
    )
    ax.plot(*exact, "k.", label="exact in time")
    fold = -float(dataset.fold_damping), 1e3 * float(dataset.fold_amplitude)
    look: dict[str, Any] = dict(color="w", markeredgecolor="k")
    ax.plot(*fold, "s", label=f"fold: {fold[0]:.2f} N s/m", **look)
    ax.set(xlabel="negative damping [N s/m]", ylabel="amplitude of limit cycles [mm]")
    ax.set_ylim(0.1, 100)
    ax.legend(fontsize=8)


def _draw_ratios(ax: Axes, dataset: xr.Dataset, name: str) -> None:
    waves, ratio = dataset[f"{name}_wave"].values, 100 * dataset[f"{name}_damping_ratio"].values
    ax.bar(waves, ratio, color=np.where(ratio < 0, "tab:red", "tab:blue"))
    least = int(np.argmin(ratio))
    note = f"least stable: {waves[least]}"
    ax.annotate(note, (waves[least], ratio[least]), (0.03, 0.06), textcoords="axes fraction",
                arrowprops=dict(arrowstyle="-", color="0.4"))  # fmt: skip
    ax.axhline(0, color="0.4", linewidth=0.8)
    ax.set(xlabel="nodal diameters", ylabel="damping ratio of small motions [%]")


def _draw_waves(ax: Axes, dataset: xr.Dataset, name: str) -> None:
    """Lines from the cycle that holds a wave to the one beyond which it is lost."""
    waves, pairs = dataset[f"{name}_wave"].values, 1e3 * dataset[f"{name}_amplitude"].values
    verdict = dataset[f"{name}_stability"].values if name == "ring" else np.full(len(waves), 1)
    ends = np.flatnonzero(np.isfinite(pairs[:, 0]))
    for i in ends:
        if np.isfinite(pairs[i, 1]):
            ax.semilogy([waves[i]] * 2, pairs[i], color="0.7", linewidth=5, zorder=1)
    held = "held" if name == "ring" else "held, if no other wave grows"
    looks = (1, "tab:blue", "w", held), (0, "tab:orange", "k", "held, but other waves grow")
    for kind, color, edge, label in looks:
        some = ends[verdict[ends] == kind]
        if len(some):
            look: dict[str, Any] = dict(color=color, markeredgecolor=edge, markersize=9)
            ax.semilogy(waves[some], pairs[some, 0], "o", label=label, **look)
    ax.semilogy(waves[ends], pairs[ends, 1], "x", color="tab:red", label="beyond: lost")
    if name == "ring":
        last = 1e3 * dataset.march_amplitude.isel(march_time=-1)
        at = int(np.argmax(last.values))
        look = dict(color="none", markeredgecolor="k", markersize=15)
        ax.plot(waves[at], float(last[at]), "s", label="where the march in time ends", **look)
    ax.set(xlabel="nodal diameters", ylabel="amplitude of limit cycles [mm]")
    ax.set_xlim(waves[ends].min() - 1, waves[ends].max() + 1)
    ax.set_ylim(0.5 * np.nanmin(pairs[ends]), 8 * np.nanmax(pairs[ends]))
    ax.set_xticks(waves[ends])
    ax.legend(fontsize=8, loc="upper left")


def _draw_march(ax: Axes, dataset: xr.Dataset) -> None:
    shown = dataset.march_amplitude.max("march_time") > MARKED
    colors = plt.get_cmap("tab10")
    for n in dataset.ring_wave.values[shown.values]:
        color = colors(abs(int(n)) % 10)
        level = 1e3 * dataset.march_amplitude.sel(ring_wave=n)
        look: dict[str, Any] = dict(
            color=color, label=f"{n} nodal diameters".replace("-", "\u2212")
        )
        ax.semilogy(dataset.march_time, level, "-" if n > 0 else "--", **look)
        cycle = 1e3 * float(dataset.ring_amplitude.sel(ring_wave=n)[0])
        ax.axhline(cycle, color=color, linestyle=":", linewidth=1)
    ax.set(xlabel="time [s]", ylabel="amplitude of waves [mm]", ylim=(1e-3, 3))
    ax.set_title("all blades of the ring in time, from a small disturbance; dotted: limit cycles")
    ax.legend(fontsize=8, ncols=6, loc="upper center")


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Cycles and folds beside closed forms, motions in time and all equations."""
    closed, exact = Source.CLOSED_FORM, Source.EXACT
    fold = dataset.closed_fold.values
    rows = [
        ("one blade: fold with one harmonic, damping", dataset.fold_damping, fold[0],
         "N s/m", closed, ROUND_OFF),
        ("one blade: fold with one harmonic, amplitude", dataset.fold_amplitude, fold[1],
         "m", closed, FLAT),
        ("one blade: fold, damping", dataset.many_fold_damping, dataset.exact_fold_damping,
         "N s/m", exact, TRUNCATION),
        ("one blade: amplitudes of cycles, largest difference",
         _largest(dataset.many_amplitude, dataset.exact_amplitude), 0, "", exact, TRUNCATION),
        ("one blade: cycles whose stability is another one in time",
         np.sum((dataset.told_stability == 1) != (dataset.exact_slope[-1] < 1)), 0, "", exact, 0),
    ]  # fmt: skip
    found, expected = dataset.ring_one_amplitude, dataset.ring_closed_amplitude
    end = dataset.march_amplitude.isel(march_time=-1)
    last = int(np.argmax(end.values))
    stable = dataset.ring_stability.values == 1
    rows += [
        ("ring: cycles that only one of both finds",
         np.sum(np.isfinite(found) != np.isfinite(expected)), 0, "", closed, 0),
        ("ring: amplitudes of cycles with one harmonic, largest difference",
         _largest(found, expected), 0, "", closed, ROUND_OFF),
        ("ring: the least stable wave of all has a stable cycle",
         stable[int(np.argmin(dataset.ring_damping_ratio.values))], 0, "", exact, 0),
        ("ring: the wave that the march ends in has one", stable[last], 1, "", exact, 0),
        ("ring: amplitude of its cycle", dataset.ring_amplitude[last, 0], end[last],
         "m", exact, MARCHED),
        ("ring: frequency of its cycle", dataset.ring_frequency[last], dataset.march_frequency,
         "Hz", exact, MARCHED),
    ]  # fmt: skip
    least = int(dataset.disk_wave[int(np.argmin(dataset.disk_damping_ratio.values))])
    off = np.abs(dataset.disk_damping_ratio - dataset.disk_whole_damping_ratio).max()
    rows += [
        ("disk: nodal diameters of the least stable wave", least, LEAST, "", exact, 0),
        ("disk: damping ratios of small motions, largest difference", off, 0, "", exact, RATIOS),
        ("disk: amplitudes of its cycles, largest difference",
         _largest(dataset.disk_one_amplitude, dataset.disk_whole_amplitude), 0, "", exact,
         REDUCTION),
    ]  # fmt: skip
    return [
        Landmark(text, float(value), float(known), *others) for text, value, known, *others in rows
    ]


def findings(dataset: xr.Dataset) -> list[Finding]:
    """Which wave a ring ends in."""
    waves, ratio = dataset.ring_wave.values, dataset.ring_damping_ratio.values
    end = dataset.march_amplitude.isel(march_time=-1).values
    least, last = int(np.argmin(ratio)), int(np.argmax(end))
    stable = dataset.ring_stability.values
    return [
        Finding(
            "Flutter need not end in the least stable wave",
            f"on the ring with air {waves[least]} nodal diameters are the least stable, with a "
            f"damping ratio of {100 * ratio[least]:.2f} %, but other waves grow on their limit "
            f"cycle; a march of all blades ends in that of {waves[last]}, of "
            f"{1e3 * end[last]:.3f} mm",
            bool(least != last and stable[least] == 0 and stable[last] == 1),
        )
    ]


def _largest(found: xr.DataArray, expected: xr.DataArray) -> float:
    """Largest relative difference of what both have."""
    return float(np.abs(found / expected - 1).max())


if __name__ == "__main__":
    run(NAME, compute, draw)
