"""Processes of tests share the cores: no threads of linear algebra beside them."""

import os
import sys

import hypothesis
import pytest

# Before NumPy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MPLBACKEND", "Agg")  # pictures are files

# No test depends on how busy the machine is.
hypothesis.settings.register_profile("without deadlines", deadline=None)
hypothesis.settings.load_profile("without deadlines")

LONG = (
    "model/test_planar_friction.py",
    "house/test_style.py",
    "studies/test_studies.py",
    "response/test_random_contacts.py",
    "continuation/test_angle_paths.py",
    "model/reduction/test_mistuned_ring.py",
    "model/cyclic/test_sector.py",
    "time_domain/test_smooth_laws_in_time.py",
    "time_domain/test_planar_motion.py",
    "time_domain/test_floquet.py",
)
"""Files that take longest: they come first, so that no process ends long after the others.

Loops of planar friction take longest to compile: the first file does it, and others find them.
"""


def pytest_collection_modifyitems(items):
    def place(item):
        name = item.path.as_posix()
        return next((i for i, long in enumerate(LONG) if name.endswith(long)), len(LONG))

    items.sort(key=place)


def pytest_addoption(parser):
    parser.addoption("--times", action="store_true", help="seconds and tests of each room")


def pytest_terminal_summary(terminalreporter, config):
    if not config.getoption("--times"):
        return
    rooms = {}
    stats = terminalreporter.stats
    for report in [one for kind in ("", "passed", "failed") for one in stats.get(kind, [])]:
        room = "/".join(report.nodeid.split("/")[1:-1]) or "."
        seconds, tests = rooms.get(room, (0.0, 0))
        rooms[room] = seconds + report.duration, tests + (report.when == "call")
    terminalreporter.section("seconds of each room")
    for room, (seconds, tests) in sorted(rooms.items(), key=lambda row: -row[1][0]):
        terminalreporter.line(f"{seconds:8.1f} s  {tests:5d} tests  tests/{room}")


@pytest.fixture(autouse=True, scope="session")
def _compiled_functions(tmp_path_factory):
    """Compiled functions of the tests are in a folder of theirs, which all processes share."""
    folder = tmp_path_factory.getbasetemp().parent / "compiled"
    folder.mkdir(mode=0o700, exist_ok=True)
    os.environ["SYMHBM_CACHE"] = str(folder)


@pytest.fixture(autouse=True)
def _no_figures_left():
    """Figures of examples and commands stay open otherwise, and too many of them are a warning."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")
