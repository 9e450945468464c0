"""Named parameters of structures, one table of records.

They are read for bounds, labels, sweeps and draws. A new parameter of a contact law is a record in
the file of the law, another one a record here.
"""

from typing import Any, NoReturn

from symhbm.model.contacts import Coulomb, CubicSpring, Parameter


def _deviation(of: str, symbol: str) -> Parameter:
    """Record of what tells how far blades deviate from the nominal one."""
    words = f"deviation of the {of}"
    return Parameter("1", words, symbol, "", "blade", "any", "any", deviation=True)


PARAMETERS = {
    "mass": Parameter(
        "kg", "mass of the blade", "$m$", "kg", "dof", "positive", "positive", designed=True
    ),
    "damping": Parameter(
        "N s m-1", "viscous damping of the blade", "$c$", "N s/m", "dof", "any", "any", True
    ),
    "stiffness": Parameter("N m-1", "stiffness of the blade", "$k$", "N/m", "dof", designed=True),
    **Coulomb.parameters,
    **CubicSpring.parameters,
    # A band of forces keeps one sign: with the other, the response is its mirror image.
    "force_amplitude": Parameter(
        "N", "amplitude of the exciting force", "$f_0$", "N", None, bound="any"
    ),
    "stiffness_deviation": _deviation("stiffness of the blade", r"$\Delta k$"),
    "frequency_deviation": _deviation("frequency of the blade alone", r"$\Delta f$"),
    "mass_deviation": _deviation("mass of the blade", r"$\Delta m$"),
    "engine_order": Parameter("1", "engine order", "EO", "", None),
}
SHORT = {"friction": Coulomb(), "cubic": CubicSpring()}
"""The groups of contacts that have no names of their own."""
CONTACT_PARAMETERS = (*Coulomb.parameters, *CubicSpring.parameters)
"""Those of contacts without a group of their own."""
BLADE_PARAMETERS = tuple(name for name, about in PARAMETERS.items() if about.per == "dof")
"""Those with one value per degree of freedom, of lumped models."""


class ReadOnly(dict[str, Any]):
    """Values of parameters by name. Setting one would change nothing, so that it raises."""

    def __setitem__(self, name: str, value: Any) -> NoReturn:
        raise TypeError(
            f"parameters[{name!r}]: expected with_parameters({name}=...), which gives another "
            "structure or problem with the value; this one stays as it is"
        )

    def __reduce__(self) -> tuple[type, tuple[dict[str, Any]]]:
        return ReadOnly, (dict(self),)  # by default entries would be set one by one


def records_of_blade_modes(count: int) -> dict[str, Parameter]:
    """Records of the deviations of the frequencies of so many modes of the blade alone."""
    return {
        f"frequency_deviation_{mode}": _deviation(
            f"frequency of mode {mode} of the blade alone", rf"$\Delta f_{{{mode}}}$"
        )
        for mode in range(count)
    }


def amplitude_of(units: str, meaning: str) -> dict[str, Parameter]:
    """The record of an amplitude that is no force, by its name."""
    record = PARAMETERS["force_amplitude"]
    return {"force_amplitude": record._replace(units=units, meaning=meaning, unit=units)}


def is_pattern(dim: object) -> bool:
    """Whether a dimension of a dataset runs over degrees of freedom, contacts or blades."""
    return dim in ("dof", "contact", "blade") or str(dim).endswith("_contact")
