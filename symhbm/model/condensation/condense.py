"""Condensation of large structures with few contacts to the degrees of freedom of the contacts."""

from collections.abc import Iterable, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from symhbm.model.condensation.condensed_model import CondensedModel, CondensedStiffness
from symhbm.model.condensation.condensed_sector import condense_sector, orthonormal
from symhbm.model.condensation.partition import Interior, in_displacements
from symhbm.model.condensation.reduced_basis import MOST, Certificate, reduce
from symhbm.model.cyclic import Sector
from symhbm.model.excitation import Excitation, check_excitation
from symhbm.model.matrices import Model
from symhbm.model.outputs import Output
from symhbm.model.places import Place, check_whole, own_numbers
from symhbm.model.plausibility import warn_of_doubts
from symhbm.model.sectors import check_at_one_speed, ends_of
from symhbm.numerics import FloatArray, FourierBasis, check, check_harmonics
from symhbm.workers import check_progress

_SOUND = 1e-6
"""Relative error of responses without a warning: matrices are not more exact."""
_NOTHING = 1e-2
"""Relative error above which responses are useless."""
_AT_REST = 1e-2
"""Share of the lowest frequency below which motions are static."""


def condense(
    model: Model | Sector,
    excitation: Any,
    frequency_band: tuple[float, float],
    harmonics: Iterable[int] = (1,),
    *,
    places: Iterable[Place] = (),
    keep: Literal["touched", "displacements"] = "touched",
    tolerance: float | None = None,
    stability: bool = False,
    progress: bool | None = None,
) -> CondensedModel:
    """Condense a structure to its contacts: all that is linear is eliminated, exactly.

    A finite-element model of a hundred thousand degrees of freedom with twenty contacts then costs
    as much per frequency as the problem of the contacts alone. `HarmonicBalance` takes the result
    as a model, under the excitations given here, which keep their degrees of freedom; `frf`,
    `follow` and `solve` give motion and peaks of the kept degrees of freedom, and
    `symhbm.datasets.recover` gives the motion of all others.

    Parameters
    ----------
    model
        The structure and its contacts; or a sector of a disk, which is condensed for each number of
        nodal diameters that its harmonics have.
    excitation
        The force, or a list of all forces it shall have; any degree of freedom may be excited.
    frequency_band
        Band of excitation frequencies [Hz] that results may lie in.
    harmonics
        Harmonics that responses may have: those of `HarmonicBalance` are some of these.
    places
        Degrees of freedom to keep beside those that contacts touch, blade tips for example, by
        number or by name. Those of a mistuned ring have their numbers along ``dof`` of its results.
    keep
        ``"touched"`` keeps all degrees of freedom that contacts touch; ``"displacements"`` keeps
        ``places`` and one unknown for each displacement of a contact ``w^T x``, in place of both
        sides: half as many for contacts between two sides, with the same responses.
    tolerance
        Largest allowed relative error of linear responses of the kept degrees of freedom; None
        warns above 1e-6.
    stability
        Make it exact between the harmonics too, from rest to the highest: perturbations oscillate
        there, so that ``stability`` of `frf` is known. It takes more factorisations.
    progress
        By default, show a bar when it takes longer than a few seconds; True: at once, False: never.

    Returns
    -------
    A model whose contact parameters are free; mass, damping and stiffness are those given.

    Raises
    ------
    TypeError, ValueError
        For bad arguments, for a structure that falls apart once the degrees of freedom that are
        kept are held, or whose mass matrix is not positive definite, if ``tolerance`` is not
        reached, and if responses have no digits at all.

    Notes
    -----
    Eliminating the linear degrees of freedom is exact for every harmonic. The condensed stiffness
    ``Z(omega)`` is a sum over poles from a basis of exact motions. Frequencies are added to the
    basis until responses agree with those of direct sparse factorisations of all equations to
    1e-11, or to round-off, at four successive frequencies that are not in the basis: three of
    largest residual of all equations, over 0.95 to 1.05 times the band and its harmonics, and the
    resonance that amplifies round-off most. ``certificate`` of the result has the largest
    difference there. It is a measurement at these frequencies, of linear responses, with all
    contacts open and with all stuck as stiff as those of ``model``.

    Displacements that others and ``places`` tell are no unknowns of their own; a sector is refused
    where that differs between its waves. Along ``dof`` displacements come after ``places``: their
    ``structure_dof`` is the number of degrees of freedom of the structure plus that of the
    displacement, their ``label`` names contact and direction, and the largest response is that of
    ``places`` and displacements together. Datasets of them are read as all others, but not rebuilt.

    Responses with friction are no combination of linear ones. Their ``friction_bound`` follows from
    the error ``dZ`` of the condensed stiffness, because friction of constant normal load only takes
    power from a difference of two motions (it is monotone): with ``L L^H = (Z - Z^H) / 2i``, what
    damping takes, a response ``x`` of any slip limits and contact stiffnesses differs by ``e``,
    whose ``|L^H e|`` is at most ``|L^-1 dZ L^-H|`` of ``|L^H x|``, plus the same part of that of
    the linear response to forces inside. Cubic springs have no such bound.
    `symhbm.datasets.recover` checks any single point: how far its response is from that of all
    equations.

    Residuals are those of NumPy's ``longdouble``. Where that is no longer than a double (some
    processors and compilers), round-off of stiff elements stays in ``Z``: by about the ratio
    of the highest to the lowest natural frequency, squared, times 1e-16, and amplified by
    resonances. The certificate includes that.

    Examples
    --------
    A chain of 200 masses with a contact to the ground at its end:

    >>> import scipy.sparse as sp
    >>> import symhbm as sh
    >>> M = sp.eye_array(200)
    >>> K = 1e4 * (2 * M - sp.eye_array(200, k=1) - sp.eye_array(200, k=-1))
    >>> chain = sh.Model(
    ...     M, 0.5 * M + 1e-5 * K, K, contacts=[(199,)],
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=0.5,
    ... )
    >>> force = sh.forces.PointForce(place=99)
    >>> small = sh.condense(chain, force, frequency_band=(0.2, 1), places=[99])
    >>> response = sh.frf(sh.HarmonicBalance(small, force), (0.2, 1))
    >>> response.structure_dof.values
    array([ 99, 199])
    """
    if not isinstance(model, (Model, Sector)):
        raise TypeError(
            f"model={check.shown(model)}: expected a Model or a Sector that is not condensed"
        )
    check_whole("model", model)
    check_at_one_speed("model", model.structure if isinstance(model, Sector) else model)
    basis = FourierBasis(check_harmonics(harmonics))
    band = ends_of(frequency_band, "positive")
    check.one_of("keep", keep, ("touched", "displacements"))
    stability, progress = check.flag("stability", stability), check_progress(progress)
    if tolerance is not None:
        tolerance = check.scalar("tolerance", tolerance, "positive")
    if not model.dissipates(basis.harmonics):
        raise ValueError(
            "model: expected damping that gives energy to no motion; symhbm.craig_bampton takes it"
        )
    excitations = _excitations(model, excitation)
    outputs = _outputs_of(model)
    read = np.unique(np.concatenate([np.zeros(0, int), *(out.touched for out in outputs)]))
    masters, rows = np.union1d(_watched(model, places), read).astype(np.intp), np.zeros(0, np.intp)
    structure = model
    if keep == "displacements":
        structure, coordinates = in_displacements(model, masters)
        masters, rows = coordinates.masters, coordinates.rows
        if isinstance(model, Sector):
            masters = model.kept[masters]
    else:
        masters = np.union1d(masters, [*model.touched]).astype(np.intp)
    _check_kept(model, masters)
    if isinstance(model, Sector):
        if model.loss_factor:
            raise TypeError(
                "model: expected a sector with viscous damping, as one is condensed for waves of "
                "both senses; symhbm.craig_bampton takes a loss factor"
            )
        if stability:
            raise ValueError("stability=True: expected False for a sector of a disk")
        assert isinstance(structure, Sector)
        condensed = condense_sector(structure, excitations, band, basis, masters, rows, progress)
        _check_error(condensed.certificate, tolerance)
        return _with_outputs(condensed, outputs)
    if model.loss_factor:
        other = model.loss_stiffness() - model.loss_factor * model.stiffness_matrix
        if abs(other).max() > 0:
            raise TypeError(
                "model: expected viscous damping, or a loss factor of the whole stiffness: this "
                "one is of the tuned disk without the air"
            )
    for force in excitations:
        model.under(force)
    warn_of_doubts(model, band, basis.harmonics)
    assert isinstance(structure, Model)
    patterns = _patterns(structure, excitations, basis, masters)
    others = np.setdiff1d(np.arange(model.n_dof), masters)
    interior = Interior(structure, masters, patterns[others], model.loss_factor)
    bands = [CondensedModel.band(n, band) for n in basis.harmonics if n]
    if stability:
        bands += _between(bands)
    touched = structure.directions[:, masters].toarray()
    springs = (touched.T * model.groups.stuck_springs) @ touched
    reduced, certificate = reduce(interior, bands, springs, progress)
    _check_error(certificate, tolerance)
    condensed = CondensedStiffness.of(reduced, interior, patterns, stability)
    given = structure, masters, band, basis.harmonics, condensed, certificate, rows
    return _with_outputs(CondensedModel(*given), outputs)


def _outputs_of(model: Model | Sector) -> list[Output]:
    """Outputs over all degrees of freedom of a structure, or of a sector of a disk."""
    if not isinstance(model, Sector):
        return [*model.outputs.values()]
    return [out.of(model.interfaces.everywhere(out.rows)) for out in model.outputs.values()]


def _with_outputs(small: CondensedModel, outputs: list[Output]) -> CondensedModel:
    """A condensed structure with the outputs of the whole one."""
    return small._seeing({output.name: output.of(small.seen(output)) for output in outputs})


def _between(bands: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """What lies between ascending bands [rad/s], and from next to nothing to the first."""
    ends = [_AT_REST * bands[0][0], *(high for _, high in bands)]
    starts = [low for low, _ in bands]
    return [(end, start) for end, start in zip(ends, starts, strict=False) if end < start]


def _check_error(certificate: Certificate, tolerance: float | None) -> None:
    """Raise ValueError where responses are not good enough, warn where that was not asked for."""
    error, count = certificate.error, certificate.n_factorisations
    allowed = _SOUND if tolerance is None else tolerance
    if error <= allowed:
        return
    told = f"responses are exact to {error:.1e} only, after {count} factorisations"
    if count >= MOST:
        advice = "a narrower band has fewer modes"
    else:
        advice = (
            "what is left is round-off next to resonances that little damping bounds; a band "
            "without them, or a structure of less different stiffnesses, has less"
        )
    if tolerance is None and error <= _NOTHING:
        check.warn(f"{told}; {advice}")
        return
    asked = "frequency_band" if tolerance is None else f"tolerance={tolerance:g}"
    raise ValueError(f"{asked}: {told}; {advice}")


def _watched(model: Model | Sector, places: Iterable[Place]) -> NDArray[np.intp]:
    """The degrees of freedom ``places``, ascending."""
    kept = own_numbers("places", model, places)
    if isinstance(model, Sector) and (right := np.setdiff1d(kept, model.kept)).size:
        raise ValueError(
            f"places: expected degrees of freedom that are not right, {right[0]} is; keep that of "
            "left at the same place, which is its of the next sector"
        )
    return kept


def _check_kept(model: Model | Sector, masters: NDArray[np.intp]) -> None:
    """Raise ValueError where nothing is kept, or everything."""
    if not len(masters):
        raise ValueError("places=(): expected at least one for a structure without contacts")
    if len(masters) == model.n_dof:
        raise ValueError(
            f"model: contacts, outputs and places= take all {model.n_dof} degrees of freedom, "
            "nothing is left to be eliminated; solve the structure as it is"
        )


def _excitations(model: Model | Sector, excitation: Any) -> Sequence[Excitation]:
    excitations = excitation if isinstance(excitation, (list, tuple)) else [excitation]
    for force in excitations:
        check_excitation("excitation", force)
    if not excitations:
        raise ValueError("excitation=[]: expected at least one")
    return [force.placed(model.number_of) for force in excitations]


def _patterns(
    model: Model, excitations: Sequence[Excitation], basis: FourierBasis, masters: NDArray[np.intp]
) -> FloatArray:
    """Orthonormal force patterns (n_dof, n_patterns) of excitations, 0 where kept."""
    felt = [model.felt_shapes(force, basis).values() for force in excitations]
    shapes = np.hstack([shape for each in felt for shape in each])
    static = [model.felt_static(force, basis) for force in excitations]
    return orthonormal(np.column_stack([shapes, *static]), masters)
