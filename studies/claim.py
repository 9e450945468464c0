"""Claims of the source, weighed, and findings of these studies: two lists that are never mixed."""

from collections.abc import Iterable
from dataclasses import dataclass

from studies.landmark import number


@dataclass(frozen=True)
class Claim:
    """A statement of the source beside what is computed.

    ``words`` are the source's, shortened where they are long; ``where`` is its figure, equation or
    section. ``computed`` says in words and numbers what is found, ``holds`` whether that bears the
    statement out, and ``expected`` which of the two the study must find.
    """

    words: str
    where: str
    computed: str
    holds: bool
    expected: bool

    @property
    def met(self) -> bool:
        """Whether the study finds what it must."""
        return bool(self.holds) == self.expected

    @property
    def verdict(self) -> str:
        """The verdict in words."""
        verdict = "holds" if self.holds else "does not hold"
        return verdict if self.met else f"{verdict.upper()}, unlike before"


@dataclass(frozen=True)
class Finding:
    """A statement of our own, about which the source is silent, and what is computed for it."""

    words: str
    computed: str
    met: bool

    @property
    def verdict(self) -> str:
        """The verdict in words."""
        return "found" if self.met else "NOT FOUND"


def below(value: float, bound: float) -> str:
    """A value that is to be small, in words: round-off has no digits to tell."""
    return f"less than {number(bound)}" if abs(value) < bound else f"{value:.1e}"


def unmet(statements: Iterable[Claim | Finding]) -> list[str]:
    """Return a line for each statement whose verdict is not the one that is expected."""
    return [f"{one.words}: {one.verdict}: {one.computed}" for one in statements if not one.met]
