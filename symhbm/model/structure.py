"""What vibrates, seen from its contacts.

Contact ``j`` acts on the relative displacement ``y_j = w_j^T x`` of two degrees of freedom, or of
one and the ground. It is a dry friction element, a cubic spring, or both side by side.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from symhbm.model.contacts import slip_limit
from symhbm.model.parameters import CONTACT_PARAMETERS, FRICTION_PARAMETERS, PARAMETERS
from symhbm.numerics import ComplexArray, FloatArray, check

_MATRICES = ("mass_matrix", "damping_matrix", "stiffness_matrix")


class NearModes(NamedTuple):
    """All modes of a structure with its contacts as springs, ascending, arrays (n_modes,).

    ``detuning``, the natural less the exciting frequency [rad/s]; ``width``, half that of the
    resonance [rad/s]; ``near``, whether a mode is near enough for both to be of it; ``shapes``
    (n_dof, n_near), the motions of those that are, of unit mass.
    """

    detuning: FloatArray
    width: FloatArray
    near: NDArray[np.bool_]
    shapes: FloatArray


class Structure(ABC):
    """A structure by its dynamic stiffness, and its contacts.

    `Model` is one, given by matrices. One of your own derives from this class and tells its
    `dynamic_stiffness`; what else is here has defaults.

    Parameters
    ----------
    n_dof
        Number of degrees of freedom.
    contacts, contact_stiffness, friction_coefficient, normal_load, cubic_stiffness
        As of `Model`.

    Raises
    ------
    TypeError, ValueError
        As `Model`, for bad contacts.

    Notes
    -----
    Without matrices there are no stability, no exact motion in time, no designs and no
    ``accuracy=``: they say so. Without `modes_below`, resonances that are so narrow that they show
    at neither end of a step of a path can be stepped over. Where the dynamic stiffness has a pole
    that nothing damps, the response passes through zero and a path does not: damp the inside too.

    Examples
    --------
    A rod, clamped at one end, with its force and its damper at the other:

    >>> import numpy as np
    >>> import symhbm as sh
    >>> class Rod(sh.Structure):  # 1 m long, wave speed 100 m/s, E A = 1e4 N, loss factor 0.02
    ...     def dynamic_stiffness(self, harmonic, frequency):
    ...         speed = 100 * np.sqrt(1 + 0.02j)
    ...         x = max(harmonic * frequency, 1e-6) / speed
    ...         value = 1e4 * (1 + 0.02j) * x / np.tan(x)
    ...         slope = 1e4 * (1 + 0.02j) / speed * (1 / np.tan(x) - x / np.sin(x) ** 2)
    ...         return np.array([[value]]), np.array([[harmonic * slope]])
    >>> rod = Rod(1, [(0,)], contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3)
    >>> response = sh.frf(sh.HarmonicBalance(rod, sh.PointForce()), (10, 40), progress=False)
    >>> response.n_peaks.item()
    1
    """

    contacts: tuple[tuple[int, ...], ...]
    contact_stiffness: Any
    friction_coefficient: Any
    normal_load: Any
    cubic_stiffness: Any
    mass_matrix: Any
    damping_matrix: Any
    stiffness_matrix: Any
    _n_dof: int
    WITHOUT_MATRICES = (
        "expected a structure with matrices, this one is given by its dynamic stiffness; sweep its "
        "parameters with over= of frf, or describe it by a Model"
    )
    """What is said where mass, damping and stiffness matrices are needed."""
    lumped = False
    """Whether every degree of freedom is a blade with parameters of its own."""

    def __init__(self, n_dof: int, contacts: Any = (), **parameters: Any):
        self._store(_n_dof=check.integer("n_dof", n_dof, minimum=1))
        for name in parameters:
            check.known(name, dict.fromkeys(CONTACT_PARAMETERS), "parameter of contacts")
        self._set_contacts(contacts, **parameters)

    def __getattr__(self, name: str) -> Any:
        if name in _MATRICES:
            raise TypeError(f"{name}: {self.WITHOUT_MATRICES}")
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    @abstractmethod
    def dynamic_stiffness(
        self, harmonic: int, frequency: float
    ) -> tuple[ComplexArray, ComplexArray]:
        """Force over motion in one harmonic, and its derivative by the angular frequency [rad/s].

        Complex, (n_dof, n_dof) [N/m, N s/m], for motions ``Re(x exp(i n omega t))``.
        """

    def _set_contacts(self, contacts: Any, **parameters: Any) -> None:
        self._store(contacts=_contact_dofs(contacts, self.n_dof))
        given = {name: parameters.get(name) for name in CONTACT_PARAMETERS}
        self._check_complete(given)
        for name, value in given.items():
            self._store(**{name: self._each(name, 0.0 if value is None else value)})

    def _check_complete(self, values: dict[str, Any]) -> None:
        """Raise ValueError for contacts that do nothing since a parameter was forgotten."""
        if not self.n_contacts:
            return
        given = [name for name in FRICTION_PARAMETERS if values[name] is not None]
        missing = [name for name in FRICTION_PARAMETERS if name not in given]
        if not missing or (not given and values["cubic_stiffness"] is not None):
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
        return self._n_dof

    @property
    def n_contacts(self) -> int:
        """Number of contacts."""
        return len(self.contacts)

    @property
    def slip_limit(self) -> FloatArray:
        """``mu F_n`` of each contact [N]."""
        return slip_limit(self.friction_coefficient, self.normal_load)

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
        """Named parameters: those of the contacts, one value each."""
        return {name: np.asarray(getattr(self, name)) for name in CONTACT_PARAMETERS}

    def with_parameters(self, **values: ArrayLike) -> Self:
        """Return a copy with other values, one or one per blade or contact, of named parameters.

        Raises KeyError for a name that is no parameter, and as the constructor for bad values.
        """
        # What does not change was checked when this structure was made.
        other = object.__new__(type(self))
        other._store(**vars(self))
        for name, value in values.items():
            check.known(name, self.parameters, "parameter of this model")
            other._put(name, value)
        return other

    def _put(self, name: str, value: ArrayLike) -> None:
        self._store(**{name: self._each(name, value)})

    def _store(self, **values: Any) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def _each(self, name: str, value: ArrayLike) -> FloatArray:
        """Checked values of a parameter of the contacts, (n_contacts,)."""
        bound = PARAMETERS[name].bound
        return check.one_or_each(name, value, self.n_contacts, "contact", bound)

    @property
    def has_matrices(self) -> bool:
        """Whether mass, damping and stiffness matrices are known."""
        return False

    @property
    def n_whole(self) -> int:
        """Number of degrees of freedom that forces may act on."""
        return self.n_dof

    @property
    def kept(self) -> NDArray[np.intp] | None:
        """Numbers of the degrees of freedom in the structure this one was made from, if any."""
        return None

    @property
    def inertia(self) -> FloatArray | None:
        """A mass matrix (n_dof, n_dof) [kg] that tells how large inertia forces are, if known."""
        return None

    @property
    def pole_residues(self) -> dict[int, Any] | None:
        """By harmonic, ``[Z, G]`` as functions with poles, for compiled corrections, if known."""
        return None

    @property
    def static_stiffness(self) -> Any:
        """Stiffness at rest, sparse (n_dof, n_dof) [N/m]."""
        return sp.csc_array(self.dynamic_stiffness(0, 0.0)[0].real)

    def check_frequencies(self, name: str, values: ArrayLike) -> None:  # noqa: B027
        """Raise ValueError for frequencies [Hz] that the structure is not made for."""

    def check_harmonics(self, harmonics: tuple[int, ...]) -> None:  # noqa: B027
        """Raise ValueError for harmonics that the structure is not made for."""

    def split_force(self, shape: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A force (n_whole, n) as one on the degrees of freedom and shares of known patterns."""
        return shape, np.zeros((0, shape.shape[1]))

    def linear_forces(self, harmonic: int, frequency: float) -> tuple[ComplexArray, ComplexArray]:
        """``[Z, G]``, forces by motions and by force patterns, and its derivative by frequency."""
        return self.dynamic_stiffness(harmonic, frequency)

    def modes_below(self, harmonic: int, frequency: float, springs: FloatArray) -> int | None:
        """Number of natural frequencies below a harmonic, with springs (n_contacts,) [N/m].

        None if nobody knows.
        """
        return None

    def modes_near(
        self, harmonic: int, frequency: float, springs: FloatArray, losses: FloatArray
    ) -> NearModes | None:
        """Modes near a harmonic, with springs and losses (n_contacts,) [N/m]; None if unknown."""
        return None

    def description(self) -> dict[str, Any]:
        """What tells it apart in a dataset, as JSON keeps it."""
        return {"structure": {"type": type(self).__name__}}

    def __repr__(self) -> str:
        kind = "lumped blade" if self.lumped else "degree of freedom"
        plural = kind.replace("degree", "degrees") if " of " in kind else f"{kind}s"
        lines = [
            f"{type(self).__name__}: {self.n_dof} {kind if self.n_dof == 1 else plural}, "
            f"{self.n_contacts} contact{'' if self.n_contacts == 1 else 's'}"
        ]
        for name, value in self.parameters.items():
            if value.size and (name != "cubic_stiffness" or self.has_cubic_springs):
                low, high = value.min(), value.max()
                text = f"{low:g}" if low == high else f"{low:g} .. {high:g}"
                lines.append(f"  {name:<21} {text} {PARAMETERS[name].unit}".rstrip())
        return "\n".join(lines)


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
