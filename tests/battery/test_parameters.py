"""Over parameters: paths solve each point, and slopes of peaks are differences of peaks."""

import json

import numpy as np
import pytest

import symhbm as sh
from tests.problems import BAND, OWN_LAWS, cases, cell, cells, problem

FOLLOWED = {
    "coulomb": "normal_load", "planar": "normal_load", "pressed": "normal_load",
    "varying": "normal_stiffness", "stop": "gap", "driven": "damper_mass",
    "cubic": "cubic_stiffness", "own": "loss", "coupled": "hardening",
}  # fmt: skip
LAWS = [*FOLLOWED]
HARDENING = "cubic", "coupled", "own"
"""Laws of which several responses may have the same parameters."""
pytestmark = pytest.mark.filterwarnings(
    "ignore:.*curve is incomplete.*(other solutions|turned back at a fold):RuntimeWarning"
)
NOT_LOCATED = pytest.mark.xfail(
    raises=RuntimeWarning, strict=True, reason="an event is told that could not be located"
)


@pytest.mark.parametrize(
    "name",
    cases(
        [
            "pressed blade point 0123", "driven chain point 13", "coupled blade base 13",
            "coulomb mistuned order 13", "stop condensed-sector order 0123",
        ],
        cells(LAWS),
    ),
)  # fmt: skip
def test_followed_points_are_solutions_at_their_values(name, request):
    if name == "pressed chain static 0123":
        request.applymarker(NOT_LOCATED)
    given, parameter = problem(name), FOLLOWED[cell(name).law]
    value = float(np.max(given.parameters[parameter]))
    band = 0.5 * value, 2 * value
    path = sh.follow(given, parameter, band, frequency=24.0, progress=False)
    if cell(name).law in HARDENING:
        audit = sh.verify(path, points=3, exact="none", laws=OWN_LAWS, progress=False)
        assert json.loads(audit.verification)["passed"]
        return
    assert path.status.item() == sh.Status.REACHED_END
    for i in (0, path.sizes["point"] // 2, -1):
        point = path.isel(point=i)
        there = given.with_parameters(**{parameter: float(point[parameter])})
        expected = sh.solve(there, 24.0).coefficient
        size = float(np.abs(expected).max())
        np.testing.assert_allclose(point.coefficient, expected, atol=1e-8 * size)


def highest(law, given, band=BAND):
    """The response over a band, and frequency and amplitude of its highest peak."""
    found = sh.frf(given, band, progress=False)
    others = any(text in found.status.item() for text in ("other solutions", "turned back"))
    if others or (law in HARDENING and not found.n_peaks):
        assert not given.single_valued
        pytest.skip("several responses at one frequency, of which one path has some")
    assert found.status.item() == sh.Status.REACHED_END
    peak = int(np.nanargmax(found.peak_amplitude.values))
    return found, peak, *(found[f"peak_{of}"].values[peak] for of in ("frequency", "amplitude"))


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    cases(
        [
            "driven chain point 13", "coulomb blade base 13",
        ],
        cells(LAWS, ["blade", "rotor", "chain", "mistuned", "condensed"], harmonics=("13", "0123")),
        together=1,
    ),
)  # fmt: skip
def test_slopes_of_peaks_are_differences(name):
    given = problem(name)
    found, peak, frequency, _ = highest(cell(name).law, given)
    slopes = sh.datasets.sensitivity(found, laws=OWN_LAWS).isel(peak=peak)
    assert slopes.sensitivity_status.item() == "exact"
    beside = frequency - 0.3, frequency + 0.3
    for parameter in given.differentiable:
        value = np.array(given.parameters[parameter], dtype=float)
        step = 1e-4 * (np.abs(value).max() or 0.01)
        ends = [
            highest(
                cell(name).law, given.with_parameters(**{parameter: value + way * step}), beside
            )[2:]
            for way in (-1, 1)
        ]
        for of, low, high in zip(("frequency", "amplitude"), *ends, strict=True):
            slope = np.nansum(slopes[f"peak_{of}_by_{parameter}"].values)
            assert slope == pytest.approx((high - low) / (2 * step), rel=1e-4, abs=1e-9), parameter


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    cases(
        ["planar blade point 1"],
        cells(LAWS, ["blade", "mistuned", "condensed-sector"], harmonics=("13", "0123")),
        together=1,
    ),
)
def test_peaks_over_a_parameter_are_those_of_its_values(name, request):
    if name == "pressed blade point 0123":
        request.applymarker(NOT_LOCATED)
    given, parameter = problem(name), FOLLOWED[cell(name).law]
    value = float(np.max(given.parameters[parameter]))
    curve = sh.peak_curve(
        given, parameter, (0.7 * value, 1.5 * value), frequency_band=BAND, progress=False
    )
    for i in (0, curve.sizes[parameter] // 2, -1):
        point = curve.isel({parameter: i})
        there = given.with_parameters(**{parameter: float(point[parameter])})
        assert float(point.peak_amplitude) == pytest.approx(
            highest(cell(name).law, there)[3], rel=1e-8
        )
