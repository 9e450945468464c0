"""One call of every verb, on structures of every class, with what it must find.

Numbers are those of a file; ``python -m tests.stored.verbs FILE`` makes it, of the library that is
imported. Points of paths may move where a path is followed otherwise: peaks, events and values at
given frequencies are kept of those, and all variables of other results.
"""

import json
import math
import sys
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import xarray as xr

import symhbm as sh
from tests.designs import any_status
from tests.sectors_to_reduce import chain_sector, plane_sector, plate_sector

VERBS = Path(__file__).parent / "verbs.npz"
BLADE: dict[str, Any] = dict(
    mass=1.0, stiffness=1e4, damping=0.5,
    contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3.0,
)  # fmt: skip
BAND = (10.0, 30.0)
GRID = [14.0, 18.0, 19.5, 22.0, 26.0]
ALONG_PATHS = ("point", "amplitude_point")
"""Dimensions of points that a path chooses."""
QUIET = dict(progress=False)


def blade(force: Any = None, harmonics: Any = (1, 3), **values: Any) -> sh.HarmonicBalance:
    """One blade on a damper to the ground."""
    return sh.HarmonicBalance(
        sh.single_blade(**BLADE | values), force or sh.forces.PointForce(), harmonics
    )


def ring(n: int = 5, order: int = 1, harmonics: Any = (1,), **values: Any) -> sh.HarmonicBalance:
    """A tuned ring under an engine order."""
    disk = sh.bladed_disk(n, **BLADE | values)
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(order), harmonics)


def pressed(contact: str = "shroud", harmonics: Any = (0, 1, 2, 3)) -> sh.HarmonicBalance:
    """Two directions of a mass, with a contact whose load moves, that opens, or that is planar."""
    stiff = dict(contact_stiffness=1e4, friction_coefficient=0.4, normal_load=4.0)
    group = {
        "shroud": lambda: sh.Friction(tangential=(0,), normal=(1,), normal_stiffness=1e4, **stiff),
        "stop": lambda: sh.Gap(normal=(0,), normal_stiffness=1e4, gap=3e-4),
        "planar": lambda: sh.Friction(tangential=(0,), across=(1,), **stiff),
        "cubic": lambda: sh.Contacts(sh.laws.CubicSpring(), [(0,)], cubic_stiffness=2e10),
        "user": lambda: sh.laws.SmoothLaw(
            lambda x, v, p: p["stiffness_of_fifth"] * x**5 + p["viscosity"] * v,
            dict(stiffness_of_fifth=(1e15, "N/m^5"), viscosity=(0.5, "N s/m")),
            [(0,)],
        ),
    }[contact]()
    model = sh.Model(
        np.eye(2), np.diag([2.0, 3.0]), np.array([[1.2e4, -2e3], [-2e3, 2.4e4]]),
        contacts={contact: group},
    )  # fmt: skip
    force = sh.forces.HarmonicForce(cosine={1: [4.0, 0]}, sine={1: [0, 4.0]})
    return sh.HarmonicBalance(model, force, harmonics)


def turning(speed: float | None = None) -> sh.HarmonicBalance:
    """A rotor that stiffens, with Coriolis forces and friction."""
    stiffness = np.array([[3e4, -1e4], [-1e4, 2e4]])
    rub = sh.Friction(
        tangential=(0,), contact_stiffness=5e3, friction_coefficient=0.4,
        normal_load=2.0, centrifugal_load=2e-4,
        **(dict(engine_order=2)),
    )  # fmt: skip
    model = sh.Model(np.eye(2), sh.RayleighDamping(1.0, 1e-5), stiffness, contacts={"rub": rub})
    skew = np.array([[0.0, 0.4], [-0.4, 0.0]])
    rotor = sh.RotatingModel(model, {0: stiffness, 600: stiffness + 800 * np.eye(2)}, coriolis=skew)
    if speed is not None:
        return sh.HarmonicBalance(rotor.at(speed), sh.forces.PointForce(amplitude=5.0), (1, 3))
    return sh.HarmonicBalance(rotor, sh.forces.EngineOrder(2, 5.0), (1, 3))


def tip(order: int = 1) -> sh.forces.EngineOrder:
    """An engine order on the tip of a chain sector."""
    return sh.forces.EngineOrder(order, 2.0, pattern={3: 1.0})


def _response(problem: sh.HarmonicBalance, band: Any = BAND, at: Any = None, **options: Any) -> Any:
    """A path's peaks and events, and values at frequencies."""
    at = np.linspace(*sorted(band), 7)[1:-1] if at is None else at
    path = sh.frf(problem, band, **QUIET, **options)
    grid = sh.frf(problem, band, at=at, **QUIET, **options)
    return path, grid


@cache
def reduced() -> Any:
    """A sector in few coordinates."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return sh.craig_bampton(plate_sector(6), modes=6, frequency_band=(1.0, 60.0))


@cache
def mistuned() -> Any:
    """A ring of reduced sectors that differ."""
    return sh.mistuned_ring(reduced(), stiffness_deviation=[0, 0.02, -0.01, 0.015, 0, -0.02])


def _merged() -> xr.Dataset:
    with TemporaryDirectory() as folder:
        parts = []
        for k in (1, 2):
            parts.append(f"{folder}/{k}.nc")
            sh.frf(
                ring(), BAND, at=GRID, over={"normal_load": [1.0, 2.0, 3.0, 5.0]},
                part=(k, 2), archive=parts[-1], **QUIET,
            )  # fmt: skip
        return sh.datasets.merge(parts, f"{folder}/whole.nc", **QUIET).load()


def _ensemble() -> xr.Dataset:
    problem = ring(harmonics=(1,), order=2)
    draws = sh.mistuning.uniform(problem, 6, seed=4, stiffness=0.03, mass=0.01)
    with ThreadPoolExecutor(2) as executor:
        return sh.frf(problem, (12, 45), over=draws, at=GRID, executor=executor, **QUIET)


def _archive(problem: sh.HarmonicBalance) -> xr.Dataset:
    with TemporaryDirectory() as folder:
        result = sh.frf(problem, BAND, at=GRID, **QUIET)
        sh.save(result, f"{folder}/kept.nc")
        again = sh.datasets.rebuild(sh.load(f"{folder}/kept.nc"))
    return sh.frf(again, BAND, at=GRID, **QUIET)


def _files() -> xr.Dataset:
    with TemporaryDirectory() as folder:
        plain = sh.Model(np.eye(2), sh.RayleighDamping(0.5, 1e-5), np.diag([2e4, 3e4]))
        sh.save_structure(plain, f"{folder}/kept.h5")
        return sh.natural_modes(sh.read_structure(f"{folder}/kept.h5"))


def _condensed(n: int = 12) -> sh.HarmonicBalance:
    """A chain seen from its contact."""
    stiffness = 2e4 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)) + 100 * np.eye(n)
    rub = sh.Friction(
        tangential=(3,), contact_stiffness=5e3, friction_coefficient=0.5, normal_load=1.0
    )
    model = sh.Model(np.eye(n), sh.RayleighDamping(0.5, 1e-5), stiffness, contacts={"rub": rub})
    force = sh.forces.PointForce(7, 3.0)
    small = sh.condense(model, force, (3.0, 20.0), (1, 3), **QUIET)
    return sh.HarmonicBalance(small, force, (1, 3))


def _wave() -> tuple[sh.HarmonicBalance, sh.Sector]:
    sector = chain_sector(9)
    small = sh.condense(sector, tip(2), (8.0, 32.0), (1, 3), **QUIET)
    return sh.HarmonicBalance(small, tip(2), (1, 3)), sector


def _recovered() -> xr.Dataset:
    problem, sector = _wave()
    point = sh.solve(problem, 20.0)
    return sh.datasets.recover(problem, point, sector)


def _negative(**values: Any) -> sh.HarmonicBalance:
    """A blade that the air drives."""
    model = sh.single_blade(**BLADE | dict(damping=-0.4) | values)
    return sh.HarmonicBalance(model, None, (1, 3))


CALLS: dict[str, Callable[[], Any]] = {
    "frf of a blade": lambda: _response(blade(), over={"normal_load": [1.0, 3.0, 30.0]}),
    "frf of a ring, each blade": lambda: _response(
        ring(order=2, normal_load=[3.0, 4, 5, 3, 4]), (12, 45), peaks="each"
    ),
    "frf with an accuracy": lambda: _response(blade(harmonics=(1,)), accuracy=1e-4),
    "frf with stability": lambda: _response(pressed("cubic", (1, 3)), (14, 28), stability=True),
    "frf with phase resonances": lambda: sh.frf(blade(), BAND, phase_resonances=True, **QUIET),
    "frf with angles": lambda: _response(blade(normal_load=2.0), (17, 21), angles="newton"),
    **{
        f"frf of {contact} contacts": lambda contact=contact: _response(
            pressed(contact), (13.0, 27.0)
        )
        for contact in ("shroud", "stop", "planar", "cubic", "user")
    },
    "frf of a rotor": lambda: _response(turning(), (12.0, 40.0)),
    "frf at a speed": lambda: _response(turning(300.0), (12.0, 40.0)),
    "frf of a sector": lambda: _response(
        sh.HarmonicBalance(chain_sector(9), tip(2), (1, 3)), (8.0, 32.0)
    ),
    "frf of a turned sector": lambda: _response(
        sh.HarmonicBalance(plane_sector(6), sh.forces.EngineOrder(2, 1.0, pattern={14: 1.0}), (1,)),
        (8.0, 60.0),
    ),
    "frf of a condensed chain": lambda: _response(_condensed(), (3.0, 20.0)),
    "frf of a condensed sector": lambda: _response(_wave()[0], (8.0, 32.0)),
    "frf of a reduced sector": lambda: _response(
        sh.HarmonicBalance(reduced(), sh.forces.EngineOrder(2, 5.0, pattern={40: 1.0}), (1,)),
        (2.0, 50.0),
    ),
    "frf of a mistuned ring": lambda: _response(
        sh.HarmonicBalance(mistuned(), sh.forces.EngineOrder(2, 5.0, pattern={40: 1.0}), (1,)),
        (2.0, 50.0),
    ),
    "frf of a moving base": lambda: _response(
        sh.HarmonicBalance(
            pressed("shroud").model,
            sh.forces.BaseMotion(acceleration=4.0, influence=[1.0, 0.0]),
            (0, 1, 2, 3),
        ),
        (13.0, 27.0),
    ),
    "follow a load": lambda: (
        sh.follow(blade(), "normal_load", (0.1, 50.0), frequency=19.5, **QUIET),
        sh.follow(blade(), "normal_load", (0.1, 50.0), [1, 3, 9.0], frequency=19.5, **QUIET),
    ),
    "solve": lambda: sh.solve(blade(), 19.0, accuracy=1e-5),
    "solve with angles": lambda: sh.solve(blade(normal_load=2.0), 19.0, angles="ipopt"),
    "static states": lambda: sh.static_states(
        sh.HarmonicBalance(
            pressed().model,
            sh.forces.PointForce() + sh.forces.StaticLoad([3.0, -2.0]),
            (0, 1, 2, 3),
        )
    ),
    "periodic motion": lambda: sh.periodic_motion(ring(n=3, order=1, harmonics=(1, 3)), 18.0),
    "periodic motion that opens": lambda: sh.periodic_motion(pressed("shroud"), 17.0),
    "verify": lambda: sh.verify(sh.frf(ring(n=4), BAND, at=GRID, **QUIET), exact="none", **QUIET),
    "nonlinear modes": lambda: sh.nonlinear_modes(
        blade(), at=[1e-4, 3e-4, 1e-3], band=(1e-5, 1e-2), **QUIET
    ),
    "nonlinear modes of a wave": lambda: sh.nonlinear_modes(
        ring(harmonics=(1, 3)), at=[1e-4, 1e-3], band=(1e-5, 1e-2), nodal_diameter=1, **QUIET
    ),
    "synthesised response": lambda: sh.datasets.synthesised_response(
        sh.nonlinear_modes(blade(), band=(1e-5, 1e-3), **QUIET), sh.forces.PointForce()
    ),
    "limit cycles": lambda: sh.limit_cycles(_negative(), amplitudes=(1e-6, 1e-1), **QUIET),
    "limit cycles over a load": lambda: sh.limit_cycles(
        _negative(), "normal_load", (1.0, 20.0), [2.0, 5.0, 10.0], amplitudes=(1e-6, 1e-1), **QUIET
    ),
    "flutter limit": lambda: sh.flutter_limit(
        _negative(), "normal_load", (1.0, 20.0), [2.0, 5.0, 10.0], amplitudes=(1e-6, 1e-3), **QUIET
    ),
    "most damping": lambda: sh.maximise_damping(blade(), "normal_load", (0.1, 50.0), 3e-4, **QUIET),
    "highest flutter limit": lambda: sh.maximise_flutter_limit(
        _negative(), "normal_load", (0.5, 20.0), (1e-6, 1e-3), **QUIET
    ),
    "minimise peak": lambda: sh.minimise_peak(
        blade(), "normal_load", (0.5, 30.0), BAND, n_starts=1, **QUIET
    ),
    "minimise the mean of cases": lambda: sh.minimise_peak(
        blade(harmonics=(1,)),
        "normal_load",
        (0.5, 30.0),
        BAND,
        over={"stiffness": [0.9e4, 1e4, 1.1e4]},
        statistic="mean",
        n_starts=1,
        **QUIET,
    ),
    "pareto front": lambda: sh.pareto_front(
        blade(harmonics=(1,)),
        "normal_load",
        (1.0, 10.0),
        BAND,
        n_points=3,
        n_starts=1,
        **QUIET,
        aims={
            "peak": lambda peaks, _: peaks["largest"],
            "load": lambda _, load: load["normal_load"],
        },
    ),
    "peak curve": lambda: sh.peak_curve(
        blade(), "normal_load", (0.5, 30.0), [1.0, 3.0, 10.0], frequency_band=BAND, **QUIET
    ),
    "sensitivity": lambda: sh.datasets.sensitivity(sh.frf(ring(n=4), BAND, **QUIET)).drop_dims(
        ALONG_PATHS, errors="ignore"
    ),
    "natural modes": lambda: sh.natural_modes(chain_sector(9), range(5), count=3),
    "natural modes, stuck": lambda: sh.natural_modes(chain_sector(9), [2], count=3, stuck=True),
    "campbell": lambda: sh.campbell(turning().model, [0.0, 200.0, 400.0], orders=[1, 2]),
    "recovered": _recovered,
    "other sectors": lambda: sh.datasets.sector_response(
        sh.solve(sh.HarmonicBalance(chain_sector(9), tip(2), (1, 3)), 20.0), [0, 3]
    ),
    "merged": _merged,
    "ensemble": _ensemble,
    "from an archive": lambda: _archive(ring(n=4, harmonics=(1, 3))),
    "from an archive, planar": lambda: _archive(pressed("planar")),
    "from an archive, reduced": lambda: _archive(
        sh.HarmonicBalance(reduced(), sh.forces.EngineOrder(2, 5.0, pattern={40: 1.0}), (1,))
    ),
    "from a file": _files,
}


def found(name: str) -> dict[str, np.ndarray]:
    """All variables of the results of a call, but for the points of paths."""
    with any_status(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="the curve is incomplete")
        results = CALLS[name]()
    results = results if isinstance(results, tuple) else (results,)
    arrays = {}
    for i, result in enumerate(results):
        result = result.drop_dims([dim for dim in ALONG_PATHS if dim in result.dims])
        for key, variable in result.variables.items():
            if key in _COUNTS:
                continue
            values = variable.values
            if values.size > _MANY:
                values = values.ravel()[:: 1 + values.size // _MANY]
            arrays[f"{i}.{key}"] = values.astype(str) if values.dtype == object else values
    return arrays


_COUNTS = {
    "n_points", "rejected_steps", "linear_solves", "iterations", "by_machine_code", "created",
    "problem_numbers",
    "elapsed", "seconds",
}  # fmt: skip
"""Variables that tell the work, or the problem, and not the result."""


_MANY = 2000
"""Values of one variable that are kept of larger ones, evenly spaced."""


def write(path: Path) -> None:
    """Compute all calls and write what they find: numbers in one array, texts in another."""
    numbers, texts, variables = [], [], []
    for name in CALLS:
        for key, values in found(name).items():
            is_text = values.dtype.kind == "U"
            (texts if is_text else numbers).append(values.ravel())
            variables.append((name, key, values.shape, is_text))
    parts = dict(numbers=np.concatenate(numbers).astype(float), texts=np.concatenate(texts))
    np.savez_compressed(path, variables=np.array(json.dumps(variables)), **parts)


def read(path: Path) -> dict[str, dict[str, np.ndarray]]:
    """Stored variables by call."""
    stored: dict[str, dict[str, np.ndarray]] = {}
    with np.load(path) as file:
        parts, starts = (file["numbers"], file["texts"]), [0, 0]
        for name, key, shape, is_text in json.loads(str(file["variables"])):
            start = starts[is_text]
            starts[is_text] += math.prod(shape)
            values = parts[is_text][start : starts[is_text]].reshape(shape)
            stored.setdefault(name, {})[key] = values
    return stored


if __name__ == "__main__":
    write(Path(sys.argv[1]))
