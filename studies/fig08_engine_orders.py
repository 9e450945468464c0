"""Fig. 8: forced response of the tuned 13-blade disk under engine orders 1, 3 and 6.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 8.
"""

import xarray as xr
from matplotlib.figure import Figure

import symhbm as sh
from studies.run import run

NAME = "fig08_engine_orders"
ENGINE_ORDERS = [1, 3, 6]
BAND = (50, 350)  # Hz


def problem(harmonics: tuple[int, ...] = (1,)) -> sh.HarmonicBalance:
    """Return the paper's disk: 13 blades, contacts of 1e6 N/m, mu = 0.5, F_n = 100 N."""
    disk = sh.bladed_disk(
        13,
        mass=1,
        stiffness=1e4,
        damping=0.5,
        contact_stiffness=1e6,
        friction_coefficient=0.5,
        normal_load=100,
    )
    return sh.HarmonicBalance(disk, sh.EngineOrder(1, amplitude=1.0), harmonics)


def compute(progress: bool = True) -> xr.Dataset:
    """Follow the response of the full ring at every engine order."""
    return sh.frf(problem(), BAND, over={"engine_order": ENGINE_ORDERS}, progress=progress)


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the three curves."""
    figure = sh.plot.response(dataset)
    figure.axes[0].set_title("Tuned disk of 13 blades, one harmonic, full ring")
    return figure


if __name__ == "__main__":
    run(NAME, compute, draw)
