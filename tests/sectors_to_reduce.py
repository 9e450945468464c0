"""Sectors of disks for tests of their reduction."""

import numpy as np

import symhbm as sh


def _springs(size, springs):
    stiffness = np.zeros((size, size))
    for i, j, k in springs:
        stiffness[np.ix_([i, j], [i, j])] += k * np.array([[1.0, -1], [-1, 1]])
    return stiffness


def plate_sector(n_sectors, damping=None):
    """A lattice of 8 columns and 10 rows, a disk of five and a blade of five rows upon it.

    A shroud joins the tips, numbers 74 and 77, to the neighbours; the blade is 40 on.
    """
    at = np.arange(80).reshape(10, 8)
    springs = [(at[y, x], at[y + 1, x], 1e6) for y in range(9) for x in range(8)]
    springs += [
        (at[y, x], at[y, x + 1], 1e6) for y in range(10) for x in range(7) if y < 5 or 2 <= x < 5
    ]
    stiffness = _springs(80, springs) + np.diag(np.where(np.arange(80) < 8, 1e6, 10.0))
    mass = 0.5 * np.eye(80)
    model = sh.Model(mass, damping or sh.RayleighDamping(2.0, 1e-5), stiffness)
    disk = sh.Sector(model, at[:5, 0], at[:5, 7], n_sectors)
    shroud = sh.Friction(
        tangential=(77, sh.next_sector(74)),
        contact_stiffness=2e5, friction_coefficient=0.3, normal_load=1.0,
    )  # fmt: skip
    return disk.with_contacts(shroud=shroud)


def plane_sector(n_sectors):
    """Bars in a plane, along x and y, each sector turned about z: 8 nodes of two directions."""
    phi = 2 * np.pi / n_sectors
    places = [(r * np.cos(a), r * np.sin(a)) for a in (0.0, phi) for r in (1.0, 1.5)]
    places += [(r * np.cos(phi / 2), r * np.sin(phi / 2)) for r in (1.2, 1.6, 1.9, 2.2)]
    places = np.array(places)  # 0, 1 left; 2, 3 right; 4 to 7 inside
    bars = [(0, 1), (0, 4), (1, 4), (2, 4), (3, 4), (1, 5), (3, 5), (4, 5), (5, 6), (6, 7)]
    size = 2 * len(places)
    stiffness = 2e3 * np.eye(size)
    for i, j in bars:
        along = (places[j] - places[i]) / np.linalg.norm(places[j] - places[i])
        row = np.zeros(size)
        row[2 * i : 2 * i + 2], row[2 * j : 2 * j + 2] = -along, along
        stiffness += 1e6 * np.outer(row, row)
    where = sh.Places(
        np.repeat(np.arange(len(places)), 2),
        ["x", "y"] * len(places),
        np.repeat(np.column_stack([places, 0 * places[:, 0]]), 2, axis=0),
    )
    damping = sh.RayleighDamping(2.0, 1e-6)
    model = sh.Model(np.eye(size), damping, stiffness, places=where)
    disk = sh.Sector(model, [0, 1, 2, 3], [4, 5, 6, 7], n_sectors, rotation="z")
    rub = sh.Friction(
        tangential=(15, sh.next_sector(14)),
        contact_stiffness=1e5, friction_coefficient=0.3, normal_load=3.0,
    )  # fmt: skip
    return disk.with_contacts(rub=rub)


def chain_sector(n_sectors):
    """A mass of the disk, number 0, and a blade of three upon it, with a shroud at the tip."""
    springs = [(0, 1, 2e4), (1, 2, 3e4), (2, 3, 2e4), (0, 4, 2e4)]
    stiffness = _springs(5, springs) + np.diag([1e4, 0, 0, 0, 0])
    model = sh.Model(np.diag([1, 0.3, 0.3, 0.3, 0]), np.diag([3, 0.5, 0.5, 0.5, 0]), stiffness)
    shroud = sh.Friction(
        tangential=(3, sh.next_sector(3)),
        contact_stiffness=2e3, friction_coefficient=0.5, normal_load=3,
    )  # fmt: skip
    return sh.Sector(model, left=[0], right=[4], n_sectors=n_sectors).with_contacts(shroud=shroud)
