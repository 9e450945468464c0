"""Drawings of structures with a mesh: faces, sets, sides, supports, contacts, forces, axes."""

import warnings

import hexahedra
import numpy as np
import pytest
import swept_bricks

import symhbm as sh
from symhbm.plot.structure import model as drawing


def sector(nodes):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return sh.read_structure(
            [swept_bricks.DATA / f"brick{nodes}" / f"{job}.inp" for job in ("still", "waves")]
        )


def items(picture, kind):
    return [item for item in picture.panels[0].items if item.kind == kind]


@pytest.mark.parametrize("nodes", [8, 20])
def test_faces_that_are_seen_are_drawn_from_back_to_front(nodes):
    model = sector(nodes)
    picture = drawing.picture(model)
    [areas] = items(picture, "areas")
    [polygons] = areas.data
    corners = 4 if nodes == 8 else 8
    assert {polygon.shape for polygon in polygons} == {(corners, 2)}
    skin = sum(map(len, model.places.mesh.skin.values()))
    assert 0.3 * skin < len(polygons) < 0.7 * skin
    for polygon in polygons:  # as the outside has them, one corner after the other
        x, y = polygon.T
        assert np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) > 0
    assert len(areas.look["facecolors"]) == len(polygons)
    labels = [item.label for item in picture.panels[0].items if item.label]
    held = len(model.places.mesh.node) - len(model.places.nodes)
    sides = len(model.places.mesh.sets["left"])
    assert labels == [f"left, {sides} nodes", f"right, {sides} nodes", f"held, {held}"]
    texts = [item.data[1] for item in items(picture, "text")]
    assert texts == ["x", "y", "z, axis of rotation"]
    assert "elements" in picture.panels[0].title


def test_what_is_nearer_is_drawn_later():
    near, _ = hexahedra.block((1, 1, 1), mapped=lambda p: p * 0.5 - [0, 3, 0])
    far, _ = hexahedra.block((1, 1, 1), first=101)
    [areas] = items(drawing.picture(hexahedra.structure(hexahedra.together(near, far))), "areas")
    sizes = [np.ptp(polygon, axis=0).max() for polygon in areas.data[0]]
    assert len(sizes) == 6
    assert max(sizes[3:]) < min(sizes[:3])
