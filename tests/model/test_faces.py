"""Areas and normals of pairs by the faces of elements, and names of overlapping sets."""

import warnings

import hexahedra
import numpy as np
import pytest

import symhbm as sh
from symhbm.model.mesh import Mesh, element, kinds
from tests.refusals import refused

SHAPES = {
    "rectangle": lambda x, y, z: True,
    "L": lambda x, y, z: min(x, y) < 2,
    "frame": lambda x, y, z: min(x, y) < 1 or max(x, y) > 3,
    "flanks": lambda x, y, z: x < 1 or x > 3,
}


def pressed(order, keep=SHAPES["rectangle"], mapped=lambda p: p, n=4):
    """Two blocks of cells of one unit that touch at z = 1, and the set of each side."""
    lower, below = hexahedra.block((n, n, 1), order, keep, mapped)
    above = lambda p: mapped(p + np.array([0, 0, 1.0]))  # noqa: E731
    upper, over = hexahedra.block((n, n, 1), order, keep, above, first=1001)
    sets = {"lower": lower.node[below[:, 2] == 1], "upper": upper.node[over[:, 2] == 0]}
    return hexahedra.together(lower, upper, sets=sets)


def quietly(mesh, *sides, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return sh.contact_pairs(hexahedra.structure(mesh), *sides, **options)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("shape", SHAPES)
def test_areas_are_those_of_the_faces(shape, order):
    """Holes, notches and two flanks of one set are no part of them; both sides lie together."""
    keep = SHAPES[shape]
    mesh = pressed(order, keep)
    count = sum(keep(x + 0.5, y + 0.5, 0.5) for x in range(4) for y in range(4))
    pairs = quietly(mesh, "lower", "upper")
    assert pairs.area.sum() == pytest.approx(count, rel=1e-12)
    assert pairs.area.min() > 0
    np.testing.assert_allclose(pairs.axes[:, 2], np.tile([0, 0, 1.0], (len(pairs), 1)), atol=1e-14)
    np.testing.assert_allclose(pairs.gap, 0, atol=1e-14)
    back = quietly(mesh, "upper", "lower")
    np.testing.assert_allclose(back.axes[:, 2, 2], -1)
    by_number = quietly(mesh, mesh.sets["lower"], mesh.sets["upper"])
    np.testing.assert_array_equal(by_number.area, pairs.area)
    assert quietly(mesh, "lower", "upper", area=3.0).area.sum() == pytest.approx(3.0)


def parabola(radius, half):
    """Length of the parabola through three points of an arc, its middle and its ends."""
    chord, sagitta = radius * np.sin(half), radius * (1 - np.cos(half))
    slope = 2 * sagitta / chord
    return chord * (np.sqrt(1 + slope**2) + np.arcsinh(slope) / slope)


@pytest.mark.parametrize("order", [1, 2])
def test_areas_of_a_cylinder_are_those_of_its_faces(order):
    """Of chords, or of parabolas, times the height; normals lean with the faces."""

    def around(p):
        radius, angle = 1 + 0.3 * p[:, 2], 0.3 * p[:, 0]
        return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 2 * p[:, 1]])

    pairs = quietly(pressed(order, mapped=around), "lower", "upper")
    length = 2 * 1.3 * np.sin(0.15) if order == 1 else parabola(1.3, 0.15)
    assert pairs.area.sum() == pytest.approx(4 * length * 8, rel=1e-10)
    radial = pairs.coordinates * [1, 1, 0]
    radial /= np.linalg.norm(radial, axis=1, keepdims=True)
    cosine = np.einsum("ij,ij->i", np.abs(pairs.axes[:, 2]), np.abs(radial))
    assert cosine.min() > np.cos(0.151 if order == 1 else 0.002)


def test_edges_of_a_thin_part_are_no_faces_of_its_two_flanks():
    """All its nodes are of the set: what lies on faces of the other side counts alone."""
    thin, at = hexahedra.block((3, 3, 1))
    low, under = hexahedra.block((3, 3, 1), mapped=lambda p: p - [0, 0, 1], first=1001)
    top, over = hexahedra.block((3, 3, 1), mapped=lambda p: p - [0, 0, -1], first=2001)
    outside = np.append(low.node[under[:, 2] == 1], top.node[over[:, 2] == 0])
    mesh = hexahedra.together(thin, low, top, sets={"thin": thin.node, "outside": outside})
    pairs = quietly(mesh, "thin", "outside")
    assert pairs.area.sum() == pytest.approx(18, rel=1e-12)
    assert sorted({*np.round(pairs.axes[:, 2, 2], 12).tolist()}) == [-1, 1]
    # One of them is held: its share is told, and of no pair.
    held = hexahedra.structure(mesh, held=[1])
    with pytest.warns(UserWarning, match=r"1 nodes of left are held .* of the area is theirs"):
        pairs = sh.contact_pairs(held, "thin", "outside")
    assert pairs.area.sum() == pytest.approx(17.75, rel=1e-12)
    # A surface names faces themselves.
    faces = {"quad": [face for face in thin.skin["quad"] if (at[face - 1, 2] == 1).all()]}
    named = hexahedra.together(thin, low, top, sets={"out": outside}, surfaces={"flank": faces})
    with pytest.warns(UserWarning, match="16 of 32 nodes of right"):
        pairs = sh.contact_pairs(hexahedra.structure(named), "flank", "out")
    assert pairs.area.sum() == pytest.approx(9, rel=1e-12)


def test_what_has_no_partner_or_is_held_has_its_area_told():
    """Midside nodes against a linear mesh, and supports amid an interface."""
    fine, at = hexahedra.block((2, 2, 1), 2)
    coarse, over = hexahedra.block((2, 2, 1), mapped=lambda p: p - [0, 0, -1], first=1001)
    sets = {"lower": fine.node[at[:, 2] == 1], "upper": coarse.node[over[:, 2] == 0]}
    mesh = hexahedra.together(fine, coarse, sets=sets)
    with pytest.warns(
        UserWarning, match=r"12 of 21 nodes of left .* 84\.21% of the area is theirs"
    ):
        pairs = sh.contact_pairs(hexahedra.structure(mesh), "lower", "upper")
    assert pairs.area.sum() == pytest.approx(4 * 3 / 19)
    mesh = pressed(1, n=2)
    held = mesh.sets["lower"][:1]
    model = hexahedra.structure(mesh, np.append(held, mesh.sets["upper"][:1]))
    words = rf"1 nodes of left are held \(the first: {held[0]}\); 1 nodes of right .* 6\.25% of the"
    with pytest.warns(UserWarning, match=words):
        pairs = sh.contact_pairs(model, "lower", "upper")
    assert pairs.area.sum() == pytest.approx(3.75)


def test_nodes_that_are_in_no_face_are_told():
    mesh = pressed(1, n=2)
    inner = mesh.sets["lower"]
    sets = {"some": inner[[0, 1, 2, 3, 4, 5, 8]]}  # the last one is in a face with missing nodes
    with pytest.warns(UserWarning, match="1 nodes of left are in no face and have no area"):
        pairs = sh.contact_pairs(hexahedra.structure(mesh.with_sets(sets)), "some", "upper")
    assert pairs.area.sum() == pytest.approx(2)


def test_names_of_overlapping_sets_are_names_of_nodes():
    mesh = pressed(1).with_sets({"both": [1, 2, 1001], "alone": [5], "base": [7, 8]})
    model = hexahedra.structure(mesh, held=[7, 8])
    assert model.places.nodes_of("both").tolist() == [1, 2, 1001]
    assert 1 in model.places.nodes_of("both")
    assert model.number_of("alone:y") == model.number_of("5:y")
    np.testing.assert_array_equal(model.places.coordinates[0], mesh.points(1))
    with pytest.raises(KeyError, match="base is a set of nodes without degrees of freedom"):
        model.places.nodes_of("base")
    with pytest.raises(KeyError, match="is of the nodes 1, 2, 1001"):
        model.number_of("both:x")
    labelled = model.places.labelled({"alone": 6})
    assert labelled.nodes_of("alone").tolist() == [6]  # a label of one's own counts
    with pytest.raises(ValueError, match="nodes of the mesh"):
        sh.Places([99999], ["x"], mesh=mesh)


@pytest.mark.parametrize("kind", kinds())
def test_elements_fill_their_cells(kind):
    """Shape functions are 1 at their nodes; quadratures, volumes and faces fit each other."""
    of = element(kind)
    np.testing.assert_allclose(of.shape(of.points)[0], np.eye(len(of.points)), atol=1e-12)
    at, weight = of.quadrature(4)
    volume = {"triangle": 1 / 2, "quad": 4, "tetra": 1 / 6, "wedge": 1, "hexahedron": 8}
    assert weight.sum() == pytest.approx(volume[of.cell])
    powers = at[:, 0] ** 2 * at[:, 1] ** 2  # a polynomial, by two quadratures
    finer, weights = of.quadrature(6)
    assert weight @ powers == pytest.approx(weights @ (finer[:, 0] ** 2 * finer[:, 1] ** 2))
    if of.n_axes == 2:
        return
    # The divergence theorem: faces look outwards and close the cell.
    mesh = Mesh(np.arange(len(of.points)), of.points, {kind: [np.arange(len(of.points))]})
    flux = 0.0
    for face, nodes in of.faces:
        flat = element(face)
        on, w = flat.quadrature(4)
        shape, slope = flat.shape(on)
        corners = of.points[list(nodes)]
        along = np.einsum("qan,nb->aqb", slope, corners)
        flux += np.einsum("q,qb,qb->", w, np.cross(along[0], along[1]), shape @ corners)
    assert flux / 3 == pytest.approx(volume[of.cell])
    assert sum(map(len, mesh.skin.values())) == len(of.faces)
    mass, moment, _ = mesh.weighed({kind: [2.0]})
    assert mass.sum() == pytest.approx(2 * volume[of.cell])
    np.testing.assert_allclose(
        moment.sum(axis=0) / mass.sum(), weights @ finer / weights.sum(), atol=1e-15
    )


ONE = np.zeros((1, 3))
test_bad_meshes = refused([
    (lambda: Mesh([1, 1], np.zeros((2, 3))), ValueError, "each node once"),
    (lambda: Mesh([1, 2], np.zeros((2, 2))), ValueError, r"shape \(2, 3\)"),
    (lambda: Mesh([1], ONE, {"hexa": [[1]]}), KeyError, "no kind of elements"),
    (lambda: Mesh([1], ONE, {"tetra": [[1]]}), ValueError, "expected 4 nodes in each row"),
    (lambda: Mesh([1], ONE, {}, {"tip": [2]}), ValueError, "2 is no node of the mesh"),
])  # fmt: skip
