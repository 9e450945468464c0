"""Where one harmonic is enough on the tuned ring: engine orders and loads against the truth.

One harmonic is compared with the exact periodic motion, over engine orders and normal loads: at the
peaks, each at its own frequency, and at the one frequency where it errs most. Under low engine
orders its third harmonic can meet the resonance of another nodal diameter, and with little load it
can be several times off, either way.
"""

import json
import sys
from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from scipy.optimize import minimize_scalar
from tqdm import tqdm

import symhbm as sh
from studies import fig08_engine_orders as fig08
from studies.claim import Finding
from studies.closed_form import EXACT_DIGITS
from studies.companions import VISIBLE, suffices
from studies.error_map import COLOUR_MAP, COLOURS, LEVELS, draw_map
from studies.landmark import Landmark, Source
from studies.run import REFERENCE, run
from studies.travelling_wave import Wave, balanced_state, travelling_wave
from symhbm.continuation import newton

NAME = "one_harmonic_validity"
ENGINE_ORDERS = (1, 2, 3, 4, 5, 6)
NORMAL_LOADS = tuple(np.logspace(0, 2, 9))  # N
N_FREQUENCIES = 6
BELOW, ABOVE = 0.6, 1.05
"""Ends of the band over the resonances with free and with stuck contacts."""
NEAR_FREE = (0.7, 0.8, 0.88, 0.94, 0.98)
"""More frequencies over the resonance with free contacts: contacts with little load just slip."""
CLOSE = 3e-5
"""Relative change of the frequency of a peak at which it is found."""


def cell(problem: sh.HarmonicBalance) -> dict[str, Any]:
    """One engine order and normal load: amplitudes where it slips, and both peaks."""
    ends = band(problem)
    path = sh.frf(problem, ends, progress=False, throw=True)
    low, high = ends
    slipping = np.flatnonzero((path.contact_state == 1).any("contact").values)
    if len(slipping):
        # A motion that never slips is linear, and one harmonic of it exact.
        low, high = path.frequency.values[slipping[[0, -1]]]
    top = int(np.nanargmax(path.peak_amplitude.values))
    peak = float(path.peak_frequency[top])
    near_free = np.array(NEAR_FREE) * ends[0] / BELOW
    balanced = partial(_one_harmonic, problem, path)
    chosen = [*np.geomspace(low, high, N_FREQUENCIES), *near_free[near_free > low], peak]
    motions = {float(at): balanced(float(at)) for at in chosen}
    waves = {
        at: travelling_wave(problem, at, balanced_state(problem, unknowns))
        for at, unknowns in motions.items()
    }
    summit = exact_peak(problem, ends, waves, balanced)
    motions[summit] = balanced(summit)
    frequency = np.array(sorted(motions))
    amplitude = np.array([_largest(problem, motions[at]) for at in frequency])
    exact = np.array([waves[at].amplitude for at in frequency])
    error = amplitude / exact - 1
    worst = int(np.argmax(np.abs(error)))
    room = (0, N_FREQUENCIES + len(NEAR_FREE) + 2 - len(frequency))
    padded = [np.pad(row, room, constant_values=np.nan) for row in (frequency, amplitude, exact)]
    peak_amplitude = float(path.peak_amplitude[top])
    return dict(
        frequency=padded[0],
        amplitude=padded[1],
        exact_amplitude=padded[2],
        peak_frequency=peak,
        peak_amplitude=peak_amplitude,
        exact_peak_frequency=summit,
        exact_peak_amplitude=waves[summit].amplitude,
        peak_error=peak_amplitude / waves[summit].amplitude - 1,
        peak_slips=np.int8(waves[summit].slips),
        worst_error=error[worst],
        worst_frequency=frequency[worst],
        slips=np.int8(len(slipping) > 0),
        periodicity=max(wave.periodicity for wave in waves.values()),
    )


def band(problem: sh.HarmonicBalance) -> tuple[float, float]:
    """Frequencies [Hz] from below the resonance with free to above that with stuck contacts."""
    blade = {name: np.mean(value) for name, value in problem.parameters.items()}
    free = blade["stiffness"] / blade["mass"]
    wave = np.sin(np.pi * blade["engine_order"] / problem.model.n_dof)
    stuck = free + 4 * wave**2 * blade["contact_stiffness"] / blade["mass"]
    low, high = np.sqrt([free, stuck]) / (2 * np.pi)
    return float(BELOW * low), float(ABOVE * high)


def _one_harmonic(problem: sh.HarmonicBalance, path: xr.Dataset, frequency: float) -> np.ndarray:
    """Unknowns of the balance at a ``frequency`` [Hz] on a path."""
    inside = np.isfinite(path.frequency.values)
    known = path.frequency.values[inside]
    unknowns = path.coefficient.values[inside].reshape(len(known), -1)
    start = np.array([np.interp(frequency, known, column) for column in unknowns.T])
    found = newton(partial(problem.evaluate, frequency=2 * np.pi * frequency), start)
    if not found.converged:
        raise ArithmeticError(f"{frequency:g} Hz: {found.status}")
    return found.unknowns


def _largest(problem: sh.HarmonicBalance, unknowns: np.ndarray) -> float:
    return float(np.linalg.norm(problem.layout.coefficients(unknowns), axis=1).max())


def exact_peak(
    problem: sh.HarmonicBalance,
    ends: tuple[float, float],
    waves: dict[float, Wave],
    balanced: Callable[[float], np.ndarray],
) -> float:
    """Frequency [Hz] of the largest exact response between two ends, near the largest one known.

    The motions on the way join ``waves``; ``balanced`` gives the unknowns of one harmonic at a
    frequency.
    """

    def inverse_square(frequency: float) -> float:
        """Nearly a parabola, as for a linear resonance; relative to the largest known response."""
        at = float(np.clip(frequency, *ends))
        if at not in waves:
            nearest = min(waves, key=lambda known: abs(known - at))
            start = balanced_state(problem, balanced(at))
            waves[at] = travelling_wave(problem, at, waves[nearest].state, start)
        return (largest / waves[at].amplitude) ** 2

    top = max(waves, key=lambda at: waves[at].amplitude)
    largest = waves[top].amplitude
    below = max((at for at in waves if at < top), default=ends[0])
    above = min((at for at in waves if at > top), default=ends[1])
    if below < top < above and min(inverse_square(below), inverse_square(above)) > 1:
        minimize_scalar(inverse_square, bracket=(below, top, above), tol=CLOSE)
    return max(waves, key=lambda at: waves[at].amplitude)


def compute(progress: bool = True) -> xr.Dataset:
    """Amplitudes and errors of one harmonic by engine order and normal load."""
    base = fig08.problem()
    shape = len(ENGINE_ORDERS), len(NORMAL_LOADS)
    pairs = [dict(engine_order=n, normal_load=load) for n in ENGINE_ORDERS for load in NORMAL_LOADS]
    with tqdm(pairs, disable=not progress, file=sys.stderr) as bar:
        cells = [cell(base.with_parameters(**pair)) for pair in bar]
    dims = ("engine_order", "normal_load")
    at_points = (*dims, "point")
    described = {
        "frequency": (
            at_points,
            "Hz",
            "excitation frequency, as many as were needed",
        ),
        "amplitude": (at_points, "m", "largest displacement, one harmonic"),
        "exact_amplitude": (at_points, "m", "largest displacement, exact"),
        "peak_frequency": (dims, "Hz", "frequency of the peak, one harmonic"),
        "peak_amplitude": (dims, "m", "displacement at the peak, one harmonic"),
        "exact_peak_frequency": (
            dims,
            "Hz",
            "frequency of the largest response of the band, exact",
        ),
        "exact_peak_amplitude": (dims, "m", "largest displacement of the band, exact"),
        "peak_error": (dims, "1", "relative error of the peak with one harmonic"),
        "peak_slips": (dims, "1", "whether contacts slip at the exact peak"),
        "worst_error": (dims, "1", "largest relative error at one frequency with one harmonic"),
        "worst_frequency": (dims, "Hz", "frequency of the largest error"),
        "slips": (dims, "1", "whether contacts slip anywhere in the band"),
        "periodicity": (dims, "1", "residual of periodicity of the exact motions, norm of energy"),
    }
    variables = {}
    for name, (axes, units, long_name) in described.items():
        stacked = np.array([result[name] for result in cells])
        stacked = stacked.reshape(*shape, *stacked.shape[1:])
        variables[name] = (axes, stacked, {"units": units, "long_name": long_name})
    coordinates = {
        "engine_order": (
            "engine_order",
            list(ENGINE_ORDERS),
            {"units": "1", "long_name": "engine order"},
        ),
        "normal_load": (
            "normal_load",
            list(NORMAL_LOADS),
            {"units": "N", "long_name": "normal load of the contact"},
        ),
    }
    attributes = {
        "title": "Where one harmonic is enough on the tuned ring of 13 blades",
        "references": "E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013, hal-00941429",
        "symhbm_schema": 1,
        "symhbm_version": version("symhbm"),
    }
    return xr.Dataset(variables, coordinates, attributes)


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the error of the peak, and the worst at one frequency, over load and engine order."""
    with sh.plot.panels(1, 2, sharey=True, sharex=True, size=(11.0, 5.6)) as (figure, axes):
        for ax in axes:
            ax.grid(False)
        norm = LogNorm(*COLOURS)
        draw_map(axes[0], dataset.peak_error, dataset.peak_slips, norm)
        draw_map(axes[1], dataset.worst_error, dataset.slips, norm)
        axes[0].set_title("largest responses of the band, each at its own frequency", fontsize=10)
        axes[1].set_title("responses at one frequency, the worst one found", fontsize=10)
        axes[0].set_ylabel("normal load $F_n$ [N]")
        for ax in axes:
            ax.set_xlabel("engine order")
        bar = figure.colorbar(
            plt.cm.ScalarMappable(norm, COLOUR_MAP), ax=axes, extend="both", pad=0.02
        )
        bar.set_label("error of one harmonic [%]")
        bar.set_ticks([1e-4, 1e-3, 1e-2, 1e-1, 1], labels=["0.01", "0.1", "1", "10", "100"])
        bar.ax.minorticks_off()
        handles: list[Any] = []
        labels = []
        for level, lines in sorted(LEVELS.items()):
            layers = [Line2D([], [], color=color, linewidth=width) for color, width in lines]
            handles.append(tuple(layers))
            labels.append(f"border of {100 * level:g} %")
        if not (dataset.peak_slips.all() and dataset.slips.all()):
            handles.append(Line2D([], [], linestyle="", marker="$S$", color="black"))
            labels.append("nothing slips: one harmonic is exact")
        look: Any = dict(handler_map={tuple: HandlerTuple(ndivide=1, pad=0)})
        figure.legend(handles, labels, loc="outside lower center", ncols=len(handles), **look)
        figure.suptitle(
            "Tuned ring of 13 blades: error of the amplitude with one harmonic, in %\n"
            "(+ too high, \N{MINUS SIGN} too low; "
            f"from {BELOW:g} of the free to {ABOVE:g} of the stuck resonance)",
            fontsize=11,
        )
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Peaks of the reference."""
    rows = []
    for curve in json.loads(REFERENCE.read_text())["ring_EO_1_3_6_Fn100"]:
        label = f"EO = {curve['EO']}, F_n = {curve['Fn']:g} N"
        here = dict(engine_order=curve["EO"], normal_load=curve["Fn"])
        cell = dataset.sel(here, method="nearest", tolerance=1e-9)
        rows += [
            Landmark(
                f"peak with one harmonic, {label}",
                float(cell.peak_amplitude),
                float(curve["hbm1_peak_X"]),
                "m",
                Source.CLOSED_FORM,
                EXACT_DIGITS,
            ),
            # The top of a parabola: 3e-5 of the frequency is a hundredth of a half-width or less.
            Landmark(
                f"exact peak, {label}",
                float(cell.exact_peak_amplitude),
                float(curve["exact_peak_x"]),
                "m",
                Source.EXACT,
                1e-6,
            ),
        ]
    return rows


def findings(dataset: xr.Dataset) -> list[Finding]:
    """Where one harmonic errs most."""
    rows = []
    for name, error in (("peak", dataset.peak_error), ("response", dataset.worst_error)):
        at = error.stack(cell=error.dims)
        at = at[int(np.abs(at.values).argmax())]
        rows.append(
            Finding(
                f"On the ring, one harmonic errs by more than {VISIBLE:g} dB in a {name}",
                f"by {100 * float(at):+.3g} % under EO {int(at.engine_order)} with "
                f"{float(at.normal_load):.3g} N, where it is worst",
                not suffices(1 + float(at)),
            )
        )
    return rows


if __name__ == "__main__":
    run(NAME, compute, draw)
