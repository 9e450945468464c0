"""Archives of condensed structures: the problem to the bit, and nothing of what is damaged."""

import numpy as np
import pytest
import scipy.sparse as sp

import symhbm as sh
from symhbm.response.verification.verify import summary
from symhbm.results.problem import record_of
from tests.archives import run

FORCE = sh.forces.HarmonicForce({0: np.linspace(0, 1, 30), 1: np.ones(30)}, {2: np.arange(30) / 30})


def chain(stiffness=4e3):
    ones = np.ones(30)
    tied = stiffness * sp.diags_array([-ones[1:], 2 * ones, -ones[1:]], offsets=[-1, 0, 1])
    slider = sh.Contacts(
        sh.laws.Coulomb(),
        [(8,), {15: 1.0, 18: -0.5}],
        contact_stiffness=2e3,
        friction_coefficient=0.5,
        normal_load=[1.0, 4.0],
    )
    stop = sh.Gap(normal=[(20,)], normal_stiffness=1e3, gap=5e-3)
    contacts = {"slider": slider, "stop": stop}
    return sh.Model(sp.eye_array(30), 0.3 * sp.eye_array(30), tied, contacts=contacts)


@pytest.fixture(scope="module")
def problem():
    small = sh.condense(chain(), FORCE, (1, 3), (0, 1, 2, 3), places=[29], progress=False)
    return sh.HarmonicBalance(small, FORCE, (0, 1, 2))


@pytest.fixture(scope="module")
def response(problem):
    over = {"normal_load": [2.0, 3.0]}
    return sh.frf(problem, (1.8, 2.2), over=over, progress=False)


def test_what_is_stored_is_verified(response, tmp_path):
    verified = sh.verify(response, progress=False)
    assert verified.residual_stored.max() < 1e-10
    assert verified.energy_error.max() < 1e-9
    assert verified.residual_larger.max() > 1e-9  # harmonic 3, which it was condensed for
    assert "exact_difference" not in verified
    told = summary(verified)
    assert "BROKEN" not in told
    assert "symhbm.craig_bampton" in told
    wrong = response.copy(deep=True)
    wrong.coefficient[0, 3, 1, 1, 0] *= 1.001
    caught = sh.verify(wrong, progress=False)
    for name in ("residual_stored", "energy_error", "amplitude_mismatch"):
        assert caught[name][0, 3] > 1e-6
    assert "BROKEN" in summary(caught)


def test_the_whole_structure_is_given_again_to_recover(problem, response):
    point = response.isel({"normal_load": 0}).isel(point=2)
    again = sh.datasets.rebuild(point)
    with pytest.raises(TypeError, match=r"structure= of symhbm\.datasets\.recover"):
        sh.datasets.recover(again, point)
    found = sh.datasets.recover(again, point, structure=chain())
    assert found.identical(sh.datasets.recover(problem, point))
    assert found.residual_norm < 1e-12
    with pytest.raises(ValueError, match="its matrices differ"):
        sh.datasets.recover(again, point, structure=chain(4.1e3))
    with pytest.raises(TypeError, match="structure=3: expected a Model"):
        sh.datasets.recover(again, point, structure=3)


@pytest.mark.parametrize("place", [0, 77, -1])
def test_damaged_numbers_never_speak(response, place):
    damaged = response.copy(deep=True)
    value = damaged["problem_numbers"].values[place]
    damaged["problem_numbers"].values[place] = np.nextafter(value, np.inf)
    for verb in (sh.datasets.rebuild, sh.verify, sh.datasets.sensitivity):
        with pytest.raises(sh.datasets.ArchiveError, match="not as it was stored"):
            verb(damaged)


def test_a_damaged_description_never_speaks(response):
    for before, after in (
        ('"frequency": [1.0, 3.0]', '"frequency": [1.0, 4.0]'),
        ('"harmonics": [0, 1, 2, 3]', '"harmonics": [0, 1, 2, 4]'),
        ('"kind": "c"', '"kind": "f"'),
    ):
        text = response.attrs["problem"]
        assert before in text
        damaged = response.assign_attrs(problem=text.replace(before, after, 1))
        with pytest.raises(sh.datasets.ArchiveError):
            sh.datasets.rebuild(damaged)
    with pytest.raises(sh.datasets.ArchiveError, match="not in it"):
        sh.datasets.rebuild(response.drop_vars("problem_numbers"))


def test_statistics_and_texts_of_condensed_structures(problem, tmp_path):
    draws = sh.mistuning.explicit(problem, normal_load=[[1.0, 4.0], [2.0, 3.0]])
    ensemble = sh.frf(problem, (1.8, 2.2), at=[1.9, 2.1], over=draws, progress=False)
    envelope = sh.statistics.envelope(ensemble.isel(solution=0))
    assert record_of(sh.datasets.rebuild(envelope))[0] == record_of(problem)[0]
    sh.save(ensemble, tmp_path / "ensemble.nc")
    told = run("info", tmp_path / "ensemble.nc")[1]
    assert "5 degrees of freedom kept of 30" in told
    assert "problem_numbers" not in told
