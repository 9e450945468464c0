"""A damaged file gives the same data as before, or an ArchiveError: never anything else."""

import sqlite3
from contextlib import closing
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from symhbm.results.archive import seal
from symhbm.results.archive import working_files as store
from symhbm.results.archive.working_files import Store, working_file
from tests.archives import interrupt
from tests.problems import one_blade

BLADE = sh.HarmonicBalance(one_blade(), sh.forces.PointForce())
LOADS = [0.5, 1.0, 3.0, 500.0]
N_DONE = 3


def call(progress=False, **options):
    over = {"normal_load": LOADS}
    return sh.frf(BLADE, (18.0, 21.0), over=over, progress=progress, **options)


def interrupted(path):
    """A working file with some of its sets, as a process leaves it that is interrupted."""
    interrupt(N_DONE, call, archive=path)
    return working_file(path)


@cache
def in_memory():
    return call()


@pytest.fixture(scope="module")
def working(tmp_path_factory):
    return interrupted(tmp_path_factory.mktemp("working") / "x.nc").read_bytes()


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    return sh.save(in_memory(), tmp_path_factory.mktemp("archive") / "x.nc").read_bytes()


def damaged(whole, seed):
    """The bytes of a file cut off, or with a few or many bits flipped, more of them at its head."""
    random = np.random.default_rng(seed)
    kind = random.integers(4)
    if kind == 0:
        return whole[: random.integers(len(whole))]
    data = bytearray(whole)
    for _ in range(1 if kind < 3 else random.integers(2, 100)):
        end = len(data) if random.random() < 0.7 else min(len(data), 4096)
        data[random.integers(end)] ^= 1 << int(random.integers(8))
    return bytes(data)


def opened(read):
    """The data of a file, None if it is said to be damaged; any other error is one of the test."""
    try:
        with read() as dataset:
            return dataset.load()
    except sh.datasets.ArchiveError:
        return None


def look_at_archives(whole, folder, seeds):
    refused = []
    for seed in seeds:
        path = folder / f"{seed}.nc"
        path.write_bytes(damaged(whole, seed))
        for lazy in (False, True):
            data = opened(lambda path=path, lazy=lazy: sh.load(path, lazy))
            assert data is None or data.identical(in_memory()), (seed, lazy)
            refused.append(data is None)
    assert any(refused)


def look_at_working_files(whole, folder, seeds):
    path = folder / "x.nc"
    file = working_file(path)
    file.write_bytes(whole)
    part = sh.load(file)
    assert int((part.status != str(sh.Status.NOT_STARTED)).sum()) == N_DONE
    expected = {sh.load: part, sh.resume: in_memory()}
    refused = []
    for seed in seeds:
        for use, argument in ((sh.load, file), (sh.resume, path)):
            for left in folder.iterdir():
                left.unlink()
            file.write_bytes(damaged(whole, seed))
            data = opened(lambda use=use, argument=argument: use(argument))
            assert data is None or data.identical(expected[use]), (seed, use)
            refused.append(data is None)
    assert any(refused)
    assert not all(refused)


def test_any_damage_of_an_archive(archive, tmp_path):
    look_at_archives(archive, tmp_path, range(30))


@pytest.mark.slow
def test_any_damage_of_a_working_file(working, tmp_path):
    look_at_working_files(working, tmp_path, range(16))


@pytest.mark.slow
def test_much_damage_of_archives(archive, tmp_path):
    look_at_archives(archive, tmp_path, range(1000, 1600))


@pytest.mark.slow
def test_much_damage_of_working_files(working, tmp_path):
    look_at_working_files(working, tmp_path, range(1000, 1600))


def flipped(path, old, new):
    """Exchange some bytes of a file for as many others."""
    data = path.read_bytes()
    assert len(old) == len(new)
    assert old in data
    path.write_bytes(data.replace(old, new, 1))


STATUS = b"the end of the band was reached"


@pytest.mark.parametrize("lazy", [False, True])
@pytest.mark.parametrize("change", [STATUS.upper(), STATUS[:-1] + b"!"])
def test_a_changed_text_is_refused(change, lazy, archive, tmp_path):
    """NetCDF itself reads it without a word."""
    path = tmp_path / "x.nc"
    path.write_bytes(archive)
    flipped(path, STATUS, change)
    with xr.open_dataset(path) as plain:
        assert change.decode() in plain.status.values
    with pytest.raises(sh.datasets.ArchiveError, match="not as it was written"):
        sh.load(path, lazy)


@pytest.mark.parametrize(
    "again", [lambda path: call(archive=path), sh.resume], ids=["frf", "resume"]
)
def test_the_file_that_is_read_was_checked(again, archive, tmp_path):
    path = tmp_path / "x.nc"
    call(archive=path).close()
    flipped(path, STATUS, STATUS.upper())
    with pytest.raises(sh.datasets.ArchiveError, match="not as it was written"):
        again(path)


def test_a_file_that_changes_after_it_was_opened(archive, tmp_path):
    path = tmp_path / "x.nc"
    path.write_bytes(archive)
    with sh.load(path, lazy=True) as lazy:
        offset = int(0.6 * len(archive))
        data = archive[:offset] + bytes(1000) + archive[offset + 1000 :]
        with path.open("rb+") as file:
            file.write(data)
        with pytest.raises(sh.datasets.ArchiveError, match=r"x\.nc'.*changed after it was opened"):
            lazy.amplitude.load()
    path.write_bytes(archive)
    with sh.load(path, lazy=True) as lazy:
        # The file that is open stays what it was.
        path.unlink()
        assert lazy.load().identical(in_memory())


def test_errors_of_netcdf_while_reading(archive, tmp_path, monkeypatch):
    from xarray.backends.netCDF4_ import NetCDF4ArrayWrapper

    path = tmp_path / "x.nc"
    path.write_bytes(archive)
    with sh.load(path, lazy=True) as lazy:
        for error in (RuntimeError("NetCDF: HDF error"), OSError("Stale file handle")):

            def fail(*_, error=error):
                raise error

            monkeypatch.setattr(NetCDF4ArrayWrapper, "_getitem", fail)
            with pytest.raises(sh.datasets.ArchiveError, match=f"cannot be read .{error}"):
                lazy.amplitude.load()


@pytest.mark.parametrize("lost", [1, 22, 23, 24, 400])
def test_a_seal_that_is_lost_with_the_last_block(lost, archive, tmp_path):
    """A file whose end was never written: as long as it should be, but of zeros."""
    path = tmp_path / "x.nc"
    path.write_bytes(archive[:-lost] + bytes(lost))
    for lazy in (False, True):
        with pytest.raises(sh.datasets.ArchiveError, match="not as it was written"):
            sh.load(path, lazy)


def test_a_file_without_a_seal_is_read(archive, tmp_path):
    """As another program leaves it that has changed something; cut in the middle, it is damaged."""
    path = tmp_path / "x.nc"
    path.write_bytes(archive[: -seal._LENGTH])
    xr.testing.assert_identical(sh.load(path), in_memory())
    plain = tmp_path / "plain.nc"
    in_memory().to_netcdf(plain)
    for file in (path, plain):
        assert not seal.is_damaged(file)
        assert sh.load(file).identical(in_memory())
        with file.open("ab") as more:
            more.write(b" ")
        assert seal.is_damaged(file)


def test_the_seal_is_of_the_whole_file(tmp_path):
    """Also of one of several blocks, and of the last byte before the seal."""
    path, size = tmp_path / "x", seal._BLOCK + 1000
    content = np.random.default_rng(0).bytes(size)
    path.write_bytes(content)
    assert not seal.is_damaged(path)
    seal.seal(path)
    sealed = path.read_bytes()
    assert sealed.startswith(content)
    assert len(sealed) == size + seal._LENGTH
    assert not seal.is_damaged(path)
    for offset in (0, 1, seal._BLOCK - 1, seal._BLOCK, size - 1, size, len(sealed) - 2):
        data = bytearray(sealed)
        data[offset] ^= 1
        path.write_bytes(data)
        # A mark that is none is no seal; a file of HDF5 tells its length beside.
        assert seal.is_damaged(path) == (offset != size)


def changed(file, command, *values):
    with closing(sqlite3.connect(file)) as connection, connection:
        assert connection.execute(command, values).rowcount


EXCHANGES = {
    "numbers": [
        "UPDATE results SET number=100 WHERE number=0",
        "UPDATE results SET number=0 WHERE number=1",
        "UPDATE results SET number=1 WHERE number=100",
    ],
    "a number": ["UPDATE results SET number=3 WHERE number=2"],
    "a number beyond": ["UPDATE results SET number=9 WHERE number=2"],
    "a blank one": ["UPDATE results SET number=4 WHERE number=-1"],
    "a row": ["DELETE FROM results WHERE number=1"],
    "all rows": ["DELETE FROM results"],
    "layout": ["UPDATE results SET layout='[]' WHERE number=1"],
    "no layout": ["UPDATE results SET layout=NULL WHERE number=1"],
    "data": ["UPDATE results SET data=zeroblob(length(data)) WHERE number=1"],
    "no data": ["UPDATE results SET data=NULL WHERE number=1"],
    "text": ["UPDATE results SET data='text' WHERE number=1"],
    "content": ["UPDATE results SET content=content+1 WHERE number=1"],
    "content and data": [
        "UPDATE results SET (content, data)=(SELECT content, data FROM results WHERE number=0) "
        "WHERE number=1"
    ],
    "checksum": ["UPDATE results SET checksum=checksum+1 WHERE number=1"],
    "number of sets": ["UPDATE about SET value='5' WHERE name='n_sets'"],
    "what is computed": ["UPDATE about SET value=zeroblob(length(value)) WHERE name='call'"],
    "nothing about it": ["DELETE FROM about WHERE name='call'"],
    "no count": ["DELETE FROM about WHERE name='rows'"],
    "name": ["UPDATE about SET name='cell' WHERE name='call'"],
}


@pytest.mark.parametrize("exchange", EXCHANGES)
def test_what_is_exchanged_in_a_working_file(exchange, working, tmp_path):
    file = working_file(tmp_path / "x.nc")
    file.write_bytes(working)
    for command in EXCHANGES[exchange]:
        changed(file, command)
    for use in (
        lambda: sh.load(file),
        lambda: sh.resume(tmp_path / "x.nc"),
        lambda: call(archive=tmp_path / "x.nc"),
    ):
        with pytest.raises(sh.datasets.ArchiveError, match=r"is damaged .*not as it was written"):
            use()
    assert not Path(tmp_path / "x.nc").exists()


def test_a_row_that_goes_while_the_file_is_read(working, tmp_path):
    file = working_file(tmp_path / "x.nc")
    file.write_bytes(working)
    with Store(file, write=False) as reader:
        assert len(reader.read(0, 3)) == N_DONE
        changed(file, "DELETE FROM results WHERE number=1")
        with pytest.raises(sh.datasets.ArchiveError, match="set 1 is not as it was written"):
            reader.read(0, 3)


def test_a_row_that_comes_while_the_file_is_read(working, tmp_path):
    """It belongs to another state of the file, whose layout may be another."""
    file = working_file(tmp_path / "x.nc")
    file.write_bytes(working)
    with Store(file, write=False) as reader, Store(file) as writer:
        before = reader.read(0, 3)
        writer.add([(3, before[0][1])])
        assert reader.read(0, 3) == before
        assert [number for number, _ in writer.read(0, 3)] == [0, 1, 2, 3]


def test_a_message_of_the_database_that_is_no_text(working, tmp_path):
    file = working_file(tmp_path / "x.nc")
    file.write_bytes(working)
    flipped(file, b"tableresultsresults", b"table\xacesultsresults")
    with pytest.raises(sh.datasets.ArchiveError, match=r"x\.nc\.partial'.* is damaged"):
        sh.load(file)


def test_a_row_of_another_computation(working, tmp_path):
    """The same numbers of the same set, but of another band: its results do not belong here."""
    file, other = (working_file(tmp_path / name) for name in ("x.nc", "y.nc"))
    file.write_bytes(working)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(f"{__name__}.LOADS", [0.6, *LOADS[1:]])
        interrupted(tmp_path / "y.nc")
    with closing(sqlite3.connect(file)) as connection, connection:
        connection.execute("ATTACH ? AS other", [str(other)])
        connection.execute("DELETE FROM results WHERE number=1")
        connection.execute("INSERT INTO results SELECT * FROM other.results WHERE number=1")
    with pytest.raises(sh.datasets.ArchiveError, match="set 1 is not as it was written"):
        sh.load(file)


def test_working_files_of_other_versions(working, tmp_path):
    file = working_file(tmp_path / "x.nc")
    file.write_bytes(working)
    for number, words in ((2, "format 2, this version of symhbm reads 1"), (3, "format 3")):
        with closing(sqlite3.connect(file)) as connection:
            connection.execute(f"PRAGMA user_version={number}")
        for use in (lambda: sh.load(file), lambda: sh.resume(tmp_path / "x.nc")):
            with pytest.raises(sh.datasets.ArchiveError, match=words):
                use()
    assert store._FORMAT == 1
