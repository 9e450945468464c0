"""pyHarm (package ``pyHarm-os``), adapted: the same model, harmonics, samples and band.

Lengths and frequencies are made dimensionless by the height of the peak and half the band, which a
user does not know, and steps are a tenth of those for each degree of freedom, at most a fifth:
about as many points as the other programs take, and no longer than it can follow.
"""

import logging
import os
import tempfile

import numpy as np

# It keeps a file of its state, by default in the working directory.
os.environ.setdefault(
    "PYHARM_CONTEXT_FILE", os.path.join(tempfile.gettempdir(), "pyharm_context.json")
)
from pyHarm.Maestro import Maestro

import symhbm as sh
from symhbm.model import force_coefficients

STEP, LONGEST = 0.1, 0.2


def analysis_of(
    problem: sh.HarmonicBalance, band: tuple[float, float], samples: int, height: float
):
    """Its analysis of a frequency response, ready to be solved."""
    model, excitation = problem.model, problem.excitation
    names = {"M": model.mass_matrix, "C": model.damping_matrix, "K": model.stiffness_matrix}
    connectors = {}
    for j, contact in enumerate(model.contacts):
        ends = {"disk": [contact[0]]} | ({"INTERNAL": [contact[1]]} if len(contact) > 1 else {})
        connectors[f"contact {j}"] = {
            "type": "Jenkins",
            "connect": ends,
            "dirs": [0],
            "mu": float(model.friction_coefficient[j]),
            "N0": float(model.normal_load[j]),
            "k": float(model.contact_stiffness[j]),
        }
    shape = force_coefficients(excitation, model.n_dof, problem.basis)
    for dof, (cosine, sine) in enumerate(shape[:, :2]):
        if cosine or sine:
            connectors[f"force {dof}"] = {
                "type": "GOForcing",
                "connect": {"disk": [dof]},
                "dirs": [0],
                "dto": 0,
                "ho": problem.harmonics[0],
                "phi": float(np.arctan2(sine, cosine)),
                "amp": float(np.hypot(cosine, sine)),
            }
    step = min(STEP * np.sqrt(model.n_dof), LONGEST)
    study = {
        "study": "frf",
        "puls_inf": 2 * np.pi * band[0],
        "puls_sup": 2 * np.pi * band[1],
        "ds0": step,
        "ds_max": step,
        "ds_min": 1e-4,
        "verbose": False,
    }
    scales = {"status": True, "lc": height, "wc": np.pi * (band[1] - band[0])}
    logging.disable(logging.INFO)
    maestro = Maestro(
        {
            "system": {"type": "Base", "nh": [*problem.harmonics], "nti": samples, "adim": scales},
            "substructures": {
                "disk": {
                    "matrix": {name: matrix.toarray() for name, matrix in names.items()},
                    "ndofs": 1,
                }
            },
            "connectors": connectors,
            "analysis": {"response": study},
        }
    )
    return maestro.nls["response"]


def peak_of(analysis, problem: sh.HarmonicBalance, band: tuple[float, float]):
    """Accepted points, frequency [Hz] and amplitude [m] of the highest point of the path.

    NaN where it ended before the band.
    """
    path = np.array([point.x for point in analysis.SolList if point.flag_accepted])
    omega = path[:, -1] * analysis.system.wc
    if omega[-1] < 2 * np.pi * band[1]:
        return len(path), np.nan, np.nan
    # Components are the slowest to vary: cosine and sine of each harmonic in turn.
    parts = path[:, :-1].reshape(len(path), -1, problem.model.n_dof) * analysis.system.lc
    angle = np.outer(np.linspace(0, 2 * np.pi, 720, endpoint=False), problem.harmonics)
    motion = np.einsum("tk,pkd->ptd", np.cos(angle), parts[:, ::2])
    motion += np.einsum("tk,pkd->ptd", np.sin(angle), parts[:, 1::2])
    height = np.abs(motion).max(axis=(1, 2))
    return len(path), float(omega[height.argmax()] / (2 * np.pi)), float(height.max())
