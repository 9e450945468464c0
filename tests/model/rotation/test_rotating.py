"""Structures that turn: at one speed, along an engine order, sectors of them."""

import numpy as np
import pytest
import scipy.sparse as sp
import xarray as xr

import symhbm as sh
from tests.designs import ring
from tests.refusals import refused

ORDER, PER_MINUTE = 3, 2 * np.pi / 60
MASS, DAMPING = np.array([[1.0, 0.1], [0.1, 0.8]]), np.diag([2.0, 3.0])
AT_REST = np.array([[1.2e4, -2e3], [-2e3, 2e4]])
STIFFENING = np.array([[2.0, -0.2], [-0.2, 1.0]])
FOURTH = np.array([[3e-5, 1e-5], [1e-5, 2e-5]])
CORIOLIS = np.array([[0.0, -0.6], [0.6, 0.0]])
SLIDER = dict(contact_stiffness=5e3, friction_coefficient=0.4, normal_load=2.0)
FORCE = sh.forces.HarmonicForce(cosine={1: [1, 0]}, sine={1: [0, 0.5]})


def stiffness_at(speed: float, fourth: bool = True) -> np.ndarray:
    square = (PER_MINUTE * speed) ** 2
    return AT_REST + square * STIFFENING + fourth * square**2 * FOURTH


def contacts() -> dict[str, sh.Contacts]:
    return {
        "own": sh.Friction(
            tangential=(0,),
            normal=(1,),
            contact_stiffness=5e3,
            normal_stiffness=4e3,
            friction_coefficient=0.4,
            normal_load=2.0,
            centrifugal_load=0.01,
            engine_order=ORDER,
        )
    }


def rotor_of(speeds=(0, 300, 500), coriolis=CORIOLIS, **named: sh.Contacts) -> sh.RotatingModel:
    model = sh.Model(MASS, DAMPING, AT_REST, contacts=named or ())
    stiffness = {speed: stiffness_at(speed, fourth=len(speeds) > 2) for speed in speeds}
    return sh.RotatingModel(model, stiffness, coriolis=coriolis)


class Wave(sh.forces.EngineOrder):
    """The force of an engine order on two degrees of freedom that are no blades."""

    def shape(self, n_dof, basis):
        return FORCE.shape(n_dof, basis)


@pytest.mark.parametrize("speeds", [(0, 400), (200, 500), (100, 300, 600)])
def test_the_stiffness_is_that_of_each_run(speeds):
    rotor = rotor_of(speeds)
    for speed in (*speeds, 250):
        exact = stiffness_at(speed, fourth=len(speeds) > 2)
        np.testing.assert_allclose(rotor.at(speed).stiffness_matrix.toarray(), exact, rtol=1e-11)
    turning = PER_MINUTE * 250
    damping = rotor.at(250).damping_matrix.toarray()
    np.testing.assert_allclose(damping, DAMPING + turning * CORIOLIS)


@pytest.mark.parametrize("harmonics", [(0, 1), (0, 1, 2, 3)])
def test_a_point_of_an_engine_order_is_one_at_its_speed(harmonics):
    rotor, force = rotor_of(**contacts()), Wave(ORDER, amplitude=8.0)
    along = sh.HarmonicBalance(rotor, force, harmonics)
    for frequency in (30.0, 17.0, 21.0):
        at = sh.HarmonicBalance(rotor.at(60 * frequency / ORDER), force, harmonics)
        one, other = sh.solve(along, frequency), sh.solve(at, frequency)
        np.testing.assert_allclose(one.coefficient, other.coefficient, rtol=1e-8, atol=1e-14)
        assert one.speed.item() == pytest.approx(60 * frequency / ORDER)
    assert one.stick_fraction.item() < 1


@pytest.mark.parametrize("archived", [False, True])
def test_the_speed_of_swept_engine_orders_is_that_of_each(archived, tmp_path):
    problem = sh.HarmonicBalance(rotor_of(), Wave(ORDER, amplitude=8.0))
    over = {"force_amplitude": [4.0, 8.0], "engine_order": [2, -3, 4]}
    to = {"archive": tmp_path / "orders.nc"} if archived else {}
    response = sh.frf(problem, (10, 60), over=over, progress=False, **to)
    orders = abs(response.engine_order)
    for name in ("speed", "peak_speed", "event_speed"):
        frequency = response[name.replace("speed", "frequency")]
        assert frequency.notnull().any() or name == "event_speed"
        xr.testing.assert_allclose(response[name].drop_attrs(), 60 * frequency / orders)
    paired = {name: xr.DataArray(values[-2:], dims="case") for name, values in over.items()}
    response = sh.frf(problem, (10, 60), over=paired, progress=False)
    xr.testing.assert_allclose(
        response.speed.drop_attrs(), 60 * response.frequency / abs(response.engine_order)
    )


def test_a_whirling_rotor_splits_by_its_speed():
    """Isotropic, in its rotating frame: ``omega_0 - Omega`` and ``omega_0 + Omega``."""
    mass, natural = 2.0, 100.0
    at_rest = mass * natural**2 * np.eye(2)
    softening = {s: at_rest - mass * (PER_MINUTE * s) ** 2 * np.eye(2) for s in (0, 300)}
    coriolis = 2 * mass * np.array([[0, -1], [1, 0]])
    still = sh.Model(mass * np.eye(2), np.zeros((2, 2)), at_rest)
    rotor = sh.RotatingModel(still, softening, coriolis=coriolis)
    turning = PER_MINUTE * 250
    modes = sh.natural_modes(rotor.at(250), count=2)
    expected = np.array([natural - turning, natural + turning]) / (2 * np.pi)
    np.testing.assert_allclose(modes.frequency, expected, rtol=1e-12)


def test_many_degrees_of_freedom_have_the_same_modes():
    rng, n = np.random.default_rng(1), 300
    chain = sp.diags_array([np.full(n - 1, -1.0), np.full(n, 2.1)], offsets=[1, 0])
    stiffness = 1e4 * (chain + chain.T)
    skew = sp.random_array((n, n), density=0.01, rng=rng)
    model = sh.Model(sp.eye_array(n), sp.csc_array((n, n)), stiffness)
    rotor = sh.RotatingModel(model, {0: stiffness, 100: 1.1 * stiffness}, coriolis=skew - skew.T)
    at = rotor.at(1000)
    modes = sh.natural_modes(at, count=5).frequency.values
    _, damping, elastic = (part.toarray() for part in at.matrices())
    whole = np.block([[np.zeros((n, n)), np.eye(n)], [-elastic, -damping]])
    exact = np.sort(np.abs(np.linalg.eigvals(whole).imag))[::2][:5] / (2 * np.pi)
    np.testing.assert_allclose(modes, exact, rtol=1e-9)


@pytest.mark.parametrize("speed", [1000, 2500])
def test_many_degrees_of_freedom_have_modes_above_their_critical_speeds(speed):
    """Of whirling masses on a chain: ``|omega_k - Omega|`` and ``omega_k + Omega``."""
    n, turning = 150, PER_MINUTE * speed
    chain = sp.diags_array([np.full(n - 1, -1.0)] * 2, offsets=[1, -1]) + 2 * sp.eye_array(n)
    one = 5e3 * chain + sp.diags_array(np.linspace(8e3, 1e4, n))
    mass, stiffness = sp.eye_array(2 * n), sp.kron(one, sp.eye_array(2))
    skew = sp.kron(sp.eye_array(n), np.array([[0, -2.0], [2, 0]]))
    runs = {s: stiffness - (PER_MINUTE * s) ** 2 * mass for s in (0, 1000)}
    rotor = sh.RotatingModel(sh.Model(mass, 0 * mass, stiffness), runs, coriolis=skew)
    natural = np.sqrt(np.linalg.eigvalsh(one.toarray()))
    assert natural[0] < turning
    exact = np.sort(np.abs([natural - turning, natural + turning]), axis=None) / (2 * np.pi)
    modes = sh.natural_modes(rotor.at(speed), count=5)
    np.testing.assert_allclose(modes.frequency, exact[:5], rtol=1e-9)


def test_motions_that_grow_are_refused_of_many_degrees_of_freedom_too():
    n = 150
    stiffness = sp.diags_array(np.tile([1e4, 1.2e4], n))
    mass = sp.eye_array(2 * n)
    skew = sp.kron(sp.eye_array(n), np.array([[0, -2.0], [2, 0]]))
    runs = {s: stiffness - (PER_MINUTE * s) ** 2 * mass for s in (0, 1000)}
    rotor = sh.RotatingModel(sh.Model(mass, 0 * mass, stiffness), runs, coriolis=skew)
    with pytest.raises(ValueError, match="Coriolis forces that hold"):
        sh.natural_modes(rotor.at(1000), count=5)  # between 100 and 109.5 rad/s


def turned(stiffness, coriolis=None):
    return sh.RotatingModel(sh.Model(MASS, DAMPING, AT_REST), stiffness, coriolis)


RUNS, PATTERN = {0: AT_REST, 100: AT_REST}, sh.forces.EngineOrder(ORDER, pattern={0: 1.0})
RUBBING = rotor_of((0, 300), tip=sh.Contacts(sh.laws.Coulomb(), (0,), **SLIDER))
DISK = sh.Sector(rotor_of((0, 300)), [0], [1], 6)
test_what_is_no_rotation_is_refused = refused([
    (lambda: turned({0: AT_REST}), ValueError, "two or three different speeds"),
    (lambda: turned({0: AT_REST, -5: AT_REST}), ValueError, "speed of stiffness"),
    (lambda: turned({0: AT_REST, 100: np.eye(3)}), ValueError, r"stiffness\[100\]"),
    (lambda: turned(RUNS, np.eye(2)), ValueError, "skew-symmetric"),
    (lambda: turned(RUNS, np.zeros((3, 3))), ValueError, "coriolis: expected shape"),
    (lambda: sh.HarmonicBalance(rotor_of(), sh.forces.PointForce()),
     ValueError, "one engine order"),
    (lambda: sh.periodic_motion(sh.HarmonicBalance(rotor_of(), Wave(ORDER)), 20.0),
     TypeError, r"RotatingModel.at\(speed\)"),
    (lambda: sh.condense(RUBBING, Wave(ORDER), (10, 40)), TypeError, r"RotatingModel.at\(speed\)"),
    (lambda: sh.craig_bampton(RUBBING, 1, (10, 40)), TypeError, r"RotatingModel.at\(speed\)"),
    (lambda: sh.condense(DISK, PATTERN, (10, 40), (0, 1)), (TypeError, ValueError), r"at\(speed\)"),
    (lambda: sh.craig_bampton(DISK, 1, (10, 40)), (TypeError, ValueError), r"at\(speed\)"),
    (lambda: sh.mistuned_ring(DISK), (TypeError, ValueError), r"at\(speed\)"),
    (lambda: sh.natural_modes(rotor_of()), TypeError, r"at\(speed\)"),
    (lambda: sh.natural_modes(DISK), TypeError, r"at\(speed\)"),
])  # fmt: skip


def test_at_a_speed_it_is_reduced_and_has_modes():
    assert sh.mistuned_ring(DISK.at(200)).n_dof == 6
    assert sh.natural_modes(DISK.at(200), 1).sizes["mode"] == 1


def test_blades_with_parameters_of_their_own_have_none_left():
    disk = ring(3).model
    at_rest = disk.stiffness_matrix.toarray()
    rotor = sh.RotatingModel(disk, {0: at_rest, 300: 1.2 * at_rest})
    assert not {"mass", "stiffness", "damping"} & {*rotor.parameters}
    np.testing.assert_allclose(rotor.at(300).stiffness_matrix.toarray(), 1.2 * at_rest)
