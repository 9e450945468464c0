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
    "pareto_damper_mass": 45,
    "identified_contacts": 60,
    "damping_of_modes": 20,
    "flutter": 18,
    "flutter_limits": 11,
}
"""Studies in the order of the page, and about how long each takes [s]: the bar moves by that."""
BAR = "{desc:<35}{percentage:3.0f}%|{bar}| {elapsed}<{remaining}, {rate_fmt}"


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
    """Run every study under one progress bar; return 1 if one failed or missed a landmark."""
    results.mkdir(parents=True, exist_ok=True)
    sections = []
    each = len(studies) / sum(studies.values())
    with tqdm(total=len(studies), unit="study", file=sys.stderr, bar_format=BAR) as bar:
        for name, seconds in studies.items():
            bar.set_description_str(name)
            sections.append(study(name, results, bar.write))
            # Round-off would take the bar beyond its end.
            bar.update(min(each * seconds, bar.total - bar.n))
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
