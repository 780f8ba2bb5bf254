"""Reflectance at normal incidence, F0, of real substances: what a fitted F0 can be held against.

Values are linear sRGB, as tabulated in two courses by N. Hoffman: ``A`` is Table 1 of "Background: physics and math of
shading" (2013; from Real-Time Rendering, 3rd edition), ``B`` the metal, semiconductor and dielectric tables of his later
course talk on the same subject, which has more metals and finer digits. Substances that both list are taken from B.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class Substance:
    """A substance, its F0 in linear sRGB, what kind it is, and which of the two tables says so."""

    name: str
    f0: tuple[float, float, float]
    kind: str
    table: str


SUBSTANCES: tuple[Substance, ...] = (
    Substance("water", (0.02, 0.02, 0.02), "dielectric", "A"),
    Substance("plastic or glass (low)", (0.03, 0.03, 0.03), "dielectric", "A"),
    Substance("plastic (high)", (0.05, 0.05, 0.05), "dielectric", "A"),
    Substance("glass (high) or ruby", (0.08, 0.08, 0.08), "dielectric", "A"),
    Substance("diamond", (0.17, 0.17, 0.17), "dielectric", "A"),
    Substance("crystalline silicon", (0.345, 0.369, 0.426), "semiconductor", "B"),
    Substance("titanium", (0.542, 0.497, 0.449), "metal", "B"),
    Substance("chromium", (0.549, 0.556, 0.554), "metal", "B"),
    Substance("iron", (0.562, 0.565, 0.578), "metal", "B"),
    Substance("nickel", (0.660, 0.609, 0.526), "metal", "B"),
    Substance("platinum", (0.673, 0.637, 0.585), "metal", "B"),
    Substance("copper", (0.955, 0.638, 0.538), "metal", "B"),
    Substance("palladium", (0.733, 0.697, 0.652), "metal", "B"),
    Substance("zinc", (0.664, 0.824, 0.850), "metal", "B"),
    Substance("gold", (1.022, 0.782, 0.344), "metal", "B"),
    Substance("aluminum", (0.913, 0.922, 0.924), "metal", "B"),
    Substance("silver", (0.972, 0.960, 0.915), "metal", "B"),
)

GAP = (0.20, 0.45)
"""Between the brightest dielectrics and the darkest metals hardly any material lies (Hoffman gives 20-40 % and 20-45 %)."""

NEAR = 0.1
"""Difference from a substance beyond which none is named: some that are listed are nearer to each other."""

COLOURED = 0.1
"""Spread of F0 over the channels, relative to its mean, that dispersion gives no dielectric (diamond: 4 %)."""

WATER = 0.02
"""The lowest F0 of an ordinary substance."""


def nearest(f0: ArrayLike) -> tuple[Substance, float]:
    """The substance nearest to an F0 ``[3]`` in linear sRGB, and the largest relative difference of a channel from it."""
    f0 = np.asarray(f0, float)
    if f0.shape != (3,):
        raise ValueError(f"F0 is compared as linear RGB, three numbers, not shape {list(f0.shape)}")
    table: NDArray[np.float64] = np.array([s.f0 for s in SUBSTANCES])
    distance = np.abs(f0 / table - 1).max(1)
    k = int(np.argmin(distance))
    return SUBSTANCES[k], float(distance[k])


def kind_of(f0: ArrayLike) -> str:
    """What an F0 (scalar or one value per channel) says about the kind of substance, in words."""
    f0 = np.asarray(f0, float)
    level = float(np.mean(f0))
    if not np.isfinite(level):
        return "F0 is not a number"
    if level < 0:
        return "negative: no substance"
    if level < WATER:
        return "below water (0.02), the lowest of ordinary substances"
    if level <= GAP[0] and np.ptp(f0) > COLOURED * level:
        return "as low as dielectrics, but coloured as none is: more a scale than a substance"
    if level <= GAP[0]:
        return "in the range of dielectrics"
    if level < GAP[1]:
        return "between 20 % and 45 %, where hardly any material lies but semiconductors"
    if level <= 1:
        return "in the range of metals"
    return "above 1: a scale, not a reflectance"
