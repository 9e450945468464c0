"""Progress of long work: bars in terminals, lines elsewhere."""

import io
import re
import sys

import pytest

import symhbm as sh
from studies import fig03_single_blade as fig03
from symhbm import workers

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
    assert few[0] == "symhbm: 33 %, 1 of 3 curves after 0 s"
    assert len(few) == 3


def test_lines_come_after_a_few_seconds(monkeypatch):
    assert work(monkeypatch, io.StringIO(), None, 10, 10, seconds=0.1) == ""
    late = work(monkeypatch, io.StringIO(), None, 10, 10, seconds=0.5).splitlines()
    assert late[0] == "symhbm: 40 %, 4 of 10 curves after 2 s"
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


def test_a_long_curve_tells_where_it_is(monkeypatch):
    clock = [0.0]

    def monotonic():
        clock[0] += 1.0
        return clock[0]

    monkeypatch.setattr(workers.time, "monotonic", monotonic)
    for stream in (io.StringIO(), Terminal()):
        monkeypatch.setattr(sys, "stderr", stream)
        monkeypatch.setattr(workers, "_LINES_APART", 3.0)
        sh.frf(fig03.problem(), (15, 30), progress=True)
        told = re.findall(r"([\d.]+) of 15 to 30 Hz, (\d+) s left of the path", stream.getvalue())
        values = [float(value) for value, _ in told]
        assert len(values) >= 2
        assert sorted(values) == values
        assert 15 < values[0] < values[-1] <= 30
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    sh.follow(fig03.problem(), "normal_load", (1, 20), frequency=20.0, progress=True)
    assert " of 1 to 20 N" in stream.getvalue()
    silent = Terminal()
    monkeypatch.setattr(sys, "stderr", silent)
    sh.frf(fig03.problem(), (15, 30), progress=False)
    assert silent.getvalue() == ""
