"""Tuned responses of disks from one sector, held against the assembled ring of all of them."""

from importlib import import_module

import numpy as np
import pytest
from rings import assembled
from sectors import FRICTION, random_disk, wave, with_friction, with_opening

import symhbm as sh
from symhbm.numerics import unknowns_of
from tests.quick import quick_first
from tests.refusals import refused

histories = import_module("symhbm.plot.contact.histories")

HARMONICS = (0, 1, 2, 3)


def of_places(disk, ring, coefficients, sector):
    """Motion of a sector from that of the ring, of what is not right."""
    return np.tensordot(ring.motions[sector].toarray(), coefficients, 1)[disk.kept]


@pytest.mark.parametrize("contacts", [with_friction, with_opening])
@pytest.mark.parametrize(
    ("cartesian", "order"), quick_first([(True, 4), (False, 3), (True, 2), (False, 2)], 2)
)
def test_a_sector_moves_as_the_whole_ring(contacts, cartesian, order):
    """Orders of both senses, and one that stands; any sector from the first."""
    disk = contacts(random_disk(6, cartesian, n_inner=1))
    force = wave(order, disk)
    ring = assembled(disk, force)
    whole = sh.HarmonicBalance(ring.model, ring.force, HARMONICS)
    first = sh.solve(sh.HarmonicBalance(disk, force, HARMONICS), 24.0)
    everywhere = sh.solve(whole, 24.0).coefficient.values
    assert (first.contact_state.values > 0).any()
    size = abs(everywhere).max()
    for sector in (0, 1, 4):
        of_sector = sh.datasets.sector_response(first, sector).coefficient.values
        assert abs(of_places(disk, ring, everywhere, sector) - of_sector).max() < 1e-9 * size
    opposite = sh.solve(sh.HarmonicBalance(disk, wave(6 - order, disk), HARMONICS), 24.0)
    if order != 3:
        assert abs(opposite.coefficient - first.coefficient).max() > 1e-2 * size


def test_contacts_of_one_interface_are_the_same_left_and_right():
    """A place on the cut belongs to both sectors: told from either, it is one contact."""
    disk = random_disk(6, True)
    force, last = wave(2, disk), disk.n_whole - 1
    found = []
    for pair in ((last, 5), (sh.next_sector(2), 5)):  # along the axis, which is not turned
        rub = sh.Friction(tangential=[pair], **FRICTION)
        problem = sh.HarmonicBalance(disk.with_contacts(rub=rub), force, HARMONICS)
        found.append(sh.solve(problem, 24.0))
    assert found[0].contact_state.item() == 1
    assert np.allclose(found[0].coefficient, found[1].coefficient, rtol=1e-12, atol=0)


def test_narrow_resonances_are_counted_wave_by_wave():
    disk = with_friction(random_disk(6, True)).in_wave(2)
    springs = np.full(4, 3e3)
    for harmonic in (1, 2, 3):
        n = disk.wave(harmonic)
        mass, _, stiffness = (m.toarray() for m in disk.matrices(n))
        rows = disk.directions_of(n).toarray()
        whole = stiffness + rows.conj().T @ (springs[:, None] * rows)
        natural = np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, whole)).real)
        for s in (60.0, 150.0, 400.0):
            below = disk.modes_below(harmonic, s / harmonic, springs)
            assert below == np.count_nonzero(natural < s)
            near = disk.modes_near(harmonic, s / harmonic, springs, 0 * springs)
            assert np.allclose(np.sort(natural), near.detuning + s, rtol=1e-9)


@pytest.mark.parametrize(
    ("make", "error", "said"),
    [
        (lambda m: sh.Sector(m, [0], [1, 2], 6), ValueError, "as many degrees of freedom"),
        (lambda m: sh.Sector(m, [0, 0], [1, 2], 6), ValueError, "each degree of freedom once"),
        (lambda m: sh.Sector(m, [0], [1], 1), ValueError, "n_sectors=1"),
        (lambda m: sh.Sector(m, [0], [1], 6, "z"), ValueError, "places"),
        (lambda m: sh.Sector(m, [0], [1], 6, "w"), ValueError, "rotation='w'"),
        (lambda m: sh.Sector(m, "left", "right", 6, "w"), ValueError, "rotation='w'"),
        (lambda m: sh.Sector(m, [0], [9], 6), ValueError, "0 to 3"),
        (lambda m: sh.Sector(m, ["a:x"], [1], 6), KeyError, "no place"),
        (lambda m: sh.Sector(np.eye(3), [0], [1], 6), TypeError, "Model of one sector"),
        (lambda m: m.with_contacts(a=sh.Gap(normal=(0, sh.next_sector(0)), normal_stiffness=1.0,
                                            gap=1.0)), TypeError, "only a symhbm.Sector"),
        (lambda m: sh.next_sector(sh.next_sector(1)), TypeError, "this sector"),
        (lambda m: sector(m).dynamic_stiffness(1, 10.0), ValueError, "under an engine order"),
        (lambda m: sh.HarmonicBalance(sector(m), sh.forces.EngineOrder(2)), ValueError, "pattern="),
        (lambda m: sh.HarmonicBalance(sector(m), sh.forces.PointForce()),
         ValueError, "EngineOrder"),
        (lambda m: sh.HarmonicBalance(sector(m), two_orders()), ValueError, "one engine order"),
        (lambda m: sh.HarmonicBalance(m, sh.forces.EngineOrder(2, pattern={0: 1})),
         ValueError, "Sector"),
        (lambda m: sh.HarmonicBalance(sector(m), sh.forces.EngineOrder(2, pattern=[1, 2])),
         ValueError,
         "pattern: expected 4 values"),
        (lambda m: sh.forces.EngineOrder(2, pattern={0: "a"}), TypeError, "a complex number"),
        (lambda m: sh.forces.EngineOrder(2, pattern={0: np.nan}), ValueError, "finite"),
        (lambda m: sh.forces.EngineOrder(2, places=[1], pattern={0: 1}), ValueError, "places=None"),
        (lambda m: sh.periodic_motion(sh.HarmonicBalance(sector(m), one_order()), 5.0), TypeError,
         "craig_bampton"),
        (lambda m: sh.datasets.sector_response(sh.solve(sh.HarmonicBalance(sector(m), one_order()),
         5.0), 6),
         ValueError, "sector=6"),
    ],
)  # fmt: skip
def test_what_cannot_be_says_so(make, error, said):
    model = sh.Model(np.eye(4), 0.1 * np.eye(4), 1e3 * np.diag([1.0, 2, 3, 4]))
    with pytest.raises(error, match=said):
        make(model)


def sector(model):
    return sh.Sector(model, [0], [1], 6)


def one_order():
    return sh.forces.EngineOrder(2, pattern={0: 1.0})


def two_orders():
    return one_order() + sh.forces.EngineOrder(3, pattern={0: 1.0})


DISK = random_disk(6, True)
MODEL, ENDS = DISK.structure, DISK.interfaces
BARE = sh.Model(
    MODEL.mass_matrix, MODEL.damping_matrix, MODEL.stiffness_matrix,
    places=sh.Places(MODEL.places.node, MODEL.places.direction),
)  # fmt: skip


def joined(left, right, count=6, rotation="z", model=MODEL):
    return sh.Sector(model, left, right, count, rotation=rotation)


test_interfaces_that_do_not_fit_are_refused = refused([
    (lambda: joined(ENDS.right, ENDS.left), ValueError, "exchange the two"),
    (lambda: joined(ENDS.left, ENDS.right, 7), ValueError, r"turned by 51\.4"),
    (lambda: joined(ENDS.left, ENDS.right[::-1]), ValueError, "same order"),
    *((lambda model=model: joined(ENDS.left, ENDS.right, 6, None, model),
       ValueError, "rotation=None: expected the axis") for model in (MODEL, BARE)),
])  # fmt: skip


def test_places_without_coordinates_have_interfaces():
    assert joined(ENDS.left, ENDS.right, model=BARE).n_sectors == 6


def test_a_large_sector_asks_to_be_condensed():
    n = 400
    model = sh.Model(np.eye(n), np.eye(n), 1e3 * np.eye(n))
    with pytest.raises(ValueError, match=r"399 degrees of freedom .* symhbm.condense\(sector"):
        sh.HarmonicBalance(sh.Sector(model, [0], [1], 6), one_order())


def test_archives_and_loops_of_contacts(tmp_path):
    """What is drawn of a contact is its motion, its phases from harmonic to harmonic included."""
    disk = with_opening(random_disk(6, True))
    problem = sh.HarmonicBalance(disk, wave(2, disk), HARMONICS)
    sh.save(sh.solve(problem, 24.0), tmp_path / "point.nc")
    point = sh.load(tmp_path / "point.nc")
    assert sh.solve(sh.datasets.rebuild(point), 24.0).equals(point)
    given = point.coefficient.transpose("dof", "harmonic", "component").values
    moves = problem.layout.relative(unknowns_of(problem.basis, HARMONICS, given))
    for contact, rows in enumerate(disk.groups.rows):
        told = histories.contact_of(point, contact).relative(point.coefficient)
        for row, motion in zip(rows, told, strict=True):
            parts = motion.transpose("harmonic", "component").values.ravel()[[0, *range(2, 8)]]
            assert np.allclose(parts, moves[row], rtol=0, atol=1e-14 * abs(moves[row]).max())
    sh.plot.hysteresis(point, contact=0)
    with pytest.raises(ValueError, match="engine_order: expected 2"):
        sh.plot.hysteresis(point.assign(engine_order=1), contact=0)


def test_nodes_left_out_of_both_interfaces_are_told():
    """A node amid them; not one on a shroud, far from them."""
    radius, n_sectors = np.array([1.0, 1.1, 1.2, 2.0]), 6
    angles = 2 * np.pi / n_sectors * np.repeat([0, 1], 4)
    at = np.tile(radius, 2) * np.array([np.cos(angles), np.sin(angles)])
    points = np.column_stack([*at, np.zeros(8)])
    places = sh.Places(np.repeat(np.arange(8), 3), [*"xyz"] * 8, np.repeat(points, 3, axis=0))
    model = sh.Model(np.eye(24), np.eye(24), 1e4 * np.eye(24), places=places)

    def disk(*nodes):
        left = [3 * node + i for node in nodes for i in range(3)]
        return sh.Sector(model, left, [dof + 12 for dof in left], n_sectors, rotation="z")

    assert disk(0, 1, 2).n_dof == 15
    with pytest.warns(UserWarning, match=r"1 nodes .* \(the first: 1 and 5\)"):
        disk(0, 2)
