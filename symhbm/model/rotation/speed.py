"""The speed of rotation along an engine order: ``Omega = omega / order``."""

from symhbm.model.excitation import Excitation
from symhbm.model.structure import Structure


def speed_order(model: Structure) -> float | None:
    """The engine order along which a structure or its contacts change, None where nothing does.

    ValueError for several.
    """
    orders = {model.engine_order, *(group.law.engine_order for group in model.groups)} - {None}
    if len(orders) > 1:
        raise ValueError(
            f"engine_order: expected one for the structure and its contacts, got {sorted(orders)}"
        )
    return orders.pop() if orders else None


def check_at_one_speed(name: str, structure: Structure) -> None:
    """Raise TypeError for a structure whose matrices change with the speed of rotation."""
    if getattr(structure, "speeds", None) is not None:
        raise TypeError(
            f"{name}: expected matrices that do not change with the speed of rotation; give the "
            "structure at one speed, RotatingModel.at(speed), or a sector of one by its own "
            "at(speed)"
        )


def check_speed(model: Structure, excitation: Excitation) -> None:
    """Raise ValueError unless structure, contacts and excitation turn at one speed."""
    order = speed_order(model)
    if order is None or excitation.speed_ratios <= {float(order)}:
        return
    told = ", ".join(f"{ratio:g}" for ratio in sorted(excitation.speed_ratios))
    raise ValueError(
        f"excitation={excitation!r}: expected one of frequencies {order} times the speed of "
        f"rotation, as engine_order={order} of structure and contacts says; its engine orders over "
        f"their harmonics are {told}"
    )
