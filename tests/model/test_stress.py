"""Stresses at nodes as linear outputs: uniform strains, supports, what CalculiX says of them."""

import re
import shutil
import warnings
from dataclasses import replace
from itertools import permutations

import hexahedra
import numpy as np
import pytest
import swept_bricks
from scipy.sparse.linalg import spsolve

import symhbm as sh
from symhbm.model.mesh import Mesh, Program, element
from tests.refusals import refused

MODULUS, POISSON = 2.1e11, 0.3
STEEL = {"steel": {"modulus": MODULUS, "poisson": POISSON}}
COMPONENTS = "xx", "yy", "zz", "xy", "yz", "zx"


def skewed(points):
    """Points of a grid, moved so that bricks are no boxes and their edges no straight lines."""
    return points + 0.08 * np.sin(2.0 * points[:, [1, 2, 0]] + points)


def tetrahedra(order):
    """Six tetrahedra in each of four cubes, with midside nodes for the order 2."""
    points, bricks = hexahedra.cells((2, 2, 1))
    corner = {tuple(at): i for i, at in enumerate((element("hexahedron").points + 1) // 2)}
    paths = []
    for ways in permutations(np.eye(3)):
        path = np.cumsum([np.zeros(3), *ways], axis=0)
        inward = np.linalg.det(np.diff(path, axis=0)) > 0
        path = path if inward else path[[1, 0, 2, 3]]
        paths.append([corner[tuple(at)] for at in path])
    points = skewed(points)
    elements = bricks[:, paths].reshape(-1, 4)
    if order == 1:
        return Mesh(1 + np.arange(len(points)), points, {"tetra": elements})
    edges = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
    pairs = np.sort(elements[:, edges].reshape(-1, 2), axis=1)
    unique, which = np.unique(pairs, axis=0, return_inverse=True)
    middles = points[unique - 1].mean(axis=1)
    whole = np.hstack([elements, len(points) + 1 + which.reshape(-1, 6)])
    every = np.vstack([points, middles])
    return Mesh(1 + np.arange(len(every)), every, {"tetra10": whole})


MESHES = {
    "hexahedron": lambda: hexahedra.block((2, 2, 1), 1, mapped=skewed)[0],
    "hexahedron20": lambda: hexahedra.block((2, 2, 1), 2, mapped=skewed)[0],
    "tetra": lambda: tetrahedra(1),
    "tetra10": lambda: tetrahedra(2),
}


def places_of(mesh, supports=(), **told):
    """All directions of all nodes that are not held."""
    node = np.repeat(np.setdiff1d(mesh.node, supports), 3)
    program = Program("by hand", materials=STEEL, **told)
    return sh.Places(node, np.tile(["x", "y", "z"], len(node) // 3), mesh=mesh, program=program)


def hooke(gradient):
    """Stress (6,) of a gradient of displacements [[du_x/dx, du_x/dy, ..], ...], by its compliance.

    Solved from the strains that stresses make, in the place of the law with Lame's constants.
    """
    compliance = np.eye(6) * (1 + POISSON) / MODULUS
    compliance[:3, :3] -= POISSON / MODULUS
    strain = (gradient + gradient.T) / 2
    strains = [strain["xyz".index(a), "xyz".index(b)] for a, b in COMPONENTS]
    return np.linalg.solve(compliance, strains)


def test_the_material_is_that_of_the_elements_at_the_nodes():
    mesh, _ = hexahedra.block((2, 1, 1))
    soft = {"soft": {"modulus": 1e9, "poisson": 0.1}}
    mesh = replace(mesh, materials={"hexahedron": ["steel", "soft"]})
    program = Program("by hand", materials=STEEL | soft)
    places = replace(places_of(mesh), program=program)
    first, middle, last = (mesh.node[mesh.coordinates[:, 0] == x] for x in (0, 1, 2))
    for nodes, name in ((first, "steel"), (last, "soft")):
        own = places.stress(nodes)
        given = places.stress(nodes, **(STEEL | soft)[name])
        assert all(abs(own[key] - given[key]).max() == 0 for key in own)
    with pytest.raises(ValueError, match=r"materials do not tell the same \(steel has .*soft has"):
        places.stress(middle)


@pytest.mark.parametrize("kind", MESHES)
def test_a_uniform_strain_is_exact(kind):
    mesh = MESHES[kind]()
    places = places_of(mesh)
    gradient = 1e-3 * np.random.default_rng(4).normal(size=(3, 3))
    motion = (places.mesh.points(mesh.node) @ gradient.T).ravel()
    expected = hooke(gradient)
    rows = places.stress(mesh.node)
    assert (*rows,) == COMPONENTS
    for name, value in zip(rows, expected, strict=True):
        off = abs(rows[name] @ motion - value).max()
        assert off < 1e-12 * abs(expected).max()


def test_supports_that_were_dropped_are_zero_displacements():
    mesh = MESHES["hexahedron20"]()
    held = mesh.node[mesh.coordinates[:, 0] < 0.15]
    told = np.stack(np.meshgrid(held, range(3), indexing="ij"), axis=-1).reshape(-1, 2)
    whole, few = places_of(mesh), places_of(mesh, held)
    motion = np.random.default_rng(5).normal(size=(len(mesh.node), 3))
    motion[np.isin(mesh.node, held)] = 0
    free = motion[~np.isin(mesh.node, held)].ravel()
    with_supports = mesh.with_sets({"root": held})
    for places, options in (
        (places_of(mesh, held, held=told), {}),
        (few, {"held": held}),
        (replace(few, mesh=with_supports), {"held": "root"}),
    ):
        for name, rows in places.stress(held, **options).items():
            expected = whole.stress(held)[name] @ motion.ravel()
            np.testing.assert_allclose(rows @ free, expected, rtol=1e-12, atol=1e-3)
    with pytest.raises(ValueError, match=f"need {held[0]}:x, which is no degree of freedom here"):
        few.stress(held)
    far = mesh.node[np.argmax(mesh.coordinates[:, 0])]
    few.stress(far)  # no support is in its elements


def test_a_node_has_the_mean_of_its_elements():
    """Of two rods in a row, the one stretched and the other not."""
    mesh, points = hexahedra.block((2, 1, 1))
    motion = np.zeros((len(points), 3))
    motion[:, 0] = np.maximum(points[:, 0] - 1, 0)
    rows = places_of(mesh).stress(mesh.node)["xx"]
    whole = hooke(np.diag([1.0, 0, 0]))[0]
    np.testing.assert_allclose(rows @ motion.ravel(), points[:, 0] / 2 * whole, rtol=1e-12)


TETRA = MESHES["tetra"]()
KNOWN = places_of(TETRA)
LONELY = Mesh([*TETRA.node, 99], np.vstack([TETRA.coordinates, [9, 9, 9]]), TETRA.elements)
FLAT = replace(TETRA, coordinates=TETRA.coordinates * [1, 1, 0])
MATERIALS = [
    (None, "no material is known"),
    ({"steel": {"modulus": MODULUS}}, "poisson: .*steel has none"),
    (STEEL | {"brass": {"modulus": 1e11, "poisson": 0.3}}, "modulus: .*brass has 1"),
]


def of(materials):
    return replace(KNOWN, program=Program("by hand", materials=materials))


test_what_is_not_known_is_refused_in_words = refused([
    *((lambda of_it=told: of(of_it).stress(1), ValueError, words) for told, words in MATERIALS),
    (lambda: KNOWN.stress(1, modulus=-1.0), ValueError, r"modulus=-1.*expected a positive modulus"),
    (lambda: KNOWN.stress(1, poisson=0.5), ValueError, r"poisson=0\.5: expected"),
    (lambda: KNOWN.stress([1, 99]), KeyError, "nodes: 99 is no node of the mesh"),
    (lambda: KNOWN.stress([]), ValueError, r"nodes=.*expected one node at least"),
    (lambda: KNOWN.stress("tipp"), KeyError, "tipp"),
    (lambda: sh.Places([1], "x").stress(1), ValueError, "places: expected a mesh"),
    (lambda: places_of(LONELY).stress([1, 99]), ValueError, "nodes: 99 is in no solid"),
    (lambda: places_of(FLAT).stress(1), ValueError, "is flat or inside out"),
])  # fmt: skip


def test_what_is_given_is_taken_and_each_node_has_its_row():
    for materials, _ in MATERIALS:
        given = of(materials).stress(1, modulus=MODULUS, poisson=POISSON)
        assert abs(given["xx"] - KNOWN.stress(1)["xx"]).max() == 0
    twice = KNOWN.stress([2, 1, 2])["xy"].toarray()
    np.testing.assert_array_equal(twice, KNOWN.stress([1, 2])["xy"].toarray()[[1, 0, 1]])


def read(job):
    """The structure of a job, whatever is said of it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return sh.read_structure(job)


def test_outputs_of_a_structure_that_was_read_and_of_its_archive(tmp_path):
    """In SI whatever the deck has, at supports too: as outputs and in archives."""
    model = read(swept_bricks.DATA / "brick8" / "still.inp")
    root = model.places.stress("bore")
    nodes = model.places.mesh.sets["bore"]
    points = model.places.coordinates
    motion = 1e-3 * np.where(model.places.direction == "x", points[:, 2], 0)
    seen = model.with_outputs(root, units="Pa")
    assert seen.outputs["zx"].rows.shape == (len(nodes), model.n_dof)
    sh.save_structure(model, tmp_path / "sector.nc")
    again = read(tmp_path / "sector.nc").places.stress("bore")
    for name, rows in root.items():
        np.testing.assert_array_equal(again[name] @ motion, rows @ motion)
    with pytest.raises(ValueError, match="which is no degree of freedom here"):
        model.places.of([0, 1]).stress("bore")  # as places of what is condensed


@pytest.mark.parametrize("turned", ["", "*TRANSFORM, NSET=bore, TYPE=C\n0,0,0, 0,0,1\n"])
def test_a_support_is_known_in_the_directions_that_the_deck_tells(tmp_path, turned):
    """Of one direction the others may depend on anything, and all of a node with its own axes."""
    for file in (swept_bricks.DATA / "brick20").glob("still.*"):
        shutil.copy(file, tmp_path)
    deck = (swept_bricks.DATA / "brick20" / "mesh.inp").read_text()
    (tmp_path / "mesh.inp").write_text(deck.replace("bore, 1, 3", f"bore, 1, 1\n{turned}"))
    places = read(tmp_path / "still.inp").places
    way = "x" if turned else "y"
    with pytest.raises(ValueError, match=f"stresses need 1:{way}, which is no degree"):
        places.stress("bore")
    (tmp_path / "mesh.inp").write_text(deck.replace("bore, 1, 3", f"bore, 1, 3\n{turned}"))
    assert read(tmp_path / "still.inp").places.stress("bore")["xx"].nnz


def test_a_material_of_several_temperatures_has_no_stresses(tmp_path):
    for file in (swept_bricks.DATA / "brick20").glob("still.*"):
        shutil.copy(file, tmp_path)
    deck = (swept_bricks.DATA / "brick20" / "mesh.inp").read_text()
    two = deck.replace("2.1E11, 0.3\n", "2.1E11, 0.3, 20.\n1.9E11, 0.3, 400.\n")
    assert two != deck
    (tmp_path / "mesh.inp").write_text(two)
    with pytest.raises(ValueError, match="poisson: expected"):
        read(tmp_path / "still.inp").places.stress("tip")


def deck_of(kind):
    """The deck of a mesh of one kind of elements, held at its set ``bore``."""
    if kind != "C3D10":
        nodes = 8 if kind == "C3D8" else 20
        return swept_bricks.mesh_of(nodes).replace(f"TYPE=C3D{nodes},", f"TYPE={kind},")
    mesh = tetrahedra(2)
    height = mesh.coordinates[:, 2]
    bore = mesh.node[height < height.min() + 0.2]
    rows = np.column_stack([mesh.node, mesh.coordinates])
    lines = ["*NODE", *(f"{row[0]:.0f},{row[1]:.12g},{row[2]:.12g},{row[3]:.12g}" for row in rows)]
    lines += ["*ELEMENT, TYPE=C3D10, ELSET=sector"]
    for number, nodes in enumerate(mesh.elements["tetra10"], 1):
        lines += [",".join(map(str, [number, *nodes]))]
    lines += ["*NSET, NSET=bore", *(f"{node}," for node in bore)]
    lines += ["*NSET, NSET=tip", f"{mesh.node[height.argmax()]},"]
    steel = swept_bricks.mesh_of(20)
    return "\n".join(lines) + "\n" + steel[steel.index("*MATERIAL") :]


def printed_stresses(path):
    """Nodes, and stresses (n, 6), of a file ``.frd``."""
    [block] = re.findall(r"^ -4  STRESS .*\n(?: -5.*\n)*((?: -1.*\n)+)", path.read_text(), re.M)
    lines = block.splitlines()
    values = [[float(line[k : k + 12]) for k in range(13, 85, 12)] for line in lines]
    return [int(line[3:13]) for line in lines], np.array(values)


@pytest.mark.slow
@pytest.mark.skipif(swept_bricks.PROGRAM is None, reason=swept_bricks.MISSING)
@pytest.mark.parametrize(
    ("kind", "apart"), [("C3D8", 2e-5), ("C3D20R", 2e-5), ("C3D10", 5e-6), ("C3D20", 0.15)]
)
def test_stresses_at_nodes_are_those_of_calculix(tmp_path, kind, apart):
    """To the digits of its file and of its numbers that go on from Gauss points to nodes.

    From the 27 points of bricks that are integrated in full it goes on in another manner.
    """
    (tmp_path / "mesh.inp").write_text(deck_of(kind))
    begin = "*INCLUDE, INPUT=mesh.inp\n*STEP\n"
    jobs = {
        "still": "*FREQUENCY, SOLVER=MATRIXSTORAGE\n",
        "pulled": "*STATIC\n*CLOAD\ntip, 2, 1000.\ntip, 3, 300.\n*EL FILE\nS\n",
    }
    for job, cards in jobs.items():
        (tmp_path / f"{job}.inp").write_text(f"{begin}{cards}*END STEP\n")
        swept_bricks.run(tmp_path, job)
    model = read(tmp_path / "still.inp")
    load = np.zeros(model.n_dof)
    for node in model.places.mesh.sets["tip"]:
        load[[model.number_of(f"{node}:{way}") for way in "yz"]] = 1000.0, 300.0
    motion = spsolve(model.stiffness_matrix.tocsc(), load)
    nodes, expected = printed_stresses(tmp_path / "pulled.frd")
    expected = expected * (1e6 if kind == "C3D8" else 1.0)  # of N/mm^2
    own = np.column_stack([rows @ motion for rows in model.places.stress(nodes).values()])
    assert abs(own - expected).max() < apart * abs(expected).max()
