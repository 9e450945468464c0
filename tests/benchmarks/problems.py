"""What is computed: the blade of the paper, its ring of blades, mistuned rings, and others."""

import numpy as np

import symhbm as sh
from studies import fig03_single_blade as fig03
from tests.sectors_to_reduce import chain_sector

RING = {"mass": 1, "stiffness": 1e4, "damping": 0.5, "contact_stiffness": 1e6}
BLADE_BAND, RING_BAND, ENSEMBLE_BAND = (10, 30), (150, 280), (50, 350)
SHROUD_BAND, SECTOR_BAND = (10, 35), (8, 40)
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
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(order), harmonics, samples)


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


def shrouded(n_blades: int, load: float) -> sh.HarmonicBalance:
    """A ring of blades with two directions each, whose shrouds are pressed by a load [N].

    Damped enough for the response to have no fold.
    """
    pairs = [(2 * j, 2 * ((j + 1) % n_blades)) for j in range(n_blades)]
    shroud = sh.Friction(
        tangential=pairs,
        normal=[(first + 1, second + 1) for first, second in pairs],
        contact_stiffness=1e4,
        normal_stiffness=2e4,
        friction_coefficient=0.4,
        normal_load=load,
    )
    damping, stiffness = np.tile([16.0, 24.0], n_blades), np.tile([1e4, 2.25e4], n_blades)
    parts = np.eye(2 * n_blades), np.diag(damping), np.diag(stiffness)
    lag = 2 * np.pi / n_blades * np.arange(n_blades)
    cosine = np.column_stack([np.cos(lag), 0.5 * np.sin(lag)]).ravel()
    sine = np.column_stack([np.sin(lag), -0.5 * np.cos(lag)]).ravel()
    force = sh.forces.HarmonicForce(cosine={1: cosine}, sine={1: sine}, amplitude=10.0)
    return sh.HarmonicBalance(sh.Model(*parts, contacts={"shroud": shroud}), force, (0, 1, 2, 3))


def sector(harmonics) -> sh.HarmonicBalance:
    """A tuned disk of 12 sectors under engine order 3, a mass and a blade of three masses each."""
    return sh.HarmonicBalance(chain_sector(12), _WAVE, harmonics)


def mistuned_sectors(harmonics) -> sh.HarmonicBalance:
    """The same sectors reduced by Craig and Bampton, in a ring of blades that are not alike."""
    reduced = sh.craig_bampton(chain_sector(12), 2, SECTOR_BAND)
    deviations = np.random.default_rng(1).uniform(-0.02, 0.02, 12)
    ring = sh.mistuned_ring(reduced, stiffness_deviation=deviations)
    return sh.HarmonicBalance(ring, _WAVE, harmonics)


_WAVE = sh.forces.EngineOrder(3, 5.0, pattern={3: 1.0})
"""A force on the tips of blades."""
