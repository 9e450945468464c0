"""Dampers under platforms, identified from responses of the blade at three places.

The finite-element sector of `studies.open_sector_contacts`, 1,200 degrees of freedom, is excited at
the tip by engine order 18, at three levels of the force. Its tip, the middle of the blade and a
place beside its root are measured, real and imaginary parts with a noise of 2 %. Stiffness and load
of the contacts under the platforms are looked for from values that are three times too large and
too small; the load is that of the damper's mass. How sure each place alone would make them says
where a sensor is worth most.
"""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import symhbm as sh
from studies.landmark import Landmark, Source, unit_of
from studies.open_sector import RADII
from studies.open_sector_contacts import (
    CONTACT_STIFFNESS,
    DAMPER_BAND,
    Condensed,
    damper,
    pressing,
    with_mass,
)
from studies.run import run

NAME = "identified_sector"
MASS = 0.01
"""Of a damper [kg]."""
LEVELS = (0.3, 1.0, 3.0)
"""Force on the tip over that of the other studies of the sector."""
MIDDLE, ROOT = 0.5 * (RADII[1] + RADII[2]), RADII[1] + 0.2 * (RADII[2] - RADII[1])
PLACES = ("tip", "middle", "root")
NOISE, SEED, N_FREQUENCIES = 0.02, 24, 15
UNKNOWN = ("contact_stiffness", "centrifugal_load")
WRONG = (3.0, 1 / 3)
"""Values that the fit starts from, over the true ones."""
SURE = 4.0
"""Standard errors within which an estimate is the true value."""
TRUE: dict[str, float] = dict(contact_stiffness=CONTACT_STIFFNESS, centrifugal_load=pressing(MASS))


def tests_of(disk: Condensed, problem: sh.HarmonicBalance) -> list[xr.Dataset]:
    """What the sensors read, with noise, a dataset for each place."""
    at, rng = np.linspace(*DAMPER_BAND, N_FREQUENCIES), np.random.default_rng(SEED)
    over = {"force_amplitude": [*LEVELS]}
    response = sh.frf(problem, DAMPER_BAND, at=at, over=over, progress=False, throw=True)
    known: Any = dict(force_amplitude=np.reshape(LEVELS, (-1, 1)), units="m")
    found = []
    for place in disk.watched:
        number = np.flatnonzero(problem.model.dofs == disk.disk.number_of(place))[0]
        first = response.coefficient.isel(dof=number).sel(harmonic=1)
        cosine, sine = first.transpose("component", "force_amplitude", "frequency").values
        exact = cosine - 1j * sine
        deviation = NOISE * abs(exact)
        real, imaginary = rng.standard_normal((2, *exact.shape))
        noisy = exact + deviation * (real + 1j * imaginary)
        found.append(sh.datasets.measured(at, noisy, place=place, deviation=deviation, **known))
    return found


def compute(progress: bool = True) -> xr.Dataset:
    """The fit to all places, and the errors that each alone would leave."""
    disk = damper(also=(MIDDLE, ROOT))
    problem = with_mass(disk.problem, MASS)
    data = tests_of(disk, problem)
    wrong = {name: factor * TRUE[name] for name, factor in zip(UNKNOWN, WRONG, strict=True)}
    start = problem.with_parameters(**wrong)
    fit = sh.identify(start, data, UNKNOWN, progress=False, throw=True)
    given: Any = dict(start=fit, n_starts=1, profiles=False, progress=False)
    alone = [sh.identify(problem, one, UNKNOWN, **given)["standard_error"] for one in data]
    about = {"units": "unknown_units", "long_name": "standard error by the data of one place"}
    errors = ("place", "unknown"), np.array(alone), about
    return fit.assign(error_of_place=errors).assign_coords(place=("place", [*PLACES]))


def draw(dataset: xr.Dataset) -> Figure:
    """Measured points on the responses of the tip, and errors by all places and by each."""
    with sh.plot.panels(2, 1, size=(6.5, 6.5)) as (figure, axes):
        tip = str(dataset["measured_place"].values[0])
        sh.plot.response(dataset, place=tip, ax=axes[0])
        values = np.array([TRUE[str(name)] for name in dataset["unknown"].values])
        shares = 100 * np.vstack([dataset["error_of_place"], dataset["standard_error"]]) / values
        for j, (name, mark) in enumerate(zip(("stiffness", "load"), "os", strict=True)):
            look: Any = dict(marker=mark, linestyle="", color="black")
            face = "white" if j else "black"
            axes[1].plot(range(4), shares[:, j], label=name, markerfacecolor=face, **look)
        axes[1].set_xticks(range(4), [*PLACES, "all three"])
        axes[1].set_ylabel("standard error [%]")
        axes[1].set_ylim(0.0)
        axes[1].margins(x=0.2)
        axes[1].legend()
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Estimates within four standard errors of the true values, residuals that are noise."""
    found = []
    for number, name in enumerate(dataset["unknown"].values.tolist()):
        sure = SURE * float(dataset["standard_error"][number]) / TRUE[name]
        units = unit_of(dataset["unknown_units"].values[number])
        estimate, words = float(dataset["estimate"][number]), name.replace("_", " ")
        found.append(Landmark(words, estimate, TRUE[name], units, Source.EXACT, sure))
    size = float(dataset["curve_size"].sum())
    square = float(dataset["curve_chi_square"].sum()) / (size - len(UNKNOWN))
    words, allowed = "mean square of the residuals in variances", float(SURE * np.sqrt(2 / size))
    found.append(Landmark(words, square, 1.0, "", Source.EXACT, allowed))
    return found


if __name__ == "__main__":
    run(NAME, compute, draw)
