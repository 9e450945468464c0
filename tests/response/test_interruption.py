"""Interruptions: a note tells which results are safe; workers end silently with their parent."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest

import symhbm as sh
from symhbm import workers as worker
from symhbm.results.archive.working_files import working_file
from tests.archives import counted
from tests.problems import one_blade

BLADE = sh.HarmonicBalance(one_blade(), sh.forces.PointForce())
LOADS = [0.5, 1.0, 3.0, 500.0]
BAND = (18.0, 21.0)


def call(loads=LOADS, **options):
    return sh.frf(BLADE, BAND, over={"normal_load": loads}, **{"progress": False} | options)


def interrupted(patch, after, use):
    """The note of an interrupted call."""
    with patch.context() as context:
        counted(context, after)
        with pytest.raises(KeyboardInterrupt) as caught:
            use()
    [note] = caught.value.__notes__
    assert note.startswith("symhbm: interrupted; ")
    assert "\n" not in note
    return note


def test_an_interrupt_says_what_is_safe(tmp_path, monkeypatch):
    path = tmp_path / "x.nc"
    note = interrupted(monkeypatch, 1, lambda: call(archive=path))
    assert "1 of 4 parameter sets are safe in 'x.nc.partial', the same call goes on" in note
    assert f"symhbm.resume({str(path)!r})" in note
    note = interrupted(monkeypatch, 2, lambda: sh.resume(path))
    assert "3 of 4 parameter sets are safe" in note
    sh.resume(path, progress=False).close()
    assert not working_file(path).exists()


def test_an_interrupt_says_what_is_lost(monkeypatch):
    note = interrupted(monkeypatch, 3, call)
    assert "3 of 4 parameter sets were computed and are lost; with archive=" in note
    note = interrupted(monkeypatch, 0, lambda: sh.frf(BLADE, BAND, progress=False))
    assert "nothing is kept of a curve that is not finished" in note
    note = interrupted(
        monkeypatch, 0, lambda: sh.follow(BLADE, "normal_load", (1, 9), frequency=19.5)
    )
    assert "nothing is kept" in note


@pytest.mark.parametrize(
    "pool",
    [lambda: ThreadPoolExecutor(1), lambda: ProcessPoolExecutor(1, mp_context=get_context("fork"))],
    ids=["thread", "process"],
)
def test_what_an_executor_has_finished_is_safe(pool, tmp_path, monkeypatch):
    path = tmp_path / "x.nc"
    with pool() as executor:
        note = interrupted(monkeypatch, 2, lambda: call(archive=path, executor=executor))
    assert "2 of 4 parameter sets are safe" in note
    with sh.resume(path, progress=False) as result:
        assert result.identical(call())


def test_a_script_ends_with_the_sentence_alone(tmp_path):
    """No traceback, and the exit code that an interrupt has."""
    script = """
        import signal
        import test_interruption as own
        from symhbm.response import ensemble

        signal.signal(signal.SIGINT, signal.default_int_handler)
        ensemble._outcome = lambda *given: signal.raise_signal(signal.SIGINT)
        own.call(archive="x.nc")
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])},
    )
    assert done.stderr.startswith("symhbm: interrupted; 0 of 4 parameter sets are safe in 'x.nc.")
    assert done.stderr.count("\n") == 1
    assert done.returncode == -signal.SIGINT


def test_a_finished_archive_says_that_nothing_was_computed(tmp_path, capsys):
    path = tmp_path / "x.nc"
    call(archive=path, progress=None).close()
    assert capsys.readouterr().err == ""
    line = f"symhbm: {str(path)!r} is complete, nothing was computed\n"
    call(archive=path, progress=None).close()
    assert capsys.readouterr().err == line
    sh.resume(path).close()
    assert capsys.readouterr().err == line
    call(archive=path).close()
    sh.resume(path, progress=False).close()
    assert capsys.readouterr().err == ""


def test_a_name_without_a_suffix_goes_on(tmp_path, monkeypatch):
    path = tmp_path / "x"
    note = interrupted(monkeypatch, 1, lambda: call(archive=path))
    assert "1 of 4 parameter sets are safe in 'x.nc.partial'" in note
    with pytest.raises(FileNotFoundError, match="1 of its 4 parameter sets are finished"):
        sh.load(path)
    sh.resume(path, progress=False).close()
    call(archive=path).close()
    assert [file.name for file in tmp_path.iterdir()] == ["x.nc"]


def test_a_working_file_of_other_names_is_refused(tmp_path, monkeypatch):
    """As one of another version is: its curves could not be put beside those of today."""
    from symhbm.response import curve

    path, unsolved = tmp_path / "x.nc", curve.unsolved

    def more(*arguments):
        table = unsolved(*arguments)
        return table | {"angle": table["residual_norm"].copy()}

    with monkeypatch.context() as patch:
        patch.setattr(curve, "unsolved", more)
        interrupted(monkeypatch, 1, lambda: call(archive=path))
    for use in (lambda: call(archive=path), lambda: sh.resume(path)):
        with pytest.raises(
            sh.datasets.ArchiveError, match=r"another version .*differ in angle; finish it"
        ):
            use()


def test_a_worker_is_attended_once(monkeypatch):
    """This process is none: it stays as it is."""
    handler = signal.getsignal(signal.SIGINT)
    worker.attend()
    with worker.at_work("one"):
        assert worker._worker.call is None
    assert signal.getsignal(signal.SIGINT) is handler


_HANG = 1800
"""Seconds after which a process that should have ended hangs: no machine is so slow."""
SCRIPT = """
    import sys, time
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context
    import test_interruption as own

    if __name__ == "__main__":
        with ProcessPoolExecutor(2, mp_context=get_context(sys.argv[1])) as pool:
            while len({*pool.map(own.attended, range(2))}) < 2:
                pass
            print(*pool._processes, flush=True)
            if sys.argv[2] == "busy":
                submit = pool.submit
                def watched(*given, **named):
                    future = submit(*given, **named)
                    future.add_done_callback(lambda _: print("done", flush=True))
                    return future
                pool.submit = watched
                own.call(range(1, 2000), executor=pool)
            time.sleep(100)
"""


def attended(_):
    """Which process does a piece of work, slowly enough that the other does one, too."""
    with worker.at_work("before"):
        time.sleep(0.1)
        return os.getpid()


def interruptible():
    """Hear an interrupt, also where the tests themselves run in the background of a shell."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def started(method, doing, folder):
    """A process with a pool of two workers, and their numbers."""
    script = folder / "script.py"
    script.write_text(textwrap.dedent(SCRIPT))
    tests = Path(__file__).parent
    process = subprocess.Popen(
        [sys.executable, script, method, doing],
        env=os.environ | {"PYTHONPATH": f"{tests}:{tests.parent}:{Path(sh.__file__).parents[1]}"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=interruptible,
    )
    assert process.stdout is not None
    return process, [int(number) for number in process.stdout.readline().split()]


def lives(process):
    """Whether there is such a process, which is not only waiting to be reaped."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


slow = pytest.mark.slow
linux = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks at /proc")


@linux
@pytest.mark.parametrize(
    ("method", "doing"),
    [
        ("fork", "idle"),
        pytest.param("fork", "busy", marks=slow),
        pytest.param("spawn", "busy", marks=slow),
        pytest.param("forkserver", "idle", marks=slow),
    ],
)
def test_workers_end_with_their_parent(method, doing, tmp_path):
    process, workers = started(method, doing, tmp_path)
    assert len(workers) == 2
    assert all(map(lives, workers))
    process.kill()
    # Workers that live on hold its pipes.
    process.wait()
    end = time.monotonic() + _HANG
    while any(map(lives, workers)) and time.monotonic() < end:
        time.sleep(0.05)
    left = [number for number in workers if lives(number)]
    for number in left:
        os.kill(number, signal.SIGKILL)
    process.communicate()
    assert not left


@linux
@pytest.mark.parametrize(
    ("method", "doing"),
    [
        ("fork", "idle"),
        pytest.param("fork", "busy", marks=slow),
        pytest.param("spawn", "idle", marks=slow),
        pytest.param("spawn", "busy", marks=slow),
    ],
)
def test_workers_are_interrupted_in_silence(method, doing, tmp_path):
    """An interrupt from the keyboard goes to all processes: one tells where it was."""
    process, workers = started(method, doing, tmp_path)
    if doing == "busy":
        assert process.stdout.readline() == "done\n"  # the first curves
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=_HANG)
    assert errors.count("Traceback") == 1, errors
    last = errors.splitlines()[-1]
    if doing == "busy":
        assert last.startswith("symhbm: interrupted; ")
        assert "of 1999 parameter sets were computed and are lost" in last
    else:
        assert last == "KeyboardInterrupt"
    assert not any(map(lives, workers))


@linux
def test_the_command_line_is_interrupted_in_one_line(tmp_path, monkeypatch):
    path = tmp_path / "x.nc"
    interrupted(monkeypatch, 1, lambda: call(range(1, 3001), archive=path))
    command = [sys.executable, "-m", "symhbm", "resume", path, "--workers", "1"]
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=interruptible,
    )
    end = time.monotonic() + _HANG
    while time.monotonic() < end and process.poll() is None:
        if "1 of its 3000 " not in _said(path):
            break
        time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    out, errors = process.communicate(timeout=_HANG)
    assert process.returncode == 130
    assert out == ""
    [line] = errors.split("\n")[-2:-1]
    assert line.startswith("symhbm: interrupted; ")
    assert "of 3000 parameter sets are safe in 'x.nc.partial'" in line
    assert "Traceback" not in errors


def _said(path):
    """What is said of an archive that is not there yet."""
    try:
        sh.load(path)
    except FileNotFoundError as error:
        return str(error)


def test_the_public_names_alone_are_shown():
    assert dir(sh) == sorted(sh.__all__)
    for name in ("archive", "runs", "store", "version", "import_module", "TYPE_CHECKING"):
        assert name not in dir(sh)
    for name in ("mistuning", "plot", "statistics"):
        assert name in dir(sh)
    for name in dir(sh):
        assert getattr(sh, name) is not None
