"""Excitations from their descriptions in datasets."""

from typing import Any

from symhbm.model.contacts import Parameter
from symhbm.model.excitation.base_motion import BaseMotion
from symhbm.model.excitation.excitation import Excitation, ForceSum
from symhbm.model.excitation.field_force import FieldForce
from symhbm.model.excitation.forces import EngineOrder, HarmonicForce, PointForce
from symhbm.model.excitation.frequency_force import FrequencyForce
from symhbm.model.excitation.pattern import pattern_from_stored
from symhbm.model.excitation.static_load import StaticLoad
from symhbm.model.parameters import PARAMETERS

_ALL = BaseMotion, EngineOrder, FieldForce, HarmonicForce, PointForce, StaticLoad
_KINDS = {kind.__name__: kind for kind in _ALL}
_BY_NUMBER = ("cosine", "sine", "values", "influence")
"""What may be by harmonic or by degree of freedom, whose numbers are texts in JSON."""


def described(description: dict[str, Any]) -> Excitation:
    """The excitation of an `Excitation.description` that went through JSON."""
    given = dict(description)
    kind = given.pop("type")
    if kind == ForceSum.__name__:
        return ForceSum(tuple(map(described, given["parts"])), given["amplitude"])
    if kind == FrequencyForce.__name__:
        forces = {int(power): described(force) for power, force in given.pop("forces").items()}
        base = given.pop("base")
        return FrequencyForce(forces, base=None if base is None else described(base), **given)
    for name in _BY_NUMBER:
        if isinstance(given.get(name), dict):
            given[name] = _by_number(given[name])
    for name in ("displacement", "velocity", "acceleration"):
        if given.get(name) is not None:
            given[name] = complex(*given[name])
    if "pattern" in given:
        given["pattern"] = pattern_from_stored(given["pattern"])
    return _KINDS[kind](**given)


def _by_number(values: dict[str, Any]) -> dict[int, Any]:
    """Values by numbers, whose rows may be so, too."""
    return {
        int(number): _by_number(value) if isinstance(value, dict) else value
        for number, value in values.items()
    }


def amplitude_of(units: str, meaning: str) -> dict[str, Parameter]:
    """The record of an amplitude that is no force, by its name."""
    record = PARAMETERS["force_amplitude"]
    return {"force_amplitude": record._replace(units=units, meaning=meaning, unit=units)}
