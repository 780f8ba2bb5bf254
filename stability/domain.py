"""Where the models are measured: every range to its ends, removable singularities with their neighbours, hard directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import ArrayLike
from numpy.typing import NDArray

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


_ALBEDO = Range(0, 1, 0.1, log=False)
_SCALE = Range(0, 1, 0.6, log=False)
_WIDTH = Range(1e-4, 30, 0.15)
_EXPONENT = Range(1e-3, 1e7, 100, special=(0.0,))
_GTR = {"alpha": Range(1e-9, 10, 0.2, special=(1.0,)), "gamma": Range(0.01, 1e7, 1.6, special=(1.0,))}
_SGD = {"alpha": Range(1e-7, 30, 0.05), "p": Range(-10, 60, 0.6, log=False, special=(0.0, 1.0, 2.0, 7.0))}
_ABC = {"b": Range(1e-8, 1e9, 200), "c": Range(1e-3, 1e4, 1.3, special=(0.0, 1.0, 2.0))}
_IOR = Range(1, 1001, 1.5, special=(1.0,))
_F0, _F1 = Range(0.05, 1, 0.05, log=False), Range(-0.04, 0.04, 0.01, log=False)
"""F_sgd crosses zero for larger f1, and there no digit of the value is left by subtraction."""

PARAMETERS: dict[str, dict[str, Range]] = {
    "Lambert": {"diffuse": _ALBEDO},
    "GTR": {"diffuse": _ALBEDO, "specular": _SCALE, **_GTR},
    "SGD": {"diffuse": _ALBEDO, "specular": _SCALE, **_SGD, "f0": _F0, "f1": _F1},
    "ABC": {"diffuse": _ALBEDO, "specular": _SCALE, **_ABC, "ior": _IOR},
    "Ward": {"diffuse": _ALBEDO, "specular": _SCALE, "alpha": _WIDTH},
    "WardAnisotropic": {"diffuse": _ALBEDO, "specular": _SCALE, "alpha_x": _WIDTH, "alpha_y": _WIDTH},
    "AshikhminShirley": {"diffuse": _ALBEDO, "specular": _SCALE, "exponent": _EXPONENT},
    "AshikhminShirleyAnisotropic": {
        "diffuse": _ALBEDO,
        "specular": _SCALE,
        "exponent_x": _EXPONENT,
        "exponent_y": _EXPONENT,
    },
}
"""By class of model."""

SHAPES: dict[str, dict[str, Range]] = {
    name: {k: r for k, r in ranges.items() if k not in ("diffuse", "specular", "ior", "f0", "f1")}
    for name, ranges in PARAMETERS.items()
}
"""The parameters of a model's normal distribution."""

FRESNEL: dict[str, dict[str, Range]] = {
    "dielectric": {"ior": _IOR},
    "schlick": {"f0": _F0},
    "sgd_fresnel": {"f0": _F0, "f1": _F1},
}


def unit(theta: ArrayLike, phi: ArrayLike) -> Reals:
    """Unit vectors of polar angle and azimuth in radians."""
    theta, phi = np.broadcast_arrays(np.asarray(theta, float), np.asarray(phi, float))
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.sin(np.pi / 2 - theta)], -1)


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
    return np.concatenate([unit(theta, phi), unit(other, phi + across)], -1)


def draw(ranges: dict[str, Range], rng: np.random.Generator, n: int) -> Reals:
    """``n`` values of each argument, ``[n, arguments]``."""
    return np.array([r.draw(rng, n) for r in ranges.values()]).reshape(len(ranges), n).T


__all__ = ["FRESNEL", "GRAZING", "NEAR", "PARAMETERS", "SHAPES", "Range", "draw", "draw_directions", "unit"]
