"""A table made from known parameters, and those parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from zlib import crc32

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array
from numpy.typing import NDArray

from ...errors import InputError
from ...geometry import Geometry, from_directions
from ...models import parameter_values
from ...models.base import BRDF, channels, evaluate_channels
from ...programs import program
from ...tables.layout import HalfDifferenceGrid, Layout, Scattered, SphericalGrid
from ...tables.merl import Angles
from ...tables.table import Table, table
from .grazing import LOWEST, GrazingStencil
from .layouts import grid as grid_of
from .materials import material
from .noise import Noise, describe

GRID = (90, 90, 180)
"""That of the MERL database: theta_h, theta_d, phi_d."""
ANISOTROPIC_GRID = (24, 30, 20, 24)
"""phi_h, theta_h, theta_d, phi_d."""

HORIZON = LOWEST
"""Cosine below which a direction lies on the horizon: angles that add up to 90 degrees leave 1e-17 of either sign."""

CHUNK = 1 << 16
"""Cells evaluated at a time: 50 MB at work, whatever the table."""

Truth = dict[str, object]


def generate(
    name: str,
    *,
    grid: tuple[int, ...] | Layout | None = None,
    convention: Angles = "edge",
    noise: Sequence[Noise] = (),
    seed: int = 0,
    channels: int = 3,
) -> tuple[Table, Truth]:
    """The table of a named material, and the truth about it. The same arguments give the same bytes.

    Args:
        name: one of :func:`names`.
        grid: cells of a half/difference grid, ``(H, D, P)`` or with phi_h first ``(Q, H, D, P)``, or any layout; by
            default :data:`GRID`, or :data:`ANISOTROPIC_GRID` for anisotropic materials.
        convention: where in a cell of a grid given by its shape the value holds, its lower "edge" or its "centre".
        noise: parts applied in order; each has a random stream of its own.
        seed: of the noise; a material has the same noise on the same grid for the same seed.
        channels: number of channels C; published and misfit materials have at most 3.

    Returns:
        The table, float64 in 1/sr: cells with a direction at or below the horizon and missing ones hold -1 and are
        masked, and so is what noise makes negative. The truth: ``model``, ``parameters`` (lists of C numbers, or
        numbers), ``material``, ``description``, ``noise``, ``seed``, ``grid`` and ``angles``; plain data for JSON.

    Raises:
        InputError: the name is unknown, the grid has no such shape, the material does not have as many channels, or it
            is anisotropic and the grid is not.
    """
    known = material(name)
    if channels < 1:
        raise InputError(f"a table has at least 1 channel, not {channels}")
    if grid is None:
        grid = ANISOTROPIC_GRID if known.anisotropic else GRID
    layout = grid_of(grid, convention) if isinstance(grid, tuple) else grid
    angles = convention if isinstance(grid, tuple) else "exact"
    if known.anisotropic and layout.isotropic:
        raise InputError(f"{name} is anisotropic and the grid is not: give one of four axes, phi_h first")
    brdf = known.brdf(channels)
    cosine, planes = evaluate(brdf, layout)
    for k, part in enumerate(noise):
        planes = part.apply(planes, cosine, np.random.default_rng([seed, crc32(name.encode()), k]))
    planes[:, ~np.isfinite(planes).all(0)] = -1.0
    truth: Truth = {
        "material": name,
        "description": known.description,
        "model": brdf.name,
        "parameters": {key: value.tolist() for key, value in parameter_values(brdf).items()},
        "noise": [describe(part) for part in noise],
        "seed": seed,
        "grid": {"kind": _KINDS[type(layout)], "shape": list(layout.shape)},
        "angles": angles,
    }
    return table(planes, layout, name, source=f"synthetic:{name}", angles=angles), truth


def evaluate(brdf: BRDF, layout: Layout) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """cos of the lower direction of each cell ``[*shape]``, and the BRDF ``[C, *shape]`` in 1/sr, float64.

    Both are NaN where a direction is at or below the horizon.
    """
    cos_i, cos_o, geometry = _cells(layout)
    lower = np.minimum(cos_i, cos_o)
    above = np.flatnonzero(lower > HORIZON)
    planes = np.full((channels(brdf), lower.size), np.nan)
    with jax.enable_x64(True):
        for start in range(0, len(above), CHUNK):
            cells = above[start : start + CHUNK]
            padded = np.resize(cells, CHUNK)  # one shape, one trace
            planes[:, cells] = np.asarray(_evaluate(brdf, geometry(padded)))[:, : len(cells)]
    return np.where(lower > HORIZON, lower, np.nan).reshape(layout.shape), planes.reshape(-1, *layout.shape)


@program
def _evaluate(brdf: BRDF, g: Geometry) -> Array:
    return evaluate_channels(brdf, g, out_axis=0)


def _cells(
    layout: Layout,
) -> tuple[NDArray[np.float64], NDArray[np.float64], Callable[[NDArray[np.intp]], Geometry]]:
    """Flat cosines of light and viewer, and the geometry of cells given by their flat index."""
    if not isinstance(layout, HalfDifferenceGrid):
        wi, wo = (v.reshape(-1, 3) for v in layout.directions())
        return wi[:, 2], wo[:, 2], lambda cells: _tabulated(from_directions(wi[cells], wo[cells]))
    cos_i, cos_o = (np.broadcast_to(c, layout.shape).reshape(-1) for c in layout.polar_cosines())

    def from_angles(cells: NDArray[np.intp]) -> Geometry:
        index = np.unravel_index(cells, layout.shape)
        th, td = layout.theta_h[index[-3]], layout.theta_d[index[-2]]
        sin2_h = np.sin(th) ** 2
        g = Geometry(
            cos_i=jnp.asarray(cos_i[cells]),
            cos_o=jnp.asarray(cos_o[cells]),
            cos_h=jnp.asarray(np.cos(th)),
            sin2_h=jnp.asarray(sin2_h),
            cos_d=jnp.asarray(np.sin(np.pi / 2 - td)),
            sin2_d=jnp.asarray(np.sin(td) ** 2),
        )
        if layout.phi_h is not None:
            ph = layout.phi_h[index[0]]
            x2, y2 = sin2_h * np.cos(ph) ** 2, sin2_h * np.sin(ph) ** 2
            g = replace(g, h_x2=jnp.asarray(x2), h_y2=jnp.asarray(y2))
        return _tabulated(g)

    return cos_i, cos_o, from_angles


def _tabulated(g: Geometry) -> Geometry:
    """The same geometry, with Smith masking through the table that reaches the horizon."""
    light, viewer = (GrazingStencil.of(np.asarray(c)) for c in (g.cos_i, g.cos_o))
    return replace(g, stencil_i=light, stencil_o=viewer)  # type: ignore[arg-type]  # it has the same two methods


_KINDS = {HalfDifferenceGrid: "half_difference", SphericalGrid: "spherical", Scattered: "scattered"}

__all__ = ["ANISOTROPIC_GRID", "GRID", "Truth", "evaluate", "generate"]
