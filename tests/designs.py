"""Problems of the design tests, small enough to be solved many times."""

import re
import warnings
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from itertools import product

import numpy as np
from scipy.optimize import minimize_scalar

import symhbm as sh
from studies.closed_form import OneBlade
from symhbm.design.cases import Maxima, Work

BAND = (5.0, 40.0)
"""Frequencies [Hz] that hold the resonances of the blade, stuck at 22.5 and free at 15.9."""
BOUNDS = (0.05, 500.0)
"""Normal loads [N] from nearly free to stuck: 1 to 10000 times what one blade needs at least."""
BEST_LOAD = 3.088578873912
BEST_AMPLITUDE = 3.082288527639e-4
BEST_FREQUENCY = 19.496559186804
"""Optimum of the blade with one harmonic, N, m and Hz, from its closed form."""


def blade(harmonics=(1,), force=1.0, **parameters):
    """One blade with a friction damper to the ground."""
    values = dict(mass=1.0, stiffness=1e4, damping=0.5)
    values |= dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=10.0)
    model = sh.single_blade(**(values | parameters))
    return sh.HarmonicBalance(model, sh.forces.PointForce(amplitude=force), harmonics)


def ring(n_blades=13, contact_stiffness=1e6, engine_order=3, harmonics=(1,), **parameters):
    """A ring of blades under an engine order."""
    values = dict(mass=1.0, stiffness=1e4, damping=0.5, contact_stiffness=contact_stiffness)
    values |= dict(friction_coefficient=0.5, normal_load=10.0)
    model = sh.bladed_disk(n_blades, **(values | parameters))
    return sh.HarmonicBalance(model, sh.forces.EngineOrder(engine_order, amplitude=1.0), harmonics)


def mistuned(n_blades=13, order=3, seed=2013, **spreads):
    """A ring whose contacts differ, by shares of their friction and stiffness and of more."""
    problem = ring(n_blades, engine_order=order)
    spreads = dict(friction_coefficient=0.4, contact_stiffness=0.2) | spreads
    draws = sh.mistuning.uniform(problem.model, n_samples=1, seed=seed, **spreads)
    return problem.with_parameters(**{name: draws[name].values[0] for name in spreads})


def uneven(n_blades, force, harmonics=(1,), seed=None, **values):
    """A ring of which all values differ from blade to blade, about those of the other rings."""
    rng = np.random.default_rng(n_blades if seed is None else seed)
    middle = dict(mass=1.0, stiffness=1e4, damping=0.5, contact_stiffness=1e6)
    middle |= dict(friction_coefficient=0.5, normal_load=10.0) | values
    spreads = dict(mass=0.05, stiffness=0.1, damping=0.2)
    spreads |= dict(contact_stiffness=0.2, friction_coefficient=0.4, normal_load=0.3)
    drawn = {name: 1 + rng.uniform(-spread, spread, n_blades) for name, spread in spreads.items()}
    disk = sh.bladed_disk(n_blades, **{name: middle[name] * drawn[name] for name in spreads})
    return sh.HarmonicBalance(disk, force, harmonics)


def closed_peak(load, contact_stiffness=1e4, ratio=1.0):
    """Peak of a blade [m] in closed form."""
    return OneBlade(1.0, 0.5, 1e4, contact_stiffness, 0.5 * load, 1.0, ratio).peak()[0]


def minimum(value, bounds):
    """Where a function of a load is least, to half of its digits, and that value."""
    found = minimize_scalar(
        lambda logarithm: value(float(np.exp(logarithm))),
        bounds=np.log(bounds),
        method="bounded",
        options={"xatol": 1e-9},
    )
    return float(np.exp(found.x)), found.fun


def design(
    problem, parameters="normal_load", bounds=BOUNDS, frequency_band=BAND, over=None, **options
):
    """The design from few starts, silent."""
    options = dict(n_starts=1, progress=False) | options
    with any_status():
        return sh.minimise_peak(problem, parameters, bounds, frequency_band, over, **options)


def failing(monkeypatch, fails):
    """Let the responses at some loads not be followed."""
    call = Work.__call__

    def some(self, number, x, previous):
        if fails(float(np.exp(x[0]))):
            return Maxima([], np.inf, True, 0, str(sh.Status.MINIMUM_STEP), True)
        return call(self, number, x, previous)

    monkeypatch.setattr(Work, "__call__", some)


class Failing(ThreadPoolExecutor):
    """Takes every task and computes none."""

    def submit(self, *args, **kwargs):
        future = Future()
        future.set_exception(MemoryError("no memory"))
        return future


@contextmanager
def any_status():
    """Without the warnings of designs, which are their statuses."""
    with warnings.catch_warnings():
        for status in sh.Status:
            warnings.filterwarnings("ignore", re.escape(str(status)))
        yield


def lowest_of_grid(problem, bounds, bands, n=(41, 13), rounds=2):
    """The lowest band maximum over a grid of designs, and over a finer one around it."""
    names, best = [*bounds], (np.inf, {})
    low, high = (np.log([bounds[name][end] for name in names]) for end in (0, 1))
    first, last = low, high
    for _ in range(rounds):
        count = n[len(names) - 1]
        values = np.exp(np.linspace(first, last, count)).T
        designs = dict(zip(names, values, strict=True))
        for index, height in largest_responses(problem, designs, bands).items():
            if height < best[0]:
                best = height, values[np.arange(len(names)), index]
        step = 1.5 * (last - first) / (count - 1)
        centre = np.log(best[1])
        first, last = np.maximum(low, centre - step), np.minimum(high, centre + step)
    return best[0]


def largest_responses(problem, designs, bands):
    """Largest responses in bands by the index of a design, of those followed to every end."""
    tops = []
    for band in bands:
        response = sh.frf(problem, band, over=designs, progress=False)
        amplitude = response.amplitude.max([d for d in response.amplitude.dims if d not in designs])
        if response.sizes["peak"]:
            amplitude = np.fmax(amplitude, response.peak_amplitude.max("peak").fillna(0))
        ended = [sh.Status.REACHED_END, sh.Status.OTHER_SOLUTIONS, sh.Status.BRANCH_POINTS]
        amplitude = amplitude.where(response.status.isin([*map(str, ended)]))
        tops.append(amplitude.transpose(*designs).values)
    highest = np.max(tops, axis=0)
    indices = product(*(range(size) for size in highest.shape))
    return {index: highest[index] for index in indices if np.isfinite(highest[index])}
