"""What cannot be drawn is refused in words, and no figure is left."""

from collections.abc import Callable
from typing import Any

import hexahedra
import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from symhbm.continuation.status import Status
from tests.plot.test_same_pictures import (
    BLADE,
    DRIVEN,
    FREE,
    QUIET,
    RING,
    SECTORS_FORCE,
    result,
    sectors,
    tied,
)
from tests.problems import one_blade

FEW, OTHERS = (10, 20), slice(1, None)


def part(name: str, **chosen: Any) -> Callable[[], Any]:
    return lambda: result(name).isel(chosen)


def of(name: str, change: Callable[[Any], Any]) -> Callable[[], Any]:
    return lambda: change(result(name))


def without(name: str, variable: str) -> Callable[[], Any]:
    return of(name, lambda found: found.drop_vars(variable))


def unknown(name: str, *variables: str) -> Callable[[], Any]:
    return of(name, lambda found: found.assign({v: found[v] * np.nan for v in variables}))


def wider(name: str, dim: str) -> Callable[[], Any]:
    return of(name, lambda found: found.expand_dims({dim: 2}))


def lasting() -> xr.Dataset:
    """An undamped resonance, which has no motion."""
    model = one_blade(damping=0, normal_load=0)
    return sh.periodic_motion(sh.HarmonicBalance(model, sh.forces.PointForce()), 50 / np.pi)


def of_seven(place: int = 3) -> xr.Dataset:
    """Degrees of freedom of one blade, which are no disk."""
    blade = sh.Model(np.eye(7), 0.2 * np.eye(7), 4 * tied(7))
    return sh.solve(sh.HarmonicBalance(blade, sh.forces.PointForce(place)), 20.0)


def not_kept() -> xr.Dataset:
    small = sh.condense(sectors(), SECTORS_FORCE, (10, 40), **QUIET)
    return sh.solve(sh.HarmonicBalance(small, SECTORS_FORCE), 20.0)


def small_chain() -> xr.Dataset:
    rub = dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=10)
    chain = sh.Model(np.eye(5), np.eye(5), tied(5), contacts=[(3,)], **rub)
    force = sh.forces.PointForce(4)
    small = sh.condense(chain.with_outputs({"stress": {0: 1e11}}, "Pa"), force, FEW, **QUIET)
    return sh.frf(sh.HarmonicBalance(small, force), FEW, at=[15], **QUIET)


def many_rows() -> xr.Dataset:
    return xr.concat([result("swept")] * 20, "shroud.normal_load", data_vars="minimal")


def failed() -> xr.Dataset:
    """As a dataset is where nothing converges."""
    loads = result("loads")
    known = {
        name: values * np.nan
        for name, values in loads.data_vars.items()
        if values.dtype.kind == "f" and {"point", "peak"} & {*values.dims}
    }
    known["peak_kind"] = xr.full_like(loads.peak_kind, "")
    return loads.assign(known).assign(status=xr.full_like(loads.status, str(Status.NO_START)))


def cycles(*given: Any) -> xr.Dataset:
    return sh.limit_cycles(DRIVEN, *given, **QUIET)


def around() -> xr.Dataset:
    return sh.frf(RING, (60, 70), over={"engine_order": [1, 2]}, at=[65], **QUIET)


def mesh() -> sh.Model:
    return hexahedra.structure(hexahedra.block((1, 1, 1))[0])


TABLE = xr.DataArray(np.ones((2, 3)), dims=("dof", "frequency"))
VALUE, KEY, TYPE = ValueError, KeyError, TypeError
BY_NAME = "a number from 0 to 4, 'blade 0' to 'blade 4', or several"
NEAREST = "the nearest are 'tip'.* a label or a node .*directions as 'tip:x'"
BAD: list[tuple[str, Any, dict[str, Any], Any, str]] = [
    ("response", "loads", dict(place=3), VALUE, "place=3"),
    ("response", "loads", dict(ax=3), TYPE, "ax=3"),
    ("response", "loads", dict(scale="db"), VALUE, "scale='db'"),
    ("response", "loads", dict(unit="inch"), VALUE, "unit='inch'"),
    ("response", "loads", dict(harmonic=5), KEY, "'5' is no harmonic"),
    ("response", "loads", dict(measured=3), TYPE, r"measured=3: expected a dataset"),
    ("response", "loads", dict(colour="red"), TYPE, "colour"),
    ("response", "loads", dict(size="poster"), VALUE, "size='poster'"),
    ("response", "point", {}, KEY, "one point"),
    ("response", "ensemble", dict(place=5), VALUE, "place=5: expected an integer from 0 to 4"),
    ("response", "ensemble", dict(place=1.5), VALUE, "place=1.5"),
    ("response", "ensemble", dict(place="blade 5"), KEY, BY_NAME),
    ("response", "ensemble", dict(place="tip"), KEY, "place='tip': expected a number from 0 to 4"),
    ("response", "ensemble", dict(place=[]), VALUE, r"place=\[\]: expected a number"),
    ("response", "named", dict(place="tpi"), KEY, NEAREST),
    ("response", "named", dict(place="4:z"), KEY, "4 has x, y"),
    ("response", "named", dict(place=9), VALUE, "from 0 to 2; the node 9 is '9'"),
    ("response", small_chain, dict(place=4), VALUE, r"of the structure these are .* \[0, 3\]"),
    ("response", small_chain, dict(place="stress"), KEY, r"outputs \(stress\) are drawn by sym"),
    ("response", [], {}, VALUE, "at least one result"),
    ("response", ["loads", "levels"], dict(label="b"), VALUE, "label='b': expected None"),
    ("response", ("loads", "levels"), dict(label=["a"]), VALUE, "expected 2 names"),
    ("response", ("loads", "levels"), dict(label="ab"), VALUE, "expected 2 names"),
    ("response", ("loads", "over the load"), {}, VALUE, "expected results over the same axes"),
    ("response", ("many", part("many", normal_load=OTHERS)), {}, VALUE, "over the same values"),
    ("phase", "loads", dict(harmonic=2), VALUE, "harmonic=2"),
    ("phase", "loads", dict(place=4), VALUE, "place=4"),
    ("phase", "loads", dict(unit="mm"), VALUE, "unit='mm'"),
    ("phase", "ring", dict(place=[1, 2]), VALUE, r"place=\[1, 2\]: expected one degree of free"),
    ("transmissibility", "loads", {}, VALUE, "its base stands still"),
    ("campbell", "loads", {}, TYPE, "expected a result of campbell"),
    ("interference", "loads", {}, TYPE, "expected a result of campbell"),
    ("nonlinear_modes", "loads", {}, TYPE, "expected a result of nonlinear_modes"),
    ("envelope", "loads", {}, KEY, "'sample' is no dimension"),
    ("envelope", "point", {}, KEY, "one point"),
    ("envelope", "ensemble", dict(quantiles=(0.9, 0.1)), VALUE, "quantiles="),
    ("envelope", "ensemble", dict(quantiles=(0.1, 1.1)), VALUE, "quantiles="),
    ("envelope", "ensemble", dict(quantiles=0.5), VALUE, "quantiles=0.5"),
    ("envelope", "ensemble", dict(samples=7), VALUE, "samples=7"),
    ("envelope", "ensemble", dict(place=5), VALUE, "place=5"),
    ("envelope", "ensemble", dict(style="curves"), VALUE, "style='curves'"),
    ("envelope", wider("ensemble", "draw"), {}, VALUE, "dimension draw as well"),
    ("envelope", "ensemble", dict(tuned=part("ensemble")), VALUE, "tuned: dataset: expected one"),
    ("envelope", "ensemble", dict(tuned=part("over the load")), VALUE, "tuned: expected a curve"),
    ("envelope", "ensemble", dict(tuned=without("tuned", "amplitude")), KEY, "tuned: "),
    ("blades", TABLE, {}, VALUE, "frequency"),
    ("blades", TABLE[:, 0].rename(dof="sample"), {}, VALUE, "sample"),
    ("blades", np.nan * TABLE[:, 0], {}, VALUE, "finite"),
    ("blades", TABLE[:, 0].astype(str), {}, TYPE, "values="),
    ("blades", [1.0, 2.0], {}, TYPE, r"values=\[1.0, 2.0\]"),
    ("disk", "loads", {}, VALUE, "expected one parameter set"),
    ("disk", around, {}, VALUE, r"engine_order as well.*isel\(engine_order=0\)"),
    ("disk", "wheel", dict(at=200.0), VALUE, r"at=200.0: no curve has it; .* from 60 to 90 of"),
    ("disk", "wheel", dict(at=99), VALUE, "at=99"),
    ("disk", "wheel", dict(place=[0, 1]), VALUE, "at least three"),
    ("disk", "wheel", dict(place=[0, 1, 1]), VALUE, "different"),
    ("disk", "wheel", dict(place=[0, 1, 7]), VALUE, "place=7"),
    ("disk", "wheel", dict(place=3), VALUE, "place="),
    ("disk", "wheel", dict(place="abc"), KEY, "place="),
    ("disk", "wheel", dict(angle=np.nan), VALUE, "angle=nan"),
    ("disk", unknown("wheel", "coefficient"), dict(at=80.0), VALUE, "converged"),
    ("disk", part("wheel", dof=[0, 1, 3, 4], frequency=0), {}, VALUE, "expected all 5 blades, 1 "),
    ("disk", not_kept, {}, VALUE, r"7 are not in it .*places= of condense keeps them"),
    ("disk", of_seven, {}, VALUE, r"place=None: expected .*neither the model nor the force"),
    ("disk", "point", {}, VALUE, "a structure of 1 blade: expected at least three"),
    ("hysteresis", "loads", dict(contact=1), VALUE, "contact=1"),
    ("hysteresis", "loads", dict(contact=0.5), VALUE, r"contact=0\.5"),
    ("hysteresis", "loads", dict(contact="shroud"), KEY, "group of contacts"),
    ("hysteresis", lasting, {}, VALUE, "converged"),
    ("hysteresis", "opens", dict(contact=1), VALUE, r"contact=1: expected one with friction.*norm"),
    ("normal_force", "opens", dict(over="time"), VALUE, "over='time'"),
    ("normal_force", "point", {}, VALUE, r"expected one with a normal direction.*Coulomb.*'frict"),
    ("stick_map", "loads", dict(contact=-1), VALUE, "contact=-1"),
    ("stick_map", "loads", dict(contact="all"), VALUE, "contact='all'"),
    ("stick_map", "loads", dict(over="mass"), KEY, "'mass' is no swept dimension"),
    ("stick_map", "point", {}, KEY, "frequency"),
    ("stick_map", part("grid", normal_load=0), {}, VALUE, "this is one"),
    ("stick_map", part("grid", normal_load=[0, 1, 1]), {}, VALUE, "twice"),
    ("stick_map", "folding", dict(over="sample"), VALUE, "do not fold"),
    ("stick_map", wider("ensemble", "case"), dict(over="sample"), VALUE, "dimension case as well"),
    ("states", many_rows, {}, VALUE, "at most 40 rows, got 120"),
    ("states", "swept", dict(contact=3), VALUE, "contact=3"),
    ("states", "point", dict(contact=1), VALUE, "contact=1"),
    ("contact_map", wider("six", "case"), dict(at=18.0), VALUE, "it is along case"),
    ("contact_map", without("six", "contact_x"), dict(at=18.0), KEY, "contact_x"),
    ("contact_map", "six", dict(variable="dissipated", at=18.0), KEY, "dissipated"),
    ("contact_map", 3, {}, TYPE, "Dataset"),
    ("nonlinear_modes", BLADE, {}, TYPE, "dataset="),
    ("nonlinear_modes", "modes", dict(over="time"), VALUE, "over='time'"),
    ("limit_cycles", cycles, {}, TYPE, "over a parameter"),
    ("limit_cycles", lambda: cycles("damping", (-30, 0), [-1.0]), {}, VALUE, "grid"),
    ("limit_cycles", lambda: cycles("damping", (-50, -40)), {}, VALUE, "no limit cycle"),
    ("limit_cycles", FREE, {}, TYPE, "dataset="),
    ("next_measurements", xr.Dataset({"a": 1.0}), {}, TYPE, "a result of next_measurements"),
    ("model", 3, {}, TYPE, "structure=3: expected a Model"),
    ("model", sh.forces.PointForce(), {}, TYPE, "expected a Model, or a HarmonicBalance"),
    ("model", one_blade(), dict(force=3), TYPE, "force=3: expected an excitation"),
    ("model", one_blade(), dict(force=sh.forces.PointForce), TYPE, "expected an excitation"),
    ("model", one_blade(), dict(force=one_blade()), TYPE, "expected an excitation"),
    ("model", one_blade(), dict(force=sh.forces.PointForce(4)), VALUE, "place=4"),
    ("model", one_blade(), dict(ax=3), TYPE, "ax=3"),
    ("model", one_blade(), dict(sets=["tip"]), VALUE, "expected a structure whose places have a m"),
    ("model", mesh, dict(sets=["tip"]), KEY, "'tip' is no set of nodes"),
    *((kind, 3, {}, TYPE, "dataset=3") for kind in ("response", "envelope", "disk", "hysteresis")),
    *((kind, without("loads", "amplitude"), {}, KEY, "'amplitude' is no variable")
      for kind in ("response", "envelope")),
    *((kind, without("loads", "coefficient"), {}, KEY, "'coefficient' is no variable")
      for kind in ("disk", "hysteresis")),
    ("hysteresis", without("loads", "normal_load"), {}, KEY, "'normal_load' is no variable"),
    ("stick_map", without("loads", "stick_fraction"), {}, KEY, "'stick_fraction' is no variable"),
    *((kind, part("loads", dof=0), {}, KEY, "'dof' is no dimension")
      for kind in ("response", "hysteresis", "disk")),
    *((kind, part("loads", contact=0), {}, KEY, "'contact' is no dimension")
      for kind in ("hysteresis", "stick_map")),
    *((kind, failed, {}, VALUE, r"converged point.*no response was found")
      for kind in ("response", "hysteresis", "stick_map")),
    ("envelope", lambda: failed().rename(normal_load="sample"), {}, VALUE, "no response was found"),
]  # fmt: skip


def made(what: Any) -> Any:
    """A result by its name, several of them, or what a function makes."""
    if isinstance(what, str) or callable(what):
        return result(what) if isinstance(what, str) else what()
    if isinstance(what, list) and all(isinstance(one, str) for one in what):
        return {name: result(name) for name in what} or what
    return [*map(made, what)] if isinstance(what, tuple) else what


@pytest.mark.filterwarnings("ignore:.*no limit cycle was found")
@pytest.mark.parametrize(("kind", "what", "options", "error", "words"), BAD)
def test_what_cannot_be_drawn_is_refused(kind, what, options, error, words):
    given = {key: made(one) if callable(one) and key == "tuned" else one for key, one in
             options.items()}  # fmt: skip
    what = made(what)
    with pytest.raises(error, match=words):
        getattr(sh.plot, kind)(what, **given)
    assert plt.get_fignums() == []
