"""Operating deflection shapes: the offsets of the tips, the instant and the nodal diameter."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import symhbm as sh
from symhbm.plot.disks.shapes import HUB, OFFSET, TIP, nodal_shares
from tests.problems import ring_of_blades


def ring(engine_order=1, harmonics=(1, 3), **options):
    disk = ring_of_blades(7, **dict(contact_stiffness=1e5, normal_load=5) | options)
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(engine_order, amplitude=1.0), harmonics)


@pytest.fixture(scope="module")
def mistuned():
    loads = np.random.default_rng(3).uniform(3, 7, 7)
    return sh.frf(ring(2, normal_load=loads), (50, 110), at=[60, 70, 80, 90], peaks="each")


def tips(figure):
    """Offset of the tip of each blade over that of the largest displacement."""
    outlines = figure.axes[0].collections[0].get_paths()
    turn = np.pi / 2 - 2 * np.pi * np.arange(len(outlines)) / len(outlines)
    along = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    corners = np.array([outline.vertices[:4] for outline in outlines])
    reach = np.einsum("bci,bi->bc", corners, along)
    # Blades begin at the hub.
    np.testing.assert_allclose(reach[:, [0, 3]], HUB)
    return (reach[:, 1:3].mean(axis=1) - TIP) / OFFSET


def title(figure):
    return figure.axes[0].get_title()


def test_offsets_are_the_displacement_at_the_instant(mistuned):
    """Against the sum of the stored terms; the scale is the largest displacement of the period."""
    point = mistuned.sel(frequency=80)
    figure = sh.plot.disk(mistuned, at=79.0, angle=1.3)
    harmonic = point.harmonic.values
    terms = [np.cos(harmonic * 1.3), np.sin(harmonic * 1.3)]
    displacement = np.einsum("dhc,ch->d", point.coefficient.values, terms)
    top = float(point.amplitude.max())
    np.testing.assert_allclose(tips(figure), displacement / top, rtol=0, atol=1e-12)
    assert title(figure).startswith("80 Hz, nearest point, nodal diameter 2 (")
    assert f"blade {int(point.amplitude.argmax('dof'))} leads: " in title(figure)
    low, high = figure.axes[1].get_ylim()
    # Micrometres.
    assert [low, high] == pytest.approx([-1e6 * top, 1e6 * top])


@given(
    n_blades=st.integers(3, 40),
    data=st.data(),
    forwards=st.booleans(),
    phase=st.floats(0, 6),
)
def test_a_wave_has_one_nodal_diameter(n_blades, data, forwards, phase):
    diameter = data.draw(st.integers(0, n_blades // 2))
    turn = (1 if forwards else -1) * 2 * np.pi * diameter * np.arange(n_blades) / n_blades + phase
    shares = nodal_shares(np.stack([np.cos(turn), np.sin(turn)], axis=-1)[:, None])
    expected = np.eye(n_blades // 2 + 1)[diameter]
    # Round-off of a transform.
    np.testing.assert_allclose(shares, expected, atol=1e-12)
