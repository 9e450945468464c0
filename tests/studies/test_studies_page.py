"""What the page of the studies counts, and what their command line takes."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from studies import fig08_engine_orders as fig08
from studies import fig13_amplification as fig13
from studies.__main__ import folder
from studies.claim import Claim
from studies.index import Section, page, parameters
from studies.run import RESULTS
from tests.problems import one_blade, problem, ring_of_blades


@pytest.mark.parametrize("asked", [["--help"], ["fig03_single_blade"], ["--results"]])
def test_the_command_computes_nothing_for_help_or_for_what_it_does_not_know(asked, capsys):
    with pytest.raises(SystemExit):
        folder(asked)
    assert "--results FOLDER" in "".join(capsys.readouterr())


def test_the_command_takes_a_folder():
    assert (folder([]), folder(["--results", "mine"])) == (RESULTS, Path("mine"))


def test_what_the_source_cites_is_not_counted_among_its_claims():
    claims = [
        Claim("It is flat", "Fig. 3", "it is", holds=True, expected=True),
        Claim("It is round", "introduction, cited from others", "no", holds=False, expected=False),
    ]
    text = page([Section("study", "A study.", claims=claims)])
    assert "claims of the source: 1 of 1 hold" in text
    assert "that the source cites, that do not hold" in text


def test_higher_engine_orders_are_weighed_by_the_resonances_of_their_nodal_diameters():
    """Without friction the resonances are those of the ring; two exchanged ones are no others."""
    problem = fig08.problem().with_parameters(friction_coefficient=1e9)
    over = {"engine_order": fig08.ENGINE_ORDERS}
    dataset = sh.frf(problem, (50, 350), over=over, progress=False).assign(
        in_phase_spread=("engine_order", np.zeros(3))
    )
    orders = np.array(fig08.DIAMETERS)
    stiffness = 1e4 + 1e6 * (2 * np.sin(np.pi * orders / 13)) ** 2
    closed = np.sqrt(stiffness - 0.5**2 / 2) / (2 * np.pi)
    for at, holds in ((closed, True), (closed[[1, 0, 2, 3, 4]], False), (1.02 * closed, False)):
        told = dataset.assign(higher_peak_frequency=("diameters", at), diameters=orders)
        [claim] = [c for c in fig08.claims(told) if c.words.startswith("The same type")]
        assert claim.holds is holds
        assert f"EO 4: {at[2]:.1f} ({closed[2]:.1f})" in claim.computed


def test_the_published_amplification_is_weighed_on_a_fine_step():
    frequency = np.linspace(65, 90, 126)
    for factor, holds in ((16.0, True), (20.0, False)):
        amplitude = np.ones((2, 126, 3))
        amplitude[1, 64, 2] = factor
        largest = amplitude.max(axis=1)
        dataset = xr.Dataset(
            {
                "amplitude": (("sample", "frequency", "dof"), amplitude),
                "tuned_amplitude": ("frequency", np.ones(126)),
                "amplification_at_frequency": (("sample", "dof"), largest),
                "largest_amplification_at_frequency": ("sample", largest.max(axis=1)),
                "frequency_of_largest_amplification": ("sample", [70.0, frequency[64]]),
            },
            {"frequency": frequency},
        )
        [claim] = [c for c in fig13.claims(dataset) if "16.6" in c.words]
        assert claim.holds is holds
        assert f"{factor:.1f} in 2 disks of ours, on blade 3 of 13" in claim.computed


@pytest.mark.parametrize(
    ("words", "given"),
    {
        "one blade": lambda: sh.HarmonicBalance(one_blade(), sh.forces.PointForce()),
        "ring of 3 blades, force on blade 2": lambda: sh.HarmonicBalance(
            ring_of_blades(3), sh.forces.PointForce(2)
        ),
        "ring of 3 blades, travelling wave of an engine order": lambda: sh.HarmonicBalance(
            ring_of_blades(3), sh.forces.EngineOrder(1)
        ),
        "disk of 4 sectors, each of 6 degrees of freedom, 1 of them kept": lambda: problem(
            "coulomb condensed-sector order 13"
        ),
    }.items(),
)
def test_structures_are_told_by_what_they_are(words, given):
    """Degrees of freedom that condensing keeps are no blades of a ring."""
    assert dict(parameters(sh.solve(given(), 20.0)))["structure"] == words
