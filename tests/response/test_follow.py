"""Responses over any parameter at one frequency, against closed forms and single points."""

from functools import cache

import numpy as np
import pytest
import xarray as xr
from closed_forms import OneBlade
from scipy.optimize import brentq, minimize_scalar

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig08_engine_orders as fig08
from symhbm.model.contacts.coulomb.located import locate
from symhbm.model.contacts.coulomb.sampled import locate_sampled
from symhbm.numerics.fourier import FourierBasis

TWO_PI = 2 * np.pi
MU = 0.5


def blade_amplitude(blade, frequency):
    """The one amplitude at a frequency [Hz]: a root of the closed form."""
    top = 2 * blade.force / (blade.damping * TWO_PI * frequency)
    return float(
        brentq(
            lambda a: np.polyval(blade.polynomial(a), TWO_PI * frequency),
            0.0,
            top,
            xtol=1e-300,
            rtol=1e-15,
        )
    )


def blade_with(**changes):
    """The closed form of the blade of Fig. 3 at 100 N, with other values of named parameters."""
    values = dict(
        mass=1.0,
        damping=0.5,
        stiffness=1e4,
        contact_stiffness=1e4,
        friction_coefficient=MU,
        normal_load=100.0,
        force_amplitude=1.0,
    )
    values |= changes
    limit = values.pop("friction_coefficient") * values.pop("normal_load")
    force = values.pop("force_amplitude")
    return OneBlade(**values, slip_limit=limit, force=force)


def stuck_stiffness(frequency, ratio=1.0, contact_stiffness=1e4):
    """Magnitude of the dynamic stiffness with the contact stuck [N/m]."""
    omega = TWO_PI * frequency
    return float(np.hypot(1e4 + ratio**2 * contact_stiffness - omega**2, 0.5 * omega))


def both_ways(problem, parameter, band, **options):
    up = sh.follow(problem, parameter, band, throw=True, **options)
    down = sh.follow(problem, parameter, band[::-1], throw=True, **options)
    return up, down


def mistuned_ring(n_blades=5, seed=1, engine_order=1, harmonics=(1,), load=20.0):
    """Ring with stiffness +-2 %, friction +-30 %, loads +-30 %, uniform."""
    rng = np.random.default_rng([seed, n_blades])

    def around(nominal, width):
        return nominal * (1 + width * rng.uniform(-1, 1, n_blades))

    disk = sh.bladed_disk(
        n_blades,
        mass=1,
        stiffness=around(1e4, 0.02),
        damping=0.5,
        contact_stiffness=around(2e4, 0.1),
        friction_coefficient=around(MU, 0.3),
        normal_load=around(load, 0.3),
    )
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(engine_order), harmonics)


# One blade, closed form


@pytest.mark.parametrize("frequency", [10.0, 17.3, 19.5, 22.5, 30.0])
def test_amplitude_over_normal_load(frequency):
    grid = np.append(np.geomspace(0.01, 100, 25), [282.0, 300.0, 400.0])
    up, down = both_ways(
        fig03.problem(), "normal_load", (0.01, 400.0), at=grid, frequency=frequency
    )
    expected = [blade_amplitude(blade_with(normal_load=f), frequency) for f in grid]
    for result in (up, down):
        assert result.amplitude.dims == ("normal_load", "dof")
        # Required: 1e-9.
        np.testing.assert_allclose(result.amplitude[:, 0], expected, rtol=1e-9)
        assert float(result.frequency) == frequency
        assert result.converged.all()
    path = sh.follow(fig03.problem(), "normal_load", (0.01, 400.0), frequency=frequency)
    assert path.amplitude.dims == ("point", "dof")
    for load, amplitude in zip(path.normal_load.values, path.amplitude.values[:, 0], strict=True):
        exact = blade_amplitude(blade_with(normal_load=float(load)), frequency)
        assert amplitude == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("frequency", [10.0, 17.3, 22.0, 22.5079])
def test_stuck_response_is_constant_and_has_no_peak(frequency):
    limit = 1e4 / stuck_stiffness(frequency) / MU
    for curve in both_ways(fig03.problem(), "normal_load", (limit / 2, 500), frequency=frequency):
        load = curve.normal_load.values
        stuck = curve.amplitude.values[load >= limit * (1 + 1e-12), 0]
        assert len(stuck) >= 2
        # The residual, 1e-12, over the dynamic amplification, at most 200.
        np.testing.assert_allclose(stuck, 1 / stuck_stiffness(frequency), rtol=1e-10)
        assert (curve.contact_state.values[load > limit * (1 + 1e-12)] == 0).all()
        assert (curve.peak_normal_load.values < limit * (1 - 1e-6)).all()
    above = sh.follow(fig03.problem(), "normal_load", (limit * 1.01, 500), frequency=frequency)
    assert int(above.n_peaks) == 0
    assert int(above.n_events) == 0


@pytest.mark.parametrize("frequency", [15.5, 17.3, 22.0, 22.5])
def test_events_over_each_friction_parameter(frequency):
    """The contact is at its limit where ``k_d A = mu F_n``, A that of the stuck blade."""
    stiffness = stuck_stiffness(frequency)
    limit = 1e4 / stiffness
    cases = {
        "normal_load": (limit / MU, "end of slip", {}),
        "friction_coefficient": (limit / 100, "end of slip", {}),
        "force_amplitude": (MU * 100 / limit, "onset of slip", {}),
    }
    for name, (value, kind, changes) in cases.items():
        problem = fig03.problem().with_parameters(**changes)
        up, down = both_ways(problem, name, (value / 3, value * 3), frequency=frequency)
        opposite = {"end of slip": "onset of slip", "onset of slip": "end of slip"}[kind]
        for curve, expected in ((up, kind), (down, opposite)):
            assert curve.event_kind.values.tolist() == [expected]
            assert curve.event_contact.values.tolist() == [0]
            # Required: 1e-9.
            assert float(curve[f"event_{name}"][0]) == pytest.approx(value, rel=1e-9)
            assert curve[f"event_{name}"].values[0] in curve[name].values


@pytest.mark.parametrize("frequency", [15.0, 17.5, 20.0])
@pytest.mark.parametrize("load", [2.5, 40.0])
def test_events_over_contact_stiffness(frequency, load):
    """``k_d A(k_d) = g`` is a quadratic: onset, end, or both."""
    omega = TWO_PI * frequency
    d, c, g = 1e4 - omega**2, 0.5 * omega, MU * load
    roots = np.roots([1 - g**2, -2 * d * g**2, -(g**2) * (d**2 + c**2)])
    roots = np.sort(roots[np.isreal(roots)].real)
    band = 100.0, 2e5
    expected = [r for r in roots if band[0] < r < band[1]]
    problem = fig03.problem().with_parameters(normal_load=load)
    up, down = both_ways(problem, "contact_stiffness", band, frequency=frequency)
    # Required: 1e-9.
    np.testing.assert_allclose(up.event_contact_stiffness, expected, rtol=1e-9)
    np.testing.assert_allclose(down.event_contact_stiffness, expected[::-1], rtol=1e-9)
    # Whether the stuck amplitude asks for more than the limit, on either side.
    for place, kind in zip(expected, up.event_kind.values, strict=True):
        beyond = place * 1.01 / np.hypot(d + place * 1.01, c) > g
        assert (kind == "onset of slip") == beyond
    for curve in (up, down):
        for stiffness, amplitude in zip(
            curve.contact_stiffness.values[::4], curve.amplitude.values[::4, 0], strict=True
        ):
            blade = blade_with(contact_stiffness=float(stiffness), normal_load=load)
            exact = blade_amplitude(blade, frequency)
            # Required: 1e-9; on the slope of a resonance the closed form loses a digit.
            assert amplitude == pytest.approx(exact, rel=1e-9)


def maxima(function, low, high, count=4000):
    """Local maxima inside a band by a dense scan, each refined."""
    grid = np.geomspace(low, high, count)
    values = np.array([function(x) for x in grid])
    tops = 1 + np.flatnonzero((values[1:-1] > values[:-2]) & (values[1:-1] >= values[2:]))
    tops = [i for i in tops if values[i] > values[i - 1] * (1 + 1e-12)]
    refined = []
    for i in tops:
        best = minimize_scalar(
            lambda x: -function(x), bounds=(grid[i - 1], grid[i + 1]), options={"xatol": 0}
        )
        refined.append((float(best.x), function(float(best.x))))
    return refined


@pytest.mark.parametrize(
    ("name", "band", "changes"),
    [
        ("normal_load", (0.05, 400.0), {}),
        ("contact_stiffness", (10.0, 1e5), {}),
        ("contact_stiffness", (10.0, 1e5), {"normal_load": 3.0}),
        ("mass", (0.3, 3.0), {"normal_load": 3.0}),
        ("stiffness", (2e3, 3e4), {"normal_load": 3.0}),
        ("damping", (0.05, 5.0), {"normal_load": 3.0}),
        ("friction_coefficient", (1e-3, 5.0), {}),
        ("force_amplitude", (0.01, 100.0), {"normal_load": 3.0}),
    ],
)
@pytest.mark.parametrize("frequency", [19.0])
def test_peaks_over_a_parameter(name, band, changes, frequency):
    """Every maximum of a dense scan of the closed form is a located peak, and no other."""
    problem = fig03.problem().with_parameters(**changes)

    def amplitude(value):
        return blade_amplitude(blade_with(**changes | {name: value}), frequency)

    expected = maxima(amplitude, *band, count=150)
    for curve in both_ways(problem, name, band, frequency=frequency):
        assert int(curve.n_peaks) == len(expected)
        events = curve[f"event_{name}"].values
        found = np.stack([curve[f"peak_{name}"].values, curve.peak_amplitude.values], axis=-1)
        for (place, height), kind, (scanned, top) in zip(
            found, curve.peak_kind.values, expected, strict=True
        ):
            # A scan fixes a maximum to the root of its round-off; its height is required: 1e-9.
            assert place == pytest.approx(scanned, rel=1e-6)
            assert height == pytest.approx(amplitude(place), rel=1e-9)
            assert height >= top * (1 - 1e-9)
            # Where the contact begins to slip its damping sets in at once.
            assert (kind == "corner") == (np.abs(events / place - 1) < 1e-9).any()


@pytest.mark.parametrize(
    ("name", "band", "harmonics"),
    [
        ("normal_load", (0.0, 200.0), (1,)),
        ("normal_load", (0.0, 200.0), (1, 3)),
        ("friction_coefficient", (0.0, 3.0), (1,)),
        ("contact_stiffness", (0.0, 3e4), (1,)),
        ("damping", (0.0, 2.0), (1,)),
        ("stiffness", (0.0, 2e4), (1,)),
        ("force_amplitude", (0.0, 5.0), (1,)),
    ],
)
def test_bands_with_zero_at_one_end(name, band, harmonics):
    problem = fig03.problem(harmonics).with_parameters(normal_load=4.0)
    grid = np.linspace(*band, 4)
    for curve in both_ways(problem, name, band, at=grid, frequency=19.0):
        assert curve.converged.all()
        if name == "force_amplitude":
            assert float(curve.amplitude[0, 0]) == 0
        for value in grid[int(name == "force_amplitude") :]:
            point = sh.solve(problem.with_parameters(**{name: value}), 19.0, throw=True)
            # Required: 1e-9.
            np.testing.assert_allclose(
                curve.amplitude.sel({name: value}), point.amplitude, rtol=1e-9
            )
    for curve in both_ways(problem, name, band, frequency=19.0):
        # As many points as a frequency response takes, with some to spare.
        assert int(curve.n_points) < 200
        values = curve[name].values
        assert values[[0, -1]].tolist() in (list(band), list(band[::-1]))
        assert np.all(np.diff(values) * np.sign(values[-1] - values[0]) > 0)


# Every named parameter


@pytest.mark.parametrize(
    ("name", "band", "harmonics"),
    [
        ("mass", (0.8, 1.3), (1,)),
        ("stiffness", (8e3, 1.4e4), (1, 3)),
        ("damping", (0.1, 3.0), (1,)),
        ("contact_stiffness", (1e3, 1e5), (1,)),
        ("friction_coefficient", (0.05, 2.0), (1,)),
        ("normal_load", (1.0, 60.0), (1, 3)),
        ("force_amplitude", (0.1, 10.0), (1,)),
        ("cubic_stiffness", (-1e6, 1e7), (1, 3)),
    ],
)
def test_values_on_a_grid_agree_with_single_points(name, band, harmonics):
    problem = mistuned_ring(5 if harmonics == (1,) else 3, harmonics=harmonics)
    grid = np.linspace(*band, 5)
    frequency = 19.0
    up, down = both_ways(problem, name, band, at=grid, frequency=frequency)
    for i, value in enumerate(grid):
        moved = problem.with_parameters(**{name: value})
        point = sh.solve(moved, frequency, throw=True)
        for result in (up, down):
            row = result.isel({name: i})
            if name == "cubic_stiffness":
                row = row.isel(solution=0)
            assert float(row[name]) == value
            largest = float(point.amplitude.max())
            # Required: 1e-9.
            np.testing.assert_allclose(row.amplitude, point.amplitude, rtol=0, atol=1e-9 * largest)
            np.testing.assert_array_equal(row.contact_state, point.contact_state)
            np.testing.assert_allclose(
                row.dissipation, point.dissipation, rtol=1e-7, atol=1e-9 * largest
            )


@pytest.mark.parametrize(("name", "index"), [("contact_stiffness", 2), ("stiffness", 3)])
def test_events_forward_equal_backward(name, index):
    problem = mistuned_ring()
    band = (5e3, 5e4)
    up, down = both_ways(problem, f"{name}[{index}]", band, frequency=19.0)
    # Required: 1e-9.
    np.testing.assert_allclose(
        np.sort(up[f"event_{name}"]), np.sort(down[f"event_{name}"]), rtol=1e-9
    )
    # The place of a flat top is good to the root of what its height is good to.
    order = np.argsort(up[f"peak_{name}"].values), np.argsort(down[f"peak_{name}"].values)
    np.testing.assert_allclose(
        up[f"peak_{name}"][order[0]], down[f"peak_{name}"][order[1]], rtol=1e-6
    )
    np.testing.assert_allclose(
        up.peak_amplitude[order[0]], down.peak_amplitude[order[1]], rtol=1e-9
    )
    onset = np.sort(up.event_contact[up.event_kind == "onset of slip"])
    end = np.sort(down.event_contact[down.event_kind == "end of slip"])
    np.testing.assert_array_equal(onset, end)


# Rings


@pytest.mark.parametrize(("engine_order", "frequency"), [(1, 77.4), (3, 211.4), (6, 317.0)])
def test_all_contacts_of_a_tuned_ring_together(engine_order, frequency):
    ratio = 2 * np.sin(np.pi * engine_order / 13)
    limit = 1e6 * ratio / stuck_stiffness(frequency, ratio, 1e6) / MU
    band = limit / 20, 2 * limit
    problem = fig08.problem().with_parameters(engine_order=engine_order)
    grid = np.linspace(*band, 9)
    expected = [
        blade_amplitude(OneBlade(1.0, 0.5, 1e4, 1e6, MU * f, ratio=ratio), frequency) for f in grid
    ]
    up, down = both_ways(problem, "normal_load", band, frequency=frequency)
    for curve, kind in ((up, "end of slip"), (down, "onset of slip")):
        assert sorted(curve.event_contact.values.tolist()) == list(range(13))
        assert set(curve.event_kind.values) == {kind}
        assert len(set(curve.event_normal_load.values)) == 1
        # Required: 1e-9.
        assert float(curve.event_normal_load[0]) == pytest.approx(limit, rel=1e-9)
    for curve in both_ways(problem, "normal_load", band, at=grid, frequency=frequency):
        for dof in range(13):
            np.testing.assert_allclose(curve.amplitude.sel(dof=dof), expected, rtol=1e-9)


@pytest.mark.parametrize(("name", "value"), [("normal_load", 30.0), ("cubic_stiffness", 1e9)])
def test_one_contact_of_the_ring(name, value):
    problem = fig08.problem().with_parameters(engine_order=3, normal_load=50.0)
    grid = np.linspace(0, value, 5)[1:]
    nominal = problem.parameters[name]
    up, down = both_ways(problem, f"{name}[4]", (0.0, value), at=grid, frequency=211.0)
    for single in grid:
        values = nominal.copy()
        values[4] = single
        point = sh.solve(problem.with_parameters(**{name: values}), 211.0, throw=True)
        largest = float(point.amplitude.max())
        for result in (up, down):
            row = result.sel({name: single})
            if "solution" in row.dims:
                row = row.isel(solution=0)
            # Required: 1e-9.
            np.testing.assert_allclose(row.amplitude, point.amplitude, rtol=0, atol=1e-9 * largest)
            np.testing.assert_array_equal(row.contact_state, point.contact_state)


def test_one_contact_at_its_nominal_value_changes_nothing():
    problem = mistuned_ring()
    value = float(problem.parameters["normal_load"][2])
    curve = sh.follow(problem, "normal_load[2]", (value / 2, 2 * value), at=[value], frequency=19.0)
    point = sh.solve(problem, 19.0)
    np.testing.assert_allclose(curve.amplitude[0], point.amplitude, rtol=1e-9)


@pytest.mark.parametrize(
    ("seed", "name"), [(0, "normal_load"), (1, "force_amplitude"), (2, "friction_coefficient")]
)
def test_mistuned_rings_near_their_resonances(seed, name):
    """Contacts stick one by one; single points from nothing are the reference."""
    problem = mistuned_ring(seed=seed, engine_order=1 + seed % 2)
    response = sh.frf(problem, (12, 55), throw=True)
    top = float(response.peak_frequency[int(np.argmax(response.peak_amplitude.values))])
    band = {
        "normal_load": (0.5, 200.0),
        "force_amplitude": (0.05, 30.0),
        "friction_coefficient": (0.01, 5.0),
    }[name]
    grid = np.geomspace(*band, 5)[1:-1]
    for frequency in (top,) if seed else (top, top * 0.97):
        up, down = both_ways(problem, name, band, frequency=frequency)
        assert up.converged.all()
        assert np.all(np.diff(up[name]) > 0)
        assert np.all(np.diff(down[name]) < 0)
        assert int(up.n_events) >= 5
        np.testing.assert_allclose(
            up[f"event_{name}"], down[f"event_{name}"].values[::-1], rtol=1e-9
        )
        on_grid = sh.follow(problem, name, band, at=grid, frequency=frequency, throw=True)
        for value in grid:
            point = sh.solve(problem.with_parameters(**{name: value}), frequency, throw=True)
            largest = float(point.amplitude.max())
            # Required: 1e-9.
            np.testing.assert_allclose(
                on_grid.amplitude.sel({name: value}),
                point.amplitude,
                rtol=0,
                atol=1e-9 * largest,
            )


def scan_peaks(grid, level):
    """Local maxima of a scan; on a plateau the residual, 1e-12, makes none."""
    below = np.maximum(level[:-2], level[2:]) * (1 + 1e-10)
    return 1 + np.flatnonzero(level[1:-1] > below)


def test_peaks_of_a_mistuned_ring_over_the_load():
    problem = mistuned_ring(seed=2)
    grid = np.geomspace(0.2, 300, 150)
    band = 0.2, 300.0
    scan = sh.follow(problem, "normal_load", band, at=grid, frequency=19.0, throw=True)
    for peaks in ("largest", "each"):
        for ends in (band, band[::-1]):
            curve = sh.follow(problem, "normal_load", ends, frequency=19.0, peaks=peaks)
            assert int(curve.n_peaks) > 0
            levels = scan.amplitude.values
            levels = levels if peaks == "each" else levels.max(axis=1, keepdims=True)
            for column, level in enumerate(levels.T):
                mine = curve.peak_dof.values == column
                mine |= peaks == "largest"
                places = curve.peak_normal_load.values[mine]
                heights = curve.peak_amplitude.values[mine]
                for top in scan_peaks(grid, level):
                    near = (places >= grid[top - 1]) & (places <= grid[top + 1])
                    assert near.any(), (column, grid[top])
                    # The located peak is at least as high as the scan.
                    assert heights[near].max() >= level[top] * (1 - 1e-9)
                for place, height in zip(places, heights, strict=True):
                    for side in (-1, 1):
                        moved = problem.with_parameters(normal_load=place * (1 + side * 1e-3))
                        beside = sh.solve(moved, 19.0, throw=True).amplitude.values
                        beside = beside[column] if peaks == "each" else beside.max()
                        assert beside < height


# Frequency responses: downwards, and peaks of each blade


@pytest.mark.parametrize(
    ("which", "harmonics"),
    [("blade", (1, 3)), ("tuned", (1,)), ("mistuned", (1,)), ("mistuned", (1, 3))],
)
def test_frequency_response_downwards(which, harmonics):
    problem, band = {
        "blade": (fig03.problem(harmonics).with_parameters(normal_load=3), (10.0, 30.0)),
        "tuned": (fig08.problem(harmonics).with_parameters(engine_order=3), (195.0, 230.0)),
        "mistuned": (mistuned_ring(3, harmonics=harmonics), (12.0, 45.0)),
    }[which]
    grid = np.linspace(*band, 21)
    up = sh.frf(problem, band, at=grid, throw=True)
    down = sh.frf(problem, band[::-1], at=grid, throw=True)
    largest = up.amplitude.max("dof")
    # Required: 1e-9.
    assert float((abs(up.amplitude - down.amplitude) / largest).max()) < 1e-9
    np.testing.assert_array_equal(up.contact_state, down.contact_state)
    np.testing.assert_allclose(
        np.sort(down.event_frequency), np.sort(up.event_frequency), rtol=1e-9
    )
    # A peak is found at the same height; its place is that of a flat top, or of an event.
    assert int(up.n_peaks) == int(down.n_peaks) > 0
    order = np.argsort(down.peak_frequency.values)
    np.testing.assert_allclose(down.peak_frequency[order], up.peak_frequency, rtol=1e-8)
    np.testing.assert_allclose(down.peak_amplitude[order], up.peak_amplitude, rtol=1e-9)
    assert down.peak_kind.values[order].tolist() == up.peak_kind.values.tolist()
    path = sh.frf(problem, band[::-1], throw=True)
    assert path.frequency.values[[0, -1]].tolist() == list(band[::-1])
    assert np.all(np.diff(path.frequency) < 0)


@cache
def scan_of_a_ring(seed):
    """Frequencies and amplitudes (n, 4) of a mistuned ring, dense at its resonances."""
    dense = [np.arange(15.0, 16.4, 0.02), np.arange(33.0, 39.0, 0.02)]
    grid = np.unique(np.concatenate([np.arange(13.0, 40.0, 0.25), *dense]))
    grid = grid[np.append(True, np.diff(grid) > 1e-6)]
    scan = sh.frf(mistuned_ring(4, seed), (grid[0], grid[-1]), at=grid, throw=True)
    return grid, scan.amplitude.values


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("down", [False, True])
def test_peaks_of_each_blade_against_a_dense_scan(seed, down):
    problem = mistuned_ring(4, seed)
    grid, amplitude = scan_of_a_ring(seed)
    band = (40.0, 13.0) if down else (13.0, 40.0)
    result = sh.frf(problem, band, peaks="each", throw=True)
    events = result.event_frequency.values
    kinds = set()
    for dof in range(4):
        level = amplitude[:, dof]
        mine = result.peak_dof.values == dof
        peaks, heights = result.peak_frequency.values[mine], result.peak_amplitude.values[mine]
        for top in scan_peaks(grid, level):
            near = (peaks >= grid[top - 1]) & (peaks <= grid[top + 1])
            assert near.any(), f"blade {dof} has no peak at {grid[top]:g} Hz"
            assert heights[near].max() >= level[top] * (1 - 1e-9)
        for peak, height, kind in zip(peaks, heights, result.peak_kind.values[mine], strict=True):
            # Points on either side solved for from nothing are lower, so that none is invented.
            for side in (-1, 1):
                beside = sh.solve(problem, peak * (1 + side * 1e-5), throw=True)
                assert float(beside.amplitude[dof]) < height
            assert (kind == "corner") == (np.abs(events / peak - 1).min() < 1e-9)
            assert kind in ("smooth", "corner")
            kinds.add(kind)
    assert kinds == {"smooth", "corner"}


@pytest.mark.parametrize("start", [1.0, 5.0, 13.0, 25.0, 33.0, 40.0])
def test_a_weak_narrow_resonance_is_found_from_any_start(start):
    """All contacts stick near 16 Hz, so that the response is linear; its two peaks are 40 % high.

    Far from it the path is smooth and steps are long: longer than the resonance is wide.
    """
    problem = mistuned_ring(4, 2)
    model = problem.model
    springs = np.diag(model.contact_stiffness)
    stiffness = model.stiffness_matrix.toarray()
    stiffness += model.directions.T.toarray() @ springs @ model.directions.toarray()
    force = np.exp(-2j * np.pi * np.arange(4) / 4)

    def largest(frequency):
        omega = TWO_PI * frequency
        dynamic = stiffness + (0.5j * omega - omega**2) * np.eye(4)
        return float(np.abs(np.linalg.solve(dynamic, force)).max())

    expected = maxima(largest, 15.0, 17.0, count=1000)
    assert len(expected) == 2
    assert max(a for _, a in expected) > 1.4 * largest(15.0)
    curve = sh.frf(problem, (start, 20.0 if start < 16 else 13.0), throw=True)
    inside = (curve.peak_frequency > 14.5) & (curve.peak_frequency < 17.0)
    assert int(inside.sum()) == 2
    # A scan fixes a flat maximum to the root of its round-off.
    np.testing.assert_allclose(
        np.sort(curve.peak_frequency[inside]), [f for f, _ in expected], rtol=1e-6
    )
    np.testing.assert_allclose(
        np.sort(curve.peak_amplitude[inside]), np.sort([a for _, a in expected]), rtol=1e-9
    )


@pytest.mark.parametrize("down", [False, True])
def test_peaks_of_each_blade_of_a_tuned_ring(down):
    problem = fig08.problem().with_parameters(engine_order=3)
    band = (350.0, 50.0) if down else (50.0, 350.0)
    curve = sh.frf(problem, band, peaks="each", throw=True)
    ((omega, amplitude),) = OneBlade(
        1.0, 0.5, 1e4, 1e6, 50.0, ratio=2 * np.sin(np.pi * 3 / 13)
    ).peaks()
    assert sorted(curve.peak_dof.values.tolist()) == list(range(13))
    # Required: 1e-9; the place of a flat top is good to its root.
    np.testing.assert_allclose(curve.peak_amplitude, amplitude, rtol=1e-9)
    np.testing.assert_allclose(curve.peak_frequency, omega / TWO_PI, rtol=1e-7)
    assert set(curve.peak_kind.values) == {"smooth"}
    largest = sh.frf(problem, band, throw=True)
    assert int(largest.n_peaks) == 1


# Sweeps, reasons to stop, archives


def test_over_other_parameters():
    result = sh.follow(
        fig03.problem(),
        "normal_load",
        (0.5, 50),
        at=[1.0, 5.0, 20.0],
        over={"contact_stiffness": [1e4, 2e4], "force_amplitude": [1.0, 2.0, 3.0]},
        frequency=19.0,
        throw=True,
    )
    assert dict(result.amplitude.sizes) == {
        "contact_stiffness": 2,
        "force_amplitude": 3,
        "normal_load": 3,
        "dof": 1,
    }
    for stiffness in (1e4, 2e4):
        for force in (1.0, 2.0, 3.0):
            for load in (1.0, 5.0, 20.0):
                blade = blade_with(
                    contact_stiffness=stiffness, force_amplitude=force, normal_load=load
                )
                chosen = dict(contact_stiffness=stiffness, force_amplitude=force, normal_load=load)
                found = float(result.amplitude.sel(chosen)[0])
                # Required: 1e-9.
                assert found == pytest.approx(blade_amplitude(blade, 19.0), rel=1e-9)


def test_reasons_to_stop():
    problem = fig03.problem()
    options = dict(frequency=19.0, max_points=5)
    with pytest.warns(RuntimeWarning, match="the curve is incomplete"):
        curve = sh.follow(problem, "normal_load", (0.5, 50), **options)
    assert "largest number of points" in str(curve.status.values)
    assert curve.sizes["point"] == 5
    with pytest.raises(sh.SolveError, match="largest number of points") as caught:
        sh.follow(problem, "normal_load", (0.5, 50), throw=True, **options)
    xr.testing.assert_identical(caught.value.result, curve)
    full = sh.follow(problem, "normal_load", (0.5, 50), frequency=19.0)
    assert "end of the band was reached" in str(full.status.values)


def test_an_undamped_resonance_over_the_stiffness_is_unbounded():
    """The linear blade without damping at its own frequency: f0/|k - m w^2|, a pole in k."""
    blade = fig03.problem().model.with_parameters(damping=0, normal_load=0)
    problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    pole = (TWO_PI * 15.0) ** 2
    for curve in both_ways(problem, "stiffness", (0.5 * pole, 2 * pole), frequency=15.0):
        assert curve.peak_kind.values.tolist() == ["unbounded"]
        assert curve.status.item() == sh.Status.WITHOUT_BOUND
        assert np.isinf(curve.peak_amplitude[0])
        # Required: 1e-9.
        assert float(curve.peak_stiffness[0]) == pytest.approx(pole, rel=1e-9)
        assert curve.converged.all()
        exact = 1 / np.abs(curve.stiffness - pole)
        far = np.abs(curve.stiffness / pole - 1) > 1e-3
        np.testing.assert_allclose(curve.amplitude[far, 0], exact[far], rtol=1e-8)


@pytest.mark.parametrize("band", [(0.0, 1.0), (1.0, 0.0)])
def test_without_damping_at_one_end(band):
    """The response of the free blade at resonance grows as 1/c, to no bound at c = 0."""
    problem = fig03.problem().with_parameters(normal_load=0.0)
    frequency = 100 / TWO_PI
    with pytest.warns(RuntimeWarning, match="the curve is incomplete"):
        curve = sh.follow(problem, "damping", band, frequency=frequency)
    damping = curve.damping.values
    assert "end of the band was reached" not in str(curve.status.values)
    for value, row in zip(damping, curve.amplitude.values[:, 0], strict=True):
        if value > 1e-6:
            assert row == pytest.approx(1 / (value * 100), rel=1e-7)


@pytest.mark.parametrize("index", [None, 2])
def test_archives_give_the_problem_back(tmp_path, index):
    problem = mistuned_ring()
    for name in ("normal_load", "stiffness"):
        nominal = problem.parameters[name]
        band = 0.8 * nominal.min(), 1.2 * nominal.max()
        moving = name if index is None else f"{name}[{index}]"
        curve = sh.follow(problem, moving, band, frequency=19.0)
        loaded = sh.load(sh.save(curve, tmp_path / f"{name}.nc"))
        xr.testing.assert_identical(loaded, curve)
        whole = sh.datasets.rebuild(loaded)
        np.testing.assert_array_equal(whole.parameters[name], nominal)
        for k in (0, 3, -1):
            point = loaded.isel(point=k)
            rebuilt = sh.datasets.rebuild(point)
            expected = nominal.copy()
            expected[slice(None) if index is None else index] = float(point[name])
            np.testing.assert_array_equal(rebuilt.parameters[name], expected)
            again = sh.solve(rebuilt, float(point.frequency), throw=True)
            # Required: 1e-9.
            np.testing.assert_allclose(again.amplitude, point.amplitude, rtol=1e-9)
    repeated = sh.follow(sh.datasets.rebuild(curve), moving, band, frequency=19.0)
    xr.testing.assert_identical(repeated, curve)


@pytest.mark.parametrize("name", ["force_amplitude", "cubic_stiffness"])
def test_archives_of_a_grid(tmp_path, name):
    problem = fig03.problem((1, 3)).with_parameters(normal_load=3.0)
    curve = sh.follow(
        problem,
        name,
        (0.5, 2.0),
        at=[0.5, 1.5],
        over={"damping": [0.5, 1.0]},
        frequency=19.0,
    )
    loaded = sh.load(sh.save(curve, tmp_path / "grid.nc"))
    xr.testing.assert_identical(loaded, curve)
    rebuilt = sh.datasets.rebuild(loaded.sel({name: 1.5, "damping": 1.0}))
    assert np.all(np.asarray(rebuilt.parameters[name]) == 1.5)
    assert rebuilt.parameters["damping"].tolist() == [1.0]
    assert np.all(
        np.asarray(sh.datasets.rebuild(loaded).parameters[name]) == problem.parameters[name]
    )


def test_units_of_the_followed_parameter():
    curve = sh.follow(fig03.problem(), "normal_load", (1, 3), frequency=19.0)
    for name in ("normal_load", "event_normal_load", "peak_normal_load"):
        assert curve[name].attrs["units"] == "N"
    assert curve.frequency.attrs["units"] == "Hz"
    assert "normal_load_nominal" in curve


def test_millimetres_and_milliseconds():
    """The same points in kg, mm and ms as in SI."""
    length, time = 1e3, 1e3
    force = length / time**2
    blade = sh.single_blade(
        mass=1,
        stiffness=1e4 / time**2,
        damping=0.5 / time,
        contact_stiffness=1e4 / time**2,
        friction_coefficient=MU,
        normal_load=100 * force,
    )
    scaled = sh.HarmonicBalance(blade, sh.forces.PointForce(amplitude=force))
    for name, band, unit in (
        ("normal_load", (0.1, 200), force),
        ("contact_stiffness", (100, 1e5), 1 / time**2),
        ("force_amplitude", (0.1, 100), force),
    ):
        one = sh.follow(fig03.problem(), name, band, frequency=22.0, throw=True)
        other = sh.follow(
            scaled, name, tuple(b * unit for b in band), frequency=22.0 / time, throw=True
        )
        assert int(one.n_points) == int(other.n_points)
        # Round-off moves points along the path, and the path by its square: 1e-9 is required there.
        np.testing.assert_allclose(other[name] / unit, one[name], rtol=1e-7)
        np.testing.assert_allclose(other[f"event_{name}"] / unit, one[f"event_{name}"], rtol=1e-9)
        np.testing.assert_allclose(other.peak_amplitude / length, one.peak_amplitude, rtol=1e-9)


# Bad input


def follow(**options):
    arguments = dict(
        problem=mistuned_ring(), parameter="normal_load", band=(1.0, 5.0), frequency=19.0
    )
    return sh.follow(**arguments | options)


NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (dict(parameter="normal_laod"), ["'normal_laod'", "allowed", "normal_load"]),
        (dict(parameter="frequency"), ["'frequency'", "allowed", "normal_load"]),
        (dict(parameter=None), ["None", "allowed", "normal_load"]),
        (dict(parameter=["normal_load"]), ["normal_load", "allowed"]),
        (dict(parameter="engine_order"), ["parameter='engine_order'", "expected"]),
        (dict(band=(3.0, 3.0)), ["band=(3.0, 3.0)", "two different values", "[N]"]),
        (dict(band=(3.0,)), ["band=(3.0,)", "two different values"]),
        (dict(band=3.0), ["band=3.0", "two different values"]),
        (dict(band=(1.0, 2.0, 3.0)), ["band=(1.0, 2.0, 3.0)", "two different values"]),
        (dict(band=(-1.0, 3.0)), ["band=(-1.0, 3.0)", ">= 0"]),
        (dict(parameter="mass", band=(0.0, 3.0)), ["band=(0.0, 3.0)", "> 0"]),
        (dict(parameter="force_amplitude", band=(-1.0, 1.0)), ["band=(-1.0, 1.0)", ">= 0"]),
        (dict(band=(1.0, NAN)), ["band=(1.0, nan)", "finite"]),
        (dict(band=(1.0, INF)), ["band=(1.0, inf)", "finite"]),
        (dict(band=("1", "2")), ["band=('1', '2')", "real numbers"]),
        (dict(band=None), ["band=None", "real numbers"]),
        (dict(at=[0.5]), ["at=[0.5]", "1 to 5"]),
        (dict(at=[5.5]), ["at=[5.5]", "1 to 5"]),
        (dict(at=[3.0, 2.0]), ["at=[3.0, 2.0]", "ascending"]),
        (dict(band=(5.0, 1.0), at=[3.0, 2.0]), ["at=[3.0, 2.0]", "ascending"]),
        (dict(at=[]), ["at=[]", "ascending"]),
        (dict(at=3.0), ["at=3.0", "ascending"]),
        (dict(at=[NAN]), ["at=[nan]", "finite"]),
        (dict(frequency=0.0), ["frequency=0.0", "> 0"]),
        (dict(frequency=-1.0), ["frequency=-1.0", "> 0"]),
        (dict(frequency=NAN), ["frequency=nan", "finite"]),
        (dict(frequency="19"), ["frequency='19'", "real number"]),
        (dict(frequency=None), ["frequency=None", "real number"]),
        (dict(frequency=(10.0, 20.0)), ["frequency=(10.0, 20.0)", "one number"]),
        (dict(parameter="normal_load[5]"), ["parameter='normal_load[5]'", "from 0 to 4"]),
        (dict(parameter="normal_load[-1]"), ["parameter='normal_load[-1]'", "from 0 to 4"]),
        (dict(parameter="normal_load[1.5]"), ["parameter='normal_load[1.5]'", "from 0 to 4"]),
        (dict(parameter="normal_load[]"), ["parameter='normal_load[]'", "from 0 to 4"]),
        (dict(parameter="stiffness[5]"), ["parameter='stiffness[5]'", "from 0 to 4"]),
        (dict(parameter="force_amplitude[0]"), ["parameter='force_amplitude[0]'", "one value"]),
        (dict(parameter="normal_laod[0]"), ["'normal_laod'", "normal_load"]),
        (dict(parameter=3), ["3 is no parameter"]),
        (dict(over={"normal_load": [1.0, 2.0]}), ["over", "normal_load", "followed"]),
        (dict(over={"mas": [1.0]}), ["'mas'", "allowed", "mass"]),
        (dict(over=[1.0]), ["over=[1.0]", "mapping"]),
        (dict(over=3.0), ["over=3.0", "mapping"]),
        (dict(peaks="all"), ["peaks='all'", "one of 'largest', 'each'"]),
        (dict(peaks=None), ["peaks=None", "one of 'largest', 'each'"]),
        (dict(peaks=["each"]), ["peaks=['each']", "one of 'largest', 'each'"]),
        (dict(peaks=np.array(["each", "largest"])), ["peaks=", "one of 'largest', 'each'"]),
        (dict(max_points=1), ["max_points=1", ">= 2"]),
        (dict(executor=3), ["executor=3", "Executor"]),
        (dict(problem=None), ["problem=None", "HarmonicBalance"]),
    ],
    ids=lambda value: None if isinstance(value, list) else "-".join(map(str, value)),
)
def test_bad_input(options, words):
    with pytest.raises((TypeError, ValueError, KeyError)) as caught:
        follow(**options)
    message = str(caught.value)
    missing = [word for word in words if word not in message]
    assert not missing, message


@pytest.mark.parametrize("options", [dict(peaks="all"), dict(band=(20.0, 20.0))])
def test_bad_input_of_a_frequency_response(options):
    ((name, value),) = options.items()
    with pytest.raises(ValueError, match="expected") as caught:
        sh.frf(mistuned_ring(), **{"band": (10.0, 20.0)} | options)
    assert f"{name}={value!r}" in str(caught.value)


def test_parameters_of_a_model_of_matrices():
    """Matrices have no named masses: the message lists what there is."""
    model = sh.Model([[1.0]], [[0.1]], [[1.0]])
    problem = sh.HarmonicBalance(model, sh.forces.PointForce())
    with pytest.raises(KeyError, match="allowed: contact_stiffness") as caught:
        sh.follow(problem, "mass", (1, 2), frequency=0.1)
    assert "force_amplitude" in str(caught.value)


def test_a_model_without_contacts():
    """Nothing depends on a contact that is not there; no place can be chosen."""
    problem = sh.HarmonicBalance(sh.Model([[1.0]], [[0.1]], [[1.0]]), sh.forces.PointForce())
    curve = sh.follow(problem, "force_amplitude", (0.5, 2), frequency=0.1, throw=True)
    exact = 1 / np.hypot(1 - (TWO_PI * 0.1) ** 2, 0.1 * TWO_PI * 0.1)
    # A linear response: round-off.
    np.testing.assert_allclose(curve.amplitude[:, 0], exact * curve.force_amplitude, rtol=1e-11)
    with pytest.raises(ValueError, match=r"normal_load\[0\]"):
        sh.follow(problem, "normal_load[0]", (0.5, 2), frequency=0.1)


@pytest.mark.parametrize("harmonics", [(1,), (1, 3), (0, 1, 2, 3)])
@pytest.mark.parametrize("problem", [fig03.problem, fig08.problem], ids=["blade", "ring"])
def test_down_to_no_force_at_all(problem, harmonics):
    """Towards rest motions become too small for squares of their inverses; at rest they are 0."""
    start = problem(harmonics).with_parameters(normal_load=1.0)
    followed = sh.follow(
        start, "force_amplitude", (1, 0), frequency=15.0 if problem is fig03.problem else 77.0
    )
    assert str(followed.status.values) == sh.Status.REACHED_END
    assert followed.converged.all()
    assert float(followed.force_amplitude[-1]) == 0.0
    np.testing.assert_array_equal(followed.amplitude[-1], 0.0)
    assert int(followed.n_points) < 60
    # Below the onset of slip the response is linear.
    stuck = followed.isel(point=[-3, -2])
    assert (stuck.contact_state == 0).all()
    ratio = (stuck.amplitude / stuck.force_amplitude).values
    np.testing.assert_allclose(ratio[0], ratio[1], rtol=1e-9)


@pytest.mark.parametrize("size", [1e-170, 1e-305, 5e-324])
def test_motions_too_small_to_have_an_inverse(size):
    """They are none: the events of the law are those of rest, up to the mean."""
    for harmonics in ((1, 3), (0, 1, 2, 3)):
        basis = FourierBasis(harmonics)
        motion = size * np.random.default_rng(1).uniform(0.5, 1, (2, basis.n_components))
        limits = np.array([1e4, 1e6]), np.array([0.0, 1.0])
        found = locate(basis, motion, *limits)
        rest = locate(basis, 0 * motion, *limits)
        for field in ("matrix", "vector", "slip", "slip_margin_gradient", "stick_fraction"):
            np.testing.assert_array_equal(getattr(found, field), getattr(rest, field))
        sampled = locate_sampled(basis, motion, *limits, samples=64)
        assert np.isfinite(sampled.slip_margin_gradient).all()
