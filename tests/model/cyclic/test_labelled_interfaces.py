"""Interfaces of sectors by labels, in the same sense as contacts between sectors."""

import numpy as np

import symhbm as sh
from tests.refusals import refused

N_SECTORS = 12
HALF = np.pi / N_SECTORS
WAYS = ["x", "y", "z"]


def points(angle, radii=(0.1, 0.12, 0.15)):
    return [[r * np.cos(angle), r * np.sin(angle), z] for r in radii for z in (0.0, 0.03)]


def sector_model(order=None):
    """Nodes on both sides of a sector and in its middle, with springs between all of them."""
    at = np.array([*points(-HALF), *points(0.0), *points(HALF)])
    labels = np.repeat(["left", "blade", "right"], 6)
    order = np.arange(18) if order is None else order
    node = np.repeat(1 + np.arange(18), 3)
    places = sh.Places(
        node, WAYS * 18, np.repeat(at[order], 3, axis=0), np.repeat(labels[order], 3)
    )
    spring = np.zeros((54, 54))
    for i in range(18):
        for j in range(i):
            along = (at[i] - at[j]) / np.linalg.norm(at[i] - at[j])
            row = np.zeros(54)
            row[3 * i : 3 * i + 3], row[3 * j : 3 * j + 3] = along, -along
            spring += 1e6 * np.outer(row, row)
    whole = np.repeat(3 * order, 3) + np.tile(range(3), 18)
    spring = (spring + 1e3 * np.eye(54))[np.ix_(whole, whole)]
    return sh.Model(np.eye(54), 0.1 * np.eye(54), spring, places=places)


def test_nodes_are_paired_by_where_they_are():
    mixed = np.random.default_rng(1).permutation(18)
    frequencies = [
        sh.natural_modes(
            sh.Sector(one, "left", "right", N_SECTORS, rotation="z"), 3, count=4
        ).frequency
        for one in (sector_model(), sector_model(mixed))
    ]
    np.testing.assert_allclose(*frequencies, rtol=1e-9)


def test_left_and_right_have_one_sense():
    """Pairs of the interfaces themselves, of the same arguments, are joined ones: no gap."""
    model = sector_model()
    disk = sh.Sector(model, "left", "right", N_SECTORS, rotation="z")
    pairs = sh.contact_pairs(
        model, "left", "right", n_sectors=N_SECTORS, normal=[0, 1.0, 0], area=1e-4
    )
    joined = dict(zip(disk.interfaces.right.tolist(), disk.interfaces.left.tolist(), strict=True))
    for right, left in pairs.nodes.tolist():
        assert joined[3 * (right - 1)] == 3 * (left - 1)
    np.testing.assert_allclose(pairs.gap, 0, atol=1e-15)
    first = {repr(place) for place in pairs.normal[0]}
    assert first == {"'13:y'", "next_sector('1:y')"}


def joined(left, right):
    return sh.Sector(sector_model(), left, right, N_SECTORS, rotation="z")


test_labels_that_are_no_interfaces = refused([
    (lambda: joined("right", "left"), ValueError, "0 of 6 are, of 6 of left; exchange the two"),
    (lambda: joined("left", "blade"), ValueError, "turned by 30 degrees about z"),
    (lambda: joined("left", "tip"), KeyError, "tip"),
    (lambda: sh.Sector(sh.Model(np.eye(2), np.eye(2), np.eye(2)), "left", "right", N_SECTORS),
     ValueError, "expected places with coordinates"),
    (lambda: joined("left", ["13:x"]), TypeError, "labels of both"),
])  # fmt: skip
