"""Structures with contacts: matrices, contact directions and their parameters.

``M x'' + C x' + K x + sum_j w_j f_j(w_j^T x) = F(t)``: contact ``j`` acts on the relative
displacement ``y_j = w_j^T x`` of two degrees of freedom, or of one and the ground. It is a dry
friction element, a cubic spring, or both side by side.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from symhbm.model.mass import check_semidefinite
from symhbm.model.parameters import (
    BLADE_PARAMETERS,
    CONTACT_PARAMETERS,
    FRICTION_PARAMETERS,
    PARAMETERS,
)
from symhbm.numerics import FloatArray, check


@dataclass(frozen=True, eq=False, repr=False)
class Model:
    """Structure of Eqs. (1)-(2) with general matrices and contacts.

    Parameters
    ----------
    mass_matrix, damping_matrix, stiffness_matrix : (n_dof, n_dof)
        Dense or `scipy.sparse` [kg, N s/m, N/m].
    contacts : sequence of (dof, dof) or (dof,)
        The two degrees of freedom of each contact, ``y = x[first] - x[second]``; one alone is
        connected to the ground.
    contact_stiffness, friction_coefficient, normal_load : one value or one per contact
        ``k_d`` [N/m], ``mu`` [-], ``F_n`` [N] of the friction element: all three, or none where
        the contacts are cubic springs alone. An explicit 0 makes a contact slide freely.
    cubic_stiffness : one value or one per contact
        ``gamma`` [N/m^3] of the force ``gamma y^3``, of any sign.

    Raises
    ------
    TypeError, ValueError
        If a matrix is not square, real and finite, if damping or stiffness have a negative diagonal
        entry, if a contact joins a degree of freedom to itself or to one that does not exist, or if
        a parameter of the contacts is missing, or one of friction is negative; for a mass matrix
        that is not symmetric or not positive semidefinite.

    Notes
    -----
    Degrees of freedom without inertia, rotations of lumped masses for example, are let pass here,
    by `frf`, `follow` and `solve`. `periodic_motion`, `condense` and bands found from natural
    frequencies need a positive definite mass matrix, and refuse others; ``stability`` is unknown
    without.

    Each contact has one direction and slips by itself. Two of them along two axes of one place are
    no contact with planar friction: under a motion at 45 degrees to both, they begin to slip at
    sqrt(2) times its force. The model knows degrees of freedom and no places, and cannot tell.
    Where the direction of motion is known, make that a degree of freedom.

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

    def __post_init__(self):
        put = object.__setattr__
        size = None
        for name in ("mass_matrix", "damping_matrix", "stiffness_matrix"):
            matrix = _matrix(name, getattr(self, name), size)
            size = matrix.shape[0]
            put(self, name, matrix)
        check_semidefinite(self.mass_matrix)
        put(self, "contacts", _contact_dofs(self.contacts, self.n_dof))
        self._check_complete()
        for name in CONTACT_PARAMETERS:
            value = getattr(self, name)
            put(self, name, self._each(name, 0.0 if value is None else value))

    def _check_complete(self) -> None:
        """Raise ValueError for contacts that do nothing since a parameter was forgotten."""
        if not self.n_contacts:
            return
        given = [name for name in FRICTION_PARAMETERS if getattr(self, name) is not None]
        missing = [name for name in FRICTION_PARAMETERS if name not in given]
        if not missing or (not given and self.cubic_stiffness is not None):
            return
        spring = given == ["contact_stiffness"]
        raise ValueError(
            f"{', '.join(f'{name}=None' for name in missing)}: expected contact_stiffness, "
            "friction_coefficient and normal_load for friction (an explicit 0 for contacts that "
            "slide freely), or cubic_stiffness alone for cubic springs; without them contacts do "
            "nothing" + ("; a linear spring is a part of stiffness_matrix" if spring else "")
        )

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom."""
        return int(self.mass_matrix.shape[0])

    @property
    def n_contacts(self) -> int:
        """Number of contacts."""
        return len(self.contacts)

    @property
    def has_cubic_springs(self) -> bool:
        """Whether any contact has a cubic spring: responses then need not be unique."""
        return bool(np.any(self.cubic_stiffness))

    @cached_property
    def directions(self) -> sp.csr_array:
        """Directions ``w_j`` as rows, shape ``(n_contacts, n_dof)``."""
        rows = [j for j, dofs in enumerate(self.contacts) for _ in dofs]
        columns = [dof for dofs in self.contacts for dof in dofs]
        values = [sign for dofs in self.contacts for sign in (1.0, -1.0)[: len(dofs)]]
        return sp.csr_array((values, (rows, columns)), shape=(self.n_contacts, self.n_dof))

    @property
    def parameters(self) -> dict[str, FloatArray]:
        """Named parameters: per blade (of a lumped model only) and per contact."""
        named: dict[str, FloatArray] = {}
        if self.lumped:
            named |= {name: getattr(self, f"{name}_matrix").data for name in BLADE_PARAMETERS}
        return named | {name: np.asarray(getattr(self, name)) for name in CONTACT_PARAMETERS}

    def with_parameters(self, **values: ArrayLike) -> Model:
        """Return a copy with other values, one or one per blade or contact, of named parameters.

        Raises KeyError for a name that is no parameter, and as the constructor for bad values.
        """
        # What does not change was checked when this model was made.
        other = object.__new__(Model)
        other.__dict__.update(self.__dict__)
        for name, value in values.items():
            check.known(name, self.parameters, "parameter of this model")
            if name in BLADE_PARAMETERS:
                other.__dict__[f"{name}_matrix"] = _diagonal(name, value, self.n_dof)
            else:
                other.__dict__[name] = self._each(name, value)
        return other

    def _each(self, name: str, value: ArrayLike) -> FloatArray:
        """Checked values of a parameter of the contacts, (n_contacts,)."""
        bound = PARAMETERS[name].bound
        return check.one_or_each(name, value, self.n_contacts, "contact", bound)

    def __reduce__(self):
        return _restored, ({field.name: getattr(self, field.name) for field in fields(self)},)

    def __repr__(self) -> str:
        kind = "lumped blade" if self.lumped else "degree of freedom"
        plural = kind.replace("degree", "degrees") if " of " in kind else f"{kind}s"
        lines = [
            f"Model: {self.n_dof} {kind if self.n_dof == 1 else plural}, "
            f"{self.n_contacts} contact{'' if self.n_contacts == 1 else 's'}"
        ]
        for name, value in self.parameters.items():
            if value.size and (name != "cubic_stiffness" or self.has_cubic_springs):
                low, high = value.min(), value.max()
                text = f"{low:g}" if low == high else f"{low:g} .. {high:g}"
                lines.append(f"  {name:<21} {text} {PARAMETERS[name].unit}".rstrip())
        return "\n".join(lines)


def single_blade(
    *,
    mass: float,
    stiffness: float,
    damping: float,
    contact_stiffness: float,
    friction_coefficient: float,
    normal_load: float,
    cubic_stiffness: float = 0.0,
) -> Model:
    """One blade on a ground spring with one friction damper to the ground: Fig. 1 and Eq. (1).

    Values in kg, N/m, N s/m, N/m, -, N, N/m^3. Raises as `Model`.

    Examples
    --------
    >>> import symhbm as sh
    >>> sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    Model: 1 lumped blade, 1 contact
      mass                  1 kg
      damping               0.5 N s/m
      stiffness             10000 N/m
      contact_stiffness     10000 N/m
      friction_coefficient  0.5
      normal_load           3 N
    """
    values = dict(mass=mass, damping=damping, stiffness=stiffness)
    matrices = [_diagonal(name, value, 1) for name, value in values.items()]
    return Model(
        *matrices,
        contacts=[(0,)],
        contact_stiffness=contact_stiffness,
        friction_coefficient=friction_coefficient,
        normal_load=normal_load,
        cubic_stiffness=cubic_stiffness,
        lumped=True,
    )


def bladed_disk(
    n_blades: int,
    *,
    mass: ArrayLike,
    stiffness: ArrayLike,
    damping: ArrayLike,
    contact_stiffness: ArrayLike,
    friction_coefficient: ArrayLike,
    normal_load: ArrayLike,
    cubic_stiffness: ArrayLike = 0.0,
) -> Model:
    """Ring of blades on ground springs, each coupled to the next by a friction damper (Fig. 5).

    Contact ``j`` joins blades ``j`` and ``(j + 1) mod n_blades``. Each parameter is one value or
    one per blade or contact, in kg, N/m, N s/m, N/m, -, N, N/m^3. Raises as `Model`, and ValueError
    for fewer than 3 blades.

    Examples
    --------
    >>> import symhbm as sh
    >>> disk = sh.bladed_disk(
    ...     3, mass=[1, 1.01, 0.99], stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e6, friction_coefficient=0.5, normal_load=10,
    ... )
    >>> disk.contacts
    ((0, 1), (1, 2), (2, 0))
    """
    n_blades = check.integer("n_blades", n_blades, minimum=3)
    values = dict(mass=mass, damping=damping, stiffness=stiffness)
    matrices = [_diagonal(name, value, n_blades) for name, value in values.items()]
    return Model(
        *matrices,
        contacts=[(j, (j + 1) % n_blades) for j in range(n_blades)],
        contact_stiffness=contact_stiffness,
        friction_coefficient=friction_coefficient,
        normal_load=normal_load,
        cubic_stiffness=cubic_stiffness,
        lumped=True,
    )


def _restored(values: dict[str, Any]) -> Model:
    """The model that was pickled: it was checked when it was made, but its arrays are writable."""
    for value in values.values():
        array = value.data if sp.issparse(value) else value
        if isinstance(array, np.ndarray):
            array.setflags(write=False)
    model = object.__new__(Model)
    model.__dict__.update(values)
    return model


def _diagonal(name: str, value: ArrayLike, size: int) -> sp.csc_array:
    entries = check.one_or_each(name, value, size, "blade", PARAMETERS[name].bound)
    # Zeros stay stored: each blade keeps its place among the parameters. The entries are read-only.
    return sp.csc_array((entries, np.arange(size), np.arange(size + 1)), shape=(size, size))


def _matrix(name: str, value: Any, size: int | None) -> Any:
    matrix: Any
    if sp.issparse(value):
        matrix = sp.csc_array(value, copy=True)
        check.array(f"{name} entries", matrix.data)
        matrix = matrix.astype(float)
    else:
        dense = check.array(name, value)
        if dense.ndim != 2:
            raise ValueError(f"{name}: expected a square matrix, got shape {dense.shape}")
        matrix = sp.csc_array(dense)
    check.array(f"{name} entries", matrix.data)
    if matrix.shape[0] != matrix.shape[1] or matrix.shape[0] == 0:
        raise ValueError(f"{name}: expected a square matrix, got shape {matrix.shape}")
    if size is not None and matrix.shape[0] != size:
        raise ValueError(
            f"{name}: expected shape {(size, size)} as the mass matrix, got {matrix.shape}"
        )
    matrix.sum_duplicates()
    matrix.data.setflags(write=False)
    diagonal = matrix.diagonal()
    if np.any(diagonal < 0):
        i = int(np.argmax(diagonal < 0))
        raise ValueError(f"{name}: expected a diagonal >= 0, entry {i} is {diagonal[i]:g}")
    return matrix


def _contact_dofs(contacts: Any, n_dof: int) -> tuple[tuple[int, ...], ...]:
    if isinstance(contacts, (str, bytes)) or not isinstance(contacts, Iterable):
        raise TypeError(f"contacts={check.shown(contacts)}: expected a sequence of DOF pairs")
    result = []
    for j, dofs in enumerate(contacts):
        # A number may be meant for a contact to the ground, or for half of the only contact.
        if not isinstance(dofs, Iterable):
            raise TypeError(
                f"contacts[{j}]={check.shown(dofs)}: expected (first, second), as in [(0, 1)], or "
                "(dof,) for a contact to the ground"
            )
        pair = tuple(dofs)
        if len(pair) not in (1, 2):
            raise ValueError(f"contacts[{j}]={check.shown(dofs)}: expected one or two DOFs")
        pair = tuple(check.integer(f"contacts[{j}]", dof, 0, n_dof - 1) for dof in pair)
        if len(set(pair)) != len(pair):
            raise ValueError(
                f"contacts[{j}]={check.shown(dofs)}: a contact joins two different DOFs"
            )
        result.append(pair)
    return tuple(result)
