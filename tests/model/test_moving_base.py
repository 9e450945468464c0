"""Moving bases, forces that change with the frequency, and fields over nodes."""

import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from symhbm.numerics import RADIANS, FourierBasis
from tests.designs import ring
from tests.refusals import refused

M, C, K = 1.3, 4.0, 2e4
GIVEN = ("displacement", "velocity", "acceleration")


def moved(displacement, **options):
    return sh.forces.BaseMotion(displacement=displacement, **options)


def chain(n=4, places=None, **friction):
    """Masses in a row, all held by the ground, the last one rubbing on it if ``friction``."""
    stiffness = 1e4 * (3 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    contacts = dict(contacts=[(n - 1,)], **friction) if friction else {}
    mass = np.diag(1.0 + np.arange(n))
    return sh.Model(mass, 1e-5 * stiffness + 0.5 * mass, stiffness, places=places, **contacts)


FRICTION = dict(contact_stiffness=5e3, friction_coefficient=0.5, normal_load=2.0)


@pytest.mark.parametrize("motion", ["relative", "absolute"])
@pytest.mark.parametrize("order", range(3))
@pytest.mark.parametrize("harmonics", [(1,), (3, 1)])
def test_an_oscillator_moves_as_its_transmissibility_tells(order, motion, harmonics):
    harmonic = harmonics[0]
    hertz = np.array([2.0, 6.0, 19.0, 25.0])
    s = 1j * harmonic * RADIANS * hertz
    amplitude = 2e-3 * np.exp(0.7j)
    base = sh.forces.BaseMotion(**{GIVEN[order]: amplitude}, motion=motion, harmonic=harmonic)
    problem = sh.HarmonicBalance(sh.Model([[M]], [[C]], [[K]]), base, harmonics)
    response = sh.frf(problem, (1, 30), at=hertz, progress=False)
    moved = amplitude / s**order
    both = {"absolute": (K + s * C), "relative": -M * s**2}
    for seen, where in (("relative", "base"), ("absolute", "ground")):
        found = sh.datasets.motion(sh.datasets.seen_from(response, where)).complex_amplitude
        found = found.sel(harmonic=harmonic).values[:, 0]
        exact = both[seen] * moved / (K + s * C + M * s**2)
        np.testing.assert_allclose(found, exact, rtol=1e-12)
        if seen == motion:
            solved = (
                sh.datasets.motion(response).complex_amplitude.sel(harmonic=harmonic).values[:, 0]
            )
            np.testing.assert_allclose(solved, exact, rtol=1e-12)
            assert response.attrs["displacements"].startswith(seen)


def test_peaks_of_transmissibilities_are_where_closed_forms_have_them():
    natural, ratio = np.sqrt(K / M), C / (2 * np.sqrt(K * M))
    at = {}
    for motion in ("relative", "absolute"):
        base = moved(1e-3, motion=motion)
        problem = sh.HarmonicBalance(sh.Model([[M]], [[C]], [[K]]), base)
        at[motion] = sh.frf(problem, (10, 30), progress=False)
    exact = natural / np.sqrt(1 - 2 * ratio**2) / RADIANS
    np.testing.assert_allclose(at["relative"].peak_frequency, exact, rtol=1e-9)
    exact = natural * np.sqrt((np.sqrt(1 + 8 * ratio**2) - 1) / (4 * ratio**2)) / RADIANS
    np.testing.assert_allclose(at["absolute"].peak_frequency, exact, rtol=1e-9)


def test_translations_follow_the_directions_of_places():
    places = sh.Places(node=[1, 1, 2, 2], direction=["x", "y", "x", "y"])
    model, basis = chain(places=places), FourierBasis((1,))
    (shape,) = sh.forces.BaseMotion(acceleration=1.0, direction="y").shapes(model, basis).values()
    np.testing.assert_array_equal(shape[:, 0], [0, -2, 0, -4])
    named = sh.forces.BaseMotion(acceleration=1.0, influence={"1:y": 1.0, "2:y": 1.0})
    problem = sh.HarmonicBalance(model, named)
    np.testing.assert_array_equal(problem.force(1.0)[:, 0], [0, -2, 0, -4])


def test_masses_of_samples_move_with_their_base():
    problem = ring(3, 1e4).with_excitation(sh.forces.BaseMotion(acceleration=1.0))
    heavy = problem.with_parameters(mass=[1, 2, 3])
    np.testing.assert_array_equal(heavy.force(5.0)[:, 0], [-1, -2, -3])
    assert sh.frf(problem, (10, 30), progress=False).n_sectors.item() == 3


def test_an_unbalance_grows_with_the_square_of_the_frequency():
    force = sh.forces.FrequencyForce(
        {2: sh.forces.PointForce(phase=0.3), 0: sh.forces.PointForce(amplitude=0.0)}, 2e-3
    )
    problem = sh.HarmonicBalance(sh.Model([[M]], [[C]], [[K]]), force)
    for hertz in (3.0, 25.0):
        omega = RADIANS * hertz
        exact = 2e-3 * omega**2 / abs(K - M * omega**2 + 1j * C * omega)
        assert sh.solve(problem, hertz).amplitude.item() == pytest.approx(exact, rel=1e-12)
    motion = sh.periodic_motion(problem, 25.0)
    assert motion.amplitude.item() == pytest.approx(exact, rel=1e-9)


PLACES = sh.Places(node=[7, 7, 9, 9], direction=["x", "y", "x", "y"], label=["tip", "tip", "", ""])


def test_fields_are_forces_by_any_way_to_tell_them():
    model = chain(places=PLACES)
    row = np.array([1.0, 0.5j, 0.0, 2.0 - 1.0j])
    labelled = xr.DataArray(
        row.reshape(2, 2), dims=("node", "direction"),
        coords={"node": [7, 9], "direction": ["x", "y"]},
    )  # fmt: skip
    named = {"tip:x": 1.0, "7:y": 0.5j, "9:y": 2.0 - 1.0j}
    pairs = sh.forces.nodal_field([9, 7], row.reshape(2, 2)[::-1], ("x", "y"))
    each = [sh.forces.FieldForce(given) for given in (row, labelled, named, pairs, {1: labelled})]
    each.append(
        sh.forces.HarmonicForce({1: {"tip:x": 1.0, "9:y": 2.0}}, {1: {"7:y": -0.5, "9:y": 1.0}})
    )
    forces = [sh.HarmonicBalance(model, force).force(1.0) for force in each]
    for force in forces:
        np.testing.assert_array_equal(force, np.column_stack([row.real, -row.imag]))


def on_chain(force):
    return sh.HarmonicBalance(chain(places=PLACES), force)


def field(pattern):
    return on_chain(sh.forces.FieldForce(pattern))


def wave(cosine):
    return on_chain(sh.forces.HarmonicForce(cosine))


def power(forces):
    return on_chain(sh.forces.FrequencyForce(forces))


def base(*given, **options):
    return on_chain(moved(*given, **options))


test_mistakes_are_named = refused([
    (lambda: field([1.0, np.nan, 0, 0]), ValueError, "pattern=.*finite"),
    (lambda: field([1.0, 2.0]), ValueError, r"pattern: expected 4 values.*got 2"),
    (lambda: field({"8:x": 1.0}), KeyError, r"pattern\[1\]: 8 is no node.*7"),
    (lambda: field({"7:z": 1.0}), KeyError, r"pattern\[1\]: '7:z' is no place; 7 has x, y"),
    (lambda: field({"tip:x": 1, "7:x": 1}), ValueError, "each place once"),
    (lambda: sh.forces.nodal_field([7], [[1.0, np.inf]], ("x", "y")), ValueError, r"node 7.*'y'"),
    (lambda: sh.forces.nodal_field([7], [1.0, 2.0]),
     ValueError, r"values: expected shape \(1, 3\)"),
    (lambda: sh.forces.nodal_field([7, 7], np.ones((2, 3))), ValueError, "each node once"),
    (lambda: wave({1: {"tip:z": 1.0}}), KeyError, r"cosine\[1\]: 'tip:z' is no"),
    (lambda: wave({1: {}}), ValueError, r"cosine\[1\]=\{\}: expected at least"),
    (lambda: wave({0: {"tip:z": 1.0}}), KeyError, "mean: 'tip:z' is no"),
    (lambda: sh.forces.BaseMotion(), ValueError, "expected one of them, got 0"),
    (lambda: sh.forces.BaseMotion(9.81), TypeError, "positional"),  # of what would not be said
    (lambda: base(1.0, velocity=2.0), ValueError, "expected one of them, got 2"),
    (lambda: base("a"), TypeError, "displacement='a': expected a complex number"),
    (lambda: base(np.inf), ValueError, "displacement=inf: expected finite"),
    (lambda: base(1.0, motion="moving"), ValueError, "motion='moving'.*relative"),
    (lambda: base(1.0, influence=[1.0]), ValueError, r"expected 4 values.*got 1"),
    (lambda: base(1.0, influence=[0.0] * 4), ValueError, "expected a motion"),
    (lambda: power({}), TypeError, r"forces=\{\}: expected \{power: force\}"),
    (lambda: power({1: sh.forces.StaticLoad([1.0])}), ValueError, "oscillates alone"),
    (lambda: power({0.5: sh.forces.PointForce()}), ValueError, "power of forces=0.5"),
    (lambda: base(1.0), ValueError, "direction=None: expected that of the base"),
    (lambda: base(1.0, direction="z"),
     ValueError, r"direction='z': expected one of the structure.*x, y"),
    (lambda: sh.HarmonicBalance(sh.craig_bampton(chain(), 2, (5, 30), places=[2]), moved(1e-4)),
     TypeError, r"expected BaseMotion\(\.\.\.\)\.on\(structure\)"),
    (lambda: sh.datasets.seen_from(sh.solve(on_chain(sh.forces.PointForce()), 5.0), "ground"),
     ValueError, r"expected a response to a symhbm\.forces\.BaseMotion"),
])  # fmt: skip


@pytest.mark.parametrize(
    ("motion", "made_of"), [("relative", {"mass"}), ("absolute", {"stiffness", "damping"})]
)
def test_no_derivative_leaves_out_that_the_force_changes(motion, made_of):
    """The force of a base is one of matrices: derivatives by these are not told at all."""
    contact = dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3)
    blade = sh.single_blade(mass=1, stiffness=1e4, damping=0.5, **contact)
    problem = sh.HarmonicBalance(blade, sh.forces.BaseMotion(acceleration=1.0, motion=motion))
    assert {"mass", "stiffness", "damping"} - {*problem.differentiable} == made_of
    for name in made_of:
        with pytest.raises(ValueError, match=f"{name}: expected a parameter that the force"):
            sh.follow(problem, name, (0.9, 1.1), frequency=15)
        loaded = problem.with_excitation(sh.forces.PointForce())
        assert name in loaded.differentiable


def complex_motion(result, dof):
    """First harmonic of a result as a complex number."""
    cosine, sine = (
        result.coefficient.isel(harmonic=0).transpose(..., "dof", "component").values[dof]
    )
    return cosine - 1j * sine


def test_outputs_are_seen_from_the_ground_by_their_weights():
    weights = {"sensor": {3: 2.0}, "strain": {1: -1e3, 2: 1e3}}
    model = chain().with_outputs(weights, units={"sensor": "m", "strain": "1"})
    for base in (moved(1e-3 + 5e-4j, influence=[1.0, 2, 3, 4]), moved(1e-3)):
        point = sh.solve(sh.HarmonicBalance(model, base), 17.0)
        ground = sh.datasets.seen_from(point, "ground")
        for name, row in weights.items():
            expected = sum(w * complex_motion(ground, dof) for dof, w in row.items())
            found = sh.datasets.seen_from(sh.datasets.output(point, name), "ground")
            np.testing.assert_allclose(complex_motion(found, 0), expected, rtol=1e-12)
            np.testing.assert_allclose(found.amplitude, abs(expected), rtol=1e-9)


@pytest.mark.parametrize("modes", [1, 2])
def test_reduced_structures_under_several_bases_are_seen_from_the_ground(modes):
    """Whatever stands first in the sum, and also where all modes are kept."""
    model = chain(**FRICTION).with_outputs({"sensor": {2: 1.0}}, units="m")
    bases = moved(1e-4), moved(3e-5j, influence=[1.0, 0, 0, 2])
    force = bases[0].on(model) + sh.forces.PointForce(2, 3.0) + bases[1].on(model)
    force = sh.forces.PointForce(1, 2.0) + force
    small = sh.craig_bampton(model, modes, (5, 30), places=[2])
    found = sh.solve(sh.HarmonicBalance(small, force), 12.0)
    whole = sh.solve(sh.HarmonicBalance(model, force), 12.0)
    near = 1e-11 if modes == 2 else 2e-2
    for result in (found, sh.solve(sh.datasets.rebuild(found), 12.0)):
        ground, exact = (sh.datasets.seen_from(each, "ground") for each in (result, whole))
        for place in (2, 3):
            own = [*found.structure_dof.values].index(place)
            expected = complex_motion(exact, place)
            np.testing.assert_allclose(complex_motion(ground, own), expected, rtol=near)
    lifts = [complex_motion(exact, at) - complex_motion(whole, at) for at in range(4)]
    np.testing.assert_allclose(lifts, 1e-4 + 3e-5j * np.array([1.0, 0, 0, 2]), rtol=1e-9)
    sensor = sh.datasets.output(found, "sensor")
    np.testing.assert_allclose(complex_motion(sensor, 0), complex_motion(whole, 2), rtol=near)
    np.testing.assert_allclose(
        complex_motion(sh.datasets.seen_from(sensor, "ground"), 0),
        complex_motion(sh.datasets.seen_from(whole, "ground"), 2),
        rtol=near,
    )


def axial_sector(damping=None, rotor=False):
    """Masses along the axis, held by the ground, each with a blade upon it."""
    stiffness = np.array([[3e4, -1e4, -1e4], [-1e4, 1.5e4, 0], [-1e4, 0, 1e4]])
    places = dict(node=[1, 2, 3], direction=["axial"] * 3)
    given = np.diag([3.0, 2.0, 0]) if damping is None else damping
    model = sh.Model(np.diag([1.0, 0.4, 0]), given, stiffness, places=places)
    if rotor:
        model = sh.RotatingModel(model, {0: stiffness, 600: stiffness + 5e3 * np.eye(3)})
    return sh.Sector(model, [0], [2], 5)


@pytest.mark.parametrize("damping", [None, sh.ModalDamping(0.02), sh.RayleighDamping(1, 1e-5)])
@pytest.mark.parametrize("motion", ["relative", "absolute"])
def test_bases_of_sectors_and_their_rings(damping, motion):
    """The whole disk moves as one degree of freedom more: its wave of no nodal diameters."""
    sector = axial_sector(damping)
    base = moved(1e-3, motion=motion, direction="axial").on(sector)
    own = sh.solve(sh.HarmonicBalance(sector, base), 19.0)
    mass, viscous, stiffness = (each.toarray().real for each in sector.matrices(0))
    s, moves = 2j * np.pi * 19.0, np.ones(2) * 1e-3
    dynamic = stiffness + s * viscous + s**2 * mass
    right = -(s**2) * mass if motion == "relative" else stiffness + s * viscous
    exact = np.linalg.solve(dynamic, right @ moves)
    found = np.array([complex_motion(own, dof) for dof in (0, 1)])
    np.testing.assert_allclose(found, exact, rtol=1e-11)
    ring = sh.solve(sh.HarmonicBalance(sh.mistuned_ring(sector), base), 19.0)
    seen = sh.datasets.seen_from(ring, "ground" if motion == "relative" else "base")
    other = exact + moves if motion == "relative" else exact - moves
    for sector_number in range(5):
        dofs = 2 * sector_number, 2 * sector_number + 1
        np.testing.assert_allclose([complex_motion(ring, d) for d in dofs], exact, rtol=1e-11)
        np.testing.assert_allclose([complex_motion(seen, d) for d in dofs], other, rtol=1e-11)


def test_bases_of_what_deviates_or_turns_are_refused():
    sector = axial_sector()
    for motion, name in (("absolute", "stiffness_deviation"), ("relative", "mass_deviation")):
        base = moved(1e-3, motion=motion, direction="axial").on(sector)
        deviating = sh.mistuned_ring(sector, **{name: 0.01 * np.arange(5)})
        with pytest.raises(ValueError, match=name):
            sh.solve(sh.HarmonicBalance(deviating, base), 19.0)
    turning = axial_sector(rotor=True)
    with pytest.raises(ValueError, match="structure at one speed"):
        moved(1e-3, motion="absolute", direction="axial").on(turning)
    moved(1e-3, motion="absolute", direction="axial").on(turning.at(300))


@pytest.mark.parametrize("damping", [np.diag([1.0, 2.0, 3.0]), sh.StructuralDamping(0.02)])
@pytest.mark.parametrize("motion", ["relative", "absolute"])
def test_a_base_moves_what_turns_along_its_axis_alone(damping, motion):
    """Across the axis Coriolis forces act on the motion of the base, whose direction turns."""
    stiffness = 1e4 * np.diag([1.0, 2, 3])
    model = sh.Model(np.eye(3), damping, stiffness)
    skew = np.array([[0, 1.0, 0], [-1, 0, 0], [0, 0, 0]])
    rotor = sh.RotatingModel(model, {0: stiffness, 600: 1.1 * stiffness}, skew).at(300)
    with pytest.raises(ValueError, match="along the axis of rotation"):
        sh.HarmonicBalance(rotor, moved(1e-3, motion=motion, influence=[1.0, 0, 1]))
    along = sh.HarmonicBalance(rotor, moved(1e-3, motion=motion, influence=[0, 0, 1.0]))
    assert sh.solve(along, 19.0).amplitude[2] > 0
