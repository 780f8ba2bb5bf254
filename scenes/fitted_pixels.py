"""What a model is fitted to: some pixels of the picture, each the sum of the few directions of light that make it.

The residual of a pixel is its difference from the measured table as it is seen, in ITP times 720: the root of the mean
square over the pixels is the RMS ΔE ITP of the picture. Model and table take the same directions, so that what a few
directions miss of a pixel is missed by both.

Lights without extent take one direction each; ambient light takes the albedo of the model at a few polar angles; lights of
some extent take a few sampled directions, and fewer pixels then stand for the picture.
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

from ..angles import directions
from ..colours import luminance
from ..errors import InputError
from ..geometry import Geometry, from_directions
from ..physics import hemisphere
from ..polar import PolarStencil
from ..programs import program
from ..tables import HalfDifferenceGrid, Table
from .appearance import Look
from .illumination import Illumination
from .interpolated import evaluated, measured
from .rendering import cast
from .sampling import R2, drawn, techniques_of
from .scene import Reals
from .seen import itp

DIRECTIONS = 512
"""Directions of punctual light that are fitted: a pixel for each, or for each few where there are several lights."""
PIXELS, ROUNDS = 128, 6
"""Pixels where light has some extent, and directions of each technique of each."""
ELSEWHERE, SHARE = 128, 0.0002
"""Cells of the whole table, and their share of the weight."""
OUTERMOST = 80.0
"""Largest polar angle of such cells, degrees."""
ANGLES, RULE = 6, (24, 8)
"""Polar angles at which the albedo is integrated under ambient light, and nodes in theta_h and phi_h of each."""
LIMIT = np.pi / 2


class Ambient(eqx.Module):
    """Pixels under even light, whose albedo is a polynomial in cos_o through its values at K angles."""

    weight: Float[Array, "K nodes"]
    """The albedo at an angle is the sum over nodes of weight times BRDF."""
    spread: Float[Array, "P K"]
    """From albedos at the angles to those of the pixels."""
    scale: Float[Array, " C"]
    """Shown value for each unit of albedo."""


class Shown(eqx.Module):
    """Pixels, and cells of the table beside them, as sums of directions; and how the measured table looks there."""

    geometry: Geometry
    """Of the J directions of each of the P pixels, of the E cells, then of the K x nodes of :class:`Ambient`."""
    arriving: Float[Array, "PJ+E C"]
    """Shown value for each unit of BRDF, of the pixels' directions and of the cells."""
    ambient: Ambient | None
    target: Float[Array, "P+E 3"]
    """How the measured table looks: :func:`.seen.itp`."""
    root_weight: Float[Array, " P+E"]
    shape: tuple[int, int] = eqx.field(static=True)
    """P and J."""

    def values(self, f: Float[Array, "all C"]) -> Float[Array, "P+E C"]:
        """Shown values of BRDF values at :attr:`geometry`; linear in them."""
        many = self.shape[0] * self.shape[1]
        own = f[: len(self.arriving)] * self.arriving
        pixels = own[:many].reshape(*self.shape, -1).sum(1)
        if self.ambient is not None:
            a = self.ambient
            albedo = (a.weight[..., None] * f[len(own) :].reshape(*a.weight.shape, -1)).sum(1)
            pixels = pixels + a.spread @ albedo * a.scale
        both: Array = jnp.concatenate([pixels, own[many:]])
        return both

    def residual(self, values: Float[Array, "P+E C"]) -> Float[Array, "P+E 3"]:
        """Weighted difference from the measured table, as it is seen."""
        difference: Array = self.root_weight[:, None] * (itp(values) - self.target)
        return difference


def shown(here: Look) -> Shown:
    """What a scene shows ready to be fitted, in float64: some of its pixels, whatever their number.

    Half of them stand for equal numbers of lit pixels and half for equal sums of luminance, so that narrow highlights are
    among them. Together with :data:`ELSEWHERE` cells of the whole table, which keep a model from doing anything at all where
    the scene has no pixel: as if lit so that a white Lambertian surface that faces the light shows 0.8.
    """
    pixels, root_weight = _drawn(here)
    part = here.light.part(pixels)
    channels = here.table.channels
    wi, wo, arriving = _directions(part, here.alpha, channels)
    there, back = _cells(here.table)
    cells = np.repeat(0.8 * np.pi * there[:, 2:], channels, 1)
    lit = np.concatenate([arriving.reshape(-1, channels) * here.exposure, cells])
    root_weight = np.concatenate([root_weight * np.sqrt(1 - SHARE), np.full(ELSEWHERE, np.sqrt(SHARE / ELSEWHERE))])
    each = wi.shape[1]
    wi, wo = np.concatenate([wi.reshape(-1, 3), there]), np.concatenate([wo.reshape(-1, 3), back])
    ambient = None
    if part.everywhere is not None:
        ambient, at, to = _ambient(np.asarray(part.wo)[:, 2], np.asarray(part.everywhere.radiance) * here.exposure)
        wi, wo = np.concatenate([wi, at]), np.concatenate([wo, to])
    with jax.enable_x64(True):
        g: Any = _geometry(wi, wo)
        f = np.asarray(evaluated(*cast((measured(here.table)[0], wi, wo), "float64")))
    g = replace(g, stencil_i=PolarStencil.of(wi[:, 2], LIMIT), stencil_o=PolarStencil.of(wo[:, 2], LIMIT))
    parts: Any = (g, lit, ambient, np.zeros(()), root_weight, (len(pixels), each))
    data = Shown(*parts)
    with jax.enable_x64(True):
        target = np.asarray(itp(data.values(jnp.asarray(f))))
    found: Shown = eqx.tree_at(lambda d: d.target, data, target)
    return found


@program
def _geometry(wi: Any, wo: Any) -> Geometry:
    return from_directions(wi, wo)


def _drawn(here: Look) -> tuple[NDArray[np.intp], Reals]:
    """Lit pixels, one of each equal step of the summed density in the order of luminance, and roots of their weights."""
    y = luminance(here.reference.values)
    lit = y > 0
    density = (lit / lit.sum() + y / y.sum()) / 2
    order = np.argsort(y, kind="stable")
    punctual = here.light.extended is None
    count = DIRECTIONS // max(len(here.light.punctual), 1) if punctual else PIXELS
    steps = np.cumsum(density[order])
    chosen = order[np.minimum(np.searchsorted(steps, (np.arange(count) + 0.5) / count * steps[-1]), len(order) - 1)]
    return chosen, np.sqrt(1 / (len(y) * density[chosen] * count))


def _directions(light: Illumination, alpha: float, channels: int) -> tuple[Reals, Reals, Reals]:
    """Directions to the light and to the camera ``[P, J, 3]`` and what f there is multiplied by ``[P, J, C]``."""
    rows = [(np.asarray(p.wi), np.asarray(p.arriving)) for p in light.punctual]
    if light.extended is not None:
        many = techniques_of(light.extended)
        shift = np.random.default_rng(0).random((many, 2, len(light.wo)))
        for i in range(ROUNDS):
            u = shift + np.asarray(R2)[:, None] * i
            given = light.extended, np.asarray(light.wo), np.float64(alpha), u - np.floor(u)
            with jax.enable_x64(True):
                wi, reach = drawn(*cast(given, "float64"))
            rows += [(w, a / ROUNDS) for w, a in zip(np.asarray(wi), np.asarray(reach), strict=True)]
    if not rows:
        rows = [(np.zeros((len(light.wo), 3)), np.zeros((len(light.wo), channels)))]
    towards, arriving = (np.stack(x, 1) for x in zip(*rows, strict=True))
    # Guard: below the horizon models are not defined, and 0 * inf = NaN; the normal stands for such directions
    # (tests/test_scenes_screen.py::test_no_direction_below_the_horizon).
    towards = np.where(arriving.any(-1, keepdims=True), towards, [0.0, 0.0, 1.0])
    return towards, np.broadcast_to(np.asarray(light.wo)[:, None], towards.shape), arriving


def _cells(table: Table) -> tuple[Reals, Reals]:
    """Directions of some cells of the whole table, every theta_h alike so that narrow spikes are seen."""
    grid = table.layout
    assert isinstance(grid, HalfDifferenceGrid)
    used = np.flatnonzero(table.within(np.radians(OUTERMOST)))
    if not len(used):
        raise InputError(
            f"{table.source or table.material}: no measured cell has both polar angles within {OUTERMOST:g} degrees"
        )
    h, d, p = np.unravel_index(np.random.default_rng(0).choice(used, ELSEWHERE), grid.shape)
    return directions(grid.theta_h[h], grid.theta_d[d], grid.phi_d[p])


def _ambient(cosine: Reals, scale: Reals) -> tuple[Ambient, Reals, Reals]:
    """The albedo at pixels of cos_o, and the directions that it takes."""
    low, high = cosine.min(), cosine.max()
    unit = np.polynomial.chebyshev.chebpts1(ANGLES)
    nodes = (low + high) / 2 + (high - low) / 2 * unit
    basis = np.polynomial.chebyshev.chebvander(unit, ANGLES - 1)
    # Guard: 0/0 where all pixels are seen at one angle (tests/test_scenes_screen.py::test_one_angle).
    place = (cosine - (low + high) / 2) / max((high - low) / 2, 1e-12)
    spread = np.polynomial.chebyshev.chebvander(place, ANGLES - 1) @ np.linalg.inv(basis)
    rules = [hemisphere(float(np.arccos(c)), RULE) for c in nodes]
    wi, weight = np.stack([r[1] for r in rules]), np.stack([r[2] for r in rules])
    wo = np.broadcast_to(np.stack([r[0] for r in rules])[:, None], wi.shape)
    # Guard: directions of no weight may lie below the horizon, where models are not defined; the normal stands for them
    # (tests/test_scenes_screen.py::test_no_direction_below_the_horizon).
    wi = np.where(weight[..., None] > 0, wi, [0.0, 0.0, 1.0])
    parts: Any = (weight, spread, scale)
    return Ambient(*parts), wi.reshape(-1, 3), wo.reshape(-1, 3)


__all__ = ["Ambient", "Shown", "shown"]
