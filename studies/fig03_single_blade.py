"""Fig. 3: forced response of one blade with a friction damper to the ground, twelve normal loads.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429), Fig. 3.
"""

import xarray as xr
from matplotlib.figure import Figure

import symhbm as sh
from studies.run import run

NAME = "fig03_single_blade"
NORMAL_LOADS = [0.01, 0.5, 1, 1.5, 2, 3, 5, 10, 18, 50, 100, 500]  # N
BAND = (10, 30)  # Hz


def problem(harmonics: tuple[int, ...] = (1,)) -> sh.HarmonicBalance:
    """Return the paper's blade: 1 kg on 1e4 N/m, 0.5 N s/m, contact of 1e4 N/m, mu = 0.5."""
    blade = sh.single_blade(
        mass=1,
        stiffness=1e4,
        damping=0.5,
        contact_stiffness=1e4,
        friction_coefficient=0.5,
        normal_load=100,
    )
    return sh.HarmonicBalance(blade, sh.PointForce(amplitude=1.0), harmonics)


def compute(progress: bool = True) -> xr.Dataset:
    """Follow the response at every load."""
    return sh.frf(problem(), BAND, over={"normal_load": NORMAL_LOADS}, progress=progress)


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the family of curves."""
    figure = sh.plot.response(dataset)
    figure.axes[0].set_title("One blade, friction damper to the ground, one harmonic")
    return figure


if __name__ == "__main__":
    run(NAME, compute, draw)
