"""The problem behind a dataset: its parameters, matrices and description, and its rebuilding."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.metadata import version
from typing import Any

import numpy as np
import scipy.sparse as sp
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.model import (
    BLADE_PARAMETERS,
    CONTACT_PARAMETERS,
    FRICTION_PARAMETERS,
    PARAMETERS,
    Excitation,
    Model,
    StructuralDamping,
    Structure,
    described,
    is_pattern,
)
from symhbm.model.condensation import CondensedModel, CondensedSector
from symhbm.model.contacts import (
    ContactLaw,
    Contacts,
    Coulomb,
    CubicSpring,
    Parameter,
    PlanarFriction,
    PressedCoulomb,
    SmoothForce,
    UnilateralSpring,
    VariableLoadFriction,
    from_stored,
    named,
    to_stored,
)
from symhbm.model.cyclic import Sector
from symhbm.model.excitation import BaseMotion, bases_of, motions_of_base
from symhbm.model.outputs import Output
from symhbm.model.reduction import DeviatingModel, deviations_of
from symhbm.model.rotation import recalled_model, speed_order
from symhbm.results.description import Description, check_names
from symhbm.results.places import of_places, places_of
from symhbm.results.request import Request
from symhbm.results.sweep import Sweep
from symhbm.results.variables import VARIABLES

SCHEMA_VERSION = 2
REFERENCE = (
    "E. Chatelet, D. Rade, G. Jacquet-Richardet, Dynamic Behavior of Cyclic Symmetrical N DOF "
    "System in the Presence of Dry Friction, DINAME 2013, hal-00941429"
)
DRAWN = "drawn"
"""Attribute of a swept parameter that tells how its values were drawn."""
LABELS = ("dof", "contact", "harmonic", "component")
OF_STRUCTURE = "structure_dof"
"""Coordinate of condensed structures: which degrees of freedom are kept."""
NUMBERS = "condensed_numbers"
"""Variable of condensed structures: their poles, residues and all else that makes them again."""
STRUCTURE_NUMBERS = "structure_numbers"
"""Variable of other structures without constant matrices, sectors for example: the same."""
LARGEST_OF = "largest_of"
"""Attribute of datasets of condensed structures: the degrees of freedom that maxima are of."""
DISPLACEMENTS = "displacements"
"""Attribute of datasets of what a moving base drives: which displacements they hold."""
SEEN = {"relative": "relative to the moving base", "absolute": "absolute"}
SPEED_ORDER = "speed_order"
"""Attribute of datasets of what changes with the speed of rotation: frequencies over it."""
EVALUATED_BY = "equations_evaluated_by"
"""Attribute of curves that tells what evaluates the equations, to the same bits."""
_EVALUATORS = {1: "machine code", 0: "the virtual machine of CasADi"}
LEFT_OUT = "force_left_out"
"""Attribute of motions that no force drives, of a problem with one."""
SPEEDS = ("speed", "peak_speed", "event_speed", "branch_speed")
OF_LARGEST = {"peak_amplitude", "peak_dof"}
"""Variables that depend on the degrees of freedom kept."""
Sizes = tuple[int, int, tuple[int, ...]]
MATRICES = ("mass_matrix", "damping_matrix", "stiffness_matrix")
_LOSS = "loss_matrix"
"""What a loss factor makes of the stiffness of a tuned disk."""
_ENTRIES = ("row", "column", "value")
_OF_BLADES = ("place", "number", "value")
_LAWS: dict[str, Any] = {
    kind.__name__: kind
    for kind in (
        Coulomb,
        CubicSpring,
        PlanarFriction,
        PressedCoulomb,
        SmoothForce,
        UnilateralSpring,
        VariableLoadFriction,
    )
}


class NotRebuiltError(LookupError):
    """A problem that its description alone does not make again."""


class MissingLawError(NotRebuiltError):
    """A contact law that is none of the library's and was not given, or is another one."""


@dataclass
class DatasetParts:
    """Variables, coordinates and attributes of a dataset, which is slow to make one by one.

    ``variables`` and ``coordinates`` are (dims, values, attributes) or ready-made, by name;
    ``sizes``, the numbers of degrees of freedom and of contacts and the harmonics, where they have
    labels.
    """

    variables: dict[str, Any]
    coordinates: dict[str, Any]
    attributes: dict[str, Any]
    sizes: Sizes | None = None

    @classmethod
    def of(cls, dataset: xr.Dataset) -> "DatasetParts":
        """The parts of a dataset with labels."""
        whole = dataset.variables
        variables = {str(name): whole[name] for name in dataset.data_vars}
        coordinates = {str(name): whole[name] for name in dataset.coords if name not in LABELS}
        sizes = dataset.sizes["dof"], dataset.sizes["contact"], tuple(whole["harmonic"].values)
        return cls(variables, coordinates, dict(dataset.attrs), sizes)

    def dataset(self) -> xr.Dataset:
        """The dataset."""
        parts = self.variables | self.coordinates
        variables = {name: _variable(part) for name, part in parts.items()}
        labels = xr.Coordinates() if self.sizes is None else _labels(*self.sizes)
        coordinates = [*self.coordinates]
        if SPEED_ORDER in self.attributes:
            speeds = _speeds(variables, speed_orders(variables, self.attributes))
            variables, coordinates = variables | speeds, [*coordinates, *speeds]
        if LARGEST_OF in self.attributes:
            for name in OF_LARGEST & {*variables}:
                variables[name] = _of_kept(variables[name], self.attributes[LARGEST_OF])
        return xr.Dataset(variables, labels, self.attributes).set_coords(coordinates)


def speed_orders(variables: Mapping[Any, Any], attributes: Mapping[str, Any]) -> xr.Variable:
    """The frequency over the speed of rotation, one or one per parameter set, NaN where none is."""
    order = xr.Variable((), attributes.get(SPEED_ORDER, np.nan))
    if (nominal := variables.get("engine_order_nominal")) is None:
        return order
    return abs(order * variables["engine_order"] / nominal)


def _speeds(variables: dict[str, Any], orders: xr.Variable) -> dict[str, Any]:
    """The speed of rotation [1/min] beside each frequency, along engine orders."""
    result = {}
    for name in SPEEDS:
        frequency = variables.get(name.replace("speed", "frequency"))
        if frequency is not None:
            about = VARIABLES[name]
            attributes = {"units": about.units, "long_name": about.long_name}
            speed = 60 / orders * frequency
            dims = (*(dim for dim in orders.dims if dim not in frequency.dims), *frequency.dims)
            result[name] = xr.Variable(dims, speed.transpose(*dims).values, attributes)
    return result


def _of_kept(variable: Any, kept: str) -> Any:
    """A variable whose long name names the degrees of freedom it was computed from."""
    long_name = str(variable.attrs["long_name"])
    changed = variable.copy(deep=False)
    changed.attrs["long_name"] = long_name if kept in long_name else f"{long_name}, of the {kept}"
    return changed


def _variable(part: Any) -> Any:
    """A part as an xarray variable, made without xarray's slow search for array packages."""
    if isinstance(part, xr.DataArray):
        return part
    if isinstance(part, xr.Variable):
        return part.copy(deep=False)
    dims, values, attributes = part
    return xr.Variable(dims, np.asarray(values), attributes, fastpath=True)


@lru_cache(maxsize=64)
def _labels(n_dof: int, n_contacts: int, harmonics: tuple[int, ...]) -> xr.Coordinates:
    """Coordinates that many datasets share: their indices are slow to make."""
    long_names = {"dof": "degree of freedom", "contact": "contact"}
    long_names["harmonic"] = "harmonic of the excitation frequency"
    values = {"dof": np.arange(n_dof), "contact": np.arange(n_contacts)}
    values["harmonic"] = np.array(harmonics)
    parts = {
        name: (name, values[name], {"long_name": long_name, "units": "1"})
        for name, long_name in long_names.items()
    }
    components = np.array(["cos", "sin"], dtype=object)
    parts["component"] = "component", components, {"long_name": "component of the harmonic"}
    return xr.Coordinates({name: _variable(part) for name, part in parts.items()})


def _searched(request: Request) -> str:
    """Where limit cycles were looked for, and where not."""
    assert request.amplitudes is not None
    assert request.mode is not None
    modes = ", ".join(map(str, np.atleast_1d(request.mode)))
    low, high = request.amplitudes
    wave = "" if request.nodal_diameter is None else f" of {request.nodal_diameter} nodal diameters"
    at = "" if request.name == "amplitude" else (
        f"; at both ends and in the middle of the band of {request.name} and at its nominal value, "
        "where none is found there between them, and along the branches found"
    )  # fmt: skip
    return (
        f"modes {modes}{wave}, for amplitudes of {low:g} to {high:g} m of the first harmonic at "
        f"degree of freedom {request.dof}, where the damping ratio of the nonlinear mode is 0{at}; "
        "motions that lie on no such mode, and motions of several frequencies, were not looked for"
    )


def with_provenance(
    variables: dict[str, Any],
    coordinates: dict[str, Any],
    problem: HarmonicBalance,
    sweep: Sweep,
    request: Request | None = None,
    harmonics: tuple[int, ...] | None = None,
) -> DatasetParts:
    """Variables and coordinates with the parameters, the problem and the versions behind them.

    ``harmonics`` are those of the coefficients, by default those of the problem.

    Raises ValueError for parameters of contacts that are called as results are.
    """
    check_names(problem)
    variables, coordinates = dict(variables), dict(coordinates)
    for name, value in problem.parameters.items():
        about = problem.records[name]
        long_name, attributes = about.meaning, {"units": about.units, "long_name": about.meaning}
        dims = () if np.ndim(value) == 0 else problem.model.dims_of(name)
        if name in sweep.values:
            swept = sweep.values[name]
            drawn = {DRAWN: swept.attrs[DRAWN]} if DRAWN in swept.attrs else {}
            target = coordinates if swept.dims == (name,) else variables
            target[name] = (swept.dims, swept.values, attributes | drawn)
            for label, coordinate in swept.coords.items():
                if label not in (name, *LABELS, *coordinates):
                    defaults = {"long_name": str(label), "units": "1"}
                    labelled = coordinate.assign_attrs(defaults | coordinate.attrs)
                    coordinates[str(label)] = (
                        labelled.variable
                    )  # its own coordinate has no attributes
        nominal = name in sweep.values or (request and name == request.name)
        if nominal:
            attributes = attributes | {"long_name": f"{long_name}, nominal value"}
        stored_name = f"{name}_nominal" if nominal else name
        variables[stored_name] = (dims, np.array(value), attributes)
    coordinates |= of_places(problem.model)
    if problem.model.kept is not None:
        attributes = {"long_name": "degree of freedom of the whole structure", "units": "1"}
        coordinates[OF_STRUCTURE] = ("dof", problem.model.kept, attributes)
    if problem.model.numbers is not None:
        condensed = isinstance(problem.model, CondensedModel)
        name, what = (NUMBERS, "condensed") if condensed else (STRUCTURE_NUMBERS, "structure")
        long_name = f"{what.replace('ed', 'ed structure')}, as the problem lays it out"
        attributes = {"long_name": long_name, "units": "1"}
        variables[name] = ((f"{what}_entry",), problem.model.numbers, attributes)
    deviates = isinstance(problem.model, DeviatingModel)
    if (problem.model.has_matrices or deviates) and not problem.model.lumped:
        for name in MATRICES:
            part = problem.model.constant_part(name.removesuffix("_matrix"))
            variables |= _sparse(name, part)
    if isinstance(problem.model, DeviatingModel):
        if problem.model.loss_factor:
            variables |= _sparse(_LOSS, problem.model.loss_stiffness())
        for name, entries in problem.model.blades.items():
            variables |= _of_blades(name, sp.coo_array(entries))
    global_attributes = {
        "title": "Forced response of a structure with dry friction by multi-harmonic balance",
        "references": REFERENCE,
        "symhbm_schema": SCHEMA_VERSION,
        "symhbm_version": _version("symhbm"),
        "casadi_version": _version("casadi"),
        "problem": json.dumps(_description(problem)),
        "swept": json.dumps(list(sweep.values)),
    }
    if request and request.unforced is not None:
        kind = request.unforced.capitalize()
        global_attributes["title"] = f"{kind} of a structure by multi-harmonic balance"
        if request.unforced == "limit cycle":
            global_attributes["searched"] = _searched(request)
        if problem.excitation.amplitude:
            global_attributes[LEFT_OUT] = "what of the force oscillates; static loads act"
    if request:
        global_attributes |= evaluated_by([request.machine_code])
        global_attributes["followed"] = json.dumps(request.to_json(problem.harmonics))
        if request.accuracy is not None:
            global_attributes["accuracy"] = request.accuracy
    model = problem.model
    for motion in motions_of_base(problem.excitation):
        global_attributes[DISPLACEMENTS] = SEEN[motion]
    if (order := speed_order(model)) is not None:
        global_attributes[SPEED_ORDER] = order
    if model.kept is not None:
        between = int(np.count_nonzero(model.kept >= model.n_whole))
        told = f"{model.n_dof - between} degrees of freedom kept of {model.n_whole}"
        beside = f" and {between} displacements of contacts" if between else ""
        global_attributes[LARGEST_OF] = told + beside
    sizes = model.n_dof, model.n_contacts, harmonics or problem.harmonics
    return DatasetParts(variables, coordinates, global_attributes, sizes)


def evaluated_by(by_machine_code: Iterable[int]) -> dict[str, str]:
    """The attribute that tells what evaluated curves: 1 for machine code, 0 without, -1 for none.

    It may be both, as workers on other machines may have no compiler. Empty for no curves.
    """
    found = {int(each) for each in by_machine_code}
    by = [text for state, text in _EVALUATORS.items() if state in found]
    return {EVALUATED_BY: " and ".join(by)} if by else {}


def states_of(dataset: xr.Dataset) -> list[int]:
    """What evaluated some of its curves, as `evaluated_by` takes it."""
    told = dataset.attrs.get(EVALUATED_BY, "").split(" and ")
    return [state for state, text in _EVALUATORS.items() if text in told]


@cache
def _version(package: str) -> str:
    return version(package)


def variables_of_model(dataset: xr.Dataset) -> list[str]:
    """Names of the variables that hold what vibrates, as far as a dataset may have them."""
    of_matrices = [f"{name}_{part}" for name in (*MATRICES, _LOSS) for part in _ENTRIES]
    changes = deviations_of(Description(dataset).blade_modes).values()
    of_blades = {f"blade_{about.part}_{part}": None for about in changes for part in _OF_BLADES}
    return [*of_matrices, *of_blades, NUMBERS, STRUCTURE_NUMBERS]


def _sparse(name: str, matrix: Any) -> dict[str, tuple]:
    columns = np.repeat(np.arange(matrix.shape[1]), np.diff(matrix.indptr))
    units = PARAMETERS["stiffness" if name == _LOSS else name.removesuffix("_matrix")].units
    parts = {
        "row": (matrix.indices.astype(np.int64), "row", "1"),
        "column": (columns, "column", "1"),
        "value": (matrix.data, "stored entries", units),
    }
    long_name, entry = name.replace("_", " "), (f"{name}_entry",)
    return {
        f"{name}_{part}": (entry, values, {"long_name": f"{long_name}, {words}", "units": unit})
        for part, (values, words, unit) in parts.items()
    }


def _of_blades(name: str, entries: Any) -> dict[str, tuple]:
    """A part of all blades among the stored entries of a matrix, by its name in a `Deviation`."""
    matrix, mode = (name, "") if name in PARAMETERS else ("stiffness", name.replace("_", " "))
    long_name = f"part of the {matrix} matrix that is the blade's{mode and f', {mode} alone'}"
    units = PARAMETERS[matrix].units
    parts = {
        "place": (entries.row.astype(np.int64), "stored entry", "1"),
        "number": (entries.col.astype(np.int64), "blade", "1"),
        "value": (entries.data, "value", units),
    }
    return {
        f"blade_{name}_{part}": (
            (f"blade_{name}_entry",),
            values,
            {"long_name": f"{long_name}, {what}", "units": unit},
        )
        for part, (values, what, unit) in parts.items()
    }


def _description(problem: HarmonicBalance) -> dict[str, Any]:
    excitation = problem.model.as_felt(problem.excitation, problem.basis)
    outputs = {name: output.to_stored() for name, output in problem.model.outputs.items()}
    model, amplitude = problem.model, excitation.amplitude
    excitation = excitation.along_base(lambda base: np.nan_to_num(_translation(base, model)))
    bases = [_base(base, model, amplitude) for base in bases_of(problem.excitation)]
    return (
        problem.model.description()
        | _groups(problem.model)
        | _in_waves(problem)
        | {
            "harmonics": list(problem.harmonics),
            "samples": problem.samples,
            "n_dof": problem.model.n_dof,
            "contacts": to_stored(problem.model.contacts),
            "lumped": problem.model.lumped,
            "excitation": excitation.description(),
        }
        | ({"amplitude": [excitation.units, excitation.meaning]} if excitation.changes else {})
        | ({"bases": bases} if bases else {})
        | ({"outputs": outputs} if outputs else {})
        | ({} if problem.peaks_of is None else {"peaks_of": problem.peaks_of})
    )


def _base(base: BaseMotion, model: Structure, amplitude: float) -> dict[str, Any]:
    """A motion of the base as JSON keeps it: what is given, and where it takes a structure."""
    share = base.amplitude / amplitude if amplitude else 1.0
    moved = _translation(base, model).tolist()
    return base.description() | {"influence": moved, "share": share}


def _translation(base: BaseMotion, model: Structure) -> np.ndarray:
    """Where a unit motion of the base takes the degrees of freedom of a structure, (n_dof,).

    NaN of displacements of contacts, which need not move with it.
    """
    moved: Any = base.influence
    kept, n_whole = model.kept, model.n_numbered
    if isinstance(moved, dict) and kept is not None:  # numbers of the whole
        named, moved = moved, np.zeros(n_whole)
        moved[[*named]] = [*named.values()]
    elif not isinstance(moved, tuple):
        moved = base.translation(model)
    moved = np.array(moved, dtype=float)
    if kept is None or len(moved) == model.n_dof != n_whole:
        return moved
    whole = np.tile(moved, n_whole // len(moved))  # of one sector, where all of them are there
    return np.append(whole, np.nan)[np.minimum(kept, n_whole)]


def _in_waves(problem: HarmonicBalance) -> dict[str, Any]:
    """Displacements of contacts of a sector of a disk by the motion that is stored, by harmonic.

    ``{number along dof: (real, imaginary part of its weight)}`` of each, for ``a - i b``.
    """
    model = problem.model
    if model.nodal_diameters is None:
        return {}
    by_harmonic = {}
    for harmonic in problem.harmonics:
        rows = [
            {dof: [complex(w).real, complex(w).imag] for dof, w in zip(each, weights, strict=True)}
            for each, weights in zip(*_lists(model.directions_in(harmonic)), strict=True)
        ]
        by_harmonic[harmonic] = rows
    order = problem.excitation.parameters.get("engine_order", model.order)
    return {"displacements": by_harmonic, "order": order}


def _lists(matrix: Any) -> tuple[Any, Any]:
    """Columns and values of the rows of a sparse matrix."""
    lists = matrix.tolil()
    return lists.rows, lists.data


def _groups(model: Structure) -> dict[str, Any]:
    """Groups of contacts that have names, or a law of the user's own, as JSON keeps them."""
    if model.is_short:
        return {}
    groups = {}
    for group in model.groups:
        pairs = [[to_stored(model.row_ends[row]) for row in rows] for rows in group.rows.T]
        records = {own: list(record) for own, record in group.law.parameters.items()}
        kind = type(group.law)
        if kind not in _LAWS.values() and kind.__name__ in _LAWS:
            raise ValueError(
                f"problem: the contact law {kind.__name__} of group {group.name!r} needs a class "
                "name of its own, datasets tell laws by it"
            )
        groups[group.name] = {
            "law": kind.__name__,
            "attributes": _attributes_of(group.law),
            "pairs": pairs,
            "parameters": records,
            "variables": {own: list(about) for own, about in group.law.variables.items()},
        }
    return {"groups": groups}


def _attributes_of(law: ContactLaw) -> dict[str, Any]:
    """What tells laws of one class apart, as JSON keeps it."""
    plain = bool, int, float, str, type(None)
    return {
        name: value if isinstance(value, plain) else np.array(value).tolist()
        for name, value in vars(law).items()
        if isinstance(value, (*plain, list, tuple, np.ndarray, np.generic))
    }


def _shown(kind: str, attributes: dict[str, Any]) -> str:
    inside = ", ".join(f"{name}={value}" for name, value in attributes.items())
    return f"{kind}({inside})" if inside else kind


def describe_problem(dataset: xr.Dataset, laws: Iterable[ContactLaw] = ()) -> HarmonicBalance:
    """Build the problem that a dataset describes; ``laws`` are those that are not the library's.

    A swept or followed parameter has its nominal value, unless the dataset was reduced to one of
    its values. Raises MissingLawError for a law that is missing or another one.
    """
    metadata = Description(dataset)
    description = metadata.problem
    if metadata.structure is not None and STRUCTURE_NUMBERS not in dataset.variables:
        raise NotRebuiltError(
            f"of a structure {metadata.structure['type']}, whose class is not in it; compute on "
            "with the problem that gave this dataset"
        )
    moving = metadata.moving
    varied = [*metadata.swept, *([moving] if moving != "frequency" else [])]
    excitation = _excitation_of(description["excitation"], varied)
    # Cubic springs came with the second schema.
    names = CONTACT_PARAMETERS if dataset.attrs["symhbm_schema"] > 1 else FRICTION_PARAMETERS
    lumped, contacts = description["lumped"], description["contacts"]
    if "groups" not in description:
        contacts = [*map(from_stored, contacts)]
    else:
        contacts = _contacts_of(dataset, description["groups"], varied, laws)
        names = ()
    nominal = {name: _nominal(dataset, name, varied) for name in names}
    if metadata.condensed is not None:
        model = _condensed(dataset, description, contacts, nominal)
    elif metadata.structure is not None:
        model = _of_numbers(dataset, description, contacts, nominal)
    else:
        if lumped:
            matrices = [sp.eye_array(description["n_dof"], format="csc")] * 3
        else:
            matrices = [_matrix(dataset, name, description["n_dof"]) for name in MATRICES]
        places = places_of(dataset)
        if "blade_stiffness_value" in dataset.variables:
            model = _with_blades(dataset, matrices, contacts, varied)
        else:
            model = Model(*matrices, contacts=contacts, lumped=lumped, places=places, **nominal)
    of_blades = {name: _nominal(dataset, name, varied) for name in BLADE_PARAMETERS if lumped}
    if told := description.get("outputs"):
        model = model._seeing({name: Output.from_stored(name, each) for name, each in told.items()})
    problem = HarmonicBalance(
        model.with_parameters(**of_blades),
        excitation,
        description["harmonics"],
        description.get("samples"),
        peaks_of=description.get("peaks_of"),
    )
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


def _condensed(
    dataset: xr.Dataset, description: dict[str, Any], contacts: Any, nominal: dict[str, Any]
) -> CondensedModel:
    if NUMBERS not in dataset.variables or "layout" not in description["condensed"]:
        raise NotRebuiltError(
            "of a condensed structure that is not in it, as those of earlier versions and of "
            "displacements of contacts are not; condense the structure again, or compute on with "
            "the problem that gave this dataset"
        )
    numbers = dataset[NUMBERS].values
    told, places = description["condensed"], places_of(dataset)
    kind = CondensedSector if "n_sectors" in told else CondensedModel
    return kind.from_stored(told, numbers, contacts, places, **nominal)


def _of_numbers(
    dataset: xr.Dataset, description: dict[str, Any], contacts: Any, nominal: dict[str, Any]
) -> Structure:
    """A sector, a structure that turns, or one with a loss factor."""
    told, numbers = description["structure"]["stored"], dataset[STRUCTURE_NUMBERS].values
    if "n_sectors" in description["structure"]:
        return Sector.from_stored(told, numbers, contacts, **nominal)
    model = recalled_model(told, numbers, description["lumped"])
    model._store(places=places_of(dataset))
    model._set_contacts(contacts, **nominal)
    return model


def _contacts_of(
    dataset: xr.Dataset, groups: dict[str, Any], varied: list[str], laws: Iterable[ContactLaw]
) -> dict[str, Contacts]:
    """The groups of contacts by name, their laws among those given."""
    known = {_shown(type(law).__name__, _attributes_of(law)): law for law in laws}
    result, missing = {}, []
    for group, entry in groups.items():
        shown = _shown(entry["law"], entry.get("attributes", {}))
        law, expected = known.get(shown) or law_of_library(entry), [*entry["parameters"]]
        if law is None:
            missing.append(f"{shown} (group {group!r})")
            continue
        if [*law.parameters] != expected or len(law.directions) != len(entry["pairs"]):
            raise MissingLawError(
                f"laws: expected {entry['law']} with the parameters {', '.join(expected)} and "
                f"{len(entry['pairs'])} directions, got {', '.join(law.parameters)} and "
                f"{len(law.directions)}"
            )
        result[group] = law, [[*map(from_stored, each)] for each in entry["pairs"]]
    if missing:
        raise MissingLawError(
            f"laws: this dataset was computed with {', '.join(missing)}, which is no law of this "
            "library; give it, as in laws=[...]"
        )
    names = named({group: law.parameters for group, (law, _) in result.items()})
    return {
        group: Contacts(
            law, *pairs, **{own: _nominal(dataset, n, varied) for own, n in names[group].items()}
        )
        for group, (law, pairs) in result.items()
    }


def law_of_library(entry: dict[str, Any]) -> ContactLaw | None:
    """The law of a described group of contacts, None for one of the user's own class.

    One of the user's expressions is told whole, as plain operations.
    """
    kind, attributes = _LAWS.get(entry["law"]), entry.get("attributes", {})
    if kind is SmoothForce:
        records = {name: Parameter(*record) for name, record in entry["parameters"].items()}
        return SmoothForce(**attributes, parameters=records)
    return None if kind is None else kind(**attributes)


def _excitation_of(stored: dict[str, Any], varied: list[str]) -> Excitation:
    if "0" in stored.get("cosine", {}) and "force_amplitude" in varied:
        raise NotRebuiltError(
            "force_amplitude: expected other parameters in a dataset with a mean force, this one "
            "is of a version that scaled the mean with the amplitude; its values can be read"
        )
    return described(stored)


def _nominal(dataset: xr.Dataset, name: str, varied: list[str]) -> np.ndarray:
    return dataset[f"{name}_nominal" if name in varied else name].values


def _with_blades(
    dataset: xr.Dataset, matrices: list[Any], contacts: Any, varied: list[str]
) -> DeviatingModel:
    base: dict[str, Any] = dict(zip(("mass", "damping", "stiffness"), matrices, strict=True))
    description, structural = Description(dataset), None
    if loss_factor := description.problem.get("loss_factor"):
        structural = StructuralDamping(loss_factor)
        base["loss"] = _matrix(dataset, _LOSS, base["stiffness"].shape[0])
    deviations = deviations_of(description.blade_modes)
    values = {name: _nominal(dataset, name, varied) for name in deviations}
    shape = len(np.atleast_1d(next(iter(values.values()))))
    blades = {}
    for matrix, name, _ in deviations.values():
        place, number, value = (dataset[f"blade_{name}_{part}"].values for part in _OF_BLADES)
        size = base[matrix].nnz, shape
        blades[name] = sp.csr_array((value, (place, number)), shape=size)
    return DeviatingModel(base, blades, contacts, structural, **values)


def _matrix(dataset: xr.Dataset, name: str, size: int) -> Any:
    row, column, value = (dataset[f"{name}_{part}"].values for part in ("row", "column", "value"))
    return sp.csc_array((value, (row, column)), shape=(size, size))
