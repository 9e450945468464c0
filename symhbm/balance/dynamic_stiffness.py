"""The linear part of Eq. (9) by its dynamic stiffness, beside the compiled forces of contacts."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from symhbm.balance.evaluation import Evaluation
from symhbm.model import Excitation, HarmonicForce, StaticLoad, Structure
from symhbm.model.excitation import FrequencyForce
from symhbm.numerics import ComplexArray, FloatArray, FourierBasis

_STEP = 1e-6
"""Step of the difference quotient that a derivative is held against, relative."""
_DERIVATIVE = 1e-4
"""Largest difference from it, relative: a wrong factor or sign is far more."""


class DynamicStiffness:
    """Dynamic stiffness of a structure without matrices, and what it feels of one force shape.

    Motions and forces of one harmonic are ``a + i b`` of their coefficients, which makes the
    dynamic stiffness the conjugate of that of ``a - i b``.

    ValueError for harmonics or a force that the structure is not made for.

    Attributes
    ----------
    powers
        The powers of the angular frequency that go with the shapes of the force.
    parts
        By harmonic: its number, the slice of its components, the force (n_powers, n_dof) on what is
        kept and the share (n_powers, n_patterns) of each pattern of forces inside, both complex.
    static : (n_dof, n_dof + n_patterns)
        ``[Z, G]`` at rest, and ``band_functions``, those of the other harmonics where they are
        known as functions with poles; None where corrections go step by step.
    mass : (n_dof, n_dof)
        The inertia [kg] by which an amplification is measured, None where the slope of the dynamic
        stiffness tells.
    """

    def __init__(self, structure: Structure, excitation: Excitation, basis: FourierBasis):
        structure.check_harmonics(basis.harmonics)
        shapes = structure.force_shapes(excitation, basis)
        self.powers = tuple(sorted(shapes))
        split = [structure.split_force(shapes[power], basis) for power in self.powers]
        each = [_by_power(parts) for parts in zip(*split, strict=True)]
        static = structure.static_load(excitation, basis)
        self._load = structure.split_force(static[:, None], FourierBasis((0,)))[0]
        self._largest = [float(np.abs(shapes[power]).max()) for power in self.powers]
        # One that bends, where curvature is asked for.
        self._structure: Any = structure
        self._basis = basis
        # Condensed structures have derivatives of their own, checked where they are made.
        self._checked = {*basis.harmonics} if structure.pole_residues is not None else set[int]()
        self.n_components = basis.n_components
        self.band_functions, self.mass = structure.pole_residues, structure.inertia
        self.parts = []
        for n, (own, share) in zip(basis.harmonics, each, strict=True):
            first = basis.component(n)
            at = slice(first, first + 1 + (n > 0))
            self.parts.append((n, at, own, share))

    def largest(self, frequency: Any) -> Any:
        """Bound of the coefficients of the force of unit amplitude, largest of a single shape."""
        if not any(self.powers):
            return self._largest[0]
        pairs = zip(self._largest, self.powers, strict=True)
        return sum(largest * frequency**power for largest, power in pairs)

    def factors(self, frequency: Any, derivative: int = 0) -> list[Any]:
        """What each shape is multiplied by at a frequency, or a derivative of it."""
        result = []
        for power in self.powers:
            factor = float(np.prod([power - k for k in range(derivative)]))
            result.append(factor * frequency ** (power - derivative) if factor else 0.0)
        return result

    @property
    def static(self) -> FloatArray:
        """``[Z, G]`` at rest."""
        return np.asarray(self._structure.linear_forces(0, 0.0)[0].real, dtype=float)

    @cached_property
    def load(self) -> FloatArray:
        """The static force that the kept degrees of freedom feel, (n_dof,) [N]."""
        own, share = self._load
        result = own[:, 0].astype(float)
        return result + self.static[:, len(own) :] @ share[:, 0] if share.any() else result

    def _felt(self, n: int, frequency: float) -> tuple[ComplexArray, ComplexArray]:
        """``[Z, G]`` of one harmonic and its derivative by the frequency, of ``a + i b``."""
        value, slope = self._structure.linear_forces(n, frequency)
        if n not in self._checked:
            self._check(n, frequency, value, slope)
            self._checked.add(n)
        return value.conj(), slope.conj()

    def _check(self, n: int, frequency: float, value: ComplexArray, slope: ComplexArray) -> None:
        """Raise ValueError for a dynamic stiffness of a user's own that cannot be meant.

        A wrong derivative leaves solutions right and moves peaks, so nobody would notice.
        """
        size = self._structure.n_dof
        where = f"dynamic_stiffness({n}, {frequency:g}) of {type(self._structure).__name__}"
        for what, array in (("value", value), ("derivative", slope)):
            if np.shape(array) != (size, size) or not np.isfinite(array).all():
                raise ValueError(
                    f"{where}: expected a {what} of shape {(size, size)}, finite, got "
                    f"{np.array2string(np.asarray(array), threshold=4)}"
                )
        step = _STEP * frequency
        if n == 0 or step == 0:
            return
        ahead, behind = (
            self._structure.linear_forces(n, frequency + way * step)[0] for way in (1, -1)
        )
        quotient = (ahead - behind) / (2 * step)
        allowed = (
            _DERIVATIVE * np.abs(quotient).max() + _DERIVATIVE * np.abs(value).max() / frequency
        )
        if np.abs(quotient - slope).max() > allowed:
            raise ValueError(
                f"{where}: expected its derivative by the angular frequency of the excitation, "
                f"about {quotient.flat[0]:.4g} in the first entry, got {slope.flat[0]:.4g}"
            )

    def shape(self, frequency: float) -> FloatArray:
        """The force of unit amplitude that the kept degrees of freedom feel, (n_unknowns,)."""
        size = self._structure.n_dof
        result = np.zeros((size, self._basis.n_components))
        factors = np.array(self.factors(frequency))
        for n, at, own, share in self.parts:
            force = factors @ own + self._felt(n, frequency)[0][:, size:] @ (factors @ share)
            result[:, at] = _real(force, n)
        return result.ravel()

    def added(
        self, contacts: Evaluation, unknowns: FloatArray, frequency: float, amplitude: float
    ) -> Evaluation:
        """The equations at one point from those of the contacts alone."""
        size, n_components = self._structure.n_dof, self._basis.n_components
        x = unknowns.reshape(size, n_components)
        forces, slopes, terms = np.empty((3, size, n_components))
        jacobian = contacts.jacobian
        jacobian = jacobian.toarray("F") if sp.issparse(jacobian) else np.asfortranarray(jacobian)
        # Columns are stored one after the other.
        blocks = jacobian.T.reshape(size, n_components, size, n_components)
        factors, rates = (np.array(self.factors(frequency, d)) for d in (0, 1))
        for n, at, own, inside in self.parts:
            value, slope = self._felt(n, frequency)
            stiffness, motion = value[:, :size], _complex(x[:, at])
            share = factors @ inside
            push = factors @ own + value[:, size:] @ share
            load = np.zeros(size) if n else self.load
            forces[:, at] = _real(stiffness @ motion - amplitude * push - load, n)
            moving = np.concatenate([motion, -amplitude * share])
            slopes[:, at] = _real(slope @ moving, n)
            if any(self.powers):
                rate = rates @ own + value[:, size:] @ (rates @ inside)
                slopes[:, at] -= _real(amplitude * rate, n)
            level = np.abs(x[:, at])
            real, imaginary = stiffness.real, stiffness.imag
            terms[:, at] = np.abs(real) @ level + np.abs(_real(amplitude * push + load, n))
            cosine, sine = at.start, at.stop - 1
            blocks[:, cosine, :, cosine] += real.T
            if n:
                terms[:, at] += np.abs(imaginary) @ level[:, ::-1]
                blocks[:, sine, :, sine] += real.T
                blocks[:, cosine, :, sine] += imaginary.T
                blocks[:, sine, :, cosine] -= imaginary.T
        return replace(
            contacts,
            residual=contacts.residual + forces.ravel(),
            magnitude=contacts.magnitude + float(terms.max()),
            jacobian=jacobian,
            by_parameter=contacts.by_parameter + slopes.ravel(),
        )

    def curvature(
        self, unknowns: FloatArray, frequency: float, amplitude: float, multipliers: FloatArray
    ) -> tuple[FloatArray, float, float]:
        """Second derivatives of the forces, weighted by ``multipliers`` (n_unknowns,).

        By the frequency and the unknowns (n_unknowns,), twice by the frequency, and by the
        frequency and the amplitude.
        """
        size, shape = self._structure.n_dof, (self._structure.n_dof, self._basis.n_components)
        x, weights = unknowns.reshape(shape), multipliers.reshape(shape)
        mixed, twice, with_amplitude = np.zeros(shape), 0.0, 0.0
        factors, rates, bends = (np.array(self.factors(frequency, d)) for d in (0, 1, 2))
        for n, at, own, inside in self.parts:
            if n == 0:
                continue
            bend = self._structure.forces_curvature(n, frequency)
            value, slope = self._felt(n, frequency)
            share = factors @ inside
            # Of a + i b, the sum of products of coefficients is the real part of one product.
            weight = _complex(weights[:, at]).conj()
            mixed[:, at] = _real((weight @ slope[:, :size]).conj(), n)
            moving = np.concatenate([_complex(x[:, at]), -amplitude * share])
            twice += float((weight @ (bend.conj() @ moving)).real)
            with_amplitude -= float((weight @ (slope[:, size:] @ share)).real)
            if any(self.powers):
                rate = rates @ own + value[:, size:] @ (rates @ inside)
                second = bends @ own + value[:, size:] @ (bends @ inside)
                second = second + 2 * slope[:, size:] @ (rates @ inside)
                with_amplitude -= float((weight @ rate).real)
                twice -= amplitude * float((weight @ second).real)
        return mixed.ravel(), twice, with_amplitude

    def modal_force(self, amplitude: float) -> Excitation:
        """The force on what is kept and on the modes inside."""
        size, known = self._structure.n_dof, self._structure.modal.forces

        def spread(own: NDArray, share: NDArray) -> NDArray:
            return np.pad(own, (0, len(known) - size)) + known @ share

        forces: dict[int, Excitation] = {}
        mean = spread(*(part[:, 0] for part in self._load))
        load = mean if mean.any() else None
        for k, power in enumerate(self.powers):
            pushes = {n: spread(own[k], share[k]) for n, _, own, share in self.parts if n}
            cosine, sine = (
                {n: part(push) for n, push in pushes.items()} for part in (np.real, np.imag)
            )
            given = (1.0, None) if any(self.powers) else (amplitude, load)
            forces[power] = HarmonicForce(cosine, sine, *given)
        if not any(self.powers):
            return forces[0]
        changing = FrequencyForce(forces, amplitude)
        return changing if load is None else changing + StaticLoad(load)

    def with_modes(self, unknowns: FloatArray, frequency: float, amplitude: float) -> FloatArray:
        """The motion of what is kept and of the modes inside, which follow it (n_all,) [m]."""
        size, modal = self._structure.n_dof, self._structure.modal
        x = unknowns.reshape(size, -1)
        result = np.zeros((len(modal.mass), x.shape[1]))
        result[:size] = x
        inner, outer, factors = modal[:3], slice(size, None), np.array(self.factors(frequency))
        stiffness, damping, mass = (matrix[outer] for matrix in inner)
        for n, at, _, inside in self.parts:
            s, share = n * frequency, factors @ inside
            rows = stiffness - 1j * s * damping - s**2 * mass
            load = amplitude * share if n else amplitude * share + self._load[1][:, 0]
            push = modal.forces[outer] @ load - rows[:, :size] @ _complex(x[:, at])
            result[outer, at] = _real(np.linalg.solve(rows[:, size:], push), n)
        return result.ravel()

    def amplification(self, unknowns: FloatArray, frequency: float, amplitude: float) -> float:
        """Largest inertia force over the largest exciting force (0 without one).

        Of what is kept, and of the interior as far as it follows without delay.
        """
        x = unknowns.reshape(self._structure.n_dof, -1)
        force = abs(amplitude) * self.largest(frequency)
        if force == 0:
            return 0.0
        if self.mass is not None:
            inertia = self.mass @ (x * self._basis.order**2)
            return float(frequency**2 * np.abs(inertia).max() / force)
        largest = 0.0
        for n, at, *_ in self.parts:
            # Of springs and masses, -n omega / 2 times the slope is the inertia.
            slope = self._felt(n, frequency)[1][:, : len(x)].real
            largest = max(largest, float(np.abs(slope @ _complex(x[:, at])).max()))
        return frequency / 2 * largest / force


def losses(
    structure: Any, basis: FourierBasis, coefficients: FloatArray, frequency: float
) -> FloatArray:
    """Linear forces (n_dof, n_components) [N] of all that does work over a cycle.

    ``coefficients`` (n_dof, n_components) [m] of the motion, ``frequency`` in rad/s.
    """
    result = np.zeros_like(coefficients)
    for n in basis.harmonics:
        first = basis.component(n)
        at = slice(first, first + 1 + (n > 0))
        if structure.is_polynomial:
            stiffness: Any = sum(frequency**k * a for k, a in structure.powers(n).items())
        else:
            stiffness = structure.linear_forces(n, frequency)[0][:, : structure.n_dof]
        lost = (stiffness.conj() - stiffness.T) / 2
        result[:, at] = _real((lost @ _complex(coefficients[:, at])).astype(complex), n)
    return result


def _by_power(parts: Sequence[tuple[FloatArray, FloatArray]]) -> tuple[ComplexArray, ComplexArray]:
    """Forces and shares (n_powers, n) of one harmonic, from coefficients by power."""
    own, share = zip(*parts, strict=True)
    return np.array([*map(_complex, own)]), np.array([*map(_complex, share)])


def _complex(components: FloatArray) -> ComplexArray:
    """``a + i b`` of coefficients (n, 1 or 2)."""
    if components.shape[1] == 1:
        return components[:, 0].astype(complex)
    return np.ascontiguousarray(components).view(complex)[:, 0]


def _real(values: ComplexArray, harmonic: int) -> FloatArray:
    """Coefficients (n, 1 or 2) of ``a + i b``."""
    parts = values.view(float).reshape(-1, 2)
    return parts if harmonic else parts[:, :1]
