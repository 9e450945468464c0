"""Progress of long work: bars in terminals, lines elsewhere."""

import io
import re
import sys

import pytest

import symhbm as sh
from studies import fig03_single_blade as fig03
from symhbm import workers
from symhbm.response import ensemble
from symhbm.results.request import Request

LOADS = {"normal_load": [1.0 + 0.1 * i for i in range(20)]}


@pytest.fixture(scope="module", autouse=True)
def _compiled():
    """The first curve of all compiles its loops, and says so."""
    sh.frf(fig03.problem(), (10, 11), at=[10, 11], progress=False)


def curves(**options):
    return sh.frf(fig03.problem(), (10, 11), at=[10, 11], over=LOADS, **options)


class Terminal(io.StringIO):
    def isatty(self):
        return True


def work(monkeypatch, stream, progress, total, pieces, seconds=0.0):
    """What work of ``pieces``, each of some ``seconds``, tells on a stream."""
    clock = [0.0]
    monkeypatch.setattr(workers.time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(sys, "stderr", stream)
    with workers.progress_bar("curve", progress, total) as bar:
        for _ in range(pieces):
            clock[0] += seconds
            bar.update()
    return stream.getvalue()


def test_short_work_is_silent_unless_it_is_asked(capsys):
    curves()
    curves(progress=False)
    assert capsys.readouterr().err == ""


def test_lines_where_the_output_is_no_terminal(capsys):
    curves(progress=True)
    told = capsys.readouterr().err.splitlines()
    assert 1 <= len(told) <= 10
    assert told[-1].startswith("symhbm: 100 %, 20 of 20 curves after ")


def test_one_line_per_tenth(monkeypatch):
    lines = work(monkeypatch, io.StringIO(), True, 40, 40).splitlines()
    assert [line.split(" %")[0] for line in lines] == [f"symhbm: {10 * i}" for i in range(1, 11)]
    assert "\r" not in "".join(lines)
    few = work(monkeypatch, io.StringIO(), True, 3, 3).splitlines()
    assert few[0] == "symhbm: 33 %, 1 of 3 curves after 0 s, about 0 s left"
    assert len(few) == 3


def test_lines_come_after_a_few_seconds(monkeypatch):
    assert work(monkeypatch, io.StringIO(), None, 10, 10, seconds=0.1) == ""
    late = work(monkeypatch, io.StringIO(), None, 10, 10, seconds=0.5).splitlines()
    assert late[0] == "symhbm: 40 %, 4 of 10 curves after 2 s, about 3 s left"
    assert late[-1] == "symhbm: 100 %, 10 of 10 curves after 5 s"
    assert len(late) == 7


def test_work_of_unknown_size(monkeypatch):
    lines = work(monkeypatch, io.StringIO(), True, None, 9, seconds=1).splitlines()
    assert lines == [
        "symhbm: 1 curve after 1 s",
        "symhbm: 2 curves after 2 s",
        "symhbm: 4 curves after 4 s",
        "symhbm: 8 curves after 8 s",
    ]


def test_lines_name_what_the_work_is(capsys):
    with workers.progress_bar("curve", True, 1, label="archive") as bar:
        bar.update()
    assert capsys.readouterr().err.startswith("symhbm: archive, 100 %, 1 of 1 curve after ")


def test_a_bar_in_a_terminal(monkeypatch):
    assert "5/5" in work(monkeypatch, Terminal(), True, 5, 5)
    assert "curves: 5 [00:00, " in work(monkeypatch, Terminal(), True, None, 5)
    assert work(monkeypatch, Terminal(), None, 5, 5) == ""
    assert work(monkeypatch, Terminal(), False, 5, 5) == ""


def test_a_notebook_has_a_bar(monkeypatch):
    """Its output is no terminal, and can be written over."""
    stream = type("OutStream", (io.StringIO,), {"__module__": "ipykernel.iostream"})()
    text = work(monkeypatch, stream, True, 5, 5)
    assert "5/5" in text
    assert "IProgress" not in text


@pytest.mark.parametrize("progress", ["yes", 1])
def test_bad_values(progress):
    with pytest.raises(TypeError, match=f"progress={progress!r}: expected True or False"):
        curves(progress=progress)


@pytest.fixture
def slow(monkeypatch):
    """A clock by which a second passes whenever somebody looks at it, and lines soon."""
    clock = iter(range(10**5, 10**6))
    monkeypatch.setattr(workers.time, "monotonic", lambda: float(next(clock)))
    monkeypatch.setattr(workers, "_LINES_APART", 3.0)
    return monkeypatch


def told_by(slow, stream, work):
    """What work tells on a stream."""
    slow.setattr(sys, "stderr", stream)
    work()
    return stream.getvalue()


@pytest.mark.parametrize("stream", [io.StringIO, Terminal])
def test_a_long_curve_tells_where_it_is(slow, stream):
    text = told_by(slow, stream(), lambda: sh.frf(fig03.problem(), (15, 30), progress=True))
    told = re.findall(r"([\d.]+) of 15 to 30 Hz(, 1 peak)?, about (\d+) s left", text)
    values = [float(value) for value, *_ in told]
    assert len(values) >= 2
    assert sorted(values) == values
    assert 15 < values[0] < values[-1] <= 30
    peak = sh.frf(fig03.problem(), (15, 30), progress=False).peak_frequency.item()
    assert {bool(passed) for value, passed, _ in told if float(value) > peak + 0.5} == {True}
    assert {bool(passed) for value, passed, _ in told if float(value) < peak} == {False}
    left = [int(seconds) for *_, seconds in told]
    assert left[-1] < left[0] <= 300


def test_words_that_nobody_reads_are_not_made(monkeypatch):
    """A path is told at each of its points, and shown twice a second at most."""
    asked, shown = [], Request.shown
    monkeypatch.setattr(Request, "shown", lambda *given: asked.append(1) or shown(*given))
    curve = sh.frf(fig03.problem(), (15, 30), progress=False)
    assert len(asked) < int(curve.n_points) / 2


def test_what_follows_a_path_is_told(slow):
    """Places between points, stability at each point, and where it changes."""
    problem = fig03.problem()
    text = told_by(
        slow, Terminal(), lambda: sh.frf(problem, (15, 30), stability=True, progress=True)
    )
    assert re.search(r"places between points solved for: \d", text)
    described = re.findall(r"points described: (\d+) of (\d+), about \d+ s left", text)
    assert len(described) >= 3
    assert len({total for _, total in described}) == 1
    counts = [int(count) for count, _ in described]
    assert sorted(counts) == counts
    assert re.search(r"steps searched for changes of stability: \d+ of \d+, about \d+ s left", text)


def test_curves_along_other_things_tell_where_they_are(slow):
    problem = fig03.problem()
    text = told_by(
        slow,
        Terminal(),
        lambda: sh.follow(problem, "normal_load", (1, 20), frequency=20.0, progress=True),
    )
    assert " of 1 to 20 N" in text
    text = told_by(
        slow, Terminal(), lambda: sh.nonlinear_modes(problem, band=(1e-5, 1e-3), progress=True)
    )
    assert re.search(r"[\de.-]+ of 1e-05 to 0.001 m, about \d+ s left", text)
    assert told_by(slow, Terminal(), lambda: sh.frf(problem, (15, 30), progress=False)) == ""


@pytest.mark.parametrize("archive", [None, "loads.nc"])
def test_a_large_ensemble_is_forecast(slow, tmp_path, archive):
    given = {} if archive is None else {"archive": tmp_path / archive}
    where = "memory; archive= keeps them on the disk" if archive is None else "disk"
    slow.setattr(workers, "_LARGE", 1e3)
    slow.setattr(ensemble, "_PIECE", 0.0)
    text = told_by(slow, io.StringIO(), lambda: curves(progress=True, **given))
    told = re.findall(r"symhbm: 20 curves take about [\d.]+ min and ([\d.]+) kB of (.*)", text)
    assert [place for _, place in told] == [where]
    kept = sum(of.nbytes for of in curves().drop_vars("problem_numbers", errors="ignore").values())
    assert 0.2 * kept < 1e3 * float(told[0][0]) < 2 * kept
    slow.setattr(workers, "_LARGE", 1e9)
    slow.setattr(workers, "_LONG", 1e9)
    assert "take about" not in told_by(slow, io.StringIO(), lambda: curves(progress=True))


def test_times_and_sizes_are_short():
    spans = [workers.span(seconds) for seconds in (0.4, 42, 89, 91, 1200, 7000, 2e5)]
    assert spans == ["0 s", "42 s", "89 s", "1.5 min", "20 min", "1.9 h", "2.3 days"]
    sizes = [workers.amount(size) for size in (12, 3400, 5.6e6, 7.89e9, 1.2e12)]
    assert sizes == ["12 bytes", "3.4 kB", "5.6 MB", "7.89 GB", "1.2 TB"]
