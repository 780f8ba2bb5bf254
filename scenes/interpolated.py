"""A measured table as a reflectance model: interpolated, so that a scene can be rendered with the measurement itself."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float
from numpy.typing import NDArray

from ..errors import InputError
from ..programs import program
from ..tables import HalfDifferenceGrid, Table

Reals = NDArray[np.float64]


class Measured(eqx.Module):
    """BRDF ``[..., C]`` in 1/sr by multilinear interpolation in (sqrt(theta_h), theta_d, phi_d), 0 below the horizon.

    As :func:`brdfit.reports.gather.interpolate` does, but as a program, and with a value everywhere: a cell that was not
    measured has the value of the nearest one that was, along phi_d first (where half and difference angles leave the
    horizon), then along theta_d, then along theta_h. ``filled`` of :func:`measured` says which those are.
    """

    values: Float[Array, "H D P C"]
    """One more plane along phi_d than the table has: the first again."""
    root_h: Float[Array, " H"]
    theta_d: Float[Array, " D"]
    phi_d: Float[Array, " P"]

    def __call__(self, wi: ArrayLike, wo: ArrayLike) -> Float[Array, "... C"]:
        """Value at unit vectors ``[..., 3]`` to light and viewer."""
        wi, wo = jnp.broadcast_arrays(jnp.asarray(wi), jnp.asarray(wo))
        above = (wi[..., 2] > 0) & (wo[..., 2] > 0)
        h, d, p = half_difference(wi, wo)
        period = self.phi_d[-1] - self.phi_d[0]
        p = self.phi_d[0] + jnp.mod(p - self.phi_d[0], period)
        total = jnp.zeros((), wi.dtype)
        axes = [_bracket(self.root_h, jnp.sqrt(h)), _bracket(self.theta_d, d), _bracket(self.phi_d, p)]
        for corner in np.ndindex(2, 2, 2):
            weight = jnp.ones((), wi.dtype)
            for side, (_, t) in zip(corner, axes, strict=True):
                weight = weight * (t if side else 1 - t)
            i, j, k = (low + side for side, (low, _) in zip(corner, axes, strict=True))
            total = total + weight[..., None] * self.values[i, j, k]
        return jnp.where(above[..., None], total, 0)


@program
def evaluated(table: Measured, wi: Array, wo: Array) -> Array:
    """The table at many directions, ``[..., C]``."""
    return table(wi, wo)


def half_difference(wi: Float[Array, "... 3"], wo: Float[Array, "... 3"]) -> tuple[Array, Array, Array]:
    """(theta_h, theta_d, phi_d) in radians, as :func:`brdfit.angles.half_difference` gives them.

    With s = l + v, d = l - v: d has the component d.(n x h) across the plane of n and h and -d.n in it, over sin(theta_h).
    """
    s, d = wi + wo, wi - wo
    length = jnp.sqrt((s * s).sum(-1))
    theta_h = jnp.arctan2(jnp.hypot(s[..., 0], s[..., 1]), s[..., 2])
    theta_d = jnp.arctan2(jnp.sqrt((d * d).sum(-1)), length)
    # Guard: two directions below the horizon may be opposite, and their sum 0 (tests/test_scenes.py::test_opposite).
    across = (d[..., 1] * s[..., 0] - d[..., 0] * s[..., 1]) / jnp.where(length > 0, length, 1)
    return theta_h, theta_d, jnp.arctan2(across, -d[..., 2])


def measured(table: Table) -> tuple[Measured, NDArray[np.bool_]]:
    """A table as a model, in float64, and which of its cells had to be filled, ``[H, D, P]``.

    Raises InputError for tables that are not on an isotropic half/difference grid.
    """
    grid = table.layout
    if not isinstance(grid, HalfDifferenceGrid) or not grid.isotropic:
        raise InputError(
            f"{table.source or table.material}: a scene is rendered from an isotropic half/difference grid; "
            "resample the table to one (MERL files are)"
        )
    gaps = ~table.mask
    values = np.moveaxis(np.where(table.mask, table.planes, 0.0), 0, -1)
    known = table.mask
    for axis in (2, 1, 0):
        values, known = _nearest(values, known, axis)
    period = grid.phi_d_edges[-1] - grid.phi_d_edges[0]
    whole = np.concatenate([values, values[:, :, :1]], 2)
    return Measured(
        *(np.asarray(a) for a in (whole, np.sqrt(grid.theta_h), grid.theta_d, np.append(grid.phi_d, grid.phi_d[0] + period)))  # type: ignore[arg-type]
    ), gaps


def _bracket(nodes: Array, x: Array) -> tuple[Array, Array]:
    """Index of the node at or below ``x`` and how far towards the next one it lies; the ends hold beyond the range."""
    if nodes.shape[0] == 1:
        return jnp.zeros(x.shape, jnp.int32), jnp.zeros_like(x)
    position = jnp.interp(x, nodes, jnp.arange(nodes.shape[0], dtype=x.dtype))
    low = jnp.minimum(position.astype(jnp.int32), nodes.shape[0] - 2)
    return low, position - low


def _nearest(values: Reals, known: NDArray[np.bool_], axis: int) -> tuple[Reals, NDArray[np.bool_]]:
    """Unknown entries from the nearest known one along an axis, where there is one."""
    if known.all():
        return values, known
    n = known.shape[axis]
    shape = [1, 1, 1]
    shape[axis] = n
    here = np.arange(n).reshape(shape)
    before = np.maximum.accumulate(np.where(known, here, -1), axis)
    after = np.flip(np.minimum.accumulate(np.flip(np.where(known, here, 2 * n), axis), axis), axis)
    take = np.where((before >= 0) & ((here - before <= after - here) | (after >= n)), before, np.minimum(after, n - 1))
    found = (before >= 0) | (after < n)
    filled = np.take_along_axis(values, take[..., None], axis)
    return np.where(known[..., None], values, np.where(found[..., None], filled, values)), found


__all__ = ["Measured", "half_difference", "measured"]
