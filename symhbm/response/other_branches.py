"""`other_branches`: the branches of solutions that are found from a response."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.continuation import FoundBranch, follow_branch
from symhbm.continuation import other_branches as found_from
from symhbm.model.contacts import ContactLaw
from symhbm.numerics import Table, check
from symhbm.response.accuracy import Refinement
from symhbm.response.curve import Curve, continuation_problem_of
from symhbm.response.run import reported
from symhbm.results import Request, Sweep, check_dataset, recall, schema, tables
from symhbm.results.archive import Spool, rebuild
from symhbm.results.reading import curve_status, set_dimensions
from symhbm.workers import unkept

SEARCHED = (
    "followed: the path; both ways of every branch that crosses another one at a branch point; "
    "branches from solutions that Newton's method finds at both ends of the band beside those "
    "known. Two branch points within one step are looked for where the derivatives come close to "
    "singular. Not looked for: branches that meet none of these, solutions at the ends that other "
    "starts of Newton's method lead to, points where more than two branches meet, branches that "
    "begin on corners of friction or of contacts that open, and motions of another period, which "
    "begin at period doublings and Neimark-Sacker events"
)
"""What a search for branches is, in words."""


@unkept("a branch")
def other_branches(
    response: xr.Dataset,
    *,
    max_branches: int = 20,
    laws: Iterable[ContactLaw] = (),
    throw: bool = False,
) -> xr.Dataset:
    """The branches of solutions that are found from a response: at its branch points, and more.

    At a branch point two branches cross; `frf` and `follow` go straight on, and this follows the
    other one, both ways, and so on from the branch points on it. Where another solution is found at
    an end of the band (its ``status`` says so), the branch from there is followed, too.

    Parameters
    ----------
    response
        A result of `frf` or `follow`, in memory or loaded, of one parameter set. It is followed
        anew, from its description: neither points nor coefficients are needed.
    max_branches
        Largest number of branches, the path of the response among them.
    laws
        Contact laws of your own that it was computed with, as of `rebuild`.
    throw
        Raise SolveError when a branch is incomplete, instead of a warning.

    Returns
    -------
    Dataset as that of `frf`, without a grid, with the dimension ``branch`` ahead: a curve for each.
    Branch 0 is the path of the response. ``branch_origin`` tells what each was found by,
    ``branch_parent`` the branch that it leaves, and ``branch_frequency`` [Hz] (or that of another
    parameter that moves) where it begins. A branch that closes begins and ends at one branch point.
    Every branch point is an event of each branch through it. The harmonics are those of the
    response; motions of odd harmonics stay such. The attribute ``searched`` says in words what was
    looked for: there may be more.

    Raises
    ------
    TypeError, ValueError
        For a dataset that is no result of `frf` or `follow`, one of several parameter sets, one
        with the switching angles as unknowns, and one whose responses are unique. ArchiveError,
        which is a ValueError, where the problem cannot be rebuilt.
    SolveError
        If a branch is incomplete and ``throw`` is True; its ``result`` is the dataset.

    Warns
    -----
    RuntimeWarning
        If branches are incomplete, or some were not followed.

    References
    ----------
    R. Seydel, Practical Bifurcation and Stability Analysis, Springer (2010), chapter 5.

    Examples
    --------
    >>> import warnings
    >>> import symhbm as sh
    >>> pair = sh.Model(
    ...     [[1.0, 0], [0, 1]], [[0.05, 0], [0, 0.05]], [[1.02, -0.02], [-0.02, 1.02]],
    ...     contacts=[(0,), (1,)], cubic_stiffness=0.1,
    ... )
    >>> problem = sh.HarmonicBalance(pair, sh.forces.HarmonicForce(cosine={1: [0.18, 0.18]}))
    >>> with warnings.catch_warnings(action="ignore"):  # other solutions branch off
    ...     response = sh.frf(problem, (0.08, 0.32))
    >>> branches = sh.other_branches(response)
    >>> branches.branch_origin.values, branches.branch_frequency.values.round(6)
    (array(['path', 'branch point'], dtype=object), array([0.08    , 0.193257]))
    """
    check_dataset("response", response)
    limit = check.integer("max_branches", max_branches, minimum=1)
    throw = check.flag("throw", throw)
    problem, request = _asked(response, laws)
    band = request.unit * request.band[0], request.unit * request.band[1]
    curve = continuation_problem_of(request, problem)
    path = follow_branch(curve, band, request.max_points, request.per_dof)
    found = found_from(path, band, request.max_points, limit)  # the path first
    sweep = Sweep({}, ("branch",), (len(found),))
    call = schema.describe(problem, sweep, request)
    about = {"long_name": "branch of solutions", "units": "1"}
    call.coordinates["branch"] = "branch", np.arange(len(found)), about
    ends = f"; the search ended at max_branches={limit}" if len(found) == limit else ""
    call.attributes["searched"] = SEARCHED + ends
    with Spool() as spool:
        encoded = [tables.encode(_table(problem, request, branch)) for branch in found]
        spool.add(enumerate(encoded))
        result = schema.label(call, sweep, request, spool.stacked())
    return reported(result, throw)


def _asked(response: xr.Dataset, laws: Iterable[ContactLaw]) -> tuple[HarmonicBalance, Request]:
    """The problem and the request of a response, without what is of its points alone."""
    if "followed" not in response.attrs or curve_status(response) is None:
        raise TypeError("response: expected a result of frf or follow")
    if dims := ", ".join(set_dimensions(response)):
        raise ValueError(
            f"response: expected one parameter set, got the dimension {dims}; select one of each, "
            "as in response.isel(...)"
        )
    problem, (_, request) = rebuild(response, laws), recall(response)
    if request.angles is not None:
        raise ValueError(
            f"response: expected one with located angles, got angles={request.angles!r}; responses "
            "of friction under constant loads are unique"
        )
    if continuation_problem_of(request, problem).single_valued:
        raise ValueError(
            "response: expected one that may have several solutions; those of this problem are "
            "unique"
        )
    return problem, replace(request, at=None, accuracy=None, keep=None)


def _table(problem: HarmonicBalance, request: Request, found: FoundBranch) -> Table:
    """The curve of one branch, and how it was found."""
    refinement = Refinement(problem, lambda same: continuation_problem_of(request, same))
    part = refinement.whole(0, found.branch)
    refinement.fill(part)
    refinement.solves = found.solves  # not those of all branches
    table = Curve(request, refinement, [part], []).table()
    return table | dict(
        branch_origin=np.array(str(found.origin), dtype=object),
        branch_parent=np.array(found.parent, dtype=np.int32),
        branch_value=request.shown([found.value])[0],
    )
