"""What ``place=`` shows: any degree of freedom, blade or node, or the largest of several."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from tests.problems import ring_of_blades

GRID = np.linspace(60, 95, 15)
NODES = sh.Places(
    node=[4, 4, 9, 9, 12],
    direction=["x", "y", "x", "y", "x"],
    label=["tip", "tip", "", "", "root"],
)


@pytest.fixture(scope="module")
def ring():
    disk = ring_of_blades(
        5, stiffness=[1e4, 1.02e4, 0.99e4, 1.01e4, 0.97e4], contact_stiffness=1e5, normal_load=10
    )
    return sh.frf(sh.HarmonicBalance(disk, sh.forces.EngineOrder(2)), (60, 95), at=GRID)


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
        (3, [3], "response of DOF 3"),
        ("blade 3", [3], "response of blade 3"),
        (["blade 1", 4], [1, 4], "largest response of blade 1, DOF 4"),
        (None, [0, 1, 2, 3, 4], "largest response"),
    ],
)
def test_blades(ring, place, dofs, words):
    levels, label = drawn(ring, place)
    np.testing.assert_allclose(levels, level(ring, dofs), rtol=1e-12)
    assert label == f"{words} [dB re 1 m]"


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


def test_ensembles_and_phases_take_places(ring):
    ensemble = xr.concat([ring, ring.assign(amplitude=1.1 * ring.amplitude)], "sample")
    for place in ("blade 2", 2, ["blade 0", "blade 2"]):
        (ax,) = sh.plot.envelope(ensemble, place=place, extremes=False).axes
        dofs = [2] if place in ("blade 2", 2) else [0, 2]
        expected = level(ring, dofs) + 20 * np.log10(1.05)
        np.testing.assert_allclose(ax.lines[0].get_ydata(), expected, rtol=1e-12)
    by_name, by_number = (sh.plot.phase(ring, place=p).axes[0].lines[0] for p in ("blade 2", 2))
    np.testing.assert_array_equal(by_name.get_ydata(), by_number.get_ydata())
    with pytest.raises(ValueError, match=r"place=\[1, 2\]: expected one degree of freedom"):
        sh.plot.phase(ring, place=[1, 2])


@pytest.mark.parametrize(
    ("place", "error", "words"),
    [
        (5, ValueError, "place=5: expected an integer from 0 to 4"),
        (1.5, ValueError, "place=1.5"),
        ("blade 5", KeyError, "a number from 0 to 4, 'blade 0' to 'blade 4', or several"),
        ("tip", KeyError, "place='tip': expected a number from 0 to 4, 'blade 0' to 'blade 4'"),
        ([], ValueError, r"place=\[\]: expected a number"),
    ],
)
def test_errors_name_what_is_allowed(ring, place, error, words):
    with pytest.raises(error, match=words):
        sh.plot.response(ring, place=place)
    assert plt.get_fignums() == []


def test_errors_name_nodes(nodes):
    words = "the nearest are 'tip'.* a label or a node .*'root', 'tip'.* directions as 'tip:x'"
    with pytest.raises(KeyError, match=words):
        sh.plot.response(nodes, place="tpi")
    with pytest.raises(KeyError, match="9 has x, y"):
        sh.plot.response(nodes, place="9:z")


def test_errors_name_other_numbers(nodes):
    """Of a node, of the whole structure, and outputs."""
    with pytest.raises(ValueError, match="from 0 to 4; the node 9 is '9'"):
        sh.plot.response(nodes, place=9)
    chain = sh.Model(
        np.eye(5),
        np.eye(5),
        1e4 * (2 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1)),
        contacts=[(3,)],
        contact_stiffness=1e4,
        friction_coefficient=0.5,
        normal_load=10,
    ).with_outputs({"stress": {0: 1e11}}, units="Pa")
    force = sh.forces.PointForce(4)
    small = sh.condense(chain, force, (10, 20))
    response = sh.frf(sh.HarmonicBalance(small, force), (10, 20), at=[15])
    with pytest.raises(ValueError, match=r"of the structure these are .* \[0, 3\]"):
        sh.plot.response(response, place=4)
    with pytest.raises(KeyError, match=r"outputs \(stress\) are drawn by symhbm.datasets.output"):
        sh.plot.response(response, place="stress")


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
