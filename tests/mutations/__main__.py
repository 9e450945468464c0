"""Which changes of the library its tests notice: ``python -m tests.mutations RESULTS.json``.

A sample over all rooms, each judged by the quick tests of its own room, in a copy of the working
tree. Finished ones are kept in the file, from which the same call goes on. ``--count N`` draws as
many, ``--list`` prints them alone, ``--survivors`` prints what no test noticed.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path

from tqdm import tqdm

from tests.mutations.mutation import ROOT, Mutation, room_of, sample

_LONGEST = 600
"""Seconds after which tests that hang count as having noticed."""
_COPIED = ("symhbm", "tests", "studies", "data", "docs", "pyproject.toml", "README.md")


def main() -> None:
    """Judge all changes of the sample that are not in the file yet."""
    parser = argparse.ArgumentParser(prog="tests.mutations", description=__doc__)
    parser.add_argument("results", type=Path)
    parser.add_argument("--count", type=int, default=120)
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--survivors", action="store_true")
    options = parser.parse_args()
    chosen = sample(options.count)
    if options.list:
        print(*(f"{one.key} {one.file}:{one.line} {one.old!r} -> {one.new!r}" for one in chosen),
              sep="\n")  # fmt: skip
        return
    results = json.loads(options.results.read_text()) if options.results.exists() else {}
    if not options.survivors:
        with tempfile.TemporaryDirectory() as folder:
            _judge(chosen, results, options.results, Path(folder))
    known = [results[one.key] for one in chosen if one.key in results]
    killed = sum(each["killed"] for each in known)
    print(f"{killed} of {len(known)} changes were noticed, {len(chosen) - len(known)} wait")
    for each in known:
        if not each["killed"]:
            print(f"{each['file']}:{each['line']}: {each['old']!r} -> {each['new']!r}")


def _judge(chosen: list[Mutation], results: dict, path: Path, folder: Path) -> None:
    for name in _COPIED:
        source = ROOT / name
        copy = shutil.copytree if source.is_dir() else shutil.copy
        copy(source, folder / name)
    for one in tqdm([one for one in chosen if one.key not in results], unit="change"):
        file = folder / one.file
        source = file.read_text(encoding="utf-8")
        file.write_text(one.applied(source), encoding="utf-8")
        try:
            killed = not _passes(one, folder)
        finally:
            file.write_text(source, encoding="utf-8")
        results[one.key] = asdict(one) | {"killed": killed}
        path.write_text(json.dumps(results, indent=1))


def _passes(mutation: Mutation, folder: Path) -> bool:
    """Whether the tests of the room pass with a change; those of responses judge what has none."""
    tests = folder / "tests" / room_of(mutation)
    of_room = str(tests if tests.is_dir() else folder / "tests" / "response")
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", of_room]
    given = os.environ | {"PYTHONPATH": str(folder)}
    try:
        done = subprocess.run(
            command, cwd=folder, env=given, capture_output=True, timeout=_LONGEST, check=False
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


if __name__ == "__main__":
    main()
