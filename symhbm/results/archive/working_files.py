"""The working file of an archive: finished parameter sets, safe against a kill at any time.

An SQLite database of one row per set. The journal stays on disk between commits, which takes two
waits for the disk per commit instead of a new file, and, unlike a write-ahead log, works on network
file systems. A second, empty database beside it is locked while a process writes: the lock ends
with the process, however that ends, and forked workers do not hold it.

All data read are compared with a checksum. The checksum of a row covers the number of its set and
the computation it belongs to, and the file states how many rows there are.
"""

import json
import os
import socket
import sqlite3
import time
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any

from symhbm.results.tables import Encoded

SUFFIX = ".partial"
_FORMAT = 1
_PATIENCE = 600.0
"""Seconds that a reader may keep a commit waiting."""
_AT_ONCE = 64
"""Parameter sets that are read at once: bounded memory, few reads."""
_SCHEMA = """
BEGIN IMMEDIATE;
CREATE TABLE about (name TEXT PRIMARY KEY, value BLOB, checksum INTEGER);
CREATE TABLE results
    (number INTEGER PRIMARY KEY, layout BLOB, content INTEGER, checksum INTEGER, data BLOB);
"""
_DAMAGE = {sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_ERROR}
_DAMAGE |= {sqlite3.SQLITE_TOOBIG, sqlite3.SQLITE_MISMATCH, sqlite3.SQLITE_CONSTRAINT_PRIMARYKEY}
"""Errors of SQLite that mean a damaged file."""


class ArchiveError(OSError, ValueError):
    """An archive that cannot be written, or a file that is no archive of this library.

    Examples
    --------
    >>> import symhbm as sh
    >>> with open("notes.nc", "w") as file:
    ...     _ = file.write("no archive")
    >>> try:
    ...     sh.load("notes.nc")
    ... except sh.datasets.ArchiveError as error:
    ...     print(type(error).__name__)
    ArchiveError
    """


def working_file(archive: Path) -> Path:
    """The working file of an archive."""
    return archive.with_name(archive.name + SUFFIX)


class Store:
    """The working file at ``path``.

    ``call`` is the dataset without results, in bytes, None for a new file; ``n_sets`` the number
    of parameter sets; ``done`` the numbers of the finished ones. ``sessions`` tell which processes
    computed them, ``sources`` the parts that were merged.

    Raises ArchiveError if it is damaged, locked by another process, or cannot be written. Reading
    needs no lock.
    """

    def __init__(self, path: Path, write: bool = True):
        self.path = path
        self.n_sets = 0
        self.done: set[int] = set()
        self.call: bytes | None = None
        self.sessions: list[dict[str, Any]] = []
        self.sources: list[dict[str, Any]] = []
        self._told = False
        self._layouts: dict[bytes, int] = {}
        self._rows = self._total = self._origin = 0
        self._lock = self._connection = None
        try:
            with self._reported("opened"):
                if write:
                    self._acquire()
                self._open(write)
        except BaseException:
            self.close()
            raise

    def _open(self, write: bool) -> None:
        if not self._connect(write):
            return
        # A transaction: one state of the file, even if another process writes meanwhile.
        self._execute("BEGIN")
        self._identify(self._entry("call"), int(self._entry("n_sets")))
        self.sessions = json.loads(self._entry("sessions", b"[]"))
        self.sources = json.loads(self._entry("sources", b"[]"))
        rows = self._execute("SELECT number, layout, content, checksum FROM results")
        for number, layout, content, checksum in rows:
            self._check_row(number, layout, content, checksum)
            self._count(number, layout, checksum)
        if self._entry("rows") != _counted(self._rows, self._total):
            raise self._damaged("the number of parameter sets is not as it was written")
        self._execute("COMMIT")
        if write:
            self._put("holder", _this_process())

    def _connect(self, write: bool) -> bool:
        """Whether the file has content; ArchiveError for a format of another version."""
        # Opened for writing, too: SQLite undoes an interrupted commit before it reads.
        address = f"{self.path.absolute().as_uri()}?mode={'rwc' if write else 'rw'}"
        self._connection = sqlite3.connect(
            address, uri=True, timeout=_PATIENCE, isolation_level=None
        )
        # Damaged text need not decode.
        self._connection.text_factory = bytes
        self._connection.execute("PRAGMA journal_mode=PERSIST")
        self._connection.execute("PRAGMA synchronous=FULL")
        number = self._connection.execute("PRAGMA user_version").fetchone()[0]
        if not number and not self._connection.execute("SELECT * FROM sqlite_master").fetchone():
            return False
        if number != _FORMAT:
            raise ArchiveError(
                f"{self._name}: format {number}, this version of symhbm reads {_FORMAT}"
            )
        return True

    def _acquire(self) -> None:
        lock_file = self.path.with_name(f"{self.path.name}-lock")
        while True:
            self._lock = sqlite3.connect(lock_file, timeout=0, isolation_level=None)
            try:
                self._lock.execute("PRAGMA journal_mode=OFF")
                self._lock.execute("BEGIN EXCLUSIVE")
            except sqlite3.OperationalError as error:
                if error.sqlite_errorcode != sqlite3.SQLITE_BUSY:
                    raise
                raise ArchiveError(f"{self._name}: in use by {self._holder()}") from None
            if lock_file.exists():
                return
            # The last holder has just removed the lock file.
            self._lock.close()

    def _holder(self) -> str:
        with suppress(ArchiveError, sqlite3.Error):
            self._connect(write=False)
            holder = json.loads(self._entry("holder"))
            return f"process {holder['process']} on {holder['host']} since {holder['since']}"
        return "another process"

    @property
    def _name(self) -> str:
        return f"path={str(self.path)!r}"

    @contextmanager
    def _reported(self, action: str) -> Iterator[None]:
        """Raise errors of SQLite as ArchiveError; ``action`` is what the file cannot be."""
        try:
            yield
        # Messages of SQLite on damaged text need not decode.
        except UnicodeDecodeError as error:
            raise self._damaged(str(error)) from error
        except sqlite3.Error as error:
            code = getattr(error, "sqlite_errorcode", None)
            if code in _DAMAGE:
                raise self._damaged(str(error)) from error
            text = f"{self._name}: the working file cannot be {action} ({error})"
            raise ArchiveError(text if self.call is None else f"{text}; {self.rest}") from error

    @property
    def rest(self) -> str:
        """Text on the results that are safe after a failure."""
        if self.path.exists():
            safe = f"{len(self.done)} of {self.n_sets} parameter sets are safe in"
            return f"{safe} {self.path.name!r}, the same call goes on with them"
        removed = repr(self.path.name) if self.path.parent.is_dir() else "the directory"
        return f"{removed} was removed, and with it all results; the same call starts anew"

    def _damaged(self, why: str) -> ArchiveError:
        return ArchiveError(
            f"{self._name}: the working file is damaged ({why}); remove it to start anew"
        )

    def _execute(self, command: str, values: tuple = ()) -> sqlite3.Cursor:
        assert self._connection is not None
        return self._connection.execute(command, values)

    def _entry(self, name: str, otherwise: bytes | None = None) -> bytes:
        """An entry, or ``otherwise`` where a file need not have it."""
        command = "SELECT value, checksum FROM about WHERE name=?"
        found = self._execute(command, (name,)).fetchone()
        if found is None and otherwise is not None:
            return otherwise
        value, checksum = found or (None, None)
        if not isinstance(value, bytes) or checksum != zlib.crc32(value, zlib.crc32(name.encode())):
            raise self._damaged(f"what it says about {name} is not as it was written")
        return value

    def _put(self, name: str, value: bytes) -> None:
        checksum = zlib.crc32(value, zlib.crc32(name.encode()))
        command = "INSERT OR REPLACE INTO about VALUES (?, ?, ?)"
        self._execute(command, (name, value, checksum))

    def _identify(self, call: bytes, n_sets: int) -> None:
        self.call, self.n_sets, self._origin = call, n_sets, zlib.crc32(call)

    def _checksum(self, number: int, layout: bytes, content: int) -> int:
        """Checksum of a row, which differs between sets and computations with equal results."""
        return zlib.crc32(layout, zlib.crc32(f"{number} {content} ".encode(), self._origin))

    def _check_row(self, number: int, layout: Any, content: Any, checksum: Any) -> None:
        if not isinstance(layout, bytes) or checksum != self._checksum(number, layout, content):
            raise self._row_damaged(number)

    def _row_damaged(self, number: int) -> ArchiveError:
        return self._damaged(f"parameter set {number} is not as it was written")

    def _count(self, number: int, layout: bytes, checksum: int) -> None:
        """Count a row of the file."""
        self._rows, self._total = self._rows + 1, self._total + checksum
        if number >= 0:
            self.done.add(number)
            self._layouts[layout] = min(number, self._layouts.get(layout, number))

    def begin(self, call: bytes, n_sets: int, blank: Encoded) -> None:
        """Write the call and the ``blank`` table of sets that are not computed."""
        assert self._connection is not None
        with self._reported("written"):
            self._identify(call, n_sets)
            try:
                self._connection.executescript(_SCHEMA)
                self._put("call", call)
                self._put("n_sets", str(n_sets).encode())
                self._put("holder", _this_process())
                self._execute(f"PRAGMA user_version={_FORMAT}")
                self._insert([(-1, blank)])
            except sqlite3.Error:
                self.call = None
                self.close()
                raise

    def add(self, encoded: Sequence[tuple[int, Encoded]], computed: bool = True) -> None:
        """Store the results of parameter sets, by number; on return they are safe on disk.

        ``computed`` by this process, or else taken from other files.
        """
        if not encoded:
            return
        with self._reported("written"):
            # One transaction waits for the disk once, however many rows it has.
            self._execute("BEGIN IMMEDIATE")
            if computed and not self._told:
                self.sessions.append(computed_here())
                self._put("sessions", json.dumps(self.sessions).encode())
                self._told = True
            self._insert(encoded)

    def add_sources(self, sources: list[dict[str, Any]]) -> None:
        """Store which parts were merged."""
        self.sources = sources
        with self._reported("written"):
            self._put("sources", json.dumps(sources).encode())

    def _insert(self, encoded: Sequence[tuple[int, Encoded]]) -> None:
        """Add rows, and end the transaction."""
        heads = []
        for number, (text, data) in encoded:
            layout, content = text.encode(), zlib.crc32(data)
            checksum = self._checksum(number, layout, content)
            row = number, layout, content, checksum, data
            self._execute("INSERT INTO results VALUES (?, ?, ?, ?, ?)", row)
            heads.append((number, layout, checksum))
        total = self._total + sum(checksum for *_, checksum in heads)
        self._put("rows", _counted(self._rows + len(heads), total))
        self._execute("COMMIT")
        for head in heads:
            self._count(*head)

    def layouts(self) -> Iterator[tuple[int, str]]:
        """The layouts of finished sets, each with the number of a set that has it."""
        return ((number, layout.decode()) for layout, number in self._layouts.items())

    def read(self, first: int, last: int) -> list[tuple[int, Encoded]]:
        """Finished sets with numbers from ``first`` to ``last``, in order; -1 is the blank one."""
        with self._reported("read"):
            rows = self._execute(
                "SELECT * FROM results WHERE number BETWEEN ? AND ? ORDER BY number", (first, last)
            ).fetchall()
        tables = {}
        for number, layout, content, checksum, data in rows:
            self._check_row(number, layout, content, checksum)
            if not isinstance(data, bytes) or content != zlib.crc32(data):
                raise self._row_damaged(number)
            # Another process may have added sets after the file was opened.
            if number in self.done or number == -1:
                tables[number] = layout.decode(), data
        for number in range(first, last + 1):
            if number in self.done and number not in tables:
                raise self._row_damaged(number)
        return [*tables.items()]

    def blocks(self) -> Iterator[list[tuple[int, Encoded]]]:
        """All finished sets in order, a few at a time."""
        for first in range(0, self.n_sets, _AT_ONCE):
            yield self.read(first, first + _AT_ONCE - 1)

    def remove(self) -> None:
        """Remove the file and release its lock."""
        if self._connection is not None:
            self._connection.close()
        self.path.unlink(missing_ok=True)
        self.path.with_name(f"{self.path.name}-journal").unlink(missing_ok=True)
        self.close()

    def close(self) -> None:
        """Close the file and release its lock."""
        if self._connection is not None:
            self._connection.close()
        if self._lock is not None:
            if self._lock.in_transaction:
                # Removed while locked: otherwise another process could lock a removed file.
                with suppress(OSError):
                    self.path.with_name(f"{self.path.name}-lock").unlink()
            self._lock.close()
        self._lock = self._connection = None

    def __enter__(self) -> "Store":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _this_process() -> bytes:
    since = time.strftime("%Y-%m-%d %H:%M:%S")
    holder = {"process": os.getpid(), "host": socket.gethostname(), "since": since}
    return json.dumps(holder).encode()


def computed_here() -> dict[str, str]:
    """What computes from now on: time, host, and the versions that results depend on."""
    about = {"since": time.strftime("%Y-%m-%dT%H:%M:%S%z"), "host": socket.gethostname()}
    packages = "symhbm", "casadi", "numpy", "scipy"
    return about | {name: version(name) for name in packages}


def _counted(rows: int, total: int) -> bytes:
    """The number of rows and the sum of their checksums."""
    return f"{rows} {total}".encode()
