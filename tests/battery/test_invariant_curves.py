"""Curves of problems of all kinds: up and down, in parts, in archives, verified, and in time."""

import json
import pickle

import numpy as np
import pytest
import xarray as xr
from scipy.signal import find_peaks

import symhbm as sh
from tests.problems import BAND, OWN_LAWS, cases, cell, cells, problem

pytestmark = pytest.mark.filterwarnings(
    "ignore:.*incomplete.*(other solutions|turned back at a fold):RuntimeWarning"
)
"""Where springs harden there are several responses at one frequency, as the status tells."""

FEW = [
    "coulomb blade base 13", "stop rotor static 0123", "planar reduced-turning order 1",
    "varying air order 0123", "none blade static 0123",
]  # fmt: skip


def curve(given, band=BAND, **options):
    return sh.frf(given, band, **dict(progress=False, stability=False) | options)


def peaks(found):
    """Frequencies and amplitudes of the peaks that every curve has: those that rise by 1 %."""
    frequency, amplitude = sh.plot.curve(found)
    tops, _ = find_peaks(amplitude, prominence=0.01 * amplitude.max())
    at = found.peak_frequency.values
    located = np.abs(at[:, None] - np.sort(frequency[tops])).argmin(axis=0)
    np.testing.assert_allclose(at[located], np.sort(frequency[tops]), rtol=1e-6)
    return at[located], found.peak_amplitude.values[located]


TWO_INSTANTS = pytest.param("pressed rotor point 0123", marks=pytest.mark.slow)
"""Two peaks beside an onset of slip: the largest displacement passes to another instant there."""
AT_A_CORNER = "driven reduced order 0123"
"""A point of the path is a peak where another instant leads: neither side has the other's slope."""


@pytest.mark.parametrize("name", [*cases(FEW, cells(), together=1), TWO_INSTANTS, AT_A_CORNER])
def test_down_as_up(name):
    given = problem(name)
    up, down = (curve(given, band) for band in (BAND, BAND[::-1]))
    if {up.status.item(), down.status.item()} != {str(sh.Status.REACHED_END)}:
        pytest.skip("several responses at one frequency, of which one sense finds some")
    (at, high), (found, low) = peaks(up), peaks(down)
    np.testing.assert_allclose(found, at, rtol=1e-6)
    np.testing.assert_allclose(low, high, rtol=1e-8)
    events = (np.sort(found.event_frequency) for found in (up, down))
    np.testing.assert_allclose(*events, rtol=1e-8)


@pytest.mark.filterwarnings("ignore:.*a maximum between two points of the path:RuntimeWarning")
@pytest.mark.parametrize("name", cases(FEW[:2], cells(), together=1))
def test_parts_are_the_whole_and_archives_keep_it(name, tmp_path):
    given, over = problem(name), {"force_amplitude": [0.6, 1.2, 2.4]}
    options = dict(at=np.linspace(*BAND, 5), over=over)
    whole = curve(given, archive=tmp_path / "whole.nc", **options)
    archives = [tmp_path / f"part{i}.nc" for i in (1, 2)]
    for i, archive in enumerate(archives, 1):
        curve(given, part=(i, 2), archive=archive, **options)
    for other in (sh.datasets.merge(archives), sh.load(tmp_path / "whole.nc")):
        for variable in ("amplitude", "coefficient", "peak_frequency", "n_solutions"):
            if variable in whole:
                xr.testing.assert_equal(other[variable].load(), whole[variable])


@pytest.mark.parametrize("name", cases([*FEW[1:3], "coulomb mistuned order 13"], cells()))
def test_copies_give_the_same_response(name):
    given = problem(name)
    one = sh.solve(given, 24.0)
    copies = [sh.datasets.rebuild(one, laws=OWN_LAWS)]
    if cell(name).law != "own":
        copies.append(pickle.loads(pickle.dumps(given)))
    for copy in copies:
        again = sh.solve(copy, 24.0).coefficient
        size = np.abs(one.coefficient).max().item()
        np.testing.assert_allclose(again, one.coefficient, atol=1e-11 * size)


@pytest.mark.parametrize("name", cases(FEW[:3], cells(), together=1))
def test_curves_are_verified(name):
    audit = sh.verify(curve(problem(name)), points=3, exact="none", laws=OWN_LAWS, progress=False)
    assert json.loads(audit.verification)["passed"]


IN_TIME = ["blade", "rotor", "chain", "ring", "mistuned", "reduced-ring"]
"""Structures with the same matrices for all harmonics."""


@pytest.mark.parametrize(
    "name",
    cases(
        ["planar blade base 13", "coulomb reduced-ring order 1", "coupled blade point 13"],
        cells(structures=IN_TIME),
        together=1,
    ),
)
def test_exact_motion_is_what_many_harmonics_tend_to(name):
    given = problem(name)
    most = max(given.harmonics)
    differences = []
    for highest in (most, 3 * most + 2):
        step = 1 if 0 in given.harmonics else 2
        more = given.with_harmonics(tuple(range(given.harmonics[0], highest + 1, step)))
        found = sh.solve(more, 24.0)
        exact = sh.periodic_motion(more, 24.0, start=found)
        assert exact.converged.all()
        difference = exact.coefficient.sel(harmonic=1) - found.coefficient.sel(harmonic=1)
        differences.append(float(abs(difference).max() / abs(found.coefficient).max()))
    assert differences[1] < max(1e-9, 0.5 * differences[0])
    assert differences[0] < 0.05
