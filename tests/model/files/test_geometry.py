"""Sides, axis and angle of sectors, found by where nodes are."""

import hexahedra
import numpy as np
import pytest
import swept_bricks

from symhbm.model.files.geometry import find_sides, twins
from symhbm.model.mesh import Mesh


def sector(axis="z", nodes=8):
    """The swept sector, its axis along another one, and its sets."""
    points, elements, sets = swept_bricks.sector(nodes)
    turned = np.roll(points, "xyz".index(axis) - 2, axis=1)
    kind = "hexahedron" if nodes == 8 else "hexahedron20"
    return Mesh(np.arange(1, len(points) + 1), turned, {kind: elements}), sets


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_axis_and_angle_are_found(axis):
    mesh, sets = sector(axis)
    for told in ((), (axis,), (axis, swept_bricks.N_SECTORS)):
        found = find_sides(mesh, *told)
        assert found is not None
        assert (found.axis, found.n_sectors) == (axis, swept_bricks.N_SECTORS)
        assert sorted(found.left) == sorted(sets["left"])
        assert sorted(found.right) == sorted(sets["right"])
        assert found.gap < 1e-14
    pairs = twins(mesh, axis, 6, sets["left"], sets["right"])
    at = dict(zip(found.left.tolist(), found.right.tolist(), strict=True))
    assert at == dict(zip(pairs.left.tolist(), pairs.right.tolist(), strict=True))
    back = twins(mesh, axis, 6, sets["right"], sets["left"])
    assert len(back.left) == 0
    assert find_sides(mesh, axis, 5) is None


def test_bodies_that_are_no_sector_have_no_sides():
    block, _ = hexahedra.block((3, 2, 2), mapped=lambda p: p * [1, 0.31, 0.2] + [2, 0.1, 0])
    assert find_sides(block) is None
    points = [Mesh([1, 2], [[1, 0, 0], [0, 1, 0]])]  # no elements
    assert find_sides(points[0]) is None
    count, turns = 22, np.arange(22) * 2 * np.pi / 22
    corners = [[r * np.cos(a), r * np.sin(a), z] for a in turns for z in (0, 1) for r in (1.0, 2.0)]
    first = 4 * np.arange(count)[:, None]
    after = np.roll(first, -1, axis=0)
    over, back = np.array([0, 1]), np.array([1, 0])
    cells = np.hstack([first + over, after + back, first + 2 + over, after + 2 + back])
    ring = Mesh(np.arange(4 * count), corners, {"hexahedron": cells})
    assert find_sides(ring) is None
