"""Parameters drawn by name: ``gtr-07`` is the same material on every machine and in every run.

The ranges are those of published fits to measured materials, so that what is drawn is as hard to fit as they are. A
parameter per channel has a level, and its channels lie within a tenth of the range of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from ...models import build
from ...models.base import BRDF, parameters_of


@dataclass(frozen=True)
class Range:
    """Where a parameter is drawn from, uniformly or uniformly in its logarithm."""

    lower: float
    upper: float
    log: bool = False

    def at(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """The value at positions ``u`` in [0, 1] along the range."""
        if self.log:
            return np.asarray(self.lower * (self.upper / self.lower) ** u)
        return self.lower + (self.upper - self.lower) * u


_ALBEDO = Range(1e-3, 0.41, log=True)
"""kD of ``abc`` (0 to 0.411; a thousandth in place of 0, which has no logarithm)."""
_EXPONENT = Range(0.5, 78200, log=True)
"""sharpness of ``ngan_ashikhminshirley``."""
_WARD_WIDTH = Range(0.0058, 0.5, log=True)
"""roughness of ``ngan_ward``."""
_WARD = {"diffuse": _ALBEDO, "specular": Range(0.0015, 0.27, log=True)}  # its albedo
_ASHIKHMIN_SHIRLEY = {"diffuse": _ALBEDO, "specular": Range(0.013, 0.98, log=True)}  # fresnelReflectance, likewise

RANGES: dict[str, dict[str, Range]] = {
    # Burley 2012 fits the same database: widths from polished metal to felt, tails from long (below 1) to nearly Gaussian.
    "gtr": {
        "diffuse": _ALBEDO,
        "specular": Range(0.02, 0.98, log=True),
        "alpha": Range(0.005, 0.6, log=True),
        "gamma": Range(0.6, 4),
    },
    # b, c, ior: the whole range of `abc`. specular: 5 to 95 % of it after conversion; its extremes belong to extreme ior.
    "abc": {
        "diffuse": _ALBEDO,
        "specular": Range(0.11, 0.58, log=True),
        "b": Range(11.2, 8.09e6, log=True),
        "c": Range(0.024, 2.66, log=True),
        "ior": Range(1.04, 99.9, log=True),
    },
    # alpha, p: the whole range of `sgd`. f0 reaches 8.5 and f1 runs from -1 to 7.5 there, with F < 0 in places; here
    # f1 <= f0 <= 1, so F >= 0 everywhere. specular: the upper half of the published ones after conversion.
    "sgd": {
        "diffuse": _ALBEDO,
        "specular": Range(0.15, 1.6, log=True),
        "alpha": Range(1.63e-5, 0.85, log=True),
        "p": Range(0, 1.77),
        "f0": Range(0.1, 1),
        "f1": Range(-0.5, 0.1),
    },
    "ward": {**_WARD, "alpha": _WARD_WIDTH},
    "ashikhmin_shirley": {**_ASHIKHMIN_SHIRLEY, "exponent": _EXPONENT},
}
"""Isotropic models: parameter by parameter."""

ANISOTROPIC_RANGES: dict[str, dict[str, Range]] = {
    "ward": {**_WARD, "alpha_x": _WARD_WIDTH, "alpha_y": _WARD_WIDTH},
    "ashikhmin_shirley": {**_ASHIKHMIN_SHIRLEY, "exponent_x": _EXPONENT, "exponent_y": _EXPONENT},
}
"""Anisotropic ones."""


def draw(cls: type[BRDF], ranges: dict[str, Range], name: str, channels: int) -> BRDF:
    """A model of ``cls`` with parameters from ``ranges`` that depend on ``name`` alone.

    More channels leave the first ones as they are, and each parameter has a generator of its own.
    """
    values = {}
    for p in parameters_of(cls):
        rng = np.random.default_rng(crc32(f"{name}/{p.name}".encode()))
        level = rng.random()
        u = np.clip(level + 0.1 * (2 * rng.random(channels) - 1), 0, 1) if p.per_channel else np.asarray(level)
        values[p.name] = ranges[p.name].at(u)
    return build(cls, values)  # type: ignore[arg-type]


__all__ = ["ANISOTROPIC_RANGES", "RANGES", "Range", "draw"]
