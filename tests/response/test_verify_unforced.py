"""Archives of nonlinear modes and limit cycles verify themselves; each damage is told."""

import json
from functools import cache

import numpy as np
import pytest

import symhbm as sh
from symhbm.response import summary
from tests.problems import one_blade, ring_of_blades
from tests.quick import quick_first

QUIET = dict(progress=False)
LOADS = {"normal_load": [1.0, 3.0]}


def blade(damping, harmonics=(1, 3, 5)):
    return sh.HarmonicBalance(one_blade(damping=damping), harmonics=harmonics)


def ring(damping):
    return sh.HarmonicBalance(ring_of_blades(5, damping=damping), harmonics=(1, 3))


def disk():
    sector = sh.Model([[1.0, 0], [0, 0]], [[0.5, 0], [0, 0]], [[3e4, -2e4], [-2e4, 2e4]])
    rubs = sh.Friction(
        tangential=(0,), contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3
    )
    air = sh.Influence({0: 1.0}, {-1: 300j, 0: -200j, 1: -250j}, frequency=30)
    whole = sh.Sector(sector, left=[0], right=[1], n_sectors=12).with_contacts(root=rubs)
    return sh.HarmonicBalance(whole.with_influences(air), harmonics=(1, 3))


def on_stop():
    """A blade that leans on a stop under a static load, and rubs."""
    stop = sh.Gap(normal=(0,), normal_stiffness=2e4, normal_load=10.0)
    rubs = sh.Contacts(
        sh.laws.Coulomb(), [(0,)], contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3
    )
    model = sh.Model([[1.0]], [[2.0]], [[1e4]], contacts={"stop": stop, "rubs": rubs})
    force = sh.forces.HarmonicForce(cosine={0: [2.0], 1: [5.0]})
    return sh.HarmonicBalance(model, force, harmonics=range(6))


def cubic():
    """Two masses, one on a cubic spring."""
    model = sh.Model(
        np.eye(2), 0 * np.eye(2), [[2.0, -1.0], [-1.0, 2.0]], contacts=[(0,)], cubic_stiffness=0.5
    )
    return sh.HarmonicBalance(model, harmonics=(1, 3, 5))


CASES = {
    "mode": lambda: sh.nonlinear_modes(blade(0.5), over=LOADS, **QUIET),
    "mode at": lambda: sh.nonlinear_modes(blade(0.5), at=[1e-4, 3e-4, 1e-3], over=LOADS, **QUIET),
    "cycles": lambda: sh.limit_cycles(blade(-0.5), over=LOADS, **QUIET),
    "wave": lambda: sh.nonlinear_modes(ring(0.5), band=(1e-5, 1e-3), nodal_diameter=2, **QUIET),
    "wave of a sector": lambda: sh.nonlinear_modes(
        disk(), band=(1e-5, 1e-3), nodal_diameter=-3, **QUIET
    ),
    "stop": lambda: sh.nonlinear_modes(
        on_stop(), band=(1e-4, 0.1), over={"force_amplitude": [0.5, 1.0]}, **QUIET
    ),
    "cycles over": lambda: sh.limit_cycles(
        blade(-0.5), "damping", (-30, 0), stability=True, over=LOADS, **QUIET
    ),
    "cycles at": lambda: sh.limit_cycles(
        blade(-0.5), "damping", (-30, 0), at=[-28, -20, -1], **QUIET
    ),
    "cycles of a wave": lambda: sh.limit_cycles(
        ring(-0.5), "damping", (-40.0, -0.5), nodal_diameter=1, **QUIET
    ),
    "cycles of a sector": lambda: sh.limit_cycles(disk(), nodal_diameter=-3, **QUIET),
    "cubic": lambda: sh.nonlinear_modes(cubic(), mode=1, band=(1e-2, 1.0), **QUIET),
}
WITHOUT_EXACT = {"wave of a sector", "cubic", "cycles of a sector"}


@cache
def dataset(case):
    return CASES[case]()


def report(verified):
    return json.loads(verified.attrs["verification"])


def verified(ds, **options):
    return sh.verify(ds, **dict(exact="none", progress=False) | options)


@pytest.mark.parametrize("case", quick_first(CASES, 3))
def test_sound_archives_pass(tmp_path, case):
    original = dataset(case)
    loaded = sh.load(sh.save(original, tmp_path / "archive.nc"))
    checked = verified(loaded, exact=2)
    result = report(checked)
    assert result["passed"], summary(checked)
    assert result["n_checked"] == int(original.converged.sum()) > 0
    # Round-off, hundreds of times below the bounds.
    assert float(checked.residual_stored.max()) < 5e-12
    assert float(checked.energy_error.max()) < 2e-11
    assert 0 < float(checked.residual_larger.max()) < 0.1
    on_grid, n_events = case.endswith(" at"), int((original.event_kind != "").sum())
    assert result["n_events"] == (0 if on_grid else n_events)
    assert ("events not verified" in summary(checked)) == on_grid
    assert ("event_mismatch" in checked) == (result["n_events"] > 0)
    assert not result["n_events"] or float(checked.event_mismatch.max()) == 0
    assert ("fold_mismatch" in checked) == (
        case in ("cycles over", "cycles at", "cycles of a wave")
    )
    if case in WITHOUT_EXACT:
        assert result["n_exact"] == 0
        assert "not against the exact motion: " in summary(checked)
    else:
        assert result["n_exact"] == 2
        assert 0 < float(checked.exact_difference.max()) < 2e-3
    again = sh.load(sh.save(checked, tmp_path / "verified.nc"))
    assert summary(again) == summary(checked)


@pytest.mark.slow
def test_exact_difference_is_that_of_more_harmonics():
    """One harmonic against many: frequencies known to ten digits, and what is left of either."""
    amplitudes, one, many = [1e-4, 3e-4, 6e-4], (1,), tuple(range(1, 42, 2))
    few, fine = (
        verified(sh.nonlinear_modes(blade(0.5, h), at=amplitudes, **QUIET), exact="all")
        .isel(solution=0)
        .exact_difference.values
        for h in (one, many)
    )
    truncation = 122.5968696 / 122.4744871 - 1
    assert few[1] == pytest.approx(truncation, rel=0.1)  # of the amplitude of one harmonic
    assert few[0] < 1e-12  # contacts stick: the mode is linear
    assert (fine < 1e-6).all()
    cycles = [
        verified(sh.limit_cycles(blade(-0.5, h), **QUIET), exact="all").exact_difference
        for h in (one, many)
    ]
    assert float(cycles[1].max()) < 1e-2 * float(cycles[0].max())


# Damage


def changed(ds, name, index, value):
    ds = ds.copy(deep=True)
    values = np.array(ds[name].values)
    values[index] = value(values[index])
    return ds.assign_coords({name: (ds[name].dims, values)}) if name in ds.coords else ds.assign(
        {name: (ds[name].dims, values, ds[name].attrs)}
    )  # fmt: skip


def by(factor):
    return lambda value: value * factor


def to(text):
    return lambda value: text


DAMAGE = {
    "amplitude of a mode": ("mode", "amplitude", (1, 12), by(1 + 1e-6), "amplitude_mismatch"),
    "amplitude of a grid": ("mode at", "amplitude", (1,), by(1 + 1e-6), "amplitude_mismatch"),
    "frequency": ("mode", "frequency", (1, 12), by(1 + 1e-6), "residual_stored"),
    "damping ratio": ("mode", "damping_ratio", (1, 40), by(1 + 1e-6), "residual_stored"),
    "damping ratio as energy": ("mode", "damping_ratio", (1, 40), by(1 + 1e-6), "energy_error"),
    "no damping ratio": ("mode", "damping_ratio", (1, 3), by(0.0), "energy_error"),
    "coefficient": ("mode", "coefficient", (1, 40, 0, 1, 0), by(1 + 1e-4), "residual_stored"),
    "modal amplitude": ("wave", "modal_amplitude", (4,), by(1 + 1e-6), "amplitude_mismatch"),
    "displacement": ("wave", "largest_displacement", (4, 2), by(1 + 1e-6), "amplitude_mismatch"),
    "one sector": ("wave", "coefficient", (4, 3, 0, 0), by(1 + 1e-6), "residual_stored"),
    "contact state": ("wave", "contact_state", (4, 3), to(1), "contact_mismatch"),
    "dissipation": ("mode", "dissipation", (1, 40, 0), by(1 + 1e-4), "contact_mismatch"),
    "cycle": ("cycles", "coefficient", (1, 1, 0, 0, 0), by(1 + 1e-6), "residual_stored"),
    "amplitude of a cycle": ("cycles", "amplitude", (1, 1), by(1 + 1e-6), "amplitude_mismatch"),
    "growth rate": ("cycles", "growth_rate", (1, 1), by(1.01), "stability_mismatch"),
    "stability": ("cycles", "stability", (1, 1), to(1), "stability_mismatch"),
    "unknown stability": ("cycles over", "stability", (1, 3), to(-1), "stability_mismatch"),
    "parameter": ("cycles over", "damping", (1, 12), by(1 + 1e-6), "residual_stored"),
    "amplitude on a branch": ("cycles over", "amplitude", (1, 12), by(1.001), "amplitude_mismatch"),
    "value of a grid": ("cycles at", "damping", (1,), by(1 + 1e-4), "residual_stored"),
    "event": ("mode", "event_amplitude", (1, 0), by(1 + 1e-6), "event_mismatch"),
    "frequency of an event": ("mode", "event_frequency", (1, 1), by(1 + 1e-8), "event_mismatch"),
    "damping of an event": ("mode", "event_damping_ratio", (1, 1), by(1.001), "event_mismatch"),
    "event that ends": ("mode", "event_kind", (1, 0), to("end of slip"), "event_mismatch"),
    "event of no kind": ("mode", "event_kind", (1, 0), to("nothing"), "event_mismatch"),
    "turn that is an onset": ("mode", "event_kind", (1, 1), to("onset of slip"), "event_mismatch"),
    "onset that is a fold": ("mode", "event_kind", (1, 0), to("fold"), "event_mismatch"),
    "contact of an event": ("stop", "event_contact", (1, 0), lambda c: 1 - c, "event_mismatch"),
    "contact there is not": ("wave", "event_contact", (0,), to(9), "event_mismatch"),
    "fold event": ("cycles over", "event_damping", (1, 0), by(1 + 1e-6), "event_mismatch"),
    "fold": ("cycles over", "fold_damping", (1,), by(1 + 1e-6), "fold_mismatch"),
    "no fold": ("cycles over", "fold_damping", (1,), by(np.nan), "fold_mismatch"),
    "fold of a grid": ("cycles at", "fold_damping", (), by(1 + 1e-6), "fold_mismatch"),
    "fold of a wave": ("cycles of a wave", "fold_damping", (), to(-1.0), "fold_mismatch"),
}


@pytest.mark.parametrize("damage", quick_first([*DAMAGE][::2] + [*DAMAGE][1::2], 4))
def test_damage_is_named_at_its_place(damage):
    case, name, index, value, figure = DAMAGE[damage]
    ds = changed(dataset(case), name, index, value)
    assert not ds.identical(dataset(case))
    checked = verified(ds)
    result = report(checked)
    assert not result["passed"]
    entry = result["figures"][figure]
    assert entry["broken"], summary(checked)
    if "normal_load" in ds[name].dims:  # a value of the grid is that of all loads
        assert entry["at"]["normal_load"] == 3.0
    inner = "event" if name.startswith("event") else "point"
    if inner in entry["at"] and index:
        assert entry["at"][inner] == index[-1 if name in ds.coords else ds[name].dims.index(inner)]


def test_stop_events_are_of_their_contacts():
    """Without both contacts there would be nothing to mix up."""
    kinds = dataset("stop").isel(force_amplitude=1).event_kind.values
    assert {"onset of slip", "onset of opening"} <= {*kinds}


def test_what_was_left_out_is_told():
    kept = sh.nonlinear_modes(blade(0.5), keep=["frequency", "damping_ratio"], **QUIET)
    with pytest.raises(
        sh.datasets.ArchiveError, match=r"nothing to verify, .*coefficient.* by keep=$"
    ):
        sh.verify(kept)
    names = ["coefficient", "frequency", "damping_ratio", "residual_norm"]
    few = verified(sh.nonlinear_modes(blade(0.5), keep=names, **QUIET), exact=1)
    result = report(few)
    assert result["passed"]
    assert "contact_mismatch" not in few
    assert "contact_state" in result["missing"]
    assert "not verified for want of" in summary(few)


def test_no_cycles_pass_nothing():
    found = sh.limit_cycles(blade(0.5), **QUIET)
    assert report(verified(found))["n_checked"] == 0
    assert not report(verified(found))["passed"]


def test_synthesised_responses_are_none_of_these():
    near = sh.datasets.synthesised_response(
        sh.nonlinear_modes(blade(0.5), at=[3e-4], **QUIET), sh.forces.PointForce(), errors=False
    )
    with pytest.raises(ValueError, match="dataset"):
        sh.verify(near)
