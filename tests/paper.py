"""How far what is drawn is from what is true, on paper."""

import json

import numpy as np

import symhbm as sh

CLOSE = 0.3
"""Distance on paper [mm] that is allowed anywhere."""
N_VALUES = 2000


def level(amplitude):
    """What is drawn of amplitudes [dB re 1 m]."""
    return 20 * np.log10(amplitude)


def texts(ax):
    """What a legend says, nothing without one."""
    legend = ax.get_legend()
    return [] if legend is None else [text.get_text() for text in legend.get_texts()]


def on_paper(ax, x, y):
    """Places (n, 2) on paper [mm] of data, in the size that the figure has."""
    figure = ax.get_figure(root=True)
    figure.canvas.draw()
    return 25.4 * ax.transData.transform(np.column_stack([x, y])) / figure.dpi


def distances(points, corners):
    """Distance of each of some points (n, 2) from the straight lines between corners (m, 2)."""
    start, step = corners[:-1], np.diff(corners, axis=0)
    length = np.maximum((step**2).sum(axis=1), 1e-30)
    nearest = []
    for point in points:
        away = point - start
        share = np.clip((away * step).sum(axis=1) / length, 0, 1)
        nearest.append(np.hypot(*(away - share[:, None] * step).T).min())
    return np.array(nearest)


def farthest(ax, true, drawn):
    """Largest distance [mm] of two curves (x, y) within axes, from points of one to the other."""
    true, drawn = on_paper(ax, *true), on_paper(ax, *drawn)
    low, high = on_paper(ax, sorted(ax.get_xlim()), sorted(ax.get_ylim()))

    def seen(points):
        return points[np.all((points >= low - 1e-6) & (points <= high + 1e-6), axis=1)]

    return max(distances(seen(true), drawn).max(), distances(seen(drawn), true).max())


def exact(curve, values, problem=None):
    """Dataset of one curve of another at ascending values, solved for."""
    followed = json.loads(curve.attrs["followed"])
    problem = sh.datasets.rebuild(curve) if problem is None else problem
    options = dict(accuracy=curve.attrs.get("accuracy"), throw=True, progress=False)
    if followed["name"] == "frequency":
        return sh.frf(problem, followed["band"], values, **options)
    options |= dict(frequency=followed["frequency"])
    return sh.follow(problem, followed["name"], followed["band"], values, **options)


def values_of(line, curve, n_values):
    """Values over the axes of a line and those of its own corners, each once."""
    ax, x = line.axes, np.asarray(line.get_xdata(), dtype=float)
    name = json.loads(curve.attrs["followed"])["name"]
    low, high = float(np.nanmin(curve[name])), float(np.nanmax(curve[name]))
    left, right = np.clip(sorted(ax.get_xlim()), low, high)
    spread = np.geomspace if ax.get_xscale() == "log" else np.linspace
    values = np.clip(spread(left, right, n_values), left, right)
    values = np.union1d(values, x[(x >= left) & (x <= right)])
    return values[np.append(True, np.diff(values) > 1e-12 * values[1:])]


def off_paper(line, curve, dof=None, n_values=N_VALUES, problem=None):
    """Largest distance on paper [mm] between a drawn line and the response of a dataset.

    ``problem`` is that of the curve where the dataset does not hold it.
    """
    values = values_of(line, curve, n_values)
    amplitude = exact(curve, values, problem).amplitude.transpose(..., "dof").values
    shown = amplitude.max(axis=-1) if dof is None else amplitude[..., dof]
    assert np.isfinite(line.get_ydata()).all()
    return farthest(line.axes, (values, 20 * np.log10(shown)), line.get_data())


def long_lines(ax):
    """The lines of axes that are no marks."""
    return [line for line in ax.lines if len(line.get_xdata()) > 2]
