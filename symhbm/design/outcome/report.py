"""An optimal design, and its derivatives by all parameters, as a labelled dataset."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance, SecondOrder
from symhbm.continuation import SolveError, Status
from symhbm.design import tolerances
from symhbm.design.cases import Cases, NamedPeak, amplitudes
from symhbm.design.program import ActiveSet, Program
from symhbm.design.search import Design, SearchResult
from symhbm.design.variables import DesignVariables
from symhbm.model import PARAMETERS
from symhbm.numerics import RADIANS, FloatArray, check
from symhbm.peaks import Conditions
from symhbm.results import Sweep, meaning, records_of_problem, with_provenance
from symhbm.results.reading import with_curve_status


def report(
    program: Program, cases: Cases, search_result: SearchResult, shape: Mapping[str, int]
) -> xr.Dataset:
    """All variables of a design but its response; ``shape`` are the dimensions of the cases."""
    variables, design, active = program.variables, search_result.design, search_result.active
    starts, descents = search_result.starts, search_result.descents
    n = variables.n_variables
    of_peak = program.aims[0].is_peak
    heights = np.array([state.height for state in design.states])
    multipliers, stationarity, curvature = np.zeros(n), np.nan, np.nan
    if active is not None:
        multipliers = np.where(active.free, 0.0, active.bound_multipliers)
        stationarity, curvature = active.stationarity, active.curvature

    def values(designs: Sequence[Design]) -> np.ndarray:
        return np.array([variables.values(d.x) for d in designs]).reshape(-1, n)

    what = "amplitude" if of_peak else "aim"
    ended = [descent.design for descent in descents]
    table = table_of(variables, cases) | {
        "design_value": ("variable", variables.values(design.x)),
        "design_bound_multiplier": ("variable", multipliers),
        f"design_{what}": ((), amplitudes(design.value)),
        "design_optimality": ((), stationarity),
        "design_curvature": ((), curvature),
        "start_value": (("start", "variable"), values(starts)),
        f"start_{what}": ("start", amplitudes([start.value for start in starts])),
        "n_surveys": ((), np.int32(cases.surveys)),
        "n_followed": ((), np.int32(cases.follows)),
        "n_failed": ((), np.int32(len(cases.failed))),
        "descent_value": (("descent", "variable"), values(ended)),
        f"descent_{what}": ("descent", amplitudes([end.value for end in ended])),
        "descent_converged": ("descent", np.array([d.converged for d in descents], dtype=bool)),
    }
    if of_peak:
        table["case_amplitude"] = (tuple(shape), np.exp(heights).reshape(tuple(shape.values())))
    else:
        sizes = (len(program.peaks), *shape.values())
        table |= {
            "named_peak": ("named_peak", np.array(program.peaks, dtype=object)),
            "named_peak_amplitude": ("named_peak", amplitudes(program.levels(heights))),
            "case_amplitude": (("named_peak", *shape), amplitudes(heights).reshape(sizes)),
        }
    table |= _active(search_result, len(heights) // len(program.peaks), of_peak)
    if active is not None and of_peak:
        for name, (slope, moved) in _influence(cases, active).items():
            table[f"design_amplitude_by_{name}"] = ((), slope)
            if name not in variables.names:  # whose nominal value has no influence
                table[f"design_value_by_{name}"] = ("variable", moved)
    return in_units(labelled(table, records_of_problem(cases.work.problem)), cases.work.peaks)


def table_of(variables: DesignVariables, cases: Cases) -> dict[str, Any]:
    """The variables of a design by name, with their units and bounds."""
    units = [cases.work.problem.records[group.parameter].units for group in variables.groups]
    return {
        "variable": ("variable", _labels(variables)),
        "variable_units": ("variable", np.array(units, dtype=object)),
        "design_lower": ("variable", np.exp(variables.lower)),
        "design_upper": ("variable", np.exp(variables.upper)),
    }


def _labels(variables: DesignVariables) -> np.ndarray:
    return np.array([group.label for group in variables.groups], dtype=object)


def in_units(result: xr.Dataset, peaks: Sequence[NamedPeak]) -> xr.Dataset:
    """A dataset of named peaks, with their units beside them where some are of goals."""
    if all(peak.problem.goal is None for peak in peaks):
        return result
    units = np.array([peak.units for peak in peaks], dtype=object)
    for name in ("named_peak_amplitude", "case_amplitude", "front_peak_amplitude"):
        if name in result:
            result[name].attrs["units"] = "named_peak_units"
    return result.merge(labelled({"named_peak_units": ("named_peak", units)}))


def report_of_fresh(
    problem: HarmonicBalance, program: Program, heights: Sequence[float]
) -> xr.Dataset:
    """The largest responses of cases that were not designed for, and their statistic."""
    [statistic] = np.exp(program.levels(np.array(heights)))
    values = {"fresh_case_amplitude": ("fresh", np.exp(heights))}
    return labelled(values | {"fresh_amplitude": ((), statistic)}, records_of_problem(problem))


def infeasible(
    problem: HarmonicBalance, variables: DesignVariables, names: Sequence[str]
) -> xr.Dataset:
    """A dataset of the problem where no design is possible."""
    unknown = np.full(variables.n_variables, np.nan)
    data = {"design_value": ("variable", unknown), "design_amplitude": ((), np.nan)}
    coordinates = {
        "variable": ("variable", _labels(variables), _attributes("variable", PARAMETERS))
    }
    records = records_of_problem(problem)
    labelled = {name: (*value, _attributes(name, records)) for name, value in data.items()}
    parts = with_provenance(labelled, coordinates, problem, Sweep({}, (), ()))
    text = (
        "Nothing was computed: no design within the bounds was found that satisfies "
        f"{' and '.join(dict.fromkeys(names))}, from {tolerances.TRIED} starts; that there is none "
        "is not proved."
    )
    result = replace(parts, sizes=None).dataset()
    return with_certificate(result, Status.DESIGN_INFEASIBLE, text)


def with_certificate(result: xr.Dataset, status: Status, text: str) -> xr.Dataset:
    """The dataset of a design with its status, which is the first line of its certificate."""
    told = {"status": ((), str(status)), "certificate": ((), f"{status}\n{text}")}
    return with_curve_status(result).assign(labelled(told).data_vars)


def checked(result: xr.Dataset, good: Collection[Status], throw: bool) -> xr.Dataset:
    """The result of a verb, with a warning, or SolveError, where its status is not ``good``."""
    status = str(result["status"].item())
    if status in good:
        return result
    if throw:
        raise SolveError(status, result)
    check.warn(status, RuntimeWarning)
    return result


def labelled(table: dict[str, Any], records: Mapping[str, Any] = PARAMETERS) -> xr.Dataset:
    """Dimensions and values by name, with units and meanings."""
    return xr.Dataset({name: (*value, _attributes(name, records)) for name, value in table.items()})


def _influence(cases: Cases, active: ActiveSet) -> dict[str, tuple[float, FloatArray]]:
    """Derivatives of the statistic [m] and of the variables by each parameter, all values alike.

    Those of the variables (n_variables,) are in units of the variable over that of the parameter;
    NaN where the response is constant in some direction, so that the optimum is not isolated, and
    by parameters that an active constraint depends on by itself.
    """
    names = cases.response(active.cases[0]).at(active.x).differentiable
    by_value = np.empty((len(active.maxima), len(names)))
    by_gradient = np.empty((len(active.maxima), len(active.x), len(names)))
    compiled: dict[int, SecondOrder] = {}
    for k, (case, followed) in enumerate(zip(active.cases, active.maxima, strict=True)):
        response = cases.response(case)
        problem = response.at(active.x)
        key = id(problem.equations.residual)
        if key not in compiled:
            compiled[key] = SecondOrder(problem, names)
        second_order = compiled[key]
        maximum = replace(followed.maximum, problem=problem)
        conditions = Conditions.of(second_order, maximum, followed.multipliers)
        first = problem.n_unknowns + 1
        alike = np.zeros((second_order.n_variables - first, len(names)))
        for number, name in enumerate(names):
            entries = second_order.places[name]
            alike[entries.start - first : entries.stop - first, number] = 1.0
        chosen = response.variables.derivative(problem, second_order.places)
        amplitude, slope = maximum.amplitude, conditions.gradient
        mixed = chosen.T @ conditions.hessian @ alike
        # The entries of a designed parameter are proportional to its variable.
        by_value[k] = slope @ alike / amplitude
        by_gradient[k] = mixed / amplitude - np.outer(followed.gradient, by_value[k])
    [top] = active.program.levels(active.heights)
    by_statistic = np.exp(top) * (active.weights @ by_value)
    moved = active.derivative(by_gradient, by_value)
    moved *= active.program.variables.values(active.x)[:, None]
    if not active.curvature > tolerances.LEVEL:
        moved[:] = np.nan
    if active.held:
        unknown = [name in active.program.limits.others for name in names]
        by_statistic[unknown], moved[:, unknown] = np.nan, np.nan
    return {
        name: (float(by_statistic[number]), moved[:, number]) for number, name in enumerate(names)
    }


def _active(search_result: SearchResult, n_cases: int, of_peak: bool) -> dict[str, Any]:
    active = search_result.active
    numbers, followed, weights = (
        ([], [], []) if active is None else (active.cases, active.maxima, active.weights)
    )
    peaks, cases = np.divmod(np.array(numbers, dtype=np.int32), n_cases)
    columns = {
        "active_case": cases,
        "active_frequency": np.array([f.maximum.frequency / RADIANS for f in followed]),
        "active_amplitude": amplitudes([f.value for f in followed]),
        "active_dof": np.array([f.maximum.dof for f in followed], dtype=np.int32),
        "active_kind": np.array([str(f.maximum.kind) for f in followed], dtype=object),
        "active_multiplier": np.array(weights, dtype=float),
    }
    if not of_peak:
        columns["active_named_peak"] = peaks
    return {name: ("active", column) for name, column in columns.items()}


def _attributes(name: str, records: Mapping[str, Any]) -> dict[str, Any]:
    for prefix, units, words in (
        (
            "design_amplitude_by_",
            meaning("design_amplitude", records).units,
            "derivative of the optimal response",
        ),
        ("design_value_by_", "", "derivative of the optimal value"),
    ):
        if name.startswith(prefix):
            parameter = name.removeprefix(prefix)
            of, long_name = records[parameter][:2]
            # The unit of a variable's value is that of variable_units.
            unit = units or "variable_units"
            return {
                "units": unit if of == "1" else f"{unit} / ({of})",
                "long_name": f"{words} by the {long_name}, all alike",
            }
    entry = meaning(name, records)
    return {"units": entry.units, "long_name": entry.long_name}
