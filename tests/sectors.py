"""Disks of any physics, with contacts and forces, small enough for the rings of all sectors."""

import numpy as np

import symhbm as sh

FRICTION = dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=2.0)


def random_disk(n_sectors, cartesian, n_inner=2, seed=2):
    """Nodes left, inner ones and right, three directions each: matrices of any physics."""
    rng = np.random.default_rng(seed)
    n_nodes = n_inner + 2
    n_dof = 3 * n_nodes
    springs, dashpots = rng.normal(size=(2, n_dof, n_dof))
    left, right = np.arange(3), np.arange(n_dof - 3, n_dof)
    phi = 2 * np.pi / n_sectors
    turn = np.array([[np.cos(phi), -np.sin(phi), 0], [np.sin(phi), np.cos(phi), 0], [0, 0, 1]])
    first = np.array([1, -0.2, 0])
    inner = [[1.1 + 0.1 * i, 0.02, 0.1] for i in range(n_inner)]
    places = sh.Places(
        np.repeat(np.arange(n_nodes), 3),
        [*"xyz"] * n_nodes if cartesian else ["radial", "tangential", "axial"] * n_nodes,
        np.repeat([first, *inner, turn @ first], 3, axis=0),
        np.repeat(["left", *[f"inner{i}" for i in range(n_inner)], "right"], 3),
    )
    model = sh.Model(
        np.diag(rng.uniform(0.5, 2, n_dof)),
        2.0 * dashpots @ dashpots.T,
        1e4 * (springs @ springs.T + 2 * np.eye(n_dof)),
        places=places,
    )
    return sh.Sector(model, left, right, n_sectors, rotation="z" if cartesian else None)


def with_friction(disk):
    """Inside, to the neighbour, and on the interface that is eliminated."""
    last = disk.n_whole - 1
    pairs = [(3, sh.next_sector(4)), (last - 1,), (5, sh.next_sector(1)), (7, last)]
    return disk.with_contacts(rub=sh.Friction(tangential=pairs, **FRICTION))


def with_opening(disk):
    last = disk.n_whole - 1
    shroud = sh.Friction(
        tangential=[(3, sh.next_sector(4)), (last - 1, 3)],
        normal=[(4, sh.next_sector(3)), (5, sh.next_sector(0))],
        normal_stiffness=8e3,
        **FRICTION,
    )
    stop = sh.Gap(normal=[(last, sh.next_sector(5))], normal_stiffness=1e4, gap=1e-4)
    return disk.with_contacts(shroud=shroud, stop=stop)


def wave(order, disk):
    """Forces on inner places and on both interfaces, and a static one."""
    pattern = {1: {5: 4 + 2j, disk.n_whole - 2: 1.0}, 2: {2: 0.6j, 5: 0.3}, 3: {5: 0.3}}
    force = sh.forces.EngineOrder(order, 3.0, pattern=pattern)
    return force + sh.forces.StaticLoad({3: 2.0, disk.n_whole - 1: 1.0})
