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

    @property
    def about(self) -> dict[str, Any]:
        """The attributes that a dataset tells of it."""
        return {"units": self.units, "long_name": self.long_name, **self.attributes}


_STATES = {
    "flag_values": np.array([-1, 0, 1, 2, 3], dtype=np.int8),
    "flag_meanings": "none stick slip open apart",
}
_STABILITY = {
    "flag_values": np.array([-1, 0, 1], dtype=np.int8),
    "flag_meanings": "unknown unstable stable",
}
_STABILITY_METHODS = {
    "flag_values": np.array([-1, 0, 1, 2], dtype=np.int8),
    "flag_meanings": "unknown Hill balanced_motion exact_motion",
}


def in_units(units: str, inner: tuple[str, ...] = (), **meanings: str) -> dict[str, Variable]:
    """Variables of the same units and dimensions, by name their meanings."""
    return {name: Variable(inner, units, meaning) for name, meaning in meanings.items()}


_TEXTS = in_units(
    "1",
    peak_kind="smooth, corner, edge, or unbounded (in double precision)",
    sensitivity_status="whether the derivatives of the peak are exact or one-sided, or why there "
    "are none",
    minimum_kind="smooth, exchange of peaks, kink, or end of the band",
    event_kind="onset or end of slip, what another law begins or ends, fold, corner, branch "
    "point, period doubling, Neimark-Sacker, symmetry breaking, another change of stability, or "
    "phase resonance",
    branch_origin="what the branch was found by: path, branch point, or other solution",
    status="why the computation ended",
    curve_status="why the curve of each parameter set of a design or a fit ended",
    variable="design variable",
    variable_units="unit of the design variable",
    named_peak="name of a peak that the aim depends on",
    named_peak_units="unit of the named peak",
    certificate="what was computed and checked of the design, and what was not",
    aim="name of an aim",
    front_kind="end: the optimum of one aim; between: of both",
    front_status="how the search for the point ended",
    removed_reason="why the design is not on the front",
    active_kind="smooth, corner, edge: end of the band, or point: one frequency",
    candidate_kind="maximum, corner, bound, or range of values that are as good as each other",
    limit_status="whether the flutter limit is told at this value, or why not",
)
"""Variables that hold text."""
TEXTS = (*_TEXTS, "limit_kind", "component")
"""Names of variables and labels that hold text."""

VARIABLES = _TEXTS | {
    "contact_state": Variable(("contact",), "1", "what the contact does in the period", _STATES),
    "dissipation": Variable(("contact",), "J", "energy dissipated by friction per cycle"),
    "growth_rate": Variable((), "s-1", "largest real part of the Floquet exponents"),
    "stability": Variable((), "1", "whether the response is stable", _STABILITY),
    "stability_method": Variable(
        (), "1", "motion whose perturbations the growth rate is of", _STABILITY_METHODS
    ),
    "velocity": Variable(("dof",), "m s-1", "velocity"),
    "limit_amplitude": Variable(
        ("disturbance",), "m", "amplitude of the first harmonic at which the limit is reached"
    ),
    "limit_frequency": Variable(("disturbance",), "Hz", "frequency at which the limit is reached"),
    "limit_kind": Variable(
        ("disturbance",), "1", "fold of two limit cycles, corner, disturbance, or largest amplitude"
    ),
}
VARIABLES |= in_units(
    "Hz",
    frequency="excitation frequency",
    peak_frequency="frequency of the peak",
    minimum_frequency="frequency of the peak where that is lowest",
    event_frequency="frequency of the event",
    branch_frequency="frequency where the branch begins",
    active_frequency="frequency of the active maximum",
)
VARIABLES |= in_units(
    "min-1",
    speed="speed of rotation",
    peak_speed="speed of rotation at the peak",
    event_speed="speed of rotation at the event",
    branch_speed="speed of rotation where the branch begins",
)
VARIABLES |= in_units(
    "m",
    ("dof", "harmonic", "component"),
    coefficient="Fourier coefficient of the displacement",
    peak_coefficient="Fourier coefficient at the peak",
)
VARIABLES |= in_units(
    "m",
    ("dof",),
    amplitude="largest absolute displacement over the period",
    largest_displacement="largest absolute displacement over the period",
    amplitude_slope="derivative of the amplitude by the moving parameter, after the point",
    amplitude_slope_before="derivative of the amplitude by the moving parameter, before the point",
    static_displacement="displacement at rest under static loads",
    displacement="displacement",
)
VARIABLES |= in_units(
    "1",
    damping_ratio="damping ratio of the nonlinear mode",
    residual_norm="largest residual over the largest sum of absolute force terms",
    condensation_error="distance of the response of what is kept from solving all equations, "
    "relative",
    iterations="linear solves spent on the point",
    sampling_error="error of the response by samples of contact forces, to first order, relative",
    highest_harmonic="highest harmonic of the response; those above are 0",
    truncation_error="estimated error of displacements and normal forces by the harmonics left "
    "out, relative",
    converged="whether the point solves the equations",
    contact_model_valid="whether the friction law holds for this motion",
    peak_dof="degree of freedom that peaks",
    peak_residual_norm="residual norm at the peak",
    peak_highest_harmonic="highest harmonic of the response at the peak",
    peak_truncation_error="estimated error of the peak by the harmonics left out, relative",
    peak_on_island="whether the peak is on an island of responses, off the branch that frf follows",
    peaking_dof="degree of freedom whose peak it is",
    surveyed="whether all peaks over the whole band were looked for here, or some followed",
    event_damping_ratio="damping ratio at the event",
    event_contact="contact that changes state, -1 where none does",
    branch_parent="branch whose branch point it leaves, -1 of others",
    n_points="points of the path, those of its peaks and between them included",
    n_peaks="peaks found",
    n_solutions="solutions at this value on the path, one connected branch",
    cycle_branch="number of the connected branch that the limit cycle is on",
    n_events="events of the path",
    rejected_steps="steps tried in vain",
    linear_solves="linear solves of the curve, peaks and events included",
    n_surveys="surveys of all peaks over the whole band that were made",
    n_sectors="sectors that move alike, of which one was solved; 1: the whole structure",
    angles_share="share of the band followed with the switching angles as unknowns",
    multiplier_real="Floquet multiplier of the period, real part",
    multiplier_imag="Floquet multiplier of the period, imaginary part",
    periodicity="distance of states a period apart over the motion, in the norm of energy",
    integration_tolerance="error of a step of the integrator that is allowed, relative to the "
    "motion",
)
VARIABLES |= in_units(
    "kg0.5 m",
    modal_amplitude="root of X^H M X, summed over the harmonics X above 0",
    event_modal_amplitude="modal amplitude at the event",
)
VARIABLES |= in_units(
    "rad",
    ("contact",),
    theta_0="angle of the largest relative displacement",
    theta_star="angle of the onset of slip after theta_0",
)
VARIABLES |= in_units(
    "1",
    ("contact",),
    stick_fraction="share of the period spent sticking",
    reversals="reversals of the relative velocity per period",
    normal_force_error="estimated error of the normal force by the harmonics left out, over the "
    "largest force",
    neutral="whether the contact never slips: one more multiplier, exactly 1",
)
VARIABLES |= in_units(
    "m",
    peak_amplitude="displacement at the peak",
    peak_amplitude_slope="derivative of the peak by the parameter",
    minimum_amplitude="largest displacement where that is lowest",
)
VARIABLES |= in_units(
    "rad",
    angle="angle of the period, omega t",
    event_angle="angle at which a contact changes its state",
)
VARIABLES |= in_units(
    "N",
    ("contact",),
    friction_force="friction force",
    friction_force_across="friction force across the tangential one",
    normal_force="normal force, of contacts that have a normal direction",
)
VARIABLES |= in_units(
    "N",
    ("contact", "harmonic", "component"),
    friction_force_coefficient="Fourier coefficient of the friction force",
    friction_force_across_coefficient="Fourier coefficient of the friction force across the "
    "tangential one",
)
VARIABLES |= in_units(
    "J",
    work="work of the exciting force per cycle",
    viscous_dissipation="energy dissipated by damping per cycle",
)
VARIABLES |= in_units(
    "variable_units",
    design_value="optimal value",
    design_lower="lower bound",
    design_upper="upper bound",
    front_value="value at a point of the front",
    removed_value="value of a design that is not on the front",
    start_value="value at a start of the search",
    descent_value="value at the end of a descent",
    design_from="first of the values that are as good as the best",
    design_to="last of the values that are as good as the best",
    candidate_value="value at a maximum or an end of the band",
    scan_value="value at which the mode was computed again",
)
VARIABLES |= in_units(
    "as given",
    design_aim="the aim at the optimum",
    start_aim="the aim at a start of the search",
    descent_aim="the aim at the end of a descent",
    front_aim="the aim at a point of the front",
    removed_aim="the aim at a design that is not on the front",
)
VARIABLES |= in_units(
    "1",
    ("disturbance",),
    flutter_limit="largest negative damping ratio under which a disturbance is held",
    flutter_limit_slope="derivative of the flutter limit by the parameter",
    limit_kind="fold of two limit cycles, corner, disturbance, or largest amplitude",
)
VARIABLES |= in_units(
    "m",
    ("disturbance",),
    limit_amplitude="amplitude of the first harmonic at which the limit is reached",
)
VARIABLES |= in_units(
    "1",
    design_bound_multiplier="slope of the logarithm of the response by that of the value, held by "
    "a bound",
    active_named_peak="number of the named peak of the active maximum",
    n_failed="responses of designs that could not be followed over the band",
    design_optimality="largest slope of the logarithm of the response that nothing holds",
    design_curvature="smallest curvature of the logarithm of the response that nothing holds",
    front_place="place on the chord of the front, from 0, the first aim's end, to 1, the second's",
    front_optimality="largest slope of the scalarised aim that nothing holds",
    front_n_active="maxima that hold the point of the front",
    removed_place="place on the chord that the design was looked for from",
    descent_converged="whether the descent ended at a minimum",
    active_case="number of the case of the active maximum",
    active_dof="degree of freedom of the active maximum",
    active_multiplier="slope of the logarithm of the aim by that of the active maximum; of one "
    "peak they sum to 1",
    n_followed="sets of maxima that were followed from design to design",
    design_damping_ratio="damping ratio, or flutter limit, at the best value",
    design_slope="derivative of that by the logarithm of the parameter, at the best value",
    candidate_damping_ratio="damping ratio, or flutter limit, there",
    scan_damping_ratio="largest damping ratio there, from the linear mode over the amplitude",
)
VARIABLES |= in_units(
    "m",
    design_amplitude="statistic of the largest responses at the optimum",
    named_peak_amplitude="statistic of the largest responses of the peak",
    front_peak_amplitude="statistic of the largest responses of the peak at a point of the front",
    case_amplitude="largest response of the case",
    start_amplitude="statistic at a start of the search",
    descent_amplitude="statistic at the end of a descent",
    active_amplitude="displacement at the active maximum",
    disturbance="amplitude of the first harmonic of a disturbance",
    fresh_case_amplitude="largest response of a case not designed for",
    fresh_amplitude="statistic of the cases not designed for",
)

_AMPLITUDE = in_units(
    "m", amplitude="amplitude of the first harmonic at the degree of freedom that tells it"
)
_GROWTH_RATE = in_units(
    "s-1", growth_rate="largest real part of the Floquet exponents but that of a shift in time"
)
OF_UNFORCED = {
    "nonlinear mode": _AMPLITUDE | in_units("Hz", frequency="frequency of the nonlinear mode"),
    "flutter limit": {},
    "limit cycle": {
        **_AMPLITUDE,
        **_GROWTH_RATE,
        "frequency": Variable((), "Hz", "frequency of the limit cycle"),
        "stability": Variable((), "1", "whether the limit cycle is stable", _STABILITY),
    },
}
"""What is followed without a force, and the variables that mean something else there."""

SLOPES = ("amplitude_slope", "amplitude_slope_before")
"""Variables whose unit is that of the amplitude over that of the parameter that moves."""

Records = Mapping[str, Any]
"""What the parameters of a problem are, each a `Parameter`, and the variables of its laws."""


_WHERE = {
    "event_": " at the event",
    "peak_": " at the peak",
    "minimum_": " at the minimum",
    "branch_": " where the branch begins",
    "fold_": " where two limit cycles meet, beyond which none was found",
}
"""Beginnings of the names of variables that tell a followed parameter at some points."""


def meaning(name: str, records: Records = PARAMETERS) -> Variable:
    """Meaning of a variable; of a followed parameter also at events, peaks and branches."""
    if isinstance(own := records.get(name), Variable):
        return own
    if name in VARIABLES:
        return VARIABLES[name]
    prefix = next((p for p in _WHERE if name.startswith(p) and name not in records), "")
    about, where = records[name.removeprefix(prefix)], _WHERE.get(prefix, "")
    if isinstance(about, Variable):
        return about._replace(long_name=about.long_name + where)
    return Variable((), about.units, about.meaning + where)


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
