"""Natural frequencies and modes of structures and of the waves of disks."""

import gc
import weakref

import numpy as np
import pytest
import scipy.sparse as sp

import symhbm as sh
from symhbm.model.linear import eigenmodes
from tests.published import blisk_sector
from tests.reference import STATED
from tests.refusals import refused

open_sector = pytest.importorskip("studies.open_sector", reason="scikit-fem")

BLISK = STATED["blisk"]
DISK = {
    open_sector.COARSE: {
        0: (904.601, 1706.458),
        1: (894.001, 1876.713),
        2: (967.929, 1932.847),
        3: (1263.404, 1939.198),
        6: (1936.558, 2142.468),
        12: (1932.608, 2494.626),
    },
    open_sector.MIDDLE: {0: (899.672, 1664.253), 12: (1870.348, 2452.627)},
    open_sector.FINE: {0: (898.401, 1653.615), 3: (1253.740, 1858.586), 12: (1854.601, 2443.023)},
}
SIZES = {open_sector.COARSE: (1305, 135), open_sector.MIDDLE: (6321, 357)}
SIZES[open_sector.FINE] = 18117, 675


@pytest.mark.parametrize("n", BLISK)
def test_blisk_of_three_masses_a_sector_to_every_digit(n):
    found = sh.natural_modes(blisk_sector(), int(n)).frequency.values
    for value, printed in zip(found, BLISK[n].split(), strict=True):
        assert f"{value:.{len(printed.partition('.')[2])}f}" == printed


@pytest.mark.parametrize(
    "grid",
    [
        open_sector.COARSE,
        pytest.param(open_sector.MIDDLE, marks=pytest.mark.slow),
        pytest.param(open_sector.FINE, marks=pytest.mark.slow),
    ],
)
def test_disk_of_finite_elements(grid):
    sector = open_sector.open_sector(grid)
    assert sector.n_all == SIZES[grid][0]
    on_bore = (2 * grid[2] + 1) * 3
    assert len(sector.left) == SIZES[grid][1] - on_bore
    for n, frequencies in DISK[grid].items():
        found = sh.natural_modes(sector.disk, n, count=2).frequency.values
        assert found.round(3).tolist() == [*frequencies]


def test_modes_are_of_unit_mass_and_sparse_ones_those_of_dense_matrices(monkeypatch):
    sector = open_sector.open_sector((2, 3, 1, 2))
    disk = sector.disk
    dense = sh.natural_modes(disk, 5, count=4)
    monkeypatch.setattr(eigenmodes, "DENSE_LIMIT", 10)
    sparse = sh.natural_modes(disk, 5, count=4)
    assert abs(sparse.frequency / dense.frequency - 1).max() < 1e-10
    shapes = [(m.mode_shape[..., 0] - 1j * m.mode_shape[..., 1]).values.T for m in (dense, sparse)]
    mass = sector.structure.mass_matrix
    products = shapes[0].conj().T @ mass @ shapes[1]
    assert np.allclose(abs(products), np.eye(4), atol=1e-7)
    turned = disk.interfaces.rotation[sector.left] @ shapes[0] * np.exp(-2j * np.pi * 5 / 24)
    assert abs(shapes[0][sector.right] - turned).max() < 1e-12 * abs(turned).max()


def test_factors_of_a_wave_are_let_go_at_once(monkeypatch):
    """Not when Python looks for circles: over many speeds they are gigabytes."""
    kept, definite = [], eigenmodes.definite

    class Kept:
        def __init__(self, matrix):
            kept.append(weakref.ref(self))
            self.factors = definite(matrix)

        def solve(self, right):
            return self.factors.solve(right)

    monkeypatch.setattr(eigenmodes, "definite", Kept)
    monkeypatch.setattr(eigenmodes, "DENSE_LIMIT", 10)
    stiffness = sp.diags_array(np.arange(1.0, 41)).tocsc().astype(complex)
    gc.disable()
    try:
        squares, _ = eigenmodes.lowest_modes(stiffness, sp.eye_array(40, dtype=complex), 2)
        np.testing.assert_allclose(squares, [1, 2], rtol=1e-9)
        [factors] = kept
        assert factors() is None
    finally:
        gc.enable()


test_what_is_no_wave_says_so = refused([
    (lambda: sh.natural_modes(blisk_sector(), 13),
     ValueError, r"nodal_diameter=13: expected an integer from -12 to 12"),
    (lambda: sh.natural_modes(blisk_sector().structure, 2),
     ValueError, r"nodal_diameter=2: expected None, a whole"),
    (lambda: sh.natural_modes(blisk_sector(), 2, count=4),
     ValueError, r"count=4: expected an integer from 1 to 3"),
])  # fmt: skip


def test_several_waves_and_structures_that_follow_without_a_mode():
    structure = blisk_sector().structure  # the right end has no mass
    assert sh.natural_modes(structure).sizes["mode"] == structure.n_dof - 1
    several = sh.natural_modes(blisk_sector(), [1, 12], count=1)
    assert several.frequency.values.round(3).ravel().tolist() == [169.344, 195.676]


@pytest.mark.parametrize("across", [None, (1,)])
def test_stuck_contacts_have_a_stiffness_along_each_direction(across):
    shroud = sh.Friction(
        tangential=(0,),
        across=across,
        normal=(2,),
        contact_stiffness=3e3,
        normal_stiffness=8e3,
        friction_coefficient=0.4,
        normal_load=2.0,
    )
    stop = sh.Gap(normal=(0,), normal_stiffness=5e2, gap=1e-3)
    stiffness = np.array([[1e4, 2e3, 1e3], [2e3, 2e4, 5e2], [1e3, 5e2, 3e4]])
    contacts = {"shroud": shroud, "stop": stop}
    model = sh.Model(np.eye(3), np.eye(3), stiffness, contacts=contacts)
    springs = [3e3 + 5e2, 3e3 if across else 0, 8e3]
    known = np.sqrt(np.linalg.eigvalsh(stiffness + np.diag(springs))) / (2 * np.pi)
    found = sh.natural_modes(model, stuck=True).frequency.values.ravel()
    np.testing.assert_allclose(found, known, rtol=1e-12)
    turning = sh.RotatingModel(model, {0: stiffness, 1000: stiffness})
    diagram = sh.campbell(turning, [0, 1000], count=3, stuck=True).frequency.values
    assert all(np.isclose(diagram, each, rtol=1e-9).any() for each in known)


def turning_ring(coefficients=()):
    """Three blades in the plane of the disk, at a speed and in the air, and their whole ring."""
    stiffness = np.array([[9e4, -1e4, -3e4], [-1e4, 3e4, 0], [-3e4, 0, 3e4]])
    skew = np.array([[0, 2.0, 0], [-2.0, 0, 0], [0, 0, 0]])
    model = sh.Model(np.diag([1.0, 1.0, 0]), np.diag([1.0, 1, 0]), stiffness)
    rotor = sh.RotatingModel(model, {0: stiffness, 600: stiffness}, coriolis=skew)
    disk = sh.Sector(rotor.at(900), [0], [2], 3)
    return disk.with_influences(*(sh.Influence({1: 1.0}, c, 30.0) for c in coefficients))


@pytest.mark.parametrize("air", [(), ({-1: 2e3j, 1: -2e3j, 0: 500.0},)])
def test_both_senses_are_told_where_they_differ(air):
    """Every frequency of the ring's quadratic problem, once."""
    disk = turning_ring(air)
    modes = sh.natural_modes(disk)
    assert modes.nodal_diameter.values.tolist() == [-1, 0, 1]
    ring = sh.mistuned_ring(disk)
    mass, damping, stiffness = (
        each.toarray() for each in (ring.mass_matrix, ring.damping_matrix, ring.stiffness_matrix)
    )
    gyroscopic, elastic = (damping - damping.T) / 2, (stiffness + stiffness.T) / 2
    size = len(mass)
    rows = np.hstack([elastic, gyroscopic])
    whole = np.block([[np.zeros((size, size)), np.eye(size)], [-np.linalg.solve(mass, rows)]])
    every = np.sort(np.abs(np.linalg.eigvals(whole).imag))[::2] / 2 / np.pi
    np.testing.assert_allclose(np.sort(modes.frequency.values.ravel()), every, rtol=1e-9)
    one = sh.natural_modes(disk, nodal_diameter=-1).frequency
    np.testing.assert_array_equal(one, modes.frequency.sel(nodal_diameter=-1))


def test_coriolis_forces_beside_modal_damping_of_large_structures():
    """Its matrix stays in factors, which hold none of them."""
    n = 600
    beside = np.ones(n - 1)
    springs = sp.diags_array([-1e4 * beside, 2e4 * np.ones(n), -1e4 * beside], offsets=[-1, 0, 1])
    skew = sp.diags_array([-5 * beside, 5 * beside], offsets=[-1, 1])
    runs = {0: springs, 9: springs}
    rotors = [
        sh.RotatingModel(sh.Model(sp.eye_array(n), damping, springs), runs, skew)
        for damping in (sh.ModalDamping(0.01, modes=4), sp.csc_array((n, n)))
    ]
    found, expected = (sh.natural_modes(rotor.at(600), count=4).frequency for rotor in rotors)
    np.testing.assert_allclose(found, expected, rtol=1e-10)
