"""Disks of quadratic elements, curved and with nodes amid their edges: a sector and its ring."""

from typing import NamedTuple

import numpy as np
import pytest
import scipy.linalg

import symhbm as sh

N, PHI = 5, 2 * np.pi / 5
CORNERS = np.array([[0, 0], [0, 2], [2, 2], [2, 0], [0, 1], [1, 2], [2, 1], [1, 0]])
"""Nodes of an element, in half steps around and outwards."""
RADII = np.array([1.0, 1.3, 1.6, 2.0, 2.4])
TIPS = (2, 4), (4, 4)
"""Both corners of a blade, by their steps around and outwards."""


class Mesh(NamedTuple):
    """Matrices (2 n, 2 n) in radial and tangential directions, and the nodes by their steps."""

    mass: np.ndarray
    stiffness: np.ndarray
    nodes: dict[tuple[int, int], int]

    def dofs(self, places):
        """Radial and tangential degrees of freedom of nodes."""
        return [2 * self.nodes[place] + k for place in places for k in range(2)]


def shapes(xi, eta):
    """Shape functions (8,) of an element at a point, and their derivatives (2, 8)."""
    at = CORNERS[:, ::-1] - 1.0
    values, slopes = np.empty(8), np.empty((2, 8))
    for i, (a, b) in enumerate(at):
        if i < 4:
            values[i] = (1 + a * xi) * (1 + b * eta) * (a * xi + b * eta - 1) / 4
            slopes[0, i] = a * (1 + b * eta) * (2 * a * xi + b * eta) / 4
            slopes[1, i] = b * (1 + a * xi) * (a * xi + 2 * b * eta) / 4
        elif a == 0:
            values[i] = (1 - xi**2) * (1 + b * eta) / 2
            slopes[:, i] = -xi * (1 + b * eta), b * (1 - xi**2) / 2
        else:
            values[i] = (1 - eta**2) * (1 + a * xi) / 2
            slopes[:, i] = a * (1 - eta**2) / 2, -eta * (1 + a * xi)
    return values, slopes


def element(places):
    """Mass and stiffness (16, 16) of plane stress on an elastic bed, of nodes (8, 2)."""
    elastic = 2e5 / (1 - 0.09) * np.array([[1, 0.3, 0], [0.3, 1, 0], [0, 0, 0.35]])
    mass, stiffness = np.zeros((2, 16, 16))
    points = zip((-np.sqrt(0.6), 0.0, np.sqrt(0.6)), (5 / 9, 8 / 9, 5 / 9), strict=True)
    points = list(points)
    for xi, first in points:
        for eta, second in points:
            values, slopes = shapes(xi, eta)
            jacobian = slopes @ places
            by_place = np.linalg.solve(jacobian, slopes)
            size = first * second * np.linalg.det(jacobian)
            moved, strain = np.zeros((2, 16)), np.zeros((3, 16))
            moved[0, ::2] = moved[1, 1::2] = values
            strain[0, ::2], strain[1, 1::2] = by_place
            strain[2, ::2], strain[2, 1::2] = by_place[1], by_place[0]
            mass += size * moved.T @ moved
            stiffness += size * strain.T @ elastic @ strain
    return mass, stiffness + 3e3 * mass


def mesh(n_sectors):
    """Three elements of the disk in each sector and one of a blade; all sectors are a ring."""
    around = 6 * n_sectors if n_sectors == N else np.inf
    first = [(6 * j + 2 * i, 0) for j in range(n_sectors) for i in range(3)]
    first += [(6 * j + 2, 2) for j in range(n_sectors)]
    of_elements = [[tuple(node) for node in at + CORNERS] for at in np.array(first)]
    of_elements = [[(int(a % around), int(r)) for a, r in nodes] for nodes in of_elements]
    nodes = {node: i for i, node in enumerate(sorted({n for some in of_elements for n in some}))}
    mass, stiffness = np.zeros((2, 2 * len(nodes), 2 * len(nodes)))
    for keys in of_elements:
        angles = np.array([a for a, _ in keys]) * PHI / 6
        radii = RADII[[r for _, r in keys]]
        # Rotations of both directions of a node.
        own = [[[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]] for a in angles]
        turn = scipy.linalg.block_diag(*own)
        places = radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
        dofs = [2 * nodes[key] + k for key in keys for k in range(2)]
        for whole, part in zip((mass, stiffness), element(places), strict=True):
            whole[np.ix_(dofs, dofs)] += turn.T @ part @ turn
    return Mesh(mass, stiffness, nodes)


ONE, RING = mesh(1), mesh(N)
LEFT, RIGHT = ([(a, r) for r in range(3)] for a in (0, 6))


def sector(cartesian=False):
    """One sector, in radial and tangential directions or along x and y."""
    mass, stiffness = ONE.mass, ONE.stiffness
    options, where = {}, None
    if cartesian:
        angles = np.array([a for a, _ in ONE.nodes]) * PHI / 6
        turn = scipy.linalg.block_diag(
            *([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]] for a in angles)
        )
        mass, stiffness = turn @ mass @ turn.T, turn @ stiffness @ turn.T
        radii = RADII[[r for _, r in ONE.nodes]]
        places = np.column_stack([radii * np.cos(angles), radii * np.sin(angles), 0 * radii])
        numbers = np.repeat(np.arange(len(angles)), 2)
        where = sh.Places(numbers, ["x", "y"] * len(angles), np.repeat(places, 2, axis=0))
        options = dict(rotation="z")
    model = sh.Model(mass, sh.RayleighDamping(2.0, 1e-4), stiffness, places=where)
    return sh.Sector(model, ONE.dofs(LEFT), ONE.dofs(RIGHT), N, **options)


@pytest.mark.parametrize("cartesian", [False, True])
def test_modes_of_all_waves_are_those_of_the_ring(cartesian):
    disk, found = sector(cartesian), []
    for wave in range(N // 2 + 1):
        alone = sh.natural_modes(disk, nodal_diameter=wave, count=8).frequency.values.ravel()
        found += [*alone] * (1 if wave == 0 else 2)
    expected = np.sqrt(scipy.linalg.eigh(RING.stiffness, RING.mass, eigvals_only=True))
    np.testing.assert_allclose(np.sort(found)[:20], expected[:20] / 2 / np.pi, rtol=1e-9)


@pytest.mark.parametrize("order", [2, pytest.param(1, marks=pytest.mark.slow)])
def test_friction_between_tips_of_a_sector_and_of_the_ring(order):
    values = dict(contact_stiffness=4e3, friction_coefficient=0.4, normal_load=0.3)
    (left, right), force = (ONE.dofs([tip])[1] for tip in TIPS), 1.5
    rub = sh.Friction(tangential=(right, sh.next_sector(left)), **values)
    wave = sh.forces.EngineOrder(order, force, pattern={1: {right: 1.0, left - 1: 0.4j}})
    one = sh.HarmonicBalance(sector().with_contacts(rub=rub), wave, (1, 3))

    pairs, shape = [], np.zeros(len(RING.mass), dtype=complex)
    for j in range(N):
        (own, behind), (radial, _) = (
            (RING.dofs([((6 * j + a) % (6 * N), r)])[1] for a, r in (TIPS[1], (8, 4))),
            RING.dofs([((6 * j + 2) % (6 * N), 4)]),
        )
        pairs.append((own, behind))
        lag = np.exp(-1j * order * PHI * j)
        shape[own], shape[radial] = lag, 0.4j * lag
    damping = 2.0 * RING.mass + 1e-4 * RING.stiffness
    rubs = sh.Friction(tangential=pairs, **values)
    ring = sh.Model(RING.mass, damping, RING.stiffness, contacts={"rub": rubs})
    forces = sh.forces.HarmonicForce({1: shape.real}, {1: -shape.imag}, amplitude=force)
    whole = sh.HarmonicBalance(ring, forces, (1, 3))
    first = sh.natural_modes(sector(), nodal_diameter=order, count=1).frequency.item()
    sticks, kept = [], one.model.interfaces.others.tolist()
    for frequency in (0.98 * first, 1.05 * first):
        alone, all_sectors = (sh.solve(p, frequency) for p in (one, whole))
        sticks.append(alone.stick_fraction.item())
        for tip in TIPS:
            a, b = (mesh.dofs([tip]) for mesh in (ONE, RING))
            own = alone.coefficient.values[[kept.index(d) for d in a]]
            other = all_sectors.coefficient.values[b]
            np.testing.assert_allclose(own, other, atol=1e-9 * np.abs(other).max())
    assert min(sticks) < 1
