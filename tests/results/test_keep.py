"""`keep`: variables left out are named, and the peaks kept can be verified."""

import json
from functools import cache

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from symhbm.response.verification.figures import FIGURES
from symhbm.response.verification.verify import summary
from tests.archives import run
from tests.problems import one_blade, ring_of_blades
from tests.quick import quick_first

RING = sh.HarmonicBalance(
    ring_of_blades(5, contact_stiffness=1e6, normal_load=10),
    sh.forces.EngineOrder(1),
    harmonics=(1, 3),
)
BLADE = sh.HarmonicBalance(one_blade(), sh.forces.PointForce(), harmonics=(1, 3))
DRAWS = sh.mistuning.uniform(RING, 3, seed=2013, friction_coefficient=0.4, normal_load=0.3)
BAND, GRID = (140.0, 210.0), [150.0, 170.0, 200.0]
README = ["amplitude", "peak_frequency", "peak_amplitude", "peak_dof", "peak_kind"]

CALLS = {
    "grid": dict(at=GRID, keep=README),
    "path": dict(keep=["peak_amplitude"]),
    "nothing": dict(at=GRID, keep=[]),
    "each": dict(keep=[], peaks="each"),
    "accuracy": dict(at=GRID, keep=["amplitude"], accuracy=1e-2),
    "stability": dict(at=GRID, keep=["stability"], stability=True),
}


@cache
def ensemble(name):
    return sh.frf(RING, BAND, over=DRAWS, progress=False, **CALLS[name])


@cache
def follow():
    return sh.follow(
        BLADE, "normal_load", (0.1, 100), frequency=19.5, keep=["amplitude"], progress=False
    )


def verified(dataset, **options):
    result = sh.verify(dataset, progress=False, **options)
    return result, json.loads(result.attrs["verification"])


@pytest.mark.parametrize("name", quick_first(CALLS, 3))
def test_peaks_that_were_kept_are_verified(name, tmp_path):
    kept = ensemble(name)
    loaded = sh.load(sh.save(kept, tmp_path / "x.nc"))
    result, report = verified(loaded, exact=2)
    assert report["passed"], summary(result)
    assert report["n_checked"] == 0
    assert report["n_peaks"] == int(kept.n_peaks.sum()) > 3
    assert report["n_exact"] == 2
    assert {"coefficient", "contact_state", "reversals"} < {*report["missing"]}
    assert ("amplitude" in report["missing"]) == ("amplitude" not in kept)
    others = (
        *("contact_mismatch", "march_error", "angles_difference"),
        *("stability_mismatch", "event_mismatch", "fold_mismatch"),
    )  # of points, of angles as unknowns, of motions without a force
    figures = [f"peak_{figure}" for figure in FIGURES if figure not in others]
    assert [*report["figures"]] == figures
    for figure in figures:
        assert result[figure].dims == kept.peak_amplitude.dims
        assert result[figure].attrs["units"] == "1"
        if figure != "peak_exact_difference":
            np.testing.assert_array_equal(
                np.isfinite(result[figure]), np.isfinite(kept.peak_amplitude)
            )
    said = summary(result)
    assert f"{report['n_peaks']} peaks checked, 2 against the exact motion" in said
    assert f"for want of {', '.join(report['missing'])}: left out by keep=" in said


def test_peaks_over_another_parameter():
    kept = follow()
    report = verified(kept)[1]
    assert report["passed"]
    assert report["n_peaks"] == int(kept.n_peaks) == 1
    at = report["figures"]["peak_residual_stored"]["at"]
    assert at["normal_load"] == float(kept.peak_normal_load[0])
    assert at["frequency"] == 19.5
    broken = kept.copy(deep=True)
    broken.peak_normal_load[0] *= 1 + 1e-6
    assert verified(broken)[1]["figures"]["peak_residual_stored"]["broken"]


DAMAGE = {
    "peak_coefficient": ("peak_residual_stored", 1 + 1e-6),
    "peak_frequency": ("peak_residual_stored", 1 + 1e-6),
    "peak_amplitude": ("peak_amplitude_mismatch", 1 + 1e-6),
    "peak_dof": ("peak_amplitude_mismatch", 4),
}


@pytest.mark.parametrize("whole", quick_first([False, True], 1))
@pytest.mark.parametrize("name", DAMAGE)
def test_damage_of_a_peak_is_named(name, whole):
    """Also where the points are there, which are as they were."""
    figure, factor = DAMAGE[name]
    kept = whole_ensemble() if whole else ensemble("grid")
    broken = kept.copy(deep=True)
    index = (1, int(kept.n_peaks[1]) - 1)
    values = broken[name].values
    values[index] = values[index] * factor if name != "peak_dof" else (values[index] + 1) % 5
    result, report = verified(broken, exact="none")
    assert not report["passed"]
    names = [name for name, entry in report["figures"].items() if entry["broken"]]
    assert figure in names
    assert not [name for name in names if not name.startswith("peak_")]
    entry = report["figures"][figure]
    assert entry["n_broken"] == 1
    assert (entry["at"]["sample"], entry["at"]["peak"]) == index
    assert "BROKEN" in summary(result)
    assert verified(kept, exact="none")[1]["passed"]


@cache
def whole_ensemble():
    return sh.frf(RING, BAND, over=DRAWS, at=GRID, progress=False)


@pytest.mark.slow
def test_coefficients_alone_are_verified_as_far_as_possible():
    kept = sh.frf(RING, BAND, over=DRAWS, at=GRID, keep=["coefficient"], progress=False)
    result, report = verified(kept)
    assert report["passed"]
    assert (report["n_checked"], report["n_exact"]) == (9, 0)
    assert report["missing"] == [
        *("amplitude", "contact_state", "stick_fraction", "dissipation", "reversals")
    ]
    assert {"residual_stored", "energy_error"} < {*report["figures"]}
    assert not {"contact_mismatch", "amplitude_mismatch"} & {*report["figures"], *result}
    # The same numbers as of the whole.
    other = verified(whole_ensemble())[0]
    xr.testing.assert_equal(result.residual_stored, other.residual_stored)
    # A bound on what cannot be looked at does not hold.
    _, report = verified(kept, bounds={"contact_mismatch": 1.0})
    assert not report["passed"]
    assert report["figures"]["contact_mismatch"]["broken"]
    assert verified(kept, bounds={"contact_mismatch": None})[1]["passed"]


def test_the_energy_balance_of_peaks_includes_friction():
    """Dissipation is that of a slider that marches, not what the residual has it to be."""
    kept = ensemble("grid")
    other = kept.assign(friction_coefficient=kept.friction_coefficient * (1 + 1e-6))
    figures = verified(other, exact="none")[1]["figures"]
    assert figures["peak_energy_error"]["broken"]
    assert figures["peak_residual_stored"]["broken"]


def test_nothing_to_verify_does_not_pass():
    """No coefficients; no peaks in the band."""
    kept = sh.frf(RING, BAND, at=GRID, keep=README, verifiable=False, progress=False)
    words = r"nothing to verify, coefficient, .*peak_coefficient were left out by keep=; with veri"
    with pytest.raises(sh.datasets.ArchiveError, match=words):
        sh.verify(kept)
    none = sh.frf(RING, (5, 6), at=[5.5], keep=["amplitude"], progress=False)
    result, report = verified(none)
    assert (report["passed"], report["n_peaks"], report["figures"]) == (False, 0, {})
    assert "0 points checked" in summary(result)
    dropped = whole_ensemble().drop_vars(["coefficient", "peak_coefficient"])
    with pytest.raises(
        sh.datasets.ArchiveError, match=r"expected a result .* without coefficient$"
    ):
        sh.verify(dropped)
    result, _ = verified(whole_ensemble().drop_vars("contact_state"))
    assert "not verified for want of contact_state: not in the dataset" in summary(result)


NEEDS = {
    "disk": ("coefficient", lambda ds: sh.plot.disk(ds.isel(sample=0, frequency=0))),
    "stick_map": ("stick_fraction", lambda ds: sh.plot.stick_map(ds.isel(sample=0))),
    "hysteresis": ("coefficient", lambda ds: sh.plot.hysteresis(ds.isel(sample=0, frequency=0))),
}


@pytest.mark.parametrize("kind", NEEDS)
def test_plots_say_what_was_left_out(kind):
    name, draw = NEEDS[kind]
    with pytest.raises(KeyError, match=rf"'{name}' was left out by keep=; compute with keep="):
        draw(ensemble("grid"))
    # What was there and is no more was not left out.
    with pytest.raises(KeyError, match=rf"'{name}' is no variable of the dataset"):
        draw(whole_ensemble().drop_vars(name))
    plt.close("all")


def test_others_say_what_was_left_out():
    kept = ensemble("nothing")
    with pytest.raises(KeyError, match="'amplitude' was left out by keep="):
        sh.plot.response(kept)
    with pytest.raises(ValueError, match=r"got one without amplitude, left out by keep="):
        sh.statistics.envelope(kept)
    with pytest.raises(sh.datasets.ArchiveError, match=r"without peak_kind, left out by keep="):
        sh.datasets.sensitivity(kept)


def test_the_command_line_says_what_was_left_out(tmp_path):
    path = sh.save(ensemble("grid"), tmp_path / "x.nc")
    assert "left out by keep=       coefficient, theta_0" in run("info", path)[1]
    code, out, err = run("verify", path, "--exact", "none")
    assert (code, err, "left out by keep=" in out) == (0, "", True)
    for given, words in (
        (("export", path, "--variables", "coefficient"), "'coefficient' was left out by keep="),
        (("export", path, "--table", "events"), "no events, they were left out by keep="),
        (("verify", path, "--output", path), "there is such a file; --overwrite replaces it"),
    ):
        code, out, err = run(*given)
        assert (code, out, words in err) == (2, "", True)
    assert run("verify", path, "--output", path, "--overwrite")[0] == 0
