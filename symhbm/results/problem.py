"""The problem of a dataset: its record, JSON and one row of numbers, and the problem made again."""

import json
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from symhbm.balance import HarmonicBalance
from symhbm.model import CONTACT_PARAMETERS, PARAMETERS, SHORT, Structure, is_pattern
from symhbm.model.contacts import ContactLaw, Contacts
from symhbm.model.excitation import BaseMotion, bases_of
from symhbm.model.records import NotRebuiltError, digest_of, joined, pack, packed, unpack
from symhbm.numerics import FloatArray
from symhbm.results.description import Description

NUMBERS = "problem_numbers"
"""Variable of the numbers of structure and excitation, to which the attribute tells the layout."""


class MissingLawError(NotRebuiltError):
    """A contact law that is not defined and was not given, or is another one."""


def record_of(problem: HarmonicBalance) -> tuple[dict[str, Any], FloatArray]:
    """What JSON tells of a problem, and its numbers (n,).

    Beside the records of structure and excitation it has what readers ask without making them.
    """
    model = problem.model
    structure, numbers = model.of_matrices("record", lambda: _alone(model))
    parts, felt = [numbers], model.as_felt(problem.excitation, problem.basis)
    bases = [_base(base, model, felt.amplitude) for base in bases_of(problem.excitation)]
    felt = felt.along_base(lambda base: np.nan_to_num(_translation(base, model)))
    objects = {"structure": structure, "excitation": packed(felt, parts)}
    numbers = joined(parts)
    told = objects | {
        "digest": digest_of(numbers, objects),
        "harmonics": list(problem.harmonics),
        "samples": problem.samples,
        "peaks_of": pack(problem.peaks_of, []),
        "peaking": None if problem.peaks_of is None else list(problem.peaking_words),
        "by_sector": problem.by_sector,
        "n_dof": model.n_dof,
        "n_whole": model.n_whole if model.frequency is not None else None,
        "lumped": model.lumped,
        "contacts": pack(model.contacts, []),
        "outputs": {name: pack(output, []) for name, output in model.outputs.items()},
        "parameters": {
            name: list(about)
            for name, about in problem.records.items()
            if about != PARAMETERS.get(name)
        },
        "bases": bases,
    }
    return told | _groups(model) | _in_waves(problem), numbers


def _alone(value: Any) -> tuple[Any, FloatArray]:
    """The record of an object by itself."""
    parts: list[FloatArray] = []
    told = packed(value, parts)
    return told, joined(parts)


def _base(base: BaseMotion, model: Structure, amplitude: float) -> dict[str, Any]:
    """A motion of the base as JSON keeps it: what is given, and where it takes a structure."""
    share = base.amplitude / amplitude if amplitude else 1.0
    moved = _translation(base, model).tolist()
    return {"motion": pack(base, []), "influence": moved, "share": share}


def _translation(base: BaseMotion, model: Structure) -> np.ndarray:
    """Where a unit motion of the base takes the degrees of freedom of a structure, (n_dof,).

    NaN of displacements of contacts, which need not move with it.
    """
    moved: Any = base.influence
    kept, n_whole, below = model.kept, model.n_numbered, model.beneath
    if isinstance(moved, tuple) and len(moved) == model.n_dof != n_whole:
        return np.array(moved, dtype=float)  # as an archive has it
    if below is not None and (kept is None or model.frequency is not None):
        whole = _translation(base, below)  # condensed structures keep what those numbered
        return whole if kept is None else _kept_of(whole, kept)
    if isinstance(moved, dict) and kept is not None:  # numbers of the whole
        named, moved = moved, np.zeros(n_whole)
        moved[[*named]] = [*named.values()]
    elif not isinstance(moved, tuple):
        moved = base.translation(model)
    moved = np.array(moved, dtype=float)
    if kept is None or len(moved) == model.n_dof != n_whole:
        return moved
    # Of one sector, where all of them are there.
    return _kept_of(np.tile(moved, n_whole // len(moved)), kept)


def _kept_of(whole: FloatArray, kept: NDArray[np.intp]) -> FloatArray:
    """Values of what is kept, NaN where that is beyond the whole."""
    return np.append(whole, np.nan)[np.minimum(kept, len(whole))]


def _in_waves(problem: HarmonicBalance) -> dict[str, Any]:
    """Displacements of contacts of a sector of a disk by the motion that is stored, by harmonic.

    ``{number along dof: (real, imaginary part of its weight)}`` of each, for ``a - i b``.
    """
    model = problem.model
    if model.nodal_diameters is None:
        return {}
    by_harmonic = {}
    for harmonic in problem.harmonics:
        lists = model.directions_in(harmonic).tolil()
        by_harmonic[harmonic] = [
            {dof: [complex(w).real, complex(w).imag] for dof, w in zip(each, weights, strict=True)}
            for each, weights in zip(lists.rows, lists.data, strict=True)
        ]
    order = problem.excitation.parameters.get("engine_order", model.order)
    n_sectors = model.interfaces.n_sectors
    return {"displacements": by_harmonic, "order": order, "n_sectors": n_sectors}


def _groups(model: Structure) -> dict[str, Any]:
    """Groups of contacts that have names, or a law of the user's own, as JSON keeps them."""
    if model.groups.are(SHORT):
        return {}
    groups, ends = {}, model.groups.row_ends
    for group in model.groups:
        law, numbers = _alone(group.law)
        groups[group.name] = {
            "law": law,
            "numbers": numbers.tolist(),
            "pairs": [[pack(ends[row], []) for row in rows] for rows in group.rows.T],
            "parameters": group.parameters,
            "variables": {own: list(about) for own, about in group.law.variables.items()},
        }
    return {"groups": groups}


def law_of(entry: Mapping[str, Any]) -> ContactLaw | None:
    """The law of a described group of contacts, None where its class is not defined."""
    try:
        return unpack(entry["law"], np.array(entry["numbers"]))
    except NotRebuiltError:
        return None


def describe_problem(dataset: xr.Dataset, laws: Iterable[ContactLaw] = ()) -> HarmonicBalance:
    """Build the problem that a dataset describes, with ``laws`` that archives do not hold.

    A swept or followed parameter has its nominal value, unless the dataset was reduced to one of
    its values. Raises NotRebuiltError for what the dataset does not hold.
    """
    metadata = Description(dataset)
    told, moving = metadata.problem, metadata.moving
    if NUMBERS not in dataset.variables:
        raise NotRebuiltError(
            f"of a structure that is not in it; select with {NUMBERS!r}, or compute on with the "
            "problem that gave this dataset"
        )
    numbers = dataset[NUMBERS].values
    objects = {name: told[name] for name in ("structure", "excitation")}
    if digest_of(numbers, objects) != told["digest"]:
        raise ValueError("the problem is not as it was stored")
    model, excitation = (unpack(each, numbers) for each in objects.values())
    varied = [*metadata.swept, *([moving] if moving != "frequency" else [])]

    def nominal(names: Iterable[str]) -> dict[str, FloatArray]:
        """Values of parameters, of a swept one the nominal ones."""
        return {n: dataset[f"{n}_nominal" if n in varied else n].values for n in names}

    if "groups" in told:
        model._set_contacts(_contacts_of(told["groups"], nominal, laws))
    else:
        model._set_contacts(metadata.contacts, **nominal(CONTACT_PARAMETERS))
    others = {*model.parameters} - {*model.groups.owners}
    model = model.with_parameters(**nominal(sorted(others)))._seeing(metadata.outputs)
    own = {"peaks_of": unpack(told["peaks_of"], numbers), "by_sector": told["by_sector"]}
    problem = HarmonicBalance(model, excitation, told["harmonics"], told["samples"], **own)
    chosen = {
        name: dataset[name].values
        for name in metadata.swept
        if name in dataset.variables and all(map(is_pattern, dataset[name].dims))
    }
    selected = moving in dataset.variables and dataset[moving].ndim == 0
    if selected and moving in problem.parameters:
        index = metadata.index
        values = np.array(problem.parameters[moving], dtype=float)
        values[... if index is None else index] = dataset[moving].values
        chosen[moving] = values
    return problem.with_parameters(**chosen)


def _contacts_of(
    groups: dict[str, Any], nominal: Any, laws: Iterable[ContactLaw]
) -> dict[str, Contacts]:
    """The groups of contacts by name, their laws those given or else those of the archive."""
    known = {}
    for law in laws:
        told, numbers = _alone(law)
        known[json.dumps([told, numbers.tolist()])] = law
    result, missing = {}, []
    for group, entry in groups.items():
        law = known.get(json.dumps([entry["law"], entry["numbers"]])) or law_of(entry)
        name, expected, n = entry["law"]["of"], [*entry["parameters"]], len(entry["pairs"])
        if law is None:
            missing.append(f"{name} (group {group!r})")
            continue
        if [*law.parameters] != expected or len(law.directions) != n:
            raise MissingLawError(
                f"laws: expected {name} with the parameters {', '.join(expected)} and "
                f"{n} directions, got {', '.join(law.parameters)} and {len(law.directions)}"
            )
        values = nominal(entry["parameters"].values())
        own = {own: values[called] for own, called in entry["parameters"].items()}
        none = np.zeros(0)
        result[group] = Contacts(law, *([*unpack(each, none)] for each in entry["pairs"]), **own)
    if missing:
        raise MissingLawError(
            f"laws: this dataset was computed with {', '.join(missing)}, which is not defined "
            "here; import the file that defines it, or give the law, as in laws=[...]"
        )
    return result
