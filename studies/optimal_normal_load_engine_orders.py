"""Design: the normal load that flattens the peak of the tuned disk, under engine orders 1 to 6.

With one harmonic the disk under an engine order is one blade, and the best load a closed form: the
contacts between blades move `2 sin(pi EO / N)` times as much as the blades, so low orders want more
load and keep higher peaks. Harmonics up to 5 tell more: under engine orders 1 and 2 the third
harmonic of the friction force excites the resonance of three times as many nodal diameters, the
best load is a third lighter, and there two peaks are equally high. It stands at a cliff: with 5 %
less load the peak of order 1 is 5.7 dB higher, with 5 % more 0.3 dB. The load that one harmonic
takes for the best costs 2.5 dB under order 1 and 1.5 dB under order 2.

One load for all orders, with one harmonic, is that of order 1: its lowest peak is above those of
all others at that load, so only one peak is active. Where order 3 is excited eight times as hard,
two peaks hold the design: as the load grows one falls and the other rises. Loads that may differ
from contact to contact, under order 3, are not better than the common one as far as was searched:
equal loads are a strict local minimum.
"""

from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import brentq

import symhbm as sh
from studies import fig08_engine_orders as fig08
from studies.claim import Claim, Finding
from studies.companions import labelled, largest_peak, of_one_harmonic
from studies.landmark import Landmark, Source
from studies.load_curves import PUBLISHED_LOAD, blade, decibels, draw
from studies.run import run

NAME = "optimal_normal_load_engine_orders"
SETS = ((1,), (1, 3, 5))
"""Harmonics; the first set has closed forms, the responses are those of the last."""
ENGINE_ORDERS = (1, 2, 3, 4, 5, 6)
BAND = (5, 350)  # Hz
BOUNDS = (0.1, 1000)
"""Normal loads [N] between which the best ones are sought."""
NEAR = (0.8, 0.9, 0.95, 1.0, 1.05, 1.1, 1.2)
FAR = (0.6, 1.6, 2.5, 4.0, 6.0, 10.0)
"""Loads over the best one at which whole responses are followed, independent of the search."""
PUBLISHED_ORDER = 3
"""Engine order of the source's Fig. 12, for which it states a load."""
DIFFERENT = 3
"""Engine order with a load for every contact."""
LOUD = {"engine_order": [1, 3], "force_amplitude": [1.0, 8.0]}
"""Two cases whose highest peaks are both active."""
ACCURACY = 1e-3
"""Truncation error asked for where a peak is compared with that of enough harmonics."""
FAILS = (1, 2)
"""Engine orders at which one harmonic does not suffice at its best load."""
TRUNCATION = 0.01
"""Error of the peaks with harmonics up to 5 at their best loads."""
ROUND_OFF = 1e-12
"""Relative difference of peaks that are solved for twice."""


def problem(harmonics: tuple[int, ...], **parameters: float) -> sh.HarmonicBalance:
    """Return the disk of Fig. 8, with the load of Fig. 12."""
    return fig08.problem(harmonics).with_parameters(normal_load=PUBLISHED_LOAD, **parameters)


def optimum(task: tuple[tuple[int, ...], float], **options: Any) -> xr.Dataset:
    """Return the lowest peak over the normal load, of some harmonics at an engine order."""
    harmonics, order = task
    disk = problem(harmonics, engine_order=order)
    options = dict(throw=True, progress=False) | options
    return sh.minimise_peak(disk, "normal_load", BOUNDS, BAND, **options)


def peak(task: tuple[tuple[int, ...], float, float], **options: Any) -> float:
    """Return the largest peak [m] of some harmonics at an engine order and a normal load [N]."""
    harmonics, order, load = task
    disk = problem(harmonics, engine_order=order).with_parameters(normal_load=load)
    found = sh.frf(disk, BAND, throw=True, progress=False, **options)
    return float(largest_peak(found).peak_amplitude)


def compute(
    progress: bool = True,
    sets: tuple[tuple[int, ...], ...] = SETS,
    engine_orders: tuple[int, ...] = ENGINE_ORDERS,
    ratios: Iterable[float] = (*FAR, *NEAR),
    different: int | None = DIFFERENT,
) -> xr.Dataset:
    """Find the best load of every set of harmonics and engine order, of all, of two, and of each.

    ``ratios`` are those of the loads over the best one at which peaks are computed as well;
    ``different`` is the engine order with a load for every contact, None for no such design.
    """
    ratio = np.array(sorted(ratios))
    cells = [(harmonics, order) for harmonics in sets for order in engine_orders]
    shape = len(sets), len(engine_orders)
    loud = {name: xr.DataArray(values, dims="case") for name, values in LOUD.items()}
    one = sets[0]
    with ProcessPoolExecutor() as pool:
        # The longest come first: nothing is left to wait for at the end.
        unlike = different and pool.submit(optimum, (one, different), vary="each", n_starts=1)
        every = pool.submit(optimum, (one, 1), over={"engine_order": list(engine_orders)})
        two = pool.submit(optimum, (one, 1), over=loud)
        found = list(pool.map(optimum, cells[::-1]))[::-1]
        best = _each(found, "design_value", shape)
        at = dict(zip(cells, best.ravel(), strict=True))
        tight = pool.map(partial(peak, accuracy=ACCURACY), [(one, o, at[h, o]) for h, o in cells])
        usual = pool.map(peak, [(*cell, PUBLISHED_LOAD) for cell in cells])
        last = sets[-1]
        around = pool.map(peak, [(last, o, r * at[last, o]) for o in engine_orders for r in ratio])
        over = {
            "engine_order": list(engine_orders),
            "normal_load": xr.DataArray(best[-1], dims="engine_order"),
        }
        curves = sh.frf(
            problem(last), BAND, over=over, executor=pool, throw=True, progress=progress
        )
        table = {
            "accurate_amplitude": np.reshape(list(tight), shape),
            "published_load_amplitude": np.reshape(list(usual), shape),
            "scan_peak_amplitude": np.reshape(list(around), (shape[1], len(ratio))),
        }
    row, both = "highest_harmonic", ("highest_harmonic", "engine_order")
    added: dict[str, tuple[Any, Any, str, str]] = {
        row: (row, [max(harmonics) for harmonics in sets], "1", "highest harmonic"),
        "optimal_normal_load": (both, best, "N", "normal load of the lowest peak"),
        "optimal_amplitude": (both, _each(found, "design_amplitude", shape), "m", "lowest peak"),
        "optimal_frequency": (both, _each(found, "active_frequency", shape), "Hz", "its frequency"),
        "active_peaks": (
            both,
            np.reshape([one.sizes["active"] for one in found], shape),
            "1",
            "peaks that hold the design",
        ),
        "accurate_amplitude": (
            both,
            table["accurate_amplitude"],
            "m",
            "peak with enough harmonics at the optimal load",
        ),
        "published_load_amplitude": (
            both,
            table["published_load_amplitude"],
            "m",
            "largest peak at the load of the source",
        ),
        "scan_ratio": ("scan", ratio, "1", "normal load over the optimal one"),
        "scan_peak_amplitude": (
            ("engine_order", "scan"),
            table["scan_peak_amplitude"],
            "m",
            "largest peak",
        ),
        **_design("all_orders", every.result()),
        **_design("two_cases", two.result()),
    }
    if unlike:
        added |= _design("unlike", unlike.result())
    return curves.assign(
        {
            name: (dims, values, {"units": units, "long_name": long_name})
            for name, (dims, values, units, long_name) in added.items()
        }
    )


def _each(found: list[xr.Dataset], name: str, shape: tuple[int, int]) -> np.ndarray:
    return np.reshape([one[name].values.flat[0] for one in found], shape)


def _design(name: str, found: xr.Dataset) -> dict[str, tuple[Any, Any, str, str]]:
    """A design of several cases or variables, and what holds it."""
    active = f"{name}_active"
    return {
        f"{name}_normal_load": (f"{name}_variable", found.design_value.values, "N", "best load"),
        f"{name}_amplitude": ((), float(found.design_amplitude), "m", "lowest highest peak"),
        f"{name}_active_case": (active, found.active_case.values, "1", "case of the active peak"),
        f"{name}_active_amplitude": (active, found.active_amplitude.values, "m", "active peak"),
        f"{name}_active_multiplier": (active, found.active_multiplier.values, "1", "its weight"),
        f"{name}_certificate": ((), found.certificate.item(), "1", "what was checked and what not"),
    }


def peak_of_two(dataset: xr.Dataset) -> tuple[float, float, float]:
    """Load [N] at which the two loud cases peak alike, their peak [m], weight of the first."""
    cases = [
        replace(blade(dataset, order), force=force)
        for order, force in zip(*LOUD.values(), strict=True)
    ]

    def peaks(limit: float) -> np.ndarray:
        return np.array([replace(case, slip_limit=limit).peak()[0] for case in cases])

    # Between the limits at which either is lowest, one falls and the other rises.
    ends = sorted(case.optimum()[0] for case in cases)
    limit: Any = brentq(lambda at: float(np.subtract(*peaks(at))), *ends, xtol=1e-300)
    step = 1e-5 * limit
    first, second = peaks(limit + step) - peaks(limit - step)
    mu = float(dataset.friction_coefficient.mean())
    return float(limit) / mu, float(peaks(limit)[0]), float(second / (second - first))


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Optima beside closed forms and scans, and what holds the designs of several peaks."""
    return [
        *_closed_forms(dataset),
        *_scans(dataset),
        *_several(dataset),
    ]


def _closed_forms(dataset: xr.Dataset) -> list[Landmark]:
    one, mu = dataset.isel(highest_harmonic=0), float(dataset.friction_coefficient.mean())
    rows = []
    for order in dataset.engine_order.values:
        closed, found = blade(dataset, order), one.sel(engine_order=order)
        limit, amplitude, frequency = closed.optimum()
        for name, value, exact, unit in (
            ("best normal load", found.optimal_normal_load, limit / mu, "N"),
            ("its peak", found.optimal_amplitude, amplitude, "m"),
            ("its resonance", found.optimal_frequency, frequency, "Hz"),
        ):
            label = f"{name}, EO = {order}, one harmonic"
            rows.append(Landmark(label, float(value), exact, unit, Source.CLOSED_FORM, 1e-9))
        gain = decibels(closed.peak()[0] / amplitude)
        below = decibels(found.published_load_amplitude / found.optimal_amplitude)
        label = f"how far the lowest peak is below that at {PUBLISHED_LOAD:g} N, EO = {order}"
        rows.append(Landmark(label, float(below), float(gain), "dB", Source.CLOSED_FORM, 1e-9))
    return rows


def _scans(dataset: xr.Dataset) -> list[Landmark]:
    last = dataset.isel(highest_harmonic=-1)
    followed = largest_peak(dataset).peak_amplitude
    lower = dataset.scan_peak_amplitude < last.optimal_amplitude * (1 - ROUND_OFF)
    highest = int(last.highest_harmonic)
    rows = [
        Landmark(
            f"loads about the best ones with a lower peak, harmonics up to {highest}",
            int(lower.sum()),
            0,
            "",
            Source.EXACT,
            0,
        )
    ]
    for order in dataset.engine_order.values:
        place = dict(engine_order=order)
        optimum = float(last.optimal_amplitude.sel(place))
        label = f"the lowest peak, EO = {order}, harmonics up to {highest}"
        rows += [
            Landmark(
                f"{label}, followed anew",
                optimum,
                float(followed.sel(place)),
                "m",
                Source.EXACT,
                ROUND_OFF,
            ),
            Landmark(
                f"{label}, beside that with enough",
                optimum,
                float(last.accurate_amplitude.sel(place)),
                "m",
                Source.EXACT,
                TRUNCATION,
            ),
        ]
    return rows


def claims(dataset: xr.Dataset) -> list[Claim]:
    """What the source says of the best load of this disk, before its Fig. 12."""
    one = dataset.isel(highest_harmonic=0).sel(engine_order=PUBLISHED_ORDER)
    load, lowest = float(one.optimal_normal_load), float(one.optimal_amplitude)
    gain = float(decibels(float(one.published_load_amplitude) / lowest))
    return [
        Claim(
            "With k_d = 1e6 N/m, the efficiency in terms of peak flattening is obtained for about "
            f"{PUBLISHED_LOAD:g} N",
            f"section on mistuning (EO = {PUBLISHED_ORDER})",
            f"the lowest peak is at {load:.2f} N, {gain:.1f} dB below that at {PUBLISHED_LOAD:g} N",
            abs(load / PUBLISHED_LOAD - 1) < 0.5,
            False,
        )
    ]


def findings(dataset: xr.Dataset) -> list[Finding]:
    """How good one harmonic is at the load that it takes for the best."""
    one = dataset.isel(highest_harmonic=0)
    ratios = (one.optimal_amplitude / one.accurate_amplitude).values.tolist()
    return [
        of_one_harmonic(ratio, f"{labelled('engine_order', order)}, best load", order in FAILS)
        for order, ratio in zip(dataset.engine_order.values.tolist(), ratios, strict=True)
    ]


def _several(dataset: xr.Dataset) -> list[Landmark]:
    mu = float(dataset.friction_coefficient.mean())
    lowest = int(dataset.engine_order.values.min())
    limit, amplitude, _ = blade(dataset, lowest).optimum()
    load, equal, weight = peak_of_two(dataset)
    active = dataset.two_cases_active_amplitude.values
    rows = [
        Landmark(
            f"one load for all engine orders, beside the best of EO = {lowest}",
            float(dataset.all_orders_normal_load[0]),
            limit / mu,
            "N",
            Source.CLOSED_FORM,
            1e-9,
        ),
        Landmark(
            "highest peak of all engine orders at that load",
            float(dataset.all_orders_amplitude),
            amplitude,
            "m",
            Source.CLOSED_FORM,
            1e-9,
        ),
        Landmark(
            "peaks that hold it",
            dataset.sizes["all_orders_active"],
            1,
            "",
            Source.CLOSED_FORM,
            0,
        ),
        Landmark("peaks that hold the load of two cases", len(active), 2, "", Source.EXACT, 0),
        Landmark(
            "difference of both peaks, relative",
            float(np.ptp(active) / active.max()),
            0,
            "",
            Source.CLOSED_FORM,
            1e-8,
        ),
        Landmark(
            "load of two cases",
            float(dataset.two_cases_normal_load[0]),
            load,
            "N",
            Source.CLOSED_FORM,
            1e-9,
        ),
        Landmark(
            "highest peak of two cases",
            float(dataset.two_cases_amplitude),
            equal,
            "m",
            Source.CLOSED_FORM,
            1e-9,
        ),
        # Central differences: their error is the square of a step of 1e-5.
        Landmark(
            "weight of the first of both peaks",
            float(dataset.two_cases_active_multiplier[int(dataset.two_cases_active_case[0] == 1)]),
            weight,
            "",
            Source.CLOSED_FORM,
            1e-6,
        ),
    ]
    if "unlike_amplitude" in dataset:
        alike = dataset.optimal_amplitude.sel(engine_order=DIFFERENT).isel(highest_harmonic=0)
        rows.append(
            Landmark(
                "a load for every contact: lowest peak beside that of one load for all",
                float(dataset.unlike_amplitude),
                float(alike),
                "m",
                Source.EXACT,
                ROUND_OFF,
            )
        )
    return rows


if __name__ == "__main__":
    run(NAME, compute, draw)
