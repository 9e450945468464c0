"""How far what is drawn is from what is true, on paper."""

import json

import numpy as np

import symhbm as sh

MILLIMETRES = 25.4
N_VALUES = 2000
CLOSE = 0.3
"""Distance on paper [mm] that nobody sees."""


def on_paper(ax, x, y):
    """Places (n, 2) on paper [mm] of data, in the size that the figure has."""
    ax.figure.canvas.draw()
    return (
        ax.transData.transform(np.column_stack([x, y])) / ax.get_figure(root=True).dpi * MILLIMETRES
    )


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


def response_at(curve, values):
    """Amplitudes (n, n_dof) [m] of one curve of a dataset at ascending values, solved for."""
    followed = json.loads(curve.attrs["followed"])
    problem, options = sh.rebuild(curve), dict(throw=True, progress=False)
    if followed["name"] == "frequency":
        exact = sh.frf(problem, followed["band"], values, **options)
    else:
        options |= dict(frequency=followed["frequency"])
        exact = sh.follow(problem, followed["name"], followed["band"], values, **options)
    return exact.amplitude.values


def off_paper(line, curve, dof=None, n_values=N_VALUES):
    """Largest distance on paper [mm] between a drawn line and the response, from either to other.

    What lies outside of the axes is not seen. ``curve`` is the dataset of the response.
    """
    ax = line.axes
    x, y = (np.asarray(data, dtype=float) for data in line.get_data())
    assert np.isfinite(y).all()
    name = json.loads(curve.attrs["followed"])["name"]
    low, high = np.nanmin(curve[name]), np.nanmax(curve[name])
    left, right = np.clip(sorted(ax.get_xlim()), low, high)
    spread = np.geomspace if ax.get_xscale() == "log" else np.linspace
    values = np.clip(spread(left, right, n_values), left, right)
    values = np.union1d(values, x[(x >= left) & (x <= right)])
    # The same value twice, to round-off.
    values = values[np.append(True, np.diff(values) > 1e-12 * values[1:])]
    amplitude = response_at(curve, values)
    shown = amplitude.max(axis=1) if dof is None else amplitude[:, dof]
    true, drawn = on_paper(ax, values, 20 * np.log10(shown)), on_paper(ax, x, y)
    bottom, top = on_paper(ax, ax.get_xlim(), ax.get_ylim())

    def seen(points):
        return points[np.all((points >= bottom - 1e-6) & (points <= top + 1e-6), axis=1)]

    return max(distances(seen(true), drawn).max(), distances(seen(drawn), true).max())
