"""Springs and sliders marched over samples of a period, as an independent audit of their laws.

A march is of first order: others with fewer samples tell how far it is off.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from symhbm.model.contacts.law import ContactLaw
from symhbm.model.contacts.motions import Motions
from symhbm.numerics import FloatArray
from symhbm.numerics.loops import Loop

_SAMPLES = 8192
_SETTLED = 1e-12
"""Change of a force over a period, relative to its spring, that is none."""
_MOST_LAPS = 100
_ROUND_OFF = 1e-14
"""Error of a sum of forces, relative to its terms: at grazing, the force is not much more."""


class Marched(NamedTuple):
    """What contacts do over a period, (n,) each, and by how much that may be off.

    ``dissipation`` [J], ``open_fraction``, ``mean_normal_force``, ``least_normal_force`` and
    ``largest_normal_force`` [N].
    """

    dissipation: FloatArray
    open_fraction: FloatArray
    mean_normal_force: FloatArray
    least_normal_force: FloatArray
    largest_normal_force: FloatArray


@Loop
def _slide(pull, limit, most: int, settled: float) -> tuple[float, float]:
    """Work (over the stiffness of the spring) per period of a slider, and what may be left of it.

    ``pull`` (2, n) and ``limit`` (n,) are the spring's force at rest and the limit [N], at samples;
    where the limit is negative the contact is open. Laps alone settle slowly where slip is short:
    the derivative of a lap leads closer. Two forces never part over a lap, so that the work is off
    by the distance that is left times the path of the spring at most.
    """
    count = len(limit)
    x, y, size, path, before = 0.0, 0.0, 0.0, 0.0, np.inf
    for i in range(count):
        size = max(size, abs(pull[0, i]) + abs(pull[1, i]))
        path += np.hypot(pull[0, i] - pull[0, i - 1], pull[1, i] - pull[1, i - 1])
    work, left, farthest = 0.0, 0.0, 2 * max(limit.max(), 0.0)
    for _ in range(most):
        first_x, first_y, work = x, y, 0.0
        # The derivative of the force by that at the start of the lap.
        xx, xy, yx, yy = 1.0, 0.0, 0.0, 1.0
        for i in range(count):
            dx, dy = pull[0, i] - pull[0, i - 1], pull[1, i] - pull[1, i - 1]
            if limit[i - 1] < 0.0 < limit[i]:
                # It has closed in between: the spring remembers what it moved since.
                since = limit[i] / (limit[i] - limit[i - 1])
                dx, dy = dx * since, dy * since
            new_x, new_y, largest = x + dx, y + dy, max(limit[i], 0.0)
            force = np.hypot(new_x, new_y)
            if force > largest:
                share, cosine, sine = largest / force, new_x / force, new_y / force
                # What is along the force is lost.
                along_x = share * (cosine * yx - sine * xx)
                along_y = share * (cosine * yy - sine * xy)
                xx, xy = -sine * along_x, -sine * along_y
                yx, yy = cosine * along_x, cosine * along_y
                new_x, new_y = new_x * share, new_y * share
            work += 0.5 * ((x + new_x) * dx + (y + new_y) * dy)
            x, y = new_x, new_y
        step_x, step_y = x - first_x, y - first_y
        change = abs(step_x) + abs(step_y)
        determinant = (1 - xx) * (1 - yy) - xy * yx
        rests = change <= settled * size
        # The determinant is 0 where nothing slips: any force within the limit stays.
        left, ahead_x, ahead_y = 0.0 if rests else farthest, 0.0, 0.0
        if determinant > 0:
            ahead_x = ((1 - yy) * step_x + xy * step_y) / determinant
            ahead_y = ((1 - xx) * step_y + yx * step_x) / determinant
            left = min(np.hypot(ahead_x, ahead_y), farthest)
        if rests:
            break
        if left < farthest and change < 0.5 * before:
            x, y = first_x + ahead_x, first_y + ahead_y
        before = change
    return work, left * path


def marched(law: ContactLaw, at: Motions) -> tuple[Marched, Marched] | None:
    """March contacts that are springs and sliders along their motions; and the errors.

    None for other laws.
    """
    basis, motion, frequency, values = at
    sliders = law.spring_sliders(frequency, values)
    if sliders is None:
        return None
    names = law.directions
    each = np.moveaxis(motion.reshape(len(motion), len(names), -1), 1, 0)
    parts = dict(zip(names, each, strict=True))
    none = np.zeros((len(motion), basis.n_components))
    stiffness, normal, friction, load, _ = (np.asarray(of, dtype=float)[:, None] for of in sliders)
    found = []
    for count in (_SAMPLES // 4, _SAMPLES // 2, _SAMPLES):
        functions = basis.values(2 * np.pi * np.arange(count) / count).T
        pull = [stiffness * parts.get(name, none) @ functions for name in ("tangential", "across")]
        press = load + normal * parts.get("normal", none) @ functions
        force, limit, pull = np.maximum(press, 0.0), friction * press, np.stack(pull, axis=1)
        slid = [_slide(*one, _MOST_LAPS, _SETTLED) for one in zip(pull, limit, strict=True)]
        spring = np.where(stiffness > 0, stiffness, 1.0)[:, 0]
        work, left = np.array(slid).T / spring
        open_share = np.mean(force == 0, axis=1)
        figures = work, open_share, force.mean(axis=1)
        found.append(Marched(*figures, force.min(axis=1), force.max(axis=1)))
    # Halved steps halve the error, at least; differences may be small by chance, two hardly are.
    parts_of = [np.array(of) for of in found]
    before, last = (np.abs(a - b) for a, b in pairwise(parts_of))
    errors = 2 * np.maximum(before / 2, last)
    # Of a normal force what samples leave out between them has a bound.
    step, size = 2 * np.pi / _SAMPLES, np.abs(normal * parts.get("normal", none))
    noise = _ROUND_OFF * (np.abs(load[:, 0]) + size.sum(axis=1))
    path = 2 * np.pi * (np.abs(each) * basis.order).sum(axis=(0, 2))
    errors[0] += left + noise * (1 + friction[:, 0]) * path
    errors[1] += (2 * basis.highest + 1) / _SAMPLES
    errors[2:] += noise + step**2 * (size * basis.order**2).sum(axis=1)
    return found[-1], Marched(*errors)
