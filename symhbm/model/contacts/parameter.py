"""What a named parameter is: the record that bounds, labels, sweeps, draws and archives read."""

from typing import Literal, NamedTuple

from symhbm.model.records import record


@record
class Parameter(NamedTuple):
    """A named number of a model, of a contact law or of an excitation.

    ``units`` as datasets have them, UDUNITS; ``symbol`` of pictures, with the ``unit`` there, by
    default its name and units; ``per``, what has one value each, None for one in all; ``bound`` of
    its values, "positive", "non-negative" or "any", and ``followed``, that of a band it is followed
    over; ``designed``, whether designs may vary it; ``deviation``, whether it is one from the
    nominal structure, which draws scatter by their spreads themselves.

    Examples
    --------
    >>> import symhbm as sh
    >>> stiffness = sh.laws.Parameter("N m-1", "stiffness of the stop", "$k_s$", bound="positive")
    >>> stiffness.units, stiffness.bound
    ('N m-1', 'positive')
    """

    units: str
    meaning: str
    symbol: str = ""
    unit: str | None = None
    per: Literal["dof", "contact", "blade"] | None = "contact"
    bound: str = "non-negative"
    followed: str = "non-negative"
    designed: bool = False
    deviation: bool = False

    @property
    def dims(self) -> tuple[str, ...]:
        """Dimensions of one value in a dataset, but of contacts with groups of their own."""
        return () if self.per is None else (self.per,)

    def shown_as(self, name: str) -> tuple[str, str]:
        """Symbol and unit of pictures."""
        return self.symbol or name.replace("_", " "), self.units if self.unit is None else self.unit
