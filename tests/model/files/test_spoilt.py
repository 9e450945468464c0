"""Jobs of a program with one thing wrong each: refused, or told by name, none in silence."""

import re
import shutil
import warnings

import hexahedra
import numpy as np
import pytest
import swept_bricks

import symhbm as sh
from symhbm.model.files import checks
from symhbm.model.mesh import Modes

STILL, TURNING, WAVES = "still", "turning", "waves"


def edited(pattern, text, file="mesh.inp", count=1):
    """A change of one file: what matches a pattern becomes another text."""

    def spoil(folder):
        path = folder / file
        changed, times = re.subn(pattern, text, path.read_text(), count=count, flags=re.M)
        assert times, f"{pattern} is not in {file}"
        path.write_text(changed)

    return spoil


def lines(file, change):
    """A change of the lines of one file."""

    def spoil(folder):
        path = folder / file
        path.write_text("\n".join(change(path.read_text().splitlines())) + "\n")

    return spoil


def swapped(folder):
    """Stiffness and mass exchanged."""
    (folder / "still.mas").rename(folder / "none")
    (folder / "still.sti").rename(folder / "still.mas")
    (folder / "none").rename(folder / "still.sti")


def conjugate(text):
    """Imaginary parts of displacements with the other sign."""
    inside, result = False, []
    for line in text:
        inside = line.startswith(" -4  DISPI") or (inside and not line.startswith(" -3"))
        if inside and line.startswith(" -1"):
            values = [float(line[13 + 12 * k : 25 + 12 * k]) for k in range(3)]
            line = line[:13] + "".join(f"{-value:12.5E}" for value in values)
        result.append(line)
    return result


def doubled(folder):
    """Matrices of a wave, twice as large."""
    edited(r"^\*STEP", f"{swept_bricks.cyclic()}*STEP", "still.inp")(folder)
    for suffix in ("sti", "mas"):
        path = folder / f"still.{suffix}"
        size = len((folder / "still.dof").read_text().split())
        table = np.loadtxt(path)
        again = table + np.array([size, size, 0])
        np.savetxt(path, np.vstack([table, again]), fmt="%d %d %.13e")


def in_node_systems(folder):
    """Matrices over directions of nodes that the deck does not tell."""
    places = [line.split(".") for line in (folder / "still.dof").read_text().split()]
    nodes = np.array(places, dtype=int)[:, 0]
    angle = 0.7 * (nodes % 3)
    size = len(nodes)
    turn = np.eye(size)
    for first in range(0, size, 3):
        c, s = np.cos(angle[first]), np.sin(angle[first])
        turn[first : first + 2, first : first + 2] = [[c, -s], [s, c]]
    for suffix in ("sti", "mas"):
        row, column, value = np.loadtxt(folder / f"still.{suffix}", unpack=True)
        matrix = np.zeros((size, size))
        matrix[row.astype(int) - 1, column.astype(int) - 1] = value
        matrix += np.triu(matrix, 1).T
        at = np.triu_indices(size)
        turned = (turn @ matrix @ turn.T)[at]
        np.savetxt(
            folder / f"still.{suffix}", np.column_stack([*np.add(at, 1), turned]), "%d %d %.13e"
        )


def both(*spoils):
    def spoil(folder):
        for each in spoils:
            each(folder)

    return spoil


SECOND = "*MATERIAL, NAME=light\n*ELASTIC\n{}, 0.3\n*DENSITY\n{}\n"
SECOND += "*SOLID SECTION, ELSET=part, MATERIAL=light\n*BOUNDARY"


def halves(modulus, density):
    """One element of another material."""
    return both(
        edited(r"^\*MATERIAL", "*ELSET, ELSET=part\n5\n*MATERIAL"),
        edited(r"^\*BOUNDARY", SECOND.format(modulus, density)),
    )


def without_rows(folder, of):
    """Matrices without the rows of a node or of node.direction, as of what depends on others."""
    rows = (folder / "still.dof").read_text().split()
    gone = {k for k, row in enumerate(rows, 1) if of in (row, row.split(".")[0])}
    kept = [k for k in range(1, len(rows) + 1) if k not in gone]
    number = {k: at for at, k in enumerate(kept, 1)}
    (folder / "still.dof").write_text("\n".join(rows[k - 1] for k in kept) + "\n")
    for suffix in ("sti", "mas"):
        entries = [line.split() for line in (folder / f"still.{suffix}").read_text().splitlines()]
        (folder / f"still.{suffix}").write_text("".join(
            f"{number[int(i)]} {number[int(j)]} {value}\n"
            for i, j, value in entries if not {int(i), int(j)} & gone
        ))  # fmt: skip


def one_side_depends(folder):
    """Equations of a node of the right side alone."""
    node = re.search(r"NSET=free_right\n(\d+),", (folder / "mesh.inp").read_text())[1]
    without_rows(folder, node)
    edited(r"^\*STEP", f"*EQUATION\n2\n{node},1,1., 1,1,-1.\n*STEP", "still.inp")(folder)


def held_along_axes_of_its_own(folder):
    """A node that is held along its radius, for which one of x and y is no row."""
    node = re.search(r"NSET=tip\n(\d+),", (folder / "mesh.inp").read_text())[1]
    without_rows(folder, f"{node}.1")
    cards = "*TRANSFORM, NSET=tip, TYPE=C\n0,0,0, 0,0,1\n*BOUNDARY\n"
    edited(r"^\*BOUNDARY", f"{cards}{node},1,1")(folder)


def quadratic_beside(folder):
    """A quadratic brick on the face of a linear one, between no nodes of its own edges."""
    text = (folder / "mesh.inp").read_text()
    corners = re.search(r"ELSET=sector\n1,(\d+),(\d+),(\d+),(\d+)", text).groups()
    more = "".join(f"{k},{90 + k % 7},{k % 3 - 1},{-10 - k % 5}\n" for k in range(101, 117))
    words = [*corners, *map(str, range(101, 117))]
    card = f"*NODE\n{more}*ELEMENT, TYPE=C3D20, ELSET=fine\n77,{','.join(words[:10])},\n"
    card += ",".join(words[10:]) + "\n*MATERIAL"
    edited(r"^\*MATERIAL", card)(folder)


MOVED = r"^(9,)[^,]*(,.*)$"
HALF = lambda text: text[: len(text) // 2]  # noqa: E731
SIDES = both(
    edited("NSET=left", "NSET=wrong"),
    edited("NSET=right", "NSET=left"),
    edited("NSET=wrong", "NSET=right"),
)
NOT_REFUSED = {
    "kilograms beside newtons per square millimetre": (
        edited(r"7\.8E-9", "7800."),
        "steel: density 7800 kg.*which no metal has, are units= right",
    ),
    "coordinates in metres beside tonnes": (
        lines("mesh.inp", lambda text: [
            ",".join([words[0], *(f"{float(word) / 1e3:.9g}" for word in words[1:])])
            if len(words := line.split(",")) == 4 else line
            for line in text
        ]),
        r"the mesh reaches 0\.00027. m from 0",
    ),
    "a material without density": (
        edited(r"^\*DENSITY\n.*\n", ""), "5 elements have no section or no density"
    ),
    "sides exchanged": (SIDES, "sides are exchanged: right should be left turned by 60 degrees"),
    "sides that nobody names": (
        both(edited("NSET=left", "NSET=low"), edited("NSET=right", "NSET=high")),
        "nobody names the sides; left and right are all nodes that touch the next sector",
    ),
    "a node moved after the run": (edited(MOVED, r"\g<1>180.0\2"), "of another mesh or density"),
    "a side with a node that is elsewhere": (
        edited(r"^(NSET=right\n)?(\*NSET, NSET=right)\n\d+,", r"\2\n1,"), "do not match: 5 of 6"
    ),
    "mass and stiffness exchanged": (swapped, "of another mesh or density"),
    "an empty set": (
        edited(r"(\*NSET, NSET=tip)\n(\d+,\n)*", r"\1\n"), "set tip is empty"
    ),
    "a material in other units than another one": (
        halves("70.E9", "2700."), "steel: density 7.8e-09 kg.*which no metal has, are units= right"
    ),
    "another density than the matrices have": (
        halves("72000.", "2.7E-9"), "the mass matrix is of another mesh or density"
    ),
    "elements without a section": (
        both(
            edited(r"^\*MATERIAL", "*ELSET, ELSET=part\n1,2,3\n*MATERIAL"),
            edited("ELSET=sector, MATERIAL", "ELSET=part, MATERIAL"),
        ),
        "2 elements have no section or no density",
    ),
    "a density below 0": (edited(r"7\.8E-9", "-7.8E-9"), "steel.*which no metal has"),
    "two nodes of one number": (
        edited(r"^\*MATERIAL", "*NODE\n9,150.,0,0\n*MATERIAL"),
        r"1 nodes have several places, the last ones count .*: 9",
    ),
    "a step that leads beyond the last number": (
        edited(r"^\*MATERIAL", "*NSET, NSET=odd, GENERATE\n1,10,4\n*MATERIAL"),
        "set odd is generated from 1 to 10 by 4, which does not lead there",
    ),
    "a step of 0": (
        edited(r"^\*MATERIAL", "*NSET, NSET=odd, GENERATE\n1,3,0\n*MATERIAL"),
        "set odd is generated from 1 to 3 by 0, which does not lead there",
    ),
    "numbers of no node": (
        edited(r"^\*MATERIAL", "*NSET, NSET=far, GENERATE\n20,25\n*MATERIAL"),
        r"set far: 3 of 6 generated numbers are those of no node \(the first: 23",
    ),
    "equations of one side": (
        one_side_depends, "1 pairs of the sides are not free alike .*equations of one side"
    ),
    "supports along axes of nodes": (
        held_along_axes_of_its_own, "1 nodes are held along axes of their own, by .TRANSFORM"
    ),
    "supports that the matrices do not have": (
        edited(r"^\*BOUNDARY", "*BOUNDARY\ntip, 3, 3"), "directions of supports are free"
    ),
    "linear and quadratic bricks beside each other": (
        quadratic_beside, "linear and quadratic elements meet at 1 faces"
    ),
    "elements that are no solids": (
        edited(r"^\*MATERIAL", "*ELEMENT, TYPE=S4, ELSET=shell\n99,1,2,3,4\n*MATERIAL"),
        "no part of the mesh: 1 S4",
    ),
    "materials that damp differently": (
        edited(r"^\*SOLID", "*MATERIAL, NAME=foam\n*DAMPING, ALPHA=2.\n*DENSITY\n8.E-9\n*SOLID"),
        "materials damp differently",
    ),
    "rows that depend on others": (
        both(
            lines("still.dof", lambda text: text[:-1]),
            lines("still.sti", lambda text: [t for t in text if " 48 " not in f" {t}"]),
            lines("still.mas", lambda text: [t for t in text if " 48 " not in f" {t}"]),
            edited(r"^\*STEP", "*EQUATION\n2\n22,3,1., 21,3,-1.\n*STEP", "still.inp"),
        ),
        r"1 degrees of freedom depend on others .*\*EQUATION",
    ),
}  # fmt: skip
"""Of the job with matrices alone: what is done, and what the warning says."""
WITH_MODES = {
    "another sense": (
        lines("waves.frd", conjugate), "nodal diameters of the program are of the sense here"
    ),
    "nodal diameters of other modes": (
        edited(r"(1PHID +)1", r"\g<1>2", "waves.frd", 0), "no wave of 2 nodal diameters"
    ),
    "modes of another stiffness": (
        edited(r"(?<= )1314\.68", "1318.68", "waves.frd", 0), "mode of 1318.69 Hz has 1314.69 Hz"
    ),
    "directions of nodes ignored": (in_node_systems, "another speed, mesh, material or support"),
    "directions exchanged": (
        lines("still.dof", lambda text: [t[:-1] + "213"[int(t[-1]) - 1] for t in text]),
        "another speed, mesh, material or support",
    ),
    "another axis": (
        edited("0,0,0, 0,0,1", "0,0,0, 1,0,0", "waves.inp"), "do not match: 0 of 4 .* about x"
    ),
    "another number of sectors": (
        edited("N=6", "N=8", "waves.inp"), "do not match: 0 of 4 and 4 nodes are 45 degrees"
    ),
    "a side without one of its nodes": (
        edited(r"(\*NSET, NSET=free_left)\n\d+,", r"\1"), "do not match: 3 of 3 and 4"
    ),
}  # fmt: skip
"""Of matrices and modes."""
REFUSED = {
    "no matrices": (lambda f: (f / "still.dof").unlink(), ValueError, "expected matrices"),
    "no mass": (lambda f: (f / "still.mas").unlink(), FileNotFoundError, "still.mas'"),
    "half of a matrix": (lines("still.sti", HALF), ValueError, "expected.*rows|has 48"),
    "a matrix without its last entries": (
        lines("still.sti", lambda text: text[:-1]), ValueError, "has 48|no diagonal entry"
    ),
    "a line that is broken": (
        edited(r"^(3 3 .*)e", r"\1f", "still.sti"), ValueError, "truncated, damaged, or no matrix"
    ),
    "fewer rows": (lines("still.dof", HALF), ValueError, "48 rows, still.dof has 24"),
    "matrices of one nodal diameter": (doubled, ValueError, "waves of one nodal diameter"),
    "a set of unknown nodes": (
        edited(r"(NSET=tip)\n", r"\1\n999,\n"), ValueError, r"sets\['tip'\]: 999 is no node"
    ),
    "a set of an unknown set": (
        edited(r"(NSET=tip)\n", r"\1\nblades\n"), ValueError, "no deck of CalculiX .*blades"
    ),
    "elements of unknown nodes": (edited(r"^1,\d+,", "1,777,"), ValueError, "777 is no node"),
    "no file that is included": (
        lambda f: (f / "mesh.inp").unlink(), FileNotFoundError, "mesh.inp|still.inp"
    ),
    "matrices along directions of nodes": (
        edited("MATRIXSTORAGE", "MATRIXSTORAGE, GLOBAL=NO", "still.inp"), ValueError, "GLOBAL=NO"
    ),
    "two elements of one number": (
        edited(r"^\*MATERIAL", "*ELEMENT, TYPE=C3D4, ELSET=b\n3,1,2,4,9\n*MATERIAL"),
        ValueError,
        "element 3 comes twice",
    ),
    "rows of nodes that the program made": (
        edited(r"^22\.1", "99.1", "still.dof"), ValueError, "node 99 .* shells, beams and rigid"
    ),
    "a section of a material that is not there": (
        edited("MATERIAL=steel$", "MATERIAL=stele"), ValueError, "unknown material stele"
    ),
    "a support of an unknown name": (
        edited(r"^bore, 1, 3", "bore, FIXED"), ValueError, "no deck of CalculiX .*FIXED"
    ),
    "no nodes": (edited(r"^\*NODE,", "*NODES,"), ValueError, r"expected \*NODE"),
    "results of another mesh": (
        edited(MOVED, r"\g<1>180.0\2"), ValueError, "waves.frd is of another mesh than waves.inp"
    ),
    "results cut off": (lines("waves.frd", lambda text: text[:40]), ValueError, "is cut off"),
    "an axis beside 0": (
        edited("0,0,0, 0,0,1", "50,0,0, 50,0,1", "waves.inp"), ValueError, "expected the axis x, y"
    ),
    "an axis that is askew": (
        edited("0,0,0, 0,0,1", "0,0,0, 1,0,1", "waves.inp"), ValueError, "expected the axis x, y"
    ),
    "sides without a name": (
        edited("free_left", "free_lift", "waves.inp"), ValueError, "no deck of CalculiX .*free_lift"
    ),
}  # fmt: skip
"""What is raised, of matrices and modes."""


@pytest.fixture
def folder(tmp_path):
    for file in (swept_bricks.DATA / "brick8").iterdir():
        shutil.copy(file, tmp_path)
    return tmp_path


def read(folder, *jobs):
    """A structure, and what is said of it: the warning, and its account."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        model = sh.read_structure([folder / f"{job}.inp" for job in jobs])
    return model, "; ".join(str(warning.message) for warning in caught)


@pytest.mark.parametrize("name", NOT_REFUSED)
def test_what_is_wrong_is_told(folder, name):
    spoil, words = NOT_REFUSED[name]
    assert not re.search(words, read(folder, STILL)[1])
    spoil(folder)
    assert re.search(words, read(folder, STILL)[1])


@pytest.mark.parametrize("name", WITH_MODES)
def test_the_modes_of_the_program_tell_what_is_wrong(folder, name):
    spoil, words = WITH_MODES[name]
    model, said = read(folder, STILL, WAVES)
    assert not re.search(words, said + " ".join(model.places.program.account))
    spoil(folder)
    model, said = read(folder, STILL, WAVES)
    assert re.search(words, said + " ".join(model.places.program.account))


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_is_refused(folder, name):
    spoil, error, words = REFUSED[name]
    spoil(folder)
    with pytest.raises(error, match=words) as caught:
        read(folder, STILL, WAVES)
    assert "\n" not in str(caught.value)


def test_jobs_that_do_not_belong_together(folder):
    edited(r"^\*STEP", "*NODE\n9,150,0,0\n*STEP", "waves.inp")(folder)
    (folder / "waves.frd").unlink()
    with pytest.raises(ValueError, match="of different meshes, node 9 is"):
        read(folder, STILL, WAVES)
    shutil.copy(folder / "still.inp", folder / "again.inp")
    for suffix in ("sti", "mas", "dof"):
        shutil.copy(folder / f"still.{suffix}", folder / f"again.{suffix}")
    with pytest.raises(ValueError, match="expected each speed once"):
        read(folder, STILL, "again")
    said = read(folder, STILL, "turning_waves")[1]
    assert "modes of turning_waves.inp are at another speed, not compared" in said
    edited("STEP, PERTURBATION", "STEP", "turning.inp")(folder)
    model, said = read(folder, TURNING)
    assert "at rest: their *STEP has no PERTURBATION" in said
    assert model.places.program.speed is None
    np.savez(folder / "sector.npz", M=np.eye(3), K=np.eye(3))
    with pytest.raises(ValueError, match="jobs of one program"):
        sh.read_structure([folder / "still.inp", folder / "sector.npz"])


def test_units_that_are_wrong_are_doubted(folder):
    with pytest.warns(UserWarning, match="no metal has, are units= right"):
        sh.read_structure(folder / "still.inp", units="m-kg-s")


def test_sectors_and_pairs_refuse_what_is_left(folder):
    """Sides the other way round; half of the supports of an interface."""
    model, _ = read(folder, STILL)
    with pytest.raises(ValueError, match="exchange the two"):
        sh.Sector(model, "right", "left", 6, rotation="z")
    with pytest.warns(UserWarning, match="2 nodes of right are held .*of the area is theirs"):
        sh.contact_pairs(model, "left", "right", n_sectors=6)


def test_sides_that_are_held_along_one_direction_are_refused(folder):
    model, _ = read(folder, STILL)
    at_sides = np.isin(model.places.node, model.places.nodes_of("left"))
    at_sides |= np.isin(model.places.node, model.places.nodes_of("right"))
    kept = np.flatnonzero(~(at_sides & (model.places.direction == "y")))
    mass, stiffness = (m[kept][:, kept] for m in (model.mass_matrix, model.stiffness_matrix))
    part = sh.Model(mass, 0 * stiffness, stiffness, places=model.places.of(kept))
    with pytest.raises(ValueError, match=r"left: .*, \d+:x is there alone; hold both or none"):
        sh.Sector(part, "left", "right", 6, rotation="z")


@pytest.mark.parametrize(("error", "doubted"), [(0.5e-5, False), (1e-3, True)])
def test_rigid_modes_are_compared_up_to_their_digits(error, doubted):
    """A free chain of nodes: the energy of a translation is that of its last digit alone."""
    mesh, _ = hexahedra.block((2, 2, 2))
    size = len(mesh.node)
    near = np.linalg.norm(mesh.coordinates[:, None] - mesh.coordinates, axis=2) < 1.1
    links = np.kron(np.diag(near.sum(axis=1)) - near, np.eye(3))
    free = hexahedra.structure(mesh)
    model = sh.Model(np.eye(3 * size), 0 * links, 1e10 * links, places=free.places)
    shape = 2.0 + np.random.default_rng(0).uniform(-error, error, (1, size, 3))
    account = []
    checks._compare(model, None, Modes(np.zeros(1), None, shape), account)
    assert any(line.startswith("LOOK") for line in account) == doubted


def test_rounded_digits_have_twice_their_mean_square():
    motion = np.random.default_rng(0).uniform(1, 10, (20000, 1)) * (1 - 1j)
    error = np.round(motion, 5) - motion
    np.testing.assert_allclose(checks._rounded(motion), 2 * np.mean(abs(error) ** 2), rtol=0.03)
