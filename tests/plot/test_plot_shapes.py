"""Operating deflection shapes: the offsets of the tips, the instant and the nodal diameter."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

import symhbm as sh
from symhbm.plot.disks.shapes import HUB, OFFSET, TIP, nodal_shares
from tests.problems import one_blade, ring_of_blades
from tests.quick import quick_first


def ring(engine_order=1, harmonics=(1, 3), **options):
    disk = ring_of_blades(7, **dict(contact_stiffness=1e5, normal_load=5) | options)
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(engine_order, amplitude=1.0), harmonics)


@pytest.fixture(scope="module")
def tuned():
    return sh.frf(ring(harmonics=(1,)), (10, 110), over={"engine_order": [0, 1, 2, 3]})


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


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_tuned_disk_at_its_peak(tuned, order):
    one = tuned.sel(engine_order=order)
    figure = sh.plot.disk(one)
    assert f"nodal diameter {order}\n" in title(figure)
    assert title(figure).startswith(f"{float(one.peak_frequency.max()):.5g} Hz, ")
    offset = tips(figure)
    assert np.abs(offset).max() == pytest.approx(1)
    # A travelling wave: a cosine over the blades, up to its sign the same at all of them.
    leading = int(np.argmax(np.abs(offset)))
    wave = offset[leading] * np.cos(2 * np.pi * order * (np.arange(7) - leading) / 7)
    # Peaks are solved to about 1e-9.
    np.testing.assert_allclose(offset, wave, atol=1e-6)


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


def test_default_instant_is_that_of_the_largest_displacement(mistuned):
    offset = tips(sh.plot.disk(mistuned, at=80.0))
    amplitude = mistuned.amplitude.sel(frequency=80)
    leading = int(amplitude.argmax("dof"))
    assert abs(offset[leading]) == pytest.approx(1)
    assert np.all(np.abs(offset) <= amplitude / amplitude.max() + 1e-12)


def test_which_point(mistuned):
    top = int(np.nanargmax(mistuned.peak_amplitude.values))
    hertz = float(mistuned.peak_frequency[top])
    assert title(sh.plot.disk(mistuned)).startswith(f"{hertz:.5g} Hz, highest peak")
    assert title(sh.plot.disk(mistuned, at=top)).startswith(f"{hertz:.5g} Hz, peak {top}")
    assert title(sh.plot.disk(mistuned.sel(frequency=90))).startswith("90 Hz, nod")
    bare = mistuned.drop_vars("peak_coefficient")
    best = int(mistuned.amplitude.max("dof").argmax("frequency"))
    start = f"{mistuned.frequency.values[best]:.5g} Hz, largest point"
    assert title(sh.plot.disk(bare)).startswith(start)


def test_points_of_solve_and_follow():
    problem = ring(1)
    assert title(sh.plot.disk(sh.solve(problem, 60.0))).startswith("60 Hz, nodal diameter 1")
    followed = sh.follow(problem, "normal_load", (1, 20), at=[2, 5], frequency=60.0)
    assert title(sh.plot.disk(followed.sel(normal_load=5))).startswith("$F_n$ = 5 N, 60 Hz")


def test_some_blades_in_an_order_of_their_own(mistuned):
    every = tips(sh.plot.disk(mistuned, at=80.0, angle=0))
    figure = sh.plot.disk(mistuned, at=80.0, angle=0, place=[6, 4, 2, 0])
    few = tips(figure)
    chosen = every[[6, 4, 2, 0]]
    # The scale is that of the blades shown.
    np.testing.assert_allclose(few / few[0], chosen / chosen[0])
    assert [text.get_text() for text in figure.axes[0].texts] == ["6", "4", "2", "0"]


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


def test_a_motion_of_one_blade_has_no_nodal_diameter(mistuned):
    alone = mistuned.sel(frequency=80)
    alone["coefficient"] = alone.coefficient.where(alone.dof == 4, 0.0)
    text = title(sh.plot.disk(alone))
    assert "no nodal diameter dominates" in text
    assert "blade 4 leads" in text


def test_a_disk_at_rest(mistuned):
    rest = mistuned.sel(frequency=80)
    rest["coefficient"] = xr.zeros_like(rest.coefficient)
    np.testing.assert_array_equal(tips(sh.plot.disk(rest)).round(12), 0)


def test_points_without_a_value_are_not_chosen(mistuned):
    kept = mistuned.frequency != 80
    names = ("amplitude", "coefficient")
    holed = mistuned.assign({name: mistuned[name].where(kept) for name in names})
    assert title(sh.plot.disk(holed, at=82.0)).startswith("90 Hz")
    nothing = mistuned.assign(coefficient=np.nan * mistuned.coefficient)
    with pytest.raises(ValueError, match="converged"):
        sh.plot.disk(nothing, at=80.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"at": 200.0}, r"at=200.0: no curve has it; .* from 60 to 90 of frequency"),
        ({"at": 99}, "at=99"),
        ({"place": [0, 1]}, "at least three"),
        ({"place": [0, 1, 1]}, "different"),
        ({"place": [0, 1, 7]}, "place=7"),
        ({"angle": np.nan}, "angle=nan"),
    ],
)
def test_bad_arguments(mistuned, options, words):
    with pytest.raises(ValueError, match=words):
        sh.plot.disk(mistuned, **options)
    assert plt.get_fignums() == []


def test_places_that_are_no_ring(mistuned):
    for place, error in ((3, ValueError), ("abc", KeyError)):
        with pytest.raises(error, match="place="):
            sh.plot.disk(mistuned, place=place)


def test_several_parameter_sets(tuned):
    with pytest.raises(ValueError, match=r"engine_order as well.*isel\(engine_order=0\)"):
        sh.plot.disk(tuned)


def sectors(n_blades=7):
    """Sectors of a root, a middle and a tip; contacts between the roots."""
    size = 3 * n_blades
    stiffness = np.zeros((size, size))
    for first, second, value in [
        link
        for root in range(0, size, 3)
        for link in (
            (root, root + 1, 4e4),
            (root + 1, root + 2, 4e4),
            (root, (root + 3) % size, 1e4),
        )
    ]:
        stiffness[[first, second], [first, second]] += value
        stiffness[[first, second], [second, first]] -= value
    stiffness[range(0, size, 3), range(0, size, 3)] += 1e5
    return sh.Model(
        np.eye(size),
        0.2 * np.eye(size),
        stiffness,
        contacts=[(root, (root + 3) % size) for root in range(0, size, 3)],
        contact_stiffness=1e4,
        friction_coefficient=0.5,
        normal_load=1.0,
    )


TIPS = tuple(range(2, 21, 3))


def names(figure):
    return [text.get_text() for text in figure.axes[0].texts]


@pytest.mark.parametrize("condensed", [False, True])
@pytest.mark.parametrize("order", quick_first([2, -2], 1))
def test_blades_are_those_of_the_engine_order(condensed, order):
    """Not all degrees of freedom: a condensed sector keeps its root too."""
    force = sh.forces.EngineOrder(order, amplitude=1.0, places=TIPS)
    model = sectors()
    if condensed:
        model = sh.condense(model, force, (10, 40), places=TIPS)
        assert model.n_dof == 14
    response = sh.frf(sh.HarmonicBalance(model, force), (10, 40), progress=False)
    figure = sh.plot.disk(response, angle=0.3)
    assert names(figure) == [str(blade) for blade in range(7)]
    assert "nodal diameter 2\n" in title(figure)
    assert len(tips(figure)) == 7
    whole = dict(zip(response.get("structure_dof", response.dof).values, range(99), strict=False))
    given = sh.plot.disk(response, angle=0.3, place=[whole[tip] for tip in TIPS])
    np.testing.assert_array_equal(tips(figure), tips(given))


def test_blades_that_were_not_kept():
    force = sh.forces.EngineOrder(2, amplitude=1.0, places=TIPS)
    point = sh.solve(sh.HarmonicBalance(sh.condense(sectors(), force, (10, 40)), force), 20.0)
    with pytest.raises(ValueError, match=r"7 are not in it .*places= of condense keeps them"):
        sh.plot.disk(point)
    assert names(sh.plot.disk(point, place=range(7))) == [str(i) for i in range(7)]
    with pytest.raises(ValueError, match=r"expected all 7 blades, 1 are not in it .*\[2\]"):
        sh.plot.disk(sh.solve(ring(), 60.0).isel(dof=[0, 1, 3, 4, 5, 6]))


def test_unknown_blades():
    """Seven degrees of freedom of one blade are no disk."""
    stiffness = 4e4 * (2 * np.eye(7) - np.eye(7, k=1) - np.eye(7, k=-1))
    blade = sh.Model(np.eye(7), 0.2 * np.eye(7), stiffness)
    point = sh.solve(sh.HarmonicBalance(blade, sh.forces.PointForce(3, amplitude=1.0)), 20.0)
    with pytest.raises(ValueError, match=r"place=None: expected .*neither the model nor the force"):
        sh.plot.disk(point)
    assert plt.get_fignums() == []
    assert len(tips(sh.plot.disk(point, place=[0, 3, 6]))) == 3


def test_blades_of_a_lumped_model_are_known_without_an_engine_order():
    disk = sh.HarmonicBalance(ring().model, sh.forces.PointForce(2, amplitude=1.0))
    assert names(sh.plot.disk(sh.solve(disk, 60.0))) == [str(i) for i in range(7)]
    one = one_blade()
    with pytest.raises(ValueError, match="a structure of 1 blade: expected at least three"):
        sh.plot.disk(sh.solve(sh.HarmonicBalance(one, sh.forces.PointForce()), 20.0))
