"""Exact derivatives of stored peaks by every parameter of every blade and contact.

A peak is a stationary point under constraints; its multipliers give the derivatives by all
parameters at once.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance, SecondOrder
from symhbm.continuation.between import TIE, Peak, PeakKind
from symhbm.model.contacts import ContactLaw
from symhbm.numerics import RADIANS, FloatArray, largest_displacement, turning_points, unknowns_of
from symhbm.peaks.conditions import Conditions, both_sides, slopes_of, solve, switches_on_limit
from symhbm.peaks.maximum import Maximum
from symhbm.results import (
    OWN_DIMENSIONS,
    VARIABLES,
    Sweep,
    recall,
    records_of_problem,
    variables,
    without,
)
from symhbm.results.archive import ArchiveError, rebuild

EXACT = "exact"
UNBOUNDED = "none: nothing limits this peak"
ONE_SIDED = (
    "one-sided: contact {contact} begins to slip here; derivatives are those towards larger "
    "values, those towards smaller ones are beside them"
)
TWO_INSTANTS = (
    "one-sided: the response is as large at several instants of the period; derivatives are those "
    "towards larger values, those towards smaller ones are beside them"
)
SEVERAL_ON_LIMIT = (
    "none: contacts {contacts} are on their limits together, derivatives by one of them would be "
    "one-sided"
)
AT_REST = "none: contacts {contacts} do not move, what force they take on when they do is one-sided"
NOT_VERIFIED = "none: what is stored could not be verified to be this peak"

_PEAK = ("peak_frequency", "peak_amplitude", "peak_dof", "peak_kind")
_NEEDED = (*_PEAK, "peak_coefficient")
_KEPT = (*_PEAK, "n_peaks", "n_sectors", "status", "curve_status")
_SAME = 1e-6
"""Relative difference up to which a peak is the stored one; peaks are located to 1e-9."""
_SLOPE = 1e-5
"""Scaled slope below which a response as large as that of a peak also peaks there."""
_REST = 1e-12
"""Motion of a contact, relative to that of the structure, that round-off explains."""
_PARTED = 1e-6
"""Relative difference of slopes of instants that are equally large, above which they part."""
_SIDE = "towards_smaller"
"""End of the names of derivatives towards smaller values, where those differ."""
_Derivatives = dict[int, tuple[FloatArray, FloatArray]]
"""By the degree of freedom that peaks, towards larger and smaller values, as of `slopes_of`."""


def sensitivity(dataset: xr.Dataset, *, laws: Iterable[ContactLaw] = ()) -> xr.Dataset:
    """Derivatives of the peaks of a result of `frf` by all of its parameters, exact.

    Parameters
    ----------
    dataset
        Any result of `frf` with its peaks, in memory or loaded, or a part of it.
    laws
        Contact laws of your own that it was computed with, as of `rebuild`.

    Returns
    -------
    Dataset with ``peak_amplitude_by_<parameter>`` [m per its unit] and
    ``peak_frequency_by_<parameter>`` [Hz per its unit] for each parameter that is no integer, those
    of cubic springs where there are any. Dimensions are those of the peaks, ``peaking_dof`` for the
    degree of freedom whose peak it is, and ``dof`` or ``contact`` for the one whose parameter
    changes. Where several peak together, as the blades of a tuned disk do, each has its own;
    others have NaN. At a load or a friction coefficient of 0 derivatives are those towards larger
    values. So they are where a peak is at the onset of slip; ``peak_amplitude_by_<parameter>_``
    ``towards_smaller``, and the same of the frequency, are then there, too, and those of the
    frequency NaN on the side of slip. ``sensitivity_status`` is ``"exact"``, tells that derivatives
    are one-sided, or why a peak has none (NaN); it is empty where there is no peak. Peaks,
    parameters and the problem come with it.

    Raises
    ------
    TypeError
        If ``dataset`` is no Dataset.
    ArchiveError
        If it holds no peaks over the frequency with their coefficients, or the problem cannot be
        rebuilt or has friction over samples. It is a ValueError.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> response = sh.frf(problem, (10, 30))
    >>> by_load = sh.datasets.sensitivity(response).peak_amplitude_by_normal_load
    >>> abs(by_load).max("peaking_dof").idxmax("contact").values  # that changes the peak most
    array([0.])
    """
    stored = _stored_peaks(dataset, laws)
    status, one_sided = np.full(stored.shape, "", dtype=object), False
    problem, parameters = stored.problem, stored.problem.parameters
    n_dof = problem.whole.peaking.n if problem.goal is None else 1
    sizes = [np.size(parameters[name]) for name in problem.differentiable]
    # Towards larger and smaller values, as of `slopes_of` each.
    slopes = np.full((2, 2, *stored.shape, n_dof, sum(sizes)), np.nan)
    for index in np.ndindex(stored.shape):
        status[index], by_dof = stored.derivatives(index)
        for dof, sides in by_dof.items():
            slopes[:, :, *index, dof] = sides
            one_sided |= sides[0] is not sides[1]
    slopes = slopes if one_sided else slopes[:1].copy()
    kept_dims = {"dof", "contact", "peak"}
    result = dataset.drop_dims([d for d in dataset.dims if d in {*OWN_DIMENSIONS} - kept_dims])
    dropped = [name for name in result.variables if name in VARIABLES and name not in _KEPT]
    result = result.drop_vars(dropped)
    records = records_of_problem(problem)
    attributes = _attributes(variables.meaning("peaking_dof", records))
    result = result.assign_coords(peaking_dof=("peaking_dof", np.arange(n_dof), attributes))
    result["sensitivity_status"] = stored.dims, status, _attributes(VARIABLES["sensitivity_status"])
    first = 0
    for name, size in zip(problem.differentiable, sizes, strict=True):
        own = problem.model.dims_of(name) if np.ndim(parameters[name]) else ()
        part, first = slopes[..., first : first + size], first + size
        part = part.reshape(*part.shape[:-1], *np.shape(parameters[name]))
        for side, pair in zip(("", _SIDE)[: 1 + one_sided], part, strict=True):
            for of, values in zip(("peak_amplitude", "peak_frequency"), pair, strict=True):
                meaning = variables.derivative(of, name, records, side.replace("_", " "))
                label = f"{of}_by_{name}" + f"_{side}" * bool(side)
                result[label] = (*stored.dims, "peaking_dof", *own), values, _attributes(meaning)
    result.attrs.pop("verification", None)
    return result


def _attributes(variable: variables.Variable) -> dict[str, Any]:
    return {"units": variable.units, "long_name": variable.long_name}


@dataclass
class _StoredPeaks:
    """The peaks of a dataset and their problems, by an index with one entry per dimension."""

    problem: HarmonicBalance
    sweep: Sweep
    dims: tuple[str, ...]
    stored: dict[str, np.ndarray]
    _sets: dict[tuple[int, ...], tuple[HarmonicBalance, SecondOrder]] = field(default_factory=dict)
    _derivatives: dict[tuple, tuple[str, _Derivatives]] = field(default_factory=dict)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of peaks along each dimension."""
        return self.stored["peak_frequency"].shape

    def derivatives(self, index: tuple[int, ...]) -> tuple[str, _Derivatives]:
        """Sensitivity status of one peak, and derivatives of its amplitude and frequency by dof."""
        stored = {name: values[index] for name, values in self.stored.items()}
        kind, dof = str(stored["peak_kind"]), int(stored["peak_dof"])
        if not kind:
            return "", {}
        if kind == PeakKind.UNBOUNDED:
            return UNBOUNDED, {}
        amplitude, frequency = float(stored["peak_amplitude"]), float(stored["peak_frequency"])
        coefficient = stored["peak_coefficient"]
        finite = np.isfinite([amplitude, frequency]).all() and np.isfinite(coefficient).all()
        if not finite or kind not in [*PeakKind]:
            return NOT_VERIFIED, {}
        set_index = index[: len(self.sweep.dims)]
        # Peaks of blades with the same motion are one solution, stored for each of them.
        key = set_index, kind, frequency, amplitude, coefficient.tobytes()
        if key not in self._derivatives:
            harmonics = self._harmonics(stored.get("peak_highest_harmonic"))
            problem, second_order = self._equations(set_index, harmonics)
            unknowns = unknowns_of(problem.basis, harmonics, coefficient[:, : len(harmonics)])
            peak = Peak(RADIANS * frequency, amplitude, dof, PeakKind(kind), unknowns, 0.0)
            self._derivatives[key] = _derivatives(problem, second_order, peak)
        return self._derivatives[key]

    def _harmonics(self, highest: Any) -> tuple[int, ...]:
        """The harmonics of one peak, which may be fewer than those of the dataset."""
        harmonics = self.problem.harmonics
        if highest is None or highest not in harmonics:
            return harmonics
        return tuple(n for n in harmonics if n <= highest)

    def _equations(
        self, set_index: tuple[int, ...], harmonics: tuple[int, ...]
    ) -> tuple[HarmonicBalance, SecondOrder]:
        """The problem of one parameter set; second derivatives are compiled once per harmonics."""
        if harmonics not in self._sets:
            base = self.problem.with_harmonics(harmonics)
            self._sets[harmonics] = base, SecondOrder(base, base.differentiable)
        base, second_order = self._sets[harmonics]
        number = int(np.ravel_multi_index(set_index, self.sweep.shape)) if set_index else 0
        return base.with_parameters(**self.sweep.chosen(number)), second_order


def _stored_peaks(dataset: xr.Dataset, laws: Iterable[ContactLaw]) -> _StoredPeaks:
    """Read the peaks of a dataset; ArchiveError where it does not hold what they are derived by."""
    problem = rebuild(dataset, laws)
    missing = [name for name in _NEEDED if name not in dataset.variables]
    if missing:
        raise ArchiveError(
            "dataset: expected a result of frf with its peaks over the frequency, got one "
            f"{without(dataset, missing)}"
        )
    if problem.samples is not None:
        raise ArchiveError(
            "dataset: expected located switching angles, got friction over "
            f"{problem.samples} samples, which is piecewise linear"
        )
    sweep = recall(dataset)[0]
    names = _NEEDED + ("peak_highest_harmonic",) * ("peak_highest_harmonic" in dataset)
    peak_dims = [str(dim) for dim in dataset["peak_frequency"].dims]
    dims = (*sweep.dims, *(dim for dim in peak_dims if dim not in sweep.dims))
    try:
        stored = {
            name: dataset[name].transpose(*dims, *VARIABLES[name].inner).values for name in names
        }
    except ValueError as error:
        raise ArchiveError(f"dataset: dimensions are missing ({error})") from error
    harmonics = problem.harmonics
    expected = {"dof": problem.model.n_dof, "harmonic": len(harmonics), "component": 2}
    sizes = {name: dataset["peak_coefficient"].sizes[name] for name in expected}
    if sizes != expected or tuple(dataset["harmonic"].values.tolist()) != harmonics:
        raise ArchiveError(f"dataset: expected coefficients of sizes {expected}, got {sizes}")
    for name in sweep.values:
        problem.activate(name)
    return _StoredPeaks(problem, sweep, dims, stored)


def _derivatives(
    problem: HarmonicBalance, second_order: SecondOrder, peak: Peak
) -> tuple[str, _Derivatives]:
    """Derivatives of a peak for each degree of freedom that peaks there, frequencies in Hz."""
    tied = [peak.dof]
    if problem.goal is None:
        amplitude, _ = largest_displacement(problem.basis, problem.peaking.of(peak.unknowns))
        tied = np.flatnonzero(np.abs(amplitude - peak.amplitude) <= TIE * peak.amplitude).tolist()
    if peak.dof not in tied:
        return NOT_VERIFIED, {}
    maximum = Maximum.at_peak(problem, peak)
    onset = switches_on_limit(maximum)
    switches = onset if len(onset) > 1 else []
    if maximum.further_contacts:
        switches = [maximum.contact, *maximum.further_contacts]
    on_limit: set[int] = {*problem.contacts.of_switches[switches].tolist()}
    for text, contacts in ((SEVERAL_ON_LIMIT, on_limit), (AT_REST, _contacts_at_rest(maximum))):
        if contacts:
            return text.format(contacts=", ".join(map(str, sorted(contacts)))), {}
    derivatives: _Derivatives = {}
    status = EXACT
    try:
        for dof in tied:
            start = Conditions.of(second_order, replace(maximum, dof=dof))
            if dof != peak.dof and not (start.stationarity <= _SLOPE and start.is_maximum()):
                continue
            solved = solve(start)
            if solved is None or not _is_same(solved.maximum, peak):
                return NOT_VERIFIED, {}
            sides = both_sides(solved, onset[0]) if onset else None
            if sides is not None:
                contact = problem.contacts.of_switches[onset[0]]
                status = ONE_SIDED.format(contact=contact)
            elif (sides := _instants(solved, dof)) is not None:
                status = TWO_INSTANTS
            else:
                slopes = slopes_of(solved)
                sides = slopes, slopes
            derivatives[dof] = sides
    except ArithmeticError:
        return NOT_VERIFIED, {}
    return status, derivatives


def _instants(solved: Conditions, dof: int) -> tuple[FloatArray, FloatArray] | None:
    """`slopes_of` a maximum at equally large instants, towards larger and smaller parameters.

    None where all of them grow alike, as opposite ones do of a motion that mirrors itself. The
    frequency is known of the instant that the maximum is of, elsewhere it is NaN.
    """
    maximum = solved.maximum
    problem, basis = maximum.problem, maximum.problem.basis
    if problem.goal is not None or _mirrors(maximum):
        return None
    points = turning_points(basis, maximum.motion[None])
    value, angle = points.value[0], points.angle[0]
    tied = np.flatnonzero(np.abs(value) >= (1 - TIE) * np.abs(value).max())
    moves = problem.peaking.by_unknowns(dof) @ solved.by_parameters[: problem.n_unknowns]
    each = np.array([np.sign(value[i]) * (basis.values(angle[i]) @ moves) for i in tied])
    if np.ptp(each, axis=0).max() <= _PARTED * np.abs(each).max():
        return None
    own = 0 if tied[0] == 0 else int(np.searchsorted(tied, np.abs(value).argmax()))
    frequency, columns = solved.frequency_gradient / RADIANS, np.arange(each.shape[1])
    larger, smaller = (
        np.array([each[lead, columns], np.where(lead == own, frequency, np.nan)])
        for lead in (each.argmax(axis=0), each.argmin(axis=0))
    )
    return larger, smaller


def _mirrors(maximum: Maximum) -> bool:
    """Whether the second half of each period is minus the first, whatever the parameters are."""
    problem = maximum.problem
    size = np.abs(problem.layout.coefficients(maximum.unknowns)).max(axis=0)
    orders = problem.basis.order[size > _REST * size.max()].astype(int)
    return problem.model.groups.odd and bool(np.all(orders // np.gcd.reduce(orders) % 2))


def _contacts_at_rest(maximum: Maximum) -> list[int]:
    """Contacts at rest whose force has a kink there.

    With a mean value in the basis the force is centred between the extremes of the motion; without
    normal load the contact never sticks.
    """
    problem = maximum.problem
    moving = problem.layout.relative(maximum.unknowns)[:, problem.basis.order > 0]
    at_rest = np.abs(moving).max(axis=1) <= _REST * np.abs(maximum.unknowns).max()
    contact, row, stiffness, limit = problem.contacts.sliders(maximum.frequency)
    kink = (problem.basis.order[0] == 0) | (limit == 0)
    return contact[at_rest[row] & kink & (stiffness > 0)].tolist()


def _is_same(maximum: Maximum, peak: Peak) -> bool:
    pairs = (maximum.amplitude, peak.amplitude), (maximum.frequency, peak.value)
    return all(abs(value - stored) <= _SAME * stored for value, stored in pairs)
