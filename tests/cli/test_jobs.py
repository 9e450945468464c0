"""The jobs of the guide, as real processes from an empty folder: one is killed, all are merged."""

import json
import os
import re
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

import symhbm as sh
from symhbm.numerics.c_library import COMPILER
from tests.archives import assert_same

PAGE = Path(__file__).parent.parent.parent / "docs" / "guide" / "ensembles-by-parts.md"
BLOCK = re.compile(r"<!-- jobs(?:: (?P<file>\S+))? -->\n```\w+\n(?P<code>.*?)```\n", re.DOTALL)
SBATCH = """
import os, re, subprocess, sys

wrapped = [word.removeprefix("--wrap=") for word in sys.argv if word.startswith("--wrap=")]
if wrapped:
    sys.exit(subprocess.call(["sh", "-c", wrapped[0]]))
script = open(sys.argv[-1]).read()
first, last = map(int, re.search(r"#SBATCH --array=(\\d+)-(\\d+)", script).groups())
tasks = [
    subprocess.Popen(["sh", sys.argv[-1]], env=os.environ | {"SLURM_ARRAY_TASK_ID": str(task)})
    for task in range(first, last + 1)
]
[task.wait() for task in tasks]
print(2013)
"""
"""Slurm's command as far as the guide needs it: it waits for its jobs, so that none depends."""


KILLED = """
import os, signal
from pathlib import Path

mark = Path("killed-" + os.environ.get("PART", ""))
if mark.exists():
    mark.unlink()
    from symhbm.results.archive.working_files import Store
    add, samples = Store.add, []

    def stored(store, encoded):
        add(store, encoded)
        samples.extend(encoded)
        if len(samples) >= 3:
            Path("stored").write_text(str(len(samples)))
            os.kill(os.getpid(), signal.SIGKILL)

    Store.add = stored
"""
"""What Python runs at first: a job with a mark is killed with three samples stored, or more that
came with the third, once."""
HANGS = 1800
"""Seconds after which a job hangs: no machine is so slow."""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder with the files of the guide, and its programs on the path."""
    programs, here = tmp_path / "programs", tmp_path / "here"
    programs.mkdir()
    here.mkdir()
    (programs / "sbatch.py").write_text(SBATCH)
    (programs / "sitecustomize.py").write_text(KILLED)
    for name, command in {
        "python": 'exec {python} "$@"',
        "symhbm": 'exec {python} -m symhbm "$@"',
        "sbatch": 'exec {python} {folder}/sbatch.py "$@"',
    }.items():
        text = command.format(python=sys.executable, folder=programs)
        (programs / name).write_text(f"#!/bin/sh\n{text}\n")
        (programs / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{programs}:{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", f"{programs}:{PAGE.parent.parent.parent}")
    # Which curves machine code evaluates depends on their number in a job.
    monkeypatch.setenv(COMPILER, "")
    for block in BLOCK.finditer(PAGE.read_text(encoding="utf-8")):
        if block["file"]:
            (here / block["file"]).write_text(block["code"])
    return here


def commands(program: str) -> str:
    """The commands of the guide that start with a program."""
    codes = [block["code"] for block in BLOCK.finditer(PAGE.read_text()) if not block["file"]]
    [code] = [code for code in codes if program in code]
    return code


def start(folder: Path, code: str) -> subprocess.Popen:
    return subprocess.Popen(["sh", "-c", code], cwd=folder)


def finished(folder: Path) -> list[int]:
    """The samples of the second job that are stored, in a file that it left."""
    with closing(sqlite3.connect(folder / "part-2.nc.partial")) as rows:
        found = rows.execute("SELECT number FROM results WHERE number >= 0 ORDER BY number")
        return [number for (number,) in found]


def one_job(folder: Path) -> Path:
    """The archive of the same call without a part."""
    code, found = re.subn(
        r'part=.*archive=f".*"', 'archive="one.nc"', (folder / "ensemble.py").read_text()
    )
    assert found == 1
    subprocess.run([sys.executable, "-c", code], cwd=folder, check=True)
    return folder / "one.nc"


@pytest.mark.slow
@pytest.mark.parametrize("way", ["sbatch", "xargs"])
def test_three_jobs_one_killed_are_one_job(way, folder):
    code = commands(way)
    (folder / "killed-2").touch()
    if way == "sbatch":
        assert start(folder, code).wait(HANGS) == 0
    else:
        line, merging = code.splitlines()
        assert start(folder, line).wait(HANGS) != 0
        assert len(finished(folder)) == int((folder / "stored").read_text()) < 10
        # It does not wait for the others.
        end = time.monotonic() + HANGS
        while not all((folder / f"part-{job}.nc").exists() for job in (1, 3)):
            assert time.monotonic() < end
            time.sleep(0.1)
        assert start(folder, merging).wait(HANGS) != 0  # a part is not there
        assert not (folder / "disks.nc").exists()
        assert start(folder, line).wait(HANGS) == 0
        (folder / "disks.nc.partial").unlink()
        assert start(folder, merging).wait(HANGS) == 0
    assert not (folder / "killed-2").exists()
    merged, one = sh.load(folder / "disks.nc"), sh.load(one_job(folder))
    told = json.loads(merged.attrs["merged_from"])
    assert [entry["archive"] for entry in told] == [f"part-{job}.nc" for job in (1, 2, 3)]
    assert [len(entry["computed"]) for entry in told] == [1, 2, 1]
    assert_same(merged, one)
