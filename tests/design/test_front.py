"""Fronts of two aims: closed forms of ends and points between, dominated points, archives."""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest

import symhbm as sh
from symhbm.continuation.status import Status
from symhbm.design.pareto import points as searched
from symhbm.design.pareto.front import certificate_of
from symhbm.design.pareto.points import BETWEEN, END, on_front
from symhbm.design.program import Aim
from tests.designs import BAND, BEST_AMPLITUDE, BEST_LOAD, blade, closed_peak, failing

BOUNDS = (0.5, 20.0)
AIMS = {
    "peak": lambda peaks, parameters: peaks["largest"],
    "load": lambda peaks, parameters: parameters["normal_load"][0],
}
DIGITS = 1e-10
"""Relative, of peaks that are solved for twice."""


def front_of(problem, bounds=BOUNDS, frequency_band=BAND, names="normal_load", **options):
    given = dict(aims=AIMS, n_points=5, progress=False) | options
    return sh.pareto_front(problem, names, bounds, frequency_band, **given)


@pytest.fixture(scope="module")
def front():
    return front_of(blade())


class TestOneBlade:
    def test_ends_are_the_optima_of_the_closed_form(self, front):
        assert front.front_kind.values.tolist() == ["end", *["between"] * 3, "end"]
        assert front.front_value[0].item() == pytest.approx(BEST_LOAD, rel=1e-8)
        assert front.front_aim[0, 0].item() == pytest.approx(BEST_AMPLITUDE, rel=DIGITS)
        assert front.front_value[-1].item() == pytest.approx(BOUNDS[0], rel=1e-15)
        expected = closed_peak(BOUNDS[0])
        assert front.front_aim[-1, 0].item() == pytest.approx(expected, rel=DIGITS)

    def test_points_between_are_on_the_closed_form_and_on_their_lines(self, front):
        peaks = [closed_peak(load) for load in front.front_value.values[:, 0]]
        assert front.front_aim.values[:, 0] == pytest.approx(peaks, rel=DIGITS)
        logarithms = np.log(front.front_aim.values)
        ranges = logarithms[0] - logarithms[-1]
        for place, at in zip(front.front_place.values, logarithms, strict=True):
            chord = (1 - place) * logarithms[0] + place * logarithms[-1]
            first, second = (at - chord) / np.abs(ranges)
            assert first == pytest.approx(second, abs=1e-9)  # both aims are equally far from it

    def test_all_is_told(self, front):
        assert front.status.item() == Status.FRONT_FOUND
        assert (front.front_optimality < 1e-8).all()
        text = front.certificate.item()
        assert "5 of 5 points are on the front of peak and load" in text
        assert "End at the optimum of peak: peak 0.0003082288" in text
        assert "Checked: each response was followed once more" in text
        assert "Not proved: that no design is better in both aims" in text
        assert front.sizes["removed"] == 0


@pytest.mark.slow
def test_of_several_optima_of_one_aim_the_end_is_the_best_in_the_other():
    """The peak depends on the product of load and friction, the other aim on the load alone."""
    bounds = {"normal_load": (0.5, 20.0), "friction_coefficient": (0.2, 0.8)}
    front = front_of(blade(), bounds, names=["normal_load", "friction_coefficient"], n_points=2)
    load, friction = front.front_value.values[0]
    assert front.front_aim[0, 0].item() == pytest.approx(BEST_AMPLITUDE, rel=1e-5)
    assert friction == pytest.approx(0.8)
    assert load == pytest.approx(BEST_LOAD * 0.5 / 0.8, rel=2e-3)  # a millionth of the peak
    assert front.front_value.values[-1] == pytest.approx([0.5, 0.8], rel=1e-6)


@pytest.mark.slow
def test_an_end_may_be_as_good_at_designs_around_it():
    """Below the resonances all loads that stick are the best; the least of them is, above."""
    low, high = (10.0, 17.0), (22.0, 30.0)
    front = front_of(
        blade(),
        (1.0, 50.0),
        [low, high],
        peaks={"low": {"frequency": low}, "high": {"frequency": high}},
        aims={"low": lambda peaks, _: peaks["low"], "high": lambda peaks, _: peaks["high"]},
        n_points=2,
    )
    assert front.status.item() == Status.FRONT_FOUND
    frequency = 2 * np.pi * low[1]
    stuck = 1 / abs(2e4 - frequency**2 + 0.5j * frequency)
    assert front.front_aim[0, 0].item() == pytest.approx(stuck, rel=2e-6)  # up to a millionth
    assert front.front_value[0].item() == pytest.approx(1e4 * stuck / 0.5, rel=1e-3)
    assert "which is as good at designs around it" in front.certificate.item()


def test_aims_that_agree_have_one_point():
    aims = {"peak": AIMS["peak"], "square": lambda peaks, _: peaks["largest"] ** 2}
    front = front_of(blade(), aims=aims)
    assert front.sizes["front"] == 1
    assert front.removed_reason.values.tolist() == ["the same as another point"]
    assert front.front_value.item() == pytest.approx(BEST_LOAD, rel=1e-8)


def point(found, aims, kind=BETWEEN, status=Status.DESIGN_OPTIMAL):
    return replace(found, aims=np.log(aims), kind=kind, status=status)


def test_dominated_equal_and_failed_points_are_removed_with_reasons(monkeypatch):
    found = []
    old = searched.on_front

    def kept(points):
        found.extend(points)
        return old(points)

    monkeypatch.setattr("symhbm.design.pareto.front.on_front", kept)
    front_of(blade(), n_points=2)
    one = found[0]
    points = [
        point(one, [1.0, 9.0], END),
        point(one, [2.0, 5.0]),
        point(one, [3.0, 6.0]),
        point(one, [2.0, 5.0 * (1 + 1e-9)]),
        point(one, [1.0, 9.0]),
        point(one, [4.0, 2.0], status=Status.DESIGN_STALLED),
        point(one, [9.0, 1.0], END),
        point(one, [5.0, 3.0]),  # A design that is removed itself removes no other.
        point(one, [2.0 * (1 - 5e-10), 6.0]),  # One as good in an aim, and worse in the other.
    ]
    reasons = [each.removed for each in on_front(points)]
    assert [bool(reason) for reason in reasons] == [0, 0, 1, 1, 1, 1, 0, 0, 1]
    assert reasons[2].startswith("dominated")
    assert reasons[3] == reasons[4] == "the same as another point"
    assert reasons[5] == str(Status.DESIGN_STALLED)
    aims = (Aim.of_peak(1), Aim.of_peak(1))
    text = certificate_of(on_front(points), aims, "")
    # [4, 2] is no optimum, and better than [5, 3], the fourth of those on the front.
    assert "are better in both aims than the points 3 of the front" in text
    del points[5]
    assert "are better in both aims" not in certificate_of(on_front(points), aims, "")
    flat = [point(one, [1.0, 9.0], END, Status.DESIGN_ON_PLATEAU), point(one, [9.0, 1.0], END)]
    assert not any(each.removed for each in on_front(flat))
    assert "as good at designs around it" in certificate_of(on_front(flat), aims, "")


def test_failures_are_told(monkeypatch):
    failing(monkeypatch, lambda load: load < 1.5)
    with pytest.warns(RuntimeWarning, match="could not be followed over the whole band"):
        front = front_of(blade(), (1.0, 20.0), n_points=3)
    assert front.n_failed > 0
    assert front.status.item() != Status.FRONT_FOUND
    with pytest.raises(sh.SolveError):
        front_of(blade(), (1.0, 20.0), n_points=3, throw=True)


class TestArchive:
    @pytest.mark.slow
    def test_it_goes_on_where_it_was_interrupted(self, front, tmp_path, monkeypatch):
        target = tmp_path / "front.nc"
        calls, best_of = [], searched.best_of

        def stopped(*arguments):
            calls.append(1)
            if len(calls) == 3:
                raise KeyboardInterrupt
            return best_of(*arguments)

        monkeypatch.setattr(searched, "best_of", stopped)
        with pytest.raises(KeyboardInterrupt) as caught:
            front_of(blade(), archive=target)
        assert "4 designs are kept in" in caught.value.__notes__[0]
        assert not target.exists()
        monkeypatch.setattr(searched, "best_of", best_of)
        resumed = front_of(blade(), archive=target)
        assert resumed.n_surveys < front.n_surveys
        assert resumed.front_aim.values == pytest.approx(front.front_aim.values, rel=1e-9)
        assert [path.name for path in tmp_path.iterdir()] == ["front.nc"]
        assert sh.load(target).identical(resumed)
        # A finished one is read.
        assert front_of(blade(), archive=target).identical(resumed)

    def test_one_of_another_call_is_refused(self, tmp_path):
        target = tmp_path / "front.nc"
        front_of(blade(), archive=target, n_points=2)
        for other in (dict(n_points=3), dict(bounds=(0.6, 20.0)), dict(frequency_band=(6.0, 40.0))):
            with pytest.raises(sh.datasets.ArchiveError, match="it is of another one"):
                front_of(blade(), archive=target, **other)


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        (dict(aims={"a": AIMS["peak"]}), TypeError, "aims=.*expected a mapping of two names"),
        (dict(aims=[1, 2]), TypeError, r"aims=\[1, 2\]: expected a mapping of two names"),
        (dict(aims={"a": 1, "b": 2}), TypeError, "^a=1: expected a function of peaks"),
        (dict(n_points=1), ValueError, "n_points=1: expected an integer >= 2"),
        (dict(n_starts=0), ValueError, "n_starts=0: expected an integer >= 1"),
    ],
)
def test_bad_input_is_named(options, error, words):
    with pytest.raises(error, match=words):
        front_of(blade(), **options)


def test_its_picture_has_all_points(front):
    figure = sh.plot.pareto_front(front)
    above = figure.axes[0].child_axes[0]
    drawn = np.concatenate([line.get_xydata() for line in above.lines[1:]])
    expected = front.front_aim.values[:, ::-1]
    assert np.sort(drawn, axis=0) == pytest.approx(np.sort(expected, axis=0))
    assert (above.get_ylabel(), figure.axes[0].child_axes[1].get_xlabel()) == ("peak", "load")
    plt.close(figure)
    with pytest.raises(TypeError, match="expected a result of pareto_front"):
        sh.plot.pareto_front(front.drop_vars("front_aim"))
