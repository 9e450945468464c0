"""The glossary has all variables of datasets; ``python -m tests.house.test_glossary`` writes it."""

from pathlib import Path

from symhbm.model import PARAMETERS
from symhbm.results import OWN_DIMENSIONS, VARIABLES
from symhbm.results.reading import HISTORIES, MOTIONS
from symhbm.results.variables import Variable

PAGE = Path(__file__).parent.parent.parent / "docs" / "glossary.md"
BEGIN, END = "<!-- variables -->\n", "<!-- end of variables -->\n"
GROUPS = {
    "Points": "",
    "Peaks": "peak_ peaking_",
    "Events": "event_",
    "Peaks over a parameter": "minimum_ surveyed n_surveys sensitivity_",
    "Designs": "design_ variable case_ start_ descent_ active_ fresh_ certificate n_followed "
    "n_failed aim named_peak front_ removed_ candidate_ scan_",
    "Flutter limits": "flutter_ limit_ disturbance",
    "Motions over a period, exact": "angle displacement velocity friction_force normal_force "
    "multiplier_ neutral work viscous_ periodicity integration_ static_displacement",
    "Curves and sets": "n_ rejected_ linear_solves angles_share status",
}
"""Titles, and how the names begin that belong there."""
CONVENTIONS = {
    "coefficient": "`x = sum_n a_n cos(n omega t) + b_n sin(n omega t)`; component `cos` is `a_n`, "
    "`sin` is `b_n`, the complex amplitude is `a_n - i b_n`",
    "amplitude": "never negative; a mean counts",
    "theta_0": "of `omega t`, from 0 to 2 pi",
    "theta_star": "of `omega t`, from 0 to 2 pi: where it is less than `theta_0`, one period on",
    "friction_force": "that of the spring: a sticking contact has `contact_stiffness` times its "
    "displacement, up to a constant, and pulls the structure back",
    "dissipation": "positive: taken from the vibration",
    "work": "positive: brought into the vibration",
    "viscous_dissipation": "positive: taken from the vibration",
    "growth_rate": "negative where perturbations decay",
    "normal_force": "positive under pressure, 0 while the contact is open",
    "event_contact": "numbers from 0 over all groups",
    "peak_dof": "numbers from 0",
}


def owner(name: str) -> str:
    """The title that a variable is listed under: of the longest beginning that fits."""
    fits = [
        (len(start), title)
        for title, starts in GROUPS.items()
        for start in starts.split()
        if name.startswith(start)
    ]
    # The error of normal forces is one of points.
    return "Points" if not fits or name == "normal_force_error" else max(fits)[1]


def meaning(name: str, about: Variable) -> str:
    """Meaning, the words of numbers that stand for words, and the sign convention."""
    text = about.long_name
    if "flag_values" in about.attributes:
        words = about.attributes["flag_meanings"].split()
        pairs = zip(about.attributes["flag_values"].tolist(), words, strict=True)
        text += ": " + ", ".join(f"{value} {word}" for value, word in pairs)
    return text + (f"; {CONVENTIONS[name]}" if name in CONVENTIONS else "")


def table(rows: list[tuple[str, str, str, str]]) -> list[str]:
    """Lines of a table of names, dimensions, units and meanings."""
    head = ["| variable | beside | unit | meaning |", "|---|---|---|---|"]
    return [*head, *(f"| `{n}` | {d} | {u} | {m} |" for n, d, u, m in rows), ""]


def generated() -> str:
    """The tables of all variables, parameters and of what `motion` makes of them."""
    lines: list[str] = []
    for title in GROUPS:
        rows = [
            (name, ", ".join(about.inner), about.units, meaning(name, about))
            for name, about in sorted(VARIABLES.items())
            if owner(name) == title
        ]
        lines += [f"## {title}", "", *table(rows)]
    parameters = [(n, "", of.units, of.meaning) for n, of in PARAMETERS.items()]
    lines += ["## Parameters", "", *table(parameters)]
    derived = MOTIONS | HISTORIES
    by_harmonic = ("complex_amplitude", "harmonic_amplitude", "phase_lag")
    rows = [
        (name, "dof, harmonic" if name in by_harmonic else "dof", units, words)
        for name, (units, words) in derived.items()
    ]
    return "\n".join([*lines, "## What `sh.datasets.motion` gives", "", *table(rows)])


def written() -> str:
    """The page with fresh tables."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    return f"{before}{BEGIN}{generated()}{END}{rest.partition(END)[2]}"


def test_the_glossary_has_all_variables():
    page = PAGE.read_text(encoding="utf-8")
    missing = [name for name in {**VARIABLES, **PARAMETERS} if f"| `{name}` |" not in page]
    assert missing == [], "python -m tests.house.test_glossary writes docs/glossary.md"
    assert page == written(), "python -m tests.house.test_glossary writes docs/glossary.md"


def test_the_glossary_has_all_dimensions():
    before = PAGE.read_text(encoding="utf-8").partition(BEGIN)[0]
    named = {*VARIABLES, *PARAMETERS}
    missing = [dim for dim in OWN_DIMENSIONS if dim not in named and f"| `{dim}` |" not in before]
    assert missing == []


def test_conventions_are_of_variables():
    assert CONVENTIONS.keys() <= VARIABLES.keys()


if __name__ == "__main__":
    PAGE.write_text(written(), encoding="utf-8")
