"""Models of the usual structures: one blade with a damper to the ground, and a ring of blades."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from symhbm.model.matrices import Model, diagonal
from symhbm.numerics import check


def single_blade(
    *,
    mass: float,
    stiffness: float,
    damping: float,
    contact_stiffness: float,
    friction_coefficient: float,
    normal_load: float,
    cubic_stiffness: float = 0.0,
) -> Model:
    """One blade on a ground spring with one friction damper to the ground: Fig. 1 and Eq. (1).

    Values in kg, N/m, N s/m, N/m, -, N, N/m^3. Raises as `Model`.

    Examples
    --------
    >>> import symhbm as sh
    >>> sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    Model: 1 lumped blade, 1 contact
      mass                  1 kg
      damping               0.5 N s/m
      stiffness             10000 N/m
      contact_stiffness     10000 N/m
      friction_coefficient  0.5
      normal_load           3 N
    """
    return _lumped(
        [(0,)],
        dict(mass=mass, damping=damping, stiffness=stiffness),
        contact_stiffness=contact_stiffness,
        friction_coefficient=friction_coefficient,
        normal_load=normal_load,
        cubic_stiffness=cubic_stiffness,
    )


def bladed_disk(
    n_blades: int,
    *,
    mass: ArrayLike,
    stiffness: ArrayLike,
    damping: ArrayLike,
    contact_stiffness: ArrayLike,
    friction_coefficient: ArrayLike,
    normal_load: ArrayLike,
    cubic_stiffness: ArrayLike = 0.0,
) -> Model:
    """Ring of blades on ground springs, each coupled to the next by a friction damper (Fig. 5).

    Contact ``j`` joins blades ``j`` and ``(j + 1) mod n_blades``. Each parameter is one value or
    one per blade or contact, in kg, N/m, N s/m, N/m, -, N, N/m^3. Raises as `Model`, and ValueError
    for fewer than 3 blades.

    Examples
    --------
    >>> import symhbm as sh
    >>> disk = sh.bladed_disk(
    ...     3, mass=[1, 1.01, 0.99], stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e6, friction_coefficient=0.5, normal_load=10,
    ... )
    >>> disk.contacts
    ((0, 1), (1, 2), (2, 0))
    """
    n_blades = check.integer("n_blades", n_blades, minimum=3)
    return _lumped(
        [(j, (j + 1) % n_blades) for j in range(n_blades)],
        dict(mass=mass, damping=damping, stiffness=stiffness),
        contact_stiffness=contact_stiffness,
        friction_coefficient=friction_coefficient,
        normal_load=normal_load,
        cubic_stiffness=cubic_stiffness,
    )


def _lumped(contacts: Any, values: dict[str, ArrayLike], **of_contacts: Any) -> Model:
    """Blades on ground springs, as many as contacts."""
    matrices = [diagonal(name, value, len(contacts)) for name, value in values.items()]
    return Model(*matrices, contacts=contacts, lumped=True, **of_contacts)
