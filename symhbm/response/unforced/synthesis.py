"""`synthesised_response`: the response to a force near a resonance, from one nonlinear mode."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance, matrices_in
from symhbm.continuation import newton
from symhbm.continuation.unforced import NonlinearModeProblem
from symhbm.model import Excitation, check_excitation
from symhbm.model.contacts import ContactLaw
from symhbm.model.linear import Matrices
from symhbm.numerics import (
    RADIANS,
    ComplexArray,
    FloatArray,
    bracketed_root,
    by_harmonic,
    check,
    unknowns_of,
)
from symhbm.response.unforced.curve import mode_problem
from symhbm.results import Description, recall
from symhbm.results.archive import rebuild
from symhbm.results.reading import set_dimensions

SIDES = ("below", "above")
_REAL = 1e-9
"""Imaginary part of a root over its size that is round-off."""


def synthesised_response(
    modes: xr.Dataset,
    force: Excitation | None = None,
    *,
    errors: bool = True,
    laws: Iterable[ContactLaw] = (),
) -> xr.Dataset:
    """Response near a resonance from one nonlinear mode: two frequencies for each amplitude.

    Parameters
    ----------
    modes
        A result of `nonlinear_modes`, one parameter set of it.
    force
        What drives the response in its first harmonic; None for the force of the problem that gave
        the modes, of which they left out what oscillates.
    errors
        Solve for the true response from each synthesised one, and tell how far it is.
    laws
        Contact laws of your own, as of `rebuild`.

    Returns
    -------
    Dataset with ``frequency`` [Hz] on both sides of the resonance, (side, point), NaN where the
    force does not reach an amplitude; ``coefficient`` [m] of that response; ``synthesis_error``,
    the relative distance from the true response that Newton's method finds from there, NaN where
    it finds none. Along ``peak``, ``peak_frequency`` and ``peak_amplitude`` [m], where both sides
    meet, and ``peak_synthesis_error``. Points of a grid have its dimensions.

    Raises
    ------
    TypeError, ValueError
        For another dataset, one of several parameter sets, a force without a first harmonic, or one
        that does not drive the wave of the mode.

    Notes
    -----
    The mode keeps its shape, its contacts do what they do in it, and all other modes are left out:
    ``m (omega^2 - Omega^2) + 2 i D omega^2 m + i c (Omega - omega) = X^H F exp(-i theta)`` with
    ``m = X^H M X`` and ``c = X^H C X``. That is exact for one degree of freedom and one harmonic.
    Reference: M. Krack, L. Panning-von Scheidt, J. Wallaschek, Journal of Engineering for Gas
    Turbines and Power 135 (2013), on synthesis from complex nonlinear modes.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> modes = sh.nonlinear_modes(problem, progress=False)
    >>> near = sh.datasets.synthesised_response(modes)
    >>> near.peak_amplitude.values.round(8)  # as sh.frf tells it
    array([0.00030849])
    """
    description = Description(modes) if isinstance(modes, xr.Dataset) else None
    if description is None or description.unforced != "nonlinear mode":
        raise TypeError(f"modes={check.shown(modes)}: expected a result of nonlinear_modes")
    if description.moving != "amplitude":
        raise ValueError(
            f"modes: expected modes over the amplitude, got those over {description.moving}"
        )
    outer = [*set_dimensions(modes)]
    if outer:
        raise ValueError(
            f"modes: expected one parameter set, got several along {', '.join(outer)}; select one, "
            f"for example modes.isel({outer[0]}=0)"
        )
    for name in ("coefficient", "frequency", "damping_ratio"):
        if name not in modes.variables:
            raise ValueError(f"modes: expected a dataset with {name}, keep= left it out")
    problem = rebuild(modes, laws)
    if force is not None:
        check_excitation("force", force)
        problem = problem.with_excitation(force)
    curve, _ = mode_problem(problem, recall(modes, problem)[1])
    synthesis = _Synthesis(curve, _driven(problem, curve.problem))
    return _dataset(modes, synthesis, check.flag("errors", errors))


def _driven(problem: HarmonicBalance, alone: HarmonicBalance) -> HarmonicBalance:
    """The balance of what moves in a mode under the force, which has to drive its wave."""
    own = alone.symmetry
    if own is None:
        same = problem.model.wave(1) == alone.model.wave(1)
    else:
        same = problem.equal_sectors == own
    if not same:
        raise ValueError(
            f"force={check.shown(problem.excitation)}: expected an engine order whose wave is that "
            "of the mode"
        )
    driven = problem if own is None else problem.of_sector(own)
    cosine = driven.basis.component(1)
    if not driven.force(1.0)[:, cosine : cosine + 2].any():
        raise ValueError(
            f"force={check.shown(problem.excitation)}: expected one with a first harmonic, which "
            "drives the mode"
        )
    return driven


class _Response(NamedTuple):
    """A response on one side of the resonance: its angular ``frequency``, and coefficients."""

    frequency: float
    unknowns: FloatArray


@dataclass(frozen=True)
class _Synthesis:
    """Responses of a ``driven`` problem from the motions of one mode."""

    curve: NonlinearModeProblem
    driven: HarmonicBalance

    @cached_property
    def _matrices(self) -> Matrices:
        return matrices_in(self.curve.problem, 1)

    @cached_property
    def _force(self) -> ComplexArray:
        """``a - i b`` of the first harmonic of the force, (n_dof,) [N]."""
        return self._first(self.driven.force(1.0).ravel())

    def _first(self, unknowns: FloatArray) -> ComplexArray:
        """``a - i b`` of the first harmonic of coefficients, (n_dof,)."""
        basis = self.driven.basis
        phasors = basis.phasors(self.driven.layout.coefficients(unknowns))
        return phasors[:, basis.harmonics.index(1)]

    def _balance(self, unknowns: FloatArray) -> tuple[ComplexArray, complex]:
        """The modal balance as a polynomial of the frequency, and the force on the mode."""
        frequency, ratio = self.curve.frequency(unknowns), self.curve.damping_ratio(unknowns)
        shape = self._first(unknowns[: self.driven.n_unknowns])
        mass_matrix, damping_matrix, _ = self._matrices
        mass = (shape.conj() @ (mass_matrix @ shape)).real
        damping = shape.conj() @ (damping_matrix @ shape)
        at_mode = mass * frequency**2 * (1 + 2j * ratio) - 1j * damping * frequency
        return np.array([-mass, 1j * damping, at_mode], dtype=complex), complex(
            shape.conj() @ self._force
        )

    def _excess(self, balance: ComplexArray, force: complex) -> FloatArray:
        """Square of the modal balance less that of the force, a polynomial of the frequency."""
        real, imaginary = np.real(balance), np.imag(balance)
        square = np.convolve(real, real) + np.convolve(imaginary, imaginary)
        square[-1] -= abs(force) ** 2
        return square.astype(float)

    def lowest(self, unknowns: FloatArray) -> tuple[float, float]:
        """Smallest excess over the frequency, relative to the force, and where; above 0: none."""
        balance, force = self._balance(unknowns)
        excess = self._excess(balance, force)
        slope = excess[:-1] * np.arange(len(excess) - 1, 0, -1.0)
        places = np.append(_positive(slope), 0.0)
        values = np.polyval(excess, places)
        best = int(np.argmin(values))
        return float(values[best]) / abs(force) ** 2, float(places[best])

    def responses(self, unknowns: FloatArray) -> list[_Response | None]:
        """The responses below and above the resonance that have the amplitude of a motion."""
        balance, force = self._balance(unknowns)
        frequencies, middle = _positive(self._excess(balance, force)), self.lowest(unknowns)[1]
        sides = frequencies[frequencies <= middle], frequencies[frequencies > middle]
        # Nearest to the resonance: the others are of a force that nothing resonates with.
        chosen = [side[np.argmin(np.abs(side - middle))] if len(side) else None for side in sides]
        return [None if f is None else self._turned(unknowns, balance, force, f) for f in chosen]

    def at_peak(self, unknowns: FloatArray) -> _Response:
        """The response at the frequency that needs the least force."""
        balance, force = self._balance(unknowns)
        return self._turned(unknowns, balance, force, self.lowest(unknowns)[1])

    def _turned(
        self, unknowns: FloatArray, balance: ComplexArray, force: complex, frequency: float
    ) -> _Response:
        """A motion with the phase that it has under the force."""
        basis = self.driven.basis
        angle = np.angle(force) - np.angle(np.polyval(balance, frequency))
        motion = self.driven.layout.coefficients(unknowns[: self.driven.n_unknowns])
        turns = np.exp(1j * angle * np.array(basis.harmonics))
        turned = basis.of_phasors(basis.phasors(motion) * turns)
        return _Response(float(frequency), turned.ravel())

    def error(self, response: _Response) -> float:
        """Relative distance from the true response nearby, NaN where none is found."""
        balance = partial(self.driven.evaluate, frequency=response.frequency)
        found = newton(balance, response.unknowns)
        if not found.converged:
            return np.nan
        distance = np.linalg.norm(found.unknowns - response.unknowns)
        return float(distance / np.linalg.norm(found.unknowns))

    def peaks(self, motions: list[FloatArray]) -> list[FloatArray]:
        """Motions along the mode at which both sides meet, solved for."""
        result = []
        for left, right in pairwise(motions):
            ends = self.lowest(left)[0], self.lowest(right)[0]
            if not ends[0] * ends[1] < 0:
                continue

            def excess(share: float, left: Any = left, right: Any = right) -> float:
                return self.lowest(self._between(left, right, share))[0]

            result.append(self._between(left, right, bracketed_root(excess)))
        return result

    def _between(self, left: FloatArray, right: FloatArray, share: float) -> FloatArray:
        """A motion of the mode between two others, solved for where that is possible."""
        guess = left + share * (right - left)
        value = float(np.log10(abs(self.curve.amplitude(guess))))
        result = newton(partial(self.curve.evaluate, value=value), guess)
        return result.unknowns if result.converged else guess


def _positive(polynomial: FloatArray) -> FloatArray:
    """Positive real roots, ascending."""
    roots = np.roots(polynomial)
    real = roots.real[(np.abs(roots.imag) <= _REAL * np.abs(roots)) & (roots.real > 0)]
    return np.sort(real).astype(float)


def _dataset(modes: xr.Dataset, synthesis: _Synthesis, errors: bool) -> xr.Dataset:
    """The responses of all points of a mode."""
    curve, driven = synthesis.curve, synthesis.driven
    dims = [str(dim) for dim in modes["frequency"].dims]
    shape, basis = modes["frequency"].shape, driven.basis
    coefficient = modes["coefficient"].values.reshape(-1, *modes["coefficient"].shape[-3:])
    own = zip(modes["frequency"].values.ravel(), modes["damping_ratio"].values.ravel(), strict=True)
    motions = [
        np.append(unknowns_of(basis, basis.harmonics, c[: driven.n_dof]), [RADIANS * f, d])
        for c, (f, d) in zip(coefficient, own, strict=True)
    ]
    frequency, error = np.full((2, 2, len(motions)), np.nan)
    found = np.full((2, *coefficient.shape), np.nan)
    for k, motion in enumerate(motions):
        if not np.isfinite(motion).all():
            continue
        for side, response in enumerate(synthesis.responses(motion)):
            if response is None:
                continue
            frequency[side, k] = response.frequency / RADIANS
            found[side, k] = by_harmonic(basis, driven.layout.everywhere(response.unknowns))
            error[side, k] = synthesis.error(response) if errors else np.nan
    peaks = synthesis.peaks([motion for motion in motions if np.isfinite(motion).all()])
    at_peaks = [synthesis.at_peak(motion) for motion in peaks]
    along = ("side", *dims)
    inner = ("dof", "harmonic", "component")
    result = xr.Dataset(
        {
            "frequency": (along, frequency.reshape(2, *shape), _about("frequency", "Hz")),
            "coefficient": (
                (*along, *inner),
                found.reshape(2, *shape, *coefficient.shape[1:]),
                _about("Fourier coefficient of the synthesised response", "m"),
            ),
            "peak_frequency": (
                "peak",
                np.array([r.frequency / RADIANS for r in at_peaks], dtype=float),
                _about("frequency of the peak", "Hz"),
            ),
            "peak_amplitude": (
                "peak",
                np.array([curve.amplitude(motion) for motion in peaks], dtype=float),
                _about(f"{modes['amplitude'].attrs['long_name']}, at the peak", "m"),
            ),
        },
        {name: modes[name].variable for name in modes.coords} | {"side": ("side", [*SIDES])},
        {"title": "Response synthesised from one nonlinear mode"},
    )
    if not errors:
        return result
    long_name = "distance from the true response, relative"
    of_peaks = np.array([synthesis.error(response) for response in at_peaks], dtype=float)
    return result.assign(
        synthesis_error=(along, error.reshape(2, *shape), _about(long_name, "1")),
        peak_synthesis_error=("peak", of_peaks, _about(f"{long_name}, at the peak", "1")),
    )


def _about(long_name: str, units: str) -> dict[str, str]:
    return {"long_name": long_name, "units": units}
