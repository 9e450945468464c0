"""The working file of an archive: finished parameter sets, safe against a kill at any instant.

An SQLite database of one row per set. The journal stays on disk between commits, which takes two
waits for the disk per commit instead of a new file, and, unlike a write-ahead log, works on network
file systems. A second, empty database beside it is locked as long as a process writes: its lock
goes with the process, however that ends, and forked workers do not hold it.
"""

import json
import os
import socket
import sqlite3
import time
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from symhbm.tables import Encoded

SUFFIX = ".partial"
_FORMAT = 1
_PATIENCE = 600.0
"""Seconds that a reader may keep a commit waiting."""
_SCHEMA = """
BEGIN IMMEDIATE;
CREATE TABLE about (name TEXT PRIMARY KEY, value BLOB);
CREATE TABLE results (number INTEGER PRIMARY KEY, layout TEXT, checksum INTEGER, data BLOB);
"""


class ArchiveError(OSError, ValueError):
    """An archive that cannot be written, or a file that is no archive of this library."""


def working_file(archive: Path) -> Path:
    """The working file of an archive."""
    return archive.with_name(archive.name + SUFFIX)


class Store:
    """The working file at ``path``.

    ``call`` is what it says of the computation, None if it is new, of ``n_sets`` parameter sets;
    ``done`` are the numbers of those that are finished.

    Raises ArchiveError if it is damaged, held by another process, or cannot be written. To read,
    it need not be held.
    """

    def __init__(self, path: Path, write: bool = True):
        self.path = path
        self.n_sets = 0
        self.done: set[int] = set()
        self.call: bytes | None = None
        self._lock = self._connection = None
        try:
            with self._reported("opened"):
                if write:
                    self._hold()
                self._open(write)
        except BaseException:
            self.close()
            raise

    def _open(self, write: bool) -> None:
        # Opened to write, too: a commit that was cut off has to be undone before anything is read.
        address = f"{self.path.absolute().as_uri()}?mode={'rwc' if write else 'rw'}"
        self._connection = sqlite3.connect(
            address, uri=True, timeout=_PATIENCE, isolation_level=None
        )
        self._connection.execute("PRAGMA journal_mode=PERSIST")
        self._connection.execute("PRAGMA synchronous=FULL")
        number = self._connection.execute("PRAGMA user_version").fetchone()[0]
        if not number and not self._connection.execute("SELECT * FROM sqlite_master").fetchone():
            return
        if number != _FORMAT:
            raise ArchiveError(f"{self._name}: format {number}, this version reads {_FORMAT}")
        self.call = self._about("call")
        self.n_sets = int(self._about("n_sets"))
        found = self._connection.execute("SELECT number FROM results WHERE number >= 0")
        self.done = {number for (number,) in found}
        if write:
            self._connection.execute("UPDATE about SET value=? WHERE name='holder'", [_me()])

    def _hold(self) -> None:
        held = self.path.with_name(f"{self.path.name}-lock")
        while True:
            self._lock = sqlite3.connect(held, timeout=0, isolation_level=None)
            try:
                self._lock.execute("PRAGMA journal_mode=OFF")
                self._lock.execute("BEGIN EXCLUSIVE")
            except sqlite3.OperationalError as error:
                if error.sqlite_errorcode != sqlite3.SQLITE_BUSY:
                    raise
                raise ArchiveError(f"{self._name}: in use by {self._holder()}") from None
            if held.exists():
                return
            # Its last holder has just removed it.
            self._lock.close()

    def _holder(self) -> str:
        with suppress(ArchiveError, sqlite3.Error):
            self._open(write=False)
            told = json.loads(self._about("holder"))
            return f"process {told['process']} on {told['host']} since {told['since']}"
        return "another process"

    @property
    def _name(self) -> str:
        return f"path={str(self.path)!r}"

    @contextmanager
    def _reported(self, done: str) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            code = getattr(error, "sqlite_errorcode", None)
            if code in (sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_CORRUPT):
                raise self._damaged(str(error)) from error
            text = f"{self._name}: the working file cannot be {done} ({error})"
            raise ArchiveError(text if self.call is None else f"{text}; {self.rest}") from error

    @property
    def rest(self) -> str:
        """What a failure leaves, in words."""
        if self.path.exists():
            safe = f"{len(self.done)} of {self.n_sets} parameter sets are safe in"
            return f"{safe} {self.path.name!r}, the same call goes on with them"
        what = repr(self.path.name) if self.path.parent.is_dir() else "the directory"
        return f"{what} was removed, and with it all results; the same call starts anew"

    def _damaged(self, why: str) -> ArchiveError:
        return ArchiveError(
            f"{self._name}: the working file is damaged ({why}); remove it to start anew"
        )

    def _execute(self, command: str, values: tuple = ()) -> sqlite3.Cursor:
        assert self._connection is not None
        return self._connection.execute(command, values)

    def _about(self, name: str) -> bytes:
        row = self._execute("SELECT value FROM about WHERE name=?", (name,)).fetchone()
        if row is None:
            raise self._damaged(f"nothing about {name}")
        return row[0]

    def begin(self, call: bytes, n_sets: int, blank: Encoded) -> None:
        """Say what is computed, and what a set looks like that is not."""
        assert self._connection is not None
        with self._reported("written"):
            try:
                self._connection.executescript(_SCHEMA)
                about = {"call": call, "n_sets": str(n_sets), "holder": _me()}
                self._connection.executemany("INSERT INTO about VALUES (?, ?)", about.items())
                self._insert(-1, blank)
                self._execute(f"PRAGMA user_version={_FORMAT}")
                self._execute("COMMIT")
            except sqlite3.Error:
                self.close()
                raise
        self.call, self.n_sets = call, n_sets

    def add(self, found: Sequence[tuple[int, Encoded]]) -> None:
        """Keep the results of some parameter sets, by number; on return they are safe."""
        if not found:
            return
        with self._reported("written"):
            # The disk is waited for once, however many they are.
            self._execute("BEGIN IMMEDIATE")
            for number, encoded in found:
                self._insert(number, encoded)
            self._execute("COMMIT")
        self.done.update(number for number, _ in found)

    def _insert(self, number: int, encoded: Encoded) -> None:
        layout, data = encoded
        checksum = zlib.crc32(data, zlib.crc32(layout.encode()))
        values = number, layout, checksum, data
        self._execute("INSERT INTO results VALUES (?, ?, ?, ?)", values)

    def layouts(self) -> Iterator[tuple[int, str]]:
        """All layouts of finished sets, and the number of a set of each."""
        with self._reported("read"):
            yield from self._execute(
                "SELECT MIN(number), layout FROM results WHERE number >= 0 GROUP BY layout"
            )

    def read(self, first: int, last: int) -> list[tuple[int, Encoded]]:
        """Finished sets with numbers from ``first`` to ``last``, in order; -1 is a blank one."""
        with self._reported("read"):
            rows = self._execute(
                "SELECT * FROM results WHERE number BETWEEN ? AND ? ORDER BY number", (first, last)
            ).fetchall()
        for number, layout, checksum, data in rows:
            if checksum != zlib.crc32(data, zlib.crc32(layout.encode())):
                raise self._damaged(f"parameter set {number} is not as it was written")
        return [(number, (layout, data)) for number, layout, _, data in rows]

    def remove(self) -> None:
        """Remove the file, which is needed no more, and let go of it."""
        if self._connection is not None:
            self._connection.close()
        self.path.unlink(missing_ok=True)
        self.path.with_name(f"{self.path.name}-journal").unlink(missing_ok=True)
        self.close()

    def close(self) -> None:
        """Let go of the file."""
        if self._connection is not None:
            self._connection.close()
        if self._lock is not None:
            if self._lock.in_transaction:
                # Before it is let go, so that nobody holds a file that is no more.
                with suppress(OSError):
                    self.path.with_name(f"{self.path.name}-lock").unlink()
            self._lock.close()
        self._lock = self._connection = None

    def __enter__(self) -> "Store":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _me() -> str:
    since = time.strftime("%Y-%m-%d %H:%M:%S")
    return json.dumps({"process": os.getpid(), "host": socket.gethostname(), "since": since})
