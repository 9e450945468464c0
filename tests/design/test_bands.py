"""Designs of random bands, and of several harmonics, against grids of whole responses."""

import numpy as np
import pytest
from designs import any_status, largest_responses, lowest_of_grid
from quick import quick_first

import symhbm as sh

SEEDS = [1025, 1004, 1002, *(seed for seed in range(1000, 1043) if seed not in (1025, 1004, 1002))]
"""Of 1015, 1024 and 1025 three starts found 3.5, 2.5 and 0.2 dB more than a grid."""
HIGHER = 0.05
"""dB that a design may be above a grid: none was by more than 1e-4 dB."""


def random_structure(rng):
    """A blade, a chain of two or three masses or a ring, with one kind of contact."""
    kind = str(rng.choice(["blade", "chain", "ring"]))
    friction = rng.uniform(0.2, 0.8)
    stiffness = 1e4 * 10 ** rng.uniform(-0.7, 1)
    contact = dict(contact_stiffness=stiffness, friction_coefficient=friction, normal_load=3.0)
    if kind == "blade":
        model = sh.single_blade(mass=1, stiffness=1e4, damping=rng.uniform(0.2, 4), **contact)
        return sh.HarmonicBalance(model, sh.forces.PointForce())
    if kind == "ring":
        n = int(rng.choice([3, 5, 12]))
        order = int(rng.integers(1, (n - 1) // 2 + 1))
        model = sh.bladed_disk(n, mass=1, stiffness=1e4, damping=rng.uniform(0.3, 4), **contact)
        return sh.HarmonicBalance(model, sh.forces.EngineOrder(order))
    n = int(rng.integers(2, 4))
    springs = 1e4 * rng.uniform(0.5, 2, n)
    diagonal = springs + np.append(springs[1:], 0)
    matrix = np.diag(diagonal) - np.diag(springs[1:], 1) - np.diag(springs[1:], -1)
    masses = np.diag(rng.uniform(0.5, 1.5, n))
    damping = rng.uniform(1e-5, 3e-4) * matrix
    at = int(rng.integers(0, n))
    pairs = [(at,)] if rng.random() < 0.6 else [(0, 1)]
    model = sh.Model(masses, damping, matrix, pairs, **contact)
    return sh.HarmonicBalance(model, sh.forces.PointForce(place=int(rng.integers(0, n))))


def random_design(seed):
    """Problem, bounds by name and bands, whose ends are near where the best of 15 loads peaks."""
    rng = np.random.default_rng(seed)
    problem = random_structure(rng)
    names = ["normal_load"]
    if int(rng.integers(1, 3)) == 2:
        names.append(str(rng.choice(["contact_stiffness", "friction_coefficient"])))
    elif rng.random() < 0.2:
        names = ["contact_stiffness"]
    stiffness = float(np.mean(problem.parameters["contact_stiffness"]))
    ranges = {
        "normal_load": (0.2, 40.0),
        "contact_stiffness": (stiffness / 4, stiffness * 4),
        "friction_coefficient": (0.1, 0.9),
    }
    loads = {"normal_load": np.geomspace(0.2, 40, 15)}
    wide = sh.frf(problem, (5.0, 150.0), over=loads, progress=False)
    best = wide.isel(normal_load=int(np.argmin(wide.peak_amplitude.max("peak").values)))
    peaks, heights = best.peak_frequency.values, best.peak_amplitude.values
    peak = float(rng.choice(peaks[np.isfinite(peaks) & (heights > 0.4 * np.nanmax(heights))]))
    end = peak * (1 + rng.normal(0, 0.04))
    which, width = rng.integers(0, 4), rng.uniform(0.1, 0.5)
    if which == 0:
        bands = [(end * (1 - width), end)]
    elif which == 1:
        bands = [(end, end * (1 + width))]
    elif which == 2:
        bands = [(end * (1 - width), end), (end * (1 + rng.uniform(0.02, 0.2)), end * 1.6)]
    else:
        below, above = rng.uniform((0.5, 0.9), (0.9, 1)), rng.uniform((1, 1.12), (1.1, 1.6))
        bands = [tuple(peak * below), tuple(peak * above)]
    return problem, {name: ranges[name] for name in names}, np.round(bands, 4).tolist()


@pytest.mark.slow
@pytest.mark.parametrize("seed", quick_first(SEEDS, 1))
def test_no_design_of_a_grid_is_better(seed):
    problem, bounds, bands = random_design(seed)
    with any_status():
        best = sh.minimise_peak(problem, [*bounds], bounds, bands, progress=False)
    found = best.design_amplitude.item()
    values = {
        name: [value] for name, value in zip(bounds, best.design_value.values.tolist(), strict=True)
    }
    again = largest_responses(problem, values, bands)
    assert [*again.values()] == pytest.approx([found], rel=1e-9)
    assert 20 * np.log10(found / lowest_of_grid(problem, bounds, bands)) < HIGHER


def chain(harmonics):
    """Two masses, rubbing on each other."""
    matrix = np.array([[2.2e4, -1e4], [-1e4, 1e4]])
    model = sh.Model(np.eye(2), 2e-4 * matrix, matrix, [(0, 1)], 2e4, 0.5, 3.0)
    return sh.HarmonicBalance(model, sh.forces.PointForce(place=1), harmonics)
