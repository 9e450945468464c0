"""Calls that cannot be answered are refused: with the argument, its value and what is allowed."""

from functools import cache
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
import xarray as xr
from sectors import random_disk, with_friction

import symhbm as sh
from symhbm.response.verification.verify import summary
from tests.problems import BLADE, one_blade, ring_of_blades

QUIET: dict[str, Any] = dict(progress=False)
ALONE = sh.HarmonicBalance(one_blade())
FORCED = sh.HarmonicBalance(one_blade(), sh.forces.PointForce(), (1, 3))
DRIVEN = ALONE.with_parameters(damping=-0.5)
RING = sh.HarmonicBalance(ring_of_blades(13))
WAVE = sh.HarmonicBalance(ring_of_blades(13), sh.forces.EngineOrder(3))
FIVE = sh.HarmonicBalance(ring_of_blades(5), sh.forces.EngineOrder(1))
DISK = with_friction(random_disk(5, cartesian=False))
SECTOR = sh.HarmonicBalance(DISK, None, (0, 1))
FREE = sh.HarmonicBalance(sh.Model(np.eye(2), np.eye(2), [[1e4, -1e4], [-1e4, 1e4]]))
PAIR = sh.HarmonicBalance(sh.Model(np.eye(2), np.eye(2), np.diag([1e4, 2e4])))
THIRD = sh.HarmonicBalance(one_blade(), sh.forces.PointForce(harmonic=3), (3,))
SAMPLED = sh.HarmonicBalance(one_blade(), sh.forces.PointForce(), (1,), 64)
SHAFT = sh.RotatingModel(sh.Model([[1.0]], [[0.0]], [[1e4]]), {0: [[1e4]], 500: [[2e4]]})
THREE = sh.Model(np.eye(3), np.eye(3), 1e4 * np.eye(3))
OF_CONTACT = sh.HarmonicBalance(THREE.with_outputs({"contact": [1, 0, 0]}, "m"), FORCED.excitation)
LOADS, BAND = {"normal_load": [1.0, 2.0]}, (1, 2)
FEW = dict(keep=["frequency", "damping_ratio"])
VALUE, KEY, TYPE = ValueError, KeyError, TypeError


def condensed() -> sh.HarmonicBalance:
    rubs = {name: BLADE[name] for name in ("contact_stiffness", "friction_coefficient")}
    blade = sh.Model(np.eye(3), np.eye(3), np.diag([1e4, 2e4, 3e4]), [(0,)], normal_load=3, **rubs)
    force = sh.forces.PointForce()
    return sh.HarmonicBalance(sh.condense(blade, force, (10, 30), (1,), **QUIET), force)


@cache
def point() -> xr.Dataset:
    return sh.solve(FORCED, 19.5)


def modes(problem: Any, *given: Any, **options: Any) -> Any:
    return lambda: sh.nonlinear_modes(problem, *given, **QUIET | options)


def over(name: str, band: Any = BAND, problem: Any = ALONE, **options: Any) -> Any:
    return modes(problem, name, band, **dict(amplitude=3e-4) | options)


def cycles(*given: Any, problem: Any = DRIVEN, **options: Any) -> Any:
    return lambda: sh.limit_cycles(problem, *given, **QUIET | options)


def follow(parameter: Any = "normal_load", band: Any = (1.0, 5.0), **options: Any) -> Any:
    given = dict(problem=FIVE, parameter=parameter, band=band, frequency=19.0) | options
    return lambda: sh.follow(**given)


def verify(what: Any = point, **options: Any) -> Any:
    return lambda: sh.verify(what() if callable(what) else what, **options)


def synthesised(problem: Any, *force: Any, **options: Any) -> Any:
    wave = dict(nodal_diameter=3) if problem is WAVE else {}
    errors = options.pop("errors", True)
    found = lambda: sh.nonlinear_modes(problem, **QUIET | wave | options)  # noqa: E731
    return lambda: sh.datasets.synthesised_response(found(), *force, errors=errors)


def outputs(given: Any, units: Any = "m") -> Any:
    return lambda: THREE.with_outputs(given, units=units)


def campbell(speeds: Any = (0, 100), **options: Any) -> Any:
    return lambda: sh.campbell(SHAFT, speeds, **options)


def accuracy(value: Any, problem: Any = FORCED) -> Any:
    return lambda: sh.frf(problem, (10, 30), accuracy=value)


CALLS: list[tuple[Any, Any, str]] = [
    (modes(ALONE, mode=1), VALUE, "mode=1: expected a number from 0 to 0"),
    (modes(ALONE, mode=-1), VALUE, "mode=-1"),
    (modes(RING, mode=1), VALUE, "mode=1: .*nodal_diameter="),
    (modes(FREE), VALUE, "mode=0: expected a mode that stiffness holds"),
    (modes(PAIR, place=1), VALUE, "place=1: expected a degree .* that moves in mode 0, .*; 0 mov"),
    (modes(ALONE, place=1), VALUE, "degree of freedom=1: expected"),
    (modes(ALONE, place=-1), VALUE, "degree of freedom=-1"),
    (modes(SECTOR, place=DISK.n_whole - 1, nodal_diameter=1), VALUE, "place=.*right interface"),
    (modes(RING, nodal_diameter=7), VALUE, "nodal_diameter=7: expected an integer from -6 to 6"),
    (modes(ALONE, nodal_diameter=1), VALUE, "nodal_diameter=1: expected None"),
    (modes(ALONE, nodal_diameter=0.5), VALUE, "nodal_diameter=0.5"),
    (modes(ALONE, band=(1e-2, 1e-6)), VALUE, "band=.*smallest"),
    (modes(ALONE, band=(0.0, 1e-6)), VALUE, "band="),
    (modes(ALONE, at=[1.0]), VALUE, "at="),
    (modes(THIRD), VALUE, "harmonics=.*expected 1"),
    (modes(SAMPLED), VALUE, "samples=64"),
    (modes(ALONE, max_points=1), VALUE, "max_points=1"),
    (modes(one_blade()), TYPE, "problem="),
    (modes(ALONE, over={"normal_lod": [1.0]}), KEY, "normal_lod"),
    (lambda: modes(condensed())(), TYPE, "craig_bampton"),
    (over("mass"), VALUE, "mass.*does not change the mass matrix"),
    (modes(ALONE, amplitude=1e-3), VALUE, "amplitude=0.001: expected None"),
    (over("normal_load", amplitude=None), (VALUE, TYPE), "amplitude=None"),
    (over("normal_load[3]"), VALUE, r"normal_load\[3\].*from 0 to 0"),
    (over("normal_load", over={"normal_load": [1]}), VALUE, "over: .normal_load. is"),
    (over("normal_load", amplitude=(1e-5, 1e-3)), (VALUE, TYPE), "amplitude="),
    (over("normal_load", amplitude=-1e-3), VALUE, "amplitude="),
    (over("normal_load", (2, 2)), VALUE, "band="),
    (over("normal_load[1]", problem=RING, nodal_diameter=3), VALUE, "nodal_diameter=3: expected N"),
    (over("force_amplitude", problem=FORCED), VALUE, "force_amplitude"),
    (cycles("weight", BAND), KEY, "weight"),
    (cycles("damping"), (TYPE, VALUE), "band"),
    (cycles("damping", (1, 1)), VALUE, "two different values"),
    (cycles("normal_load", (-1, 1)), VALUE, "band"),
    (cycles("damping", (-30, 0), [-40]), VALUE, "within the band"),
    (cycles("force_amplitude", BAND), (KEY, VALUE), "force_amplitude"),
    (cycles(None, BAND), VALUE, "parameter=None"),
    (cycles(at=[1.0]), VALUE, "parameter=None"),
    (cycles("damping[9]", (-3, 0)), VALUE, "damping"),
    (cycles(amplitudes=(1, 1e-3)), VALUE, "smallest, largest"),
    (cycles(amplitudes=(0, 1)), VALUE, "amplitude"),
    (cycles(mode=1), VALUE, "mode=1"),
    (cycles(mode=(0, 0)), VALUE, "different"),
    (cycles(mode="first"), (TYPE, VALUE), "mode"),
    (cycles(place=1), VALUE, "degree of freedom=1"),
    (cycles(nodal_diameter=1), VALUE, "nodal_diameter=1"),
    (cycles(stability=1), (TYPE, VALUE), "stability"),
    (cycles("damping", (-3, 0), over={"damping": [1.0]}), VALUE, "damping"),
    (cycles(max_points=1), VALUE, "max_points"),
    (cycles(problem=DRIVEN.with_harmonics((3, 5))), VALUE, "harmonics"),
    (cycles(problem=SECTOR, nodal_diameter=1, stability=True), VALUE, "stability=True"),
    (cycles("damping[2]", (-3, 0), problem=RING, nodal_diameter=1), VALUE, "all sectors move alik"),
    (follow("normal_laod"), KEY, "'normal_laod'.*allowed.*normal_load"),
    (follow("frequency"), KEY, "'frequency'.*allowed.*normal_load"),
    (follow(None), (TYPE, KEY), "None.*allowed.*normal_load"),
    (follow(["normal_load"]), (TYPE, KEY), "normal_load.*allowed"),
    (follow("engine_order"), VALUE, "parameter='engine_order'.*expected"),
    (follow(band=None), TYPE, r"band=None.*two different values \(first, last\) \[N\]"),
    (follow(band=(3.0, 3.0)), VALUE, r"band=\(3.0, 3.0\).*two different values.*\[N\]"),
    (follow(band=(-1.0, 3.0)), VALUE, r"band=\(-1.0, 3.0\).*>= 0"),
    (follow("mass", (0.0, 3.0)), VALUE, r"band=\(0.0, 3.0\).*> 0"),
    (follow("force_amplitude", (-1.0, 1.0)), VALUE, r"band=\(-1.0, 1.0\).*>= 0"),
    (follow(at=[5.5]), VALUE, r"at=\[5.5\].*1 to 5"),
    (follow(band=(5.0, 1.0), at=[3.0, 2.0]), VALUE, r"at=\[3.0, 2.0\].*ascending"),
    (follow(frequency=0.0), VALUE, "frequency=0.0.*> 0"),
    (follow(frequency=(10.0, 20.0)), (TYPE, VALUE), r"frequency=\(10.0, 20.0\).*one number"),
    *((follow(f"normal_load[{i}]"), VALUE, rf"parameter='normal_load\[{i}\]'.*from 0 to 4")
      for i in ("5", "-1", "1.5", "")),
    (follow("stiffness[5]"), VALUE, r"parameter='stiffness\[5\]'.*from 0 to 4"),
    (follow("force_amplitude[0]"), VALUE, r"parameter='force_amplitude\[0\]'.*one value"),
    (follow("normal_laod[0]"), KEY, "'normal_laod'.*normal_load"),
    (follow(3), (TYPE, KEY), "3 is no parameter"),
    (follow(over=LOADS), VALUE, "over.*normal_load.*followed"),
    (follow(peaks="all"), VALUE, "peaks='all'.*one of 'largest', 'each'"),
    (follow(peaks=np.array(["each", "largest"])), VALUE, "peaks=.*one of 'largest', 'each'"),
    (lambda: sh.frf(FORCED, (10, 30), phase_resonances="yes"), TYPE, "phase_resonances='yes'"),
    *((accuracy(value), (TYPE, VALUE), "accuracy")
      for value in (0.0, 1.0, -1e-3, np.nan, "1e-3", [1e-3])),
    (lambda: sh.solve(FORCED, 20.0, accuracy=0.0), VALUE, "accuracy"),
    (accuracy(1e-3, SAMPLED), VALUE, "samples=64"),
    (verify(points=0), VALUE, "points=0"),
    (verify(points="some"), VALUE, "points='some': expected 'all' or an integer"),
    (verify(exact=-1), VALUE, "exact=-1"),
    (verify(exact="some"), VALUE, "exact='some': expected 'all', 'none' or an integer"),
    (verify(exact=1.5), VALUE, r"exact=1\.5"),
    (verify(bounds={"energy_error": -1.0}), VALUE, r"bounds\['energy_error'\]=-1\.0"),
    (verify(bounds=[1e-9]), TYPE, "bounds="),
    (verify(bounds={"residual": 1.0}), KEY, "'residual' is no figure.*residual_stored, residual_l"),
    (verify(1), TYPE, "dataset="),
    (verify(xr.Dataset()), VALUE, "not written by symhbm"),
    (verify(lambda: sh.periodic_motion(FORCED, 19.5, n_angles=8)), VALUE, "a result of frf, follo"),
    (lambda: summary(point()), VALUE, "expected what verify returns"),
    (synthesised(WAVE, sh.forces.EngineOrder(2)), VALUE, r"force=EngineOrder.*wave"),
    (synthesised(ALONE), VALUE, r"force=.*first harmonic"),
    (synthesised(WAVE, 1.0), TYPE, "force="),
    (synthesised(WAVE, errors=1), TYPE, "errors="),
    (synthesised(WAVE, over=LOADS), VALUE, "several along normal_load"),
    (synthesised(WAVE, **FEW), VALUE, "coefficient"),
    (synthesised(ALONE, parameter="normal_load", band=BAND, at=[1.5], amplitude=3e-4), VALUE,
     "over the amplitude, got those over normal_load"),
    (lambda: sh.datasets.synthesised_response(WAVE), TYPE, "modes="),
    (lambda: sh.other_branches(sh.frf(FORCED, (10, 30))), VALUE, "response: expected one that may"),
    (lambda: sh.other_branches(point()), TYPE, "response: expected a result of frf or follow"),
    (lambda: sh.other_branches(1), TYPE, "response=1"),
    (outputs({}), TYPE, r"outputs=\{\}: expected \{name: weights\}"),
    (outputs({"a b": [1, 0, 0]}), VALUE, "'a b' is no name"),
    (outputs({"peak_x": [1, 0, 0]}), VALUE, "begins as results"),
    (outputs({"a": [1, 0]}), VALUE, r"outputs\['a'\]: expected 3 weights .* got 2"),
    (outputs({"a": np.eye(2)}), VALUE, "expected 3 weights"),
    (outputs({"a": [1, np.nan, 0]}), VALUE, r"outputs\['a'\]"),
    (outputs({"a": sp.csr_array([[0, np.inf, 0]])}), VALUE, r"outputs\['a'\]"),
    (outputs({"a": {3: 1.0}}), VALUE, r"outputs\['a'\]"),
    (outputs({"a": {"tip:x": 1.0}}), KEY, r"outputs\['a'\]: 'tip:x' is no place"),
    (outputs({"a": {}}), TYPE, r"outputs\['a'\]=\{\}: expected \{dof: weight\}"),
    (outputs({"a": [0, 0, 0]}), VALUE, "not 0 in each row, row 0"),
    (outputs({"a": [1, 0, 0]}, None), TYPE, "units=None: expected text"),
    (outputs({"a": [1, 0, 0]}, {"a": "m", "b": "m"}), KEY, "'b'"),
    (lambda: sh.solve(OF_CONTACT, 10.0), VALUE, "'contact' needs a name of its own"),
    (lambda: FORCED.with_peaks_of("strain"), KEY, "strain"),
    (lambda: sh.datasets.output(point(), "strain"), KEY, "strain"),
    (campbell([100]), VALUE, "two or more"),
    (campbell(orders=[0]), VALUE, "orders=0"),
    (campbell(count=5), VALUE, "count=5"),
    (campbell(nodal_diameter=1), VALUE, "a whole structure has all of them"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "error", "words"), CALLS)
def test_it_is_named_with_its_value_and_what_is_allowed(call, error, words):
    with pytest.raises(error, match=words):
        call()
