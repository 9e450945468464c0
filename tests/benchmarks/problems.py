"""What is computed: the blade of the paper, its ring of blades, and mistuned rings."""

import symhbm as sh
from studies import fig03_single_blade as fig03

RING = {"mass": 1, "stiffness": 1e4, "damping": 0.5, "contact_stiffness": 1e6}
BLADE_BAND, RING_BAND, ENSEMBLE_BAND = (10, 30), (150, 280), (50, 350)
"""Bands [Hz]."""


def blade(load: float, harmonics: tuple[int, ...] = (1,), samples: int | None = None):
    """The blade of Fig. 3 under a normal load [N]."""
    problem = fig03.problem(harmonics)
    if samples is not None:
        problem = sh.HarmonicBalance(problem.model, problem.excitation, harmonics, samples)
    return problem.with_parameters(normal_load=load)


def ring(harmonics, load: float, samples: int | None = None, n_blades: int = 13):
    """A ring of blades under a normal load [N] and engine order 3 of 13, or the like of others."""
    disk = sh.bladed_disk(n_blades, **RING, friction_coefficient=0.5, normal_load=load)
    order = round(3 * n_blades / 13)
    return sh.HarmonicBalance(disk, sh.EngineOrder(order), harmonics, samples)


def draws(problem: sh.HarmonicBalance, n_samples: int):
    """Mistuned contacts of a ring, with the half-widths of the paper's ensemble."""
    return sh.mistuning.uniform(
        problem,
        n_samples=n_samples,
        seed=1,
        friction_coefficient=0.4,
        contact_stiffness=0.2,
        normal_load=0.3,
    )


def mistuned(n_blades: int, load: float = 10) -> sh.HarmonicBalance:
    """The first mistuned ring of so many blades, one harmonic."""
    problem = ring((1,), load, n_blades=n_blades)
    values = draws(problem, 1).isel(sample=0)
    return problem.with_parameters(**{str(name): values[name].values for name in values.data_vars})
