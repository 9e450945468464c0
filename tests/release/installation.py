"""Built files, fresh environments with them, and what must run there."""

import os
import shlex
import shutil
import subprocess
import sys
import tarfile
import venv
import zipfile
from collections.abc import Sequence
from pathlib import Path

from tests.release.metadata import ROOT, for_an_index, project, quick_start
from tests.release.smoke import SMOKE

TEST_TOOLS = ("pytest>=8", "hypothesis>=6.110")
BESIDE = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "CITATION.cff", "LICENSE")
FOLDERS = ("symhbm", "studies", "tests", "docs", "data")


def run(command: Sequence[str | Path], folder: Path, **environment: str) -> str:
    """Run a command in a folder, without the sources on its path; a failure ends all."""
    told = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    told |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "agg"}
    done = subprocess.run(
        [*map(str, command)],
        cwd=folder,
        env=told | environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        check=False,
    )
    if done.returncode:
        words = shlex.join(map(str, command))
        raise SystemExit(f"{words}: exit code {done.returncode}\n{done.stdout[-6000:]}")
    return done.stdout


def fresh(folder: Path, packages: Sequence[str | Path]) -> Path:
    """Python of a new environment with these packages, none of them compiled here."""
    venv.create(folder, with_pip=True)
    python = folder / ("Scripts" if os.name == "nt" else "bin") / "python"
    install = [python, "-m", "pip", "install", "-q", "--only-binary", ":all:", *packages]
    run(install, folder)
    return python


def build(folder: Path) -> tuple[Path, Path]:
    """The wheel and the source archive of the last commit, made in a folder."""
    sources, built = folder / "sources", folder / "dist"
    sources.mkdir(parents=True)
    run(["git", "archive", "-o", folder / "sources.tar", "HEAD"], ROOT)
    with tarfile.open(folder / "sources.tar") as archive:
        archive.extractall(sources, filter="data")
    readme = sources / "README.md"
    address = project(sources).get("urls", {}).get("Repository")
    readme.write_text(for_an_index(readme.read_text("utf-8"), address), encoding="utf-8")
    tools = fresh(folder / "tools", ["build", "twine"])
    run([tools, "-m", "build", "-o", built], sources)
    (wheel,), (sdist,) = built.glob("*.whl"), built.glob("*.tar.gz")
    run([tools, "-m", "twine", "check", "--strict", wheel, sdist], folder)
    return wheel, sdist


def check_contents(wheel: Path, sdist: Path) -> None:
    """Raise ValueError for files that are missing, or where they should not be."""
    kept = run(["git", "ls-tree", "-r", "--name-only", "HEAD"], ROOT).splitlines()
    names = set(zipfile.ZipFile(wheel).namelist())
    code = {name for name in kept if name.startswith("symhbm/")}
    others = {name for name in names - code if ".dist-info/" not in name}
    if wrong := sorted(others | code - names):
        raise ValueError(f"{wheel.name}: missing or too many: {wrong}")
    if not any(name.endswith("licenses/LICENSE") for name in names):
        raise ValueError(f"{wheel.name}: without LICENSE")
    with tarfile.open(sdist) as archive:
        inside = {name.partition("/")[2] for name in archive.getnames()}
    wanted = {name for name in kept if name.split("/")[0] in FOLDERS} | {*BESIDE}
    if lacking := sorted(wanted - inside):
        raise ValueError(f"{sdist.name}: without {lacking}")


def check_quick_start(python: Path, folder: Path) -> str:
    """Run the first study of README.md and its commands in an empty folder."""
    folder.mkdir()
    code, commands = quick_start((ROOT / "README.md").read_text(encoding="utf-8"))
    (folder / "study.py").write_text(code, encoding="utf-8")
    printed = run([python, "study.py"], folder)
    for command in ["symhbm --help", *commands]:
        run([python, "-m", *shlex.split(command)], folder)
    return printed


def check_smoke(python: Path, sdist: Path, folder: Path) -> str:
    """Run the smoke set from the source archive, on the package that is installed."""
    with tarfile.open(sdist) as archive:
        archive.extractall(folder, filter="data")
    (sources,) = folder.iterdir()
    shutil.rmtree(sources / "symhbm")
    run([python, "-m", "pip", "install", "-q", *TEST_TOOLS], folder)
    # Old packages warn of one another, which is no fault of symhbm.
    options = [
        "-q",
        "-p",
        "no:cacheprovider",
        "-o",
        "addopts=-m 'not slow'",
        "-o",
        "filterwarnings=",
    ]
    printed = run([python, "-m", "pytest", *options, *SMOKE], sources)
    return printed.strip().splitlines()[-1]


def check_all(name: str, wheel: Path, sdist: Path, folder: Path, pins: Sequence[str] = ()) -> str:
    """Versions and results of the quick start and the smoke set in an environment of its own."""
    print(f"{name}: installing", file=sys.stderr)
    python = fresh(folder / name, [wheel, *pins])
    check_quick_start(python, folder / f"{name}-study")
    return check_smoke(python, sdist, folder / f"{name}-tests")
