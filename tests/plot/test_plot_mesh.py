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


def test_sets_contacts_and_forces_are_drawn():
    model = sector(8)
    tip = int(model.places.nodes_of("tip")[0])
    disk = sh.Sector(model, "left", "right", 6, rotation="z").with_contacts(
        joint=sh.Friction(
            tangential=(f"{tip}:y",), contact_stiffness=1e6, friction_coefficient=0.3, normal_load=1
        )
    )
    force = sh.forces.EngineOrder(2, pattern={f"{tip}:y": 3.0, f"{tip}:z": 4.0})
    picture = drawing.picture(disk, force=force, sets=["tip"])
    labels = [item.label for item in picture.panels[0].items if item.label]
    assert labels[0].startswith("tip, ")
    assert "contacts, 1" in labels
    assert len(items(picture, "arrow")) == 3  # the axes
    assert picture.panels[0].x.label == (
        "force of engine order 2 on 2 degrees of freedom, $f_0$ = 1 N"
    )
    colours = items(picture, "areas")[0].look["facecolors"]
    assert any(max(colour) - min(colour) > 0.2 for colour in colours)  # a face of the tip
    figure = sh.plot.model(disk, sets=["tip"])
    assert figure.axes[0].get_legend() is not None


def test_bad_sets_say_what_is_allowed():
    mesh, _ = hexahedra.block((1, 1, 1))
    model = hexahedra.structure(mesh)
    assert sh.plot.model(model).axes
    with pytest.raises(KeyError, match="'tip' is no set of nodes"):
        sh.plot.model(model, sets=["tip"])
    blade = sh.single_blade(
        mass=1, stiffness=1e4, damping=1, contact_stiffness=1, friction_coefficient=1, normal_load=1
    )
    with pytest.raises(ValueError, match="expected a structure whose places have a mesh"):
        sh.plot.model(blade, sets=["tip"])


def test_what_is_nearer_is_drawn_later():
    near, _ = hexahedra.block((1, 1, 1), mapped=lambda p: p * 0.5 - [0, 3, 0])
    far, _ = hexahedra.block((1, 1, 1), first=101)
    [areas] = items(drawing.picture(hexahedra.structure(hexahedra.together(near, far))), "areas")
    sizes = [np.ptp(polygon, axis=0).max() for polygon in areas.data[0]]
    assert len(sizes) == 6
    assert max(sizes[3:]) < min(sizes[:3])
