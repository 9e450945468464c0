"""Bad input raises at the boundary: with the argument's name, its value and what is allowed."""

import math
import pickle
import re
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import scipy.sparse as sp
import xarray as xr

import symhbm as sh
from symhbm.numerics import check

NAN, INF = float("nan"), float("inf")
NOT_NUMBERS = [NAN, INF, -INF, "1", None, 1j]
BAD_INPUT = (ValueError, TypeError, KeyError)
PARAMETERS = dict(
    mass=1.0,
    stiffness=1e4,
    damping=0.5,
    contact_stiffness=1e4,
    friction_coefficient=0.5,
    normal_load=3.0,
)
BAD_VALUES = [
    (name, value)
    for name in PARAMETERS
    for value in (*NOT_NUMBERS, -1.0)
    if (name, value) != ("damping", -1.0)  # air may drive a blade
]
RING = sh.bladed_disk(3, **PARAMETERS)
BLADE = sh.single_blade(**PARAMETERS)
PROBLEM = sh.HarmonicBalance(RING, sh.forces.EngineOrder(1))
BAND = (10.0, 11.0)
GIVEN = dict(contact_stiffness=1e4, friction_coefficient=0.5, normal_load=3.0)


@contextmanager
def refused(*words, kind=BAD_INPUT, allowed="expected|allowed|must be"):
    """The call raises before CasADi sees it; the message has the words and what is allowed."""
    with pytest.raises(kind, match=re.escape(words[0])) as caught:
        yield
    message = str(caught.value)
    missing = [word for word in words if word not in message]
    assert not missing, f"{missing} not in {message!r}"
    assert re.search(allowed, message), f"what is allowed is not in {message!r}"
    assert "casadi" not in message.lower()
    assert not any("casadi" in str(entry.path) for entry in caught.traceback)


def frf(**options):
    return sh.frf(PROBLEM, **{"band": BAND, "progress": False, **options})


def labelled(values, *dims, **coords):
    return xr.DataArray(values, dims=dims, coords=coords)


# Values that are bad by themselves: the message shows them behind the name of the argument

MATRICES = ("mass_matrix", "damping_matrix", "stiffness_matrix")
CONTACT = dict(contact_stiffness=1.0, friction_coefficient=1.0, normal_load=1.0)
PAIR = dict(contacts=[(0, 1), (0,)], **CONTACT)


def each(name: str, *values: Any) -> list[tuple[str, Any]]:
    return [(name, value) for value in values]


def of_each(names: Iterable[str], *values: Any) -> list[tuple[str, Any]]:
    return [pair for name in names for pair in each(name, *values)]


OF_CURVES = [
    *each("band", (10, 10), (0, 10), (-5, 10), (-10, -5), (NAN, 10), (10, NAN), (10, INF)),
    *each("band", (), (10,), 10, (10, 11, 12), [[10, 11]]),
    *each("band", ("10", "11"), "10-11", (10, None), None, (10, 11j)),
    *each("at", [9.9, 10.5], [10.5, 11.1], [10.5, 10.2], [10.2, 10.2], [-10.5], [0, 10.5]),
    *each("at", [], 10.5, [[10.2, 10.5]], [[10.2], [10.3, 10.4]]),
    *each("at", [10.5, NAN], [10.5, INF], ["10.5"], "10.5", [None], [10.5j]),
    *each("max_points", 1, 0, -5, 2.5, *NOT_NUMBERS, [10]),
]
OF_PROBLEMS = [
    *BAD_VALUES,
    *of_each(PARAMETERS, [1.0, 2.0]),
    ("mass", 0.0),
    *each("force_amplitude", *NOT_NUMBERS, [1.0]),
    *each("engine_order", *NOT_NUMBERS, 1.5, [1]),
]
OF_POINT_FORCES = [
    *each("place", -1, 0.5, *NOT_NUMBERS, [0]),
    *each("harmonic", 0, -1, 1.5, *NOT_NUMBERS, [1]),
    *of_each(["amplitude", "phase"], *NOT_NUMBERS, [1.0]),
]
OF_WAVES = [
    *each("harmonic", 0, -1, 1.5, "1", None, NAN),
    *each("amplitude", *NOT_NUMBERS, [1.0]),
]
OF_BASES = each(
    "harmonics", (), (0,), (-1, 1), (1.5,), (1, 1), (1, NAN), (None,), ("1",), (1j,), "1", "", 1,
    [[1]],
)  # fmt: skip
PATHS = each("path", None, 5, 1.5)
GIVEN_TO: dict[str, tuple[Callable[..., Any], list[tuple[str, Any]]]] = {
    "blade": (
        lambda **bad: sh.single_blade(**PARAMETERS | bad),
        BAD_VALUES + of_each(PARAMETERS, [1.0, 1.0]),
    ),
    "ring": (
        lambda **bad: sh.bladed_disk(3, **PARAMETERS | bad),
        [(name, [1.0, value, 1.0]) for name, value in BAD_VALUES],
    ),
    "number of blades": (
        lambda **bad: sh.bladed_disk(**PARAMETERS | bad),
        each("n_blades", 2, 1, 0, -3, 3.5, *NOT_NUMBERS, "3", [3], True),
    ),
    "contact": (
        lambda **bad: sh.Model(*[np.eye(2)] * 3, **PAIR | bad),
        of_each(CONTACT, *NOT_NUMBERS, -1.0, [1.0], [1.0] * 3)
        + each("cubic_stiffness", NAN, INF, "1", 1j, [1.0], [1.0] * 3),
    ),
    "problem": (PROBLEM.with_parameters, OF_PROBLEMS),
    "point force": (sh.forces.PointForce, OF_POINT_FORCES),
    "order": (sh.forces.EngineOrder, each("order", 1.5, -0.5, *NOT_NUMBERS, [1], True)),
    "wave": (lambda **bad: sh.forces.EngineOrder(1, **bad), OF_WAVES),
    "basis": (lambda **bad: sh.HarmonicBalance(RING, sh.forces.EngineOrder(1), **bad), OF_BASES),
    "point": (
        lambda **bad: sh.solve(PROBLEM, **bad),
        each("frequency", 0, -1.0, *NOT_NUMBERS, [10.0], [10.0, 20.0], []),
    ),
    "curve": (frf, OF_CURVES),
    "saving": (lambda path: sh.save(sh.solve(PROBLEM, 10.0), path), PATHS),
    "loading": (sh.load, PATHS),
}


@pytest.mark.parametrize(
    ("to", "name", "value"),
    [(to, *pair) for to, (_, pairs) in GIVEN_TO.items() for pair in pairs],
    ids=repr,
)
def test_bad_values_are_shown(to, name, value):
    with refused(f"{name}={value!r}"):
        GIVEN_TO[to][0](**{name: value})


@pytest.mark.parametrize(
    ("call", "given", "meant"),
    [
        (frf, dict(acuracy=1e-3), "accuracy"),
        (frf, dict(archiv="x.nc"), "archive"),
        (
            partial(sh.peak_curve, PROBLEM, "normal_load", (1, 9)),
            dict(frequency_ban=BAND),
            "frequency_band",
        ),
        (partial(sh.plot.response, sh.solve(PROBLEM, 10.0)), dict(plce=0), "place"),
    ],
)
def test_a_misspelt_keyword_is_told_the_one_that_is_meant(call, given, meant):
    [(name, value)] = given.items()
    with refused(f"{name}={value!r}: unexpected argument of", f"did you mean {meant!r}?"):
        call(**given)


# What does not go together, or is another thing: words that the message has


def model_with(name, matrix):
    matrices: dict[str, Any] = {other: np.eye(2) for other in MATRICES}
    return sh.Model(**matrices | {name: matrix})


BAD_MATRICES = [
    (np.ones((2, 3)), "(2, 3)"),
    (np.zeros((0, 0)), "(0, 0)"),
    ([1.0, 1.0], "(2,)"),
    (1.0, "()"),
    (np.ones((1, 2, 2)), "(1, 2, 2)"),
    (sp.csr_array(np.ones((2, 3))), "(2, 3)"),
    ([[1.0, NAN], [NAN, 1.0]], "nan"),
    (sp.csr_array([[INF, 0.0], [0.0, 1.0]]), "inf"),
    ([["1", "0"], ["0", "1"]], "'1'"),
    ([[1.0, 1j], [-1j, 1.0]], "1j"),
    (sp.csc_array([[1.0, 1j], [-1j, 1.0]]), "_matrix"),
    ([[1.0, 0.0], [0.0]], "[0.0]"),
    (None, "None"),
    ("matrix", "'matrix'"),
]
BAD_CONTACTS = [
    ([(0, 1), (1, 2)], "contacts[1]=2"),
    ([(-1, 0)], "contacts[0]=-1"),
    ([(2,)], "contacts[0]=2"),
    ([2], "contacts[0]=2"),
    ([0, 1], "contacts[0]=0: expected (first, second)"),
    ((0, 1), "contacts[0]=0: expected (first, second)"),
    ([(0, 0)], "contacts[0]=(0, 0)"),
    ([(1, 0), (1, 1.0)], "contacts[1]=(1, 1.0)"),
    ([(0, 1, 2)], "contacts[0]=(0, 1, 2)"),
    ([()], "contacts[0]=()"),
    ([(0, 0.5)], "contacts[0]=0.5"),
    ([(0, NAN)], "contacts[0]=nan"),
    ([(0, None)], "contacts[0]=None"),
    ([(0, 1j)], "contacts[0]=1j"),
    (["01"], "contacts[0]='0"),
    ("01", "contacts='01'"),
    (None, "contacts=None"),
    (1, "contacts=1"),
]
BAD_PLACES = [
    ([], "[]"), ([0, 1, 0], "[0, 1, 0]"), ([0, -1], "-1"), ([0, 0.5], "0.5"), ([0, NAN], "nan"),
    ([0, None], "None"), ("012", "'0"), (5, "5"),
]  # fmt: skip
BAD_FORCES = [
    (dict(), ["cosine={}", "sine={}"]),
    (dict(cosine=[1.0]), ["cosine=[1.0]", "mapping"]),
    (dict(sine=None), ["sine=None", "mapping"]),
    (dict(cosine={-1: [1.0]}), ["cosine", "-1"]),
    (dict(cosine={1.5: [1.0]}), ["cosine", "1.5"]),
    (dict(cosine={"1": [1.0]}), ["cosine", "'1'"]),
    (dict(sine={0: [1.0]}), ["sine", "0"]),
    (dict(cosine={1: [NAN]}), ["cosine[1]=[nan]"]),
    (dict(sine={1: ["1"]}), ["sine[1]=['1']"]),
    (dict(sine={1: None}), ["sine[1]=None"]),
    (dict(cosine={1: [1j]}), ["cosine[1]=[1j]"]),
    (dict(cosine={1: [[1.0, 2.0]]}), ["cosine[1]=[[1.0, 2.0]]"]),
    (dict(cosine={1: [1.0]}, amplitude=INF), ["amplitude=inf"]),
]
NOT_OF_A_RING = [
    (sh.forces.PointForce(place=3), ["place=3", "0 to 2"]),
    (sh.forces.EngineOrder(1, places=(0, 1, 3)), ["places=3", "0 to 2"]),
    (sh.forces.HarmonicForce(cosine={1: [1.0, 2.0]}), ["cosine[1]", "3", "2"]),
    (sh.forces.HarmonicForce(sine={1: [1.0] * 4}), ["sine[1]", "3", "4"]),
    (sh.forces.PointForce(harmonic=3), ["harmonics=(1, 2)", "3"]),
    (sh.forces.EngineOrder(1, harmonic=3), ["harmonics=(1, 2)", "3"]),
    (sh.forces.HarmonicForce(cosine={0: [1.0] * 3}), ["harmonics=(1, 2)", "0"]),
    (sh.forces.HarmonicForce(sine={1: [1.0] * 3, 4: [1.0] * 3}), ["harmonics=(1, 2)", "4"]),
]
MISSPELT = [
    ("normal_lod", "normal_load"),
    ("stifness", "stiffness"),
    ("friction", "friction_coeff"),
]
OTHER_NAMES = [("normal_lod", "normal_load"), ("amplitude", "force_amplitude"), ("Mass", "mass")]
EVERYTHING = [*PARAMETERS, "force_amplitude", "engine_order"]
BAD_SWEEPS = [
    *each("normal_load", *([1.0, value] for value in (-1.0, *NOT_NUMBERS))),
    *each("normal_load", "1", None, 1j, NAN, -1.0, {1: 2.0}),
    *[("mass", [1.0, 0.0]), ("stiffness", [-1.0]), ("force_amplitude", [NAN])],
    *each("engine_order", [1.0, 1.5], 0.5, [1, NAN], ["1"], labelled([1.5], "sample")),
    *each("normal_load", [[1.0, 2.0, 3.0]], [[1.0], [2.0, 3.0]], []),
    *each("normal_load", *(labelled(v, "sample") for v in ([1, -1], [1, NAN], ["1", "2"], [2j]))),
    ("normal_load", labelled([], "sample")),
]
BAD_DIMENSIONS = [
    ("normal_load", labelled([1.0, 2.0], "contact"), ["3", "2", "contact"]),
    ("stiffness", labelled(np.ones((2, 4)), "sample", "dof"), ["3", "4", "dof"]),
    ("normal_load", labelled([1.0] * 3, "dof"), ["dof"]),
    ("mass", labelled([1.0] * 3, "contact"), ["contact"]),
    ("force_amplitude", labelled([1.0] * 3, "dof"), ["dof"]),
    ("engine_order", labelled([1] * 3, "contact"), ["contact"]),
    ("normal_load", labelled([1.0] * 3, "contact", contact=[2, 1, 0]), ["contact"]),
    # Names that the result needs for something else.
    *(
        ("normal_load", labelled([1.0, 2.0], name), [name])
        for name in ("point", "frequency", "harmonic", "peak", "amplitude", "engine_order", "mass")
    ),
    ("normal_load", labelled([1.0], "s", amplitude=("s", [7.0])), ["amplitude"]),
]
SHORTER, LONGER = labelled([1.0, 2.0], "sample"), labelled([1e4, 2e4, 3e4], "sample")
ONE_ORDER, OTHER_ORDER = (
    labelled([1e4, 2e4], "sample", sample=order) for order in ([0, 1], [1, 0])
)
"""Pairing by position would pair what the labels say does not belong together."""
FORCE = sh.forces.PointForce()

Case = tuple[Callable[[], Any], list[str]]
UNFIT: list[Case] = [
    *(
        (partial(sh.bladed_disk, 3, **PARAMETERS | {name: value}), [f"{name}={value!r}", "3"])
        for name, value in of_each(PARAMETERS, [], [1.0], [1.0] * 2, [1.0] * 4, [[1.0] * 3])
    ),
    (lambda: sh.single_blade(**PARAMETERS | {"mass": 0}), ["mass=0", "> 0"]),
    (lambda: sh.bladed_disk(3, **PARAMETERS | {"mass": [1, 0, 1]}), ["mass=[1, 0, 1]", "> 0"]),
    *(
        (partial(model_with, name, matrix), [name, word])
        for name in MATRICES
        for matrix, word in BAD_MATRICES
    ),
    *(
        (partial(model_with, name, np.diag([-1.0, 1.0])), [name, "-1"])
        for name in ("mass_matrix", "stiffness_matrix")
    ),
    *((partial(model_with, name, np.eye(3)), ["_matrix", "(2, 2)", "(3, 3)"]) for name in MATRICES),
    (
        lambda: model_with("mass_matrix", [[1.0, 0.5], [0.0, 1.0]]),
        ["mass_matrix", "symmetric", "0.5"],
    ),
    *(
        (partial(sh.forces.EngineOrder, 1, places=places), [f"places={word}"])
        for places, word in BAD_PLACES
    ),
    *((partial(sh.forces.HarmonicForce, **given), words) for given, words in BAD_FORCES),
    *((partial(sh.HarmonicBalance, RING, force, (1, 2)), words) for force, words in NOT_OF_A_RING),
    *(
        (partial(sh.HarmonicBalance, value, FORCE), ["model=", "Model"])
        for value in (None, "ring", 1, PROBLEM, np.eye(3))
    ),
    *(
        (partial(sh.HarmonicBalance, RING, value), ["excitation=", "excitation"])
        for value in ("force", 1.0, np.ones(3), RING, sh.forces.PointForce)
    ),
    *(
        (partial(verb, value, at), ["problem=", "HarmonicBalance"])
        for verb, at in ((sh.solve, 10.0), (sh.frf, BAND))
        for value in (None, "problem", RING, xr.Dataset())
    ),
    *((partial(frf, over={name: value}), [name]) for name, value in BAD_SWEEPS),
]
UNKNOWN: list[Case] = [
    *(
        (
            partial(thing.with_parameters, **{name: 1.0}),
            [name, *PARAMETERS, f"did you mean '{nearest}"],
        )
        for thing in (RING, PROBLEM)
        for name, nearest in MISSPELT
    ),
    (
        lambda: sh.forces.EngineOrder(1).with_parameters(engine_ordr=2),
        ["engine_ordr", "force_amplitude", "did you mean 'engine_order'"],
    ),
    (lambda: FORCE.with_parameters(engine_order=2), ["engine_order", "force_amplitude"]),
    (
        lambda: model_with("mass_matrix", np.eye(2)).with_parameters(mass=1.0),
        ["mass", "contact_stiffness"],
    ),
    *(
        (partial(frf, over={name: [1.0]}), [name, *EVERYTHING, f"did you mean '{nearest}'"])
        for name, nearest in OTHER_NAMES
    ),
    *(
        (
            partial(
                frf, over=xr.Dataset({one: ("sample", [1.0]) for one in ("normal_load", name)})
            ),
            [name, *EVERYTHING],
        )
        for name, _ in OTHER_NAMES
    ),
    (lambda: frf(over={1: [1.0]}), ["1", *EVERYTHING]),
]
OF_ANOTHER_KIND: list[Case] = [
    *(
        (partial(frf, over=value), ["over=", "mapping"])
        for value in ("normal_load", 5, ["normal_load"], [("normal_load", [1.0])], SHORTER)
    ),
    *(
        (partial(frf, executor=value), ["executor=", "Executor"])
        for value in ("pool", 4, [], ThreadPoolExecutor)
    ),
    (lambda: frf(executer=2), ["executer=2", "did you mean 'executor'"]),
    (lambda: sh.nonlinear_modes(PROBLEM, verifiable=True), ["verifiable=True", "progress"]),
]
CASES = [
    *((*one, {}) for one in UNFIT),
    *((*one, dict(kind=KeyError)) for one in UNKNOWN),
    *((*one, dict(kind=TypeError)) for one in OF_ANOTHER_KIND),
    *(
        (
            partial(sh.Model, *[np.eye(2)] * 3, contacts=contacts),
            [word],
            dict(allowed="expected|joins two different DOFs"),
        )
        for contacts, word in BAD_CONTACTS
    ),
    *(
        (
            partial(frf, over={name: value}),
            ["over", name, *words],
            dict(allowed="expected|has no value per|one of the result's own"),
        )
        for name, value, words in BAD_DIMENSIONS
    ),
    (
        lambda: frf(over={"normal_load": SHORTER, "contact_stiffness": LONGER}),
        ["over", "contact_stiffness", "sample", "2", "3"],
        dict(allowed="elsewhere it has 2"),
    ),
    (
        lambda: frf(over={"normal_load": ONE_ORDER, "contact_stiffness": OTHER_ORDER}),
        ["over", "contact_stiffness", "sample"],
        dict(allowed="elsewhere|expected"),
    ),
]


@pytest.mark.parametrize(
    ("call", "words", "options"), CASES, ids=[words[0] for _, words, _ in CASES]
)
def test_what_does_not_fit_is_named(call, words, options):
    with refused(*words, **options):
        call()


@pytest.mark.parametrize("name", [*MATRICES, "contacts", "normal_load", "lumped", "anything"])
def test_model_cannot_be_changed(name):
    with pytest.raises(AttributeError, match=name):
        setattr(RING, name, 1.0)
    with pytest.raises(AttributeError, match=name):
        delattr(RING, name)


@pytest.mark.parametrize("name", PARAMETERS)
def test_parameter_arrays_cannot_be_written(name):
    with pytest.raises(ValueError, match="read-only"):
        RING.parameters[name][0] = 2.0


@pytest.mark.parametrize("name", MATRICES)
def test_matrices_cannot_be_written(name):
    with pytest.raises(ValueError, match="read-only"):
        getattr(RING, name)[0, 0] = 2.0


# Files


@pytest.fixture(scope="module")
def dataset():
    problem = sh.HarmonicBalance(BLADE, sh.forces.PointForce())
    return sh.frf(problem, (15, 25), over={"normal_load": [1.0, 3.0]}, progress=False)


@pytest.fixture
def folder(tmp_path, monkeypatch, dataset):
    """A working directory with an archive, another file and a directory in it."""
    monkeypatch.chdir(tmp_path)
    sh.save(dataset, "archive.nc")
    Path("file").write_text("text")
    Path("directory").mkdir()
    return tmp_path


def content(folder):
    return {path: path.is_file() and path.read_bytes() for path in sorted(folder.rglob("*"))}


@pytest.mark.parametrize("value", [None, "dataset", {}, xr.DataArray([1.0])], ids=lambda v: type(v))
def test_dataset_of_the_wrong_type(folder, value):
    with refused("dataset=", "Dataset", kind=TypeError):
        sh.save(value, "new.nc")
    with refused("dataset=", "Dataset", kind=TypeError):
        sh.datasets.rebuild(value)
    assert not Path("new.nc").exists()


@pytest.mark.parametrize(
    "path",
    [
        *["missing/new.nc", "file/new.nc", "file/in/new.nc", "directory", "directory/.."],
        *["", ".", "..", "/", "x" * 300],
    ],
    ids=lambda path: path[:20] or "empty",
)
def test_path_that_cannot_be_written(folder, dataset, path):
    before = content(folder)
    with refused(
        "path=", path[:70], kind=sh.datasets.ArchiveError, allowed="expected|cannot be written"
    ):
        sh.save(dataset, path, overwrite=True)
    assert content(folder) == before


@pytest.mark.parametrize("name", ["new.nc", "archive.nc"])
@pytest.mark.parametrize(
    "error", [OSError(28, "No space left on device"), RuntimeError("NetCDF: HDF error")], ids=repr
)
def test_write_that_fails(folder, dataset, monkeypatch, name, error):
    """Nothing half-written is left, and the archive that was there still is."""

    def fail(self, path, **options):
        Path(path).write_bytes(b"half an archive")
        raise error

    before = content(folder)
    monkeypatch.setattr(xr.Dataset, "to_netcdf", fail)
    with refused(f"path={name!r}", kind=sh.datasets.ArchiveError, allowed="cannot be written"):
        sh.save(dataset, name, overwrite=True)
    assert content(folder) == before


@pytest.mark.parametrize("name", ["new.nc", "archive.nc"])
def test_full_disk(folder, dataset, name):
    """No patch: the operating system refuses to let the file grow."""
    resource = pytest.importorskip("resource")
    large = dataset.assign(noise=("entry", np.random.default_rng(0).normal(size=200_000)))
    before = content(folder)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limits[1]))
    try:
        with refused(f"path={name!r}", kind=sh.datasets.ArchiveError, allowed="cannot be written"):
            sh.save(large, name, overwrite=True)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert content(folder) == before


def test_write_that_is_interrupted(folder, dataset, monkeypatch):
    def interrupt(self, path, **options):
        Path(path).write_bytes(b"half an archive")
        raise KeyboardInterrupt

    before = content(folder)
    monkeypatch.setattr(xr.Dataset, "to_netcdf", interrupt)
    with pytest.raises(KeyboardInterrupt):
        sh.save(dataset, "archive.nc", overwrite=True)
    assert content(folder) == before


@pytest.mark.parametrize(
    "value", [None, {}, {"a": 1}, True, np.True_, 1j, np.complex128(1j)], ids=repr
)
@pytest.mark.parametrize("of_variable", [False, True])
def test_attribute_that_netcdf_cannot_hold(folder, dataset, value, of_variable):
    broken = dataset.copy(deep=True)
    (broken.amplitude if of_variable else broken).attrs["remark"] = value
    before = content(folder)
    with refused("remark", repr(value)):
        sh.save(broken, "archive.nc", overwrite=True)
    assert content(folder) == before


DAMAGED = "damaged|no NetCDF file"


def test_missing_file(folder):
    with refused("path='missing.nc'", kind=FileNotFoundError, allowed="no such file"):
        sh.load("missing.nc")


@pytest.mark.parametrize("size", [0, 1, 8, 5000])
def test_file_of_random_bytes(folder, size):
    Path("random.nc").write_bytes(np.random.default_rng(size).bytes(size))
    with refused("path='random.nc'", kind=sh.datasets.ArchiveError, allowed=DAMAGED):
        sh.load("random.nc")


@pytest.mark.parametrize("share", [0.0, 1e-3, 0.01, 0.1, 0.5, 0.9, 0.999])
def test_truncated_archive(folder, share):
    whole = Path("archive.nc").read_bytes()
    Path("cut.nc").write_bytes(whole[: int(share * len(whole))])
    with refused("path='cut.nc'", kind=sh.datasets.ArchiveError, allowed=DAMAGED):
        sh.load("cut.nc")


def test_archive_without_its_last_byte(folder):
    Path("cut.nc").write_bytes(Path("archive.nc").read_bytes()[:-1])
    with refused("path='cut.nc'", kind=sh.datasets.ArchiveError, allowed=DAMAGED):
        sh.load("cut.nc")


@pytest.mark.parametrize("n_bytes", [1, 50])
def test_archive_with_damaged_bytes(folder, n_bytes):
    whole = np.frombuffer(Path("archive.nc").read_bytes(), np.uint8)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        damaged = whole.copy()
        damaged[rng.integers(0, whole.size, n_bytes)] ^= rng.integers(1, 256, n_bytes, np.uint8)
        Path("damaged.nc").write_bytes(damaged.tobytes())
        with refused("path='damaged.nc'", kind=sh.datasets.ArchiveError, allowed=DAMAGED):
            sh.load("damaged.nc")


def test_archive_that_another_program_changed(folder):
    """It is read as any NetCDF file, without the checksum it was written with."""
    before = sh.load("archive.nc")
    Path("changed.nc").write_bytes(Path("archive.nc").read_bytes())
    with netCDF4.Dataset("changed.nc", "a") as file:
        file.setncattr("note", "seen")
    assert sh.load("changed.nc").attrs["note"] == "seen"
    xr.testing.assert_equal(sh.load("changed.nc"), before)


@pytest.mark.parametrize("path", ["directory", "file", "."])
def test_path_that_cannot_be_read(folder, path):
    with refused(f"path={path!r}", kind=sh.datasets.ArchiveError, allowed=DAMAGED):
        sh.load(path)


def test_foreign_file(folder, dataset):
    xr.Dataset({"a": ("x", [1.0, 2.0])}).to_netcdf("foreign.nc")
    with refused(
        "path='foreign.nc'", kind=sh.datasets.ArchiveError, allowed="not written by symhbm"
    ):
        sh.load("foreign.nc")
    with refused("dataset", kind=sh.datasets.ArchiveError, allowed="not written by symhbm"):
        sh.datasets.rebuild(xr.Dataset())


@pytest.mark.parametrize("number", [99, 0, "banana"], ids=repr)
def test_unknown_schema(folder, dataset, number):
    foreign = dataset.assign_attrs(symhbm_schema=number)
    foreign.to_netcdf("foreign.nc")
    with refused("path='foreign.nc'", str(number), kind=sh.datasets.ArchiveError, allowed="schema"):
        sh.load("foreign.nc")
    with refused("dataset", str(number), kind=sh.datasets.ArchiveError, allowed="schema"):
        sh.datasets.rebuild(foreign)


@pytest.mark.parametrize("name", ["problem", "swept"])
@pytest.mark.parametrize("text", [None, "{", "5"])
def test_description_that_is_damaged(dataset, name, text):
    broken = dataset.copy()
    del broken.attrs[name]
    if text is not None:
        broken.attrs[name] = text
    with refused("dataset", kind=sh.datasets.ArchiveError, allowed="description"):
        sh.datasets.rebuild(broken)


@pytest.mark.parametrize("name", ["mass", "contact_stiffness", "normal_load_nominal"])
def test_parameter_that_is_missing(dataset, name):
    with refused("dataset", name, kind=sh.datasets.ArchiveError, allowed="description"):
        sh.datasets.rebuild(dataset.drop_vars(name))


@pytest.mark.parametrize("value", ["no", 0, 1])
def test_stability_is_a_flag(value):
    problem = sh.HarmonicBalance(
        sh.single_blade(
            mass=1,
            stiffness=1e4,
            damping=0.5,
            contact_stiffness=1e4,
            friction_coefficient=0.5,
            normal_load=1,
        ),
        sh.forces.PointForce(amplitude=1.0),
    )
    for call in (
        lambda: sh.frf(problem, (10, 20), stability=value),
        lambda: sh.solve(problem, 20.0, stability=value),
        lambda: sh.follow(problem, "normal_load", (1, 2), frequency=20.0, stability=value),
    ):
        with pytest.raises(TypeError, match="stability"):
            call()


def test_parameters_are_set_by_with_parameters_alone():
    for owner in (BLADE, PROBLEM):
        with refused("parameters['normal_load']", "with_parameters(normal_load=", kind=TypeError):
            owner.parameters["normal_load"] = 5.0
    assert pickle.loads(pickle.dumps(BLADE.parameters)) == BLADE.parameters


def test_of_many_names_the_nearest_are_told():
    names = [f"name_{i}" for i in range(40)] + ["amplitude"]
    with refused("'amplitud'", "did you mean 'amplitude'?", "41 names") as _:
        check.known("amplitud", names)
    with refused("allowed: none"):
        check.known("k", [])


def test_other_spelling_of_a_name():
    with pytest.raises(AttributeError) as caught:
        _ = sh.FRF
    assert (caught.value.name, caught.value.obj) == ("FRF", sh)  # of which Python tells the nearest


def test_what_was_meant_is_told():
    """Obvious wrong input whose error names the right one."""
    with refused("band=", "at= asks for given ones"):
        frf(band=np.linspace(10, 11, 5))
    damper = sh.Friction(
        tangential=[(0,)], contact_stiffness=1e4, friction_coefficient=0.5, normal_load=1
    )
    with refused("contacts=", 'a group has a name, as in {"damper": group}'):
        sh.Model([[1.0]], [[1.0]], [[1e4]], contacts=damper)  # type: ignore[arg-type]
    with refused("bounds=", "scipy.optimize.Bounds"):
        names, bounds = ["normal_load", "stiffness"], [(1, 2), (1e4, 2e4)]
        sh.minimise_peak(PROBLEM, names, bounds, BAND)
    stop = sh.laws.SmoothLaw(lambda y, v, p: p["k"] * y, {"k": (1e3, "N/m")}, [(0,)])
    model = sh.Model([[1.0]], [[1.0]], [[1e4]], contacts={"stop": stop})
    with refused("'k'", "designed=True"):
        sh.minimise_peak(sh.HarmonicBalance(model, sh.forces.PointForce()), "k", (1, 2), BAND)
    with refused("'c' is no parameter", "has k", allowed="has k"):
        sh.laws.SmoothLaw(lambda y, v, p: p["c"] * y, {"k": (1e3, "N/m")}, [(0,)])

    class Worn(sh.laws.Coulomb):
        parameters = sh.laws.Coulomb.parameters | {"wear": "1"}

    with refused("parameters['wear']='1'", "symhbm.laws.Parameter"):
        sh.Contacts(
            Worn(), [(0,)], contact_stiffness=1, friction_coefficient=1, normal_load=1, wear=0
        )
    with pytest.raises(ValueError, match="in the place of math"):
        sh.laws.SmoothLaw(lambda y, v, p: p["k"] * math.tanh(y), {"k": (1e3, "N/m")}, [(0,)])
    point = [(dof,) for dof in range(3)]
    whole = sh.Model(np.eye(3), np.eye(3), 1e4 * np.eye(3), contacts=point, **GIVEN)
    with pytest.raises(ValueError, match=r"take all 3 degrees of freedom.*solve the structure"):
        sh.condense(whole, sh.forces.PointForce(), BAND)
