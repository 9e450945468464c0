"""`read_structure`: a structure from the files of a finite-element program."""

import os
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import scipy.sparse as sp

from symhbm.model.cyclic import RotatingModel
from symhbm.model.files import arrays, hdf5
from symhbm.model.files.checks import accounted, found_units
from symhbm.model.files.contents import KINDS, LOOK, Contents, Reader, in_si, units_of
from symhbm.model.files.programs import abaqus, ansys, calculix, nastran
from symhbm.model.files.several import damping_of, joined, rotating
from symhbm.model.files.table import read_places
from symhbm.model.files.traps import completed, doubt_units, without_supports
from symhbm.model.matrices import Model
from symhbm.numerics import check

_WORDS = {
    "mass": ("mass", "m"),
    "damping": ("damping", "damp", "dmpv", "c"),
    "stiffness": ("stiffness", "stiff", "stif", "k"),
}
"""Ends of the names of files of one matrix each."""
_READERS: dict[str, Reader] = {
    ".npz": arrays.read_npz,
    ".mat": arrays.read_mat,
    ".h5": hdf5.read,
    ".hdf5": hdf5.read,
    ".nc": hdf5.read,
    **dict.fromkeys((".op4", ".op2", ".bdf", ".nas"), nastran.read),
    ".inp": calculix.read,
    **dict.fromkeys((".full", ".cdb", ".rst"), ansys.read),
}
_ADVICE = {".hb": "Harwell-Boeing; write Matrix Market instead, as *EXPORT,...,MMF of Ansys does"}
_ADVICE |= dict.fromkeys((".rsa", ".rua", ".matrix", ".harwell"), _ADVICE[".hb"])
_SI = "m-kg-s"


def read_structure(
    path: Any,
    *,
    names: Mapping[str, str] | None = None,
    places: Any = None,
    labels: Mapping[str, Any] | None = None,
    units: str | None = None,
    symmetric: bool = False,
    damping: Any = None,
) -> Model:
    """Read a structure from the files of a finite-element program, without contacts.

    Parameters
    ----------
    path
        One file with all matrices, ``.npz``, ``.mat`` up to version 7, ``.h5``, Ansys ``.full``
        (``pip install symhbm[ansys]``) with ``.cdb`` or ``.rst`` beside it, Nastran ``.op4`` or
        ``.op2`` (``symhbm[nastran]``) with the bulk data beside it. Matrices in one file each,
        Matrix Market or Abaqus ``.mtx`` or `scipy.sparse.save_npz`, have names that end in
        ``_stiffness``, ``_mass`` and ``_damping``, as ``sector_stiffness.mtx``, in ``_STIF2``,
        ``_MASS2`` and ``_DMPV2``, or are ``k.mtx``, ``m.mtx`` and ``c.mtx``: one of them tells the
        others, ``sector.mtx`` all. Or ``{"mass": path, "stiffness": path}``.
        The deck of a job of CalculiX, ``.inp``, with what it wrote beside it, or a list of several
        jobs of one mesh: matrices at rest or at a speed, and natural modes that the program
        computed. An archive of `save_structure`, ``.nc`` or ``.h5``.
    names
        What matrices are called in a file of several, ``{"stiffness": "KAA", ...}``, unless M, C
        and K, mass, damping and stiffness, or MAA, BAA and KAA.
    places
        Table of the degrees of freedom in the order of the file: a file of comma-separated values
        or columns by name, ``node``, ``direction``, ``x``, ``y``, ``z``, ``label``; the mesh
        ``.msh`` of gmsh (``symhbm[gmsh]``); or `symhbm.Places`. Without directions a line is a
        node. Coordinates have the unit of length.
    labels
        Names of nodes, ``{"tip": 1207, "root": [3, 4, 5]}``.
    units
        Length, mass and time of the file, ``"mm-t-s"``, ``"mm-kg-ms"``, ``"in-lbf-s"``; SI is made
        of them. By default those in which the materials of a deck are metals, else SI.
    symmetric
        The matrices are symmetric, and one triangle of them may stand for both.
    damping
        Damping in the place of that of the file, as of `Model`: a `ModalDamping` for example, or a
        matrix [N s/m].

    Returns
    -------
    A `Model` in SI units. One warning says what was done to the matrices: units changed,
    triangles completed, degrees of freedom dropped that are supports (1e36 on the diagonal of the
    stiffness) or have rows of zeros, those without mass or stiffness, asymmetry, and a lowest
    natural frequency below 0.01 or above 1e6 Hz, which wrong units have; matrices that are there
    and were not read, and how many directions each node was given. Without a damping matrix
    there is no damping. Of more than 20,000 degrees of freedom the frequency is not solved for.

    Of the files of a program ``places`` have its mesh, what else it told, and an account of all of
    it, ``places.program.account``; its doubts are warned of, too. Matrices at several speeds make
    a `RotatingModel`.

    Raises
    ------
    FileNotFoundError, ValueError
        For files that are not there, truncated or of another kind, in one line; for a missing mass
        or stiffness, a triangle without ``symmetric``, shapes that differ, and unknown units.
    KeyError
        For unknown names of matrices, columns and nodes.
    ImportError
        For files of Ansys, Nastran and gmsh without the package that reads them.

    Examples
    --------
    >>> import tempfile, scipy.io, scipy.sparse as sp
    >>> import symhbm as sh
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     scipy.io.mmwrite(f"{folder}/rod_mass.mtx", sp.eye_array(3))
    ...     scipy.io.mmwrite(f"{folder}/rod_stiffness.mtx", 1e4 * sp.eye_array(3))
    ...     places = dict(node=[7, 7, 7], direction=["x", "y", "z"])
    ...     rod = sh.read_structure(f"{folder}/rod.mtx", places=places)
    >>> rod.number_of("7:z")
    2
    """
    several = path if isinstance(path, (list, tuple)) else [path]
    parts = [_contents(each, names or {}) for each in several]
    of_program = [part.program is not None for part in parts]
    if len(parts) > 1 and not all(of_program):
        raise ValueError(f"path={check.shown(path)}: expected one path, or jobs of one program")
    if all(of_program):
        parts = joined([*map(Path, several)], parts)
    options = dict(places=places, labels=labels, units=units, symmetric=symmetric, damping=damping)
    made = [_structure(path, part, **options) for part in parts]
    if told := [note for _, notes in made for note in dict.fromkeys(notes)]:
        check.warn(f"{_shown(path)}: {'; '.join(dict.fromkeys(told))}")
    models = [model for model, _ in made]
    if parts[0].rotation is not None:
        return RotatingModel(models[0], *parts[0].rotation)
    return models[0] if len(models) == 1 else rotating(models)


def _structure(
    path: Any,
    contents: Contents,
    *,
    places: Any,
    labels: Mapping[str, Any] | None,
    units: str | None,
    symmetric: bool,
    damping: Any,
) -> tuple[Model, list[str]]:
    """A model of what files hold, and what is to be said of it."""
    notes: list[str] = []
    found = found_units(contents.program)
    if units is None and found not in (None, _SI):
        notes.append(f"units={found!r} found by the material")
    units = units or found or _SI
    system = units_of(units)
    matrices = contents.matrices
    for kind in ("mass", "stiffness"):
        if kind not in matrices:
            there = f"{' and '.join(matrices) or 'none that is known'} alone"
            beside = f"; not read: {', '.join(contents.beside)}; names= says what it is called"
            raise ValueError(
                f"path={check.shown(path)}: expected a {kind} matrix, there is {there}"
                f"{beside if contents.beside else ''}"
            )
    n_dof = matrices["stiffness"].shape[0]
    for kind, matrix in matrices.items():
        if matrix.shape[0] != n_dof:
            raise ValueError(
                f"{kind}: expected {n_dof} rows as the stiffness, got {matrix.shape[0]}"
            )
    matrices.setdefault("damping", sp.csc_array((n_dof, n_dof)))
    if contents.beside:
        notes.append(f"not read: {', '.join(contents.beside)}")
    known = contents.places
    if known is not None and contents.mesh is not None:
        known = replace(known, mesh=contents.mesh, program=contents.program)
    known = read_places(places, known, n_dof, notes.append)
    if labels is not None:
        if known is None:
            raise ValueError("labels: expected places=, the file does not tell nodes")
        known = known.labelled(labels)
    contents = completed(contents._replace(places=known), symmetric, notes.append)
    contents = without_supports(contents, notes.append)
    if units != _SI:
        if contents.damping is not None:
            raise ValueError(f"units={units!r}: expected {_SI!r}, this is a structure saved in SI")
        contents = in_si(contents, system)
        assumed = ", all degrees of freedom taken as displacements" if known is None else ""
        notes.append(f"{units} changed to SI{assumed}")
    doubt_units(contents, units, notes.append)
    of_kind, known = contents.matrices, contents.places
    program = None if known is None else known.program
    given = of_kind["damping"] if contents.damping is None else contents.damping
    if program is not None:
        given = damping_of(program.materials) or given
    given = given if damping is None else damping
    model = Model(of_kind["mass"], given, of_kind["stiffness"], places=known)
    if program is None or contents.program is None:
        return model, [*contents.notes, *notes]
    notes = [*contents.notes, *notes]
    model, doubts = accounted(model, notes)
    return model, [*(note.removeprefix(LOOK) for note in notes), *doubts]


def _contents(path: Any, names: Mapping[str, str]) -> Contents:
    """Everything that the files hold."""
    for kind in names:
        check.known(kind, KINDS, "kind of matrices")
    files, left = _files(path)
    of_reader: dict[Reader, dict[str, Path]] = {}
    for kind, file in files.items():
        of_reader.setdefault(_reader(file), {})[kind] = file
    if len(of_reader) > 1 and abaqus.read in of_reader:
        raise ValueError("path: expected matrices of Abaqus in all files or in none")
    parts = [reader(of, names) for reader, of in of_reader.items()]
    if len(parts) == 1:
        return parts[0]._replace(beside=(*left, *parts[0].beside))
    matrices = {kind: matrix for part in parts for kind, matrix in part.matrices.items()}
    known = next((part.places for part in parts if part.places is not None), None)
    left += [name for part in parts for name in part.beside]
    damping = next((part.damping for part in parts if part.damping is not None), None)
    return Contents(matrices, known, any(part.triangle for part in parts), tuple(left), damping)


def _files(path: Any) -> tuple[dict[str, Path], list[str]]:
    """Files by the kind of their matrix, ``""`` for one with several, and names of others."""
    if isinstance(path, Mapping):
        for kind in path:
            check.known(str(kind), KINDS, "kind of matrices")
        return {str(kind): _existing(Path(file)) for kind, file in path.items()}, []
    if not isinstance(path, (str, os.PathLike)):
        raise TypeError(f"path={check.shown(path)}: expected a path, or paths by kind of matrix")
    file = Path(path)
    suffix = file.suffix.lower()
    if suffix not in (".mtx", ".npz"):
        _reader(file)  # what cannot be read says so before it is looked for
        return {"": _existing(file)}, []
    if suffix == ".npz" and file.exists() and not arrays.is_one_matrix(file):
        return {"": file}, []
    return _beside(file)


def _beside(file: Path) -> tuple[dict[str, Path], list[str]]:
    """The files of one matrix each that go with one of them, or with what they have in common.

    And the names of files that begin as they do, of no known kind.
    """
    found: dict[str, Path] = {}
    left: list[str] = []
    base = (_kind_of(file.stem) or (file.stem, ""))[0]
    for other in sorted(file.parent.glob(f"*{file.suffix}")):
        other_base, kind = _kind_of(other.stem) or (None, "")
        if other_base is None and base and re.match(re.escape(base) + r"[_.\-]", other.stem):
            left.append(other.name)
        if other_base != base:
            continue
        if kind in found:
            raise ValueError(
                f"path={str(file)!r}: {found[kind].name} and {other.name} are both {kind}; give "
                "{'mass': path, 'stiffness': path}"
            )
        found[kind] = other
    if not found or (file.exists() and file not in found.values()):
        _existing(file)
        raise ValueError(
            f"path={str(file)!r}: of which matrix? expected a name that ends in _mass, _damping or "
            "_stiffness, or {'mass': path, 'stiffness': path}"
        )
    return found, left


def _kind_of(stem: str) -> tuple[str, str] | None:
    """What the name of a file has in common with others, and the kind of its matrix."""
    parts = re.fullmatch(r"(.*?)[_.\-]?([A-Za-z]+)\d*", stem)
    if parts is None:
        return None
    for kind, words in _WORDS.items():
        if parts[2].lower() in words:
            return parts[1], kind
    return None


def _reader(file: Path) -> Reader:
    suffix = file.suffix.lower()
    if suffix == ".mtx":
        with _existing(file).open("rb") as head:
            market = head.read(len(arrays.MATRIX_MARKET)) == arrays.MATRIX_MARKET
        return arrays.read_matrix_market if market else abaqus.read
    if suffix not in _READERS:
        advice = _ADVICE.get(suffix, f"expected one of .mtx, {', '.join(_READERS)}")
        raise ValueError(f"path={str(file)!r}: {advice}")
    return _READERS[suffix]


def _existing(file: Path) -> Path:
    if not file.is_file():
        raise FileNotFoundError(f"path={str(file)!r}: no such file")
    return file


def _shown(path: Any) -> str:
    return ", ".join(map(str, path.values())) if isinstance(path, Mapping) else str(path)
