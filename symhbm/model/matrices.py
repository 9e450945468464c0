"""Structures given by mass, damping and stiffness matrices.

``M x'' + C x' + K x + sum_j w_j f_j(w_j^T x) = F(t)``, the contacts being those of `Structure`. The
dynamic stiffness is a polynomial of the frequency, harmonic by harmonic.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from symhbm.model.damping import Damping, RayleighDamping
from symhbm.model.linear import (
    Matrices,
    NearModes,
    all_modes,
    check_semidefinite,
    hermitian,
    weighted,
)
from symhbm.model.parameters import BLADE_PARAMETERS, CONTACT_PARAMETERS, PARAMETERS
from symhbm.model.places import check_places
from symhbm.model.structure import Structure
from symhbm.numerics import ComplexArray, FloatArray, check, negative_eigenvalues


class PolynomialStructure(Structure):
    """A structure of ``Z = sum_k omega^k A_k`` in each harmonic, and of an inertia.

    Models, what rotates, and sectors of both tell their `powers`.
    """

    is_polynomial = bends = True

    def matrices_in(self, harmonic: int) -> Matrices:
        """Matrices of a harmonic, sparse, of motions ``Re(x exp(i n omega t))``."""
        return self.matrices(self.wave(harmonic))

    @abstractmethod
    def loss_stiffness(self, nodal_diameter: int | None = None) -> Any:
        """What the loss factor makes of the stiffness, sparse (n_dof, n_dof) [N/m].

        Of a sector of a disk in a wave of so many nodal diameters.
        """

    def rotation_powers(self, harmonic: int) -> dict[int, Any]:
        """What rotation adds to the ``A_k``, sparse (n_dof, n_dof) by ``k``."""
        return {}

    def powers(self, harmonic: int) -> dict[int, Any]:
        """Sparse ``A_k`` (n_dof, n_dof) by ``k``: ``K + i n omega C - (n omega)^2 M`` and more."""
        mass, damping, stiffness = self.matrices_in(harmonic)
        result = {0: stiffness, 1: 1j * harmonic * damping, 2: -(harmonic**2) * mass}
        if harmonic and self.loss_factor:
            result[0] = stiffness + 1j * self.loss_stiffness(self.wave(harmonic))
        for power, added in self.rotation_powers(harmonic).items():
            result[power] = result[power] + added if power in result else added
        return result

    def _dense(self, harmonic: int) -> tuple[dict[int, ComplexArray], ComplexArray, ComplexArray]:
        """``A_k``, directions of the contacts and the mass matrix as arrays."""

        def made() -> tuple[dict[int, ComplexArray], ComplexArray, ComplexArray]:
            powers = self.powers(harmonic).items()
            dense = {k: part.toarray().astype(complex) for k, part in powers}
            mass = self.matrices_in(harmonic).mass_matrix.toarray()
            return dense, self.directions_in(harmonic).toarray(), mass

        return self.of_matrices(harmonic, made)

    def dynamic_stiffness(
        self, harmonic: int, frequency: float
    ) -> tuple[ComplexArray, ComplexArray]:
        """The polynomial and its derivative by the frequency, dense."""
        parts = self._dense(harmonic)[0]
        value, slope = np.zeros((2, self.n_dof, self.n_dof), dtype=complex)
        for power, part in parts.items():
            value += frequency**power * part
            if power:
                slope += power * frequency ** (power - 1) * part
        return value, slope

    @property
    def static_stiffness(self) -> Any:
        """Stiffness at rest, sparse (n_dof, n_dof) [N/m]."""
        return self.matrices_in(0).stiffness_matrix

    def forces_curvature(self, harmonic: int, frequency: float) -> ComplexArray:
        """Second derivative of the dynamic stiffness by the frequency, (n_dof, n_dof)."""
        result = np.zeros((self.n_dof, self.n_dof), dtype=complex)
        for power, part in self._dense(harmonic)[0].items():
            if power > 1:
                result += power * (power - 1) * frequency ** (power - 2) * part
        return result

    def _undamped(self, harmonic: int, frequency: float, springs: FloatArray) -> ComplexArray:
        parts, directions, _ = self._dense(harmonic)
        whole = sum(frequency**power * part for power, part in parts.items())
        return hermitian(whole + weighted(directions.conj().T, springs) @ directions)

    def modes_below(self, harmonic: int, frequency: float, springs: FloatArray) -> int | None:
        """Number of natural frequencies below a harmonic, counted exactly."""
        return negative_eigenvalues(self._undamped(harmonic, frequency, springs))

    def modes_near(
        self, harmonic: int, frequency: float, springs: FloatArray, losses: FloatArray
    ) -> NearModes | None:
        """All modes of a harmonic, with springs and losses; None where a motion has no inertia."""
        exciting, (_, directions, mass) = harmonic * frequency, self._dense(harmonic)
        elastic = self._undamped(harmonic, frequency, springs) + exciting**2 * mass
        try:
            squares, shapes = all_modes(elastic, mass)
        except ValueError:
            return None
        if len(squares) < self.n_dof:
            return None
        natural = np.sqrt(np.maximum(squares, 1e-300))
        whole = self.dynamic_stiffness(harmonic, frequency)[0]
        loss = (whole - whole.conj().T) / 2j + weighted(directions.conj().T, losses) @ directions
        width = np.einsum("ik,ij,jk->k", shapes.conj(), loss / exciting, shapes, optimize=True)
        near = np.ones(len(natural), dtype=bool)
        return NearModes(natural - exciting, width.real / 2, near, shapes)


@dataclass(frozen=True, eq=False, repr=False)
class Model(PolynomialStructure):
    """Structure of Eqs. (1)-(2) with general matrices and contacts.

    Parameters
    ----------
    mass_matrix, damping_matrix, stiffness_matrix : (n_dof, n_dof)
        Dense or `scipy.sparse` [kg, N s/m, N/m]. Damping may be a `ModalDamping`,
        `RayleighDamping` or `StructuralDamping` instead, from which its matrix follows.
    contacts : sequence of (dof, dof), (dof,) or {dof: weight}, or `symhbm.Contacts` by name
        The two degrees of freedom of each contact, ``y = x[first] - x[second]``; one alone is
        connected to the ground; weights make ``y = sum_i weight_i x[i]``, also as the rows of an
        array (n, n_dof). They are friction elements and cubic springs; groups of any laws have
        names, and their values with them. Parameters of groups are ``"<group>.<parameter>"``,
        those of one group alone their name.
    contact_stiffness, friction_coefficient, normal_load : one value or one per contact
        ``k_d`` [N/m], ``mu`` [-], ``F_n`` [N] of the friction element: all three, or none where
        the contacts are cubic springs alone. An explicit 0 makes a contact slide freely.
    cubic_stiffness : one value or one per contact
        ``gamma`` [N/m^3] of the force ``gamma y^3``, of any sign.
    places : `symhbm.Places`, or its columns by name
        Where degrees of freedom are. Contacts and forces may then call them by label or node and
        direction, ``"tip:y"`` or ``"1207:y"``, and results tell them.

    Raises
    ------
    TypeError, ValueError
        If a matrix is not square, real and finite, if stiffness has a negative diagonal
        entry, if a contact joins a degree of freedom to itself or to one that does not exist, is a
        list of numbers, which may be degrees of freedom or weights, or lacks a parameter, or if one
        of friction is negative; for a mass matrix that is not symmetric or not positive
        semidefinite.

    Notes
    -----
    Degrees of freedom without inertia, rotations of lumped masses for example, are let pass here,
    by `frf`, `follow` and `solve`. `periodic_motion`, `condense` and bands found from natural
    frequencies need a positive definite mass matrix, and refuse others; ``stability`` is unknown
    without.

    Damping may be negative, as that of air that drives a blade. Responses then need be neither
    unique nor stable; `limit_cycles` gives the motions without a force.

    Each contact has one direction and slips by itself. Two of them along two axes of one place are
    no contact with planar friction: under a motion at 45 degrees to both, they begin to slip at
    sqrt(2) times its force. The model knows degrees of freedom and no places, and cannot tell.
    Where the direction of motion is known, give the contact the weights of that direction.

    Examples
    --------
    Two masses, one contact between them and one between the second and the ground:

    >>> import symhbm as sh
    >>> model = sh.Model(
    ...     [[1, 0], [0, 1]], [[0.5, 0], [0, 0.5]], [[2e4, -1e4], [-1e4, 1e4]],
    ...     contacts=[(0, 1), (1,)],
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=[3, 5],
    ... )
    >>> model.with_parameters(normal_load=4).normal_load
    array([4., 4.])
    """

    mass_matrix: Any
    damping_matrix: Any
    stiffness_matrix: Any
    contacts: Any = ()
    contact_stiffness: Any = None
    friction_coefficient: Any = None
    normal_load: Any = None
    cubic_stiffness: Any = None
    lumped: bool = False
    places: Any = None

    WITHOUT_MATRICES = (
        "expected viscous damping, a loss factor is of forced responses alone; give a ModalDamping "
        "with half the loss factor as ratio, or a damping matrix"
    )

    damping: ClassVar[Any] = None
    """The rule that damping follows, as `RayleighDamping`, None where it is a matrix alone."""
    coriolis_matrix: ClassVar[Any] = None
    """The matrix of Coriolis forces at its speed, ``Omega G``, beside a rule of damping."""

    def __post_init__(self):
        size, given = None, self.damping_matrix
        if isinstance(given, Damping):
            self._store(damping=given)
            vars(self).pop("damping_matrix")
        for name in ("mass_matrix", "damping_matrix", "stiffness_matrix"):
            if name in vars(self):
                matrix = matrix_of(name, getattr(self, name), size)
                size = matrix.shape[0]
                self._store(**{name: matrix})
        check_semidefinite(self.mass_matrix)
        self._store(places=check_places(self.places, self.n_dof))
        self._set_contacts(
            self.contacts, **{name: getattr(self, name) for name in CONTACT_PARAMETERS}
        )

    def with_damping(self, damping: Any) -> Model:
        """Return a copy with another damping, a matrix or a rule as `ModalDamping`.

        Raises as `Model`, and TypeError for what has matrices of its own kind.
        """
        if type(self) is not Model or self.lumped:
            raise TypeError(
                "with_damping: expected a Model of matrices; that of a blade or a disk of them is "
                "the parameter damping, of others that of the structure they are made of"
            )
        changed = Model(self.mass_matrix, damping, self.stiffness_matrix, places=self.places)
        other = self._copy()
        for name in ("damping", "damping_matrix"):
            vars(other).pop(name, None)
            if name in vars(changed):
                other._store(**{name: vars(changed)[name]})
        return other

    def __getattr__(self, name: str) -> Any:
        if name != "damping_matrix" or self.damping is None:
            return super().__getattr__(name)
        # Modes take time: they are computed where the matrix is asked for.
        own = self.mass_matrix, self.stiffness_matrix
        self._store(damping_matrix=self.damping_seen(lambda matrix: matrix, *own))
        return vars(self)["damping_matrix"]

    def damping_seen(self, seen: Callable[[Any], Any], mass: Any, stiffness: Any) -> Any:
        """The damping matrix of a wave, of a reduced structure, ..: of all that it is made of.

        ``seen`` makes such a matrix of one of the structure; ``mass`` and ``stiffness`` are those,
        whose modes a rule of damping is of.
        """
        if self.damping is None:
            return seen(self.damping_matrix)
        found = self.damping.matrix(mass, stiffness)
        return found if self.coriolis_matrix is None else found + seen(self.coriolis_matrix)

    def without_rule(self) -> Model:
        """The same without a rule of damping."""
        if self.damping is None:
            return self
        other = self._copy(damping=RayleighDamping())
        vars(other).pop("damping_matrix", None)
        return other

    @property
    def loss_factor(self) -> float:  # type: ignore[override]
        """Loss factor of a structure with structural damping, 0 of others."""
        return 0.0 if self.damping is None else self.damping.loss_factor

    def loss_stiffness(self, nodal_diameter: int | None = None) -> Any:
        """The loss factor times all of the stiffness."""
        return self.loss_factor * self.stiffness_matrix

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom."""
        return int(self.mass_matrix.shape[0])

    def _own_parameters(self) -> dict[str, FloatArray]:
        """Those of each blade, of a lumped model only."""
        names = BLADE_PARAMETERS if self.lumped else ()
        return {name: getattr(self, f"{name}_matrix").data for name in names}

    def _put(self, name: str, value: ArrayLike) -> None:
        if name in BLADE_PARAMETERS:
            self._store(**{f"{name}_matrix": diagonal(name, value, self.n_dof)})
        else:
            super()._put(name, value)

    @property
    def has_matrices(self) -> bool:  # type: ignore[override]
        """Whether they are all there is: structural damping is none of them."""
        return self.damping is None or not self.damping.loss_factor

    def fields(self) -> dict[str, Any]:
        """What makes it again; damping by a rule is the rule."""
        fields = super().fields()
        if self.damping is not None:
            fields.pop("damping_matrix", None)
        # Their diagonals are parameters, which change them.
        nothing = sp.eye_array(self.n_dof, format="csc")
        return fields | {f"{name}_matrix": nothing for name in BLADE_PARAMETERS if self.lumped}


def diagonal(name: str, value: ArrayLike, size: int) -> sp.csc_array:
    """Diagonal matrix of one value or one per blade of a named parameter."""
    entries = check.one_or_each(name, value, size, "blade", PARAMETERS[name].bound)
    # Zeros stay stored: each blade keeps its place among the parameters. The entries are read-only.
    return sp.csc_array((entries, np.arange(size), np.arange(size + 1)), shape=(size, size))


def matrix_of(name: str, value: Any, size: int | None) -> Any:
    """A square matrix, sparse, read-only, of ``size``; TypeError or ValueError for what is none."""
    matrix: Any
    if sp.issparse(value):
        matrix = sp.csc_array(value, copy=True)
        check.array(f"{name} entries", matrix.data)
        matrix = matrix.astype(float, copy=False)
    else:
        dense = check.array(name, value)
        if dense.ndim != 2:
            raise ValueError(f"{name}: expected a square matrix, got shape {dense.shape}")
        matrix = sp.csc_array(dense)
    if matrix.shape[0] != matrix.shape[1] or matrix.shape[0] == 0:
        raise ValueError(f"{name}: expected a square matrix, got shape {matrix.shape}")
    if size is not None and matrix.shape[0] != size:
        raise ValueError(
            f"{name}: expected shape {(size, size)} as the mass matrix, got {matrix.shape}"
        )
    matrix.sum_duplicates()
    matrix.data.setflags(write=False)
    diagonal = matrix.diagonal()
    if name in ("mass_matrix", "stiffness_matrix") and np.any(diagonal < 0):
        i = int(np.argmax(diagonal < 0))
        raise ValueError(f"{name}: expected a diagonal >= 0, entry {i} is {diagonal[i]:g}")
    return matrix
