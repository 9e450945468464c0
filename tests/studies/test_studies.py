"""Each study runs as documented and meets its landmarks, all of them and what the page says."""

import base64
import importlib
import io
import json
import sys
from dataclasses import replace
from functools import partial
from html.parser import HTMLParser
from types import ModuleType
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

import symhbm as sh
from studies import (
    damping_and_localisation,
    fig01_fig05_models,
    fig06_point_force,
    fig07_nodal_diameters,
    fig09_contact_stiffness,
    fig12_mistuned_disk,
    fig13_amplification,
    harmonic_convergence,
    index,
    laws_and_solvers,
    one_harmonic_validity,
    optimal_normal_load_engine_orders,
    optimal_normal_load_robust,
    optimal_normal_load_single_blade,
    switching_angles,
)
from studies.__main__ import STUDIES as ALL
from studies.__main__ import main, statements
from studies.claim import Claim, Finding
from studies.claim import unmet as unmet_statements
from studies.claims_table import PAGE
from studies.closed_form import OneBlade, StuckRing
from studies.companions import full_stick_load, largest_peak
from studies.damped_disks import equal_damping
from studies.landmark import Landmark, Source, number, unmet
from studies.readings import READINGS
from studies.run import REFERENCE
from tests.problems import ring_of_blades

LONG = (
    "underplatform_damper",
    "open_sector_modes",
    "open_sector_contacts",
    "open_sector_mistuned",
    "pareto_damper_mass",
    "calculix_sector",
    "damping_of_modes",
    "flutter",
    "flutter_limits",
    "identified_contacts",
    "identified_backbone",
    "identified_sector",
)
"""Studies that are run apart, in full."""
STUDIES = tuple(name for name in ALL if name not in LONG)
EXACT = json.loads(REFERENCE.read_text())
CLAIMS = PAGE.read_text(encoding="utf-8")
WHOLE = tuple(
    name
    for name in STUDIES
    if name.startswith(("fig03", "fig06", "fig07", "fig08", "fig09", "fig10", "fig11"))
)
"""Studies that are computed here as the documented command computes them."""
QUICK = (
    "fig01_fig05_models",
    "fig03_single_blade",
    "fig04_hysteresis_loop",
    "fig07_nodal_diameters",
)
"""Studies of the page that all runs write; the others are slow tests."""


def each_of(names):
    """Parameters of a test of some studies."""
    return [pytest.param(name, marks=[pytest.mark.slow] * (name not in QUICK)) for name in names]


SMALL = {
    optimal_normal_load_single_blade: dict(
        sets=((1,), (1, 3)), n_loads=5, dampings=(1 / 32, 1 / 64)
    ),
    optimal_normal_load_engine_orders: dict(
        sets=((1,), (1, 3)), engine_orders=(3, 6), ratios=(0.9, 1.1), different=None
    ),
    optimal_normal_load_robust: dict(
        n_design=2,
        n_fresh=2,
        statistics=("worst",),
        problem=sh.HarmonicBalance(
            ring_of_blades(5, contact_stiffness=1e6, normal_load=10),
            sh.forces.EngineOrder(1, amplitude=1.0),
        ),
    ),
}
"""Arguments of studies that are run at a part of their points."""


@pytest.fixture(scope="module")
def at_some_points():
    """Costly studies have some of their points."""
    some = harmonic_convergence.cases
    laws = laws_and_solvers.cases
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(harmonic_convergence, "SIX_REVERSALS", (63.0,))
        patch.setattr(harmonic_convergence, "HIGHEST", (1, 3, 5, 9, 15))
        patch.setattr(harmonic_convergence, "cases", lambda: some()[:4] + some()[-1:])
        patch.setattr(one_harmonic_validity, "ENGINE_ORDERS", (1, 3, 6))
        patch.setattr(one_harmonic_validity, "NORMAL_LOADS", (100.0, 2e4))
        patch.setattr(fig12_mistuned_disk, "N_SAMPLES", 3)
        # As fine as the whole grid, where the largest ratios are.
        patch.setattr(fig13_amplification, "GRID", np.linspace(65, 90, 126))
        patch.setattr(laws_and_solvers, "REPEATS", 1)
        patch.setattr(damping_and_localisation, "N_SAMPLES", 3)
        patch.setattr(damping_and_localisation, "NORMAL_LOADS", (1.0, 100.0, 300.0))
        # A few disks and engine orders do not tell what the claims are weighed by.
        patch.setattr("studies.__main__.unmet_statements", lambda _: [])
        patch.setattr(laws_and_solvers, "cases", lambda: laws()[5:10])
        for name, value in dict(
            LOADS=(3,), ENGINE_ORDERS=(1,), PARTLY=(), N_FREQUENCIES=21
        ).items():
            patch.setattr(switching_angles, name, value)
        for study, arguments in SMALL.items():
            patch.setattr(study, "compute", partial(study.compute, **arguments))
        yield


@pytest.fixture(scope="module")
def outcome(tmp_path_factory, at_some_points):
    """Directory and exit code of a run of the quick studies."""
    results = tmp_path_factory.mktemp("results")
    return results, main({name: ALL[name] for name in QUICK}, results)


def pictures_of(name):
    """Files of the pictures of a study, that on the axes of the source first."""
    on_source_axes = hasattr(importlib.import_module(f"studies.{name}"), "draw_on_source_axes")
    return [f"{name}_source_axes.png"] * on_source_axes + [f"{name}.png"]


class Datasets(dict):
    """Archives by the names of their studies; those that are not quick run when asked for."""

    def __init__(self, results):
        super().__init__()
        self.results = results

    def folder(self, name):
        return self.results if name in QUICK else self.results / name

    def __missing__(self, name):
        if name not in QUICK:
            assert main({name: ALL[name]}, self.folder(name)) == 0
        return self.setdefault(name, sh.load(self.folder(name) / f"{name}.nc"))


@pytest.fixture(scope="module")
def datasets(outcome):
    return Datasets(outcome[0])


def test_quick_studies_succeed(outcome):
    results, code = outcome
    assert code == 0
    files = {path.name for path in results.iterdir() if path.is_file()}
    pictures = {picture for name in QUICK for picture in pictures_of(name)}
    pictures |= {picture.replace(".png", ".svg") for picture in pictures}
    assert files == pictures | {f"{name}.nc" for name in QUICK} | {"index.html"}


@pytest.mark.parametrize("name", each_of(STUDIES))
def test_study_meets_its_landmarks(name, datasets):
    study = importlib.import_module(f"studies.{name}")
    assert name == study.NAME
    assert datasets[name].attrs["references"]
    assert (datasets.folder(name) / f"{name}.png").stat().st_size > 10_000
    landmarks = study.landmarks(datasets[name])
    assert landmarks
    assert unmet(landmarks) == []


@pytest.mark.parametrize("name", each_of(STUDIES))
def test_claims_and_findings_come_out_as_they_are_told(name, datasets):
    """Claims of the source keep their verdicts; `docs/claims.md` tells these, and no others."""
    study = importlib.import_module(f"studies.{name}")
    claims, findings = (statements(study, kind, datasets[name]) for kind in ("claims", "findings"))
    rows = [line for line in CLAIMS.splitlines() if line.endswith(f"| `{name}` |")]
    assert bool(rows) == bool(claims or findings)
    for one in claims:
        [row] = [row for row in rows if row.startswith(f"| {one.words}. | {one.where} |")]
        if name in WHOLE:
            assert one.met
            assert f"| {one.computed}. | {one.verdict} |" in row
    if name in WHOLE:
        assert [one.words for one in findings if not one.met] == []
        assert len(rows) == len(claims) + len(findings)


@pytest.mark.slow
@pytest.mark.parametrize("name", LONG)
def test_long_study_meets_its_landmarks(name, tmp_path):
    assert main({name: ALL[name]}, tmp_path) == 0
    assert (tmp_path / f"{name}.nc").exists()


def test_claims_are_not_taken_on_trust():
    """A claim whose verdict changes, and a finding that is not found, are told."""
    claim = Claim("It is flat", "Fig. 3", "it is round", holds=False, expected=False)
    assert (claim.met, claim.verdict) == (True, "does not hold")
    changed = replace(claim, holds=True)
    assert unmet_statements([claim, changed]) == ["It is flat: HOLDS, unlike before: it is round"]
    finding = Finding("It is round", "to 1 %", met=False)
    assert unmet_statements([finding]) == ["It is round: NOT FOUND: to 1 %"]


@pytest.mark.slow
def test_laws_and_solvers(datasets):
    """Laws that are exact agree; the sampled one errs as it says, to second order."""
    dataset = datasets["laws_and_solvers"]
    exact = dataset.isel(law=slice(0, 4))
    solved = exact.status == "success"
    outside = dataset.case.str.contains("66.25 Hz")
    assert bool(solved.where(~outside, drop=True).all())
    assert not solved.where(outside, drop=True).isel(law=slice(1, 4)).any()
    sampled = dataset.isel(law=slice(4, 8))
    # The stated error is of first order: the second is its square, 1 % at 64 samples.
    np.testing.assert_allclose(sampled.difference, sampled.sampling_error, rtol=0.03)
    table = laws_and_solvers.table(dataset)
    assert table.count("does not apply") == 3
    assert table.count("\n") == 6


@pytest.mark.slow
def test_switching_angles(datasets):
    """Every curve is followed by every solver, and the table tells each."""
    dataset = datasets["switching_angles"]
    assert np.all(dataset.status == "the end of the band was reached")
    assert np.all(dataset.linear_solves > 0)
    assert switching_angles.table(dataset).count("| 100.0 % |") == dataset.sizes["case"] == 4


def test_closed_form_peaks_are_those_of_the_reference():
    """One blade, and the ring with its contacts moved 2 sin(pi EO / N) times as much."""
    blade = dict(mass=1.0, damping=0.5, stiffness=1e4, force=1.0)
    for peak in EXACT["single_blade_peaks"]:
        limit = 0.5 * peak["Fn"]
        closed = OneBlade(contact_stiffness=1e4, slip_limit=limit, ratio=1.0, **blade)
        amplitude, frequency = closed.peak()
        # Solved to double precision; the reference has its digits.
        assert amplitude == pytest.approx(float(peak["hbm1_peak_X"]), rel=1e-12)
        assert frequency == pytest.approx(float(peak["hbm1_peak_hz"]), rel=1e-11)
    for peak in EXACT["ring_EO_1_3_6_Fn100"]:
        ratio = 2 * np.sin(np.pi * peak["EO"] / 13)
        closed = OneBlade(contact_stiffness=1e6, slip_limit=50.0, ratio=ratio, **blade)
        assert closed.peak()[0] == pytest.approx(float(peak["hbm1_peak_X"]), rel=1e-12)
        held = EXACT["ring_stuck_peaks_kd1e6"][str(peak["EO"])]["P_full_stick_min"]
        assert closed.largest_contact_force() == pytest.approx(float(held), rel=1e-12)


blades = st.builds(
    OneBlade,
    mass=st.floats(0.1, 10),
    damping=st.floats(0.05, 1),
    stiffness=st.floats(5e3, 5e4),
    contact_stiffness=st.floats(5e3, 1e6),
    slip_limit=st.just(1.0),
    force=st.floats(0.1, 10),
    ratio=st.floats(0.3, 2),
)


@settings(max_examples=25)
@given(blades)
def test_closed_form_optimum_is_the_lowest_peak(blade):
    """It is the peak at its slip limit, and a search over slip limits ends there."""
    limit, amplitude, frequency = blade.optimum()
    # Two equations solved to double precision.
    assert replace(blade, slip_limit=limit).peak() == pytest.approx((amplitude, frequency), 1e-11)
    found: Any = minimize_scalar(
        lambda log: np.log(replace(blade, slip_limit=np.exp(log)).peak()[0]),
        bounds=(np.log(limit) - 1, np.log(limit) + 2),
        method="bounded",
        options=dict(xatol=1e-9),
    )
    assert np.exp(found.fun) == pytest.approx(amplitude, rel=1e-11)
    # The bottom of a parabola: half the digits, and its curvature is of order one.
    assert np.exp(found.x) == pytest.approx(limit, rel=1e-5)


@settings(max_examples=25)
@given(blades)
def test_closed_form_optimum_without_damping(blade):
    none = replace(blade, damping=0.0)
    added = blade.ratio**2 * blade.contact_stiffness
    expected = (
        np.pi * blade.force / (2 * blade.ratio),
        np.pi * blade.force / added,
        np.sqrt((blade.stiffness + added / 2) / blade.mass) / (2 * np.pi),
    )
    assert none.optimum() == pytest.approx(expected, rel=1e-12)
    # Richardson: what is left is of second order in a step of 1e-4 of the damping.
    c = 1e-4 * added / (2 * np.pi * expected[2])
    far, near = (
        (np.array(replace(blade, damping=at).optimum()) / expected - 1) / at for at in (c, c / 2)
    )
    np.testing.assert_allclose(2 * near - far, blade.slopes(), rtol=1e-5, atol=1e-9 / c)


def test_tail_of_disks():
    """A third of six are the worst two; of two, the worst counts alone."""
    peaks = np.array([3.0, 1.0, 6.0, 2.0, 5.0, 4.0])
    value = optimal_normal_load_robust.value
    assert value("tail", peaks) == pytest.approx(5.5, rel=1e-15)
    assert value("tail", peaks[:2]) == 3.0
    # Of four, the worst and a third of the next.
    assert value("tail", peaks[:4]) == pytest.approx((6 + 3 / 3) / (4 / 3), rel=1e-15)
    assert (value("mean", peaks), value("worst", peaks)) == (3.5, 6.0)


def test_stuck_ring_has_the_natural_frequencies_of_the_reference():
    for stiffness, published in EXACT["ring_natural_hz"].items():
        ring = StuckRing(13, 1.0, 0.5, 1e4, float(stiffness), 1.0)
        found = ring.natural_frequencies()
        # The reference has 17 digits.
        np.testing.assert_allclose(found, np.array(published, dtype=float), rtol=1e-14)


@pytest.mark.parametrize("order", range(7))
@pytest.mark.parametrize("phase", [0.0, 0.3, 2.0])
def test_nodal_diameters_of_a_wave(order, phase):
    """A cosine of n waves over the disk is zero on n diameters, a quarter wave from its maxima."""
    blades = 2 * np.pi * np.arange(13) / 13
    shape = np.cos(order * blades - phase)
    assert fig07_nodal_diameters.counted(shape) == order
    zeros = fig07_nodal_diameters.nodal_angles(shape)
    # The trigonometric interpolation of a wave that the blades resolve is the wave.
    np.testing.assert_allclose(np.cos(order * zeros - phase), 0, atol=1e-10)


def ticks(first, last, step):
    return list(range(first, last + 1, step))


AXES: dict[str, list[tuple[list[int], list[int], int]]] = {
    "fig03_single_blade": [(ticks(10, 30, 2), ticks(-80, -20, 10), 12)],
    "fig06_point_force": [(ticks(0, 350, 50), ticks(-200, -50, 50), 13)] * 2,
    "fig08_engine_orders": [
        (ticks(0, 350, 50), ticks(-140, -70, 10), 13),
        (ticks(50, 350, 50), ticks(-130, -70, 10), 13),
        (ticks(50, 350, 50), ticks(-130, -70, 10), 13),
    ],
    "fig10_friction_coefficient": [(ticks(20, 200, 20), ticks(-120, -60, 10), 4)] * 2,
    "fig12_mistuned_disk": [(ticks(50, 350, 50), ticks(-150, -95, 5), 13)] * 2,
}
"""Ticks of the frequency [Hz] and of the level [dB] in the source, and how many lines we draw."""


def on_source_axes(name, dataset):
    """Axes of a study as in the source."""
    study = importlib.import_module(f"studies.{name}")
    return getattr(study, "draw_on_source_axes", study.draw)(dataset).axes


@pytest.mark.parametrize("name", each_of(AXES))
def test_figures_have_the_axes_of_the_source(name, datasets):
    axes = on_source_axes(name, datasets[name])
    for ax, (frequency, level, count) in zip(axes, AXES[name], strict=True):
        assert ax.get_xticks().tolist() == frequency
        assert ax.get_yticks().tolist() == level
        assert ax.get_xlim() == (frequency[0], frequency[-1])
        assert ax.get_ylim() == (level[0], level[-1])
        lines = [line for line in ax.lines if len(line.get_xdata()) > 2]
        assert len(lines) == count
        for line in lines:
            # From end to end; a blade does not stand still.
            assert line.get_xdata()[0] <= max(frequency[0], 0.5)
            assert line.get_xdata()[-1] == frequency[-1]
    plt.close("all")


@pytest.mark.slow
def test_the_linear_lines_of_figure_6_are_the_direct_solution(datasets):
    """Down to the bottom of each antiresonance, wherever a line has a corner."""
    ax, _ = on_source_axes("fig06_point_force", datasets["fig06_point_force"])
    stuck = datasets["fig06_point_force"].sel(normal_load=1e5)
    ring = fig06_point_force.ring(sh.datasets.rebuild(stuck))
    lines = [line for line in ax.lines if len(line.get_xdata()) > 2]
    places = np.unique(np.concatenate([line.get_xdata() for line in lines]))
    direct = dict(zip(places, (20 * np.log10(np.abs([*map(ring.response, places)]))), strict=True))
    for blade, line in enumerate(lines):
        expected = [direct[at][blade] for at in line.get_xdata()]
        # A line may be 0.3 mm off; the axes are 95 mm high. Found: 0.22 dB.
        np.testing.assert_allclose(line.get_ydata(), expected, rtol=0, atol=0.3)
    assert min(line.get_ydata().min() for line in lines) < -180
    plt.close("all")


def test_the_loop_has_the_axes_of_the_source(datasets):
    left, right = on_source_axes("fig04_hysteresis_loop", datasets["fig04_hysteresis_loop"])
    assert left.get_xlim() == (0, 2 * np.pi)
    assert right.get_xticks().tolist() == [-1e-3, 0, 1e-3]
    assert right.get_xlim() == (-1e-3, 1e-3)
    assert left.get_yticks().tolist() == [-2, -1, 0, 1, 2]
    assert right.get_yticks().tolist() == [-2, -1.5, -1, -0.5, 0, 0.5, 1, 1.5, 2]
    assert left.get_ylim() == right.get_ylim() == (-2, 2)
    one = datasets["fig04_hysteresis_loop"].isel(motion=0)
    turned = left.get_xticks()[1:4] - float(one.theta_0)
    np.testing.assert_allclose(turned, [0, float(one.theta_star - one.theta_0), np.pi], atol=1e-12)
    plt.close("all")


def test_nodal_diameters_are_drawn_where_the_blades_are_at_rest(datasets):
    """Blade i moves as cos(2 pi EO i / N): its tip is outside where that is positive."""
    figure = fig07_nodal_diameters.draw(datasets["fig07_nodal_diameters"])
    disks = figure.axes[: len(fig07_nodal_diameters.ENGINE_ORDERS)]
    for ax, order in zip(disks, fig07_nodal_diameters.ENGINE_ORDERS, strict=True):
        red = [line for line in ax.lines if line.get_color() == "red"]
        assert len(red) == 2 * order
        for line in red:
            x, y = (ends[1] for ends in line.get_data())
            # Clockwise from the top.
            assert np.cos(order * np.arctan2(x, y)) == pytest.approx(0, abs=1e-9)
        [tips] = [line for line in ax.lines if len(line.get_xdata()) == 14]
        moved = np.hypot(*tips.get_data())[:-1] - 1
        expected = np.cos(2 * np.pi * order * np.arange(13) / 13)
        np.testing.assert_allclose(moved, moved[0] * expected, atol=1e-9)
        assert moved[0] > 0.2
    plt.close(figure)


@pytest.mark.parametrize(
    "name", each_of(["fig03_single_blade", "fig08_engine_orders", "fig11_normal_load"])
)
def test_full_stick_begins_at_the_load_that_is_stated(name, datasets):
    """At the resonance of the stuck structure contacts slip with a little less, not with more."""
    dataset = datasets[name].isel({d: 0 for d in ("engine_order",) if d in datasets[name].dims})
    curve = dataset.isel({d: 0 for d in ("normal_load",) if d in dataset.dims})
    problem = sh.datasets.rebuild(curve)
    stuck = largest_peak(
        sh.frf(problem.with_parameters(normal_load=1e9), (15, 350), progress=False)
    )
    load = float(dataset.full_stick_normal_load)
    assert load == pytest.approx(float(full_stick_load(stuck)), rel=1e-9)
    for share, slips in ((0.999, True), (1.001, False)):
        held = problem.with_parameters(normal_load=share * load)
        found = sh.solve(held, float(stuck.peak_frequency), throw=True)
        assert bool((found.contact_state == 1).any()) is slips


def test_engine_order_0_does_not_see_the_contacts():
    """Whatever contact stiffness, friction and load: the response of one blade alone."""
    problem = fig09_contact_stiffness.problem().with_parameters(engine_order=0)
    frequency = np.array([5.0, 15.0, 15.9154, 16.5, 150.0])
    found = sh.frf(
        problem, (5, 150), frequency, fig09_contact_stiffness.UNCOUPLED, progress=False, throw=True
    )
    omega = 2 * np.pi * frequency
    alone = 1 / np.abs(1e4 - omega**2 + 0.5j * omega)
    # Round-off, times the quality factor of 200.
    np.testing.assert_allclose(
        found.amplitude, np.broadcast_to(alone[:, None], found.amplitude.shape), rtol=1e-12
    )
    assert found.amplitude.shape == (2, 2, 2, 5, 13)


def test_readings_are_on_both_pages(outcome):
    page = " ".join(Page((outcome[0] / "index.html").read_text()).text).replace("\u2212", "-")
    for where, words in READINGS:
        assert f"| {where} | {words}. |" in CLAIMS
        assert where in page
        assert words.partition("`")[0] in page


def test_reading_of_figure_10_has_the_peaks_of_the_closed_form():
    """EO 3, k_d = 1e5 N/m and mu from 0.2 to 0.8, with 10 N and with 100 N."""
    [words] = [words for where, words in READINGS if where == "Fig. 10"]
    for load, place in ((10, 0), (100, 1)):
        blade = OneBlade(1.0, 0.5, 1e4, 1e5, 1.0, 1.0, 2 * np.sin(3 * np.pi / 13))
        peaks = [replace(blade, slip_limit=mu * load).peak()[0] for mu in (0.2, 0.4, 0.6, 0.8)]
        levels = 20 * np.log10([min(peaks), max(peaks)])
        told = words.partition(";")[2 * place]
        assert "from {:.1f} to {:.1f} dB".format(*levels) in told


def test_structures_that_are_drawn_are_those_that_are_computed(datasets):
    """Figs. 1 and 5 have the parameters of the other studies."""
    drawn = fig01_fig05_models.models(datasets["fig01_fig05_models"])
    for model, problem in zip(drawn, fig01_fig05_models.problems(), strict=True):
        assert model.contacts == problem.model.contacts
        for name, values in model.parameters.items():
            np.testing.assert_array_equal(values, problem.parameters[name])


def damped(x, c=0.5):
    """Frequency response of a blade of 1 kg and 1e4 N/m without friction [m/N]."""
    omega = 2 * np.pi * x
    return 1 / np.abs(1e4 - omega**2 + 1j * c * omega)


@pytest.mark.parametrize("damping", [0.01, 0.5, 20.0, 100.0])
def test_viscous_damping_of_a_peak(damping):
    """The damping that a peak of one blade comes back from, also where it is large."""
    blade = OneBlade(1.0, 0.25, 1e4, 0.0, 1.0, 1.0, 1.0)
    at = np.sqrt(1e4 - damping**2 / 2) / (2 * np.pi)
    assert damped(at, damping) > max(damped(0.99 * at, damping), damped(1.01 * at, damping))
    found = equal_damping(blade, damped(at, damping))
    # The difference of stiffnesses loses the digits that damping has not.
    assert found == pytest.approx(damping, rel=1e-6)


def test_signs_of_paired_differences():
    """1 and -1 where the same disks differ for sure, 0 where they scatter."""
    noise = np.random.default_rng(1).normal(0, 1, 24)
    viscous = np.full(24, 10.0)
    friction = np.stack([viscous + 1 + noise / 10, viscous - 1 + noise / 10, viscous + 3 * noise])
    values = xr.DataArray(
        np.stack([friction, np.broadcast_to(viscous, (3, 24))], axis=1),
        {"kind": ["friction", "viscous"]},
        ("normal_load", "kind", "sample"),
    )
    found = damping_and_localisation.more_than_viscous(values)
    assert found.values.tolist() == [1, -1, 0]


def test_landmark_in_words():
    near = Landmark("peak", 1.0005, 1.0, "m", Source.EXACT, 1e-3)
    assert near.met
    assert near.verdict == "agrees to 0.1 %"
    far = Landmark("peak", 1.1, 1.0, "m", Source.EXACT, 1e-9)
    assert not far.met
    assert unmet([near, far]) == ["peak: DIFFERS: 1.1 m, not 1 m to 1e-9"]
    assert Landmark("shift", -2e-10, 0.0, "Hz", Source.EXACT, 1e-9).verdict == "agrees to 1e-9 Hz"
    for source in Source:
        assert not Landmark("peak", float("nan"), 1.0, "m", source, 1e-3).met


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0, "0"),
        (1e5, "1e5"),
        (123456.7, "1.23457e5"),
        (1e-9, "1e-9"),
        (-2.5e-4, "-2.5e-4"),
        (9999.4, "9999.4"),
        (0.001, "0.001"),
        (100.0, "100"),
        (1e10, "1e10"),
    ],
)
def test_numbers_without_zeros_to_count(value, text):
    assert number(value) == text


class Page(HTMLParser):
    """Checks that elements are nested and closed; collects attributes and text."""

    VOID = ("meta", "link", "img", "br")

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.text = [], [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)

    def all(self, tag, name):
        return [attrs[name] for found, attrs in self.tags if found == tag and name in attrs]


def pixels(source):
    """Red, green and blue of an image that is inside of the page."""
    head, _, data = source.partition(",")
    assert head == "data:image/png;base64"
    file = io.BytesIO(base64.b64decode(data, validate=True))
    return plt.imread(file, format="png")[..., :3]


def pixels_of(path):
    return plt.imread(path)[..., :3]


def pictures_in(page):
    """Small pictures of the contents, and the pictures of studies."""
    images = [attrs for tag, attrs in page.tags if tag == "img"]
    small = [image["src"] for image in images if not image["alt"]]
    return small, [image for image in images if image["alt"]]


def test_page_has_every_study_and_needs_nothing_else(outcome, datasets):
    results, _ = outcome
    text = (results / "index.html").read_text()
    page = Page(text)
    assert page.all("section", "id") == list(QUICK)
    files = [file for name in QUICK for file in pictures_of(name)]
    assert len(files) == len(QUICK) + 2  # two on the axes of the source
    cards, pictures = pictures_in(page)
    assert len(cards) == len(QUICK)
    for small, name in zip(cards, QUICK, strict=True):
        assert pixels(small).shape[1] <= pixels_of(results / f"{name}.png").shape[1] / 2
    for picture, file in zip(pictures, files, strict=True):
        shown, stored = pixels(picture["src"]), pixels_of(results / file)
        assert shown.shape == stored.shape
        # Two pixels for each of the page; colours are few, and near those of the file.
        assert int(picture["width"]) == stored.shape[1] // 2
        assert np.abs(shown - stored).mean() < 0.01
    # Anchors within the page, the archives beside it, and an icon of nothing.
    links = {link for link in page.all("a", "href") if not link.startswith("#")}
    full = {file.replace(".png", kind) for file in files for kind in (".png", ".svg")}
    assert links == {f"{name}.nc" for name in QUICK} | full
    anchors = {link[1:] for link in page.all("a", "href") if link.startswith("#")}
    assert anchors == set(QUICK) | {"studies"}
    assert page.all("link", "href") == ["data:,"]
    assert not {"script", "iframe", "object", "video"} & {tag for tag, _ in page.tags}
    assert all(word not in text for word in ("http:", "https:", "url(", "@import"))


def test_no_claim_is_left_out_of_the_lists():
    """Also those whose verdict is a number of NumPy."""
    claims = [
        Claim("It is flat", "Fig. 3", "round", holds=np.False_, expected=False),  # type: ignore
        Claim("It is round", "Fig. 4", "round", holds=np.True_, expected=True),  # type: ignore
    ]
    text = index.page([index.Section("shape", "Shapes.", claims=claims)])
    lists = text.partition('<main id="studies">')[0]
    assert "It is flat" in lists
    assert "It is round" in lists
    assert "claims of the source: 1 of 2 hold" in lists


def test_a_part_that_is_wrong_is_open():
    wrong = Landmark("half", 0.5, 1.0, "", Source.EXACT, 1e-3)
    right = Landmark("whole", 1.0, 1.0, "", Source.EXACT, 1e-3)
    text = index.page([index.Section("parts", "Parts.", landmarks=[wrong, right])])
    assert '<details open><summary>Landmarks: <span class="bad">1 of 2 agree</span>' in text
    text = index.page([index.Section("parts", "Parts.", landmarks=[right])])
    assert '<details><summary>Landmarks: <span class="count">1 of 1 agree</span>' in text


def fake(name, compute, landmarks=()):
    module = ModuleType(f"studies.{name}", "A study of <nothing> & more.\n\nIt does `little`.\n")
    vars(module).update(compute=compute, draw=lambda _: plt.figure(), landmarks=lambda _: landmarks)
    return module


def raises(progress):
    raise ArithmeticError("no <solution> at 3 N")


def nothing(progress):
    return xr.Dataset(attrs={"symhbm_schema": 1})


@pytest.mark.slow
def test_a_study_that_fails_does_not_stop_the_others(tmp_path, monkeypatch, capsys):
    wrong = Landmark("half", 0.5, 1.0, "", Source.EXACT, 1e-3)
    monkeypatch.setitem(sys.modules, "studies.failing", fake("failing", raises))
    monkeypatch.setitem(sys.modules, "studies.missing", fake("missing", nothing, [wrong]))
    studies = {"failing": 1, "not_there": 1, "fig04_hysteresis_loop": 2, "missing": 1}
    assert main(studies, tmp_path) == 1
    shown = capsys.readouterr()
    assert shown.out.split() == [
        *(str(tmp_path / f"missing.{kind}") for kind in ("nc", "png", "svg")),
        str(tmp_path / "fig04_hysteresis_loop.nc"),
        *(
            str(tmp_path / f"fig04_hysteresis_loop{end}.{kind}")
            for end in ("", "_source_axes")
            for kind in ("png", "svg")
        ),
        str(tmp_path / "index.html"),
    ]
    assert "failing: ArithmeticError: no <solution> at 3 N" in shown.err
    assert "not_there: ModuleNotFoundError" in shown.err
    assert "missing: half: DIFFERS" in shown.err
    # One bar, to its end, with a sane estimate from its first line on.
    assert "100%" in shown.err
    assert "about 5 s left" in shown.err
    page = (tmp_path / "index.html").read_text()
    assert "no &lt;solution&gt; at 3 N" in page
    assert "A study of &lt;nothing&gt; &amp; more" in page
    assert "<code>little</code>" in page
    assert page.count("This study failed") == 2
    assert "1 landmarks not met" in page
    assert 'id="fig04_hysteresis_loop"' in page


def test_an_interrupt_ends_with_a_sentence(tmp_path, monkeypatch, capsys):
    def interrupted(progress):
        raise KeyboardInterrupt

    monkeypatch.setitem(sys.modules, "studies.quick", fake("quick", nothing))
    monkeypatch.setitem(sys.modules, "studies.slow", fake("slow", interrupted))
    assert main({"slow": 9, "quick": 1}, tmp_path) == 130
    last = capsys.readouterr().err.splitlines()[-1]
    assert last == f"studies: interrupted; 1 of 2 studies are in {tmp_path}"
