"""A table cut into blocks, each a thin copy of the whole: what the passes of a fit run over.

A pass over n blocks of N visits every N-th cell or so: a few blocks are a coarse table for a search, all of them are the
whole table, and one compiled program serves both. Within a block the cells keep the axes of the grid, so that what depends
on theta_h alone is evaluated once for each theta_h.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.typing import NDArray

from ..geometry import Geometry, from_directions
from ..polar import PolarStencil
from ..tables import HalfDifferenceGrid, Table
from ..tables.layout import Layout

Reals = NDArray[np.float64]

STRIDED = 10
"""Cells of a block along theta_d, and by default along phi_d, at most."""
SCATTERED_BANDS = (6, 4)
"""Bands of scattered samples along theta_h and theta_d."""
SCATTERED_CELLS = 8160
"""Samples in a block of scattered samples, at most."""


class Blocks(eqx.Module):
    """Cells in blocks of one shape. A leaf of ``geometry`` with a leading axis of 1 is shared by all blocks."""

    geometry: Geometry
    measured: Float[Array, "blocks C *cells"]
    """BRDF in 1/sr; 0 where not fitted."""
    weight: Float[Array, " blocks *cells"]
    """Share of the measure, 0 where not fitted; sums to 1."""

    def at(self, i: Array) -> tuple[Geometry, Float[Array, " C *cells"], Float[Array, "*cells"]]:
        """Geometry, measured values and weights of block i."""
        geometry = jax.tree.map(lambda leaf: leaf[0] if leaf.shape[0] == 1 else leaf[i], self.geometry)
        return geometry, self.measured[i], self.weight[i]

    def channel(self, c: int) -> Blocks:
        """The same cells with channel c alone."""
        one: Blocks = eqx.tree_at(lambda b: b.measured, self, self.measured[:, c : c + 1])
        return one


class Samples(eqx.Module):
    """The fitted cells of a table, and a compressed copy of it for one loss where there is one."""

    cells: Blocks
    banded: tuple[int, ...] = eqx.field(static=True)
    """Shape that unfolds the cells of a block so that each angular band of the jackknife has its own index."""
    band_axes: tuple[int, ...] = eqx.field(static=True)
    """Axes of ``banded`` that number the bands; the others lie within one."""
    nodes: Blocks | None = None
    """The table with its rows along phi_d compressed, in blocks of the same shape."""
    remainder: Float[Array, " C"] | None = None
    """What the compressed blocks leave out of the cost, a constant."""

    @property
    def channels(self) -> int:
        """Number of channels C."""
        return self.cells.measured.shape[1]

    @property
    def blocks(self) -> int:
        """Number of blocks of cells."""
        return self.cells.weight.shape[0]

    @property
    def compressed(self) -> int:
        """Number of compressed blocks."""
        return 0 if self.nodes is None else self.nodes.weight.shape[0]

    def block(self, i: Array) -> tuple[Geometry, Float[Array, " C *cells"], Float[Array, "*cells"]]:
        """Geometry, measured values and weights of block i; compressed blocks are numbered first."""
        nodes, count = self.nodes, self.compressed
        if nodes is None:
            return self.cells.at(i)
        # the index that is not used is clipped by the lookup, and its block is never read
        block: tuple[Geometry, Array, Array] = jax.lax.cond(i < count, lambda: nodes.at(i), lambda: self.cells.at(i - count))
        return block

    def channel(self, c: int) -> Samples:
        """The same cells with channel c alone."""
        nodes = None if self.nodes is None else self.nodes.channel(c)
        remainder = None if self.remainder is None else self.remainder[c : c + 1]
        return Samples(self.cells.channel(c), self.banded, self.band_axes, nodes, remainder)


def samples(table: Table, max_angle: float, measure: str, along_phi: int = STRIDED) -> tuple[Samples, NDArray[np.bool_]]:
    """Blocks of the cells of ``table`` with polar angles up to ``max_angle`` degrees, and which cells those are.

    ``measure`` is ``"solid_angle"`` (a cell counts by its solid angles) or ``"cells"`` (every cell counts once). A block of
    a grid has at most ``along_phi`` cells of a row.
    Raises ValueError for another measure or an angle outside (0, 90).
    """
    if measure not in ("solid_angle", "cells"):
        raise ValueError(f"unknown measure {measure!r}: choose solid_angle or cells")
    if not 0 < max_angle < 90:
        raise ValueError(f"max_angle must lie in (0, 90) degrees, not {max_angle:g}")
    limit = float(np.radians(max_angle))
    used = table.within(limit)
    if isinstance(table.layout, HalfDifferenceGrid) and table.layout.isotropic:
        from .grid_samples import grid_samples

        return grid_samples(table, table.layout, used, measure, limit, along_phi), used
    return _scattered_samples(table, used, shares(table.layout, used, measure), limit), used


def shares(layout: Layout, used: NDArray[np.bool_], measure: str) -> Reals:
    """Share of each cell in the measure of all that are used; 0 elsewhere."""
    weight = np.where(used, layout.solid_angle() if measure == "solid_angle" else 1.0, 0.0)
    total = weight.sum()
    if not total > 0:
        # every fitted cell has no extent (a single ring at the pole, say): count cells
        weight = used.astype(float)
        total = max(weight.sum(), 1.0)
    weight /= total
    return weight


def spread_order(n: int) -> NDArray[np.int64]:
    """An order of 0..n-1 in which any first few are spread over the whole (golden-ratio steps)."""
    return np.argsort((np.arange(n) * 0.6180339887498949) % 1.0, kind="stable")


def _scattered_samples(table: Table, used: NDArray[np.bool_], weight: Reals, limit: float) -> Samples:
    wi, wo = (v[used] for v in table.layout.directions())
    values, share = table.planes[:, used], weight[used]
    if not used.any():  # one sample of weight 0 stands for none
        wi = wo = np.array([[0.0, 0.0, 1.0]])
        values, share = np.zeros((table.channels, 1)), np.zeros(1)
    slots = _band_slots(wi, wo)
    banded = slots.shape[1:]
    slots = slots.reshape(len(slots), -1)
    fitted = slots >= 0
    wi, wo = wi[slots], wo[slots]  # an empty slot, -1, repeats the last direction, with weight 0
    g: Any = from_directions(wi, wo)
    if table.isotropic:
        g = replace(g, h_x2=None, h_y2=None, light=None, viewer=None)
    stencils = [PolarStencil.of(v[..., 2], limit) for v in (wi, wo)]
    g = eqx.tree_at(lambda q: (q.stencil_i, q.stencil_o), g, tuple(stencils), is_leaf=lambda x: x is None)
    measured = np.moveaxis(np.where(fitted, values[:, slots], 0.0), 0, 1)
    kept = jnp.asarray(np.where(fitted, share[slots], 0.0))
    return Samples(Blocks(jax.tree.map(jnp.asarray, g), jnp.asarray(measured), kept), banded, (0,))


def _band_slots(wi: Reals, wo: Reals) -> NDArray[np.int64]:
    """Indices of samples in slots ``[blocks, bands, m]``, -1 where empty: each block has its share of each angular band."""
    n = len(wi)
    total = wi + wo
    theta_h = np.arctan2(np.hypot(total[:, 0], total[:, 1]), total[:, 2])
    theta_d = np.arctan2(np.linalg.norm(wi - wo, axis=-1), np.linalg.norm(total, axis=-1))
    bands = [
        part
        for row in np.array_split(np.argsort(theta_h, kind="stable"), SCATTERED_BANDS[0])
        for part in np.array_split(row[np.argsort(theta_d[row], kind="stable")], SCATTERED_BANDS[1])
    ]
    longest = max(len(b) for b in bands) if n else 1
    m = max(1, min(longest, SCATTERED_CELLS // len(bands)))
    blocks = -(-longest // m)
    slots = np.full((len(bands), blocks * m), -1, np.int64)
    for band, members in zip(slots, bands, strict=True):
        band[: len(members)] = members
    # strided, not cut, so that a block has its share of every band also within the band
    return np.ascontiguousarray(slots.reshape(len(bands), m, blocks).transpose(2, 0, 1))[spread_order(blocks)]
