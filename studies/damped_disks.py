"""Disks of `studies.damping_and_localisation`, and their responses in closed form.

Weak springs join neighbouring blades: contacts that never slip. Friction dampers stand between each
blade and the ground, or between neighbours.
"""

from dataclasses import replace

import numpy as np
import xarray as xr

import symhbm as sh
from studies.closed_form import OneBlade
from studies.companions import ALL_STICK

N_BLADES = 13
ENGINE_ORDER = 3
DAMPING = 0.25  # N s/m
COUPLING = 100.0  # N/m
CONTACT_STIFFNESS = 1e4  # N/m
FRICTION_COEFFICIENT = 0.5
PLACES = {
    "to the ground": [(i,) for i in range(N_BLADES)],
    "between blades": [(i, (i + 1) % N_BLADES) for i in range(N_BLADES)],
}


def viscous_disk(damping: float) -> sh.HarmonicBalance:
    """Return the disk without friction dampers: its contacts are the weak springs."""
    disk = sh.bladed_disk(
        N_BLADES,
        mass=1,
        stiffness=1e4,
        damping=damping,
        contact_stiffness=COUPLING,
        friction_coefficient=FRICTION_COEFFICIENT,
        normal_load=ALL_STICK,
    )
    return sh.HarmonicBalance(disk, sh.forces.EngineOrder(ENGINE_ORDER, amplitude=1.0))


def friction_disk(place: str, normal_load: float) -> sh.HarmonicBalance:
    """Return the disk with friction dampers, and the least viscous damping."""
    alone = viscous_disk(DAMPING)
    assert isinstance(alone.model, sh.Model)
    disk = replace(
        alone.model,
        contacts=[*alone.model.contacts, *PLACES[place]],
        contact_stiffness=np.repeat([COUPLING, CONTACT_STIFFNESS], N_BLADES),
        friction_coefficient=FRICTION_COEFFICIENT,
        normal_load=np.repeat([ALL_STICK, normal_load], N_BLADES),
        cubic_stiffness=0.0,
    )
    return sh.HarmonicBalance(disk, alone.excitation)


def tuned_blade(place: str, normal_load: float) -> OneBlade:
    """One blade of the tuned disk under the engine order, in closed form."""
    stretch = 2 * np.sin(np.pi * ENGINE_ORDER / N_BLADES)
    return OneBlade(
        mass=1.0,
        damping=DAMPING,
        stiffness=1e4 + COUPLING * stretch**2,
        contact_stiffness=CONTACT_STIFFNESS,
        slip_limit=FRICTION_COEFFICIENT * normal_load,
        force=1.0,
        ratio=1.0 if place == "to the ground" else float(stretch),
    )


def equal_damping(blade: OneBlade, amplitude: float) -> float:
    """Viscous damping [N s/m] with which a blade without friction has a peak of this amplitude.

    From ``A c sqrt(k / m - c^2 / (4 m^2)) = f0``.
    """
    stiffness = blade.force / amplitude
    rest = blade.stiffness - np.sqrt(blade.stiffness**2 - stiffness**2)
    return float(np.sqrt(2 * blade.mass * rest))


def stiffness_matrix(dataset: xr.Dataset, sample: int) -> np.ndarray:
    """Of a disk without friction dampers."""
    own = np.diag(dataset.stiffness.sel(sample=sample).values)
    one = np.eye(N_BLADES)
    return own + COUPLING * (2 * one - np.roll(one, 1, axis=0) - np.roll(one, -1, axis=0))


def by_linear_algebra(dataset: xr.Dataset) -> xr.Dataset:
    """Localisation and amplification of the viscous disks at the frequencies of their peaks."""
    viscous = dataset.sel(kind="viscous")
    force = np.exp(-2j * np.pi * ENGINE_ORDER * np.arange(N_BLADES) / N_BLADES)

    def responses(damping: np.ndarray, frequency: np.ndarray) -> np.ndarray:
        omega = 2 * np.pi * frequency[..., None, None]
        each = np.stack([stiffness_matrix(dataset, s) for s in dataset.sample.values])
        matrix = each + (1j * omega * damping[..., None, None, None] - omega**2) * np.eye(N_BLADES)
        right = np.broadcast_to(force[:, None], (*matrix.shape[:-1], 1))
        return np.abs(np.linalg.solve(matrix, right))[..., 0]

    size = responses(viscous.damping.values, viscous.peak_frequency.values)
    dims = viscous.localisation.dims
    peak = xr.DataArray(size.max(axis=-1), dims=dims)
    ratio = (size**4).sum(axis=-1) / (size**2).sum(axis=-1) ** 2
    return xr.Dataset(
        {"localisation": (dims, ratio), "amplification": peak / viscous.tuned_peak.variable}
    )
