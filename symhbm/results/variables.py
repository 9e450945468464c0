"""Names, dimensions, units and meanings of all variables of a dataset: the archive's contract."""

import re
from collections import defaultdict
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from symhbm.model import PARAMETERS

OWN_DIMENSIONS = (
    "point",
    "frequency",
    "solution",
    "dof",
    "contact",
    "harmonic",
    "component",
    "peak",
    "event",
    "branch",
    "minimum",
    "angle",
    "multiplier",
    "peaking_dof",
    "disturbance",
)
OF_PLACES = ("node", "direction", "label", *(f"{o}_{a}" for o in ("dof", "contact") for a in "xyz"))
"""Coordinates of structures with places."""

OF_LAWS = ("contact",)
"""Dimensions of the variables of contact laws, after the point."""


class Variable(NamedTuple):
    """Meaning of one variable; ``inner`` are its dimensions after point, peak or event."""

    inner: tuple[str, ...]
    units: str
    long_name: str
    attributes: Mapping[str, Any] = MappingProxyType({})


_STATES = {
    "flag_values": np.array([-1, 0, 1, 2, 3], dtype=np.int8),
    "flag_meanings": "none stick slip open apart",
}
_STABILITY = {
    "flag_values": np.array([-1, 0, 1], dtype=np.int8),
    "flag_meanings": "unknown unstable stable",
}

VARIABLES = {
    "frequency": Variable((), "Hz", "excitation frequency"),
    "speed": Variable((), "min-1", "speed of rotation"),
    "peak_speed": Variable((), "min-1", "speed of rotation at the peak"),
    "event_speed": Variable((), "min-1", "speed of rotation at the event"),
    "coefficient": Variable(
        ("dof", "harmonic", "component"), "m", "Fourier coefficient of the displacement"
    ),
    "amplitude": Variable(("dof",), "m", "largest absolute displacement over the period"),
    "largest_displacement": Variable(
        ("dof",), "m", "largest absolute displacement over the period"
    ),
    "damping_ratio": Variable((), "1", "damping ratio of the nonlinear mode"),
    "modal_amplitude": Variable(
        (), "kg0.5 m", "root of X^H M X, summed over the harmonics X above 0"
    ),
    "amplitude_slope": Variable(
        ("dof",), "m", "derivative of the amplitude by the moving parameter, after the point"
    ),
    "amplitude_slope_before": Variable(
        ("dof",), "m", "derivative of the amplitude by the moving parameter, before the point"
    ),
    "contact_state": Variable(("contact",), "1", "what the contact does in the period", _STATES),
    "theta_0": Variable(("contact",), "rad", "angle of the largest relative displacement"),
    "theta_star": Variable(("contact",), "rad", "angle of the onset of slip after theta_0"),
    "stick_fraction": Variable(("contact",), "1", "share of the period spent sticking"),
    "dissipation": Variable(("contact",), "J", "energy dissipated by friction per cycle"),
    "reversals": Variable(("contact",), "1", "reversals of the relative velocity per period"),
    "residual_norm": Variable(
        (), "1", "largest residual over the largest sum of absolute force terms"
    ),
    "condensation_error": Variable(
        (), "1", "distance of the response of what is kept from solving all equations, relative"
    ),
    "iterations": Variable((), "1", "linear solves spent on the point"),
    "sampling_error": Variable(
        (), "1", "error of the response by samples of contact forces, to first order, relative"
    ),
    "growth_rate": Variable((), "s-1", "largest real part of the Floquet exponents"),
    "stability": Variable((), "1", "whether the response is stable", _STABILITY),
    "highest_harmonic": Variable((), "1", "highest harmonic of the response; those above are 0"),
    "truncation_error": Variable(
        (),
        "1",
        "estimated error of displacements and normal forces by the harmonics left out, relative",
    ),
    "normal_force_error": Variable(
        ("contact",),
        "1",
        "estimated error of the normal force by the harmonics left out, over the largest force",
    ),
    "converged": Variable((), "1", "whether the point solves the equations"),
    "contact_model_valid": Variable((), "1", "whether the friction law holds for this motion"),
    "peak_frequency": Variable((), "Hz", "frequency of the peak"),
    "peak_amplitude": Variable((), "m", "displacement at the peak"),
    "peak_dof": Variable((), "1", "degree of freedom that peaks"),
    "peak_kind": Variable((), "1", "smooth, corner, edge, or unbounded (in double precision)"),
    "peak_amplitude_slope": Variable((), "m", "derivative of the peak by the parameter"),
    "peak_residual_norm": Variable((), "1", "residual norm at the peak"),
    "peak_coefficient": Variable(
        ("dof", "harmonic", "component"), "m", "Fourier coefficient at the peak"
    ),
    "peak_highest_harmonic": Variable((), "1", "highest harmonic of the response at the peak"),
    "peak_truncation_error": Variable(
        (), "1", "estimated error of the peak by the harmonics left out, relative"
    ),
    "peak_on_island": Variable(
        (), "1", "whether the peak is on an island of responses, off the branch that frf follows"
    ),
    "peaking_dof": Variable((), "1", "degree of freedom whose peak it is"),
    "sensitivity_status": Variable(
        (), "1", "whether the derivatives of the peak are exact or one-sided, or why there are none"
    ),
    "surveyed": Variable(
        (), "1", "whether all peaks over the whole band were looked for here, or some followed"
    ),
    "minimum_amplitude": Variable((), "m", "largest displacement where that is lowest"),
    "minimum_frequency": Variable((), "Hz", "frequency of the peak where that is lowest"),
    "minimum_kind": Variable((), "1", "smooth, exchange of peaks, kink, or end of the band"),
    "event_frequency": Variable((), "Hz", "frequency of the event"),
    "event_damping_ratio": Variable((), "1", "damping ratio at the event"),
    "event_modal_amplitude": Variable((), "kg0.5 m", "modal amplitude at the event"),
    "event_kind": Variable(
        (),
        "1",
        "onset or end of slip, what another law begins or ends, fold, corner, branch point, period "
        "doubling, Neimark-Sacker, symmetry breaking, another change of stability, or phase "
        "resonance",
    ),
    "event_contact": Variable((), "1", "contact that changes state, -1 where none does"),
    "branch_origin": Variable(
        (), "1", "what the branch was found by: path, branch point, or other solution"
    ),
    "branch_parent": Variable((), "1", "branch whose branch point it leaves, -1 of others"),
    "branch_frequency": Variable((), "Hz", "frequency where the branch begins"),
    "branch_speed": Variable((), "min-1", "speed of rotation where the branch begins"),
    "n_points": Variable(
        (), "1", "points of the path, those of its peaks and between them included"
    ),
    "n_peaks": Variable((), "1", "peaks found"),
    "n_solutions": Variable((), "1", "solutions at this value on the path, one connected branch"),
    "cycle_branch": Variable((), "1", "number of the connected branch that the limit cycle is on"),
    "n_events": Variable((), "1", "events of the path"),
    "rejected_steps": Variable((), "1", "steps tried in vain"),
    "linear_solves": Variable((), "1", "linear solves of the curve, peaks and events included"),
    "n_surveys": Variable((), "1", "surveys of all peaks over the whole band that were made"),
    "n_sectors": Variable(
        (), "1", "sectors that move alike, of which one was solved; 1: the whole structure"
    ),
    "angles_share": Variable(
        (), "1", "share of the band followed with the switching angles as unknowns"
    ),
    "status": Variable((), "1", "why the computation ended"),
    "static_displacement": Variable(("dof",), "m", "displacement at rest under static loads"),
    "angle": Variable((), "rad", "angle of the period, omega t"),
    "displacement": Variable(("dof",), "m", "displacement"),
    "velocity": Variable(("dof",), "m s-1", "velocity"),
    "friction_force": Variable(("contact",), "N", "friction force"),
    "friction_force_coefficient": Variable(
        ("contact", "harmonic", "component"), "N", "Fourier coefficient of the friction force"
    ),
    "friction_force_across": Variable(
        ("contact",), "N", "friction force across the tangential one"
    ),
    "friction_force_across_coefficient": Variable(
        ("contact", "harmonic", "component"),
        "N",
        "Fourier coefficient of the friction force across the tangential one",
    ),
    "normal_force": Variable(
        ("contact",), "N", "normal force, of contacts that have a normal direction"
    ),
    "event_angle": Variable((), "rad", "angle at which a contact changes its state"),
    "multiplier_real": Variable((), "1", "Floquet multiplier of the period, real part"),
    "multiplier_imag": Variable((), "1", "Floquet multiplier of the period, imaginary part"),
    "neutral": Variable(
        ("contact",), "1", "whether the contact never slips: one more multiplier, exactly 1"
    ),
    "work": Variable((), "J", "work of the exciting force per cycle"),
    "viscous_dissipation": Variable((), "J", "energy dissipated by damping per cycle"),
    "periodicity": Variable(
        (), "1", "distance of states a period apart over the motion, in the norm of energy"
    ),
    "integration_tolerance": Variable(
        (), "1", "error of a step of the integrator that is allowed, relative to the motion"
    ),
    "variable": Variable((), "1", "design variable"),
    "variable_units": Variable((), "1", "unit of the design variable"),
    "design_value": Variable((), "variable_units", "optimal value"),
    "design_lower": Variable((), "variable_units", "lower bound"),
    "design_upper": Variable((), "variable_units", "upper bound"),
    "design_bound_multiplier": Variable(
        (), "1", "slope of the logarithm of the response by that of the value, held by a bound"
    ),
    "design_amplitude": Variable((), "m", "statistic of the largest responses at the optimum"),
    "design_aim": Variable((), "as given", "the aim at the optimum"),
    "start_aim": Variable((), "as given", "the aim at a start of the search"),
    "descent_aim": Variable((), "as given", "the aim at the end of a descent"),
    "named_peak": Variable((), "1", "name of a peak that the aim depends on"),
    "named_peak_amplitude": Variable((), "m", "statistic of the largest responses of the peak"),
    "named_peak_units": Variable((), "1", "unit of the named peak"),
    "active_named_peak": Variable((), "1", "number of the named peak of the active maximum"),
    "n_failed": Variable((), "1", "responses of designs that could not be followed over the band"),
    "design_optimality": Variable(
        (), "1", "largest slope of the logarithm of the response that nothing holds"
    ),
    "design_curvature": Variable(
        (), "1", "smallest curvature of the logarithm of the response that nothing holds"
    ),
    "design_status": Variable((), "1", "how the search for a design ended"),
    "certificate": Variable(
        (), "1", "what was computed and checked of the design, and what was not"
    ),
    "aim": Variable((), "1", "name of an aim"),
    "front_aim": Variable((), "as given", "the aim at a point of the front"),
    "front_value": Variable((), "variable_units", "value at a point of the front"),
    "front_kind": Variable((), "1", "end: the optimum of one aim; between: of both"),
    "front_place": Variable(
        (), "1", "place on the chord of the front, from 0, the first aim's end, to 1, the second's"
    ),
    "front_status": Variable((), "1", "how the search for the point ended"),
    "front_optimality": Variable((), "1", "largest slope of the scalarised aim that nothing holds"),
    "front_n_active": Variable((), "1", "maxima that hold the point of the front"),
    "front_peak_amplitude": Variable(
        (), "m", "statistic of the largest responses of the peak at a point of the front"
    ),
    "removed_aim": Variable((), "as given", "the aim at a design that is not on the front"),
    "removed_value": Variable((), "variable_units", "value of a design that is not on the front"),
    "removed_place": Variable((), "1", "place on the chord that the design was looked for from"),
    "removed_reason": Variable((), "1", "why the design is not on the front"),
    "case_amplitude": Variable((), "m", "largest response of the case"),
    "start_value": Variable((), "variable_units", "value at a start of the search"),
    "start_amplitude": Variable((), "m", "statistic at a start of the search"),
    "descent_value": Variable((), "variable_units", "value at the end of a descent"),
    "descent_amplitude": Variable((), "m", "statistic at the end of a descent"),
    "descent_converged": Variable((), "1", "whether the descent ended at a minimum"),
    "active_case": Variable((), "1", "number of the case of the active maximum"),
    "active_frequency": Variable((), "Hz", "frequency of the active maximum"),
    "active_amplitude": Variable((), "m", "displacement at the active maximum"),
    "active_dof": Variable((), "1", "degree of freedom of the active maximum"),
    "active_kind": Variable(
        (), "1", "smooth, corner, edge: end of the band, or point: one frequency"
    ),
    "active_multiplier": Variable(
        (),
        "1",
        "slope of the logarithm of the aim by that of the active maximum; of one peak they sum "
        "to 1",
    ),
    "n_followed": Variable((), "1", "sets of maxima that were followed from design to design"),
    "design_from": Variable(
        (), "variable_units", "first of the values that are as good as the best"
    ),
    "design_to": Variable((), "variable_units", "last of the values that are as good as the best"),
    "design_damping_ratio": Variable((), "1", "damping ratio, or flutter limit, at the best value"),
    "design_slope": Variable(
        (), "1", "derivative of that by the logarithm of the parameter, at the best value"
    ),
    "candidate_value": Variable((), "variable_units", "value at a maximum or an end of the band"),
    "candidate_damping_ratio": Variable((), "1", "damping ratio, or flutter limit, there"),
    "candidate_kind": Variable(
        (), "1", "maximum, corner, bound, or range of values that are as good as each other"
    ),
    "scan_value": Variable((), "variable_units", "value at which the mode was computed again"),
    "scan_damping_ratio": Variable(
        (), "1", "largest damping ratio there, from the linear mode over the amplitude"
    ),
    "flutter_limit": Variable(
        ("disturbance",), "1", "largest negative damping ratio under which a disturbance is held"
    ),
    "flutter_limit_slope": Variable(
        ("disturbance",), "1", "derivative of the flutter limit by the parameter"
    ),
    "limit_amplitude": Variable(
        ("disturbance",), "m", "amplitude of the first harmonic at which the limit is reached"
    ),
    "limit_frequency": Variable(("disturbance",), "Hz", "frequency at which the limit is reached"),
    "limit_kind": Variable(
        ("disturbance",), "1", "fold of two limit cycles, corner, disturbance, or largest amplitude"
    ),
    "limit_status": Variable(
        (), "1", "whether the flutter limit is told at this value, or why not"
    ),
    "disturbance": Variable((), "m", "amplitude of the first harmonic of a disturbance"),
    "fresh_case_amplitude": Variable((), "m", "largest response of a case not designed for"),
    "fresh_amplitude": Variable((), "m", "statistic of the cases not designed for"),
}

OF_UNFORCED = {
    "nonlinear mode": {
        "amplitude": Variable(
            (), "m", "amplitude of the first harmonic at the degree of freedom that tells it"
        ),
        "frequency": Variable((), "Hz", "frequency of the nonlinear mode"),
    },
    "flutter limit": {},
    "limit cycle": {
        "amplitude": Variable(
            (), "m", "amplitude of the first harmonic at the degree of freedom that tells it"
        ),
        "frequency": Variable((), "Hz", "frequency of the limit cycle"),
        "growth_rate": Variable(
            (), "s-1", "largest real part of the Floquet exponents but that of a shift in time"
        ),
        "stability": Variable((), "1", "whether the limit cycle is stable", _STABILITY),
    },
}
"""What is followed without a force, and the variables that mean something else there."""

SLOPES = ("amplitude_slope", "amplitude_slope_before")
"""Variables whose unit is that of the amplitude over that of the parameter that moves."""

TEXTS = (
    "peak_kind",
    "event_kind",
    "branch_origin",
    "minimum_kind",
    "status",
    "sensitivity_status",
    "component",
    "variable",
    "variable_units",
    "design_status",
    "certificate",
    "named_peak",
    "named_peak_units",
    "aim",
    "front_kind",
    "front_status",
    "removed_reason",
    "active_kind",
    "candidate_kind",
    "limit_kind",
    "limit_status",
)
"""Variables that hold text."""


Records = Mapping[str, Any]
"""What the parameters of a problem are, each a `Parameter`, and the variables of its laws."""


def meaning(name: str, records: Records = PARAMETERS) -> Variable:
    """Meaning of a variable; of a followed parameter also at events, peaks and branches."""
    if isinstance(own := records.get(name), Variable):
        return own
    if name in VARIABLES:
        return VARIABLES[name]
    prefixes = "event_", "peak_", "minimum_", "branch_", "fold_"
    prefix = next((p for p in prefixes if name.startswith(p) and name not in records), "")
    parameter = records[name.removeprefix(prefix)]
    suffixes = {"event_": " at the event", "peak_": " at the peak", "": ""}
    suffixes |= {"minimum_": " at the minimum", "branch_": " where the branch begins"}
    suffixes["fold_"] = " where two limit cycles meet, beyond which none was found"
    if isinstance(parameter, Variable):
        return parameter._replace(long_name=parameter.long_name + suffixes[prefix])
    return Variable((), parameter.units, parameter.meaning + suffixes[prefix])


def derivative(
    name: str, parameter: str, records: Records = PARAMETERS, side: str = ""
) -> Variable:
    """Meaning of the derivative of a variable by a parameter, ``<name>_by_<parameter>``.

    ``side`` tells which of two it is where they differ.
    """
    of, by = meaning(name, records), meaning(parameter, records)
    powers: defaultdict[str, float] = defaultdict(float)
    for variable, sign in ((of, 1), (by, -1)):
        for symbol, power in re.findall(r"([A-Za-z]+)(-?[\d.]*)", variable.units):
            powers[symbol] += sign * float(power or 1)
    units = " ".join(f"{s}{'' if p == 1 else f'{p:g}'}" for s, p in powers.items() if p)
    words = f"derivative of the {of.long_name} by the {by.long_name}{f', {side}' * bool(side)}"
    return Variable((), units or "1", words)
