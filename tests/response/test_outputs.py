"""Linear outputs of responses: their values, peaks, archives, ensembles and projections."""

import numpy as np
import pytest

import symhbm as sh
from tests.paper import level
from tests.quick import quick_first

FRICTION = dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=[1.0, 1.5])
STRESS = 2e11 * np.array([[1.0, -1.0, 0.0], [0.0, 0.5, 2.0]])
BAND = (5, 40)


def three():
    stiffness = 1e4 * (3 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1))
    mass = np.diag([1.0, 1.0, 2.0])
    model = sh.Model(
        mass, 1e-5 * stiffness + 0.5 * mass, stiffness, contacts=[(0, 1), (2,)], **FRICTION
    )
    outputs = {"tip": {1: 1.0}, "stress": STRESS, "double": [{0: 2.0}, {2: 0.25}]}
    return model.with_outputs(outputs, units={"tip": "m", "stress": "Pa", "double": "m"})


def problem(peaks_of=None, harmonics=(1, 3)):
    force = sh.forces.PointForce(amplitude=2.0)
    return sh.HarmonicBalance(three(), force, harmonics, peaks_of=peaks_of)


@pytest.fixture(scope="module")
def response():
    return sh.frf(problem("stress"), BAND, progress=False)


def test_one_row_of_one_gives_the_displacement_to_the_bit():
    each = sh.frf(problem(), BAND, peaks="each", progress=False)
    np.testing.assert_array_equal(each.tip_amplitude, each.amplitude.sel(dof=1))
    np.testing.assert_array_equal(each.tip_coefficient, each.coefficient.sel(dof=1))
    np.testing.assert_array_equal(
        each.tip_peak_to_peak, sh.datasets.motion(each).peak_to_peak.sel(dof=1)
    )
    tip = sh.frf(problem("tip"), BAND, progress=False)
    own = each.peak_dof.values == 1
    np.testing.assert_array_equal(tip.peak_kind, each.peak_kind.values[own])
    for name in ("peak_amplitude", "peak_frequency"):
        np.testing.assert_allclose(tip[name], each[name].values[own], rtol=1e-12)
    assert tip.peak_amplitude.attrs == {"units": "m", "long_name": "tip at the peak"}


def test_outputs_are_those_of_the_motion_in_time(response):
    angle = 2 * np.pi * np.arange(20000) / 20000
    motion = sh.datasets.motion(response.isel(point=slice(0, None, 7)), angle=angle)
    by_hand = np.einsum("rd,pda->pra", STRESS, motion.displacement.values)
    some = response.isel(point=slice(0, None, 7))
    largest, spread = np.abs(by_hand).max(-1), by_hand.max(-1) - by_hand.min(-1)
    # The highest of 20000 samples is at most 9 (pi / 20000)^2 / 2 = 1e-7 below the maximum.
    assert np.all(some.stress_amplitude >= largest * (1 - 1e-15))
    np.testing.assert_allclose(some.stress_amplitude, largest, rtol=2e-7)
    np.testing.assert_allclose(some.stress_peak_to_peak, spread, rtol=2e-7)
    for i, row in np.ndindex(largest.shape):
        k = np.abs(by_hand[i, row]).argmax()
        near = angle[k] + np.linspace(-1, 1, 2001) * 2 * np.pi / 20000
        fine = sh.datasets.motion(some.isel(point=[i]), angle=near).displacement.values[0]
        exact = some.stress_amplitude.values[i, row]
        assert np.abs(STRESS[row] @ fine).max() == pytest.approx(exact, rel=1e-10)
    seen = sh.datasets.motion(sh.datasets.output(response, "stress"))
    phasors = np.einsum(
        "rd,pdh->prh", STRESS, sh.datasets.motion(response).complex_amplitude.values
    )
    np.testing.assert_allclose(seen.complex_amplitude, phasors, rtol=1e-9, atol=1e-6)


def test_an_output_without_a_peak():
    found = sh.frf(problem("stress"), (8.0, 9.0), progress=False)
    seen = sh.datasets.output(found, "stress")
    assert seen.peak_coefficient.sizes["peak"] == 0
    assert seen.peak_coefficient.sizes["dof"] == len(STRESS)


def disk():
    springs = {(0, 1): 1e4, (0, 2): 2e4, (1, 3): 3e4}
    stiffness = np.diag([1e4, 1e4, 0, 0])
    for (i, j), spring in springs.items():
        stiffness[np.ix_([i, j], [i, j])] += spring * np.array([[1, -1], [-1, 1]])
    blade = sh.Model(np.diag([1.0, 0.5, 0, 0.2]), np.diag([2.0, 1.0, 0, 0.4]), stiffness)
    shroud = sh.Contacts(
        sh.laws.Coulomb(), (1, sh.next_sector(1)),
        contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    )  # fmt: skip
    sector = sh.Sector(blade, left=[0], right=[2], n_sectors=6).with_contacts(shroud=shroud)
    return sector.with_outputs({"root": {0: 3e9, 1: -1e9}}, units="Pa")


def test_outputs_of_a_sector_go_around_the_disk_with_its_phase():
    sector, force = disk(), sh.forces.EngineOrder(2, pattern={1: 2.0})
    first = sh.frf(sh.HarmonicBalance(sector, force, peaks_of="root"), (15, 40), progress=False)
    ring = sh.mistuned_ring(sector)
    assert ring.outputs["root"].rows.shape[0] == 6
    whole = sh.frf(sh.HarmonicBalance(ring, force, peaks_of="root"), (15, 40), progress=False)
    np.testing.assert_allclose(first.peak_amplitude, whole.peak_amplitude, rtol=1e-9)
    point = sh.solve(sh.HarmonicBalance(sector, force), 24.0)
    of_ring = sh.solve(sh.HarmonicBalance(ring, force), 24.0)
    around = sh.datasets.sector_response(point, range(6))
    np.testing.assert_allclose(
        around.root_coefficient, of_ring.root_coefficient, rtol=1e-8, atol=1e-3
    )
    reduced = sh.craig_bampton(sector, 1, (5, 60))
    small = sh.solve(sh.HarmonicBalance(reduced, force), 24.0)
    np.testing.assert_allclose(small.root_amplitude, point.root_amplitude, rtol=1e-9)
    with pytest.raises(ValueError, match="not right, 2 is"):
        disk().with_outputs({"root": {2: 1.0}}, units="Pa")


@pytest.mark.slow
@pytest.mark.parametrize("keep", quick_first(["touched", "displacements"], 1))
def test_condensed_structures_keep_what_outputs_read(keep, tmp_path):
    n = 30
    stiffness = 1e4 * (3 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    whole = sh.Model(
        np.eye(n), 0.5 * np.eye(n) + 2e-5 * stiffness, stiffness, contacts=[(n - 1, n - 2), (3,)],
        contact_stiffness=1e4, friction_coefficient=0.5, normal_load=1.0,
    ).with_outputs({"strain": {10: -5.0, 11: 5.0}}, units="1")  # fmt: skip
    force, band = sh.forces.PointForce(20, amplitude=5.0), (15, 25)
    small = sh.condense(whole, force, band, keep=keep, progress=False)
    problems = [sh.HarmonicBalance(model, force, peaks_of="strain") for model in (whole, small)]
    exact, found = (sh.frf(each, band, progress=False) for each in problems)
    np.testing.assert_allclose(found.peak_frequency, exact.peak_frequency, rtol=1e-8)
    np.testing.assert_allclose(found.peak_amplitude, exact.peak_amplitude, rtol=1e-7)
    point = found.drop_dims("point").isel(peak=0)
    again = sh.datasets.recover(problems[1], point)
    assert again.strain_amplitude.item() == pytest.approx(point.peak_amplitude.item(), rel=1e-9)
    by_hand = 5.0 * (again.coefficient.sel(dof=11) - again.coefficient.sel(dof=10))
    np.testing.assert_allclose(again.strain_coefficient, by_hand, rtol=1e-9)
    reduced = sh.craig_bampton(whole, 26, band)
    near = sh.frf(sh.HarmonicBalance(reduced, force, peaks_of="strain"), band, progress=False)
    np.testing.assert_allclose(near.peak_amplitude.max(), exact.peak_amplitude.max(), rtol=2e-3)
    motion = reduced.expanded(near.peak_coefficient.values[0, :, 0])
    by_hand = np.hypot(*(5.0 * (motion[11] - motion[10])))
    assert near.peak_amplitude.values[0] == pytest.approx(by_hand, rel=1e-12)
    late = sh.condense(whole.with_outputs({"tip": {3: 1.0}}, "m"), force, band, progress=False)
    with pytest.raises(ValueError, match=r"outputs\['mid'\]: expected degrees .* kept, 15 is not"):
        late.with_outputs({"mid": {15: 1.0}}, "m")
    if keep == "touched":
        sh.save(found, tmp_path / "small.nc")
        stored = sh.datasets.rebuild(sh.load(tmp_path / "small.nc"))
        anew = sh.frf(stored, band, progress=False)
        np.testing.assert_array_equal(anew.peak_amplitude, found.peak_amplitude)


def test_exact_motions_have_exact_outputs():
    balance = problem(harmonics=range(1, 22, 2))
    point, motion = sh.solve(balance, 12.0), sh.periodic_motion(balance, 12.0)
    np.testing.assert_allclose(motion.stress_amplitude, point.stress_amplitude, rtol=1e-4)
    by_hand = motion.displacement.values @ STRESS.T
    np.testing.assert_allclose(motion.stress, by_hand, rtol=1e-12, atol=1e-6)
    assert np.all(motion.stress_amplitude >= np.abs(by_hand).max(0))
    of_harmonics = np.einsum("rd,dhc->rhc", STRESS, motion.coefficient.values)
    np.testing.assert_allclose(motion.stress_coefficient, of_harmonics, rtol=1e-12, atol=1e-6)
    tip = motion.amplitude.sel(dof=1).item()
    assert motion.tip_amplitude.item() == pytest.approx(tip, rel=1e-12)


def test_second_derivatives_of_peaks_of_differences():
    step = 1e-4
    curve = sh.peak_curve(
        problem("stress", (1,)), "force_amplitude", (1.0, 2.5), [1.6 - step, 1.6, 1.6 + step],
        frequency_band=(5, 25), progress=False,
    )  # fmt: skip
    low, _, high = curve.peak_amplitude.values
    assert (high - low) / (2 * step) == pytest.approx(
        curve.peak_amplitude_slope[1].item(), rel=1e-5
    )


def test_pictures_of_outputs(response):
    figure = sh.plot.response(sh.datasets.output(response, "stress"))
    axes = figure.axes[0]
    assert axes.get_ylabel() == "largest stress [dB re 1 Pa]"
    top = level(response.peak_amplitude.values.max())
    assert max(np.nanmax(line.get_ydata()) for line in axes.lines) == pytest.approx(top, abs=1e-6)
    plain = sh.plot.response(response).axes[0]
    assert max(np.nanmax(line.get_ydata()) for line in plain.lines) < 0
