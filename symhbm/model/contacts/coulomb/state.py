"""The force of a spring and a Coulomb slider, given its events over one period.

With the switching angles known, the force is ``k_d y + offset`` or ``+-g``, ``g = mu F_n``, on a
handful of intervals, and its Fourier coefficients (Eqs. 6-8) are the closed form

    f = k_d A y + g b,

where the matrix ``A`` and the vector ``b`` depend on the angles alone. The force is continuous and
``dy/dtau = 0`` at reversals, so the derivative at fixed angles is the exact derivative.

Reference: E. Chatelet, D. Rade, G. Jacquet-Richardet, DINAME 2013 (hal-00941429).
"""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symhbm.model.contacts.motions import Located
from symhbm.numerics import FloatArray

SMALLEST_MOTION = 1e-150
"""Motion [m] below which there is none: its inverse has no square in double precision."""


@dataclass(frozen=True)
class ContactState:
    """Events of a batch of friction contacts over one period.

    Attributes
    ----------
    matrix : (n_contacts, n_components, n_components)
        ``A`` of the module's closed form, dimensionless.
    vector : (n_contacts, n_components)
        ``b`` of the module's closed form, dimensionless.
    slip : (n_contacts,)
        Whether the contact slips at all during the period.
    slip_margin : (n_contacts,)
        ``ln(k_d (y_max - y_min) / (2 g))``: positive when the motion asks for slip, infinite
        without limit or without motion.
    slip_margin_gradient : (n_contacts, n_components)
        Its derivative with respect to the coefficients of ``y`` [1/m].
    theta_0, theta_star : (n_contacts,)
        Angle of the maximum of ``y`` and the angle where slip starts after it [rad]; NaN where the
        two-reversal motion of Eqs. (4)-(11) does not apply.
    stick_fraction : (n_contacts,)
        Share of the period spent sticking.
    reversals : (n_contacts,)
        Number of sign changes of the relative velocity per period.
    stick_begin, stick_end : (n_contacts, n_stretches)
        Where a contact that slips begins to stick and where it slips again [rad], ascending; NaN
        elsewhere. Friction over samples has none.
    """

    matrix: FloatArray
    vector: FloatArray
    slip: NDArray[np.bool_]
    slip_margin: FloatArray
    slip_margin_gradient: FloatArray
    theta_0: FloatArray
    theta_star: FloatArray
    stick_fraction: FloatArray
    reversals: NDArray[np.int_]
    stick_begin: FloatArray
    stick_end: FloatArray

    @property
    def stick_intervals(self) -> tuple[NDArray[np.intp], FloatArray, FloatArray]:
        """The contact, the begin and the end of all stretches of stick, (n_intervals,) each."""
        contact, stretch = np.nonzero(~np.isnan(self.stick_end))
        return contact, self.stick_begin[contact, stretch], self.stick_end[contact, stretch]

    def located(self, vector: FloatArray) -> Located:
        """What the equations take of the contacts, with a ``vector`` in the place of their own."""
        n, size = vector.shape
        # CasADi stores columns one after the other.
        matrix = self.matrix.transpose(0, 2, 1).reshape(n, size * size)
        sticking = np.where(self.slip, self.stick_fraction, 0.0)
        events = np.concatenate([matrix, vector, sticking[:, None]], axis=1)
        margins, slopes = self.slip_margin[:, None], self.slip_margin_gradient[:, None]
        return Located(events, self.slip[:, None], margins, slopes, self)

    def split(self, count: int) -> list["ContactState"]:
        """The events of ``count`` batches of as many contacts each."""
        parts = [np.split(getattr(self, field.name), count) for field in fields(self)]
        return [ContactState(*each) for each in zip(*parts, strict=True)]


def slip_limit(friction_coefficient: Any, normal_load: Any) -> Any:
    """``g = mu F_n`` [N], of arrays or of symbols."""
    return friction_coefficient * normal_load
