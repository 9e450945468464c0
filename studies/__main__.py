"""Run all studies: ``python -m studies``."""

import sys
from importlib import import_module

from tqdm import tqdm

from studies.run import run

STUDIES = (
    "fig03_single_blade",
    "fig04_hysteresis_loop",
    "fig08_engine_orders",
    "harmonic_convergence",
    "one_harmonic_validity",
    "laws_and_solvers",
)


def main() -> None:
    """Run every study under one progress bar."""
    with tqdm(STUDIES, unit="study", file=sys.stderr) as bar:
        for name in bar:
            bar.set_description(name)
            study = import_module(f"studies.{name}")
            with bar.external_write_mode():
                run(name, lambda study=study: study.compute(progress=False), study.draw)


if __name__ == "__main__":
    main()
