"""Parts of a sweep: the sets of one job; merged, they are the archive of one job, bit by bit."""

import json
import os
import warnings
from functools import cache

import numpy as np
import pytest
import xarray as xr

import symhbm as sh
from symhbm.continuation.correctors import programs
from symhbm.numerics.c_library import COMPILER
from symhbm.results.archive import merging
from symhbm.results.archive.working_files import working_file
from tests.archives import assert_same, counted, interrupt
from tests.quick import quick_first

VALUES = dict(mass=1.0, stiffness=1e4, damping=0.5, friction_coefficient=0.5)
RING = sh.HarmonicBalance(
    sh.bladed_disk(3, contact_stiffness=1e6, normal_load=10, **VALUES), sh.forces.EngineOrder(1)
)
BLADE = sh.HarmonicBalance(
    sh.single_blade(contact_stiffness=1e4, normal_load=3, **VALUES), sh.forces.PointForce()
)
DRAWS = sh.mistuning.uniform(RING, 5, seed=1, contact_stiffness=0.2, normal_load=0.3)
NAMED = DRAWS.assign_coords(origin=("sample", list("abcde")))
BAND, GRID = (160.0, 260.0), [170.0, 190.0, 210.0, 230.0]
LOADS = [0.5, 1.0, 3.0, 500.0]

CALLS = {
    "path": (sh.frf, (RING, BAND), dict(over=NAMED)),
    "grid": (sh.frf, (RING, BAND), dict(over=DRAWS, at=GRID)),
    "kept": (sh.frf, (RING, BAND), dict(over=DRAWS, at=GRID, keep=["amplitude"])),
    "list": (sh.frf, (BLADE, (18, 21)), dict(over={"normal_load": LOADS})),
    "product": (
        sh.frf,
        (BLADE, (18, 21)),
        dict(over={"damping": [0.5, 0.7], "normal_load": LOADS}),
    ),
    "accuracy": (sh.frf, (BLADE, (18, 21)), dict(over={"normal_load": LOADS}, accuracy=0.02)),
    "follow": (
        sh.follow,
        (BLADE, "normal_load", (0.5, 100)),
        dict(frequency=19.5, over={"damping": [0.5, 0.7, 0.9]}),
    ),
    "modes": (
        sh.nonlinear_modes,
        (sh.HarmonicBalance(BLADE.model, harmonics=(1,)),),
        dict(band=(1e-5, 1e-3), over={"normal_load": [1.0, 3.0, 5.0]}),
    ),
}


def call(name, **options):
    verb, arguments, given = CALLS[name]
    return verb(*arguments, **given | {"progress": False} | options)


@pytest.fixture(autouse=True)
def _one_evaluator(monkeypatch):
    """Results tell what evaluates the equations: the same throughout, however many curves."""
    programs._programs.cache_clear()
    monkeypatch.setenv(COMPILER, "")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Archives of parts, computed once: ``made("path", (1, 3))``; of one job without a part."""

    @cache
    def archive(name, part=None):
        folder = tmp_path_factory.mktemp("made")
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv(COMPILER, "")
            call(name, archive=folder / "x.nc", part=part).close()
        return folder / "x.nc"

    return archive


def merge(paths, *arguments, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return sh.datasets.merge(paths, *arguments, progress=False, **options)


def same(one, other):
    assert_same(sh.load(other), sh.load(one))


@pytest.fixture
def interrupted(tmp_path):
    """The second of two parts, with one of its three samples."""
    interrupt(1, call, "grid", archive=tmp_path / "two.nc", part=(2, 2))
    return tmp_path / "two.nc"


@pytest.mark.parametrize("name", quick_first(CALLS, 2))
def test_merged_parts_are_the_archive_of_one_job(name, made, tmp_path):
    parts = [made(name, (k, 2)) for k in (2, 1)]
    with merge(parts, tmp_path / "all") as result:
        told = json.loads(result.attrs["merged_from"])
    assert [entry["archive"] for entry in told] == ["x.nc", "x.nc"]
    assert all(entry["computed"][0]["host"] and entry["symhbm_version"] for entry in told)
    assert os.listdir(tmp_path) == ["all.nc"]
    same(made(name), tmp_path / "all.nc")


def test_a_product_is_parted_along_either_dimension(made, tmp_path):
    """The longer one by itself, the other by its name; also both at once."""
    first, second = made("product", (1, 2)), made("product", (2, 2))
    assert dict(sh.load(first).status.sizes) == {"damping": 2, "normal_load": 2}
    of_damping = tmp_path / "damping.nc"
    call("product", archive=of_damping, part={"damping": range(0, 1)}).close()
    assert dict(sh.load(of_damping).status.sizes) == {"damping": 1, "normal_load": 4}
    with pytest.warns(RuntimeWarning, match=r"6 of 8 .* missing: 6 to 7 of the product of damping"):
        sh.datasets.merge([of_damping, first], tmp_path / "some.nc", progress=False)
    parts = [tmp_path / "some.nc", second]
    merge(parts, tmp_path / "all.nc", unfinished=True).close()
    same(made("product"), tmp_path / "all.nc")


def test_a_part_is_a_result_by_itself(made):
    """With the samples of the whole, their labels, and who computed it."""
    whole, part = sh.load(made("path")), sh.load(made("path", (2, 2)))
    assert part.sample.values.tolist() == [2, 3, 4]
    assert part.origin.values.tolist() == ["c", "d", "e"]
    for name in ("contact_stiffness", "normal_load", "status", "peak_amplitude"):
        values = whole[name].isel(sample=slice(2, 5)).values[tuple(map(slice, part[name].shape))]
        np.testing.assert_array_equal(part[name].values, values)
    assert json.loads(part.attrs["computed"])[0]["numpy"] == np.__version__
    parameters = sh.datasets.rebuild(part.isel(sample=0)).parameters
    np.testing.assert_array_equal(parameters["normal_load"], DRAWS.normal_load.values[2])
    kinds = ("points", "peaks", "events", "sets")
    for kind in kinds:
        of_part = sh.datasets.table(part, kind)
        of_whole = sh.datasets.table(whole, kind).query("sample >= 2").reset_index(drop=True)
        xr.testing.assert_equal(of_part.to_xarray(), of_whole.to_xarray())


DRAWN = {
    "uniform": sh.mistuning.uniform,
    "truncated_normal": sh.mistuning.truncated_normal,
    "lognormal": sh.mistuning.lognormal,
}


@pytest.mark.parametrize("sampling", quick_first(["sobol", "random", "latin_hypercube"], 1))
@pytest.mark.parametrize("law", quick_first(DRAWN, 1))
def test_samples_are_the_same_whatever_the_parts(law, sampling, tmp_path):
    """Each job draws anew, as it would alone: with correlations, and by every kind of sampling."""

    def draws():
        options = dict(correlation=1.5, between={("contact_stiffness", "normal_load"): 0.5})
        spreads = dict(contact_stiffness=0.2, normal_load=0.1)
        return DRAWN[law](RING, 4, seed=3, sampling=sampling, **options, **spreads)

    def job(**options):
        keep = ["amplitude"]
        return sh.frf(RING, BAND, at=[200.0], over=draws(), keep=keep, progress=False, **options)

    parts = [tmp_path / f"{k}.nc" for k in (1, 2, 3)]
    for k, path in enumerate(parts, 1):
        job(part=(k, 3), archive=path).close()
        own = sh.load(path)
        np.testing.assert_array_equal(own.normal_load, draws().normal_load.sel(sample=own.sample))
    job(archive=tmp_path / "one.nc").close()
    merge(parts, tmp_path / "all.nc").close()
    same(tmp_path / "one.nc", tmp_path / "all.nc")


@pytest.mark.slow
def test_an_interrupted_part_goes_on(interrupted, made, tmp_path):
    """By the same call or from its file; another part of the same sweep is refused there."""
    with pytest.raises(sh.datasets.ArchiveError, match="of another computation, different in part"):
        call("grid", archive=interrupted, part=(1, 2))
    interrupt(1, call, "grid", archive=interrupted, part=(2, 2))
    with sh.resume(interrupted, progress=False) as part:
        assert len(json.loads(part.attrs["computed"])) == 3
    merge([made("grid", (1, 2)), interrupted], tmp_path / "all.nc").close()
    same(made("grid"), tmp_path / "all.nc")


def test_missing_parts_are_told_and_can_be_computed(made, tmp_path):
    path = tmp_path / "all.nc"
    with pytest.warns(RuntimeWarning, match="3 of 5 .* missing: 0 to 1 of sample, counted from 0"):
        result = sh.datasets.merge([made("grid", (2, 2))], path, progress=False)
    assert result.status.values[:2].tolist() == [str(sh.Status.NOT_STARTED)] * 2
    assert os.listdir(tmp_path) == ["all.nc.partial"]
    with pytest.MonkeyPatch.context() as patch:
        counted(patch, stop=2)
        with sh.resume(path, progress=False) as whole:
            told = json.loads(whole.attrs["merged_from"])
    assert [entry["archive"] for entry in told] == ["x.nc", None]
    assert told[0]["parameter_sets"] == "2 to 4"
    same(made("grid"), path)


def test_the_same_call_without_a_part_goes_on_with_what_was_merged(made, tmp_path):
    with pytest.warns(RuntimeWarning, match="missing"):
        sh.datasets.merge([made("grid", (2, 2))], tmp_path / "all.nc", progress=False)
    with pytest.MonkeyPatch.context() as patch:
        counted(patch, stop=2)
        call("grid", archive=tmp_path / "all.nc").close()
    same(made("grid"), tmp_path / "all.nc")


def test_unfinished_parts_are_told_or_asked_for(interrupted, made, tmp_path):
    parts = [made("grid", (1, 2)), interrupted]
    for second in (interrupted, working_file(interrupted)):
        with pytest.raises(
            sh.datasets.ArchiveError, match=r"two\.nc'.* 1 of its 3 .* unfinished=True"
        ):
            merge([parts[0], second], tmp_path / "all.nc")
        with pytest.warns(RuntimeWarning, match="3 of 5 .* missing: 3 to 4 of sample"):
            result = sh.datasets.merge([parts[0], second], unfinished=True, progress=False)
        assert int((result.status == str(sh.Status.NOT_STARTED)).sum()) == 2
    assert sorted(os.listdir(tmp_path)) == ["two.nc.partial", "two.nc.partial-journal"]


@pytest.mark.slow
def test_parts_may_overlap(made, tmp_path):
    """Sets of equal values count once; where one differs, it is named."""
    extra = tmp_path / "extra.nc"
    call("path", archive=extra, part=range(1, 4)).close()
    merge([made("path", (1, 2)), extra, made("path", (2, 2))], tmp_path / "all.nc").close()
    same(made("path"), tmp_path / "all.nc")
    other = sh.load(extra)
    other["peak_amplitude"][1, 0] *= 1 + 1e-15
    sh.save(other, tmp_path / "other.nc")
    paths = [made("path", (1, 2)), made("path", (2, 2)), tmp_path / "other.nc"]
    with pytest.raises(sh.datasets.ArchiveError) as caught:
        merge(paths, tmp_path / "new.nc")
    words = f"other.nc': at sample=2 its peak_amplitude is not that of {str(paths[1])!r}; one"
    assert words in str(caught.value)
    assert not (tmp_path / "new.nc").exists()


OTHERS = {
    "normal_load": dict(over=DRAWS.assign(normal_load=DRAWS.normal_load * (1 + 1e-15))),
    "frequency": dict(at=[*GRID[:-1], 231.0]),
    "peaks": dict(peaks="each"),
    "sample": dict(over=DRAWS.isel(sample=slice(4))),
}


@pytest.mark.parametrize("what", OTHERS)
def test_other_computations_are_refused_by_name(what, made, tmp_path):
    call("grid", archive=tmp_path / "two.nc", part=(2, 2), **OTHERS[what]).close()
    text = rf"1 of 2 parts .*two\.nc'.* of another computation than .*different in .*{what}"
    with pytest.raises(sh.datasets.ArchiveError, match=text):
        merge([made("grid", (1, 2)), tmp_path / "two.nc"], tmp_path / "all.nc")
    assert os.listdir(tmp_path) == ["two.nc"]


@pytest.mark.parametrize("package", ["symhbm", "casadi"])
def test_other_versions_are_refused_by_name(package, made, tmp_path):
    for name in ("attribute", "session"):
        part = sh.load(made("grid", (2, 2)))
        if name == "attribute":
            part.attrs[f"{package}_version"] = "9.9"
        else:
            text = json.loads(part.attrs["computed"])
            part.attrs["computed"] = json.dumps([text[0] | {package: "9.9"}])
        path = sh.save(part, tmp_path / f"{name}.nc")
        with pytest.raises(
            sh.datasets.ArchiveError, match=rf"different in {package}_version \(.*9\.9"
        ):
            merge([made("grid", (1, 2)), path], tmp_path / "all.nc")


def test_damaged_parts_are_all_told(made, tmp_path):
    whole = made("grid", (1, 2)).read_bytes()
    for number in range(3):
        damaged = bytearray(whole)
        damaged[len(damaged) // 2 + number] ^= 1
        (tmp_path / f"{number}.nc").write_bytes(damaged)
    (tmp_path / "cut.nc").write_bytes(whole[: len(whole) // 2])
    paths = [made("grid", (2, 2)), *sorted(tmp_path.iterdir()), tmp_path / "none.nc"]
    with pytest.raises(sh.datasets.ArchiveError, match="5 of 6 parts cannot be merged") as caught:
        merge(paths, tmp_path / "all.nc")
    for name in ("0.nc", "1.nc", "2.nc", "cut.nc", "none.nc"):
        assert f"{name}'" in str(caught.value)
    assert not (tmp_path / "all.nc").exists()


def test_a_part_that_was_changed_is_refused(made, tmp_path):
    part = sh.load(made("grid", (2, 2)))
    changed = part.assign(normal_load=part.normal_load * 2)
    cases = {
        "its normal_load is not that of the whole": changed,
        "its contact_stiffness is not that": part.isel(sample=slice(2)),
        "without amplitude": part.drop_vars("amplitude"),
        "no part of a sweep": sh.load(made("grid")),
    }
    for text, dataset in cases.items():
        path = sh.save(dataset, tmp_path / "x.nc", overwrite=True)
        with pytest.raises(sh.datasets.ArchiveError, match=text):
            merge([path])


@pytest.mark.slow
def test_files_that_are_there_are_not_replaced_without_a_word(made, tmp_path):
    path, parts = tmp_path / "all.nc", [made("grid", (1, 2)), made("grid", (2, 2))]
    path.write_text("precious")
    with pytest.raises(FileExistsError, match=r"there is 'all\.nc', overwrite=True replaces it"):
        merge(parts, path)
    with pytest.raises(sh.datasets.ArchiveError, match="not replaced by one with gaps"):
        sh.datasets.merge(parts[:1], path, overwrite=True, progress=False)
    assert path.read_text() == "precious"
    merge(parts, path, overwrite=True).close()
    same(made("grid"), path)
    with pytest.warns(RuntimeWarning, match="missing"):
        sh.datasets.merge(parts[:1], tmp_path / "gap.nc", progress=False)
    with pytest.raises(FileExistsError, match=r"gap\.nc\.partial', overwrite.*resume"):
        merge(parts, tmp_path / "gap.nc")
    with pytest.raises(sh.datasets.ArchiveError, match="another name than that of a part"):
        merge([*parts, tmp_path / "gap.nc.partial"], tmp_path / "gap.nc", unfinished=True)
    merge(parts, tmp_path / "gap.nc", overwrite=True).close()
    assert sorted(os.listdir(tmp_path)) == ["all.nc", "gap.nc"]


@pytest.mark.parametrize(
    "name", ["a b\nc.nc", "ä?#%41.nc", "-o '; DROP.nc", "x" * 240 + ".nc", "0.5"]
)
def test_strange_names_are_names(name, made, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    parts = [f"1{name}", f"2{name}"]
    for k, part in enumerate(parts, 1):
        os.link(made("grid", (k, 2)), part)
    with merge(parts, name) as result:
        assert [entry["archive"] for entry in json.loads(result.attrs["merged_from"])] == parts
    same(made("grid"), name)


@pytest.mark.parametrize(
    ("arguments", "kind", "text"),
    [
        (dict(archives="x.nc"), TypeError, "archives='x.nc': expected a sequence of paths"),
        (dict(archives=[]), ValueError, "archives: expected at least one part"),
        (dict(archives=[3]), TypeError, "archives=3: expected text or a path"),
        (dict(archives=["no.nc"]), FileNotFoundError, r"path='no.nc': no such file"),
        (
            dict(archives=["x.nc"], path="a.partial"),
            sh.datasets.ArchiveError,
            "name of the archive",
        ),
        (
            dict(archives=["x.nc"], path="no/a.nc"),
            sh.datasets.ArchiveError,
            "existing, writable directory",
        ),
        (dict(archives=["x.nc"], unfinished=1), TypeError, "unfinished=1: expected True or False"),
    ],
)
def test_bad_arguments_of_merge(arguments, kind, text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(kind, match=text):
        sh.datasets.merge(**arguments)
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(
    ("part", "kind", "text"),
    [
        ((0, 2), ValueError, r"k of part=0: expected an integer from 1 to 2"),
        ((3, 2), ValueError, r"k of part=3: expected an integer from 1 to 2"),
        ((1, 6), ValueError, r"n of part=6: expected an integer from 1 to 5"),
        (range(3, 6), ValueError, r"within the 5 values along 'sample'"),
        (range(3, 3), ValueError, r"part=range\(3, 3\): expected a range"),
        (range(0, 4, 2), ValueError, r"steps of 1"),
        (3, TypeError, r"part=3: expected \(k, n\)"),
        ({"sampel": range(1)}, KeyError, "sample"),
        ({"sample": (1, 2)}, TypeError, "expected"),
        ({}, ValueError, "expected one dimension"),
    ],
)
def test_bad_parts(part, kind, text):
    with pytest.raises(kind, match=text):
        call("grid", part=part)


def test_parts_need_a_sweep_and_names_of_their_own():
    with pytest.raises(ValueError, match=r"part=\(1, 2\): expected None where no parameter"):
        sh.frf(BLADE, (18, 21), part=(1, 2))
    named = DRAWS.assign_coords(whole_sample=("sample", np.arange(5)))
    with pytest.raises(ValueError, match="expected a name other than 'whole_sample'"):
        sh.frf(RING, BAND, at=GRID, over=named, part=(1, 2))


def test_statistics_grow_with_what_is_there(interrupted, made):
    """They say how many samples are missing, and of all samples they are those of one job."""
    tuned = sh.frf(RING, BAND, at=GRID, progress=False)
    with pytest.warns(RuntimeWarning, match="missing"):
        some = sh.datasets.merge(
            [made("grid", (1, 2)), interrupted], unfinished=True, progress=False
        )
    there = sh.load(made("grid")).isel(sample=slice(3))
    s, factors = sh.statistics, lambda data: sh.statistics.amplification(data, tuned)
    for statistic in (
        factors,
        s.envelope,
        s.localisation,
        lambda data: s.convergence(factors(data)),
        lambda data: s.position(factors(data), 1.2),
    ):
        partial, expected = statistic(some), statistic(there)
        counts = "n_used", "n_failed", "n_missing"
        assert [int(partial[count]) for count in counts] == [3, 0, 2]
        assert [int(expected[count]) for count in counts] == [3, 0, 0]
        for variable in expected.drop_vars("n_missing"):
            values = partial[variable]
            values = values.isel(sample=slice(3)) if "sample" in values.dims else values
            np.testing.assert_array_equal(values.values, expected[variable].values, variable)
    worst = sh.statistics.worst(some, tuned)
    assert int(worst.sample) in (0, 1, 2)
    empty = some.isel(sample=slice(3, None))
    with pytest.raises(ValueError, match="0 failed, 2 are not computed"):
        sh.statistics.worst(empty, tuned)


@pytest.mark.slow
def test_many_parts_do_not_fill_the_memory(tmp_path):
    """200 parts: the memory that merging takes is that of few sets, as is that of one part."""
    import tracemalloc

    n, keep = 200, ["amplitude"]
    draws = sh.mistuning.uniform(RING, 2 * n, seed=1, normal_load=0.3)
    part = sh.frf(RING, BAND, at=GRID, over=draws, keep=keep, part=(1, n), progress=False)
    peaks = {}
    for count in (20, n):
        paths = []
        for k in range(1, count + 1):
            of_part = range(2 * k - 2, 2 * k)
            load = part.whole_normal_load.values[of_part.start : of_part.stop]
            own = part.assign(normal_load=part.normal_load.copy(data=load))
            own = own.assign_coords(sample=("sample", [*of_part], part.sample.attrs))
            told = dict(dim="sample", first=of_part.start, stop=of_part.stop, size=2 * n)
            own = own.assign_attrs(part=json.dumps(told))
            paths.append(sh.save(own, tmp_path / f"{count}-{k}.nc"))
        tracemalloc.start()
        merging.merged(paths, tmp_path / f"all-{count}.nc", progress=False)
        peaks[count] = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peaks[n] < 1.5 * peaks[20] + 1e6
