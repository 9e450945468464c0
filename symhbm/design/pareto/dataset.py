"""The front of two aims as a labelled dataset, and what is said of it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from symhbm.continuation import Status
from symhbm.design import tolerances
from symhbm.design.cases import Cases
from symhbm.design.maxima import amplitudes
from symhbm.design.outcome import in_units, labelled
from symhbm.design.pareto.points import END, FLAT, FrontPoint
from symhbm.design.program import Aim, Program
from symhbm.design.variables import DesignVariables
from symhbm.results import records_of_problem


def dataset_of(
    points: Sequence[FrontPoint], program: Program, aims: Sequence[Aim], cases: Cases
) -> xr.Dataset:
    """All variables of a front but its responses; removed points are apart."""
    variables = program.variables
    on, off = ([p for p in points if bool(p.removed) == removed] for removed in (False, True))
    units = [cases.work.problem.records[group.parameter].units for group in variables.groups]
    actives = [point.found.active for point in on]
    heights = [
        program.levels(np.array([state.height for state in point.found.design.states]))
        for point in on
    ]
    n_active = np.array([0 if a is None else len(a.maxima) for a in actives], dtype=np.int32)
    table: dict[str, Any] = {
        "aim": ("aim", np.array([aim.name for aim in aims], dtype=object)),
        "variable": ("variable", _texts([group.label for group in variables.groups])),
        "variable_units": ("variable", _texts(units)),
        "design_lower": ("variable", np.exp(variables.lower)),
        "design_upper": ("variable", np.exp(variables.upper)),
        "named_peak": ("named_peak", _texts(program.peaks)),
        "front_aim": (("front", "aim"), _aims(on)),
        "front_value": (("front", "variable"), _values(variables, on)),
        "front_kind": ("front", _texts([point.kind for point in on])),
        "front_place": ("front", np.array([point.along for point in on])),
        "front_status": ("front", _texts([str(point.status) for point in on])),
        "front_optimality": (
            "front",
            np.array([np.nan if a is None else a.stationarity for a in actives]),
        ),
        "front_n_active": ("front", n_active),
        "front_peak_amplitude": (
            ("front", "named_peak"),
            amplitudes(np.array(heights)).reshape(-1, len(program.peaks)),
        ),
        "removed_aim": (("removed", "aim"), _aims(off)),
        "removed_value": (("removed", "variable"), _values(variables, off)),
        "removed_place": ("removed", np.array([point.along for point in off])),
        "removed_reason": ("removed", _texts([point.removed for point in off])),
        "n_surveys": ((), np.int32(cases.surveys)),
        "n_followed": ((), np.int32(cases.follows)),
        "n_failed": ((), np.int32(len(cases.failed))),
    }
    return in_units(labelled(table, records_of_problem(cases.work.problem)), cases.work.peaks)


def status_of_front(points: Sequence[FrontPoint]) -> Status:
    """Status of a front: good where both ends are there and no point failed."""
    ends = [point for point in points if point.kind == END]
    if not all(np.all(np.isfinite(point.aims)) for point in ends):
        return next(p.status for p in ends if not np.all(np.isfinite(p.aims)))
    failed = [point for point in points if point.removed == str(point.status)]
    doubtful = [point for point in points if point.status == Status.DESIGN_BESIDE_FAILURES]
    return Status.FRONT_INCOMPLETE if failed or doubtful else Status.FRONT_FOUND


def certificate_of(points: Sequence[FrontPoint], aims: Sequence[Aim], check: str) -> str:
    """Sentences on the points of a front, those removed, and what is not known."""
    on = [point for point in points if not point.removed]
    sentences = [f"{len(on)} of {len(points)} points are on the front of {_both(aims)}."]
    for point in points:
        if point.kind == END:
            aim = aims[round(point.along)].name
            share = f", up to {point.up_to:g} of it" if point.up_to else ""
            share += ", which is as good at designs around it" if point.status in FLAT else ""
            said = f"at the optimum of {aim}{share}: {_told(point, aims)}"
            sentences.append(f"End {said}{f' ({point.removed})' if point.removed else ''}.")
    optima = [p.found.active.stationarity for p in on if p.found.active is not None]
    if optima:
        sentences.append(
            f"{len(optima)} satisfy the conditions of a minimum of their scalarised aim: slopes "
            f"that nothing holds are below {max(*optima, 1e-16):.1e}."
        )
    if check:
        sentences.append(check)
    below = [number for number, point in enumerate(on) if _beaten(point, points)]
    if below:
        sentences.append(
            "Designs that were removed, as no condition shows them to be optimal, are better in "
            f"both aims than the points {', '.join(map(str, below))} of the front."
        )
    reasons = [point.removed for point in points if point.removed]
    for reason in dict.fromkeys(reasons):
        sentences.append(f"{reasons.count(reason)} removed: {reason}.")
    sentences.append(
        "Not proved: that no design is better in both aims than a point, as minima were reached "
        "from several starts and not from all; nothing is said of the front between points."
    )
    return " ".join(sentences)


def _beaten(point: FrontPoint, points: Sequence[FrontPoint]) -> bool:
    """Whether another design is better in both aims, be it an optimum or not."""
    return any(bool(np.all(other.aims < point.aims - tolerances.AGREE)) for other in points)


def _both(aims: Sequence[Aim]) -> str:
    return " and ".join(aim.name for aim in aims)


def _told(point: FrontPoint, aims: Sequence[Aim]) -> str:
    pairs = zip(aims, amplitudes(point.aims), strict=True)
    return ", ".join(f"{aim.name} {value:.10g}" for aim, value in pairs)


def _texts(words: Sequence[str]) -> np.ndarray:
    return np.array(list(words), dtype=object)


def _aims(points: Sequence[FrontPoint]) -> np.ndarray:
    return amplitudes(np.array([point.aims for point in points])).reshape(-1, 2)


def _values(variables: DesignVariables, points: Sequence[FrontPoint]) -> np.ndarray:
    values = [variables.values(point.x) for point in points]
    return np.array(values).reshape(-1, variables.n_variables)
