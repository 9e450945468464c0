"""The multi-harmonic balance equations, Eq. (9), compiled once for every parameter set."""

import warnings
from collections.abc import Iterable
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symhbm.balance.dynamic_stiffness import DynamicStiffness
from symhbm.balance.equations import MATRIX_INPUTS, Equations
from symhbm.balance.evaluation import Evaluation
from symhbm.balance.unknowns import Unknowns
from symhbm.model import CONTACT_PARAMETERS, Excitation, Model, Structure, Symmetry, find_symmetry
from symhbm.model.contacts import ContactState, locate, locate_sampled, slip_limit
from symhbm.numerics import FloatArray, FourierBasis, check, check_harmonics

LARGE = 100_000
"""Entries of a stiffness matrix from which compiling it takes longer (5 s) than condensing it."""
_FEW = 4
"""Degrees of freedom for each one that contacts touch, from which condensing is worth it."""
_COMMON = {*CONTACT_PARAMETERS, "force_amplitude"}
"""Parameters whose values are compared sector by sector wherever they are set."""


class HarmonicBalance(Unknowns):
    """Multi-harmonic balance of a model under an excitation, Eq. (9).

    Parameters
    ----------
    model, excitation
        What vibrates, and what drives it.
    harmonics
        Harmonics of the response, for example ``(1,)``, ``(1, 3, 5)`` or ``(0, 1, 2, 3)``.
    samples
        March the friction law over so many samples of the period (alternating frequency and time)
        instead of locating its switching angles: a cross-check, with a sampling error that
        results state.
    symmetry
        Balance the first of the sectors that `symhbm.model.find_symmetry` tells: the unknowns
        are its coefficients alone, the contacts its own.

    Raises
    ------
    TypeError, ValueError
        For a bad harmonic set, an excitation that does not fit the model or the set, or samples
        too few for the harmonics.

    Attributes
    ----------
    contact_stiffness, cubic_stiffness, slip_limit : (n_contacts,)
        Of the contacts that are located [N/m, N/m^3, N].

    Notes
    -----
    The unknowns are the Fourier coefficients [m], degree of freedom by degree of freedom,
    component by component within one. ``residual`` is one CasADi function of the unknowns, the
    angular frequency [rad/s] and all physical parameters; ``mass``, ``damping`` and ``stiffness``
    are the stored entries of the matrices in column order, which for a lumped model is one value
    per blade. Its inputs ``matrix`` and ``vector`` are the located contact events.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.PointForce())
    >>> problem.with_parameters(normal_load=5, force_amplitude=2.0).parameters["normal_load"]
    array([5.])
    """

    def __init__(
        self,
        model: Structure,
        excitation: Excitation,
        harmonics: Iterable[int] = (1,),
        samples: int | None = None,
        symmetry: Symmetry | None = None,
    ):
        if not isinstance(model, Structure):
            raise TypeError(f"model={check.shown(model)}: expected a Model")
        if isinstance(excitation, type) or not callable(getattr(excitation, "shape", None)):
            raise TypeError(f"excitation={check.shown(excitation)}: expected an excitation")
        self.model = model
        self.excitation = excitation
        self.basis = FourierBasis(check_harmonics(harmonics))
        if samples is not None:
            samples = check.integer("samples", samples, minimum=2 * self.basis.highest + 1)
        self.samples = samples
        self.symmetry = symmetry
        self._structure: DynamicStiffness | None = None
        if not model.has_matrices:
            if symmetry is not None:
                raise ValueError("symmetry: expected None for a structure without matrices")
            self._structure = DynamicStiffness(model, excitation, self.basis)
        elif isinstance(model, Model):
            _advise(model)
        # Shared by all copies of this problem: each is compiled once.
        self._compiled: dict[tuple, Equations] = {}
        self._equations = self._compile(model.has_cubic_springs)
        self._set_arguments()

    @property
    def parameters(self) -> dict[str, Any]:
        """The named parameters of model and excitation and their values."""
        return self.model.parameters | self.excitation.parameters

    @property
    def residual(self) -> ca.Function:
        """CasADi function of Eq. (9): unknowns, frequency and parameters to forces [N].

        TypeError for a condensed structure, whose linear part is none; `evaluate` has all of it.
        """
        self._check_compiled("residual")
        return self._equations.residual

    def derivative(self, name: str) -> ca.Function:
        """CasADi function of the sparse exact derivative of the residual by one of its inputs.

        ``name`` is ``unknowns``, ``frequency`` or a parameter; KeyError lists the names. Those by
        the parameters only for a condensed structure: TypeError for the others.
        """
        if name not in self.parameters:
            self._check_compiled(f"derivative({name!r})")
        if name == "cubic_stiffness":
            self._equations = self._compile(cubic=True)
            self._set_arguments()
        return self._equations.derivative(name)

    def _check_compiled(self, what: str) -> None:
        if self._structure is not None:
            raise TypeError(
                f"{what}: a structure without matrices has no such CasADi function; use evaluate, "
                "or of a condensed one a HarmonicBalance of the attribute structure of its model"
            )

    def check_frequencies(self, name: str, values: Any) -> None:
        """Raise ValueError unless frequencies [Hz] are among those that the model is made for."""
        self.model.check_frequencies(name, values)

    def _compile(self, cubic: bool) -> Equations:
        """The equations of this structure, harmonic set and sector, with or without springs."""
        key = self.harmonics, self.symmetry, cubic
        if key not in self._compiled:
            self._compiled[key] = Equations(self.model, self.basis, cubic, self.symmetry)
        return self._compiled[key]

    def with_harmonics(self, harmonics: tuple[int, ...]) -> "HarmonicBalance":
        """Copy with other harmonics, compiled once for all copies of this problem."""
        return self._with(basis=FourierBasis(harmonics))

    def of_sector(self, symmetry: Symmetry) -> "HarmonicBalance":
        """Balance of the first of equal sectors, compiled once for all copies of this problem."""
        return self._with(symmetry=symmetry)

    def _with(self, **changes: Any) -> "HarmonicBalance":
        other = object.__new__(HarmonicBalance)
        other.__dict__.update(self.__dict__, **changes)
        other._equations = other._compile(self._equations.cubic)
        if not other.model.has_matrices:
            other._structure = DynamicStiffness(other.model, other.excitation, other.basis)
        other._set_arguments()
        return other

    @property
    def single_valued(self) -> bool:
        """Whether there is one response at every frequency.

        With constant normal loads and dissipative damping friction responses are unique; cubic
        springs make several.
        """
        return not self.model.has_cubic_springs

    @property
    def in_closed_form(self) -> bool:
        """Whether the events of contacts are closed forms, compiled with the balance."""
        return self._equations.closed and self.samples is None

    @property
    def structure(self) -> DynamicStiffness | None:
        """Of a condensed structure, its linear part beside the compiled forces."""
        return self._structure

    @property
    def compiled(self) -> tuple[Equations, list[FloatArray]]:
        """The compiled equations, and their parameters in the order of ``parameter_names``."""
        return self._equations, self._arguments

    def arguments(
        self,
        unknowns: FloatArray,
        frequency: float,
        slip: NDArray[np.bool_] | None = None,
        friction: ContactState | None = None,
    ) -> dict[str, FloatArray]:
        """Named inputs of `residual` and `derivative` at a point, its contact events located.

        ``unknowns`` (n_unknowns,) [m], ``frequency`` in rad/s; ``slip`` (n_contacts,) imposes
        contact states, see `symhbm.model.contacts.locate`; ``friction`` are the events where known.
        """
        if friction is None:
            friction = self.locate(unknowns, slip)
        named: dict[str, FloatArray] = dict(
            zip(self._equations.parameter_names, self._arguments, strict=True)
        )
        n_contacts, size = friction.vector.shape
        named["matrix"] = friction.matrix.transpose(1, 0, 2).reshape(size, n_contacts * size)
        named["vector"] = friction.vector.T
        if self._structure is not None:
            named["force_shape"] = self._structure.shape(frequency)
        return {"unknowns": unknowns, "frequency": np.array([frequency])} | named

    def with_parameters(self, **values: Any) -> "HarmonicBalance":
        """Copy with other values of named parameters, sharing the compiled equations.

        Raises KeyError for a name that is no parameter, ValueError or TypeError for bad values.
        """
        known, own = self.parameters, self.model.parameters
        for name in values:
            check.known(name, known)
        of_model = {k: v for k, v in values.items() if k in own}
        of_force = {k: v for k, v in values.items() if k not in of_model}
        other = object.__new__(HarmonicBalance)
        other.__dict__.update(self.__dict__)
        if of_model:
            other.model = self.model.with_parameters(**of_model)
            if other.model.has_cubic_springs and not self._equations.cubic:
                other._equations = self._compile(cubic=True)
        if of_force:
            other.excitation = self.excitation.with_parameters(**of_force)
            if not other.model.has_matrices and {*of_force} != {"force_amplitude"}:
                other._structure = DynamicStiffness(other.model, other.excitation, self.basis)
        other._set_arguments()
        if self.symmetry is not None and not {*values} <= _COMMON:
            found = find_symmetry(other.model, other.excitation, self.basis)
            if found != self.symmetry:
                raise ValueError(f"{', '.join(values)}: expected a structure of equal sectors")
        return other

    def locate(self, unknowns: FloatArray, slip: NDArray[np.bool_] | None = None):
        """Events of all contacts at the unknowns, see `symhbm.model.contacts.locate`."""
        motion = self.relative(unknowns), self.contact_stiffness, self.slip_limit
        return self.locate_motions(*motion, slip)

    def locate_motions(self, *motion: Any) -> ContactState:
        """The same of any contacts: their motions, stiffness, limits of slip, imposed states."""
        if self.samples is None:
            return locate(self.basis, *motion)
        return locate_sampled(self.basis, *motion, samples=self.samples)

    def located(self) -> "HarmonicBalance":
        """The same problem with located switching angles."""
        other = object.__new__(HarmonicBalance)
        other.__dict__.update(self.__dict__, samples=None)
        return other

    def evaluate(
        self,
        unknowns: FloatArray,
        frequency: float,
        slip: NDArray[np.bool_] | None = None,
        friction: ContactState | None = None,
    ) -> Evaluation:
        """Residual and derivatives at ``unknowns`` [m] and angular ``frequency`` [rad/s].

        ``slip`` (n_contacts,) imposes contact states, see `symhbm.model.contacts.locate`;
        ``friction`` are the events of the contacts where they are known.
        """
        at = unknowns, frequency, self._arguments
        if self.in_closed_form:
            imposed = slip if friction is None else friction.slip
            found, friction = self._equations.in_closed_form(*at, imposed)
            stretches = 0.0
        else:
            friction = self.locate(unknowns, slip) if friction is None else friction
            found = self._equations(*at, friction)
            stretches = self._stretches(unknowns, friction)
        residual, magnitude, values, by_parameter = found
        result = Evaluation(
            residual,
            float(magnitude[0]) + stretches,
            self._equations.assemble(values),
            by_parameter,
            friction,
        )
        if self._structure is None:
            return result
        return self._structure.added(result, unknowns, frequency, self.excitation.amplitude)

    def force(self, frequency: float) -> FloatArray:
        """Coefficients of the force at an angular frequency, ``(n_dof, n_components)`` [N]."""
        shape = self._arguments[-1] if self._structure is None else self._structure.shape(frequency)
        return self.coefficients(self.excitation.amplitude * shape)

    def _stretches(self, unknowns: FloatArray, friction: ContactState) -> float:
        """Largest of the two terms of stretches of stick, see `Equations`."""
        spread = self._equations.directions_absolute @ np.abs(unknowns)
        spread = spread.reshape(self.n_contacts, self.basis.n_components).max(axis=1, initial=0.0)
        travel = spread * self.contact_stiffness
        stretches = 2 * travel * np.where(friction.slip, friction.stick_fraction, 0.0)
        return float(stretches.max(initial=0.0))

    def contact_forces(self, unknowns: FloatArray) -> FloatArray:
        """Forces of the contacts of a condensed structure, ``(n_dof, n_components)`` [N]."""
        alone = object.__new__(HarmonicBalance)
        alone.__dict__.update(self.__dict__, _structure=None)
        return self.coefficients(alone.evaluate(unknowns, 0.0).residual)

    def amplification(self, unknowns: FloatArray, frequency: float) -> float:
        """Largest inertia force over the largest exciting force (0 without one)."""
        if self._structure is not None:
            return self._structure.amplification(unknowns, frequency, self.excitation.amplitude)
        force = abs(self.excitation.amplitude) * np.abs(self._arguments[-1]).max()
        inertia = self.model.mass_matrix @ (self.everywhere(unknowns) * self.basis.order**2)
        return float(frequency**2 * np.abs(inertia).max() / force) if force > 0 else 0.0

    def _set_arguments(self) -> None:
        model, excitation, equations = self.model, self.excitation, self._equations
        named = {name: equations.rows(model, name).data for name in MATRIX_INPUTS}
        named |= {name: self.own(name, getattr(model, name)) for name in CONTACT_PARAMETERS}
        self.contact_stiffness = named["contact_stiffness"]
        self.cubic_stiffness = named["cubic_stiffness"]
        self.slip_limit = slip_limit(named["friction_coefficient"], named["normal_load"])
        named["force_amplitude"] = np.array([excitation.amplitude])
        if self._structure is None:
            shape = excitation.shape(model.n_dof, self.basis)[equations.dofs]
        else:
            shape = np.zeros((self.n_dof, self.basis.n_components))  # it adds the force itself
        named["force_shape"] = shape.ravel()
        self._arguments = [
            np.ascontiguousarray(named[name], dtype=float)
            for name in self._equations.parameter_names
        ]

    def __reduce__(self):
        given = self.model, self.excitation, self.harmonics, self.samples, self.symmetry
        return HarmonicBalance, given

    def __repr__(self) -> str:
        law = "" if self.samples is None else f", friction over {self.samples} samples"
        return (
            f"HarmonicBalance: harmonics {self.harmonics}, {self.n_unknowns} unknowns{law}\n"
            f"{self.model!r}\n{self.excitation!r}"
        )


def _advise(model: Model) -> None:
    """Say of a large structure with few contacts that it is better condensed."""
    entries = int(model.stiffness_matrix.nnz)
    touched = len({dof for contact in model.contacts for dof in contact})
    if entries <= LARGE or _FEW * touched > model.n_dof:
        return
    warnings.warn(
        f"a structure of {model.n_dof:,} degrees of freedom, of which contacts touch {touched}, "
        f"and {entries:,} entries of its stiffness matrix: it takes about {entries / 2e4:.0f} s to "
        "compile, and every point some factorisations of all its equations; symhbm.condense(model, "
        "excitation, frequency, harmonics, dofs=...) gives the same responses of what contacts "
        "touch and of dofs, and each point in milliseconds",
        stacklevel=3,
    )


def check_problem(problem: object, whole: bool = False) -> None:
    """Raise TypeError unless it is a HarmonicBalance, of a ``whole`` structure where needed."""
    if not isinstance(problem, HarmonicBalance):
        raise TypeError(f"problem={check.shown(problem)}: expected a HarmonicBalance")
    if whole and not problem.model.has_matrices:
        raise TypeError(f"problem: {problem.model.WITHOUT_MATRICES}")
