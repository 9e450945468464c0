"""A blade with a stop: the response opens the contact, folds twice, and has three solutions.

One blade on a unilateral spring under a preload, `N = max(N0 + k_n x, 0)`. Where the amplitude is
above `N0 / k_n` the spring lets go for a part of the period, and the blade is softer: the resonance
leans towards low frequencies. Between two folds there are three motions at one frequency, the
middle one unstable.

The motion that opens once a period is known in time: between an opening and the next closing, and
from there to the next opening, the blade is linear. At a given share of the period that it is open
the speed and the phase of the force follow from linear equations, and the frequency from the size
of the force. Folds are where that frequency is largest and smallest over the share.
"""

from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.linalg import expm
from scipy.optimize import brentq, minimize_scalar

import symhbm as sh
from studies.landmark import Landmark, Source
from studies.run import run
from studies.smooth import DASHES, along
from symhbm.numerics import FloatArray

NAME = "gap_stop"
MASS, DAMPING, STIFFNESS = 1.0, 2.0, 1e4  # kg, N s/m, N/m
NORMAL_STIFFNESS, NORMAL_LOAD, FORCE = 2e4, 10.0, 5.0  # N/m, N, N
BAND = (10.0, 35.0)
HIGHEST = 25
SEVERAL = 21.5  # Hz
"""Frequency at which there are three solutions."""
SHARE_ERROR, FOLD_ERROR = 1e-5, 1e-8
"""Relative errors by the harmonics above 25; a fold is an extreme, which moves to second order."""
NEAR = 1e-3
"""How far [Hz, and of a share] an exact motion is sought from that of a balance."""
XATOL = {"xatol": 1e-10}


def problem(highest: int = HIGHEST) -> sh.HarmonicBalance:
    """Return the balance of the blade with harmonics from 0 to a highest one."""
    stop = sh.Gap(normal=(0,), normal_stiffness=NORMAL_STIFFNESS, normal_load=NORMAL_LOAD)
    blade = sh.Model([[MASS]], [[DAMPING]], [[STIFFNESS]], contacts={"stop": stop})
    return sh.HarmonicBalance(blade, sh.forces.PointForce(amplitude=FORCE), range(highest + 1))


def openings() -> FloatArray:
    """Frequencies [Hz] at which the closed blade moves by ``N0 / k_n``: it opens between them."""
    stiffness = STIFFNESS + NORMAL_STIFFNESS
    size = FORCE * NORMAL_STIFFNESS / NORMAL_LOAD
    powers = MASS**2, DAMPING**2 - 2 * MASS * stiffness, stiffness**2 - size**2
    return np.sort(np.sqrt(np.roots(powers))) / (2 * np.pi)


def maps(omega: float, share: float) -> tuple[FloatArray, FloatArray]:
    """Return the maps of `(x, x', cos, sin, 1)` from an opening to the closing, and over a period.

    ``omega`` in rad/s. The latter is also that of small changes of `(x, x')`, as the force of the
    stop is continuous.
    """
    period = 2 * np.pi / omega
    pieces = []
    for stiffness, load, length in (
        (STIFFNESS, NORMAL_LOAD, share * period),
        (STIFFNESS + NORMAL_STIFFNESS, 0.0, (1 - share) * period),
    ):
        rate = np.zeros((5, 5))
        rate[0, 1], rate[2, 3], rate[3, 2] = 1, -omega, omega
        rate[1] = np.array([-stiffness, -DAMPING, 1.0, 0.0, load]) / MASS
        pieces.append(expm(rate * length))
    return pieces[0], pieces[1] @ pieces[0]


def excess(omega: float, share: float) -> float:
    """Logarithm of the force of the motion that opens once, for a share, over the given force."""
    first, whole = maps(omega, share)
    # Unknown: speed and both parts of the force at the opening, where x = -N0 / k_n.
    known = np.array([-NORMAL_LOAD / NORMAL_STIFFNESS, 0, 0, 0, 1])
    rows = np.array([first[0], whole[0], whole[1]])
    matrix = rows[:, 1:4] - [[0, 0, 0], [0, 0, 0], [1, 0, 0]]
    right = np.array([known[0], known[0], 0]) - rows @ known
    return float(np.log(np.linalg.norm(np.linalg.solve(matrix, right)[1:]) / FORCE))


def exact_share(frequency: float, near: float) -> float:
    """Share of the period that the exact motion is open, next to that of a balance."""
    around = partial(excess, 2 * np.pi * frequency)
    share: Any = brentq(around, near - NEAR, near + NEAR, xtol=1e-14)
    return float(share)


def exact_fold(frequency: float, share: float) -> float:
    """Frequency [Hz] of the fold of exact motions next to that of a balance.

    Over the share the force has an extreme there that is the given one.
    """
    ends, omega = (share - 10 * NEAR, share + 10 * NEAR), 2 * np.pi * frequency
    sign = np.sign(2 * excess(omega, share) - sum(excess(omega, end) for end in ends))

    def extreme(at: float) -> float:
        objective = lambda one: -sign * excess(2 * np.pi * at, one)  # noqa: E731
        found: Any = minimize_scalar(objective, bounds=ends, method="bounded", options=XATOL)
        return -sign * float(found.fun)

    found: Any = brentq(extreme, frequency - NEAR, frequency + NEAR, xtol=1e-12)
    return float(found)


def compute(progress: bool = True) -> xr.Dataset:
    """Response over the band, that with one harmonic, and the three solutions at one frequency."""
    response = sh.frf(problem(), BAND, progress=progress, throw=True)
    rough = sh.frf(problem(1), BAND, progress=progress, throw=True)
    several = sh.frf(problem(), BAND, at=[SEVERAL], progress=progress, throw=True)
    several = several.isel(frequency=0)
    units = {"units": "m", "long_name": "largest displacement, harmonics 0 and 1"}
    added: dict[str, tuple] = {
        "rough_frequency": (
            "rough_point",
            rough.frequency.values,
            {"units": "Hz", "long_name": "excitation frequency, harmonics 0 and 1"},
        ),
        "rough_amplitude": ("rough_point", rough.amplitude.values[:, 0], units),
    }
    for name in ("coefficient", "amplitude", "open_fraction"):
        value = several[name]
        added[f"solution_{name}"] = (value.dims, value.values, value.attrs)
    attributes = {"title": "A blade with a stop that opens"}
    return response.assign(added).assign_attrs(attributes)


def exact_solutions(dataset: xr.Dataset) -> list[tuple[float, float]]:
    """Open share and largest multiplier of exact motions next to the solutions, closed ones first.

    The multiplier is the growth of a small change over a period: above 1 a motion is unstable.
    """
    omega, found = 2 * np.pi * SEVERAL, []
    for share in np.sort(dataset.solution_open_fraction.values.ravel()):
        exact = exact_share(SEVERAL, share) if share else 0.0
        multipliers = np.linalg.eigvals(maps(omega, exact)[1][:2, :2])
        found.append((exact, float(np.abs(multipliers).max())))
    return found


def folds(dataset: xr.Dataset) -> list[tuple[float, float]]:
    """Frequencies [Hz] of the folds, the higher first, and open shares there."""
    at = dataset.event_frequency.values[dataset.event_kind.values == "fold"]
    places = [int(np.argmin(np.abs(dataset.frequency.values - one))) for one in at]
    return [(float(f), float(dataset.open_fraction[i, 0])) for f, i in zip(at, places, strict=True)]


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the response with its states, and the normal force of the three solutions."""
    with sh.plot.panels(1, 2, size=(11.0, 5.0), width_ratios=(1.4, 1)) as (figure, (left, right)):
        _draw_response(left, dataset)
        _draw_forces(right, dataset)
        figure.suptitle("A blade on a stop under a preload: it opens, folds, and has three motions")
    return figure


def _draw_response(ax: Axes, dataset: xr.Dataset) -> None:
    frequency, level = dataset.frequency.values, 1e3 * dataset.amplitude.values[:, 0]
    opens = dataset.open_fraction.values[:, 0] > 0
    back = np.diff(frequency) < 0
    drawn_frequency, drawn, at = along(dataset)
    rough = dataset.rough_frequency, 1e3 * dataset.rough_amplitude
    ax.semilogy(*rough, ":", color="0.55", linewidth=1, label="harmonics 0 and 1")
    for label, color, style, shown in (
        ("always closed", "tab:blue", DASHES, ~opens[:-1] | ~opens[1:]),
        ("opens", "tab:orange", "-", (opens[:-1] & opens[1:]) & ~back),
        ("opens, unstable", "tab:red", "--", back),
    ):
        part = shown[at]
        first, last = (np.append(part, False), np.append(False, part))
        line = np.where(first | last, 1e3 * drawn, np.nan)
        ax.semilogy(drawn_frequency, line, linestyle=style, color=color, label=label)
    solutions = 1e3 * dataset.solution_amplitude.values.ravel()
    ax.axvline(SEVERAL, color="0.6", linewidth=0.8, linestyle=(0, (1, 2)), zorder=1)
    ax.plot(np.full(len(solutions), SEVERAL), solutions, "ko", label=f"at {SEVERAL:g} Hz")
    for marker, kinds in (("D", ("fold",)), ("s", ("onset of opening", "end of opening"))):
        at = dataset.event_frequency.values[np.isin(dataset.event_kind.values, kinds)]
        places = [int(np.argmin(np.abs(frequency - one))) for one in at]
        look = dict(color="white", markeredgecolor="black", markersize=6)
        name = "folds" if kinds == ("fold",) else "opens and closes"
        ax.semilogy(frequency[places], level[places], marker, label=name, **look)  # type: ignore
    ax.set(xlim=(15, 35), xlabel="excitation frequency [Hz]", ylabel="largest displacement [mm]")
    ax.legend(loc="upper right", fontsize=9)


def _draw_forces(ax: Axes, dataset: xr.Dataset) -> None:
    angle, balance = np.linspace(0, 2 * np.pi, 1000), problem()
    values = balance.basis.values(angle)
    solutions = dataset.solution_coefficient.values.reshape(-1, HIGHEST + 1, 2)
    shares = dataset.solution_open_fraction.values.ravel()
    looks = ("always closed", "tab:blue", DASHES), ("unstable", "tab:red", "--")
    looks += (("stable", "tab:orange", "-"),)
    for i, (word, color, style) in zip(np.argsort(shares), looks, strict=True):
        pairs = solutions[i]
        motion = values @ np.concatenate([pairs[:1, 0], pairs[1:].ravel()])
        force = np.maximum(NORMAL_LOAD + NORMAL_STIFFNESS * motion, 0)
        label = f"{word}: open for {100 * shares[i]:.1f} %" if shares[i] else word
        ax.plot(angle, force, linestyle=style, color=color, label=label)
    ax.axhline(NORMAL_LOAD, color="0.6", linewidth=0.8, linestyle=(0, (1, 2)), zorder=1)
    ax.set_xticks(np.pi / 2 * np.arange(5), ["0", "π/2", "π", "3π/2", "2π"])
    ax.set(xlabel=r"angle $\tau = \omega t$ [rad]", ylabel="normal force of the stop [N]")
    ax.set_ylim(-5, 150)
    ax.set_title(f"the three motions at {SEVERAL:g} Hz", fontsize=10)
    ax.legend(loc="upper center", fontsize=9)


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Where it opens and folds, and how long it is open, against closed forms in time."""
    kinds, at = dataset.event_kind.values, dataset.event_frequency.values
    rows = []
    for kind, expected in zip(("onset of opening", "end of opening"), openings(), strict=True):
        [found] = at[kinds == kind]
        # Up to there the response is linear, and both are solved to round-off.
        row = f"{kind}, frequency", found, expected, "Hz", Source.CLOSED_FORM, 1e-10
        rows.append(Landmark(*row))
    for found, share in folds(dataset):
        row = "fold, frequency", found, exact_fold(found, share), "Hz", Source.EXACT, FOLD_ERROR
        rows.append(Landmark(*row))
    shares = np.sort(dataset.solution_open_fraction.values.ravel())
    exact = exact_solutions(dataset)
    rows.append(Landmark("solutions at 21.5 Hz", len(shares), 3, "", Source.EXACT, 0))
    unstable = sum(multiplier > 1 for _, multiplier in exact)
    rows.append(Landmark("unstable ones among them", unstable, 1, "", Source.EXACT, 0))
    for share, (expected, _) in zip(shares[1:], exact[1:], strict=True):
        name = "share of the period that one of them is open"
        rows.append(Landmark(name, share, expected, "", Source.EXACT, SHARE_ERROR))
    return rows


if __name__ == "__main__":
    run(NAME, compute, draw)
