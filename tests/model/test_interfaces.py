"""Pairs of nodes: matched by coordinates, normals, areas, directions, values of a table."""

import numpy as np
import pytest

import symhbm as sh
from tests.refusals import refused

AXES = "xyz"


def model_of(points, directions=AXES, label=None):
    """A model of nodes at points (n, 3), 1 and on, each with a mass in all directions."""
    n, m = len(points), len(directions)
    places = sh.Places(
        np.repeat(np.arange(1, n + 1), m),
        np.tile(list(directions), n),
        np.repeat(points, m, axis=0),
        None if label is None else np.repeat(label, m),
    )
    one = np.eye(n * m)
    return sh.Model(one, one, 1e4 * one, places=places)


def grid(n_x=4, n_y=3, size=(0.03, 0.02), shift=0.0):
    """Points of a rectangle in the plane z = shift, moved a little within it."""
    x, y = np.meshgrid(np.linspace(0, size[0], n_x), np.linspace(0, size[1], n_y))
    return np.column_stack([x.ravel(), y.ravel(), np.full(x.size, shift)])


def two_sides(gap=1e-4, order=None):
    """Two rectangles above each other, the second one in another order."""
    first, second = grid(), grid(shift=gap)
    order = np.random.default_rng(2).permutation(len(second)) if order is None else order
    label = ["lower"] * len(first) + ["upper"] * len(second)
    return model_of(np.vstack([first, second[order]]), label=label), order


def turned(points, axis, angle):
    rotation = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    rotation[[i, j], [i, j]] = np.cos(angle)
    rotation[i, j], rotation[j, i] = -np.sin(angle), np.sin(angle)
    return points @ rotation.T


def test_nodes_are_paired_by_coordinates():
    model, order = two_sides()
    pairs = sh.contact_pairs(model, "lower", "upper")
    assert len(pairs) == 12
    expected = 13 + np.argsort(order)
    assert pairs.nodes.tolist() == np.column_stack([np.arange(1, 13), expected]).tolist()
    np.testing.assert_allclose(pairs.coordinates[:, 2], 0.5e-4)
    np.testing.assert_allclose(pairs.gap, 1e-4)
    np.testing.assert_allclose(pairs.axes[:, 2], np.tile([0, 0, 1.0], (12, 1)), atol=1e-12)
    assert pairs.normal[0] == {"1:z": 1.0, f"{expected[0]}:z": -1.0}
    by_number = sh.contact_pairs(model, np.arange(12, 0, -1), np.arange(13, 25))
    assert by_number.nodes[:, 0].tolist() == [*range(12, 0, -1)]


def test_axes_are_right_handed_and_close_contacts():
    model, _ = two_sides()
    pairs = sh.contact_pairs(model, "upper", "lower", tangential=[1, 1, 0])
    np.testing.assert_allclose(
        pairs.axes @ pairs.axes.transpose(0, 2, 1), [np.eye(3)] * 12, atol=1e-15
    )
    np.testing.assert_allclose(np.linalg.det(pairs.axes), 1.0)
    np.testing.assert_allclose(pairs.axes[:, 0], [[0.5**0.5, 0.5**0.5, 0]] * 12, atol=1e-15)
    group = sh.Friction(
        tangential=pairs.tangential,
        across=pairs.across,
        normal=pairs.normal,
        contact_stiffness=1e12 * pairs.area,
        normal_stiffness=2e12 * pairs.area,
        friction_coefficient=0.3,
        normal_load=1e6 * pairs.area,
    )
    joined = model.with_contacts(joint=group)
    assert joined.n_contacts == 12
    # The upper side moves down by 1: all contacts close by 1, and none slides.
    motion = np.where(joined.places.direction == "z", joined.places.label == "upper", False) * -1.0
    displacements = (joined.directions @ motion).reshape(12, 3)
    np.testing.assert_allclose(displacements, np.tile([0, 0, 1.0], (12, 1)), atol=1e-15)
    np.testing.assert_allclose(joined.contact_coordinates, pairs.coordinates)


@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_areas_sum_to_that_of_the_interface(jitter):
    points = grid(5, 4)
    inside = (points[:, 0] % 0.03 > 0) & (points[:, 1] % 0.02 > 0)
    points[inside, :2] += jitter * 0.005 * np.random.default_rng(1).normal(size=(inside.sum(), 2))
    points = turned(points, 0, 0.7)
    model = model_of(np.vstack([points, points]))
    half = len(points)
    left, right = np.arange(1, half + 1), np.arange(half + 1, 2 * half + 1)
    pairs = sh.contact_pairs(model, left, right, normal=turned(np.array([0, 0, 1.0]), 0, 0.7))
    assert pairs.area.sum() == pytest.approx(6e-4, rel=1e-12)
    assert pairs.area.min() > 0
    if not jitter:  # a node of the grid has a quarter of each cell it is a corner of
        cell = 6e-4 / 12
        corners = np.array([[1, 2, 2, 2, 1], [2, 4, 4, 4, 2], [2, 4, 4, 4, 2], [1, 2, 2, 2, 1]])
        np.testing.assert_allclose(pairs.area, cell * corners.ravel() / 4, rtol=1e-10)
    scaled = sh.contact_pairs(model, left, right, normal=[0, -0.6, 0.8], area=3e-4)
    assert scaled.area.sum() == pytest.approx(3e-4)
    given = sh.contact_pairs(model, left, right, normal=[0, 0, 1], area=1e-6 * left)
    np.testing.assert_allclose(given.area, 1e-6 * left)


def test_normals_of_a_curved_surface():
    angle, height = np.meshgrid(np.linspace(-0.4, 0.4, 9), np.linspace(0, 0.05, 4))
    angle, height = angle.ravel(), height.ravel()
    radial = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    inner = 0.1 * radial + height[:, None] * [0, 0, 1]
    model = model_of(np.vstack([inner, inner + 1e-4 * radial]))
    pairs = sh.contact_pairs(model, np.arange(1, 37), np.arange(37, 73))
    cosine = np.einsum("ij,ij->i", pairs.axes[:, 2], radial)
    assert cosine.min() > np.cos(0.01)
    arc = 0.8 * 0.1 * 0.05
    assert pairs.area.sum() == pytest.approx(arc, rel=3e-3)


def test_unmatched_nodes_are_told():
    points = np.vstack([grid(), grid(shift=1e-4)[:-2], [[1.0, 0, 0]]])
    model = model_of(points)
    with pytest.warns(
        UserWarning,
        match=r"2 of 12 nodes of left \(the first: 11\) and 1 of 11 nodes of right .*: 23\)",
    ):
        pairs = sh.contact_pairs(model, np.arange(1, 13), np.arange(13, 24))
    assert len(pairs) == 10


def test_each_node_has_one_partner():
    points = np.vstack([grid(), grid()[3:4] - 1e-5, grid(shift=1e-4)])
    model = model_of(points)
    left, right = np.arange(1, 14), np.arange(14, 26)
    with pytest.warns(UserWarning, match=r"1 of 13 nodes of left \(the first: 13\)$"):
        pairs = sh.contact_pairs(model, left, right, tolerance=5e-4)
    assert pairs.nodes.tolist() == np.column_stack([left[:12], right]).tolist()


def both(**options):
    return sh.contact_pairs(**(dict(model=two_sides()[0], left="lower", right="upper") | options))


def row(normal=(0, 0, 1), **options):
    """Two lines of five nodes above each other."""
    line = np.column_stack([np.linspace(0, 1, 5), np.zeros(5), np.zeros(5)])
    model = model_of(np.vstack([line, line + np.array([0, 0, 1e-3])]))
    return sh.contact_pairs(model, np.arange(1, 6), np.arange(6, 11), normal=normal, **options)


def in_a_plane(normal):
    line = np.column_stack([np.zeros(3), np.arange(3.0), np.zeros(3)])
    model = model_of(np.vstack([line, line]), "xy")
    return sh.contact_pairs(model, [1, 2, 3], [4, 5, 6], normal=normal, area=[1e-4] * 3)


test_bad_arguments = refused([
    *((lambda options=options: both(**options), error, words) for options, error, words in (
        (dict(left="upside"), KeyError, "left: upside is no node.*nearest"),
        (dict(left=[1, 99]), KeyError, "left: 99 is no node"),
        (dict(left=[1, 1]), ValueError, "each node once"),
        (dict(left=[1.5]), ValueError, "expected integers, the numbers of nodes"),
        (dict(normal=[0, 0]), ValueError, r"shape \(3,\) or \(12, 3\)"),
        (dict(normal=[0, 0, 0]), ValueError, "not 0"),
        (dict(area=[1.0, 2.0]), ValueError, "one number or 12"),
        (dict(area=-1.0), ValueError, "> 0"),
        (dict(axis="w"), ValueError, "axis='w'"),
        (dict(n_sectors=1), ValueError, "n_sectors=1"),
        (dict(tolerance=0.0), ValueError, "tolerance"),
        (dict(model=sh.Model([[1]], [[1]], [[1]])), ValueError, "places with coordinates"),
        (dict(model=3), TypeError, "Model with places"),
        (dict(model=two_sides(gap=0.0)[0]), ValueError, "both sides coincide"),
        (dict(tolerance=5e-5), ValueError, r"expected pairs within it .* 0\.0001 m apart"),
    )),
    (lambda: row(None), ValueError, "not on one line"),
    (row, ValueError, "area=None: expected areas"),
    (lambda: row(area=1.0, tangential=[0, 0, 1]), ValueError, "normal nowhere"),
    (lambda: in_a_plane([0, 0, 1]), ValueError, "normal: expected displacements"),
])  # fmt: skip


def test_lines_with_a_normal_and_areas_are_pairs():
    assert len(row([0, 0, 2], area=np.ones(5))) == 5


N_SECTORS = 12


def blade(directions):
    """Both sides of a sector of twelve, between which the next sector lies turned about z."""
    radius, height = np.meshgrid([0.2, 0.22, 0.24], [0.0, 0.02, 0.05])
    side = np.column_stack([radius.ravel(), 0 * radius.ravel(), height.ravel()])
    angle = np.pi / N_SECTORS
    points = np.vstack([turned(side, 2, angle), turned(side, 2, -angle)])
    return model_of(points, directions, ["high"] * 9 + ["low"] * 9)


def test_pairs_across_the_boundary_of_sectors_are_told_in_these_axes():
    model = blade(AXES)
    pairs = sh.contact_pairs(model, "low", "high", n_sectors=N_SECTORS)
    angle = np.pi / N_SECTORS
    tangential = np.array([-np.sin(angle), np.cos(angle), 0])
    np.testing.assert_allclose(pairs.axes[:, 2], [tangential] * 9, atol=1e-12)
    np.testing.assert_allclose(pairs.gap, 0, atol=1e-15)
    assert pairs.area.sum() == pytest.approx(0.04 * 0.05)
    weights = {repr(place): weight for place, weight in pairs.normal[0].items()}
    expected = {"'1:x'": tangential[0], "'1:y'": tangential[1]}
    expected |= {"next_sector('10:x')": -tangential[0], "next_sector('10:y')": -tangential[1]}
    assert weights == pytest.approx(expected)


def test_cylindrical_directions_are_those_of_each_node():
    ways = ["radial", "tangential", "axial"]
    pairs = sh.contact_pairs(blade(ways), "low", "high", n_sectors=N_SECTORS, tangential=[0, 0, 1])
    assert {repr(p): w for p, w in pairs.normal[0].items()} == pytest.approx(
        {"'1:tangential'": 1.0, "next_sector('10:tangential')": -1.0}
    )
    assert {repr(p): w for p, w in pairs.tangential[4].items()} == pytest.approx(
        {"'5:axial'": 1.0, "next_sector('14:axial')": -1.0}
    )


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_any_axis_turns_sectors(axis):
    turned_axes = np.argsort((np.arange(3) + AXES.index(axis) - 2) % 3)
    points = blade(AXES).places.coordinates[::3][:, turned_axes]
    model = model_of(points, AXES, ["high"] * 9 + ["low"] * 9)
    pairs = sh.contact_pairs(model, "low", "high", n_sectors=N_SECTORS, axis=axis)
    assert len(pairs) == 9
    assert pairs.area.sum() == pytest.approx(0.04 * 0.05)


def test_values_of_a_static_analysis(tmp_path):
    model, _ = two_sides()
    pairs = sh.contact_pairs(model, "lower", "upper")
    points = 1e3 * grid()[::-1]
    table = tmp_path / "static.csv"
    lines = [f"{x},{y},{z},{x + 10 * y},open" for x, y, z in points]
    table.write_text("\n".join(["X, Y, Z, pressure, status", *lines]))
    values = pairs.nearest(table, length=1e-3)
    np.testing.assert_allclose(values["pressure"], 1e3 * (grid()[:, 0] + 10 * grid()[:, 1]))
    assert values["status"].tolist() == ["open"] * 12
    columns = dict(zip(AXES, points.T / 1e3, strict=True)) | dict(gap=np.arange(12))
    assert pairs.nearest(columns)["gap"].tolist() == [*range(11, -1, -1)]
    with pytest.raises(ValueError, match="length= is the unit"):
        pairs.nearest(table)
    with pytest.raises(ValueError, match="columns x, y, z"):
        pairs.nearest({"x": [1.0]})
    for gap in (np.arange(13), np.arange(11)):
        with pytest.raises(ValueError, match="columns of one length"):
            pairs.nearest(columns | dict(gap=gap))
    with pytest.raises(ValueError, match="within 1e-06 m"):
        pairs.nearest(table, 1e-6, length=1e-3)


def test_structures_in_a_plane_have_one_tangential_direction():
    pairs = in_a_plane([1, 0, 0])
    assert pairs.tangential[1] == {"2:y": 1.0, "5:y": -1.0}
    assert pairs.across == []


def plate(keep, n, ratio=1.0, jitter=0.0, meshed=True):
    """Two plates of square cells where ``keep`` says so, and the area of those cells."""
    count = n + 1
    x, y = np.meshgrid(np.arange(count), np.arange(count))
    cells = [(i, j) for j in range(n) for i in range(n) if keep((i + 0.5) / n, (j + 0.5) / n)]
    corners = np.array([[j * count + i, j * count + i + 1, (j + 1) * count + i] for i, j in cells])
    corners = np.column_stack([corners, corners[:, 2] + 1])
    used, corners = np.unique(corners, return_inverse=True)
    corners = corners.reshape(-1, 4)
    points = np.column_stack([x.ravel(), ratio * y.ravel(), 0 * x.ravel()])[used] / n
    inside = np.bincount(corners.ravel()) == 4
    moved = np.random.default_rng(3).uniform(-jitter, jitter, (inside.sum(), 2)) / n
    points[inside, :2] += moved * [1, ratio]
    size = len(points)
    stiffness = np.zeros((size, size))
    for cell in corners:
        stiffness[np.ix_(cell, cell)] += 4 * np.eye(4) - 1
    stiffness = 1e4 * np.kron(np.eye(2), np.kron(stiffness * meshed + np.eye(size), np.eye(3)))
    places = sh.Places(
        np.repeat(np.arange(1, 2 * size + 1), 3),
        [*"xyz"] * 2 * size,
        np.repeat(np.vstack([points, points + np.array([0, 0, 1e-4])]), 3, axis=0),
        np.repeat(["lower", "upper"], 3 * size),
    )
    one = np.eye(6 * size)
    return sh.Model(one, one, stiffness, places=places), len(cells) * ratio / n**2


SHAPES = {
    "L": lambda x, y: min(x, y) < 0.5,
    "frame": lambda x, y: min(x, y) < 1 / 6 or max(x, y) > 5 / 6,
    "flanks": lambda x, y: x < 1 / 6 or x > 5 / 6,
}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("n", "ratio", "jitter"), [(6, 1, 0), (6, 2, 0.1), (12, 1, 0.2)])
def test_areas_of_what_is_no_rectangle(shape, n, ratio, jitter):
    """The mesh tells what is between nodes, however coarse it is."""
    model, exact = plate(SHAPES[shape], n, ratio, jitter)
    with pytest.warns(UserWarning, match="of the area between the nodes is left out"):
        pairs = sh.contact_pairs(model, "lower", "upper", normal=[0, 0, 1])
    assert pairs.area.sum() == pytest.approx(exact, rel=1e-9 if not jitter else 0.02)


@pytest.mark.parametrize("jitter", [0, 0.3])
def test_nothing_is_left_out_of_a_rectangle(jitter):
    model, exact = plate(lambda x, y: True, 8, 3.0, jitter)
    pairs = sh.contact_pairs(model, "lower", "upper", normal=[0, 0, 1])
    assert pairs.area.sum() == pytest.approx(exact, rel=1e-9)


def test_far_larger_triangles_are_left_out_where_no_mesh_is_known():
    """Of nodes alone: what spans two flanks is far larger than the cells."""
    model, exact = plate(SHAPES["flanks"], 24, meshed=False)
    with pytest.warns(UserWarning, match="50% of the area|6.% of the area"):
        pairs = sh.contact_pairs(model, "lower", "upper", normal=[0, 0, 1])
    assert pairs.area.sum() == pytest.approx(exact, rel=1e-9)
