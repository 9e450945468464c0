"""Derivatives of stored peaks: against whole responses on both sides, symmetry and archives."""

import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from symhbm.model import PARAMETERS
from symhbm.peaks.sensitivity import AT_REST, EXACT, NOT_VERIFIED, UNBOUNDED
from symhbm.results.variables import derivative
from tests.designs import blade, ring
from tests.problems import ring_of_blades
from tests.quick import quick_first

BLADE = blade(normal_load=3)
TUNED = ring(5, 1e5, 1)
LOADS = np.array([18.0, 22.0, 15.0, 25.0])
RING = ring(
    4, [9e4, 1.1e5, 1e5, 1.2e5], 1, stiffness=[1.01e4, 0.99e4, 1e4, 1.02e4], normal_load=LOADS
)
BAND = 50, 110


def frf(problem, band=BAND, **options):
    return sh.frf(problem, band, progress=False, **options)


def both_sides(problem, name, step, index=..., band=BAND, **options):
    """Responses with one parameter smaller and larger by a share of itself, and the difference."""
    sides = np.array([problem.parameters[name]] * 2, dtype=float)
    size = 2 * step * sides[0][index].flat[0]
    for side, sign in zip((0, 1), (-1, 1), strict=True):
        sides[(side, index)] *= 1 + sign * step
    dim = {"stiffness": "dof", "mass": "dof", "damping": "dof"}.get(name, "contact")
    over = {name: xr.DataArray(sides, dims=("side", dim)[: sides.ndim])}
    responses = frf(problem, band, over=over, **options)
    return responses.isel(side=0), responses.isel(side=1), size


def nearest(dataset, frequency, dof):
    """The peak of one degree of freedom that is closest to a frequency."""
    same_dof = dataset.isel(peak=np.flatnonzero(dataset.peak_dof.values == dof))
    return same_dof.isel(peak=int(np.argmin(np.abs(same_dof.peak_frequency.values - frequency))))


def test_which_contact_matters_most():
    response = frf(RING, peaks="each")
    derivatives = sh.datasets.sensitivity(response)
    assert (derivatives.sensitivity_status == EXACT).all()
    assert {"smooth", "corner"} == {*derivatives.peak_kind.values}
    # Each blade peaks alone where the disk is mistuned.
    has_derivatives = np.isfinite(derivatives.peak_amplitude_by_force_amplitude.values)
    assert (
        has_derivatives == (derivatives.peaking_dof.values == response.peak_dof.values[:, None])
    ).all()
    highest = derivatives.isel(peak=derivatives.peak_amplitude.argmax("peak"))
    dof = int(highest.peak_dof)
    exact = highest.peak_amplitude_by_normal_load.sel(peaking_dof=dof)
    for contact in range(4):
        band = highest.peak_frequency.item() + np.array([-2, 2])
        low, high, size = both_sides(RING, "normal_load", 1e-4, contact, band, peaks="each")
        pair = (nearest(side, float(highest.peak_frequency), dof) for side in (low, high))
        low, high = (side.peak_amplitude.item() for side in pair)
        # The square of the step.
        difference = (high - low) / size
        assert difference == pytest.approx(
            exact.values[contact], abs=1e-5 * np.abs(exact).max().item()
        )
    highest_peak = response.isel(peak=response.peak_amplitude.argmax("peak"))
    by_load = sh.datasets.sensitivity(highest_peak).peak_amplitude_by_normal_load
    assert abs(by_load).max("peaking_dof").idxmax("contact") == abs(exact).argmax("contact")


def test_slopes_of_both_sides_at_the_onset_of_slip():
    """Against differences to either side; one side sticks, and the other dissipates."""
    band = (15, 30)
    stuck = frf(BLADE.with_parameters(normal_load=1e4), band).peak_amplitude.item()
    problem = BLADE.with_parameters(normal_load=stuck * 1e4 / 0.5)
    found = sh.datasets.sensitivity(frf(problem, band))
    assert found.sensitivity_status.item().startswith("one-sided: contact 0 begins to slip here")
    for name in ("damping", "normal_load", "stiffness", "contact_stiffness", "force_amplitude"):
        for sign, side in ((1, ""), (-1, "_towards_smaller")):
            step = sign * 1e-5 * float(np.max(problem.parameters[name]))
            moved = problem.with_parameters(**{name: np.max(problem.parameters[name]) + step})
            slope = (frf(moved, band).peak_amplitude.item() - stuck) / step
            told = found[f"peak_amplitude_by_{name}{side}"].item()
            # The step, and heights to 1e-9 over it.
            assert told == pytest.approx(slope, rel=1e-3, abs=1e-9 * abs(stuck / step))
        smaller = found[f"peak_amplitude_by_{name}_towards_smaller"]
        assert "towards smaller" in smaller.long_name
    # More damping sticks: the frequency of that side is known, that of the other is not.
    assert np.isfinite(found.peak_frequency_by_damping).all()
    assert np.isnan(found.peak_frequency_by_damping_towards_smaller).all()
    beside = sh.datasets.sensitivity(frf(problem.with_parameters(damping=0.5001), band))
    assert beside.sensitivity_status.item() == EXACT
    assert "peak_amplitude_by_damping_towards_smaller" not in beside


def test_contacts_that_begin_to_slip_together_have_no_slopes():
    stuck = frf(TUNED.with_parameters(normal_load=1e5))
    relative = 2 * np.sin(np.pi / 5) * stuck.peak_amplitude.max().item()
    found = sh.datasets.sensitivity(frf(TUNED.with_parameters(normal_load=relative * 1e5 / 0.5)))
    assert "contacts 0, 1, 2, 3, 4 are on their limits" in found.sensitivity_status.item()


def test_blades_that_do_not_peak():
    """A disk with mistuned loads is tuned while all contacts stick, until the first onset."""
    response = frf(TUNED.with_parameters(normal_load=[14.1, 11.1, 12.3, 10.4, 14.4]), peaks="each")
    derivatives = sh.datasets.sensitivity(response)
    assert (derivatives.sensitivity_status == EXACT).all()
    coefficient = response.peak_coefficient.squeeze("harmonic")
    amplitude = np.hypot(coefficient.sel(component="cos"), coefficient.sel(component="sin"))
    equal = np.isclose(amplitude, response.peak_amplitude.values[:, None], rtol=1e-9, atol=0)
    has_derivatives = derivatives.peak_amplitude_by_force_amplitude.notnull().values
    # All blades have equal amplitudes here, though some rise further.
    all_equal = equal.all(axis=1)
    assert all_equal.sum() > 1
    for i in np.flatnonzero(all_equal):
        same_peak = np.isclose(
            response.peak_frequency, response.peak_frequency[i], rtol=1e-12, atol=0
        )
        assert (
            np.flatnonzero(has_derivatives[i]).tolist()
            == response.peak_dof.values[same_peak].tolist()
        )
        assert 0 < has_derivatives[i].sum() < 5


def test_two_parameters_and_a_pattern():
    rng = np.random.default_rng(2)
    loads = xr.DataArray(
        LOADS * rng.uniform(0.9, 1.1, (2, 4)), dims=("sample", "contact"), coords={"sample": [7, 8]}
    )
    over = {"force_amplitude": [0.8, 1.0], "normal_load": loads}
    derivatives = sh.datasets.sensitivity(frf(RING, (60, 85), over=over, at=[60.0, 80.0]))
    assert "frequency" not in derivatives.dims
    assert derivatives.sample.values.tolist() == [7, 8]
    has_peak = derivatives.peak_kind.values != ""
    assert (derivatives.sensitivity_status.values == np.where(has_peak, EXACT, "")).all()
    problem = sh.datasets.rebuild(derivatives.sel(sample=8, force_amplitude=0.8))
    np.testing.assert_array_equal(problem.model.normal_load, loads.sel(sample=8))
    alone = sh.datasets.sensitivity(frf(problem, (60, 85)))
    n_peaks = alone.sizes["peak"]
    same = derivatives.sel(sample=8, force_amplitude=0.8).isel(peak=slice(n_peaks))
    for name in ("normal_load", "mass", "force_amplitude"):
        for of in ("peak_amplitude", "peak_frequency"):
            swept, single = (side[f"{of}_by_{name}"] for side in (same, alone))
            # A sweep locates the peaks of each curve as a single curve does.
            np.testing.assert_allclose(swept.values, single.values, rtol=1e-6)


def test_engine_orders_share_their_equations():
    derivatives = sh.datasets.sensitivity(frf(TUNED, over={"engine_order": [1, 2]}))
    assert (derivatives.sensitivity_status == EXACT).all()
    alone = sh.datasets.sensitivity(frf(TUNED.with_parameters(engine_order=2)))
    xr.testing.assert_allclose(
        derivatives.peak_amplitude_by_mass.sel(engine_order=2, drop=True),
        alone.peak_amplitude_by_mass,
        rtol=1e-9,
    )


def test_peaks_have_their_own_harmonics():
    problem, band = BLADE.with_parameters(normal_load=1.5), (2, 40)
    response = frf(problem, band, accuracy=1e-2)
    assert response.peak_highest_harmonic.min() < response.harmonic.max()
    derivatives = sh.datasets.sensitivity(response)
    assert (derivatives.sensitivity_status == EXACT).all()
    index = int(response.peak_highest_harmonic.argmin("peak"))
    harmonics = tuple(range(1, int(response.peak_highest_harmonic[index]) + 1, 2))
    fixed = sh.datasets.sensitivity(frf(problem.with_harmonics(harmonics), band))
    reference = nearest(fixed, float(response.peak_frequency[index]), 0)
    for name in ("peak_amplitude_by_normal_load", "peak_frequency_by_damping"):
        # Both peaks are solved for to round-off on the same harmonics.
        np.testing.assert_allclose(derivatives[name].isel(peak=index), reference[name], rtol=1e-7)


def test_a_contact_without_load():
    problem = RING.with_parameters(normal_load=[0.0, *LOADS[1:]])
    response = frf(problem, (70, 110))
    derivatives = sh.datasets.sensitivity(response).isel(
        peak=response.peak_amplitude.argmax("peak")
    )
    assert derivatives.sensitivity_status == EXACT
    step = 1e-5
    loaded = frf(problem.with_parameters(normal_load=[step, *LOADS[1:]]), (70, 110))
    loaded = nearest(loaded, float(derivatives.peak_frequency), int(derivatives.peak_dof))
    for of in ("peak_amplitude", "peak_frequency"):
        difference = float(loaded[of] - derivatives[of]) / step
        exact = derivatives[f"{of}_by_normal_load"].sel(peaking_dof=derivatives.peak_dof, contact=0)
        # One-sided: the remainder goes with the root of the load over what moves the contact.
        assert difference == pytest.approx(exact.item(), rel=2e-2)


def mirrored():
    """A disk whose blades 1 and 4, 2 and 3 are alike, excited at blade 0."""
    rng = np.random.default_rng(10)
    stiffness, load = 1e4 * rng.uniform(0.9, 1.1, 3), rng.uniform(5, 20, 3)
    values = dict(stiffness=stiffness[[0, 1, 2, 2, 1]], normal_load=load[[0, 1, 2, 1, 0]])
    return sh.HarmonicBalance(ring(5, 1e5, **values).model, sh.forces.PointForce())


def test_contacts_on_their_limits_together():
    response = frf(mirrored(), (55, 70), peaks="each")
    derivatives = sh.datasets.sensitivity(response)
    exact = derivatives.sensitivity_status == EXACT
    together = derivatives.isel(peak=np.flatnonzero(~exact))
    assert together.sizes["peak"]
    assert (together.peak_kind == "corner").all()
    for text in together.sensitivity_status.values:
        assert text.startswith(("none: contacts 0, 4 are", "none: contacts 1, 3 are"))
    assert together.peak_amplitude_by_normal_load.isnull().all()
    others = derivatives.isel(peak=np.flatnonzero(exact))
    assert others.peak_frequency_by_mass.notnull().any(("peaking_dof", "dof")).all()


def test_contacts_on_their_limits_have_their_own_numbers():
    """Contacts of other laws come first, and have no switches."""
    disk = mirrored().model
    names = ("contact_stiffness", "friction_coefficient", "normal_load")
    values = {name: disk.parameters[name] for name in names}
    groups = {
        "spring": sh.Contacts(sh.laws.CubicSpring(), [(0,)], cubic_stiffness=0),
        "ring": sh.Contacts(sh.laws.Coulomb(), disk.contacts, **values),
    }
    model = sh.Model(disk.mass_matrix, disk.damping_matrix, disk.stiffness_matrix, contacts=groups)
    response = frf(sh.HarmonicBalance(model, sh.forces.PointForce()), (55, 70), peaks="each")
    status = sh.datasets.sensitivity(response).sensitivity_status.values
    together = [text for text in status if text != EXACT]
    assert together
    for text in together:
        assert text.startswith(("none: contacts 1, 5 are", "none: contacts 2, 4 are"))


def folding_ring():
    """Seven blades with cubic springs whose response folds where a contact ends to slip."""
    disk = ring_of_blades(
        7,
        mass=[0.98, 1.02, 1.02, 0.98, 0.98, 1.02, 1.02],
        stiffness=[10600, 9400, 10600, 9400, 9400, 9400, 10600],
        damping=0.249,
        contact_stiffness=[5183, 3456, 3456, 3456, 5183, 3456, 3456],
        friction_coefficient=[0.6, 0.4, 0.4, 0.6, 0.4, 0.6, 0.6],
        normal_load=[1.635, 2.452, 1.635, 2.452, 1.635, 2.452, 1.635],
        cubic_stiffness=1.117e8,
    )
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(1))


@pytest.mark.slow
def test_corner_at_a_fold():
    """With a cubic spring a contact may stick and slip on the same side of a corner."""
    problem, band = folding_ring(), (10, 17.2)
    response = frf(problem, band, peaks="each")
    corners = response.isel(peak=np.flatnonzero(response.peak_kind == "corner"))
    folds = response.event_frequency.values[response.event_kind.values == "fold"]
    folded = np.isin(corners.peak_frequency.values, folds)
    assert folded.any()
    derivatives = sh.datasets.sensitivity(corners)
    assert derivatives.sensitivity_status.values.tolist() == [EXACT] * corners.sizes["peak"]
    corner = corners.isel(peak=int(np.flatnonzero(folded)[0]))
    dof, exact = int(corner.peak_dof), derivatives.isel(peak=int(np.flatnonzero(folded)[0]))
    for name, index in (("normal_load", 3), ("contact_stiffness", 4)):
        low, high, size = both_sides(problem, name, 1e-6, index, band, peaks="each")
        pair = [nearest(side, float(corner.peak_frequency), dof) for side in (low, high)]
        for of in ("peak_amplitude", "peak_frequency"):
            derivative = exact[f"{of}_by_{name}"].sel(peaking_dof=dof).values
            difference = (pair[1][of] - pair[0][of]).item() / size
            assert difference == pytest.approx(
                derivative[index], abs=1e-5 * np.abs(derivative).max()
            )


@pytest.mark.parametrize("engine_order", quick_first([0, 1], 1))
def test_stiff_contacts_and_little_damping(engine_order):
    """The terms of a slope cancel to a ten-millionth, which leaves round-off."""
    problem = ring(
        5,
        [1.1e8, 0.9e8, 1e8, 1.2e8, 0.8e8],
        engine_order,
        (0, 1, 2),
        damping=0.05,
        stiffness=[1.001e4, 0.999e4, 1e4, 1.0005e4, 1e4],
        normal_load=[1.5, 1.2, 1.3, 1.1, 1.4],
    )
    response = frf(problem, (15, 17))
    derivatives = sh.datasets.sensitivity(response)
    assert derivatives.sensitivity_status.values.tolist() == [EXACT] * response.sizes["peak"]
    # Force and loads together scale the response, whatever it is.
    by_load = (derivatives.peak_amplitude_by_normal_load * problem.model.normal_load).sum("contact")
    scaled = (by_load + derivatives.peak_amplitude_by_force_amplitude).max("peaking_dof")
    np.testing.assert_allclose(scaled, response.peak_amplitude, rtol=1e-7)


def test_unbounded_peaks():
    problem = BLADE.with_parameters(damping=0, normal_load=1)
    derivatives = sh.datasets.sensitivity(frf(problem, (10, 40)))
    assert UNBOUNDED in derivatives.sensitivity_status.values
    unbounded = derivatives.isel(peak=np.flatnonzero(derivatives.sensitivity_status == UNBOUNDED))
    assert unbounded.peak_amplitude_by_mass.isnull().all()
    assert np.isinf(unbounded.peak_amplitude).all()


def test_contacts_at_rest():
    """All blades move in phase: no contact moves, so that its force would have a kink."""
    in_phase = TUNED.with_parameters(engine_order=0)
    assert (sh.datasets.sensitivity(frf(in_phase, (10, 30))).sensitivity_status == EXACT).all()
    for problem in (
        sh.HarmonicBalance(in_phase.model, in_phase.excitation, (0, 1, 2)),
        in_phase.with_parameters(normal_load=0),
    ):
        derivatives = sh.datasets.sensitivity(frf(problem, (10, 30)))
        assert derivatives.sensitivity_status.values.tolist() == [
            AT_REST.format(contacts="0, 1, 2, 3, 4")
        ]


def test_no_peaks():
    derivatives = sh.datasets.sensitivity(frf(BLADE, (5, 8)))
    assert derivatives.sizes["peak"] == 0
    assert derivatives.peak_amplitude_by_normal_load.shape == (0, 1, 1)


@pytest.mark.parametrize("factor", [0.9, 1.5, np.nan])
@pytest.mark.parametrize("name", ["peak_coefficient", "peak_amplitude", "peak_frequency"])
def test_damaged_numbers(name, factor):
    response = frf(BLADE, (15, 25))
    check_damaged(response.assign({name: response[name] * factor}))


@pytest.mark.parametrize(
    ("name", "value"), [("peak_dof", 1), ("peak_dof", -1), ("peak_kind", "edge")]
)
def test_damaged_labels(name, value):
    response = frf(BLADE, (15, 25))
    response[name] = response[name].copy(data=np.array([value], dtype=response[name].dtype))
    check_damaged(response)


def check_damaged(response):
    derivatives = sh.datasets.sensitivity(response)
    assert derivatives.sensitivity_status.values.tolist() == [NOT_VERIFIED]
    assert derivatives.peak_amplitude_by_mass.isnull().all()


def test_units():
    assert derivative("peak_amplitude", "normal_load").units == "m N-1"
    assert derivative("peak_amplitude", "contact_stiffness").units == "m2 N-1"
    assert derivative("peak_amplitude", "friction_coefficient").units == "m"
    assert derivative("peak_amplitude", "cubic_stiffness").units == "m4 N-1"
    assert derivative("peak_frequency", "damping").units == "Hz N-1 s-1 m"
    derivatives = sh.datasets.sensitivity(frf(BLADE, (15, 30)))
    for name in (str(name) for name in derivatives.data_vars if "_by_" in str(name)):
        variable = derivative(*name.split("_by_"))
        assert derivatives[name].attrs == {"units": variable.units, "long_name": variable.long_name}
        assert name.split("_by_")[1] in PARAMETERS


SAMPLED = sh.HarmonicBalance(BLADE.model, BLADE.excitation, (1,), samples=64)
FEW = dict(keep=["amplitude", "peak_frequency"], verifiable=False)
REFUSED = [
    (lambda: xr.Dataset(), "not written by symhbm"),
    (lambda: frf(BLADE, (15, 30), **FEW), "without peak_amplitude, peak_dof, peak_kind, peak_c"),
    (
        lambda: sh.follow(BLADE, "normal_load", (1, 3), frequency=19.5, progress=False),
        "over the frequency, got one without peak_frequency",
    ),
    (lambda: sh.solve(BLADE, 19.5), "expected a result of frf"),
    (lambda: frf(SAMPLED, (15, 30)), "friction over 64 samples"),
    (lambda: frf(RING, (55, 65)).isel(dof=0), "dimensions are missing"),
    (lambda: frf(RING, (55, 65)).isel(harmonic=[]), "expected coefficients of sizes"),
]


@pytest.mark.parametrize(("made", "words"), REFUSED)
def test_other_datasets_are_refused(made, words):
    with pytest.raises(sh.datasets.ArchiveError, match=words):
        sh.datasets.sensitivity(made())


def test_what_is_no_dataset_is_refused():
    with pytest.raises(TypeError, match="dataset=3: expected an xarray Dataset"):
        sh.datasets.sensitivity(3)


def test_opposite_instants_part_where_blades_deviate():
    """Blades that move against each other reach both extremes alike; one that deviates does not."""
    blade = sh.Model(np.diag([1.0, 0]), np.diag([6.0, 0]), [[1.2e4, -1e3], [-1e3, 1e3]])
    stop = sh.Gap(normal=(0, sh.next_sector(0)), normal_stiffness=3e3, normal_load=1.0)
    ring = sh.mistuned_ring(sh.Sector(blade, [0], [1], 4).with_contacts(stop=stop))
    force = sh.forces.EngineOrder(2, 5.0, pattern={0: 1.0})
    problem = sh.HarmonicBalance(ring, force, (0, 1, 2, 3))
    response = sh.frf(problem, (22, 24), progress=False, stability=False)
    found = sh.datasets.sensitivity(response).isel(peak=0, peaking_dof=0)
    assert "several instants" in found.sensitivity_status.item()
    name, step = "peak_amplitude_by_stiffness_deviation", 1e-5
    slopes = found[name].values, found[f"{name}_towards_smaller"].values

    def amplitude(deviation):
        changed = problem.with_parameters(stiffness_deviation=deviation)
        return sh.solve(changed, response.peak_frequency.item()).amplitude.values[0]

    for way, expected in zip((step, -step), slopes, strict=True):
        each = [amplitude(way * row) - amplitude(0.0) for row in np.eye(4)]
        np.testing.assert_allclose(np.array(each) / way, expected, atol=1e-5)
    by_stiffness = found.peak_amplitude_by_normal_stiffness
    assert np.isfinite(by_stiffness).all()
