"""Saving and loading of NetCDF archives, and rebuilding of the problems behind them."""

import json
import os
import tempfile
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from symhbm.balance import HarmonicBalance
from symhbm.continuation import Status
from symhbm.model.contacts import ContactLaw
from symhbm.model.records import NotRebuiltError
from symhbm.numerics import Table, check
from symhbm.results import parts, tables
from symhbm.results.archive.lazy import open_lazily
from symhbm.results.archive.seal import is_damaged, seal
from symhbm.results.archive.working_files import SUFFIX, ArchiveError, Store, working_file
from symhbm.results.problem import describe_problem
from symhbm.results.provenance import SCHEMA_VERSION, DatasetParts
from symhbm.results.schema import check_dataset, label, recall
from symhbm.results.variables import TEXTS

COMPRESSION: dict[str, Any] = {"zlib": True, "complevel": 4}


def save(dataset: xr.Dataset, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Write a dataset to a NetCDF file, whole or not at all, and return the path.

    Parameters
    ----------
    dataset
        What to write.
    path
        The file; a name without a suffix gets ``.nc``.
    overwrite
        Replace an existing file, once the new one is complete.

    Raises
    ------
    TypeError
        If ``dataset`` is no Dataset.
    FileExistsError
        If there is such a file and ``overwrite`` is False.
    ArchiveError
        If the file cannot be written; nothing is left behind. It is an OSError and a ValueError.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> sh.save(sh.frf(problem, (10, 30)), "blade").name
    'blade.nc'
    """
    check_dataset("dataset", dataset, unforced=True)
    overwrite = check.flag("overwrite", overwrite)
    _check_attributes(dataset)
    target = path_of(path)
    try:
        target = target if target.is_dir() else with_suffix(target)
        check_target(target)
        if target.exists() and not overwrite:
            raise FileExistsError(
                f"path={str(target)!r}: there is such a file; overwrite=True replaces it"
            )
        with draft_of(target) as draft:
            write(dataset, draft)
            seal(draft)
    except (ArchiveError, FileExistsError):
        raise
    except (OSError, RuntimeError, ValueError) as error:
        raise ArchiveError(f"path={str(target)!r}: cannot be written ({error})") from error
    return target


@contextmanager
def draft_of(path: Path) -> Iterator[Path]:
    """A file beside another one that takes its place once it is complete."""
    draft = path.with_name(f".symhbm-{os.getpid()}-{threading.get_ident()}.part")
    try:
        yield draft
        os.replace(draft, path)
    finally:
        draft.unlink(missing_ok=True)


def write(dataset: xr.Dataset, path: Path) -> None:
    """Write a dataset to a NetCDF file; a failure leaves a damaged file."""
    encoding = {
        str(name): dict(COMPRESSION)
        for name, variable in dataset.variables.items()
        if variable.ndim and variable.dtype.kind in "fib"
    }
    dataset.to_netcdf(path, engine="netcdf4", format="NETCDF4", encoding=encoding)


def load(path: str | os.PathLike[str], lazy: bool = False) -> xr.Dataset:
    """Read an archive.

    The working file of an interrupted one, ``<path>.partial``, gives what is finished; parameter
    sets that are not have NaN and the status `Status.NOT_STARTED`.

    Parameters
    ----------
    path
        A NetCDF file, or a working file; ``.nc`` may be left out.
    lazy
        Leave the numbers of a NetCDF file where they are until they are used; by default they are
        read into memory. The checksum of the whole file is compared first in either case (700 MB
        take 0.5 s, or as long as the disk takes to read them); a file that changes later raises
        ArchiveError where its numbers are used.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ArchiveError
        If the file is damaged, is no NetCDF file, or was not written by this library. It is an
        OSError and a ValueError.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> path = sh.save(sh.frf(problem, (10, 30)), "blade.nc")
    >>> sh.load(path).peak_frequency.values.round(3)
    array([19.374])
    """
    source = existing(path_of(path))
    lazy = check.flag("lazy", lazy)
    if not source.exists():
        raise FileNotFoundError(f"path={str(source)!r}: no such file{_progress_text(source)}")
    if source.name.endswith(SUFFIX):
        return finished_part(source)
    try:
        # NetCDF may never return from damaged bytes.
        if is_damaged(source):
            raise OSError("it is not as it was written")
        dataset = open_lazily(source) if lazy else xr.load_dataset(source, engine="netcdf4")
    except (OSError, RuntimeError, ValueError, KeyError, AttributeError, IndexError) as error:
        raise ArchiveError(f"path={str(source)!r}: damaged, or no NetCDF file ({error})") from error
    try:
        check_schema(dataset, f"path={str(source)!r}")
    except ArchiveError:
        dataset.close()
        raise
    for name, variable in dataset.variables.items():
        if variable.dtype.kind in "US" or (name in TEXTS and variable.dtype != object):
            dataset[name] = variable.astype(object)
    for variable in dataset.variables.values():
        variable.encoding = {}
    dataset.encoding = {}
    return dataset


def _progress_text(archive: Path) -> str:
    """Text on the working file of an archive that is not finished; empty without one."""
    file = working_file(archive)
    if not file.exists():
        return ""
    with Store(file, write=False) as store:
        if store.call is None:
            return f" yet, and nothing in {str(file)!r}"
        return (
            f" yet, {len(store.done)} of its {store.n_sets} parameter sets are finished: "
            f"symhbm.resume({str(archive)!r}) computes the others, "
            f"symhbm.load({str(file)!r}) gives those"
        )


def finished_part(file: Path) -> xr.Dataset:
    """What is finished of a working file; the other sets are padding with a status that says so."""
    with Store(file, write=False) as store:
        call = call_of(store)
        [(_, encoded)] = store.read(-1, -1)
        blank = tables.failed(tables.decode(*encoded), str(Status.NOT_STARTED))
        layouts = [encoded[0], *(layout for _, layout in store.layouts())]
        layout = tables.common(map(tables.stored_layout, layouts))
        results = tables.stack(_filled(store, blank), store.n_sets, layout)
        origin = origin_of(store, call)
    return label(DatasetParts.of(call), *recall(call), results).assign_attrs(origin)


def origin_of(store: Store, call: xr.Dataset) -> dict[str, str]:
    """Attributes that tell which parts were merged, and who computed a part."""
    if store.sources:
        resumed = [{"archive": None, "computed": store.sessions}] if store.sessions else []
        return {parts.MERGED: json.dumps([*store.sources, *resumed])}
    return {parts.COMPUTED: json.dumps(store.sessions)} if parts.PART in call.attrs else {}


def _filled(store: Store, blank: Table) -> Iterator[Table]:
    """The tables of all sets in order, a ``blank`` one for each that is not finished."""
    number = 0
    for rows in store.blocks():
        for finished, encoded in rows:
            yield from repeat(blank, finished - number)
            yield tables.decode(*encoded)
            number = finished + 1
    yield from repeat(blank, store.n_sets - number)


def call_of(store: Store) -> xr.Dataset:
    """The dataset without results that a working file was begun with."""
    if store.call is None:
        raise ArchiveError(f"path={str(store.path)!r}: nothing was stored yet; start anew")
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, "call.nc")
        copy.write_bytes(store.call)
        return load(copy)


def bytes_of(call: xr.Dataset) -> bytes:
    """A dataset without results as bytes of NetCDF; ArchiveError if NetCDF cannot hold it."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            return save(call, Path(folder, "call.nc")).read_bytes()
        except ArchiveError as error:
            raise ArchiveError(f"over: cannot be archived ({error.__cause__})") from error


def rebuild(dataset: xr.Dataset, laws: Iterable[ContactLaw] = ()) -> HarmonicBalance:
    """Rebuild the problem that a dataset of this library was computed from.

    Swept parameters have their nominal values; select one set first to get its values, as in
    ``rebuild(dataset.sel(normal_load=3))``. ``laws`` are the contact laws of your own: a dataset
    holds their names alone. Degrees of freedom of a structure that was condensed or reduced have
    the numbers they have along ``dof`` of the dataset; names of places stay.

    Raises
    ------
    TypeError
        If ``dataset`` is no Dataset, or one of the laws is none.
    ArchiveError
        If it does not describe a problem, or a contact law is missing.

    Examples
    --------
    >>> import symhbm as sh
    >>> blade = sh.single_blade(
    ...     mass=1, stiffness=1e4, damping=0.5,
    ...     contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3,
    ... )
    >>> problem = sh.HarmonicBalance(blade, sh.forces.PointForce())
    >>> loads = sh.frf(problem, (10, 30), over={"normal_load": [1, 3]})
    >>> again = sh.datasets.rebuild(loads.sel(normal_load=1))
    >>> again.parameters["normal_load"]
    array([1.])
    """
    check_dataset("dataset", dataset, unforced=True)
    check_schema(dataset, "dataset")
    for law in laws:
        if not isinstance(law, ContactLaw):
            raise TypeError(f"laws: expected contact laws, got {check.shown(law)}")
    try:
        return describe_problem(dataset, laws)
    except NotRebuiltError as error:
        raise ArchiveError(f"dataset: {error}") from error
    except (LookupError, AttributeError, TypeError, ValueError) as error:
        raise ArchiveError(
            f"dataset: the description of the problem is damaged ({error})"
        ) from error


def check_schema(dataset: xr.Dataset, source: str) -> None:
    """Raise ArchiveError unless ``dataset`` follows a schema this version can read."""
    number = dataset.attrs.get("symhbm_schema")
    if number is None:
        raise ArchiveError(
            f"{source}: not written by symhbm (the attribute symhbm_schema is missing)"
        )
    known = isinstance(number, (int, np.integer)) and number == SCHEMA_VERSION
    described = str(dataset.attrs.get("problem"))
    before = '"excitation"' in described and '"digest"' not in described  # the first release
    if not known or before:
        raise ArchiveError(
            f"{source}: symhbm_schema={number!r}{' of before the first release' * before}, this "
            f"version reads {SCHEMA_VERSION} alone; compute it again, or read it with the version "
            "that wrote it"
        )


def with_suffix(path: Path) -> Path:
    """The name of an archive, with ``.nc`` where it has no suffix; digits, as in 0.5, are none."""
    named = path.name and not path.suffix[1:2].isalpha()
    return path.with_name(f"{path.name}.nc") if named else path


def existing(path: Path) -> Path:
    """The path itself if an archive or its working file is there, else the path with ``.nc``."""
    if path.exists() or working_file(path).exists():
        return path
    return with_suffix(path)


def check_target(target: Path, name: str = "path") -> None:
    """Raise ArchiveError unless an archive of that name may be written."""
    if not target.name or target.is_dir() or not target.parent.is_dir():
        raise ArchiveError(
            f"{name}={str(target)!r}: expected a file name in an existing, writable directory"
        )
    if target.name.endswith(SUFFIX):
        raise ArchiveError(
            f"{name}={str(target)!r}: expected the name of the archive, without {SUFFIX!r}, the "
            "end of the name of a working file"
        )


def path_of(path: object, name: str = "path") -> Path:
    """The argument as a Path; TypeError that names it if it is no path."""
    try:
        return Path(path)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"{name}={check.shown(path)}: expected text or a path") from None


def _check_attributes(dataset: xr.Dataset) -> None:
    """Raise TypeError for attributes that NetCDF cannot hold as they are."""
    owners = {"dataset": dataset, **{f"dataset[{n!r}]": v for n, v in dataset.variables.items()}}
    for owner, holder in owners.items():
        for name, value in holder.attrs.items():
            simple = isinstance(value, (str, int, float, np.generic, np.ndarray))
            if not simple or np.asarray(value).dtype.kind not in "iufU":
                raise TypeError(
                    f"{owner}.attrs[{name!r}]={check.shown(value)}: expected text or real numbers"
                )
