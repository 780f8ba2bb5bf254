"""A table cut into blocks, each a thin copy of the whole: what the passes of a fit run over.

A pass over n blocks of N visits every N-th cell or so: a few blocks are a coarse table for a search, all of them are the
whole table, and one compiled program serves both. Within a block the cells keep the axes of the grid, so that what depends
on theta_h alone is evaluated once for each theta_h.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.typing import NDArray

from ..angles import polar_cosines
from ..geometry import Geometry, from_directions
from ..polar import PolarStencil
from ..tables import HalfDifferenceGrid, Table
from .compression import row_rules
from .losses import Loss
from .threads import in_threads

Reals = NDArray[np.float64]

THETA_H_BANDS = 9
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
    weight = np.broadcast_to(table.layout.solid_angle() if measure == "solid_angle" else np.ones(()), used.shape)
    weight = np.where(used, weight, 0.0)
    total = weight.sum()
    if not total > 0:
        # every fitted cell has no extent (a single ring at the pole, say): count cells
        weight = used.astype(float)
        total = max(weight.sum(), 1.0)
    weight = weight / total
    if isinstance(table.layout, HalfDifferenceGrid) and table.layout.isotropic:
        return _grid_samples(table, table.layout, used, weight, limit, along_phi), used
    return _scattered_samples(table, used, weight, limit), used


def _spread_order(n: int) -> NDArray[np.int64]:
    """An order of 0..n-1 in which any first few are spread over the whole (golden-ratio steps)."""
    return np.argsort((np.arange(n) * 0.6180339887498949) % 1.0, kind="stable")


class _Fold:
    """Cuts ``[H, D, P]`` arrays into blocks ``[B, H, D' P']`` that each stride over theta_d and phi_d.

    The last axis is long, so that the innermost loops of a pass are; ``(bands, rows, D', P')`` unfolds the cells.
    """

    def __init__(self, shape: tuple[int, ...], along_phi: int = STRIDED) -> None:
        h, d, p = self.shape = shape
        bands = min(THETA_H_BANDS, h)
        rows = -(-h // bands)
        self.steps = -(-d // STRIDED), -(-p // along_phi)
        self.banded = bands, rows, -(-d // self.steps[0]), -(-p // self.steps[1])
        self.padded = bands * rows, self.banded[2] * self.steps[0], self.banded[3] * self.steps[1]
        self.order = _spread_order(self.steps[0] * self.steps[1])

    def __call__(self, a: np.ndarray, fill: float = 0.0) -> Array:
        """:meth:`fold` for a program."""
        return jnp.asarray(self.fold(a, fill))

    def fold(self, a: np.ndarray, fill: float = 0.0) -> np.ndarray:
        """Blocks ``[B, ..., H, D' P']`` of ``[..., H, D, P]``; what does not depend on theta_h or (theta_d, phi_d) keeps
        an axis of length 1 there, and what is the same in all blocks has B = 1.
        """
        lead = a.ndim - 3
        pad = [(0, 0)] * lead + [(0, 0 if n == 1 else m - n) for n, m in zip(a.shape[lead:], self.padded, strict=True)]
        a = np.pad(a, pad, constant_values=fill) if any(after for _, after in pad) else a
        if a.shape[-2:] == (1, 1):
            return np.asarray(a.reshape(1, *a.shape[:-1]))
        a = np.broadcast_to(a, (*a.shape[:-2], *self.padded[1:]))
        (step_d, step_p), (_, _, d, p) = self.steps, self.banded
        a = a.reshape(*a.shape[:-2], d, step_d, p, step_p)
        a = np.moveaxis(a, (-3, -1), (0, 1)).reshape(step_d * step_p, *a.shape[:-4], d * p)
        return np.asarray(a[self.order])

    def unfold(self, blocks: np.ndarray) -> np.ndarray:
        """``[H, D, P]`` of blocks ``[B, H, D' P']``."""
        h, depth, p = self.shape
        (step_d, step_p), (_, _, d, q) = self.steps, self.banded
        a = np.empty_like(blocks)
        a[self.order] = blocks
        a = np.moveaxis(a.reshape(step_d, step_p, -1, d, q), (0, 1), (2, 4))
        return a.reshape(a.shape[0], d * step_d, q * step_p)[:h, :depth, :p]


def _grid_samples(
    table: Table, grid: HalfDifferenceGrid, used: NDArray[np.bool_], weight: Reals, limit: float, along_phi: int
) -> Samples:
    geometry, rows = _grid_geometry(_axes(grid), limit, along_phi)
    part = np.ix_(*rows)
    fold = _Fold((*(len(r) for r in rows), len(grid.phi_d)), along_phi)
    # channel by channel, so that no copy of the whole table is made on the way
    planes = (fold.fold(np.where(used[part], plane[part], 0.0)) for plane in table.planes)
    first = next(planes)
    measured = np.empty((first.shape[0], table.channels, *first.shape[1:]))
    for c, plane in enumerate((first, *planes)):
        measured[:, c] = plane
    return Samples(Blocks(geometry, jnp.asarray(measured), fold(weight[part])), banded=fold.banded, band_axes=(0, 2))


GROUPS = 8
"""Parts of the table that are compressed side by side."""


def compress(whole: Samples, table: Table, used: NDArray[np.bool_], max_angle: float, loss: Loss) -> Samples:
    """The samples with a compressed copy of the table beside them, made for one loss (bound to the table): each row along
    phi_d has as many nodes as a block has cells of it.

    The same samples where that is not possible: scattered samples, short rows, losses without a transform.
    """
    grid = table.layout
    transform: Any = loss.transform
    if transform is None or loss.inverse is None or not isinstance(grid, HalfDifferenceGrid) or not grid.isotropic:
        return whole
    limit = float(np.radians(max_angle))
    k = whole.banded[3]
    _, rows = _grid_geometry(_axes(grid), limit, k)
    fold = _Fold((*(len(r) for r in rows), len(grid.phi_d)), k)
    if len(grid.phi_d) < 2 * k:
        return whole
    h, d = grid.theta_h[rows[0], None, None], grid.theta_d[None, rows[1], None]
    weight = fold.unfold(np.asarray(whole.cells.weight))
    g = _plain_geometry(h, d, grid.phi_d, weight > 0)
    if loss.weigh is not None:
        weight *= np.asarray(loss.weigh(g))
    rules = row_rules(np.where(grid.phi_d > np.pi, 2 * np.pi - grid.phi_d, grid.phi_d), weight, k)

    def row_by_row(a: np.ndarray) -> np.ndarray:
        """``[H D, P]`` of ``[H, D, P]``; axes that it does not depend on may have length 1."""
        return np.broadcast_to(a, (*weight.shape[:2], a.shape[-1])).reshape(-1, a.shape[-1])

    part = np.ix_(*rows)
    fitted, share = row_by_row(used[part]), row_by_row(weight)
    values = [row_by_row(plane[part]) for plane in table.planes]

    def reduced(at: NDArray[np.intp]) -> tuple[Reals, Reals]:
        """Values at the nodes of some rows, and the square sum that they leave out."""
        planes = np.stack([np.where(fitted[at], plane[at], 0.0) for plane in values])
        transformed = np.asarray(transform(planes, jax.tree.map(lambda a: row_by_row(a)[at], g)))
        at_nodes, kept = rules.compress(transformed, at)
        return at_nodes, np.einsum("rp,crp,crp->c", share[at], transformed, transformed) - kept

    groups = rules.groups(GROUPS)
    parts = list(in_threads(reduced, groups))
    remainder = np.sum([left_out for _, left_out in parts], 0)
    at_rows = np.empty((table.channels, *share.shape[:1], k))
    for at, (of_rows, _) in zip(groups, parts, strict=True):
        at_rows[:, at] = of_rows
    node_weight = rules.weight
    at_nodes = _plain_geometry(h, d, rules.phi, node_weight > 0)
    nodal = np.asarray(loss.inverse(jnp.asarray(at_rows.reshape(table.channels, *rules.phi.shape)), at_nodes))
    relative = loss.weight(at_nodes)
    node_weight = node_weight if relative is None else node_weight / np.asarray(relative)
    nodes = _Fold((*(len(r) for r in rows), k), k)
    blocks = Blocks(_folded(at_nodes, nodes, limit), nodes(nodal), nodes(node_weight))
    return Samples(whole.cells, whole.banded, whole.band_axes, blocks, jnp.asarray(np.maximum(remainder, 0.0)))


def _folded(g: Geometry, fold: _Fold, limit: float) -> Geometry:
    """Geometry ``[H, D, P]`` in blocks, with the stencils of its polar angles."""

    def stencil(cosine: Array) -> PolarStencil:
        s = PolarStencil.of(np.asarray(cosine), limit)
        return PolarStencil(fold(np.asarray(s.index), 1), fold(np.asarray(s.fraction)), limit)

    cosines = [fold(np.asarray(c), 1.0) for c in (g.cos_i, g.cos_o, g.cos_h, g.cos_d)]
    sin2_h, sin2_d = (fold(np.asarray(c)) for c in (g.sin2_h, g.sin2_d))
    return Geometry(
        cosines[0],
        cosines[1],
        cosines[2],
        sin2_h,
        cosines[3],
        sin2_d,
        stencil_i=stencil(g.cos_i),
        stencil_o=stencil(g.cos_o),
    )


def _plain_geometry(h: Reals, d: Reals, phi: Reals, fitted: NDArray[np.bool_]) -> Geometry:
    """Geometry of half/difference angles; where not fitted, of the normal direction."""
    cos_i, cos_o = (np.where(fitted, c, 1.0) for c in polar_cosines(h, d, phi))
    fields: Any = cos_i, cos_o, np.cos(h), np.sin(h) ** 2, np.cos(d), np.sin(d) ** 2
    return Geometry(*fields)


def _axes(grid: HalfDifferenceGrid) -> tuple[bytes, bytes, bytes]:
    return grid.theta_h.tobytes(), grid.theta_d.tobytes(), grid.phi_d.tobytes()


@lru_cache(maxsize=1)
def _grid_geometry(
    axes: tuple[bytes, bytes, bytes], limit: float, along_phi: int
) -> tuple[Geometry, tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Geometry of a half/difference grid in blocks, and the rows of theta_h and theta_d that have any cell within the
    limit; the tables of a batch share it.
    """
    h, d, p = (np.frombuffer(a) for a in axes)
    cos_i, cos_o = HalfDifferenceGrid(h, d, p, h, d, p).polar_cosines()
    valid = (cos_i >= np.cos(limit) - 1e-12) & (cos_o >= np.cos(limit) - 1e-12)
    rows = np.flatnonzero(valid.any((1, 2))), np.flatnonzero(valid.any((0, 2)))
    del cos_i, cos_o  # two copies of the grid
    # Guard: cells that are not fitted have weight 0, and 0 * inf = NaN: they get a harmless direction
    # (tests/test_samples.py::test_unused_cells_are_harmless).
    g = _plain_geometry(h[rows[0], None, None], d[None, rows[1], None], p, valid[np.ix_(*rows)])
    return _folded(g, _Fold(g.cos_i.shape, along_phi), limit), rows


def _scattered_samples(table: Table, used: NDArray[np.bool_], weight: Reals, limit: float) -> Samples:
    wi, wo = (v[used] for v in table.layout.directions())
    values, share = table.planes[:, used], weight[used]
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
    return np.ascontiguousarray(slots.reshape(len(bands), m, blocks).transpose(2, 0, 1))[_spread_order(blocks)]
