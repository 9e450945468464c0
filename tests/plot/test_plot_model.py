"""Drawings of models: every element where it belongs, and what is not drawn is told."""

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
import scipy.sparse as sp
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex
from matplotlib.patches import FancyBboxPatch

import symhbm as sh
from symhbm.cli import main
from symhbm.cli.selection import draw
from symhbm.plot.structure.masses import COLORS
from symhbm.plot.structure.network import HALF, links, places_of_contacts, spread
from tests.paper import texts
from tests.problems import one_blade, ring_of_blades

FRICTION: Any = dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3)


def second_difference(n):
    return 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)


def chain(n=5, damping=None, **options):
    damping = 0.5 * np.eye(n) if damping is None else damping
    values = dict(contacts=[(1,), (n - 1,)]) | FRICTION | options
    return sh.Model(np.eye(n), damping, 1e4 * second_difference(n), **values)


def membrane(nx=20, ny=10):
    along, across = (sp.csr_array(second_difference(n)) for n in (nx, ny))
    return sp.kron(sp.eye_array(ny), along) + sp.kron(across, sp.eye_array(nx))


def plate(bending=True, **options):
    stiffness = 1e4 * sp.csc_array(membrane())
    stiffness = stiffness @ stiffness / 1e4 if bending else stiffness
    mass = sp.eye_array(200)
    values = dict(contacts=[(0,), (19,), (95, 115)]) | FRICTION | options
    return sh.Model(mass, 0.1 * mass, stiffness, **values)


def elements(figure, kind):
    """The lines of every symbol of a colour, (n_points, 2) each."""
    color = to_hex(COLORS[kind])
    found: list[Any] = [
        each for each in figure.axes[0].collections if isinstance(each, LineCollection)
    ]
    return [
        np.concatenate([path.vertices for path in each.get_paths()])
        for each in found
        if to_hex(each.get_colors()[0]) == color
    ]


def masses(figure):
    """Names and centres of the masses."""
    boxes = [patch for patch in figure.axes[0].patches if isinstance(patch, FancyBboxPatch)]
    corners = np.array([(box.get_x(), box.get_y()) for box in boxes]).reshape(-1, 2)
    return corners + HALF


def words(figure):
    ax = figure.axes[0]
    return " ".join(f"{ax.get_title()} {ax.get_xlabel()}".split())


def beside(figure):
    return [text.get_text() for text in figure.axes[0].texts]


def ends_at(symbol, centre):
    """Whether a symbol ends on the side of a mass, or at a bar that is there."""
    return np.linalg.norm(symbol - centre, axis=1).min() < 1.6 * HALF


# Matrices as networks

element = st.tuples(st.integers(0, 5), st.integers(0, 5), st.floats(0.5, 2e6))


@pytest.mark.slow
@given(st.lists(element, max_size=12))
def test_elements_come_back_from_the_matrix_they_make(given_elements):
    matrix, ground, between = np.zeros((6, 6)), np.zeros(6), {}
    for i, j, value in given_elements:
        if i == j:
            matrix[i, i] += value
            ground[i] += value
        else:
            matrix[[i, j], [i, j]] += value
            matrix[[i, j], [j, i]] -= value
            pair = min(i, j), max(i, j)
            between[pair] = between.get(pair, 0) + value
    found = links(matrix)
    assert found.reason == ""
    # Sums of rows: what is left beside larger entries has their round-off.
    np.testing.assert_allclose(found.ground, ground, rtol=0, atol=1e-9 * np.abs(matrix).max())
    pairs = {tuple(pair): value for pair, value in zip(found.pairs, found.values, strict=True)}
    assert pairs == pytest.approx(between, rel=1e-12)


@pytest.mark.parametrize(
    ("matrix", "reason"),
    [
        ([[2, 1], [1, 2]], "positive entries off its diagonal (1 of 1)"),
        ([[2, -1], [-0.5, 2]], "not symmetric"),
        ([[0, 1], [-1, 0]], "not symmetric"),
        ([[1, -2], [-2, 5]], "rows whose sum is negative (1 of 2)"),
    ],
)
def test_matrices_that_are_no_network(matrix, reason):
    found = links(np.array(matrix, dtype=float))
    assert reason in found.reason
    assert not found.ground.any()
    assert found.pairs.tolist() == [[0, 1]]


# Symbols


def test_one_blade():
    """Fig. 1 of the source: spring and damper to one wall, friction damper to the other."""
    figure = sh.plot.model(one_blade(), force=sh.forces.PointForce(amplitude=2))
    assert len(masses(figure)) == 1
    assert len(elements(figure, "friction")) == 1
    assert len(elements(figure, "cubic")) == len(elements(figure, "opened")) == 0
    # Left and right of the mass.
    assert elements(figure, "friction")[0][:, 0].min() >= HALF - 1e-12
    assert max(part[:, 0].max() for part in elements(figure, "spring")) <= -HALF
    assert {"$m$", "$k$", "$c$", r"$k_d$, $\mu$, $F_n$"} <= {*beside(figure)}
    text = words(figure)
    assert "1 lumped blade, 1 contact" in text
    for value in ("= 1 kg", "= 10000 N/m", "= 0.5 N s/m", "$F_n$ = 3 N", "$f_0$ = 2 N"):
        assert value in text
    assert "Not drawn" not in text


def test_cubic_springs():
    figure = sh.plot.model(one_blade(cubic_stiffness=1e9))
    assert len(elements(figure, "friction")) == len(elements(figure, "cubic")) == 1
    assert r"$\gamma$ = 1e9 N/m³" in words(figure)
    alone = sh.Model([[1]], [[0.1]], [[1]], contacts=[(0,)], cubic_stiffness=0.1)
    figure = sh.plot.model(alone)
    assert len(elements(figure, "cubic")) == 1
    assert not elements(figure, "friction")


def test_ring():
    """Fig. 5 of the source: each contact ends at the two blades that it joins."""
    model = ring_of_blades(13)
    figure = sh.plot.model(sh.HarmonicBalance(model, sh.forces.EngineOrder(3)))
    centres, symbols = masses(figure), elements(figure, "friction")
    assert len(centres) == len(symbols) == 13
    # Blades stand on a circle, one after the other.
    turn = np.unwrap(np.arctan2(centres[:, 1], centres[:, 0]))
    np.testing.assert_allclose(np.diff(turn), -2 * np.pi / 13, rtol=1e-9)
    for dofs, symbol in zip(model.contacts, symbols, strict=True):
        near = [i for i, centre in enumerate(centres) if ends_at(symbol, centre)]
        assert near == sorted(dofs)
    # A spring and a damper of each, towards the disk.
    assert len(elements(figure, "spring")) == 26
    inner = np.concatenate(elements(figure, "spring"))
    assert np.linalg.norm(inner, axis=1).max() < np.linalg.norm(centres[0])
    arrows = [text for text in figure.axes[0].texts if getattr(text, "arrow_patch", None)]
    assert len(arrows) == 13
    assert "engine order 3 on 13 blades" in words(figure)
    assert "disk" in beside(figure)


@pytest.mark.parametrize(
    "change", [dict(normal_load=0), dict(contact_stiffness=0), dict(friction_coefficient=0)]
)
def test_a_contact_without_force_is_open(change):
    [(name, value)] = change.items()
    each = np.full(13, FRICTION[name], dtype=float)
    each[4] = value
    others: Any = {name: each}
    figure = sh.plot.model(ring_of_blades(13, **others))
    assert len(elements(figure, "friction")) == 12
    (symbol,) = elements(figure, "opened")
    centres = masses(figure)
    assert [i for i in range(13) if ends_at(symbol, centres[i])] == [4, 5]
    assert "1 open contact, without force" in words(figure)
    # The value of the open one is in no range of those that act.
    assert "12 friction dampers" in words(figure)
    assert " 0 to " not in words(figure)


def test_values_that_differ_stand_beside_their_elements():
    stiffness = 1e4 + np.arange(13)
    figure = sh.plot.model(ring_of_blades(13, stiffness=stiffness, normal_load=np.arange(1, 14)))
    texts = beside(figure)
    for i in range(13):
        assert f"$k$ {10000 + i}" in texts
        assert any(text.splitlines()[-1] == f"$F_n$ {i + 1}" for text in texts if text)
    assert "$k$ = 10000 to 10012 N/m" in words(figure)
    assert "$F_n$ = 1 to 13 N" in words(figure)
    assert not any("$m$ 1" in text for text in texts)


def test_chain_with_contacts_to_the_ground():
    figure = sh.plot.model(chain(normal_load=[3, 5]), force=sh.forces.PointForce(4))
    centres, symbols = masses(figure), elements(figure, "friction")
    assert np.ptp(centres[:, 1]) == 0
    for dof, symbol in zip((1, 4), symbols, strict=True):
        assert [i for i in range(5) if ends_at(symbol, centres[i])] == [dof]
    # Four springs between, two to the ground where the chain ends, five dampers to the ground.
    assert len(elements(figure, "spring")) == 4 + 2 + 5
    text = words(figure)
    assert "springs between $k$ = 10000 N/m" in text
    assert "springs to the ground $k$ = 10000 N/m" in text
    assert "Not drawn" not in text


def test_dampers_between_masses():
    damping = 0.5 * np.eye(5) + 1e-5 * 1e4 * second_difference(5)
    figure = sh.plot.model(chain(damping=damping))
    assert len(elements(figure, "spring")) == 4 + 2 + 5 + 4
    assert "dampers between $c$ = 0.1 N s/m" in words(figure)


def test_masses_without_inertia():
    model = sh.Model(np.diag([1, 0]), np.eye(2), 1e4 * second_difference(2))
    figure = sh.plot.model(model)
    styles = [patch.get_linestyle() for patch in figure.axes[0].patches]
    assert len(set(map(str, styles))) == 2
    assert "0 to 1 kg, 1 degree of freedom without it (dashed)" in words(figure)


# What is not drawn


def test_omitted_properties_are_listed():
    stiffness = 1e4 * second_difference(4)
    stiffness[0, 2] = stiffness[2, 0] = 3e3
    mass = np.eye(4) + 0.1 * (np.eye(4, k=1) + np.eye(4, k=-1))
    gyroscopic = np.eye(4) + 0.2 * (np.eye(4, k=1) - np.eye(4, k=-1))
    figure = sh.plot.model(sh.Model(mass, gyroscopic, stiffness, contacts=[(0,)], **FRICTION))
    text = words(figure)
    assert "Not drawn: springs; the stiffness matrix has positive entries" in text
    assert "Not drawn: viscous dampers; the damping matrix is not symmetric" in text
    assert "Not drawn: coupling of 3 pairs by inertia" in text
    assert len(elements(figure, "line")) == 4
    # Not a single spring or damper: the bars are drawn in another colour.
    assert not elements(figure, "spring")


@pytest.mark.slow
def test_condensed_structure():
    whole = plate()
    force = sh.forces.PointForce(105)
    small = sh.condense(whole, force, (5, 30), places=[60])
    figure = sh.plot.model(sh.HarmonicBalance(small, force))
    names = [text for text in beside(figure) if text.isdigit()]
    assert names == [str(dof) for dof in small.dofs]
    centres = masses(figure)
    touched = [
        tuple(i for i in range(5) if ends_at(symbol, centres[i]))
        for symbol in elements(figure, "friction")
    ]
    assert sorted(touched) == sorted(small.contacts)
    text = words(figure)
    assert "condensed: 5 degrees of freedom, 3 contacts" in text
    assert "Not drawn: mass, damping and stiffness of all 200 degrees of freedom" in text
    assert "Not drawn: the force on 1 degree of freedom not kept" in text
    kept = sh.condense(whole, sh.forces.PointForce(60), (5, 30), places=[60])
    assert (
        "force on"
        not in words(sh.plot.model(kept, force=sh.forces.PointForce(60))).partition("Not")[2]
    )
    alone = sh.condense(plate(contacts=[(7,)]), force, (5, 30))
    assert "7" in beside(sh.plot.model(alone))


# Large structures


@pytest.mark.parametrize("bending", [False, True])
def test_plates_are_dots_and_lines(bending):
    figure = sh.plot.model(plate(bending), force=sh.forces.PointForce(105))
    ax = figure.axes[0]
    labels = texts(ax)
    assert len(masses(figure)) == 0
    assert "held to the ground, 200" in labels
    assert "friction damper between, 1" in labels
    assert "friction damper to the ground, 2" in labels
    assert ("coupling between pairs" in labels[0]) == bending
    assert ("Not drawn: springs" in words(figure)) == bending
    count = 370 if not bending else len(links(plate().stiffness_matrix).pairs)
    assert labels[0].endswith(f", {count}")


def test_distances_follow_the_number_of_links():
    grid = links(membrane())
    places = spread(200, grid.pairs)
    steps = np.linalg.norm(places[grid.pairs[:, 0]] - places[grid.pairs[:, 1]], axis=1)
    # Neighbours of a grid stay near: 29 steps lie between its far corners.
    assert steps.max() < 3.5 * steps.min()
    far = [np.linalg.norm(places[i] - places[199 - i]) for i in (0, 19)]
    assert min(far) > 15 * np.median(steps)
    row = spread(50, links(second_difference(50)).pairs)
    np.testing.assert_allclose(np.abs(np.diff(row[:, 0])), 2 / 49, rtol=1e-6)
    assert np.abs(row[:, 1]).max() < 1e-6


def test_unconnected_parts_stand_apart():
    places = spread(6, np.array([[0, 1], [1, 2], [3, 4], [4, 5]]))
    between = np.linalg.norm(places[:3, None] - places[None, 3:], axis=2)
    within = np.linalg.norm(places[:3, None] - places[None, :3], axis=2)
    assert np.isfinite(places).all()
    assert between.min() > within.max() / 2


@pytest.mark.parametrize(
    "model",
    [
        ring_of_blades(40),
        chain(40),
        sh.Model(np.eye(30), np.eye(30), np.eye(30)),
        sh.Model(np.eye(12), np.eye(12), 20 * np.eye(12) - np.ones((12, 12))),
        sh.Model([[1]], [[1]], [[1]], contacts=[(0,)] * 30, **FRICTION),
        sh.Model(np.eye(2), np.eye(2), np.eye(2), contacts=[(0, 1)] * 9, **FRICTION),
        sh.Model(np.eye(3), np.zeros((3, 3)), np.zeros((3, 3)), contacts=[(0, 2)], **FRICTION),
        ring_of_blades(3, cubic_stiffness=1e8),
        chain(5, damping=np.eye(5) + 1e-4 * second_difference(5), contacts=[(0, 3), (1, 2)]),
        ring_of_blades(13, normal_load=np.arange(13), stiffness=np.arange(1, 14)),
        plate(),
    ],
    ids=[
        "ring",
        "chain",
        "alone",
        "full",
        "many on one",
        "many on a pair",
        "floating",
        "three",
        "circle",
        "opened",
        "plate",
    ],
)
def test_every_model_is_drawn(model, tmp_path):
    figure = sh.plot.model(model)
    figure.savefig(tmp_path / "model.png", dpi=40)
    head = repr(model).partition("\n")[0].partition(": ")[2]
    assert head in words(figure)
    # Nothing that is written is cut off, up to a hundredth of an inch.
    inside, whole = figure.get_tightbbox(), figure.get_size_inches()
    assert min(inside.x0, inside.y0) > -0.01
    assert np.all(inside.max < whole + 0.01)


# Forces


def lengths(figure):
    arrows = [text for text in figure.axes[0].texts if getattr(text, "arrow_patch", None)]
    return [np.linalg.norm(np.subtract(arrow.xy, arrow.get_position())) for arrow in arrows]


def test_arrows_are_as_long_as_the_force_is_large():
    force = sh.forces.HarmonicForce(
        cosine={1: [1, 0, 0, 3, 0]}, sine={3: [0, 0, 2, 4, 0]}, amplitude=2
    )
    figure = sh.plot.model(chain(), force=force)
    found = np.array(lengths(figure))
    np.testing.assert_allclose(found / found.max(), [1 / 5, 2 / 5, 1], rtol=1e-9)
    assert "3 degrees of freedom, harmonics 1, 3, up to 10 N (root of the sum" in words(figure)


@pytest.mark.slow
def test_force_of_a_problem_or_an_excitation():
    problem = sh.HarmonicBalance(ring_of_blades(13), sh.forces.PointForce(2, harmonic=3), (1, 3))
    assert len(lengths(sh.plot.model(problem))) == 1
    assert len(lengths(sh.plot.model(problem, force=sh.forces.EngineOrder(1)))) == 13
    assert len(lengths(sh.plot.model(problem.model, force=problem))) == 1
    assert lengths(sh.plot.model(problem.model)) == []
    assert r"cos(3 $\omega t$) on 2" in words(sh.plot.model(problem))


def test_own_axes_are_drawn_into():
    own, (left, right) = plt.subplots(1, 2)
    assert sh.plot.model(one_blade(), ax=right) is own
    assert right.get_title()
    assert not left.get_title()


@pytest.mark.parametrize(
    ("structure", "options", "error", "message"),
    [
        (3, {}, TypeError, "structure=3: expected a Model"),
        (sh.forces.PointForce(), {}, TypeError, "expected a Model, or a HarmonicBalance"),
        (one_blade(), dict(force=3), TypeError, "force=3: expected an excitation"),
        (one_blade(), dict(force=sh.forces.PointForce), TypeError, "expected an excitation"),
        (one_blade(), dict(force=one_blade()), TypeError, "expected an excitation"),
        (one_blade(), dict(force=sh.forces.PointForce(4)), ValueError, "place=4"),
        (one_blade(), dict(ax=3), TypeError, "ax=3"),
    ],
)
def test_bad_input(structure, options, error, message):
    with pytest.raises(error, match=message):
        sh.plot.model(structure, **options)
    assert plt.get_fignums() == []


# Command line


def test_structure_of_an_archive(tmp_path):
    problem = sh.HarmonicBalance(one_blade(), sh.forces.PointForce())
    loads = sh.frf(problem, (15, 25), over={"normal_load": [1.0, 2.0]}, progress=False)
    path = sh.follow(problem, "normal_load", (1, 9), frequency=19.0, progress=False)
    sh.save(loads, tmp_path / "loads.nc")
    command = ["plot", str(tmp_path / "loads.nc"), "--kind", "model"]
    several = CliRunner().invoke(main, command)
    assert several.exit_code != 0
    assert "several over normal_load; select one, for example --select normal_load=1.0" in (
        several.output
    )
    assert CliRunner().invoke(main, [*command, "--select", "normal_load=2"]).exit_code == 0
    assert (tmp_path / "loads_model.png").stat().st_size > 10_000
    assert "$F_n$ = 2 N" in words(draw(loads, "model", ["normal_load=2"], {})[1])
    assert "normal load at its nominal value" in words(draw(path, "model", [], {})[1])


OF_SECTORS = {(3,): (2,), (2, sh.next_sector(3)): (1, 2), (2, sh.next_sector(2)): (1,)}


@pytest.mark.parametrize(("ends", "expected"), OF_SECTORS.items())
def test_contacts_of_a_sector_are_at_its_own_degrees_of_freedom(ends, expected):
    """Those numbered after an interface that belongs to the next sector, too."""
    sector = sh.Sector(sh.Model(np.eye(4), np.eye(4), 1e4 * second_difference(4)), [0], [1], 12)
    rubs = sector.with_contacts(rub=sh.Contacts(sh.laws.Coulomb(), ends, **FRICTION))
    [places] = places_of_contacts(rubs)
    assert places == expected
    sh.plot.model(rubs)
