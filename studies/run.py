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
REFERENCE = DATA / "reference" / "exact_values.json"


def run(
    name: str,
    compute: Callable[[], xr.Dataset],
    draw: Callable[[xr.Dataset], Figure],
    results: Path = RESULTS,
    say: Callable[[str], object] = print,
) -> list[Path]:
    """Compute a study, save its archive and its picture, and ``say`` their paths."""
    matplotlib.use("Agg")
    results.mkdir(parents=True, exist_ok=True)
    dataset = compute()
    archive = sh.save(dataset, results / f"{name}.nc", overwrite=True)
    figure = draw(dataset)
    picture = results / f"{name}.png"
    figure.savefig(picture)
    plt.close(figure)
    for path in (archive, picture):
        say(str(path))
    return [archive, picture]
