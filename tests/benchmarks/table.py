"""Tables in Markdown, the machine they are of, and their place in the documents."""

import importlib.metadata
import os
import platform
from dataclasses import dataclass, field
from pathlib import Path

DOCUMENTS = Path(__file__).parents[2] / "docs"
PAGE, SCALE = DOCUMENTS / "benchmarks.md", DOCUMENTS / "guide" / "scale.md"
BEGIN, END = "<!-- benchmarks -->", "<!-- end of benchmarks -->"
PACKAGES = ("symhbm", "casadi", "numpy", "scipy", "xarray", "numba", "pyHarm-os")


@dataclass
class Table:
    """Rows of text under a header, a sentence before and remarks after them."""

    caption: str
    header: list[str]
    rows: list[list[str]] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        lines = [self.header, ["---"] * len(self.header), *self.rows]
        body = "\n".join(f"| {' | '.join(line)} |" for line in lines)
        remarks = [f"*{remark}*" for remark in dict.fromkeys(self.remarks)]
        return "\n\n".join([self.caption, body, *remarks])


def seconds(value: float) -> str:
    """A time with two digits."""
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if value >= size:
            return f"{value / size:.{0 if value / size >= 9.95 else 1}f} {unit}"
    return f"{value / 1e-6:.0f} µs"


def ratio(value: float) -> str:
    """A ratio with two digits."""
    return f"{value:.0f}" if value >= 9.95 else f"{value:.1f}" if value >= 0.95 else f"{value:.2f}"


def machine() -> str:
    """The machine, and the versions of Python and the packages that matter."""
    model = platform.processor() or platform.machine()
    if Path("/proc/cpuinfo").exists():
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        named = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
        model = named[0] if named else model
    versions = [f"Python {platform.python_version()}"]
    for package in PACKAGES:
        try:
            versions.append(f"{package} {importlib.metadata.version(package)}")
        except importlib.metadata.PackageNotFoundError:
            versions.append(f"no {package}")
    return f"{model}, {os.cpu_count()} cores, {platform.system()}; {', '.join(versions)}."


def write(text: str, page: Path = PAGE) -> None:
    """Replace what stands between the two markers of a page."""
    whole = page.read_text(encoding="utf-8")
    before, begun, rest = whole.partition(BEGIN)
    _, closed, after = rest.partition(END)
    if not (begun and closed):
        raise SystemExit(f"{page}: expected the lines {BEGIN} and {END}")
    page.write_text(f"{before}{BEGIN}\n{text}\n{END}{after}", encoding="utf-8")
