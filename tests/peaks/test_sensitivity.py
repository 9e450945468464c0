"""Derivatives of stored peaks: against whole responses on both sides, symmetry and archives."""

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

import symhbm as sh
from symhbm.cli import main
from symhbm.model import PARAMETERS
from symhbm.peaks.sensitivity import EXACT, NOT_VERIFIED, STILL, UNBOUNDED
from symhbm.results.variables import derivative

COMMON = dict(mass=1, stiffness=1e4, damping=0.5, friction_coefficient=0.5)
BLADE = sh.HarmonicBalance(
    sh.single_blade(**COMMON, contact_stiffness=1e4, normal_load=3), sh.PointForce()
)
TUNED = sh.HarmonicBalance(
    sh.bladed_disk(5, **COMMON, contact_stiffness=1e5, normal_load=10), sh.EngineOrder(1)
)
LOADS = np.array([18.0, 22.0, 15.0, 25.0])
RING = sh.HarmonicBalance(
    sh.bladed_disk(
        4,
        **COMMON | {"stiffness": [1.01e4, 0.99e4, 1e4, 1.02e4]},
        contact_stiffness=[9e4, 1.1e5, 1e5, 1.2e5],
        normal_load=LOADS,
    ),
    sh.EngineOrder(1),
)
BAND = 50, 110


def frf(problem, band=BAND, **options):
    return sh.frf(problem, band, progress=False, **options)


def both_sides(problem, name, step, place=..., band=BAND, **options):
    """Responses with one parameter smaller and larger by a share of itself, and the difference."""
    sides = np.array([problem.parameters[name]] * 2, dtype=float)
    size = 2 * step * sides[0][place].flat[0]
    for side, sign in zip((0, 1), (-1, 1), strict=True):
        sides[(side, place)] *= 1 + sign * step
    own = {"stiffness": "dof", "mass": "dof", "damping": "dof"}.get(name, "contact")
    over = {name: xr.DataArray(sides, dims=("side", own)[: sides.ndim])}
    found = frf(problem, band, over=over, **options)
    return found.isel(side=0), found.isel(side=1), size


def nearest(dataset, frequency, dof):
    """The peak of one degree of freedom that is closest to a frequency."""
    own = dataset.isel(peak=np.flatnonzero(dataset.peak_dof.values == dof))
    return own.isel(peak=int(np.argmin(np.abs(own.peak_frequency.values - frequency))))


def test_one_blade_over_a_sweep():
    loads = [1.5, 3.0, 18.0]
    found = sh.sensitivity(frf(BLADE, (15, 25), over={"normal_load": loads}))
    assert (found.sensitivity_status == EXACT).all()
    assert found.peak_amplitude_by_normal_load.dims == (
        *("normal_load", "peak", "peaking_dof", "contact"),
    )
    for load in loads:
        here = found.sel(normal_load=load).squeeze()
        problem = BLADE.with_parameters(normal_load=load)
        everything = {*problem.parameters} - {"cubic_stiffness"}
        for name in everything if load == 3.0 else ["normal_load"]:
            low, high, size = both_sides(problem, name, 1e-4, band=(15, 25))
            for of in ("peak_amplitude", "peak_frequency"):
                by = (high[of] - low[of]).item() / size
                level = abs(here[of].item()) / size * 2e-4
                # The square of the step, and peaks located to 1e-9 over steps of 1e-4.
                assert here[f"{of}_by_{name}"].item() == pytest.approx(by, abs=1e-4 * level)
    assert "peak_amplitude_by_cubic_stiffness" not in found


def test_which_contact_matters_most():
    response = frf(RING, peaks="each")
    found = sh.sensitivity(response)
    assert (found.sensitivity_status == EXACT).all()
    assert {"smooth", "corner"} == {*found.peak_kind.values}
    # Each blade peaks alone where the disk is mistuned.
    each = np.isfinite(found.peak_amplitude_by_force_amplitude.values)
    assert (each == (found.peaking_dof.values == response.peak_dof.values[:, None])).all()
    highest = found.isel(peak=found.peak_amplitude.argmax("peak"))
    dof = int(highest.peak_dof)
    exact = highest.peak_amplitude_by_normal_load.sel(peaking_dof=dof)
    for contact in range(4):
        band = highest.peak_frequency.item() + np.array([-2, 2])
        low, high, size = both_sides(RING, "normal_load", 1e-4, contact, band, peaks="each")
        pair = (nearest(side, float(highest.peak_frequency), dof) for side in (low, high))
        low, high = (side.peak_amplitude.item() for side in pair)
        # The square of the step.
        by = (high - low) / size
        assert by == pytest.approx(exact.values[contact], abs=1e-5 * np.abs(exact).max().item())
    part = response.isel(peak=response.peak_amplitude.argmax("peak"))
    by_load = sh.sensitivity(part).peak_amplitude_by_normal_load
    assert abs(by_load).max("peaking_dof").idxmax("contact") == abs(exact).argmax("contact")


def test_blades_of_a_tuned_disk():
    largest, each = frf(TUNED), frf(TUNED, peaks="each")
    assert largest.n_sectors == 5
    found, all_peaks = sh.sensitivity(largest), sh.sensitivity(each)
    whole = sh.sensitivity(frf(TUNED, sector=False))
    assert found.sizes["peak"] == 1
    assert all_peaks.sizes["peak"] == 5
    for name in ("mass", "damping", "contact_stiffness", "normal_load"):
        for of in ("peak_amplitude", "peak_frequency"):
            values = found[f"{of}_by_{name}"].values[0]
            level = np.abs(values).max()
            # A blade further everything is the same; round-off of systems of condition 1e6.
            turned = [np.roll(values[0], blade) for blade in range(5)]
            np.testing.assert_allclose(values, turned, atol=1e-8 * level)
            np.testing.assert_allclose(whole[f"{of}_by_{name}"][0], values, atol=1e-8 * level)
            np.testing.assert_allclose(
                all_peaks[f"{of}_by_{name}"].values, np.tile(values, (5, 1, 1)), atol=1e-8 * level
            )
            low, high, size = both_sides(TUNED, name, 1e-4, band=(55, 62))
            by = (high[of] - low[of]).item() / size
            # All contacts or blades alike: the sum, but for the square of the step.
            assert values[0].sum() == pytest.approx(by, rel=1e-5, abs=1e-7 * level)
    # One contact alone mistunes the disk; each blade then has its own peak.
    low, high, size = both_sides(TUNED, "normal_load", 1e-4, 2, (55, 62), peaks="each")
    for dof in range(5):
        exact = found.peak_amplitude_by_normal_load.values[0]
        pair = (nearest(side, largest.peak_frequency.item(), dof) for side in (high, low))
        high_peak, low_peak = (side.peak_amplitude.item() for side in pair)
        by = (high_peak - low_peak) / size
        assert by == pytest.approx(exact[dof, 2], abs=1e-4 * np.abs(exact).max())


def test_blades_that_do_not_peak():
    """While all contacts stick, a disk with mistuned loads is tuned; the first onset ends that."""
    response = frf(TUNED.with_parameters(normal_load=[14.1, 11.1, 12.3, 10.4, 14.4]), peaks="each")
    found = sh.sensitivity(response)
    assert (found.sensitivity_status == EXACT).all()
    coefficient = response.peak_coefficient.squeeze("harmonic")
    level = np.hypot(coefficient.sel(component="cos"), coefficient.sel(component="sin"))
    alike = np.isclose(level, response.peak_amplitude.values[:, None], rtol=1e-9, atol=0)
    given = found.peak_amplitude_by_force_amplitude.notnull().values
    # All blades move as far, some of them climb on beyond.
    together = alike.all(axis=1)
    assert together.sum() > 1
    for i in np.flatnonzero(together):
        same = np.isclose(response.peak_frequency, response.peak_frequency[i], rtol=1e-12, atol=0)
        assert np.flatnonzero(given[i]).tolist() == response.peak_dof.values[same].tolist()
        assert 0 < given[i].sum() < 5


def test_two_parameters_and_a_pattern():
    rng = np.random.default_rng(2)
    loads = xr.DataArray(
        LOADS * rng.uniform(0.9, 1.1, (2, 4)), dims=("sample", "contact"), coords={"sample": [7, 8]}
    )
    over = {"force_amplitude": [0.8, 1.0], "normal_load": loads}
    found = sh.sensitivity(frf(RING, (60, 85), over=over, at=[60.0, 80.0]))
    assert "frequency" not in found.dims
    assert found.sample.values.tolist() == [7, 8]
    there = found.peak_kind.values != ""
    assert (found.sensitivity_status.values == np.where(there, EXACT, "")).all()
    one = sh.rebuild(found.sel(sample=8, force_amplitude=0.8))
    np.testing.assert_array_equal(one.model.normal_load, loads.sel(sample=8))
    alone = sh.sensitivity(frf(one, (60, 85)))
    n_peaks = alone.sizes["peak"]
    same = found.sel(sample=8, force_amplitude=0.8).isel(peak=slice(n_peaks))
    for name in ("normal_load", "mass", "force_amplitude"):
        for of in ("peak_amplitude", "peak_frequency"):
            mine, other = (side[f"{of}_by_{name}"] for side in (same, alone))
            # Curves meet their peaks the same way with or without neighbours.
            np.testing.assert_allclose(mine.values, other.values, rtol=1e-6)


def test_engine_orders_share_their_equations():
    found = sh.sensitivity(frf(TUNED, over={"engine_order": [1, 2]}))
    assert (found.sensitivity_status == EXACT).all()
    alone = sh.sensitivity(frf(TUNED.with_parameters(engine_order=2)))
    xr.testing.assert_allclose(
        found.peak_amplitude_by_mass.sel(engine_order=2, drop=True),
        alone.peak_amplitude_by_mass,
        rtol=1e-9,
    )


def test_peaks_have_their_own_harmonics():
    blade, band = BLADE.with_parameters(normal_load=1.5), (2, 40)
    response = frf(blade, band, accuracy=1e-2)
    assert response.peak_highest_harmonic.min() < response.harmonic.max()
    found = sh.sensitivity(response)
    assert (found.sensitivity_status == EXACT).all()
    at = int(response.peak_highest_harmonic.argmin("peak"))
    harmonics = tuple(range(1, int(response.peak_highest_harmonic[at]) + 1, 2))
    given = sh.HarmonicBalance(blade.model, blade.excitation, harmonics)
    fixed = sh.sensitivity(frf(given, band))
    other = nearest(fixed, float(response.peak_frequency[at]), 0)
    for name in ("peak_amplitude_by_normal_load", "peak_frequency_by_damping"):
        # Both peaks are solved for to round-off on the same harmonics.
        np.testing.assert_allclose(found[name].isel(peak=at), other[name], rtol=1e-7)


def test_cubic_springs():
    duffing = sh.HarmonicBalance(
        sh.Model([[1.0]], [[0.05]], [[1.0]], contacts=[(0,)], cubic_stiffness=0.1),
        sh.PointForce(amplitude=0.18),
    )
    band = 0.08, 0.32
    found = sh.sensitivity(frf(duffing, band)).squeeze()
    assert found.sensitivity_status == EXACT
    assert "peak_amplitude_by_mass" not in found
    for name in ("cubic_stiffness", "force_amplitude"):
        low, high, size = both_sides(duffing, name, 1e-4, band=band)
        for of in ("peak_amplitude", "peak_frequency"):
            by = (high[of] - low[of]).item() / size
            # The square of the step; a top of a backbone is located to 1e-9.
            assert found[f"{of}_by_{name}"].item() == pytest.approx(by, rel=1e-5)
    # There is no friction element, so nothing that its parameters change.
    assert found.peak_amplitude_by_normal_load == 0
    swept = sh.sensitivity(
        frf(duffing.with_parameters(cubic_stiffness=0), band, over={"cubic_stiffness": [0.0, 0.1]})
    )
    by_spring = swept.peak_amplitude_by_cubic_stiffness
    assert by_spring.sel(cubic_stiffness=0.1).item() == pytest.approx(
        found.peak_amplitude_by_cubic_stiffness.item(), rel=1e-7
    )
    assert np.isfinite(by_spring.sel(cubic_stiffness=0.0))


def test_a_contact_without_load():
    problem = RING.with_parameters(normal_load=[0.0, *LOADS[1:]])
    response = frf(problem, (70, 110))
    found = sh.sensitivity(response).isel(peak=response.peak_amplitude.argmax("peak"))
    assert found.sensitivity_status == EXACT
    step = 1e-5
    loaded = frf(problem.with_parameters(normal_load=[step, *LOADS[1:]]), (70, 110))
    loaded = nearest(loaded, float(found.peak_frequency), int(found.peak_dof))
    for of in ("peak_amplitude", "peak_frequency"):
        by = float(loaded[of] - found[of]) / step
        exact = found[f"{of}_by_normal_load"].sel(peaking_dof=found.peak_dof, contact=0)
        # One-sided: the remainder goes with the root of the load over what moves the contact.
        assert by == pytest.approx(exact.item(), rel=2e-2)


def mirrored():
    """A disk whose blades 1 and 4, 2 and 3 are alike, excited at blade 0."""
    rng = np.random.default_rng(10)
    stiffness, load = 1e4 * rng.uniform(0.9, 1.1, 3), rng.uniform(5, 20, 3)
    disk = sh.bladed_disk(
        5,
        **COMMON | {"stiffness": stiffness[[0, 1, 2, 2, 1]]},
        contact_stiffness=1e5,
        normal_load=load[[0, 1, 2, 1, 0]],
    )
    return sh.HarmonicBalance(disk, sh.PointForce())


def test_contacts_on_their_limits_together():
    response = frf(mirrored(), (55, 70), peaks="each")
    found = sh.sensitivity(response)
    exact = found.sensitivity_status == EXACT
    pairs = found.isel(peak=np.flatnonzero(~exact))
    assert pairs.sizes["peak"]
    assert (pairs.peak_kind == "corner").all()
    for text in pairs.sensitivity_status.values:
        assert text.startswith(("none: contacts 0, 4 are", "none: contacts 1, 3 are"))
    assert pairs.peak_amplitude_by_normal_load.isnull().all()
    given = found.isel(peak=np.flatnonzero(exact))
    assert given.peak_frequency_by_mass.notnull().any(("peaking_dof", "dof")).all()


LOOPING = sh.HarmonicBalance(
    sh.bladed_disk(
        4,
        **COMMON
        | {
            "stiffness": [9585.6, 9736.8, 10301.3, 10082.2],
            "friction_coefficient": [0.594, 0.345, 0.456, 0.507],
        },
        contact_stiffness=[837700.0, 973300.0, 991600.0, 863900.0],
        normal_load=[1.917, 2.104, 2.285, 2.548],
    ),
    sh.EngineOrder(1),
    (1, 3),
)
"""Peaks at corners where no contact begins or ends to slip, but one slips once more in a period."""


def test_corners_of_small_loops():
    band = 91.5, 94.5
    response = frf(LOOPING, band, peaks="each")
    corners = response.isel(peak=np.flatnonzero(response.peak_kind == "corner"))
    assert corners.sizes["peak"]
    found = sh.sensitivity(corners)
    assert found.sensitivity_status.values.tolist() == [EXACT] * corners.sizes["peak"]
    for name, place in (("normal_load", 2), ("stiffness", 3)):
        low, high, size = both_sides(LOOPING, name, 1e-6, place, band, peaks="each")
        for k in range(corners.sizes["peak"]):
            frequency, dof = float(corners.peak_frequency[k]), int(corners.peak_dof[k])
            pair = [nearest(side, frequency, dof) for side in (low, high)]
            for of in ("peak_amplitude", "peak_frequency"):
                exact = found[f"{of}_by_{name}"].isel(peak=k).sel(peaking_dof=dof).values
                by = (pair[1][of] - pair[0][of]).item() / size
                # Corners are located to round-off, over steps of 1e-6.
                assert by == pytest.approx(exact[place], abs=1e-5 * np.abs(exact).max())


def folding_ring():
    """Seven blades with cubic springs whose response folds where a contact ends to slip."""
    disk = sh.bladed_disk(
        7,
        mass=[0.98, 1.02, 1.02, 0.98, 0.98, 1.02, 1.02],
        stiffness=[10600, 9400, 10600, 9400, 9400, 9400, 10600],
        damping=0.249,
        contact_stiffness=[5183, 3456, 3456, 3456, 5183, 3456, 3456],
        friction_coefficient=[0.6, 0.4, 0.4, 0.6, 0.4, 0.6, 0.6],
        normal_load=[1.635, 2.452, 1.635, 2.452, 1.635, 2.452, 1.635],
        cubic_stiffness=1.117e8,
    )
    return sh.HarmonicBalance(disk, sh.EngineOrder(1))


def test_a_corner_at_which_the_path_folds():
    """Beside a cubic spring a contact may stick and slip on the same side of a corner."""
    problem, band = folding_ring(), (10, 17.2)
    response = frf(problem, band, peaks="each")
    corners = response.isel(peak=np.flatnonzero(response.peak_kind == "corner"))
    folds = response.event_frequency.values[response.event_kind.values == "fold"]
    folded = np.isin(corners.peak_frequency.values, folds)
    assert folded.any()
    found = sh.sensitivity(corners)
    assert found.sensitivity_status.values.tolist() == [EXACT] * corners.sizes["peak"]
    at = corners.isel(peak=int(np.flatnonzero(folded)[0]))
    dof, exact = int(at.peak_dof), found.isel(peak=int(np.flatnonzero(folded)[0]))
    for name, place in (("normal_load", 3), ("contact_stiffness", 4)):
        low, high, size = both_sides(problem, name, 1e-6, place, band, peaks="each")
        pair = [nearest(side, float(at.peak_frequency), dof) for side in (low, high)]
        for of in ("peak_amplitude", "peak_frequency"):
            own = exact[f"{of}_by_{name}"].sel(peaking_dof=dof).values
            by = (pair[1][of] - pair[0][of]).item() / size
            assert by == pytest.approx(own[place], abs=1e-5 * np.abs(own).max())


@pytest.mark.parametrize("engine_order", [0, 1])
def test_stiff_contacts_and_little_damping(engine_order):
    """The terms of a slope, ten million times what is left of them, have round-off of their own."""
    disk = sh.bladed_disk(
        5,
        **COMMON | {"damping": 0.05, "stiffness": [1.001e4, 0.999e4, 1e4, 1.0005e4, 1e4]},
        contact_stiffness=[1.1e8, 0.9e8, 1e8, 1.2e8, 0.8e8],
        normal_load=[1.5, 1.2, 1.3, 1.1, 1.4],
    )
    problem = sh.HarmonicBalance(disk, sh.EngineOrder(engine_order), (0, 1, 2))
    response = frf(problem, (15, 17))
    found = sh.sensitivity(response)
    assert found.sensitivity_status.values.tolist() == [EXACT] * response.sizes["peak"]
    # Force and loads together scale the response, whatever it is.
    by_load = (found.peak_amplitude_by_normal_load * problem.model.normal_load).sum("contact")
    scaled = (by_load + found.peak_amplitude_by_force_amplitude).max("peaking_dof")
    np.testing.assert_allclose(scaled, response.peak_amplitude, rtol=1e-7)


def test_unbounded_peaks():
    problem = BLADE.with_parameters(damping=0, normal_load=1)
    found = sh.sensitivity(frf(problem, (10, 40)))
    assert UNBOUNDED in found.sensitivity_status.values
    nothing = found.isel(peak=np.flatnonzero(found.sensitivity_status == UNBOUNDED))
    assert nothing.peak_amplitude_by_mass.isnull().all()
    assert np.isinf(nothing.peak_amplitude).all()


def test_contacts_at_rest():
    """All blades move alike: whichever contact moves first is centred, or has no limit."""
    alike = TUNED.with_parameters(engine_order=0)
    assert (sh.sensitivity(frf(alike, (10, 30))).sensitivity_status == EXACT).all()
    for problem in (
        sh.HarmonicBalance(alike.model, alike.excitation, (0, 1, 2)),
        alike.with_parameters(normal_load=0),
    ):
        found = sh.sensitivity(frf(problem, (10, 30)))
        assert found.sensitivity_status.values.tolist() == [STILL.format(contacts="0, 1, 2, 3, 4")]


def test_no_peaks():
    found = sh.sensitivity(frf(BLADE, (5, 8)))
    assert found.sizes["peak"] == 0
    assert found.peak_amplitude_by_normal_load.shape == (0, 1, 1)


@pytest.mark.parametrize("factor", [0.9, 1.5, np.nan])
@pytest.mark.parametrize("name", ["peak_coefficient", "peak_amplitude", "peak_frequency"])
def test_damaged_numbers(name, factor):
    response = frf(BLADE, (15, 25))
    check_damaged(response.assign({name: response[name] * factor}))


@pytest.mark.parametrize(
    ("name", "value"), [("peak_dof", 1), ("peak_dof", -1), ("peak_kind", "edge")]
)
def test_damaged_words(name, value):
    response = frf(BLADE, (15, 25))
    response[name] = response[name].copy(data=np.array([value], dtype=response[name].dtype))
    check_damaged(response)


def check_damaged(response):
    found = sh.sensitivity(response)
    assert found.sensitivity_status.values.tolist() == [NOT_VERIFIED]
    assert found.peak_amplitude_by_mass.isnull().all()


def test_archives(tmp_path):
    keep = ["peak_frequency", "peak_amplitude", "peak_dof", "peak_kind", "peak_coefficient"]
    over = {"normal_load": [1.0, 3.0]}
    path = tmp_path / "response.nc"
    whole = sh.sensitivity(frf(BLADE, (15, 30), over=over))
    with frf(BLADE, (15, 30), over=over, keep=keep, archive=path) as lazy:
        found = sh.sensitivity(lazy).load()
    xr.testing.assert_identical(found.drop_attrs(), whole.drop_attrs())
    again = sh.sensitivity(sh.load(path))
    xr.testing.assert_identical(again.drop_attrs(), whole.drop_attrs())
    sh.save(again, tmp_path / "sensitivity.nc")
    loaded = sh.load(tmp_path / "sensitivity.nc")
    xr.testing.assert_identical(loaded, again)
    told = CliRunner().invoke(main, ["info", str(tmp_path / "sensitivity.nc")])
    assert told.exit_code == 0
    assert "frequency response from 15 to 30 Hz, its peaks alone" in told.output
    assert sh.rebuild(loaded.sel(normal_load=3.0)).model.normal_load == 3.0


def test_units():
    assert derivative("peak_amplitude", "normal_load").units == "m N-1"
    assert derivative("peak_amplitude", "contact_stiffness").units == "m2 N-1"
    assert derivative("peak_amplitude", "friction_coefficient").units == "m"
    assert derivative("peak_amplitude", "cubic_stiffness").units == "m4 N-1"
    assert derivative("peak_frequency", "damping").units == "Hz N-1 s-1 m"
    found = sh.sensitivity(frf(BLADE, (15, 30)))
    for name in (str(name) for name in found.data_vars if "_by_" in str(name)):
        about = derivative(*name.split("_by_"))
        assert found[name].attrs == {"units": about.units, "long_name": about.long_name}
        assert name.split("_by_")[1] in PARAMETERS


def test_other_datasets_are_refused():
    with pytest.raises(TypeError, match="dataset=3: expected an xarray Dataset"):
        sh.sensitivity(3)
    with pytest.raises(sh.ArchiveError, match="not written by symhbm"):
        sh.sensitivity(xr.Dataset())
    names = ["amplitude", "peak_frequency"]
    kept = frf(BLADE, (15, 30), keep=names, verifiable=False)
    with pytest.raises(
        sh.ArchiveError, match="without peak_amplitude, peak_dof, peak_kind, peak_c"
    ):
        sh.sensitivity(kept)
    loads = sh.follow(BLADE, "normal_load", (1, 3), frequency=19.5, progress=False)
    with pytest.raises(sh.ArchiveError, match="over the frequency, got one without peak_frequency"):
        sh.sensitivity(loads)
    with pytest.raises(sh.ArchiveError, match="expected a result of frf"):
        sh.sensitivity(sh.solve(BLADE, 19.5))
    sampled = sh.HarmonicBalance(BLADE.model, BLADE.excitation, (1,), samples=64)
    with pytest.raises(sh.ArchiveError, match="friction over 64 samples"):
        sh.sensitivity(frf(sampled, (15, 30)))
    with pytest.raises(sh.ArchiveError, match="dimensions are missing"):
        sh.sensitivity(frf(RING, (55, 65)).isel(dof=0))
    with pytest.raises(sh.ArchiveError, match="expected coefficients of sizes"):
        sh.sensitivity(frf(RING, (55, 65)).isel(harmonic=[]))
