"""A table cut into blocks, each a thin copy of the whole: what the passes of a fit run over.

A pass over n blocks of N visits every N-th cell or so: a few blocks are a coarse table for a search, all of them are the
whole table, and one compiled program serves both. Within a block the cells keep the axes of the grid, so that what depends
on theta_h alone is evaluated once for each theta_h.
"""

from __future__ import annotations

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
from .compression import row_rule
from .losses import Loss

Reals = NDArray[np.float64]

THETA_H_BANDS = 9
STRIDED = 10
"""Cells of a block along theta_d and phi_d."""
SCATTERED_BANDS = (6, 4)
"""Bands of scattered samples along theta_h and theta_d."""
SCATTERED_CELLS = 8160
"""Samples in a block of scattered samples, at most."""


class Samples(eqx.Module):
    """The fitted cells of a table, and before them a compressed copy where there is one.

    A leaf of ``geometry`` with a leading axis of 1 is shared by all blocks. The first ``compressed`` blocks are the table
    with its rows along phi_d compressed for one loss; the others are its cells.
    """

    geometry: Geometry
    measured: Float[Array, "blocks C *cells"]
    """BRDF in 1/sr; 0 where not fitted."""
    weight: Float[Array, "blocks *cells"]
    """Share of the measure, 0 where not fitted; sums to 1."""
    banded: tuple[int, ...] = eqx.field(static=True)
    """Shape that unfolds ``cells`` so that each angular band of the jackknife has its own index."""
    band_axes: tuple[int, ...] = eqx.field(static=True)
    """Axes of ``banded`` that number the bands; the others lie within one."""
    remainder: Float[Array, "C"]
    """What the compressed blocks leave out of the cost, a constant."""
    compressed: int = eqx.field(static=True, default=0)
    """Number of compressed blocks."""

    @property
    def blocks(self) -> int:
        """Number of blocks of cells."""
        return self.measured.shape[0] - self.compressed

    def block(self, i: Array) -> tuple[Geometry, Float[Array, "C *cells"], Float[Array, "*cells"]]:
        """Geometry, measured values and weights of block i."""
        geometry = jax.tree.map(lambda leaf: leaf[0] if leaf.shape[0] == 1 else leaf[i], self.geometry)
        return geometry, self.measured[i], self.weight[i]

    def channel(self, c: int) -> Samples:
        """The same cells with channel c alone."""
        part = slice(c, c + 1)
        one: Samples = eqx.tree_at(lambda s: (s.measured, s.remainder), self, (self.measured[:, part], self.remainder[part]))
        return one


def samples(table: Table, max_angle: float, measure: str) -> tuple[Samples, NDArray[np.bool_]]:
    """Blocks of the cells of ``table`` with polar angles up to ``max_angle`` degrees, and which cells those are.

    ``measure`` is ``"solid_angle"`` (a cell counts by its solid angles) or ``"cells"`` (every cell counts once).
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
        return _grid_samples(table, table.layout, used, weight, limit), used
    return _scattered_samples(table, used, weight, limit), used


def _spread_order(n: int) -> NDArray[np.int64]:
    """An order of 0..n-1 in which any first few are spread over the whole (golden-ratio steps)."""
    return np.argsort((np.arange(n) * 0.6180339887498949) % 1.0, kind="stable")


class _Fold:
    """Cuts ``[H, D, P]`` arrays into blocks ``[B, H, D' P']`` that each stride over theta_d and phi_d.

    The last axis is long, so that the innermost loops of a pass are; ``(bands, rows, D', P')`` unfolds the cells.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        h, d, p = self.shape = shape
        bands = min(THETA_H_BANDS, h)
        rows = -(-h // bands)
        self.steps = -(-d // STRIDED), -(-p // STRIDED)
        self.banded = bands, rows, -(-d // self.steps[0]), -(-p // self.steps[1])
        self.padded = bands * rows, self.banded[2] * self.steps[0], self.banded[3] * self.steps[1]
        self.order = _spread_order(self.steps[0] * self.steps[1])

    def __call__(self, a: np.ndarray, fill: float = 0.0) -> Array:
        """Blocks ``[B, ..., H, D' P']`` of ``[..., H, D, P]``; what does not depend on theta_h or (theta_d, phi_d) keeps
        an axis of length 1 there, and what is the same in all blocks has B = 1.
        """
        lead = a.ndim - 3
        pad = [(0, 0)] * lead + [(0, 0 if n == 1 else m - n) for n, m in zip(a.shape[lead:], self.padded, strict=True)]
        a = np.pad(a, pad, constant_values=fill) if any(after for _, after in pad) else a
        if a.shape[-2:] == (1, 1):
            return jnp.asarray(a.reshape(1, *a.shape[:-1]))
        a = np.broadcast_to(a, (*a.shape[:-2], *self.padded[1:]))
        (step_d, step_p), (_, _, d, p) = self.steps, self.banded
        a = a.reshape(*a.shape[:-2], d, step_d, p, step_p)
        a = np.moveaxis(a, (-3, -1), (0, 1)).reshape(step_d * step_p, *a.shape[:-4], d * p)
        return jnp.asarray(a[self.order])

    def unfold(self, blocks: np.ndarray) -> np.ndarray:
        """``[H, D, P]`` of blocks ``[B, H, D' P']``."""
        h, depth, p = self.shape
        (step_d, step_p), (_, _, d, q) = self.steps, self.banded
        a = np.empty_like(blocks)
        a[self.order] = blocks
        a = np.moveaxis(a.reshape(step_d, step_p, -1, d, q), (0, 1), (2, 4))
        return a.reshape(a.shape[0], d * step_d, q * step_p)[:h, :depth, :p]


def _grid_samples(table: Table, grid: HalfDifferenceGrid, used: NDArray[np.bool_], weight: Reals, limit: float) -> Samples:
    geometry, rows = _grid_geometry(grid.theta_h.tobytes(), grid.theta_d.tobytes(), grid.phi_d.tobytes(), limit)
    part = np.ix_(*rows)
    fold = _Fold((*(len(r) for r in rows), len(grid.phi_d)))
    measured = np.where(used[part], _block(table.planes, rows), 0.0)
    none = jnp.zeros(table.channels)
    return Samples(geometry, fold(measured), fold(weight[part]), banded=fold.banded, band_axes=(0, 2), remainder=none)


def compress(cells: Samples, table: Table, used: NDArray[np.bool_], max_angle: float, loss: Loss) -> Samples:
    """The samples with a compressed copy of the table before them, made for one loss (bound to the table).

    The same samples where that is not possible: scattered samples, short rows, losses without a transform.
    """
    grid = table.layout
    if loss.transform is None or not isinstance(grid, HalfDifferenceGrid) or not grid.isotropic:
        return cells
    limit = float(np.radians(max_angle))
    geometry, rows = _grid_geometry(grid.theta_h.tobytes(), grid.theta_d.tobytes(), grid.phi_d.tobytes(), limit)
    part = np.ix_(*rows)
    fold = _Fold((*(len(r) for r in rows), len(grid.phi_d)))
    k = fold.banded[3]
    if len(grid.phi_d) < 2 * k:
        return cells
    h, d = grid.theta_h[rows[0], None, None], grid.theta_d[None, rows[1], None]
    weight = np.asarray(fold.unfold(np.asarray(cells.weight)))
    at_cells = _plain_geometry(h, d, grid.phi_d, weight > 0)
    relative = loss.weight(at_cells)
    weight = weight if relative is None else weight * np.asarray(relative)
    rule = row_rule(np.where(grid.phi_d > np.pi, 2 * np.pi - grid.phi_d, grid.phi_d), weight, k)
    planes = np.where(used[part], _block(table.planes, rows), 0.0)
    transformed = np.asarray(loss.transform(jnp.asarray(planes), at_cells))
    coefficients = rule.project(transformed)
    remainder = (weight * transformed**2).sum((1, 2, 3)) - (coefficients**2).sum((1, 2, 3))
    at_nodes = _plain_geometry(h, d, rule.phi, rule.weight > 0)
    assert loss.inverse is not None  # a transform comes with its inverse
    values = np.asarray(loss.inverse(jnp.asarray(rule.at_nodes(coefficients)), at_nodes))
    relative = loss.weight(at_nodes)
    node_weight = rule.weight if relative is None else rule.weight / np.asarray(relative)
    nodes = _Fold((*(len(r) for r in rows), k))

    def before(first: np.ndarray, leaf: Array, fill: float = 0.0) -> Array:
        return jnp.concatenate([nodes(first, fill), leaf])

    def stencil(cosine: Array, leaf: PolarStencil | None) -> PolarStencil:
        assert leaf is not None
        s = PolarStencil.of(np.asarray(cosine), limit)
        return PolarStencil(before(np.asarray(s.index), leaf.index, 1), before(np.asarray(s.fraction), leaf.fraction), limit)

    joined = Geometry(
        cos_i=before(np.asarray(at_nodes.cos_i), geometry.cos_i, 1.0),
        cos_o=before(np.asarray(at_nodes.cos_o), geometry.cos_o, 1.0),
        cos_h=geometry.cos_h,
        sin2_h=geometry.sin2_h,
        cos_d=before(np.asarray(at_nodes.cos_d), geometry.cos_d, 1.0),
        sin2_d=before(np.asarray(at_nodes.sin2_d), geometry.sin2_d),
        stencil_i=stencil(at_nodes.cos_i, geometry.stencil_i),
        stencil_o=stencil(at_nodes.cos_o, geometry.stencil_o),
    )
    measured, share = before(values, cells.measured), before(node_weight, cells.weight)
    count = share.shape[0] - cells.weight.shape[0]
    left = jnp.asarray(np.maximum(remainder, 0.0))
    return Samples(joined, measured, share, cells.banded, cells.band_axes, left, compressed=count)


def _block(planes: Reals, rows: tuple[NDArray[np.int64], NDArray[np.int64]]) -> Reals:
    """The rows of theta_h and theta_d that are fitted, of ``[C, H, D, P]``."""
    return planes[:, rows[0]][:, :, rows[1]]


def _plain_geometry(h: Reals, d: Reals, phi: Reals, fitted: NDArray[np.bool_]) -> Geometry:
    """Geometry of half/difference angles; where not fitted, of the normal direction."""
    cos_i, cos_o = (jnp.asarray(np.where(fitted, c, 1.0)) for c in polar_cosines(h, d, phi))
    cos_h, sin2_h, cos_d, sin2_d = (jnp.asarray(a) for a in (np.cos(h), np.sin(h) ** 2, np.cos(d), np.sin(d) ** 2))
    return Geometry(cos_i, cos_o, cos_h, sin2_h, cos_d, sin2_d)


@lru_cache(maxsize=1)
def _grid_geometry(
    theta_h: bytes, theta_d: bytes, phi_d: bytes, limit: float
) -> tuple[Geometry, tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Geometry of a half/difference grid in blocks, and the rows of theta_h and theta_d that have any cell within the
    limit; the tables of a batch share it.
    """
    h, d, p = (np.frombuffer(a) for a in (theta_h, theta_d, phi_d))
    cos_i, cos_o = HalfDifferenceGrid(h, d, p, h, d, p).polar_cosines()
    valid = (cos_i >= np.cos(limit) - 1e-12) & (cos_o >= np.cos(limit) - 1e-12)
    rows = np.flatnonzero(valid.any((1, 2))), np.flatnonzero(valid.any((0, 2)))
    part = np.ix_(*rows)
    # Guard: cells that are not fitted have weight 0, and 0 * inf = NaN: they get a harmless direction
    # (tests/test_samples.py::test_unused_cells_are_harmless).
    cos_i, cos_o = (np.where(valid, c, 1.0)[part] for c in (cos_i, cos_o))
    h, d = h[rows[0], None, None], d[None, rows[1], None]
    fold = _Fold(cos_i.shape)

    def stencil(cosine: Reals) -> PolarStencil:
        s = PolarStencil.of(cosine, limit)
        return PolarStencil(fold(np.asarray(s.index), 1), fold(np.asarray(s.fraction)), limit)

    geometry = Geometry(
        cos_i=fold(cos_i, 1.0),
        cos_o=fold(cos_o, 1.0),
        cos_h=fold(np.cos(h), 1.0),
        sin2_h=fold(np.sin(h) ** 2),
        cos_d=fold(np.cos(d), 1.0),
        sin2_d=fold(np.sin(d) ** 2),
        stencil_i=stencil(cos_i),
        stencil_o=stencil(cos_o),
    )
    return geometry, rows


def _scattered_samples(table: Table, used: NDArray[np.bool_], weight: Reals, limit: float) -> Samples:
    wi, wo = (v[used] for v in table.layout.directions())
    values, share = table.planes[:, used], weight[used]
    slots = _band_slots(wi, wo)
    banded = slots.shape[1:]
    slots = slots.reshape(len(slots), -1)
    fitted = slots >= 0
    normal = np.array([0.0, 0.0, 1.0])
    # Guard: empty slots hold the normal direction with weight 0, so that nothing divides by zero.
    wi, wo = (np.where(fitted[..., None], v[slots], normal) for v in (wi, wo))
    g: Any = from_directions(wi, wo)
    if table.isotropic:
        g = eqx.tree_at(lambda q: (q.h_x2, q.h_y2), g, (None, None), is_leaf=lambda x: x is None)
    stencils = [PolarStencil.of(v[..., 2], limit) for v in (wi, wo)]
    g = eqx.tree_at(lambda q: (q.stencil_i, q.stencil_o), g, tuple(stencils), is_leaf=lambda x: x is None)
    measured = np.moveaxis(np.where(fitted, values[:, slots], 0.0), 0, 1)
    kept = jnp.asarray(np.where(fitted, share[slots], 0.0))
    none = jnp.zeros(table.channels)
    return Samples(jax.tree.map(jnp.asarray, g), jnp.asarray(measured), kept, banded, (0,), none)


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
