"""CalculiX: its matrices, sets, loads and modes, read from jobs that it ran, and anew."""

import re
import shutil
import warnings
from pathlib import Path

import numpy as np
import pytest
import swept_bricks
from scipy.linalg import eigh

import symhbm as sh
from symhbm.model.files.programs import calculix as reader
from symhbm.model.files.programs.deck import Deck

BRICKS = [8, 20]
TURNING = swept_bricks.SPEED


@pytest.fixture(params=BRICKS)
def brick(request):
    return request.param


@pytest.fixture
def folder(brick):
    return swept_bricks.DATA / f"brick{brick}"


def quietly(*jobs, **options):
    """The structure of some jobs, whatever is said of it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return sh.read_structure([job.with_suffix(".inp") for job in jobs], **options)


def modes_of(job):
    """Frequencies [Hz], nodal diameters and shapes of a job, over the nodes of its mesh."""
    contents = reader.read({"": job.with_suffix(".inp")}, {})
    return contents.program.modes, contents.mesh


def disk_of(model):
    return sh.Sector(model, "left", "right", swept_bricks.N_SECTORS, rotation="z")


def check_modes(job, model, sense):
    """Frequencies to 1e-6, and shapes as waves of the sense."""
    modes, mesh = modes_of(job)
    disk = disk_of(model)
    at = mesh.at(model.places.node), np.searchsorted([*"xyz"], model.places.direction)
    for wave in swept_bricks.WAVES:
        chosen = modes.nodal_diameter == wave
        natural = sh.natural_modes(disk, nodal_diameter=sense * wave, count=int(chosen.sum()))
        np.testing.assert_allclose(
            natural.frequency.values, modes.frequency[chosen], rtol=1e-6, atol=0
        )
        for frequency, shape in zip(modes.frequency[chosen], modes.shape[chosen], strict=True):
            motion = shape[at]
            assert likeness(model, disk, motion, frequency, sense * wave) > 1 - 1e-6
            if 0 < wave < swept_bricks.N_SECTORS / 2:
                assert likeness(model, disk, motion, frequency, -sense * wave) < 0.99


def likeness(model, disk, motion, frequency, wave):
    """Square of the cosine, by the mass, between a motion and our mode of a wave there."""
    matrices = disk.matrices(wave)
    squares, shapes = eigh(matrices.stiffness_matrix.toarray(), matrices.mass_matrix.toarray())
    mode = shapes[:, np.argmin(abs(np.sqrt(squares) / 2 / np.pi - frequency))]
    own = disk.expanded(mode, wave)
    one, other, both = (
        left.conj() @ (model.mass_matrix @ right)
        for left, right in ((own, own), (motion, motion), (own, motion))
    )
    return abs(both) ** 2 / (one * other).real


SENSE = {8: -1, 20: 1}
"""Of CalculiX's nodal diameters: they are those here where the right side depends on the left."""


def test_natural_frequencies_and_waves_are_those_of_the_program(folder, brick):
    check_modes(folder / "waves", quietly(folder / "still"), SENSE[brick])


def test_natural_frequencies_and_waves_under_speed(folder, brick):
    model = quietly(folder / "turning")
    assert model.places.program.speed == pytest.approx(TURNING)
    check_modes(folder / "turning_waves", model, SENSE[brick])
    both = quietly(folder / "still", folder / "turning")
    assert both.speeds == pytest.approx((0, TURNING))
    check_modes(folder / "waves", both.at(0), SENSE[brick])
    check_modes(folder / "turning_waves", both.at(TURNING), SENSE[brick])


def displacements(path):
    """Displacements (n, 3) of a table, by the number of their node."""
    table = path.read_text().partition("displacements")[2].splitlines()[2:]
    rows = [line.split() for line in table[: table.index("")]]
    return {int(node): np.array([*map(float, values)]) for node, *values in rows}


def test_static_displacement_under_speed(folder, brick):
    """By our own centrifugal load of mesh and density, and the stiffness at rest."""
    model = quietly(folder / "still", folder / "waves")
    load = model.places.centrifugal_load(TURNING)
    disk = disk_of(model)
    stiffness = disk.matrices(0).stiffness_matrix
    felt = disk.felt_static(sh.forces.StaticLoad(load))
    motion = disk.expanded(np.linalg.solve(stiffness.toarray(), felt), 0).real
    expected = displacements(folder / "static.dat")
    unit = 1e-3 if brick == 8 else 1.0
    nodes = np.unique(model.places.node)
    given = np.array([motion[model.places.dofs_of(node)] for node in nodes.tolist()])
    wanted = unit * np.array([expected[node] for node in nodes.tolist()])
    assert abs(given - wanted).max() < 1e-6 * abs(wanted).max()
    # What the program told of large displacements is near, in metres, too.
    turning = quietly(folder / "turning").places
    own = turning.program.displacement[turning.mesh.at(nodes)]
    assert abs(own - wanted).max() < 0.1 * abs(wanted).max()


def test_mass_and_centre_are_those_of_the_program(folder, brick):
    program = quietly(folder / "still").places.program
    text = (folder / "static.dat").read_text()
    words = text.partition("total mass for set")[2].split("\n\n", 2)[1]
    tonnes = 1e3 if brick == 8 else 1.0
    assert program.mass.sum() == pytest.approx(tonnes * float(words), rel=1e-6)
    centre = np.array(text.partition("center of gravity")[2].split("\n\n", 2)[1].split(), float)
    unit = 1e-3 if brick == 8 else 1.0
    told = quietly(folder / "still", folder / "static").places.program.account
    assert f"static.inp: total mass, by the program in its units: {words.strip()}" in told
    np.testing.assert_allclose(
        program.moment.sum(axis=0) / program.mass.sum(), unit * centre, rtol=1e-6
    )


def test_the_account_says_what_was_found(folder, brick):
    with pytest.warns(UserWarning, match="supports: (18|24) directions of") as caught:
        model = sh.read_structure([folder / "still.inp", folder / "waves.inp"])
    [said] = [str(warning.message) for warning in caught]
    assert ("mm-t-s' found by the material" in said) == (brick == 8)
    assert ("the other sense: its n is -n here" in said) == (brick == 8)
    lines = "\n".join(model.places.program.account)
    assert "sector of 6, 60 degrees about z" in lines
    left, right = ("one", "two") if brick == 8 else ("two", "one")
    assert f"left is {left}, right is {right}" in lines
    # The blade of 20 nodes is as wide as a sector, and not joined.
    touching = [name for name in model.places.mesh.sets if name.endswith("_touching")]
    assert touching == (["left_touching", "right_touching"] if brick == 20 else [])
    assert ("free nodes touch the next sector beside two" in lines) == bool(touching)
    if touching:
        one, other = (model.places.mesh.points(model.places.nodes_of(name)) for name in touching)
        half = np.sqrt(0.75)
        turned = one @ [[0.5, half, 0], [-half, 0.5, 0], [0, 0, 1]]
        assert np.linalg.norm(turned[:, None] - other, axis=2).min(axis=1).max() < 1e-6
    assert "nodal diameters" in lines
    assert "density 7800 kg/m^3, modulus 2.1e+11 N/m^2" in lines
    for name in ("left", "right", "tip"):
        assert model.places.nodes_of(name).size
    assert disk_of(model).n_sectors == swept_bricks.N_SECTORS


def test_what_was_told_comes_back(folder, tmp_path):
    model = quietly(folder / "still", folder / "turning", folder / "waves")
    again = sh.read_structure(sh.save_structure(model, tmp_path / "sector.nc"))
    for name in ("mass", "moment"):
        given, wanted = (getattr(each.places.program, name) for each in (again, model))
        np.testing.assert_array_equal(given, wanted)
    assert again.places.program.account == model.places.program.account
    np.testing.assert_array_equal(again.places.nodes_of("tip"), model.places.nodes_of("tip"))
    for kind, block in model.places.mesh.elements.items():
        np.testing.assert_array_equal(again.places.mesh.elements[kind], block)
    load = again.places.centrifugal_load(100)
    np.testing.assert_array_equal(load, model.places.centrifugal_load(100))
    # An archive of results makes it again, too.
    disk = disk_of(again.at(0))
    problem = sh.HarmonicBalance(disk, sh.forces.EngineOrder(1, pattern={0: 1.0}), (1,))
    path = tmp_path / "point.nc"
    sh.save(sh.solve(problem, 100.0), path)
    places = sh.datasets.rebuild(sh.load(path)).model.structure.places
    np.testing.assert_array_equal(places.nodes_of("tip"), model.places.nodes_of("tip"))
    assert places.program.n_sectors == 6


@pytest.mark.slow
@pytest.mark.skipif(swept_bricks.PROGRAM is None, reason=swept_bricks.MISSING)
def test_the_program_writes_the_same_anew(brick, tmp_path):
    """Of the version that is installed."""
    made = swept_bricks.jobs(tmp_path / "jobs", brick)
    for job, modes in (("still", "waves"), ("turning", "turning_waves")):
        check_modes(made / modes, quietly(made / job), SENSE[brick])
        kept = quietly(swept_bricks.DATA / f"brick{brick}" / job)
        given = quietly(made / job)
        for name in ("mass_matrix", "stiffness_matrix"):
            one, other = getattr(given, name), getattr(kept, name)
            assert abs(one - other).max() < 1e-9 * abs(other).max()


DECK = """*HEADING
a text, of no matter
** a comment
*Node, nset=Every
1, 0, 0, 0
2, 1.0D0
3, 1., 1., 0.
4, 0., 1., 0.
*INCLUDE, INPUT=rest.inp
*NSET, NSET=ODD, GENERATE
1, 7, 2
*NSET, NSET=odd, GENERATE
101, 109
*NSET, NSET=odd
8
*NSET, NSET=both
ODD, 2
*NSET, NSET=of_cube, ELSET=cube
*ELEMENT, TYPE=B31, ELSET=beams
7, 1, 2
*SURFACE, NAME=top
cube, S2
*SURFACE, NAME=points, TYPE=NODE
ODD
4
*Material, name=soft
*Elastic
70., .3
*Damping, alpha=2., beta=1e-5
*Density
2700.
*solid section, elset=CUBE, material=SOFT
"""
REST = """*NODE
5,0.,0.,1.
6,1.,0.,1.
7,1.,1.,1.
8,0.,1.,1.
*ELEMENT, TYPE=C3D8R, ELSET=cube
1, 1,2,3,4,
5,6,7,8
"""


def test_decks_are_read_as_the_program_reads_them(tmp_path):
    """Capitals do not count, sets name sets, rows go on, files include others."""
    (tmp_path / "deck.inp").write_text(DECK)
    (tmp_path / "rest.inp").write_text(REST)
    deck = Deck(tmp_path / "deck.inp")
    mesh = deck.mesh
    assert mesh.elements["hexahedron"].tolist() == [[1, 2, 3, 4, 5, 6, 7, 8]]
    assert mesh.points(2).tolist() == [1, 0, 0]
    expected = dict(Every=[1, 2, 3, 4], ODD=[1, 3, 5, 7, 8], both=[1, 2, 3, 5, 7, 8])
    expected |= dict(of_cube=[*range(1, 9)], points=[1, 3, 4, 5, 7, 8], top=[5, 6, 7, 8])
    assert {name: nodes.tolist() for name, nodes in mesh.names.items()} == expected
    assert mesh.surfaces["top"]["quad"].tolist() == [[5, 6, 7, 8]]
    assert deck.notes == [
        "no part of the mesh: 1 B31, which are no solids",
        "set ODD: 9 of 9 generated numbers are those of no node (the first: 101)",
    ]
    told = dict(modulus=70.0, poisson=0.3, density=2700.0, mass_share=2.0, stiffness_share=1e-5)
    assert deck.materials == {"soft": told}
    assert mesh.materials["hexahedron"].tolist() == ["soft"]


def test_damping_of_the_material_is_that_of_the_structure(tmp_path):
    for file in (swept_bricks.DATA / "brick8").glob("*.*"):
        shutil.copy(file, tmp_path)
    path = tmp_path / "mesh.inp"
    deck = path.read_text()
    path.write_text(deck.replace("*DENSITY", "*DAMPING, ALPHA=3., BETA=2E-6\n*DENSITY"))
    assert quietly(tmp_path / "still").damping == sh.RayleighDamping(3.0, 2e-6)
    path.write_text(deck.replace("*DENSITY", "*DAMPING, STRUCTURAL=0.02\n*DENSITY"))
    assert quietly(tmp_path / "still").damping == sh.StructuralDamping(0.02)


PAGE = Path(__file__).parents[3] / "docs" / "guide" / "export" / "calculix.md"


@pytest.mark.slow
def test_the_page_goes_from_decks_to_a_damped_response(tmp_path, monkeypatch, capsys):
    """In less than 30 lines, of jobs that were run before."""
    [script] = re.findall(r"^```\n(import subprocess.*?)```$", PAGE.read_text(), re.M | re.S)
    assert len([line for line in script.splitlines() if line]) < 30
    for file in (swept_bricks.DATA / "brick8").iterdir():
        shutil.copy(file, tmp_path)
    ran = []
    monkeypatch.setattr("subprocess.run", lambda words, **_: ran.append(words))
    monkeypatch.chdir(tmp_path)
    warnings.simplefilter("ignore")
    exec(script, {})
    assert ran == [["ccx", "still"], ["ccx", "waves"]]
    peaks = capsys.readouterr().out.splitlines()[-1]
    told = re.search(r"the peaks are ([\d., and]+) micrometres", PAGE.read_text())[1]
    given, expected = ([*map(float, re.findall(r"\d+\.\d*", text))] for text in (peaks, told))
    assert given == expected
    assert (tmp_path / "disk.png").stat().st_size > 10_000
    assert "Mesh: 22 nodes" in (tmp_path / "disk.html").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.skipif(swept_bricks.PROGRAM is None, reason=swept_bricks.MISSING)
def test_the_decks_of_the_page_write_what_is_needed(tmp_path, monkeypatch, capsys):
    """And its lines of Python run on them."""
    decks = re.findall(r"^```\n(\*.*?)```$", PAGE.read_text(), re.M | re.S)
    scripts = re.findall(r"^```\n(import.*?)```$", PAGE.read_text(), re.M | re.S)
    assert (len(decks), len(scripts)) == (3, 3)
    damped, joined, disk = scripts
    mesh = swept_bricks.mesh_of(8)
    mesh = re.sub(r"NSET=(left|right)", r"NSET=whole_\1", mesh)
    (tmp_path / "mesh.inp").write_text(mesh.replace("NSET=free_", "NSET="))
    monkeypatch.chdir(tmp_path)
    warnings.simplefilter("ignore")
    for job, deck in zip(("still", "waves", "turning"), decks, strict=True):
        (tmp_path / f"{job}.inp").write_text(deck)
    swept_bricks.run(tmp_path, "still")
    exec(joined, {})
    for job in ("waves", "turning"):
        swept_bricks.run(tmp_path, job)
    jobs = [f"{job}.inp" for job in ("still", "turning", "waves")]
    sector = sh.read_structure(jobs)
    account = "\n".join(sector.places.program.account)
    assert "LOOK" not in account
    assert "nodal diameters of the program are of the sense here" in account
    assert sector.speeds == pytest.approx((0, 5000))
    sh.save_structure(sector, "sector.nc")
    exec(disk, {})
    exec(damped, {})
    assert len(capsys.readouterr().out.split()) > 5
