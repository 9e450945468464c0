"""Run studies: compute, archive, draw, and say where the files are."""

from collections.abc import Callable
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import xarray as xr
from matplotlib.figure import Figure

import symhbm as sh

DATA = Path(__file__).resolve().parent.parent / "data"
RESULTS = DATA / "results"
KINDS = ("png", "svg")
"""Formats of each picture."""
REFERENCE = DATA / "reference" / "exact_values.json"


def run(
    name: str,
    compute: Callable[[], xr.Dataset],
    draw: Callable[[xr.Dataset], Figure],
    draw_on_source_axes: Callable[[xr.Dataset], Figure] | None = None,
    *,
    results: Path = RESULTS,
    say: Callable[[str], object] = print,
) -> list[Path]:
    """Compute a study, save its archive and its pictures, and ``say`` the paths of all files.

    Returns those of the archive and of the pictures as PNG; each picture is there as SVG, too. One
    on the axes of the source has a name that ends in ``_source_axes``.
    """
    matplotlib.use("Agg")
    results.mkdir(parents=True, exist_ok=True)
    dataset = compute()
    archive = sh.save(dataset, results / f"{name}.nc", overwrite=True)
    draws = {name: draw}
    if draw_on_source_axes is not None:
        draws[f"{name}_source_axes"] = draw_on_source_axes
    pictures, files = [], [archive]
    for stem, draw_one in draws.items():
        figure = draw_one(dataset)
        pictures.append(results / f"{stem}.png")
        files += [sh.plot.save(figure, pictures[-1].with_suffix(f".{kind}")) for kind in KINDS]
        plt.close(figure)
    for path in files:
        say(str(path))
    return [archive, *pictures]
