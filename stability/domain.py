"""Where the models are measured: every range to its ends, removable singularities with their neighbours, hard directions."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..angles import unit_vectors
from ..models import Parameter

Reals = NDArray[np.float64]

GRAZING = float(np.radians(89.995))
NEAR = tuple(s * 10.0**e for e in (-15, -12, -9, -6, -3) for s in (1, -1))
"""Offsets from a removable singularity."""


@dataclass(frozen=True)
class Range:
    """The values of one argument from ``low`` to ``high``, evenly spread in the logarithm if ``log``.

    ``special`` are values at which a formula as printed is 0/0; ``usual`` is the value while another argument is varied.
    """

    low: float
    high: float
    usual: float
    log: bool = True
    special: tuple[float, ...] = ()

    def grid(self, n: int) -> Reals:
        """``n`` values from end to end."""
        return np.geomspace(self.low, self.high, n) if self.log else np.linspace(self.low, self.high, n)

    def draw(self, rng: np.random.Generator, n: int) -> Reals:
        """``n`` values: six of ten from the range, two its ends, two a special value or a neighbour of one."""
        spread = rng.uniform(0, 1, n)
        values = self.low * (self.high / self.low) ** spread if self.log else self.low + (self.high - self.low) * spread
        ends = rng.choice([self.low, self.high], n)
        near = rng.choice([0.0, *NEAR], n) + rng.choice(self.special or (self.usual,), n)
        kind = rng.uniform(0, 1, n)
        least = min(self.low, *self.special) if self.special else self.low
        return np.clip(np.where(kind < 0.6, values, np.where(kind < 0.8, ends, near)), least, self.high)


_TILT = {"low": -1.5, "high": 1.5}
CHANGES: dict[str, dict[str, dict[str, Any]]] = {
    "gtr": {"alpha": {"special": (1.0,)}, "gamma": {"special": (1.0,)}},
    "sgd": {
        "p": {"special": (0.0, 1.0, 2.0, 7.0)},
        # F_sgd crosses zero for larger f1, and there no digit of the value is left by subtraction
        "f0": {"low": 0.05, "high": 1, "usual": 0.05},
        "f1": {"low": -0.04, "high": 0.04, "usual": 0.01},
    },
    "abc": {"b": {"low": 1e-8}, "c": {"special": (0.0, 1.0, 2.0)}},
    "epd": {"p": {"special": (1.0,)}},
    "student_t": {"gamma": {"special": (2.0,)}},
    # where cylinders touch, the slope by their spacing has a kink at normal incidence
    "poulin_fournier": {"spacing": {"low": 2.01}},
    # off the axis of Phong's lobe, where the largest coefficient changes; and at a tilt of 90 degrees the cosine of a lobe
    # seen at normal incidence is 0 but for rounding
    "lafortune": {"tilt": {**_TILT, "usual": 0.9}},
    "lafortune2": {"tilt_1": {**_TILT, "usual": 0.9}, "tilt_2": {**_TILT, "usual": -0.7}},
    "lafortune3": {"tilt_1": {**_TILT, "usual": 0.9}, "tilt_2": {**_TILT, "usual": -0.7}, "tilt_3": {**_TILT, "usual": 0.5}},
}
"""By model or block and parameter: in what its range differs from what is declared, and its removable singularities."""


def range_of(p: Parameter, owner: str) -> Range:
    """The range of a parameter of a model or block: the box that fits search and the closed ends of where it is valid.

    Scales, which have no upper end, go to 1. The usual value is the default, or the middle where that is an end.
    """
    low, high = p.search
    special: tuple[float, ...] = ()
    if p.valid.upper in p.valid:
        high = p.valid.upper
    if not math.isfinite(high):
        high = 1.0
    if p.valid.lower in p.valid and p.valid.lower < low:
        low, special = (low, (p.valid.lower,)) if p.log else (p.valid.lower, ())
    middle = math.sqrt(low * high) if p.log else (low + high) / 2
    found = Range(low, high, p.default if low < p.default < high else middle, p.log, special)
    return replace(found, **CHANGES.get(owner, {}).get(p.name, {}))


def ranges_of(parameters: Iterable[Parameter], owner: str) -> dict[str, Range]:
    """Ranges by name."""
    return {p.name: range_of(p, owner) for p in parameters}


def draw_directions(rng: np.random.Generator, n: int) -> Reals:
    """``n`` pairs of directions, ``[n, 6]``: a sixth each any, mirror, retro, near-mirror, grazing, normal incidence."""
    kind = rng.integers(0, 6, n)
    theta, phi = rng.uniform(0, GRAZING, n), rng.choice([0, np.pi / 2, np.nan], n)
    phi = np.where(np.isnan(phi), rng.uniform(0, 2 * np.pi, n), phi)
    theta = np.where(kind == 4, GRAZING - 10 ** rng.uniform(-6, -1, n), np.where(kind == 5, 0, theta))
    offset, turn = (10 ** rng.uniform(-8, -1, n) * rng.choice([-1, 1], n) for _ in range(2))
    other = np.where((kind == 0) | (kind == 5), rng.uniform(0, GRAZING, n), theta)
    other = np.where((kind == 3) | (kind == 4), np.clip(theta + offset, 0, GRAZING), other)
    across = np.where((kind == 0) | (kind == 5), rng.uniform(0, 2 * np.pi, n), np.pi)
    across = np.where(kind == 2, 0, np.where(kind >= 3, across + turn, across))
    return np.concatenate([unit_vectors(theta, phi), unit_vectors(other, phi + across)], -1)


def draw(ranges: dict[str, Range], rng: np.random.Generator, n: int) -> Reals:
    """``n`` values of each argument, ``[n, arguments]``."""
    return np.array([r.draw(rng, n) for r in ranges.values()]).reshape(len(ranges), n).T


__all__ = ["CHANGES", "GRAZING", "NEAR", "Range", "draw", "draw_directions", "range_of", "ranges_of"]
