"""Groups of friction contacts, by what they are given: one direction, two, with a normal or not."""

from typing import Any

from symhbm.model.contacts.coulomb import Coulomb, PressedCoulomb
from symhbm.model.contacts.group import Contacts
from symhbm.model.contacts.law import ContactLaw
from symhbm.model.contacts.normal import Given, Preload, given_by_rotation, given_of
from symhbm.model.contacts.planar import PlanarFriction
from symhbm.model.contacts.varying_load import VariableLoadFriction


class Friction(Contacts):
    """Contacts that rub: a spring and a slider, pressed by a constant load or by the motion.

    With a ``normal`` direction the load varies with the motion, up to lift-off:
    ``N = max(N0 + k_n v, 0)``, ``|T| <= mu N``; without one it is the ``normal_load``.

    Parameters
    ----------
    tangential, across, normal
        Where contacts act, see `symhbm.Contacts`: ``(first, second)``, ``(dof,)`` or
        ``{dof: weight}``, or a sequence of them. With ``across``, at a right angle to
        ``tangential``, friction is planar: one circle bounds both forces. A contact closes where
        ``v``, the normal displacement, is positive; its force acts against it.
    contact_stiffness, normal_stiffness
        ``k_t`` and ``k_n`` [N/m], one value or one per contact.
    friction_coefficient
        ``mu``.
    normal_load, gap
        ``N0`` [N], or the gap [m] with ``N0 = -k_n gap``. The one that is given is the parameter:
        it stays as it is where the normal stiffness changes.
    preload
        ``"balanced"``: displacements are measured from the equilibrium under the preload.
        ``"coupled"``: from where nothing is loaded; static loads press the contacts, in
        harmonic 0.
    centrifugal_load, engine_order
        What rotation adds to the load, ``centrifugal_load (omega / engine_order)^2`` [N], one value
        or one per contact [kg m]: ``m r`` of a damper. The excitation is one of that engine order,
        so that ``omega / engine_order`` is the speed of rotation. Both or neither.

    Raises
    ------
    TypeError, ValueError
        As `symhbm.Contacts`; for neither or both of ``normal_load`` and ``gap``, and for a gap or a
        normal stiffness without a normal direction.

    Examples
    --------
    Two blades with a shroud between them that presses and rubs:

    >>> import numpy as np
    >>> import symhbm as sh
    >>> shroud = sh.Friction(
    ...     tangential=(0, 2), normal=(1, 3), contact_stiffness=1e4, normal_stiffness=2e4,
    ...     friction_coefficient=0.4, normal_load=4.0,
    ... )
    >>> model = sh.Model(
    ...     np.eye(4), np.diag([2, 3, 2, 3]), np.diag([1e4, 2.25e4, 1.04e4, 2.3e4]),
    ...     contacts={"shroud": shroud},
    ... )
    >>> force = sh.forces.HarmonicForce(cosine={1: [10, 5, 0, 0]}, sine={1: [0, 0, 10, -5]})
    >>> response = sh.frf(sh.HarmonicBalance(model, force), (10, 35), progress=False)
    >>> "onset of opening" in response.event_kind.values
    True
    """

    def __init__(
        self,
        *,
        tangential: Any,
        across: Any = None,
        normal: Any = None,
        contact_stiffness: Any,
        friction_coefficient: Any,
        normal_stiffness: Any = None,
        normal_load: Any = None,
        gap: Any = None,
        preload: Preload = "balanced",
        centrifugal_load: Any = None,
        engine_order: int | None = None,
    ):
        values = dict(
            contact_stiffness=contact_stiffness, friction_coefficient=friction_coefficient
        )
        given, load = given_of(normal_load, gap)
        values |= {given: load} | given_by_rotation(centrifugal_load, engine_order)
        if normal is None and (given == "gap" or normal_stiffness is not None):
            raise ValueError(
                "normal=None: expected the normal direction, a gap or a normal stiffness needs it"
            )
        directions = {"tangential": tangential}
        law = _law(across is not None, normal is not None, given, preload, engine_order)
        if across is not None:
            directions["across"] = across
        if normal is not None:
            directions["normal"], values["normal_stiffness"] = normal, normal_stiffness
        super().__init__(law, **directions, **values)


def _law(
    planar: bool, presses: bool, given: Given, preload: Preload, engine_order: int | None
) -> ContactLaw:
    """The law of friction in one direction or two, with a load that varies or a constant one."""
    if presses:
        return (PlanarFriction if planar else VariableLoadFriction)(given, preload, engine_order)
    if preload != "balanced":
        raise ValueError(
            f"preload={preload!r}: expected 'balanced' without a normal direction, the load is "
            "constant"
        )
    if planar:
        return PlanarFriction("constant", engine_order=engine_order)
    return Coulomb() if engine_order is None else PressedCoulomb(engine_order)
