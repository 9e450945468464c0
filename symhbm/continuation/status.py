"""Outcomes of computations, and what to try after one that ended too early."""

from enum import StrEnum
from typing import Any


class Status(StrEnum):
    """Outcome of a computation; the value of each member is the sentence shown to the user.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> sh.frf(problem, (10, 30)).status.item() == sh.Status.REACHED_END
    True
    """

    SUCCESS = "success"
    REACHED_END = "the end of the band was reached"
    NO_CONVERGENCE = (
        "Newton's method did not converge; try frf over a band that ends here, as its path may "
        "lead to the response, or check the parameters for values many orders of magnitude apart"
    )
    UNDEFINED_FORCE = (
        "the force of a contact law is no number, or jumps at a break point, at motions that were "
        "tried from here on; the points before are valid; check its expression and its parameters "
        "there"
    )
    NO_START = (
        "no response was found at the start of the band; try a band that starts elsewhere, or "
        "check the parameters for values many orders of magnitude apart"
    )
    NO_MODE = (
        "the linear mode could not be followed to the smallest amplitude; try a smaller one, or "
        "another degree of freedom that tells the amplitude"
    )
    NO_FREQUENCY = (
        "the frequency of the mode falls to 0: nothing holds it at the last amplitude; the points "
        "before are valid; end the band of amplitudes there"
    )
    NO_CYCLES = (
        "no limit cycle was found at the values of the parameter that were searched, which is no "
        "proof that there is none between them; try a band around the values where you expect one, "
        "other modes, or a wider band of amplitudes"
    )
    CYCLE_LOST = (
        "a limit cycle that a nonlinear mode tells of could not be solved for, and is missing; the "
        "others are valid; try a narrower band of amplitudes, or another degree of freedom"
    )
    MODE_TURNED_BACK = (
        "the amplitude turned back at a fold and came back to its smallest value, as the motion "
        "passed to other degrees of freedom or harmonics; the points are valid; try another degree "
        "of freedom that tells the amplitude, or smaller amplitudes"
    )
    OTHER_SOLUTIONS = (
        "the end of the band was reached, but at an end of the band there are other solutions, "
        "which this path does not visit; the points are valid; symhbm.other_branches(result) "
        "follows those that it finds; or try a wider band, at whose ends the response is unique"
    )
    BRANCH_POINTS = (
        "the end of the band was reached, but other solutions branch off on the way "
        "(event_kind is branch point there), which this path does not visit; the points are valid; "
        "symhbm.other_branches(result) follows them; where it cannot, make the structure or the "
        "force a little less symmetric"
    )
    CLOSED = "the branch came back to where it began, and is closed"
    MINIMUM_STEP = (
        "the path could not be continued: the step fell below its smallest value; "
        "the points before are valid; try more harmonics if contacts lift off there, or a band "
        "that starts beyond the last of them"
    )
    INTERRUPTED = (
        "the path could not be continued through a part of the band, and begins anew beyond it: "
        "nothing is computed there (converged is false, the values are NaN), and peaks may be "
        "missing; the other points are valid; try more harmonics if contacts lift off there, or at "
        "with values there"
    )
    SEVERAL_MEET = (
        "the path could not be continued through a point where more than two branches meet, as of "
        "structures with several equal parts; the points before are valid; make the structure or "
        "the force a little less symmetric"
    )
    TURNED_BACK = (
        "the path turned back at a fold and came back to the start of the band without reaching "
        "its end; the points are valid; try a wider band, or the opposite direction"
    )
    MAXIMUM_POINTS = (
        "the largest number of points was reached before the end of the band; "
        "the points before are valid; try max_points with a larger value or a narrower band"
    )
    POINTS_MISSING = (
        "the end of the band was reached, but some points are not converged "
        "(converged is false there, the values are NaN); the others are valid; try a band that "
        "starts close to those that are missing"
    )
    ACCURACY_NOT_REACHED = (
        "not every response is as accurate as asked for, with the most harmonics that are tried; "
        "truncation_error tells what each is; try an accuracy that asks for less"
    )
    ANGLES_DO_NOT_APPLY = (
        "the form with the switching angles as unknowns does not apply over all of the band: a "
        "contact reverses while it slips; the points are valid; use located angles, the default of "
        "angles, for the rest"
    )
    ANGLES_NOT_CONVERGED = (
        "the solver of the form with the switching angles as unknowns did not converge over all of "
        "the band; the points are valid; try another solver in angles, or located angles, its "
        "default"
    )
    UNBOUNDED = (
        "the response grows without bound: no damping limits this resonance; "
        "add damping or friction, or end the band before it"
    )
    WITHOUT_BOUND = (
        "the end of the band was reached, but at a resonance in it the response grows without "
        "bound (peak_kind is unbounded there): neither damping nor friction limits it; the points "
        "are valid; add damping, or end the band before it"
    )
    PEAK_NOT_LOCATED = (
        "the end of the band was reached, but a maximum between two points of the path could not "
        "be solved for and is missing among the peaks; try a narrower band around the largest "
        "amplitude"
    )
    CHANGE_NOT_LOCATED = (
        "the end of the band was reached, but between two points of the path whose stability, or "
        "the sign of whose lag, differs the event could not be located, and is missing; the points "
        "are valid; try a narrower band around them"
    )
    SYSTEM_SINGULAR = (
        "the equations are singular at this frequency: an undamped resonance lies here and the "
        "response is unbounded, or a degree of freedom has neither stiffness nor inertia; add what "
        "is missing, or move the frequency"
    )
    NOT_HELD = (
        "something moves freely that neither stiffness nor a cubic spring holds: friction alone "
        "does not determine where it stands in the mean (harmonic 0), and under a force with a "
        "mean or with even harmonics it drifts and has no periodic motion; add the stiffness that "
        "holds it, or, where the force has odd harmonics alone, leave 0 and all even harmonics out"
    )
    NO_MOTION = (
        "no periodic motion was found: Newton's method did not converge; try start with a response "
        "nearby, or check the parameters for values many orders of magnitude apart"
    )
    GROWS = (
        "the motion grows without bound from the start, as cubic springs of negative stiffness "
        "allow; try a start nearer to a motion, or a smaller force"
    )
    DESIGN_OPTIMAL = (
        "a minimum of the largest response, or of the objective, was found, and the whole band was "
        "followed there"
    )
    DESIGN_AT_BOUND = (
        "the best design found lies on bounds of its variables: the largest response, or the "
        "objective, falls towards them; try wider bounds"
    )
    DESIGN_BESIDE_FAILURES = (
        "a minimum was found, but at other designs that were tried nearby the response "
        "could not be followed over the band (n_failed), so that better ones there may have been "
        "missed; try narrower bounds of the values, or a narrower band"
    )
    DESIGN_AT_EDGE = (
        "at the best design found the largest response lies at an end of the band, not at a peak: "
        "a resonance may have left the band, and be higher outside; try a wider band"
    )
    DESIGN_WITHOUT_PEAK = (
        "at the best design found no peak lies in the band: the largest response is at an end of "
        "it, and a resonance may be outside; try a wider band"
    )
    DESIGN_ON_PLATEAU = (
        "the best design found lies where the largest response does not change with the design; "
        "elsewhere within the bounds it is higher, as far as it was tried"
    )
    DESIGN_WITHOUT_EFFECT = (
        "the largest response does not change with the design anywhere it was tried, as contacts "
        "that never slip do not; try lower normal loads, or a band that holds other resonances"
    )
    DESIGN_INFEASIBLE = (
        "no design within the bounds was found that satisfies the constraints; try wider bounds, "
        "or other constraints"
    )
    DESIGN_UNBOUNDED = (
        "a resonance is unbounded at every design that was tried; add damping, or try bounds with "
        "larger friction limits"
    )
    DESIGN_STALLED = (
        "the search ended at a design that exact conditions do not show to be a minimum: close by "
        "the largest response has a kink, or falls; the design is the best one tried; try other "
        "starts"
    )
    DESIGN_NOT_SURVEYED = (
        "the response could not be followed over the whole band at the best design found, so that "
        "nothing is proved; try a narrower band"
    )
    DAMPING_LARGEST = "the best value lies within the bounds, and the whole band was followed"
    DAMPING_AT_BOUND = (
        "the best value lies at a bound of the parameter, towards which the damping grows; try "
        "wider bounds"
    )
    DAMPING_ON_RANGE = (
        "all values from design_from to design_to are as good as each other, and better than those "
        "outside; another amplitude, or a smaller range of amplitudes, may tell them apart"
    )
    DAMPING_WITHOUT_EFFECT = (
        "the parameter changes nothing within the bounds: all of its values are as good as each "
        "other; try wider bounds, or another amplitude"
    )
    DAMPING_NOT_FOLLOWED = (
        "the mode was not followed over all of the bounds and amplitudes, so that a better value "
        "may be missing; try narrower ones"
    )
    DAMPING_SURPASSED = (
        "another motion of the same mode and amplitude, which this path does not visit, has more "
        "damping at some value, see scan_damping_ratio; try bounds that begin there"
    )
    LIMIT_MISSING = (
        "the flutter limit is not told at some values, where the mode could not be followed to "
        "the largest amplitude, or its amplitude turns back; the others are valid; try a smaller "
        "largest amplitude, or a narrower band"
    )
    FRONT_FOUND = (
        "both ends of the front and all points between them satisfy the conditions of an optimum, "
        "and the whole band was followed at each"
    )
    FRONT_INCOMPLETE = (
        "some points of the front were not found, or lie beside designs that could not be followed "
        "(removed_reason and front_status tell which); the others are valid; try narrower bounds "
        "or another number of points"
    )
    PEAK_UNBOUNDED = (
        "the largest response grows without bound over a part of the band (peak_kind is unbounded "
        "there): neither damping nor friction limits it; add damping, or begin the band beyond"
    )
    PEAK_AT_EDGE = (
        "the largest response lies at an end of the band of frequencies over a part of the band "
        "(peak_kind is edge there), a resonance may lie beyond; try a wider frequency band"
    )
    PEAK_NOT_FOLLOWED = (
        "between some values a survey found a higher response than the peaks that could be "
        "followed there, and peaks may be missing; the points are valid; try a narrower band, or "
        "values close to each other in at"
    )
    PEAK_ON_ISLAND = (
        "at some values the highest peak is on an island of responses, which frf does not reach "
        "(peak_on_island tells where); the points are valid; symhbm.follow over the parameter at "
        "that frequency shows both responses"
    )
    SURVEY_INCOMPLETE = (
        "some surveys did not reach the end of the band of frequencies, so that peaks may be "
        "missing; try a narrower frequency band, or frf at such a value"
    )
    COMPUTATION_FAILED = "the computation failed; try this parameter set by itself"
    NOT_STARTED = "nothing was computed yet"


class SolveError(RuntimeError):
    """A computation that did not reach its end, raised only when the caller passes ``throw=True``.

    The attribute ``result`` holds the dataset computed so far.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> try:
    ...     sh.frf(problem, (10, 30), max_points=5, throw=True)
    ... except sh.SolveError as error:
    ...     print(error.result.sizes["point"])
    5
    """

    def __init__(self, message: str, result: Any = None):
        super().__init__(message)
        self.result = result

    def __reduce__(self):
        return type(self), (str(self), self.result)
