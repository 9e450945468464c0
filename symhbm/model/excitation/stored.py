"""Excitations from their descriptions in datasets."""

from typing import Any

from symhbm.model.excitation.excitation import Excitation, ForceSum
from symhbm.model.excitation.forces import EngineOrder, HarmonicForce, PointForce
from symhbm.model.excitation.pattern import pattern_from_stored
from symhbm.model.excitation.static_load import StaticLoad

_KINDS = {kind.__name__: kind for kind in (PointForce, EngineOrder, HarmonicForce, StaticLoad)}
_BY_NUMBER = ("cosine", "sine", "values")
"""What may be by harmonic or by degree of freedom, whose numbers are texts in JSON."""


def described(description: dict[str, Any]) -> Excitation:
    """The excitation of an `Excitation.description` that went through JSON."""
    given = dict(description)
    kind = given.pop("type")
    if kind == ForceSum.__name__:
        return ForceSum(tuple(map(described, given["parts"])), given["amplitude"])
    for name in _BY_NUMBER:
        if isinstance(given.get(name), dict):
            given[name] = {int(number): value for number, value in given[name].items()}
    if "pattern" in given:
        given["pattern"] = pattern_from_stored(given["pattern"])
    return _KINDS[kind](**given)
