"""A large structure condensed to the few degrees of freedom that are kept."""

from functools import cached_property
from hashlib import sha256
from typing import Any, NamedTuple, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symhbm.model.condensation.pole_residue import PoleResidueFunction, PoleSum
from symhbm.model.condensation.reduced_basis import Certificate
from symhbm.model.parameters import CONTACT_PARAMETERS
from symhbm.model.structure import Model
from symhbm.numerics import RADIANS, FloatArray, check

_INSIDE = 1e-12
"""Share of a force outside of the known patterns that is round-off."""


class CondensedStiffness(NamedTuple):
    """Dynamic stiffness of a structure at the kept degrees of freedom, with ``p = i n omega``.

    ``matrix``, ``[Z, G]`` (n_dof, n_dof + n_patterns): forces by motions, and by force patterns;
    ``undamped``, Z (n_dof, n_dof) without damping; ``static``, ``[Z, G]`` at rest;
    ``held`` (n,) fixed-interface natural frequencies [rad/s]; ``patterns``
    (n_dof of the structure, n_patterns), orthonormal, 0 where kept.
    """

    matrix: PoleSum
    undamped: PoleSum
    static: FloatArray
    held: FloatArray
    patterns: FloatArray


class CondensedModel(Model):
    """A `Model` condensed by `condense`: its contacts, on the degrees of freedom that are kept.

    Contact parameters stay free, mass, damping and stiffness are those of the structure.

    Attributes
    ----------
    dofs : (n_dof,)
        The degrees of freedom that are kept, as the structure numbers them, ascending.
    frequency
        Band of excitation frequencies [Hz] (lowest, highest).
    harmonics
        Harmonics of it that responses may have.
    certificate
        How exact it is, see `symhbm.model.condensation.reduced_basis.Certificate`.
    """

    dofs: NDArray[np.intp]
    frequency: tuple[float, float]
    harmonics: tuple[int, ...]
    certificate: Certificate

    def __init__(
        self,
        structure: Model,
        dofs: NDArray[np.intp],
        frequency: tuple[float, float],
        harmonics: tuple[int, ...],
        seen: CondensedStiffness,
        certificate: Certificate,
    ):
        position = {int(dof): i for i, dof in enumerate(dofs)}
        attributes: dict[str, Any] = {name: getattr(structure, name) for name in CONTACT_PARAMETERS}
        attributes["contacts"] = tuple(
            tuple(position[dof] for dof in c) for c in structure.contacts
        )
        attributes |= dict(
            dofs=dofs, frequency=frequency, harmonics=harmonics, certificate=certificate
        )
        attributes |= dict(seen=seen, lumped=False, _structure=structure)
        nearest = [np.argmin(np.abs(seen.matrix.poles - 1j * natural)) for natural in seen.held]
        attributes["held_width"] = np.abs(seen.matrix.poles[np.array(nearest, dtype=int)].real)
        whole = {n: seen.matrix for n in harmonics if n}
        attributes["matrices"] = {
            n: PoleResidueFunction(whole[n], self.band(n, frequency)) for n in whole
        }
        attributes["undamped"] = {
            n: PoleResidueFunction(seen.undamped, self.band(n, frequency)) for n in whole
        }
        self.__dict__.update(attributes)

    seen: CondensedStiffness
    held_width: FloatArray
    matrices: dict[int, PoleResidueFunction]
    undamped: dict[int, PoleResidueFunction]
    _structure: Model

    @staticmethod
    def band(harmonic: int, frequency: tuple[float, float]) -> tuple[float, float]:
        """Verified band of one harmonic [rad/s]: iterations may leave the band of the results."""
        low, high = frequency
        return RADIANS * harmonic * 0.95 * low, RADIANS * harmonic * 1.05 * high

    @property
    def structure(self) -> Model:
        """The whole structure, with the contact parameters as they are here."""
        return self._structure.with_parameters(**self.parameters)

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom that are kept."""
        return len(self.dofs)

    @property
    def n_whole(self) -> int:
        """Number of degrees of freedom of the whole structure."""
        return self._structure.n_dof

    def with_parameters(self, **values: ArrayLike) -> "CondensedModel":
        """Return a copy with other values, one or one per contact, of named parameters.

        Raises KeyError for a name that is no parameter, and as `Model` for bad values.
        """
        copy = object.__new__(CondensedModel)
        copy.__dict__.update(self.__dict__)
        for name, value in values.items():
            check.known(name, self.parameters, "parameter of a condensed model")
            copy.__dict__[name] = self._each(name, value)
        return copy

    @cached_property
    def description(self) -> dict[str, Any]:
        """Identification of a condensed structure for JSON."""
        model, patterns = self._structure, self.seen.patterns
        parts = (model.mass_matrix, model.damping_matrix, model.stiffness_matrix)
        digest = sha256(np.ascontiguousarray(patterns).tobytes())
        for matrix in parts:
            for array in (matrix.indptr, matrix.indices, matrix.data):
                digest.update(np.ascontiguousarray(array).tobytes())
        return {
            "n_dof": self.n_whole,
            "dofs": self.dofs.tolist(),
            "frequency": list(self.frequency),
            "harmonics": list(self.harmonics),
            "error": self.certificate.error,
            "matrices": digest.hexdigest(),
        }

    def share(self, shape: FloatArray) -> FloatArray:
        """Coefficients (n_patterns, n) of force patterns (n_whole, n) by the known patterns.

        ValueError where a force is no sum of known patterns and forces on kept degrees of freedom.
        """
        inside = shape.copy()
        inside[self.dofs] = 0.0
        share = self.seen.patterns.T @ inside
        rest = np.abs(inside - self.seen.patterns @ share).max(axis=1)
        if rest.max() > _INSIDE * np.abs(shape).max():
            raise ValueError(
                f"excitation: the condensed structure does not know this force (on degree of "
                f"freedom {int(rest.argmax())}); give it to condense, alone or in a list"
            )
        return share

    def check_frequencies(self, name: str, values: ArrayLike) -> None:
        """Raise ValueError unless frequencies [Hz] are within the band of the condensation."""
        low, high = self.frequency
        frequencies = np.asarray(values, dtype=float)
        if frequencies.min() < low or frequencies.max() > high:
            raise ValueError(
                f"{name}={check.shown(values)}: expected frequencies within the band of the "
                f"condensed structure, {low:g} to {high:g} Hz; condense it for a wider one"
            )

    def _missing(self, name: str) -> NoReturn:
        raise TypeError(
            f"{name}: a condensed structure has none of its own, and what was asked for needs "
            "it; use a HarmonicBalance of the whole one, the attribute structure of this model"
        )

    @property
    def mass_matrix(self) -> NoReturn:
        """Raises TypeError: of the whole structure only."""
        self._missing("mass_matrix")

    @property
    def damping_matrix(self) -> NoReturn:
        """Raises TypeError: of the whole structure only."""
        self._missing("damping_matrix")

    @property
    def stiffness_matrix(self) -> NoReturn:
        """Raises TypeError: of the whole structure only."""
        self._missing("stiffness_matrix")

    def __reduce__(self) -> Any:
        arguments = (self.dofs, self.frequency, self.harmonics, self.seen, self.certificate)
        return CondensedModel, (self.structure, *arguments)

    def __repr__(self) -> str:
        low, high = self.frequency
        return (
            f"Condensed{super().__repr__()}\n  kept of {self.n_whole} degrees of freedom, "
            f"{low:g} to {high:g} Hz, harmonics {self.harmonics}, "
            f"linear responses exact to {self.certificate.error:.1e}, with friction to "
            f"{self.certificate.friction_bound:.1e}; the largest response is that of these "
            f"{self.n_dof}"
        )
