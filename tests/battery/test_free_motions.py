"""Modes, limit cycles and flutter limits of one sector, and of the ring of all of them."""

import numpy as np
import pytest
from rings import assembled

import symhbm as sh
from tests.problems import N_SECTORS, OPENS, sector


def pairs(law, nodal_diameter, damped):
    """One sector, and the ring assembled from all, both asked for the same wave."""
    disk = sector(law, damped=damped)
    harmonics = (0, 1, 2, 3) if law in OPENS else (1, 3)
    alone = sh.HarmonicBalance(disk, None, harmonics)
    ring = sh.HarmonicBalance(assembled(disk).model, None, harmonics)
    return alone, ring, dict(nodal_diameter=nodal_diameter, place=1, progress=False)


@pytest.mark.parametrize(
    ("law", "nodal_diameter"),
    [
        ("coulomb", 1),
        *(
            pytest.param(law, k, marks=pytest.mark.slow)
            for law in ("coulomb", "varying", "planar", "own")
            for k in (-1, 0, 2)
        ),
    ],
)
def test_cycles_of_a_sector_are_those_of_its_ring(law, nodal_diameter):
    alone, ring, options = pairs(law, nodal_diameter, -0.2)
    options |= dict(amplitudes=(1e-6, 1e-2))
    one, whole = sh.limit_cycles(alone, **options), sh.limit_cycles(ring, **options)
    assert one.sizes["point"] == whole.sizes["point"]
    for name in ("frequency", "amplitude"):
        np.testing.assert_allclose(one[name], whole[name], rtol=1e-8)
    if "stability" in one and "stability" in whole:
        np.testing.assert_array_equal(one.stability, whole.stability)


@pytest.mark.parametrize(
    "law",
    ["coulomb", *(pytest.param(law, marks=pytest.mark.slow) for law in ("planar", "stop", "own"))],
)
def test_modes_of_a_sector_are_those_of_its_ring(law):
    alone, ring, options = pairs(law, 1, 1.0)
    grid = np.geomspace(1e-5, 1e-3, 4)
    options |= dict(band=(1e-6, 1e-2), at=grid)
    one, whole = sh.nonlinear_modes(alone, **options), sh.nonlinear_modes(ring, **options)
    for name in ("frequency", "damping_ratio"):
        np.testing.assert_allclose(one[name], whole[name], rtol=1e-8)
    of_all = np.sqrt(N_SECTORS) * one.modal_amplitude
    np.testing.assert_allclose(of_all, whole.modal_amplitude, rtol=1e-8)


@pytest.mark.parametrize(
    "law",
    ["coulomb", *(pytest.param(law, marks=pytest.mark.slow) for law in ("planar", "varying"))],
)
def test_flutter_limits_of_a_sector_are_those_of_its_ring(law):
    alone, ring, options = pairs(law, 1, 0.3)
    options |= dict(at=[1.0, 2.0], amplitudes=(1e-6, 1e-3), disturbance=3e-4)
    one, whole = (sh.flutter_limit(p, "normal_load", (0.5, 3), **options) for p in (alone, ring))
    for name in ("flutter_limit", "flutter_limit_slope", "limit_frequency"):
        np.testing.assert_allclose(one[name], whole[name], rtol=1e-8)


def test_cycle_of_opposite_neighbours_is_one_of_all_blades_alone():
    """The only wave of its frequency: a mode of the whole ring, which no wave is asked of."""
    disk = sector("coulomb", damped=-0.2)
    wave, whole = (
        sh.limit_cycles(
            sh.HarmonicBalance(model, None, (1, 3)), amplitudes=(1e-6, 1e-2), place=1,
            progress=False, **which,
        )
        for model, which in ((disk, dict(nodal_diameter=2)), (assembled(disk).model, dict(mode=4)))
    )  # fmt: skip
    assert len(wave.frequency) == 1
    for name in ("frequency", "amplitude"):
        np.testing.assert_allclose(whole[name], wave[name], rtol=1e-8)
