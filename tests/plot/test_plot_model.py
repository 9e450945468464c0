"""Drawings of models: every element where it belongs, and what is not drawn is told."""

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

import symhbm as sh
from symhbm.cli import main
from symhbm.cli.selection import draw
from symhbm.plot.structure.network import links, places_of_contacts, spread
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


def words(figure):
    ax = figure.axes[0]
    return " ".join(f"{ax.get_title()} {ax.get_xlabel()}".split())


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


# Large structures


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


UNIT, RUBS = np.eye(3), {"contacts": [(0, 2)]} | FRICTION
MODELS = {
    "ring": ring_of_blades(40),
    "chain": chain(40),
    "alone": sh.Model(np.eye(30), np.eye(30), np.eye(30)),
    "full": sh.Model(np.eye(12), np.eye(12), 20 * np.eye(12) - np.ones((12, 12))),
    "many on one": sh.Model(UNIT, UNIT, UNIT, contacts=[(0,)] * 30, **FRICTION),
    "many on a pair": sh.Model(UNIT, UNIT, UNIT, contacts=[(0, 1)] * 9, **FRICTION),
    "floating": sh.Model(UNIT, 0 * UNIT, 0 * UNIT, **RUBS),
    "circle": chain(5, np.eye(5) + 1e-4 * second_difference(5), contacts=[(0, 3), (1, 2)]),
    "opened": ring_of_blades(13, normal_load=np.arange(13), stiffness=np.arange(1, 14)),
    "plate": plate(),
}


@pytest.mark.parametrize("model", MODELS.values(), ids=[*MODELS])
def test_every_model_is_drawn(model, tmp_path):
    figure = sh.plot.model(model)
    figure.savefig(tmp_path / "model.png", dpi=40)
    head = repr(model).partition("\n")[0].partition(": ")[2]
    assert head in words(figure)
    # Nothing that is written is cut off, up to a hundredth of an inch.
    inside, whole = figure.get_tightbbox(), figure.get_size_inches()
    assert min(inside.x0, inside.y0) > -0.01
    assert np.all(inside.max < whole + 0.01)


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
