"""Pictures as data are those of before: lines, marks, texts, axes and looks, kind by kind."""

import warnings
from collections.abc import Callable
from functools import cache, partial
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_hex

import symhbm as sh
from symhbm.plot.rendering import drawn
from tests.calculix import DATA
from tests.measurements import measured_responses
from tests.problems import chain, duffing, one_blade, ring_of_blades
from tests.stored.shown import read, same, told

QUIET = dict(progress=False)
BLADE = sh.HarmonicBalance(one_blade(), sh.forces.PointForce(), (1, 3))
FREE = sh.HarmonicBalance(one_blade(), harmonics=(1, 3))
STIFFER = BLADE.with_parameters(stiffness=1.2e4)
FIRST = FREE.with_harmonics((1,))
DRIVEN = FREE.with_parameters(damping=-0.5)
DISK = ring_of_blades(5, contact_stiffness=1e5, normal_load=[9.0, 11, 10, 8, 12])
RING = sh.HarmonicBalance(DISK, sh.forces.EngineOrder(2))
FORCE = sh.forces.HarmonicForce(cosine={1: [10, 0, 4]}, sine={1: [0, 10, 0]})
TIPS = tuple(range(2, 21, 3))
SECTORS_FORCE = sh.forces.EngineOrder(2, amplitude=1.0, places=TIPS)
OF_CHAIN = sh.forces.HarmonicForce(cosine={1: {0: 1.0, 3: 0.5}}, sine={1: {1: 0.6}})
RUB = dict(contact_stiffness=1e4, friction_coefficient=0.3)
LOADS, LEVELS = {"normal_load": [1.0, 3.0, 6.0]}, {"force_amplitude": [0.5, 2.0]}
BAND, GRID, WIDE = (10, 30), np.linspace(14, 24, 6), (60, 95)
SPRINGS = {"cubic_stiffness": xr.DataArray([0.08, 0.1, 0.13], dims="sample")}
MASSES = xr.DataArray([0.9, 1.0, 1.1], dims="sample")
SHAKEN = {"force_amplitude": [1e-5, 2e-5]}
HELD, MANY = (1e-6, 4e-4), {"normal_load": np.geomspace(0.1, 9, 16)}


def tied(n: int) -> Any:
    """Springs of masses one behind the other, whose ends the ground holds."""
    return 1e4 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))


def three_contacts() -> sh.HarmonicBalance:
    """Friction that presses, a stop and plain friction of one structure."""
    contacts = {
        "shroud": sh.Friction(
            tangential=(0,), normal=(1,), normal_stiffness=1e4, normal_load=5.0, **RUB
        ),
        "stop": sh.Gap(normal=(2,), normal_stiffness=2e4, gap=2e-3),
        "root": sh.Friction(tangential=(2, 0), normal_load=2.0, **RUB),
    }
    matrices = np.eye(3), np.diag([2.0, 3.0, 2.0]), np.diag([1.5e4, 2.25e4, 1.2e4])
    return sh.HarmonicBalance(sh.Model(*matrices, contacts=contacts), FORCE, range(4))


def base() -> sh.HarmonicBalance:
    isolator = sh.Model([[1.0]], [[10.0]], [[1e4]])
    return sh.HarmonicBalance(isolator, sh.forces.BaseMotion(displacement=1e-3))


def named() -> sh.HarmonicBalance:
    places = sh.Places(node=[4, 4, 9], direction=["x", "y", "x"], label=["tip", "tip", ""])
    model = sh.Model(np.eye(3), 0.5 * np.eye(3), tied(3), places=places)
    return sh.HarmonicBalance(model, sh.forces.PointForce("tip:y"))


def rub_of_six() -> sh.HarmonicBalance:
    points = np.array([[0.5, x, y] for y in (0.0, 0.01) for x in (0.0, 0.01, 0.02)])
    rubs = dict(contacts=[(i,) for i in range(6)], normal_load=[0.1, 9, 0.2, 9, 0.1, 9], **RUB)
    places = sh.Places(np.arange(6), "x", points)
    model = sh.Model(np.eye(6), np.eye(6), 1e4 * np.eye(6), places=places, **rubs)
    return sh.HarmonicBalance(model, sh.forces.HarmonicForce(cosine={1: np.ones(6)}))


def sectors(n: int = 7) -> sh.Model:
    """A ring of sectors of a root, a middle and a tip; roots rub on each other."""
    blade = np.array([[1.5e5, -4e4, 0], [-4e4, 8e4, -4e4], [0, -4e4, 4e4]])
    next_one, size = np.roll(np.eye(n), 1, axis=0), 3 * n
    stiffness = np.kron(np.eye(n), blade)
    stiffness -= 1e4 * np.kron(next_one + next_one.T, np.diag([1.0, 0, 0]))
    pairs = [(root, (root + 3) % size) for root in range(0, size, 3)]
    return sh.Model(np.eye(size), 0.2 * np.eye(size), stiffness, pairs, normal_load=1.0, **RUB)


def wheel(condensed: bool) -> sh.HarmonicBalance:
    model: Any = sectors()
    if condensed:
        model = sh.condense(model, SECTORS_FORCE, (10, 40), places=TIPS, **QUIET)
    return sh.HarmonicBalance(model, SECTORS_FORCE)


FOURTH = xr.DataArray(np.arange(5) == 4, dims="dof")


def stopped(found: xr.Dataset) -> xr.Dataset:
    """Curves that end on their way."""
    return found.assign(status=xr.full_like(found.status, str(sh.Status.MINIMUM_STEP)))


def samples(problem: Any = RING) -> Any:
    return sh.mistuning.uniform(problem, 6, seed=5, normal_load=0.3)


def ranked(engine_order: Any = (3, 3, 3)) -> xr.Dataset:
    table: Any = {"candidate_force_amplitude": ("candidate", [2.0, 8.0, 1.0])}
    table["candidate_engine_order"] = "candidate", [*engine_order]
    table["expected_error"] = ("candidate", "unknown"), [[0.1, 5], [0.2, 6], [0.3, 7]]
    table |= {"estimate": ("unknown", [-2.0, 100.0]), "standard_error": ("unknown", [1.0, 10.0])}
    return xr.Dataset(table, {"unknown": ["normal_load", "damping"]})


def blown(found: xr.Dataset) -> xr.Dataset:
    """Some samples without any number, or without one, and one that waits."""
    amplitude = found.amplitude.copy(deep=True)
    amplitude[1], amplitude[3, 2:4], amplitude[:, 5] = np.nan, np.nan, np.nan
    status = found.status.where(np.arange(6) < 5, str(sh.Status.NOT_STARTED))
    return found.assign(amplitude=amplitude, status=status)


def cut(found: xr.Dataset) -> xr.Dataset:
    """A path that ends in the middle, and one with a hole."""
    amplitude, frequency = found.amplitude.copy(deep=True), found.frequency.values.copy()
    frequency[2, int(np.searchsorted(frequency[2], 75.0)) :] = np.nan
    amplitude[4, 6] = np.nan
    return found.assign(amplitude=amplitude).assign_coords(
        frequency=(("sample", "point"), frequency)
    )


def twice(found: xr.Dataset) -> xr.Dataset:
    """Two solutions from a frequency on."""
    second = (0.5 * found.amplitude).where(found.frequency > 80)
    both = xr.concat([found.amplitude, second], "solution")
    return found.drop_vars("amplitude").assign(amplitude=both)


def holed(found: xr.Dataset) -> xr.Dataset:
    known = (found.frequency != 20) | (found.normal_load != 3)
    return found.assign(stick_fraction=found.stick_fraction.where(known))


def missing(found: xr.Dataset) -> xr.Dataset:
    known = found.flutter_limit.where(found.normal_load != found.normal_load[2])
    return found.assign(flutter_limit=known)


def of_sectors() -> Any:
    sheet = sh.Model([[1, 0], [0, 0.0]], [[0.1, 0], [0, 0.0]], [[3e4, -2e4], [-2e4, 2e4]])
    return sh.campbell(sh.Sector(sheet, [0], [1], 24), [200, 900], orders=range(1, 8), count=1)


def whirling() -> Any:
    skew = 2 * np.array([[0.0, -1], [1, 0]])
    runs = {s: 1e4 * np.eye(2) - (np.pi * s / 30) ** 2 * np.eye(2) for s in (0, 300)}
    model = sh.Model(np.eye(2), 0.5 * np.eye(2), 1e4 * np.eye(2))
    return sh.campbell(sh.RotatingModel(model, runs, coriolis=skew), [0, 600, 900], orders=[1, 4])


RESULTS: dict[str, Callable[[], Any]] = {
    "loads": lambda: sh.frf(BLADE, BAND, over=LOADS, **QUIET),
    "grid": lambda: sh.frf(BLADE, BAND, at=GRID, over=LOADS, **QUIET),
    "many": lambda: sh.frf(BLADE, BAND, at=GRID[:2], over=MANY, **QUIET),
    "over many": lambda: sh.frf(STIFFER, BAND, at=GRID[:2], over=MANY, **QUIET),
    "two": lambda: sh.frf(BLADE, BAND, at=GRID, over=LOADS | {"damping": [0.5, 1.0]}, **QUIET),
    "levels": lambda: sh.frf(BLADE, BAND, over=LEVELS, **QUIET),
    "point": lambda: sh.solve(BLADE, 18.0),
    "motion": lambda: sh.periodic_motion(BLADE, 18.0, n_angles=64),
    "folds": lambda: sh.frf(duffing(), (0.08, 0.32), stability=True, **QUIET),
    "over the load": lambda: sh.follow(BLADE, "normal_load", (0.5, 50), frequency=19.5, **QUIET),
    "ring": lambda: sh.frf(RING, WIDE, peaks="each", **QUIET),
    "wheel": lambda: sh.frf(RING, (60, 90), at=[60, 70, 80, 90], **QUIET),
    "of sectors": lambda: sh.solve(wheel(False), 20.0),
    "of few": lambda: sh.solve(wheel(True), 20.0),
    "turning": lambda: sh.limit_cycles(DRIVEN, "mass", (0.5, 2.0), **QUIET),
    "ensemble": lambda: sh.frf(RING, WIDE, at=np.linspace(60, 95, 8), over=samples(), **QUIET),
    "paths": lambda: sh.frf(RING, WIDE, over=samples(), **QUIET),
    "folding": lambda: sh.frf(duffing(), (0.08, 0.32), over=SPRINGS, **QUIET),
    "followed": lambda: sh.follow(
        RING, "normal_load", (1, 100), frequency=75.0, over={"mass": MASSES}, **QUIET
    ),
    "tuned": lambda: sh.frf(RING.with_parameters(normal_load=10.0), WIDE, **QUIET),
    "named": lambda: sh.frf(named(), (5, 40), at=np.linspace(5, 40, 8), **QUIET),
    "opens": lambda: sh.solve(three_contacts(), 27.0),
    "wave": lambda: sh.solve(RING, 75.0),
    "swept": lambda: sh.frf(
        three_contacts(), (14, 34), at=np.linspace(14, 34, 6),
        over={"shroud.normal_load": [1.0, 20.0]}, **QUIET,
    ),
    "six": lambda: sh.frf(rub_of_six(), (18, 19), at=[18, 19], **QUIET),
    "planar": lambda: sh.solve(
        sh.HarmonicBalance(chain("pressed"), OF_CHAIN, (0, 1, 2, 3)), 24.0
    ),
    "base": lambda: sh.frf(base(), (5, 60), **QUIET),
    "base levels": lambda: sh.frf(base(), (5, 60), at=[5, 9], over=SHAKEN, **QUIET),
    "modes": lambda: sh.nonlinear_modes(FREE, over=LOADS, **QUIET),
    "modes over": lambda: sh.nonlinear_modes(FREE, "normal_load", (1, 9), amplitude=3e-4, **QUIET),
    "cycles": lambda: sh.limit_cycles(
        DRIVEN, "damping", (-30, -0.1), stability=True, over={"normal_load": [1.0, 3.0]}, **QUIET
    ),
    "limits": lambda: sh.flutter_limit(
        FIRST, "normal_load", (1, 9), [1, 2, 4, 9], amplitudes=HELD, disturbance=[1e-6, 1e-4],
        **QUIET,
    ),
    "held": lambda: sh.maximise_flutter_limit(FIRST, "normal_load", (1, 9), HELD, **QUIET),
    "peaks": lambda: sh.peak_curve(BLADE, "normal_load", (1, 6), frequency_band=BAND, **QUIET),
    "front": lambda: sh.pareto_front(
        BLADE, "normal_load", (1, 6), BAND, n_points=3, **QUIET,
        aims={"peak [m]": lambda p, _: p["largest"], "load": lambda _, q: q["normal_load"][0]},
    ),
}  # fmt: skip


@cache
def result(name: str) -> Any:
    return RESULTS[name]()


def draw(kind: str, of: Any, *given: Any, **options: Any) -> Callable[[], Any]:
    """The picture of a result by its name, of several, or of what a function makes."""

    def made() -> Any:
        what = of() if callable(of) else result(of) if isinstance(of, str) else of
        if isinstance(of, list):
            what = {name: result(name) for name in of}
        more = {key: one() if callable(one) else one for key, one in options.items()}
        return getattr(sh.plot, kind).picture(what, *given, **more)

    return made


def measured() -> Any:
    return measured_responses(BLADE, [0.5, 2.0], [14.0, 17.0, 20.0])


def accelerations() -> Any:
    given: Any = dict(units="m s-2", form="magnitude", force_amplitude=2.0)
    return sh.datasets.measured([14.0, 20.0], [1.0, 2.0], left_out=[False, True], **given)


def of_peaks() -> Any:
    return sh.datasets.measured(18.0, 5e-4, units="m", form="peak", force_amplitude=2.0)


def of_modes() -> Any:
    given: Any = dict(units="mm", form="mode", amplitude=[0.2, 1])
    return sh.datasets.measured([20.0, 17.0], [0.1, 0.08], **given)


def least_stick() -> xr.DataArray:
    return result("ensemble").stick_fraction.min("frequency").rename("least stick")


def condensed() -> sh.HarmonicBalance:
    whole = sh.Model(np.eye(9), 0.1 * np.eye(9), tied(9), [(1,), (4, 6)], normal_load=3.0, **RUB)
    force = sh.forces.PointForce(3)
    return sh.HarmonicBalance(sh.condense(whole, force, (5, 30), places=[8], **QUIET), force)


def uneven() -> sh.Model:
    """Couplings of all kinds that are no springs and dampers."""
    stiffness, off = tied(4), np.eye(4, k=1)
    stiffness[0, 2] = stiffness[2, 0] = 3e3
    damping, mass = np.eye(4) + 0.2 * (off - off.T), np.eye(4) + 0.1 * (off + off.T)
    return sh.Model(mass, damping, stiffness, contacts=[(0,)], normal_load=3.0, **RUB)


def meshed() -> Any:
    with warnings.catch_warnings(action="ignore"):
        jobs = [DATA / "brick8" / f"{job}.inp" for job in ("still", "waves")]
        model = sh.read_structure(jobs)
    tip = f"{model.places.nodes_of('tip')[0]}:y"
    disk = sh.Sector(model, "left", "right", 6, rotation="z")
    disk = disk.with_contacts(joint=sh.Friction(tangential=(tip,), normal_load=1, **RUB))
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(2, pattern={tip: 3.0}))


def plate() -> sh.Model:
    n, eye = 12, np.eye(12)
    stiffness = np.kron(eye, tied(n)) + np.kron(tied(n), eye)
    mass = np.eye(n * n)
    contacts = [(0,), (11,), (95, 115)]
    return sh.Model(mass, 0.1 * mass, stiffness, contacts=contacts, normal_load=3.0, **RUB)


OPENED = ring_of_blades(
    7, normal_load=[3, 3, 0, 3, 3, 3, 2], stiffness=1e4 + np.arange(7), cubic_stiffness=1e8,
    contact_stiffness=[1e4] * 4 + [0.0] + [1e4] * 2, friction_coefficient=[0.5] * 6 + [0.0],
)  # fmt: skip
WAVES = sh.forces.HarmonicForce(cosine={1: [1, 0, 0, 3, 0]}, sine={3: [0, 0, 2, 4, 0]}, amplitude=2)
LINE = sh.Model(
    np.diag([1, 1, 0, 1, 1]), 0.5 * np.eye(5) + 1e-5 * tied(5), tied(5), contacts=[(1,), (3, 4)],
    normal_load=[3, 5], **RUB,
)  # fmt: skip
PICTURES: dict[str, Callable[[], Any]] = {
    "response": draw("response", "loads"),
    "response, linear": draw("response", "loads", scale="linear", unit="mm", annotate=True),
    "response, log": draw("response", "grid", scale="log", unit="um", peaks=False),
    "response, harmonic": draw("response", "grid", harmonic=3),
    "response of many": draw("response", "many"),
    "response of two": draw("response", "two"),
    "response of samples": draw("response", "paths"),
    "response, measured": draw("response", "levels", measured=measured),
    "response, measured accelerations": draw("response", "levels", measured=accelerations),
    "response, measured peaks": draw("response", "levels", measured=of_peaks),
    "response that stops": draw("response", lambda: stopped(result("loads"))),
    "response that folds": draw("response", "folds"),
    "response over a load": draw("response", "over the load"),
    "response of a blade": draw("response", "ring", place="blade 3"),
    "response of blades": draw("response", "ring", place=["blade 1", 4]),
    "response of a node": draw("response", "named", place="tip"),
    "response of a place": draw("response", "named", place="9:x"),
    "responses": draw("response", ["loads", "levels"]),
    "responses of grids": draw("response", ["many", "over many"]),
    "response of a base": draw("response", "base"),
    "bode": draw("bode", "loads"),
    "bodes": draw("bode", ["loads", "levels"]),
    "loops": draw("hysteresis", ["point", "motion"]),
    "response of base levels": draw("response", "base levels"),
    "phase": draw("phase", "grid", harmonic=3, unit="rad"),
    "nyquist": draw("nyquist", "levels", unit="mm"),
    "phase portrait": draw("phase_portrait", "motion"),
    "phase portraits": draw("phase_portrait", "loads"),
    "transmissibility": draw("transmissibility", "base", scale="log"),
    "backbone of modes": draw("backbone", "modes", scale="linear"),
    "backbone of peaks": draw("backbone", "levels"),
    "backbone over a load": draw("backbone", "peaks"),
    "envelope": draw("envelope", "ensemble", place=3, quantiles=(0.25, 0.75), samples=2),
    "envelope, tuned": draw("envelope", "paths", tuned=partial(result, "tuned"), scale="linear"),
    "envelope with holes": draw("envelope", lambda: blown(result("ensemble"))),
    "envelope of paths that end": draw("envelope", lambda: cut(result("paths")), samples=6),
    "envelope of several solutions": draw("envelope", lambda: twice(result("ensemble"))),
    "envelope that folds": draw("envelope", "folding", extremes=False),
    "envelope over a load": draw("envelope", "followed"),
    "density": draw("envelope", "ensemble", style="density"),
    "blades": draw("blades", lambda: result("ensemble").amplitude.max("frequency")),
    "blades of one": draw("blades", lambda: least_stick().isel(sample=0).where(GRID[0] > 0)),
    "contacts of samples": draw("blades", least_stick),
    "disk": draw("disk", "ring"),
    "disk of sectors": draw("disk", "of sectors", angle=0.3),
    "disk of what is kept": draw("disk", "of few", angle=0.3),
    "disk of a wave": draw("disk", "wave"),
    "disk of one blade": draw(
        "disk",
        lambda: result("wave").assign(coefficient=result("wave").coefficient.where(FOURTH, 0)),
    ),
    "disk at rest": draw(
        "disk", lambda: result("wave").assign(coefficient=0 * result("wave").coefficient)
    ),
    "disk at": draw("disk", "ring", at=75.0, angle=1.3, place=[4, 2, 0]),
    "hysteresis": draw("hysteresis", "point"),
    "hysteresis of a motion": draw("hysteresis", "motion"),
    "hysteresis of peaks": draw("hysteresis", "loads"),
    "hysteresis that opens": draw("hysteresis", "opens"),
    "hysteresis of all": draw("hysteresis", "wave", contact="friction"),
    "hysteresis in a plane": draw("hysteresis", "planar"),
    "normal force": draw("normal_force", "opens"),
    "normal force over": draw("normal_force", "opens", over="displacement"),
    "normal force of a stop": draw("normal_force", "swept", contact=1, at=28.0),
    "states": draw("states", "swept"),
    "states of a sweep": draw("states", "swept", contact=2),
    "states at peaks": draw("states", "loads", at="peak"),
    "stick map": draw("stick_map", "grid"),
    "stick map with holes": draw("stick_map", lambda: holed(result("grid"))),
    "stick map of paths": draw("stick_map", "loads"),
    "stick map of all": draw("stick_map", "ensemble", contact="mean", over="sample"),
    "contact map": draw("contact_map", "six", at=18.0),
    "contact map of energy": draw("contact_map", "six", "dissipation", at="largest"),
    "modes": draw("nonlinear_modes", "modes"),
    "modes over their energy": draw("nonlinear_modes", "modes", over="energy"),
    "modes over a load": draw("nonlinear_modes", "modes over"),
    "modes, measured": draw("nonlinear_modes", "modes", measured=of_modes),
    "modes that stop": draw("nonlinear_modes", lambda: stopped(result("modes"))),
    "cycles": draw("limit_cycles", "cycles"),
    "cycles over a mass": draw("limit_cycles", "turning"),
    "cycles that stop": draw("limit_cycles", lambda: stopped(result("cycles"))),
    "limits": draw("flutter_limit", "limits"),
    "limits that are missing": draw("flutter_limit", lambda: missing(result("limits"))),
    "best limit": draw("flutter_limit", "held"),
    "front": draw("pareto_front", "front"),
    "front that is not complete": draw(
        "pareto_front", lambda: result("front").assign(status=str(sh.Status.FRONT_INCOMPLETE))
    ),
    "ranking": draw("next_measurements", ranked),
    "ranking of several": draw("next_measurements", lambda: ranked(engine_order=[3, 2, 1])),
    "campbell": draw("campbell", whirling),
    "interference": draw("interference", of_sectors),
    "model": draw("model", BLADE),
    "model of a ring": draw("model", sh.HarmonicBalance(OPENED, sh.forces.EngineOrder(3))),
    "model of a chain": draw("model", LINE, force=WAVES),
    "model with a mesh": draw("model", meshed, sets=["tip"]),
    "model of a plate": draw("model", plate, force=sh.forces.PointForce(77)),
    "model of uneven couplings": draw("model", uneven),
    "model that is condensed": draw("model", condensed),
}


def shown(name: str) -> Any:
    """A picture as data, and what Matplotlib makes of it."""
    picture = PICTURES[name]()
    figure = drawn(picture)
    parts = [part for ax in figure.axes for part in (ax, *ax.child_axes)]
    result = told(dict(picture=picture, axes=[axes_of(ax) for ax in parts]))
    plt.close(figure)
    return result


def axes_of(ax: Any) -> dict[str, Any]:
    legend = ax.get_legend()
    return dict(
        limits={"drawn": [*ax.get_xlim(), *ax.get_ylim()]},
        scales=[ax.get_xscale(), ax.get_yscale(), str(ax.get_aspect()), ax.axison],
        words=[ax.get_xlabel(), ax.get_ylabel(), ax.get_title()],
        texts=[(text.get_text(), text.get_color()) for text in ax.texts],
        legend=[text.get_text() for text in legend.get_texts()] if legend else None,
        place={"drawn": [*(legend.get_window_extent() if legend else ax.bbox).bounds]},
        lines=[
            (to_hex(line.get_color(), True), line.get_linestyle(), line.get_marker(), line.get_lw())
            for line in ax.lines
        ],
        areas=[
            (type(one).__name__, one.get_alpha(), [*map(to_hex, one.get_facecolor()[:2])])
            for one in (*ax.collections, *ax.patches) if np.ndim(one.get_facecolor()) == 2
        ],
        patches=[(one.get_extents().bounds, to_hex(one.get_facecolor())) for one in ax.patches],
    )  # fmt: skip


@pytest.mark.parametrize("name", PICTURES)
def test_pictures_are_those_of_before(name):
    same(shown(name), read("pictures")[name])
