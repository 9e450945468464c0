"""The named parameters of structures, contacts and forces: one record each.

A new parameter is a new record here: bounds, labels, sweeps, draws, designs and archives read it.
"""

from typing import Literal, NamedTuple


class Parameter(NamedTuple):
    """A named number of a model or an excitation.

    ``units`` as datasets have them, UDUNITS; ``symbol`` of pictures, with the ``unit`` there;
    ``per``, what has one value each, None for one in all; ``bound`` of its values, as
    `symhbm.numerics.check` names it, and ``followed``, that of a band it is followed over;
    ``in_slip``, its exponent in the motion over the limit of slip, ``k_d (y_max - y_min) /
    (2 mu F_n)``; ``designed``, whether designs may vary it.
    """

    units: str
    meaning: str
    symbol: str
    unit: str
    per: Literal["dof", "contact"] | None
    bound: str = "non-negative"
    followed: str = "non-negative"
    in_slip: float = 0.0
    designed: bool = False


PARAMETERS = {
    "mass": Parameter(
        "kg", "mass of the blade", "$m$", "kg", "dof", "positive", "positive", designed=True
    ),
    "damping": Parameter(
        "N s m-1", "viscous damping of the blade", "$c$", "N s/m", "dof", designed=True
    ),
    "stiffness": Parameter("N m-1", "stiffness of the blade", "$k$", "N/m", "dof", designed=True),
    "contact_stiffness": Parameter(
        "N m-1", "stiffness of the contact", "$k_d$", "N/m", "contact", in_slip=1.0, designed=True
    ),
    "friction_coefficient": Parameter(
        "1", "friction coefficient", r"$\mu$", "", "contact", in_slip=-1.0, designed=True
    ),
    "normal_load": Parameter(
        "N", "normal load of the contact", "$F_n$", "N", "contact", in_slip=-1.0, designed=True
    ),
    "cubic_stiffness": Parameter(
        "N m-3", "stiffness of the cubic spring", r"$\gamma$", "N/m³", "contact", "any", "any"
    ),
    # A band of forces keeps one sign: with the other, the response is its mirror image.
    "force_amplitude": Parameter(
        "N", "amplitude of the exciting force", "$f_0$", "N", None, bound="any"
    ),
    "engine_order": Parameter("1", "engine order", "EO", "", None),
}


def _of_each(what: str) -> tuple[str, ...]:
    return tuple(name for name, about in PARAMETERS.items() if about.per == what)


BLADE_PARAMETERS = _of_each("dof")
"""Those with one value per degree of freedom, of lumped models."""
CONTACT_PARAMETERS = _of_each("contact")
"""Those with one value per contact."""
FRICTION_PARAMETERS = tuple(name for name, about in PARAMETERS.items() if about.in_slip)
"""Those of dry friction."""


def dims_of(name: str) -> tuple[str, ...]:
    """Dimensions of one value of a parameter in a dataset."""
    per = PARAMETERS[name].per
    return () if per is None else (per,)
