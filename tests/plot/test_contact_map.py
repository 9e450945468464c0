"""Contacts where they are: states and values over an interface."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import symhbm as sh
from tests.paper import texts

POINTS = np.array([[0.5, x, y] for y in (0.0, 0.01) for x in (0.0, 0.01, 0.02)])
LOADS = [0.1, 9.0, 0.2, 9.0, 0.1, 9.0]


@pytest.fixture(scope="module")
def response():
    """Six masses on the ground, of which those of small loads slip."""
    places = sh.Places(np.arange(6), "x", POINTS)
    blade = sh.Model(
        np.eye(6),
        np.eye(6),
        1e4 * np.eye(6),
        contacts=[(i,) for i in range(6)],
        contact_stiffness=1e4,
        friction_coefficient=0.5,
        normal_load=LOADS,
        places=places,
    )
    force = sh.forces.HarmonicForce(cosine={1: np.ones(6)})
    return sh.frf(sh.HarmonicBalance(blade, force), (18, 19), at=[18, 19], progress=False)


def test_states_are_where_contacts_are(response):
    point = response.isel(frequency=0)
    figure = sh.plot.contact_map(point)
    [ax] = figure.axes
    [dots] = ax.collections
    np.testing.assert_allclose(dots.get_offsets(), 1e3 * POINTS[:, 1:])
    assert [ax.get_xlabel(), ax.get_ylabel()] == ["$y$ [mm]", "$z$ [mm]"]
    assert texts(ax) == ["sticks", "slips"]
    faces = dots.get_facecolors()
    slips = point.contact_state.values == 1
    assert slips.tolist() == [load < 1 for load in LOADS]
    assert len(np.unique(faces[slips], axis=0)) == len(np.unique(faces[~slips], axis=0)) == 1
    assert not np.array_equal(faces[slips][0], faces[~slips][0])


def test_values_have_a_colour_bar_with_their_unit(response):
    point = response.isel(frequency=0)
    figure = sh.plot.contact_map(point, "dissipation")
    ax, bar = figure.axes
    shown = ax.collections[0].get_array()
    power = point.dissipation.values.max()
    label = bar.get_ylabel()
    assert label.startswith("energy dissipated by friction per cycle [")
    factor = {"J": 1.0, "mJ": 1e3, "µJ": 1e6}[label.partition("[")[2].rstrip("]")]
    assert shown.max() == pytest.approx(factor * power)
    assert "[" not in sh.plot.contact_map(point, "stick_fraction").axes[1].get_ylabel()


def test_some_contacts_and_own_axes(response):
    _, ax = plt.subplots()
    part = response.isel(frequency=0, contact=slice(3))
    figure = sh.plot.contact_map(part, ax=ax)
    assert figure.axes == [ax]
    assert len(ax.collections[0].get_offsets()) == 3
    plt.close(figure)


def test_what_cannot_be_drawn(response):
    with pytest.raises(ValueError, match="it is along case"):
        sh.plot.contact_map(response.isel(frequency=0).expand_dims(case=2))
    figure = sh.plot.contact_map(response, at="largest")
    assert figure.axes[0].get_title().endswith("Hz, largest point")
    point = response.isel(frequency=0)
    with pytest.raises(KeyError, match="contact_x"):
        sh.plot.contact_map(point.drop_vars("contact_x"))
    with pytest.raises(KeyError, match="dissipated"):
        sh.plot.contact_map(point, "dissipated")
    unknown = point.assign(contact_state=point.contact_state * 0 - 1)
    with pytest.raises(ValueError, match="nothing"):
        sh.plot.contact_map(unknown)
    with pytest.raises(TypeError, match="Dataset"):
        sh.plot.contact_map(3)
