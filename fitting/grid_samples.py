"""Half/difference tables in blocks, and their compressed copies.

What does not depend on the values (geometry, weights, the rules of the rows) is kept for the next table with the same grid
and the same cells measured, as the tables of a collection have.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array
from numpy.typing import NDArray

from ..angles import polar_cosines
from ..geometry import Geometry
from ..polar import PolarStencil
from ..programs import program
from ..tables import HalfDifferenceGrid, Table
from .compression import RowRules, row_rules
from .losses import Loss
from .samples import STRIDED, Blocks, Samples, shares, spread_order
from .threads import in_threads

Reals = NDArray[np.float64]
Transform = Any

THETA_H_BANDS = 9


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
        self.order = spread_order(self.steps[0] * self.steps[1])
        self.blocks = len(self.order), bands * rows, self.banded[2] * self.banded[3]
        """Shape of an array in blocks."""

    def __call__(self, a: np.ndarray, fill: float = 0.0) -> Array:
        """Blocks for a program; what does not depend on theta_h or (theta_d, phi_d) keeps an axis of length 1 there, and
        what is the same in all blocks has B = 1.
        """
        rows = 1 if a.shape[0] == 1 else self.blocks[1]
        if a.shape[1:] == (1, 1):
            return on_device(np.pad(a.reshape(1, -1, 1), ((0, 0), (0, rows - a.shape[0]), (0, 0)), constant_values=fill))
        out = aligned((self.blocks[0], rows, self.blocks[2]), a.dtype, fill)
        return on_device(self.fold(np.broadcast_to(a, (a.shape[0], *self.shape[1:])), out))

    def fold(self, a: np.ndarray, out: np.ndarray) -> np.ndarray:
        """Blocks of ``[H, D, P]``, written into ``out`` but for the cells that fill the blocks up."""
        for block, at in zip(out, self.order, strict=True):
            part = a[:, at // self.steps[1] :: self.steps[0], at % self.steps[1] :: self.steps[1]]
            block.reshape(len(block), *self.banded[2:])[: len(a), : part.shape[1], : part.shape[2]] = part
        return out


def aligned(shape: tuple[int, ...], dtype: Any = float, fill: float = 0.0) -> np.ndarray:
    """An array that programs take as it is, without a copy: it begins at a multiple of 64 bytes."""
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    raw = np.empty(size + 64, np.uint8)
    begin = -raw.ctypes.data % 64
    out: np.ndarray = raw[begin : begin + size].view(dtype).reshape(shape)
    out[...] = fill
    return out


def on_device(a: np.ndarray) -> Array:
    """An array for programs. A transfer: ``jnp.asarray`` compiles a program for every shape."""
    placed: Array = jax.device_put(a)
    return placed


@dataclass(frozen=True, eq=False)
class _Rows:
    """The rows of a grid up to the last that has a cell within the limit, in blocks."""

    part: tuple[slice, slice]
    """Where they are, along theta_h and theta_d."""
    theta_h: Reals
    """``[H, 1, 1]``"""
    theta_d: Reals
    """``[1, D, 1]``"""
    fold: _Fold
    geometry: Geometry


@lru_cache(maxsize=1)
def _rows(grid: HalfDifferenceGrid, limit: float, along_phi: int) -> _Rows:
    visible = grid.visible(limit, 1e-12)
    part = _first(np.any(visible, (1, 2))), _first(np.any(visible, (0, 2)))
    h, d = grid.theta_h[part[0], None, None], grid.theta_d[None, part[1], None]
    # Guard: cells that are not fitted have weight 0, and 0 * inf = NaN: they get a harmless direction
    # (tests/test_samples.py::test_unused_cells_are_harmless).
    g = _plain_geometry(h, d, grid.phi_d, visible[part])
    fold = _Fold(g.cos_i.shape, along_phi)
    return _Rows(part, h, d, fold, _folded(g, fold, limit))


def _first(seen: NDArray[np.bool_]) -> slice:
    """The first of some rows, up to the last that is seen."""
    return slice(0, int(np.flatnonzero(seen).max(initial=0)) + 1)


@dataclass(frozen=True, eq=False)
class _Weights:
    """Shares of the measure of the fitted cells."""

    rows: Reals
    """``[H, D, P]``"""
    blocks: Array


@lru_cache(maxsize=1)
def _weights(grid: HalfDifferenceGrid, limit: float, along_phi: int, measure: str, fitted: bytes) -> _Weights:
    used = np.unpackbits(np.frombuffer(fitted, np.uint8), count=int(np.prod(grid.shape))).reshape(grid.shape).astype(bool)
    rows = _rows(grid, limit, along_phi)
    weight = shares(grid, used, measure)[rows.part]
    return _Weights(weight, rows.fold(weight))


def grid_samples(
    table: Table, grid: HalfDifferenceGrid, used: NDArray[np.bool_], measure: str, limit: float, along_phi: int
) -> Samples:
    """Blocks of the fitted cells of a table."""
    rows = _rows(grid, limit, along_phi)
    weights = _weights(grid, limit, along_phi, measure, np.packbits(used).tobytes())
    measured = aligned((rows.fold.blocks[0], table.channels, *rows.fold.blocks[1:]))

    def fold(c: int) -> None:
        rows.fold.fold(_values(table, used, rows, c), measured[:, c])

    list(in_threads(fold, range(table.channels)))
    return Samples(Blocks(rows.geometry, on_device(measured), weights.blocks), rows.fold.banded, (0, 2))


def _values(table: Table, used: NDArray[np.bool_], rows: _Rows, c: int) -> Reals:
    """Values of one channel ``[H, D, P]``, 0 where not fitted."""
    return np.where(used[rows.part], table.planes[c][rows.part], 0.0)


@dataclass(frozen=True, eq=False)
class _Compression:
    """How the rows of a table are compressed, whatever their values."""

    transforming: Geometry
    """Of the cells ``[H, D, P]``."""
    weight: Array
    """Weights of the loss ``[H, D, P]``."""
    rules: RowRules
    at_nodes: Geometry
    """Of the nodes ``[H, D, k]``."""
    fold: _Fold
    geometry: Geometry
    node_weight: Array


@lru_cache(maxsize=2)
def _compression(grid: HalfDifferenceGrid, limit: float, k: int, measure: str, fitted: bytes, loss: Loss) -> _Compression:
    rows, weight = _rows(grid, limit, k), _weights(grid, limit, k, measure, fitted).rows
    g = _plain_geometry(rows.theta_h, rows.theta_d, grid.phi_d, weight > 0)
    weight = weight if loss.weigh is None else weight * np.asarray(loss.weigh(g))
    rules = row_rules(np.where(grid.phi_d > np.pi, 2 * np.pi - grid.phi_d, grid.phi_d), weight, k)
    node_weight = rules.weight
    at_nodes = _plain_geometry(rows.theta_h, rows.theta_d, rules.phi, node_weight > 0)
    relative = loss.weight(at_nodes)
    node_weight = node_weight if relative is None else node_weight / np.asarray(relative)
    fold = _Fold(node_weight.shape, k)
    return _Compression(
        jax.tree.map(on_device, g),
        on_device(weight),
        rules,
        at_nodes,
        fold,
        _folded(at_nodes, fold, limit),
        fold(node_weight),
    )


@program
def _transformed(loss: Loss, values: Array | Reals, g: Geometry, weight: Array) -> tuple[Array, Array]:
    """What the loss sees of the values ``[H, D, P]`` of a channel, and its weighted square sum."""
    transform: Transform = loss.transform
    seen = jnp.broadcast_to(transform(values, g), values.shape)
    return seen, jnp.sum(weight * seen**2)


@program
def _inverse(loss: Loss, seen: Array | Reals, g: Geometry) -> Array:
    inverse: Transform = loss.inverse
    return jnp.broadcast_to(inverse(seen, g), seen.shape)


def compress(whole: Samples, table: Table, used: NDArray[np.bool_], max_angle: float, measure: str, loss: Loss) -> Samples:
    """The samples with a compressed copy of the table beside them, made for one loss (bound to the table): each row along
    phi_d has as many nodes as a block has cells of it.

    The same samples where that is not possible: scattered samples, short rows, losses without a transform.
    """
    grid = table.layout
    if loss.transform is None or loss.inverse is None or not isinstance(grid, HalfDifferenceGrid) or not grid.isotropic:
        return whole
    k = whole.banded[3]
    if len(grid.phi_d) < 2 * k:
        return whole
    limit = float(np.radians(max_angle))
    rows = _rows(grid, limit, k)
    how = _compression(grid, limit, k, measure, np.packbits(used).tobytes(), loss)
    nodes = aligned((how.fold.blocks[0], table.channels, *how.fold.blocks[1:]))

    def channel(c: int) -> float:
        """Fills in a channel's nodes and returns what they leave out of its cost."""
        seen, total = _transformed(loss, _values(table, used, rows, c), how.transforming, how.weight)
        at_nodes, kept = how.rules.compress(np.asarray(seen).reshape(-1, seen.shape[-1]))
        values = _inverse(loss, at_nodes.reshape(how.rules.phi.shape), how.at_nodes)
        how.fold.fold(np.asarray(values), nodes[:, c])
        return max(float(total) - kept, 0.0)

    remainder = np.array(list(in_threads(channel, range(table.channels))))
    blocks = Blocks(how.geometry, on_device(nodes), how.node_weight)
    return Samples(whole.cells, whole.banded, whole.band_axes, blocks, on_device(remainder))


def _folded(g: Geometry, fold: _Fold, limit: float) -> Geometry:
    """Geometry ``[H, D, P]`` in blocks, with the stencils of its polar angles."""

    def stencil(cosine: Array) -> PolarStencil:
        s = PolarStencil.of(np.asarray(cosine), limit)
        return PolarStencil(fold(np.asarray(s.index), 1), fold(np.asarray(s.fraction)), limit)

    cos_i, cos_o, cos_h, cos_d = (fold(np.asarray(c), 1.0) for c in (g.cos_i, g.cos_o, g.cos_h, g.cos_d))
    sin2_h, sin2_d = (fold(np.asarray(c)) for c in (g.sin2_h, g.sin2_d))
    return Geometry(cos_i, cos_o, cos_h, sin2_h, cos_d, sin2_d, stencil_i=stencil(g.cos_i), stencil_o=stencil(g.cos_o))


def _plain_geometry(h: Reals, d: Reals, phi: Reals, fitted: NDArray[np.bool_]) -> Geometry:
    """Geometry of half/difference angles; where not fitted, of the normal direction."""
    cos_i, cos_o = (np.where(fitted, c, 1.0) for c in polar_cosines(h, d, phi))
    fields: Any = cos_i, cos_o, np.cos(h), np.sin(h) ** 2, np.cos(d), np.sin(d) ** 2
    return Geometry(*fields)


__all__ = ["compress", "grid_samples"]
