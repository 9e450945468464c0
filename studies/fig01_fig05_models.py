"""Figs. 1 and 5: the structures, drawn from the models that the other studies compute.

One blade on a spring and a viscous damper, with a friction damper to the ground; and 13 blades on a
disk, with friction dampers between neighbours and a force on each. A friction damper is a spring
`k_d` in series with a slider, which its normal load `F_n` (`N_i` in Fig. 5) presses together.

Of these drawings of the source only the words in them are known here. They are read so: the disk of
Fig. 5 does not move, contact i joins blades i and i + 1, and the forces are those of an engine
order. Blades are counted from 0, clockwise. Natural frequencies with open and with stuck contacts
tell that what is drawn is what is computed.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Figs. 1 and 5.
"""

import json
from importlib.metadata import version

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from scipy.linalg import eigh

import symhbm as sh
from studies import fig03_single_blade as fig03
from studies import fig08_engine_orders as fig08
from studies.closed_form import EXACT_DIGITS
from studies.landmark import Landmark, Source
from studies.run import REFERENCE, run
from symhbm.model import PARAMETERS

NAME = "fig01_fig05_models"
FIGURES = ("Fig. 1", "Fig. 5")
DRAWN = ("mass", "damping", "stiffness", "contact_stiffness", "friction_coefficient", "normal_load")
NORMAL_LOAD = 100.0
"""Normal load [N] that the source states with both figures."""


def problems() -> list[sh.HarmonicBalance]:
    """The blade of Fig. 3 and the disk of Fig. 8."""
    return [
        one.with_parameters(normal_load=NORMAL_LOAD) for one in (fig03.problem(), fig08.problem())
    ]


def natural_frequencies(problem: sh.HarmonicBalance, stuck: bool) -> np.ndarray:
    """Natural frequencies [Hz] where no contact slips, or all of them do, ascending."""
    model = problem.model
    stiffness = model.stiffness_matrix.toarray()
    if stuck:
        directions = model.directions.toarray()
        stiffness = stiffness + (directions.T * model.contact_stiffness) @ directions
    return np.sqrt(eigh(stiffness, model.mass_matrix.toarray(), eigvals_only=True)) / (2 * np.pi)


def compute(progress: bool = True) -> xr.Dataset:
    """Parameters of both structures, and their natural frequencies."""
    both = problems()
    highest = max(one.model.n_dof for one in both)
    frequency = np.full((len(both), 2, highest), np.nan)
    for i, problem in enumerate(both):
        for j in range(2):
            frequency[i, j, : problem.model.n_dof] = natural_frequencies(problem, stuck=bool(j))
    variables = {
        name: (
            "figure",
            [float(np.mean(one.parameters[name])) for one in both],
            dict(zip(("units", "long_name"), PARAMETERS[name][:2], strict=True)),
        )
        for name in DRAWN
    }
    about = {"units": "Hz", "long_name": "natural frequency"}
    count = {"units": "1", "long_name": "number of blades"}
    return xr.Dataset(
        variables
        | {
            "natural_frequency": (("figure", "contacts", "mode"), frequency, about),
            "n_blades": ("figure", [one.model.n_dof for one in both], count),
        },
        {"figure": list(FIGURES), "contacts": ["open", "stuck"]},
        {
            "title": "The structures of the source",
            "references": "E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013, hal-00941429",
            "symhbm_schema": 1,
            "symhbm_version": version("symhbm"),
        },
    )


def models(dataset: xr.Dataset) -> list[sh.Model]:
    """The structures that a dataset describes."""
    blade, disk = (
        {name: float(dataset[name].sel(figure=figure)) for name in DRAWN} for figure in FIGURES
    )
    n_blades = int(dataset.n_blades.sel(figure=FIGURES[1]))
    return [sh.single_blade(**blade), sh.bladed_disk(n_blades, **disk)]


def draw(dataset: xr.Dataset) -> Figure:
    """Draw both structures, each with its force."""
    forces = (sh.forces.PointForce(), sh.forces.EngineOrder(1))
    with sh.plot.panels(1, 2, size=(11.0, 6.4), width_ratios=(1, 1.25)) as (figure, axes):
        for ax, model, force, name in zip(axes, models(dataset), forces, FIGURES, strict=True):
            sh.plot.model(model, force=force, ax=ax)
            ax.set_title(f"{name}: {ax.get_title()}")
    return figure


def landmarks(dataset: xr.Dataset) -> list[Landmark]:
    """Numbers of blades and contacts, and natural frequencies with open and with stuck contacts."""
    blade, disk = models(dataset)
    own = dataset.natural_frequency.sel(figure=FIGURES[0]).isel(mode=0)
    k, k_d, m = (
        float(dataset[name].sel(figure=FIGURES[0]))
        for name in ("stiffness", "contact_stiffness", "mass")
    )
    known = json.loads(REFERENCE.read_text())["ring_natural_hz"]["1000000"]
    # Each but that without nodal diameters has two modes.
    modes = np.sort(np.repeat(np.array(known, dtype=float), 2)[1:])
    ring = dataset.natural_frequency.sel(figure=FIGURES[1], contacts="stuck").values
    return [
        Landmark("contacts of the blade", blade.n_contacts, 1, "", Source.PUBLISHED, 0.0),
        Landmark("blades of the disk", disk.n_dof, 13, "", Source.PUBLISHED, 0.0),
        Landmark("contacts of the disk", disk.n_contacts, 13, "", Source.PUBLISHED, 0.0),
        *(
            Landmark(
                f"natural frequency of the blade, contact {state}",
                float(own.sel(contacts=state)),
                float(np.sqrt(stiffness / m) / (2 * np.pi)),
                "Hz",
                Source.CLOSED_FORM,
                EXACT_DIGITS,
            )
            for state, stiffness in (("open", k), ("stuck", k + k_d))
        ),
        Landmark(
            "natural frequencies of the disk, contacts stuck, largest difference",
            float(np.abs(ring / modes - 1).max()),
            0.0,
            "",
            Source.EXACT,
            EXACT_DIGITS,
        ),
    ]


if __name__ == "__main__":
    run(NAME, compute, draw)
