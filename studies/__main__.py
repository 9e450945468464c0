"""Run all studies and write a page about them: ``python -m studies``."""

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from time import perf_counter
from types import ModuleType
from typing import Any

import xarray as xr
from tqdm import tqdm

import symhbm as sh
from studies import index
from studies.claim import unmet as unmet_statements
from studies.landmark import unmet
from studies.run import RESULTS, run
from symhbm.workers import span

STUDIES = {
    "fig01_fig05_models": 2,
    "fig03_single_blade": 4,
    "fig04_hysteresis_loop": 1,
    "fig06_point_force": 8,
    "fig07_nodal_diameters": 1,
    "fig08_engine_orders": 3,
    "fig09_contact_stiffness": 5,
    "fig10_friction_coefficient": 3,
    "fig11_normal_load": 7,
    "fig12_mistuned_disk": 12,
    "fig13_amplification": 30,
    "harmonic_convergence": 34,
    "one_harmonic_validity": 18,
    "laws_and_solvers": 28,
    "switching_angles": 60,
    "optimal_normal_load_single_blade": 15,
    "optimal_normal_load_engine_orders": 240,
    "optimal_normal_load_robust": 200,
    "damping_and_localisation": 55,
    "underplatform_damper": 15,
    "shroud_opening": 8,
    "gap_stop": 5,
    "open_sector_modes": 15,
    "open_sector_contacts": 30,
    "open_sector_mistuned": 45,
    "calculix_sector": 100,
    "pareto_damper_mass": 45,
    "identified_contacts": 30,
    "identified_backbone": 30,
    "identified_sector": 45,
    "damping_of_modes": 20,
    "flutter": 18,
    "flutter_limits": 11,
}
"""Studies in the order of the page, and about how long each takes [s]: the bar moves by that."""
BAR = "{desc:<35}{percentage:3.0f}%|{bar}| {elapsed}{postfix}"
KNOWN = 60.0
"""Seconds that `STUDIES` is trusted for, until this machine has shown how fast it is."""
INTERRUPTED = 130
"""Exit code of an interruption."""


def study(name: str, results: Path, say: Callable[[str], object] = print) -> index.Section:
    """Run one study; what goes wrong is told in its section."""
    document, start = "", perf_counter()
    made = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    try:
        module = import_module(f"studies.{name}")
        document = module.__doc__ or ""
        archive, *pictures = run(
            name,
            lambda: module.compute(progress=False),
            module.draw,
            getattr(module, "draw_on_source_axes", None),
            results=results,
            say=say,
        )
        # What the page says comes from the file that it points to.
        dataset = sh.load(archive)
        return index.Section(
            name=name,
            document=document,
            parameters=index.parameters(dataset),
            pictures=pictures,
            made=made,
            seconds=perf_counter() - start,
            version=str(dataset.attrs.get("symhbm_version", "")),
            archive=archive.name,
            landmarks=module.landmarks(dataset),
            claims=statements(module, "claims", dataset),
            findings=statements(module, "findings", dataset),
        )
    except Exception as error:
        return index.Section(name, document, error=f"{type(error).__name__}: {error}")


def statements(module: ModuleType, kind: str, dataset: xr.Dataset) -> list[Any]:
    """The ``"claims"`` of the source or ``"findings"`` of a study; not every study has some."""
    return getattr(module, kind)(dataset) if hasattr(module, kind) else []


def main(studies: Mapping[str, float] = STUDIES, results: Path = RESULTS) -> int:
    """Run every study under one bar, the quickest first, and return an exit code.

    It is 1 if a study failed or missed a landmark.
    """
    results.mkdir(parents=True, exist_ok=True)
    done: dict[str, index.Section] = {}
    with tqdm(total=sum(studies.values()), file=sys.stderr, bar_format=BAR) as bar:
        start = perf_counter()
        for name in sorted(studies, key=lambda name: studies[name]):
            pace = (perf_counter() - start + KNOWN) / (bar.n + KNOWN)
            bar.set_description_str(name, refresh=False)
            bar.set_postfix_str(f"about {span(pace * (bar.total - bar.n))} left")
            try:
                done[name] = study(name, results, bar.write)
            except KeyboardInterrupt:
                bar.close()
                kept = f"{len(done)} of {len(studies)} studies are in {results}"
                print(f"studies: interrupted; {kept}", file=sys.stderr)
                return INTERRUPTED
            bar.update(studies[name])
        bar.set_postfix_str("")
    sections = [done[name] for name in studies]
    print(index.write(sections, results / "index.html"))
    wrong = [f"{one.name}: {one.error}" for one in sections if one.error]
    for one in sections:
        lines = unmet(one.landmarks) + unmet_statements([*one.claims, *one.findings])
        wrong += [f"{one.name}: {line}" for line in lines]
    for line in wrong:
        print(line, file=sys.stderr)
    return int(bool(wrong))


def folder(arguments: Sequence[str] | None = None) -> Path:
    """The folder that the command line names; it ends where it asks for help or for what is not."""
    parser = argparse.ArgumentParser(prog="python -m studies", description=__doc__)
    words = f"folder of archives, pictures and the page (default: {RESULTS})"
    parser.add_argument("--results", type=Path, default=RESULTS, metavar="FOLDER", help=words)
    return parser.parse_args(arguments).results


if __name__ == "__main__":
    sys.exit(main(results=folder()))
