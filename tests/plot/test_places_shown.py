"""What ``place=`` shows: any degree of freedom, blade or node, or the largest of several."""

import numpy as np
import pytest

import symhbm as sh
from tests.problems import ring_of_blades

GRID = np.linspace(60, 95, 15)
NODES = sh.Places(
    node=[4, 4, 9, 9, 12],
    direction=["x", "y", "x", "y", "x"],
    label=["tip", "tip", "", "", "root"],
)


@pytest.fixture(scope="module")
def nodes():
    n = 5
    stiffness = 2e4 * np.eye(n) - 1e4 * (np.eye(n, k=1) + np.eye(n, k=-1))
    chain = sh.Model(np.eye(n), 0.5 * np.eye(n), stiffness, places=NODES)
    return sh.frf(sh.HarmonicBalance(chain, sh.forces.PointForce(place="tip:y")), (60, 95), at=GRID)


def drawn(dataset, place):
    """Levels [dB] at the values of the grid, and the label."""
    (ax,) = sh.plot.response(dataset, place=place, peaks=False).axes
    x, y = ax.lines[0].get_data()
    return np.asarray(y)[[np.flatnonzero(x == at)[0] for at in GRID]], ax.get_ylabel()


def level(dataset, dofs):
    return 20 * np.log10(dataset.amplitude.isel(dof=dofs).max("dof").values)


@pytest.mark.parametrize(
    ("place", "dofs", "words"),
    [
        ("tip:y", [1], "response of tip:y"),
        ("9:x", [2], "response of 9:x"),
        ("tip", [0, 1], "largest response of tip"),
        ("9", [2, 3], "largest response of 9"),
        ("root", [4], "response of root"),
        (4, [4], "response of root:x"),
        (("tip", "12"), [0, 1, 4], "largest response of tip, 12"),
    ],
)
def test_nodes(nodes, place, dofs, words):
    levels, label = drawn(nodes, place)
    np.testing.assert_allclose(levels, level(nodes, dofs), rtol=1e-12)
    assert label == f"{words} [dB re 1 m]"


def test_peaks_of_a_place_are_where_it_is_largest():
    """Of two blades, those peaks at which one of them is the larger."""
    disk = ring_of_blades(5, stiffness=[1e4, 1.3e4, 1e4, 0.8e4, 1e4], normal_load=1e4)
    problem = sh.HarmonicBalance(disk, sh.forces.PointForce(place=1))
    curve = sh.frf(problem, (12, 40), peaks="each", progress=False)
    (ax,) = sh.plot.response(curve, place=["blade 1", "blade 3"]).axes
    top = ax.lines[0]
    marks = [line.get_xydata()[0] for line in ax.lines[1:]]
    own = curve.isel(peak=curve.peak_dof.isin([1, 3]).values)
    located = np.stack([own.peak_frequency, 20 * np.log10(own.peak_amplitude)], axis=-1)
    assert marks
    for mark in marks:
        assert np.isclose(located, mark, rtol=1e-9).all(axis=1).any()
        assert mark[1] >= np.interp(mark[0], *top.get_data()) - 1e-3
    levels = own.amplitude.isel(dof=[1, 3]).max("dof")
    beaten = [
        peak
        for peak in located
        if peak[1] < 20 * np.log10(np.interp(peak[0], own.frequency, levels)) - 1
    ]
    assert len(marks) <= len(located) - len(beaten)
