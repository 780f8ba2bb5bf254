"""What a picture shows of a material: the pairs of directions behind its pixels, by what they contribute.

The share of one direction of light in a pixel is the luminance that comes by it over the luminance of the pixel; a pixel
counts by how much a relative change of it is seen, (dI/d ln L)^2, with I the intensity of ICtCp (the PQ curve of
Recommendation ITU-R BT.2100). So the weights sum the square of the visible difference over the pixels.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.typing import NDArray

from ..angles import half_difference
from ..colours import library, luminance
from ..tables import HalfDifferenceGrid
from .difference import WHITE
from .illumination import Extended, Illumination
from .interpolated import Measured, evaluated
from .rendering import Rendered, cast
from .sampling import drawn, techniques_of
from .scene import Reals

ROUNDS = 16
"""Directions of each technique and pixel that stand for light of some extent."""
LARGEST = 100_000
"""Pairs of such directions that are looked at; scenes with more pixels have fewer of them looked at."""


@dataclass(frozen=True, eq=False)
class Seen:
    """Pairs of directions that a picture is made of."""

    wi: Reals
    """Unit vectors to the light, ``[n, 3]``."""
    wo: Reals
    """Unit vectors to the camera, ``[n, 3]``."""
    measured: Reals
    """BRDF of the table, ``[n, C]``."""
    pixel: Reals
    """Radiance of the pixel that each is part of, times the exposure, ``[n, C]``."""
    share: Reals
    """Part of the luminance of the pixel that comes this way, over the number of pixels, ``[n]``; sums to 1."""
    weight: Reals
    """That times how much a relative change of the pixel is seen, squared, ``[n]``; sums to 1."""

    def cells(self, grid: HalfDifferenceGrid) -> Reals:
        """The weights summed over the cells of an isotropic grid, ``[H, D, P]``."""
        h, d, p, _ = half_difference(self.wi, self.wo)
        low, high = grid.phi_d_edges[0], grid.phi_d_edges[-1]
        index = [
            np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
            for edges, x in (
                (grid.theta_h_edges, h),
                (grid.theta_d_edges, d),
                (grid.phi_d_edges, low + np.mod(p - low, high - low)),
            )
        ]
        out = np.zeros(grid.shape)
        np.add.at(out, tuple(index), self.weight)
        return out

    def draw(self, count: int) -> Seen:
        """So many pairs of equal share, one of each equal step of the summed share in the order of theta_h."""
        order = np.argsort(half_difference(self.wi, self.wo)[0], kind="stable")
        steps = np.cumsum(self.share[order])
        chosen = order[np.minimum(np.searchsorted(steps, (np.arange(count) + 0.5) / count * steps[-1]), len(order) - 1)]
        weight = self.weight[chosen] / self.share[chosen]
        parts = (self.wi[chosen], self.wo[chosen], self.measured[chosen], self.pixel[chosen])
        return Seen(*parts, np.full(count, 1 / count), weight / weight.sum())


def seen(table: Measured, light: Illumination, picture: Rendered, exposure: float, alpha: float) -> Seen:
    """What the picture of a measured table shows. ``picture`` is that picture, ``alpha`` the width of the table's lobe."""
    rng = np.random.default_rng(0)
    rows: list[tuple[Reals, Reals, Reals, NDArray[np.intp]]] = []
    every = np.arange(len(light.wo))
    rows += [(np.asarray(p.wi), np.asarray(light.wo), np.asarray(p.arriving), every) for p in light.punctual]
    extended = light.extended
    if light.everywhere is not None:
        others = Extended((), None, None) if extended is None else extended
        extended = Extended(others.balls, others.sky, light.everywhere.radiance)
    if extended is not None:
        count = min(len(every), max(LARGEST // (ROUNDS * techniques_of(extended)), 1))
        part = np.sort(rng.choice(every, count, replace=False))
        some = Illumination(light.wo, (), None, extended).part(part).extended
        for _ in range(ROUNDS):
            with jax.enable_x64(True):
                u = rng.random((techniques_of(extended), 2, len(part)))
                directions, reach = drawn(*cast((some, np.asarray(light.wo)[part], np.float64(alpha), u), "float64"))
            for w, a in zip(np.asarray(directions), np.asarray(reach), strict=True):
                rows.append((w, np.asarray(light.wo)[part], a * (len(every) / len(part) / ROUNDS), part))
    wi, wo, arriving = (np.concatenate([r[k] for r in rows]) for k in range(3))
    at = np.concatenate([r[3] for r in rows])
    with jax.enable_x64(True):
        values = np.asarray(evaluated(*cast((table, wi, wo), "float64")), float)
    pixel = picture.values * exposure
    brightness = luminance(pixel)
    share = luminance(values * arriving) * exposure / np.maximum(brightness[at], 1e-12)
    weight = share * visibility(brightness)[at] ** 2
    kept = weight > 0
    even, counted = (x[kept] / (x[kept].sum() or 1.0) for x in (share, weight))
    return Seen(wi[kept], wo[kept], values[kept], pixel[at][kept], even, counted)


M1, M2 = 2610 / 16384, 2523 / 4096 * 128
C1, C2, C3 = 3424 / 4096, 2413 / 4096 * 32, 2392 / 4096 * 32
"""Constants of the PQ curve (Recommendation ITU-R BT.2100-2, table 4)."""
DARK = 1e-4
"""Added to what PQ is taken of, 1e-4 of white: 0.01 cd/m^2, where screens are black. The curve's slope at 0 is infinite."""


def pq(shown: Any) -> Any:
    """The PQ signal in [0, 1] of linear values, where 1 is white at :data:`~.difference.WHITE` cd/m^2."""
    y = ((shown + DARK) * (WHITE / 10000)) ** M1
    return ((C1 + C2 * y) / (1 + C3 * y)) ** M2


LMS = np.array([[1688, 2146, 262], [683, 2951, 462], [99, 309, 3688]]) / 4096
ITP = np.array([[2048, 2048, 0], [3305, -6806.5, 3501.5], [17933, -17390, -543]]) / 4096
"""From linear RGB of BT.2020 to LMS, and from its PQ signal to ITP (BT.2100-2, table 7; BT.2124-0: T is half C_T)."""


@cache
def _to_lms() -> Reals:
    """From linear sRGB."""
    colour = library()
    wide = colour.matrix_RGB_to_RGB(*(colour.RGB_COLOURSPACES[n] for n in ("sRGB", "ITU-R BT.2020")))
    return np.asarray(LMS @ wide)


def itp(shown: Float[Array, "... C"]) -> Float[Array, "... 3"]:
    """720 ITP of linear values, where 1 is white: their distance is ΔE ITP. Below 0 is 0; but for three channels grey."""
    shown = jnp.maximum(shown, 0)
    if shown.shape[-1] != 3:
        shown = jnp.broadcast_to(shown.mean(-1, keepdims=True), (*shown.shape[:-1], 3))
    seen: Array = 720 * pq(shown @ _to_lms().T) @ ITP.T
    return seen


def visibility(shown: Reals) -> Reals:
    """dPQ/d ln L: how much a small relative change of a value is seen."""
    step = 1e-4
    shown = np.maximum(shown, 0)
    return np.asarray((pq(shown * (1 + step)) - pq(shown * (1 - step))) / (2 * step))


__all__ = ["Seen", "itp", "pq", "seen", "visibility"]
