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
    slides = state & moves
    travel = np.where(slides, contact_stiffness * radius, 1.0)
    share = np.where(travel > 0, slip_limit / np.where(travel > 0, travel, 1.0), 0.0)
    share = np.where(slides, np.minimum(share, 1.0), 1.0)
    # cos(stick) = 1 - 2 share, in forms that keep their digits for stiff contacts in gross slip.
    stick = 2 * np.arctan2(np.sqrt(share), np.sqrt(1 - share))
    sin_stick = 2 * np.sqrt(share * (1 - share))
    bend = _angle_minus_sine(stick, sin_stick)

    # The 2 x 2 block of the matrix in axes along the motion and across it, and the vector.
    along = bend / 2 - sin_stick * share
    across = bend / 2 + sin_stick * share
    upper, lower = sin_stick**2 / 2, -2 * share**2
    push_along, push_across = 4 / np.pi * sin_stick, 4 / np.pi * (2 * share - 1)
    # Turned to the axes of cosine and sine.
    safe = np.where(moves, radius, 1.0)
    c, s = np.where(moves, cosine / safe, 1.0), np.where(moves, sine / safe, 0.0)
    cc, cs, ss = c * c, c * s, s * s
    turned, middle = (upper + lower) * cs, (along - across) * cs
    block = np.empty((n_contacts, 2, 2))
    block[:, 0, 0] = along * cc - turned + across * ss
    block[:, 0, 1] = middle + upper * cc - lower * ss
    block[:, 1, 0] = middle - upper * ss + lower * cc
    block[:, 1, 1] = along * ss + turned + across * cc

    matrix = np.zeros((n_contacts, size, size))
    vector = np.zeros((n_contacts, size))
    gradient = np.zeros((n_contacts, size))
    matrix[:, -2:, -2:] = np.where(state[:, None, None], 2 / np.pi * block, np.eye(2))
    matrix[state & ~moves] = 0.0
    vector[:, -2] = np.where(slides, push_along * c - push_across * s, 0.0)
    vector[:, -1] = np.where(slides, push_along * s + push_across * c, 0.0)
    gradient[:, -2] = np.where(moves, c / safe, 0.0)
    gradient[:, -1] = np.where(moves, s / safe, 0.0)
    theta_star = theta_0 + stick
    turn = 2 * np.pi
    theta_0 = theta_0 % turn
    # A contact held in slip short of its limit never leaves its stretch of stick.
    begin = np.where(slides & (excess > 0), theta_0, np.nan)[:, None] + np.array([0.0, np.pi])
    return LocatedFriction(
        matrix=matrix,
        vector=vector,
        slip=state,
        excess=excess,
        excess_gradient=gradient,
        theta_0=np.where(moves, theta_0, np.nan),
        theta_star=np.where(slides, theta_star % turn, np.nan),
        stick_fraction=np.where(state, np.where(moves, stick / np.pi, 0.0), 1.0),
        reversals=np.where(moves, 2, 0),
        stick_begin=begin,
        stick_end=begin + stick[:, None],
    )


def _angle_minus_sine(angle: FloatArray, sine: FloatArray) -> FloatArray:
    square = angle**2
    series = 1 - square / 20 * (1 - square / 42 * (1 - square / 72 * (1 - square / 110)))
    return np.where(angle < 0.3, angle**3 / 6 * series, angle - sine)
