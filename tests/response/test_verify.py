"""Archives verify themselves: sound ones pass, damaged ones are caught and named."""

import json
from functools import cache

import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig08_engine_orders as fig08
from symhbm.response.verification.verify import FIGURES, summary, verify
from tests.archives import three_rings, two_masses
from tests.pressed_contact import two_way
from tests.problems import duffing, ring_of_blades
from tests.quick import quick_first
from tests.random_contacts import random_system

BLADE = fig03.problem((1, 3)).with_parameters(normal_load=3)
RING = sh.HarmonicBalance(
    ring_of_blades(3),
    sh.forces.EngineOrder(1),
    harmonics=(1, 3),
)
DUFFING = duffing()
GENERAL = two_masses(back=-4.0)


def general():
    with pytest.warns(UserWarning, match="stiffness_matrix is not symmetric"):
        return sh.frf(GENERAL, (0.3, 0.7), over={"force_amplitude": [1.0, 2.0]})


CASES = {
    "figure 3": lambda: fig03.compute(progress=False),
    "ring": lambda: sh.frf(fig08.problem(), (74, 80)),
    "grid": lambda: sh.frf(BLADE, (15, 25), at=np.linspace(15, 25, 11)),
    "loads": lambda: sh.follow(BLADE, "normal_load", (0.1, 100), frequency=19.5),
    "one load": lambda: sh.follow(
        RING,
        "normal_load[1]",
        (0.5, 5),
        at=[0.5, 2.0, 5.0],
        over={"force_amplitude": [1.0, 2.0]},
        frequency=24.0,
    ),
    "duffing": lambda: sh.frf(DUFFING, (0.32, 0.08), at=[0.15, 0.19, 0.21]),
    "cubic stiffness": lambda: sh.follow(
        BLADE, "cubic_stiffness", (1e8, 1e9), frequency=19.5, max_points=50
    ),
    "ensemble": lambda: sh.frf(RING, (26, 36), at=np.linspace(26, 36, 6), over=three_rings()),
    "engine orders": lambda: sh.frf(RING, (28, 32), at=[29, 31], over={"engine_order": [0, 1, 4]}),
    "general": general,
    "sampled": lambda: sh.frf(
        sh.HarmonicBalance(BLADE.model, BLADE.excitation, (1, 3), samples=64), (15, 25), at=[17, 19]
    ),
    "point": lambda: sh.solve(RING, 30.0),
}


@cache
def dataset(case):
    return CASES[case]()


def report(verified):
    return json.loads(verified.attrs["verification"])


@pytest.mark.parametrize("case", quick_first(CASES, 3))
def test_sound_archives_pass(tmp_path, case):
    original = dataset(case)
    loaded = sh.load(sh.save(original, tmp_path / "archive.nc"))
    verified = verify(loaded, exact=1)
    result = report(verified)
    assert result["passed"], summary(verified)
    assert result["n_checked"] == int(original.converged.sum()) > 0
    assert result["n_skipped"] == int((~original.converged).sum())
    assert result["n_exact_failed"] == 0
    assert result["n_exact"] == 1
    # Round-off, hundreds of times below the bound.
    assert float(verified.residual_stored.max()) < 2e-12
    assert "angles_difference" not in verified  # of angles as unknowns alone
    of_others = {"angles_difference", "stability_mismatch", "event_mismatch", "fold_mismatch"}
    for name in (name for name in FIGURES if name not in of_others):
        assert verified[name].dims == original.converged.dims
        assert verified[name].attrs["units"] == "1"
        assert verified[name].attrs["long_name"]
        if name != "exact_difference":
            np.testing.assert_array_equal(np.isfinite(verified[name]), original.converged)
    # Nothing else has changed, and what is verified is an archive.
    stripped = verified.drop_vars([name for name in result["figures"] if name in verified])
    del stripped.attrs["verification"]
    xr.testing.assert_identical(stripped, original)
    again = sh.load(sh.save(verified, tmp_path / "verified.nc"))
    xr.testing.assert_identical(again, verified)
    assert summary(again) == summary(verified)


def test_flags_hide_nothing():
    damaged = dataset("grid").copy(deep=True)
    damaged.converged[3] = False
    damaged.coefficient[3] *= 1.5
    result = report(verify(damaged, exact="none"))
    assert result["n_checked"] == 11
    assert result["figures"]["residual_stored"]["at"]["frequency"] == 18.0


def scale(ds, name, index, factor):
    values = ds[name].values.copy()
    values[index] *= factor
    ds[name] = (ds[name].dims, values, ds[name].attrs)
    return ds


def flip(ds, index):
    ds.contact_state.values[index] = 1 - ds.contact_state.values[index]
    return ds


# The point, the damage, the figure that names it.
DAMAGE = {
    "coefficient": ("coefficient", (1, 4, 0, 0, 0), 1 + 1e-6, "residual_stored"),
    "frequency": ("frequency", (1, 4), 1 + 1e-6, "residual_stored"),
    "not a number": ("coefficient", (1, 4), np.nan, "residual_stored"),
    "infinity": ("frequency", (1, 4), np.inf, "residual_stored"),
    "dissipation": ("dissipation", (1, 12, 0), 1 + 1e-4, "energy_error"),
    "dissipation of the contact": ("dissipation", (1, 12, 0), 1 + 1e-4, "contact_mismatch"),
    "reversals": ("reversals", (1, 4, 0), 2, "contact_mismatch"),
    "stick fraction": ("stick_fraction", (1, 4, 0), 0.9, "contact_mismatch"),
    "amplitude": ("amplitude", (1, 4, 0), 1 + 1e-6, "amplitude_mismatch"),
}


@pytest.mark.parametrize("damage", quick_first(DAMAGE, 4))
def test_damage_is_named_at_its_point(damage):
    name, index, factor, figure = DAMAGE[damage]
    part = dataset("figure 3").isel(normal_load=[0, 5, 8]).copy(deep=True)
    verified = verify(scale(part, name, index, factor), exact="none")
    result = report(verified)
    entry = result["figures"][figure]
    assert not result["passed"]
    assert entry["broken"]
    assert entry["n_broken"] == 1
    assert (entry["at"]["normal_load"], entry["at"]["point"]) == (3.0, index[1])
    line = next(line for line in summary(verified).splitlines() if line.startswith(figure))
    assert f"BROKEN  normal_load=3, point={index[1]}," in line


@pytest.mark.parametrize(
    ("case", "index"),
    [("grid", (0, 0)), ("grid", (5, 0)), ("ensemble", (2, 3, 1)), ("point", (1,))],
)
def test_flipped_contact_state(case, index):
    damaged = flip(dataset(case).copy(deep=True), index)
    verified = verify(damaged, exact="none")
    assert np.argwhere(verified.contact_mismatch.values == 1).tolist() == [list(index[:-1])]
    broken = [name for name, entry in report(verified)["figures"].items() if entry["broken"]]
    assert broken == ["contact_mismatch"]


def test_followed_parameter_is_that_of_each_point():
    damaged = scale(dataset("loads").copy(deep=True), "normal_load", (7,), 1 + 1e-3)
    result = report(verify(damaged, exact="none"))["figures"]["residual_stored"]
    assert result["broken"]
    assert result["at"]["point"] == 7
    assert result["at"]["normal_load"] == float(damaged.normal_load[7])
    assert result["at"]["frequency"] == 19.5
    # No such parameter: the one point is broken, not the archive.
    verified = verify(scale(damaged, "normal_load", (7,), -1.0), exact="none")
    assert np.isinf(verified.residual_stored.values[7])
    assert report(verified)["figures"]["residual_stored"]["n_broken"] == 1


@pytest.mark.parametrize(
    ("problem", "frequency", "expected"),
    [
        # The README's table, one harmonic, two digits.
        (fig03.problem().with_parameters(normal_load=3), 19.5, 2.4e-4),
        (fig08.problem(), 77.04, 9.2e-2),
        (fig03.problem((1, 3)).with_parameters(normal_load=3), 19.5, 1.8e-4),
    ],
)
def test_exact_difference_is_the_known_truncation(problem, frequency, expected):
    verified = verify(sh.solve(problem, frequency), exact="all")
    assert float(verified.exact_difference) == pytest.approx(expected, rel=0.03)


def test_larger_set_is_the_next_problem():
    """The residual on a larger set is that of the larger problem, even harmonics left out."""
    ds = sh.solve(BLADE, 19.5)
    larger = sh.HarmonicBalance(BLADE.model, BLADE.excitation, (1, 3, 5, 7))
    unknowns = np.concatenate([ds.coefficient.values[0].ravel(), np.zeros(4)])
    expected = larger.evaluate(unknowns, 2 * np.pi * 19.5).norm
    # The same numbers through the same function.
    assert float(verify(ds).residual_larger) == pytest.approx(expected, rel=1e-9)
    assert 1e-5 < expected < 1e-1
    # With more harmonics less is left out.
    assert float(verify(sh.solve(larger, 19.5)).residual_larger) < expected / 2


@pytest.mark.slow
def test_choice_of_points():
    ds = dataset("figure 3")
    verified = verify(ds, points=20, exact=6)
    assert int(np.isfinite(verified.residual_stored).sum()) == 20
    result = report(verified)
    assert result["n_checked"] + result["n_unchecked"] == int(ds.converged.sum())
    assert result["n_exact"] == int(np.isfinite(verified.exact_difference).sum()) == 6
    checked = verified.where(np.isfinite(verified.residual_stored))
    # The exact motion is asked for where most is left out.
    worst = checked.residual_larger.argmax(...)
    assert np.isfinite(verified.exact_difference[worst])
    assert int(np.isfinite(verify(ds, points=10**6, exact=0).residual_stored).sum()) == int(
        ds.converged.sum()
    )


@pytest.mark.slow
def test_parts_and_order_of_dimensions():
    ds = dataset("ensemble")
    whole = verify(ds, exact="none")
    for part in (
        ds.isel(sample=1),
        ds.isel(frequency=[2, 4]),
        ds.isel(sample=2, frequency=3),
        ds.transpose("component", "frequency", "dof", "contact", "sample", "harmonic", ...),
    ):
        verified = verify(part, exact="none")
        assert report(verified)["passed"]
        index = {name: part[name].values for name in ("sample", "frequency")}
        expected = whole.residual_larger.sel(index).transpose(*verified.residual_larger.dims)
        # The same numbers through the same functions.
        np.testing.assert_allclose(verified.residual_larger, expected, rtol=1e-9)
    with pytest.raises(ValueError, match="dimensions are missing"):
        verify(ds.isel(contact=0))
    with pytest.raises(ValueError, match="sizes"):
        verify(ds.isel(harmonic=[0]))


def test_bounds():
    ds = dataset("point")
    result = report(verify(ds, bounds={"residual_larger": 1e-12, "energy_error": None}))
    assert not result["passed"]
    assert result["figures"]["residual_larger"]["broken"]
    assert result["figures"]["energy_error"]["bound"] is None
    assert report(verify(ds, bounds={"residual_larger": 1.0}))["passed"]
    # A bound on what was not computed does not hold.
    result = report(verify(ds, bounds={"exact_difference": 1.0}, exact="none"))
    assert not result["passed"]
    assert result["figures"]["exact_difference"]["worst"] is None


def test_nothing_to_verify_does_not_pass():
    still = dataset("grid").isel(frequency=[0]).copy(deep=True)
    still.converged[:] = False
    still.coefficient[:] = np.nan
    result = report(verify(still))
    assert (result["n_checked"], result["n_skipped"], result["passed"]) == (0, 1, False)


def test_contacts_that_open_are_marched():
    response = sh.frf(two_way(), (22, 26), progress=False)
    verified = verify(response, exact="none", progress=False)
    assert report(verified)["passed"]
    assert 0 < verified.march_error.max() < 1e-3
    for name in ("dissipation", "open_fraction", "mean_normal_force"):
        damaged = response.copy(deep=True)
        damaged[name] *= 1.01
        wrong = verify(damaged, points=3, exact="none", progress=False)
        assert wrong.contact_mismatch.max() > 1e-3


def test_structures_without_contacts_pass():
    linear = sh.HarmonicBalance(sh.Model([[1.0]], [[0.5]], [[1e4]]), sh.forces.PointForce())
    verified = verify(sh.frf(linear, (10, 15), progress=False), exact="none", progress=False)
    assert report(verified)["passed"]
    assert verified.energy_error.max() < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("seed", [4, 5, 23, 28])
def test_round_off_of_contacts_that_hardly_touch_is_no_mismatch(seed):
    """Neither of what was found, nor of coefficients with another last digit; a millionth is."""
    problem, band = random_system(seed)
    response = sh.frf(problem, band, progress=False)
    signs = np.random.default_rng(seed).choice([-1, 1], response.coefficient.shape)
    for change, broken in ((0.0, False), (1e-15 * signs, False), (1e-6, True)):
        changed = response.assign(coefficient=response.coefficient * (1 + change))
        report = sh.verify(changed, points=60, exact="none", progress=False)
        figures = json.loads(report.attrs["verification"])["figures"]
        assert figures["contact_mismatch"]["broken"] == broken
        assert figures["residual_stored"]["broken"] == broken


def test_broken_figures_are_explained():
    problem, band = random_system(4)
    point = sh.solve(problem, band[0])
    wrong = sh.verify(point.assign(amplitude=1.01 * point.amplitude), exact="none")
    told = summary(wrong).splitlines()
    [line] = [line for line in told if line.startswith("amplitude_mismatch: ")]
    assert line.endswith("compute them again")
    sound = summary(sh.verify(point, exact="none"))
    assert "compute them again" not in sound
