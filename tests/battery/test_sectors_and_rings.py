"""One sector moves as its whole ring does, reduced and condensed structures as the whole ones."""

import numpy as np
import pytest
from rings import assembled

import symhbm as sh
from tests.problems import (
    HARMONICS,
    N_SECTORS,
    cases,
    cell,
    cells,
    force_of,
    problem,
    reduced,
    sector,
    solved,
)

SAME = {
    "ring": "sector", "reduced": "sector", "reduced-turning": "turning", "reduced-ring": "turning",
    "condensed": "chain", "condensed-sector": "sector",
}  # fmt: skip
"""Structures whose motion is that of another one, at the places they keep."""
QUICK = [
    "varying ring static 0123", "planar ring order 13", "pressed reduced static 0123",
    "planar reduced-ring order 13", "own condensed base 13", "coulomb condensed static 0123",
    "stop condensed-sector order 0123",
]  # fmt: skip


@pytest.mark.parametrize("name", cases(QUICK, cells(structures=SAME)))
def test_structures_that_move_alike(name):
    law, structure, force, level = cell(name)
    given, other = problem(name), problem(" ".join((law, SAME[structure], force, level)))
    found, expected = solved(given), solved(other)
    if structure == "ring":
        found = found[: len(expected)]
    else:
        own = reduced(law, 300.0) if structure == "reduced-ring" else given.model
        kept = own.kept if structure.startswith("reduced") else given.model.dofs
        found, expected = found[: len(kept)], expected[np.asarray(kept)]
    size = np.abs(expected).max()
    np.testing.assert_allclose(found, expected, atol=2e-8 * size)
    if structure.startswith("condensed"):
        everywhere = sh.datasets.recover(given, sh.solve(given, 24.0))
        assert everywhere.residual_norm < 1e-10
        kept = other.model.kept if structure == "condensed-sector" else slice(None)
        whole = everywhere.coefficient.values[kept]
        np.testing.assert_allclose(whole, solved(other), atol=1e-8 * size)


@pytest.mark.parametrize(
    "name",
    cases(
        ["pressed sector static 0123", "coulomb turning order 13"],
        cells(structures=["sector", "turning"]),
    ),
)
def test_sector_and_the_ring_assembled_from_all(name):
    """All matrices and forces of the ring from those of the sector, by the test itself."""
    given = problem(name)
    ring = assembled(given.model, given.excitation, given.harmonics)
    whole = sh.HarmonicBalance(ring.model, ring.force, given.harmonics)
    found, own = solved(whole), solved(given)
    seen = np.einsum("ij,jhc->ihc", ring.motions[0].toarray(), found)
    expected = seen[given.model.interfaces.others]
    np.testing.assert_allclose(own, expected, atol=1e-9 * np.abs(own).max())


@pytest.mark.parametrize(
    "name",
    cases(
        ["coulomb mistuned order 13", "stop mistuned order 0123"], cells(structures=["mistuned"])
    ),
)
def test_numbers_of_blades_are_arbitrary(name):
    """Deviations one blade further on: the motion one blade further on, and as much later."""
    law, _, force, level = cell(name)
    deviations = 0.02 * np.sin(np.arange(N_SECTORS))
    motions = []
    for shift in (0, 1):
        ring = sh.mistuned_ring(sector(law), stiffness_deviation=np.roll(deviations, shift))
        harmonics = HARMONICS[level]
        given = sh.HarmonicBalance(ring, force_of(force, ring, True, harmonics), harmonics)
        motion = solved(given) @ [1, -1j]
        motions.append(motion.reshape(N_SECTORS, -1, len(harmonics)))
    lag = np.exp(-2j * np.pi / N_SECTORS * np.array(HARMONICS[level]))
    expected = np.roll(motions[0], 1, axis=0) * lag
    np.testing.assert_allclose(motions[1], expected, atol=1e-9 * np.abs(expected).max())
