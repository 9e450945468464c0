"""Disks of reduced sectors whose blades deviate."""

from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rings import assembled
from scipy.linalg import eigh

import symhbm as sh
from tests.problems import rub
from tests.sectors_to_reduce import chain_sector, plane_sector, plate_sector

TIP = 76
BLADE = np.arange(80).reshape(10, 8)[5:, 2:6].ravel()


def blade_alone(disk):
    """Stiffness, mass and modes of the blade held at its root: squares of frequencies, shapes."""
    at = np.ix_(BLADE, BLADE)
    stiffness = disk.structure.stiffness_matrix.toarray()[at]
    mass = disk.structure.mass_matrix.toarray()[at]
    return stiffness, mass, *eigh(stiffness, mass)


@pytest.fixture(scope="module")
def complete():
    """A sector in other coordinates, with all its modes and all of its blade."""
    disk = plate_sector(4)
    modes = 80 - len({*disk.interfaces.left, *disk.interfaces.right, 74, 77, TIP})
    small = sh.craig_bampton(
        disk, modes, (1, 40), places=[TIP], blade=BLADE, blade_modes=len(BLADE)
    )
    return disk, small


@pytest.mark.parametrize("name", ["stiffness_deviation", "frequency_deviation_0"])
def test_a_mistuned_ring_is_the_unreduced_one(complete, name):
    """With all modes: by springs that are added by hand to each blade of the assembled ring."""
    disk, small = complete
    values = 0.03 * np.random.default_rng(3).standard_normal(4)
    own, mass, squares, shapes = blade_alone(disk)
    mode = mass @ shapes[:, 0]
    added = np.outer(values, own).reshape(4, *own.shape)
    if name == "frequency_deviation_0":
        added = ((1 + values) ** 2 - 1)[:, None, None] * squares[0] * np.outer(mode, mode)
    inside = disk.structure.stiffness_matrix.toarray()[BLADE]
    rest = np.setdiff1d(np.arange(80), BLADE)
    # What resists the motion of the blade beside that with its root.
    relative = np.zeros((len(BLADE), 80))
    relative[:, BLADE] = np.eye(len(BLADE))
    relative[:, rest] = np.linalg.solve(inside[:, BLADE], inside[:, rest])
    ring = assembled(disk)
    blades = [relative @ motion for motion in ring.motions]
    springs = sum(b.T @ each @ b for b, each in zip(blades, added, strict=True))
    stiffness, of_ring = ring.model.stiffness_matrix.toarray(), ring.model.mass_matrix.toarray()
    exact, tuned = (
        np.sqrt(eigh(k, of_ring, eigvals_only=True)[:100]) / (2 * np.pi)
        for k in (stiffness + springs, stiffness)
    )
    found = sh.natural_modes(sh.mistuned_ring(small, **{name: values}), count=100).frequency
    assert_allclose(found, exact, rtol=1e-9)
    assert np.abs(exact / tuned - 1).max() > 1e-4


def test_the_blade_follows_its_root_freely():
    disk = plate_sector(4)
    ground = np.where(np.arange(80) < 8, 1e6, 10.0)
    stiffness = disk.structure.stiffness_matrix.toarray() - np.diag(ground)
    free = sh.Model(np.eye(80), np.zeros((80, 80)), stiffness)
    small = sh.craig_bampton(
        sh.Sector(free, disk.interfaces.left, disk.interfaces.right, 4), 20, (1, 40), places=[TIP],
        blade=BLADE,
    )  # fmt: skip
    together = np.ones(small.structure.n_dof)
    bent = small.blade.stiffness
    assert np.abs(bent @ together).max() < 1e-8 * np.abs(bent).max()


def test_places_of_a_ring_are_kept_by_name():
    """Those of the first sector; what is at its right interface moves as the next one's left."""
    disk = plane_sector(6)
    ring, force = sh.mistuned_ring(disk), sh.forces.EngineOrder(1, pattern={"4:x": 1.0})
    small = sh.condense(ring, force, (20, 80), (1,), places=["4:x"], progress=False)
    [place] = np.flatnonzero(ring.kept == disk.number_of("4:x"))
    assert place in small.dofs
    right = disk.interfaces.right[0]
    name = next(
        f"{node}:{way}"
        for node in set(disk.structure.places.node)
        for way in "xy"
        if disk.number_of(f"{node}:{way}") == right
    )
    with pytest.raises(ValueError, match="twins at the left"):
        sh.condense(ring, force, (20, 80), (1,), places=[name], progress=False)


@pytest.fixture(scope="module")
def of_chains():
    return sh.craig_bampton(chain_sector(4), 2, (1, 60), blade=[1, 2, 3], blade_modes=2)


VALUES = {
    "frequency_deviation_0": np.array([0.01, 0, -0.02, 0.005]),
    "frequency_deviation_1": np.array([-0.01, 0.02, 0, 0.03]),
    "mass_deviation": np.array([0.01, 0, 0, 0]),
}


@pytest.fixture(scope="module")
def of_modes(of_chains):
    ring = sh.mistuned_ring(of_chains, **VALUES)
    return sh.HarmonicBalance(ring, sh.forces.EngineOrder(1, pattern={3: 1.0}, amplitude=4.0))


BAND = (12, 25)


def test_derivatives_by_deviations(of_chains, of_modes):
    """Those of single modes beside those of all of the blade, at once and one after the other."""
    names = ("stiffness_deviation", "frequency_deviation", *VALUES)
    rng = np.random.default_rng(0)
    values = {name: 0.03 * rng.standard_normal(4) for name in names}
    problem = of_modes.with_parameters(**values)
    unknowns = 1e-3 * rng.standard_normal(problem.n_unknowns)
    for name in names:
        step = 1e-5 * rng.standard_normal(4)
        ends = [problem.with_parameters(**{name: values[name] + way * step}) for way in (1, -1)]
        quotient = (
            ends[0].evaluate(unknowns, 150.0).residual - ends[1].evaluate(unknowns, 150.0).residual
        ) / 2
        inputs = problem.arguments(unknowns, 150.0)
        derivative = problem.derivative(name).call(inputs)["jacobian"].full() @ step
        assert_allclose(derivative, quotient, atol=1e-7 * np.abs(quotient).max())
        whole = ends[0].model.stiffness_matrix, ends[0].model.mass_matrix
        again = sh.mistuned_ring(of_chains, **values | {name: values[name] + step})
        for found, expected in zip(whole, (again.stiffness_matrix, again.mass_matrix), strict=True):
            assert abs(found - expected).max() <= 1e-12 * abs(expected).max()


def test_a_frequency_deviation_is_one_of_the_square(of_chains):
    values = np.array([0.01, 0, -0.02, 0.005])
    by_frequency = sh.mistuned_ring(of_chains, frequency_deviation=values)
    by_stiffness = sh.mistuned_ring(of_chains, stiffness_deviation=(1 + values) ** 2 - 1)
    difference = by_frequency.stiffness_matrix - by_stiffness.stiffness_matrix
    assert abs(difference).max() < 1e-12 * abs(by_frequency.stiffness_matrix).max()


def test_modes_in_sweeps_draws_and_archives(of_modes):
    name = "frequency_deviation_1"
    draws = sh.mistuning.uniform(of_modes, 2, seed=1, **{name: 0.05, "normal_load": 0.1})
    assert draws[name].dims == ("sample", "blade")
    assert np.abs(draws[name] - VALUES[name]).max() < 0.05
    response = sh.frf(of_modes, BAND, over=draws, progress=False)
    assert response[name].dims == ("sample", "blade")
    assert response[name].units == "1"
    assert response[name].long_name == "deviation of the frequency of mode 1 of the blade alone"
    again = sh.datasets.rebuild(response.isel(sample=1))
    chosen = of_modes.with_parameters(**{n: draws[n][1] for n in (name, "normal_load")})
    coefficients = [sh.solve(problem, 18.0).coefficient.values for problem in (chosen, again)]
    np.testing.assert_array_equal(*coefficients)
    assert again.records[name] == of_modes.records[name]


BAD = [
    (dict(stiffness_deviation=-1.0), ValueError, "above -1"),
    (dict(frequency_deviation=[0.0, 0.1]), ValueError, "frequency_deviation"),
    (dict(mass_deviation="light"), TypeError, "mass_deviation"),
    (dict(frequency_deviation_0=-1.0), ValueError, "frequency_deviation_0: .* above -1"),
    (dict(frequency_deviation_1=[0.1]), ValueError, "frequency_deviation_1"),
    (dict(frequency_deviation=[0, 0, -0.4, 0], frequency_deviation_1=-0.3),
     ValueError, "those of blade 2 it is -0.15 of the tuned"),
    (dict(frequency_deviation_2=0.1), KeyError, "'frequency_deviation_2' .* 2 modes .*_1"),
    (dict(blade_modes=2), ValueError, "blade_modes=2: expected 0"),
    (dict(blade=BLADE, blade_modes=21), ValueError, "blade_modes=21: expected at most 20"),
    (dict(blade=BLADE, blade_modes=-1), ValueError, "blade_modes=-1"),
]  # fmt: skip


@pytest.mark.parametrize(("given", "error", "told"), BAD)
def test_bad_deviations_and_numbers_of_modes_are_refused(of_chains, given, error, told):
    reduce = partial(sh.craig_bampton, plate_sector(4), 5, (1, 40))
    make = reduce if "blade_modes" in given else partial(sh.mistuned_ring, of_chains)
    with pytest.raises(error, match=told):
        make(**given)


def test_a_ring_is_one_of_sectors():
    with pytest.raises(TypeError, match="expected a Sector"):
        sh.mistuned_ring(3)


def test_modes_of_one_frequency_are_told():
    blade = range(40, 80)  # with chains beside it that are as low
    with pytest.warns(UserWarning, match="modes 0 and 1 .* same frequency, 64.0681 Hz"):
        sh.craig_bampton(plate_sector(4), 5, (1, 40), blade=blade, blade_modes=1)


def test_deviations_that_together_leave_no_stiffness_are_refused_when_set(of_modes):
    few = of_modes.with_parameters(stiffness_deviation=-0.6, frequency_deviation=0.5)
    with pytest.raises(ValueError, match="leave some stiffness"):
        few.with_parameters(frequency_deviation=-0.5)
    again = few.with_parameters(stiffness_deviation=0.5, frequency_deviation=-0.6)
    assert again.model.frequency_deviation[0] == -0.6


def shrouded(damping=None, air=()):
    """Five sectors, a mass of the disk and one of the blade, whose tips rub on each other."""
    stiffness = np.array([[5e4, -2e4, -2e4], [-2e4, 2e4, 0], [-2e4, 0, 2e4]])
    given = np.diag([2.0, 0.5, 0]) if damping is None else damping
    disk = sh.Sector(sh.Model(np.diag([1.0, 0.4, 0]), given, stiffness), [0], [2], 5)
    shroud = sh.Friction(tangential=(1, sh.next_sector(1)), **rub(3e3, 0.5, 1.0))
    return disk.with_contacts(shroud=shroud).with_influences(*air)


def test_slopes_of_rings_with_a_loss_factor_are_those_that_are_known():
    """Deviations change a stiffness that the loss factor does not: they can be swept alone."""
    ring = sh.mistuned_ring(shrouded(sh.StructuralDamping(0.02)), stiffness_deviation=0.01)
    problem = sh.HarmonicBalance(ring, sh.forces.EngineOrder(2, pattern={1: 5.0}))
    response = sh.frf(problem, (29.8, 30.2), progress=False)
    slopes = sh.datasets.sensitivity(response)
    assert "peak_amplitude_by_stiffness_deviation" not in slopes
    largest, step = int(np.argmax(response.peak_amplitude.values)), 1e-5
    by_force = slopes.peak_amplitude_by_force_amplitude.isel(peak=largest).max().item()
    peaks = [
        sh.frf(
            problem.with_parameters(force_amplitude=1 + way * step), (29.8, 30.2), progress=False
        )
        for way in (1, -1)
    ]
    up, down = (one.peak_amplitude.max().item() for one in peaks)
    assert by_force == pytest.approx((up - down) / (2 * step), rel=1e-4)
    with pytest.raises(ValueError, match="under a loss factor derivatives by deviations"):
        sh.follow(problem, "stiffness_deviation", (0.0, 0.02), frequency=30.0, progress=False)


def test_a_ring_with_a_loss_factor_of_a_part_is_not_condensed():
    sector = shrouded(sh.StructuralDamping(0.02))
    force = sh.forces.EngineOrder(2, pattern={1: 5.0})
    sh.condense(sh.mistuned_ring(sector), force, (15, 60), progress=False)
    deviating = sh.mistuned_ring(sector, stiffness_deviation=0.01)
    with pytest.raises(TypeError, match="of the tuned disk without the air"):
        sh.condense(deviating, force, (15, 60), progress=False)


def test_modes_that_are_not_kept_may_have_one_frequency():
    """Those of the blade are 15.9 Hz and twice 31.8 Hz; the first one alone is kept."""
    springs = {(0, 2): 1e4, (0, 3): 4e4, (0, 4): 4e4, (0, 1): 3e4}
    stiffness = np.diag([2e4, 0, 0, 0, 0])
    for (i, j), k in springs.items():
        stiffness[np.ix_([i, j], [i, j])] += (k * np.array([[1, -1], [-1, 1]])).astype(int)
    model = sh.Model(np.diag([1.0, 0, 1, 1, 1]), np.zeros((5, 5)), stiffness)
    sector = sh.Sector(model, [0], [1], 4)
    small = sh.craig_bampton(sector, 2, (1, 60), places=[2], blade=[2, 3, 4], blade_modes=1)
    assert_allclose(small.blade.frequencies, [100 / 2 / np.pi], rtol=1e-12)
