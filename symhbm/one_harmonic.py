"""The friction contact under one harmonic: every angle and integral in closed form, Eqs. (6)-(8).

``y = r cos(tau - theta_0)`` about any mean slips when ``k_d r > g``, from
``theta_star = theta_0 + arccos(1 - 2 g / (k_d r))`` to the next extreme. The second half period
mirrors the first.
"""

import numpy as np
from numpy.typing import NDArray

from symhbm.fourier import FloatArray, FourierBasis
from symhbm.friction import LocatedFriction, limit_excess


def locate_one_harmonic(
    basis: FourierBasis,
    coefficients: FloatArray,
    contact_stiffness: FloatArray,
    slip_limit: FloatArray,
    slip: NDArray[np.bool_] | None = None,
) -> LocatedFriction:
    """Locate the events of motions of harmonic 1, with or without a mean; see `contact.locate`."""
    n_contacts, size = coefficients.shape
    cosine, sine = coefficients[:, -2], coefficients[:, -1]
    radius = np.hypot(cosine, sine)
    moves = radius > 0
    theta_0 = np.arctan2(sine, cosine)
    excess, state = limit_excess(2 * radius, contact_stiffness, slip_limit, slip)
    travel = np.where(moves & state, contact_stiffness * radius, 1.0)
    share = np.where(travel > 0, slip_limit / np.where(travel > 0, travel, 1.0), 0.0)
    stick = np.where(state, np.arccos(np.maximum(1 - 2 * share, -1.0)), np.pi)
    theta_star = theta_0 + stick

    cos_0, sin_0 = np.cos(theta_0), np.sin(theta_0)
    cos_1, sin_1 = np.cos(theta_star), np.sin(theta_star)
    # Integrals over the sticking part of the first half period.
    on_stick = np.stack([sin_1 - sin_0, cos_0 - cos_1], axis=-1)
    on_slip = np.stack([-sin_0 - sin_1, cos_0 + cos_1], axis=-1)
    double = (sin_1 * cos_1 - sin_0 * cos_0) / 2
    mixed = (sin_1**2 - sin_0**2) / 2
    products = np.stack([stick / 2 + double, mixed, mixed, stick / 2 - double], axis=-1)
    extreme = np.stack([cos_0, sin_0], axis=-1)

    block = products.reshape(-1, 2, 2) - on_stick[:, :, None] * extreme[:, None, :]
    matrix = np.zeros((n_contacts, size, size))
    vector = np.zeros((n_contacts, size))
    gradient = np.zeros((n_contacts, size))
    matrix[:, -2:, -2:] = np.where(state[:, None, None], 2 / np.pi * block, np.eye(2))
    matrix[state & ~moves] = 0.0
    slides = (state & moves)[:, None]
    vector[:, -2:] = np.where(slides, 2 / np.pi * (on_stick - on_slip), 0.0)
    gradient[:, -2:] = np.where(moves, 1 / np.where(moves, radius, 1.0), 0.0)[:, None] * extreme
    turn = 2 * np.pi
    return LocatedFriction(
        matrix=matrix,
        vector=vector,
        slip=state,
        excess=excess,
        excess_gradient=gradient,
        theta_0=np.where(moves, theta_0 % turn, np.nan),
        theta_star=np.where(moves & state, theta_star % turn, np.nan),
        stick_fraction=np.where(state, np.where(moves, stick / np.pi, 0.0), 1.0),
        reversals=np.where(moves, 2, 0),
    )
