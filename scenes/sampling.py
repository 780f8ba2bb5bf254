"""Light of some extent, by multiple importance sampling of the lights and of the lobe (Veach & Guibas 1995).

Every technique draws one direction for each pixel in each round; with the balance heuristic the estimate of a round is

    sum_t f(w_t) L(w_t) cos(theta_t) / sum_s p_s(w_t),

whatever drew w_t. The techniques are a cosine lobe, a GGX lobe of half vectors for the visible normals, and one for each
light. Points within a batch follow the R2 sequence of Roberts (2018), shifted at random for each pixel; the batches have
shifts of their own, so that their spread is the noise.

The same key draws the same directions for every material, so that the noise of two pictures does not count as difference.
"""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import from_directions
from .illumination import Ball, Extended, Sky

BATCHES = 4
R2 = (0.7548776662466927, 0.5698402909980532)
"""1/g and 1/g^2 with g^3 = g + 1."""

Directions = Float[Array, "... 3"]
Reals = Float[Array, "..."]


def sampled(
    brdf: Any, light: Extended, wo: Float[Array, "P 3"], alpha: Array, rounds: int, key: Array
) -> Float[Array, "batches P C"]:
    """Reflected radiance, estimated by :data:`BATCHES` independent batches of ``rounds`` rounds each.

    ``alpha`` is the width of the GGX lobe that directions are drawn from: a matter of noise, not of the mean.
    """
    techniques = techniques_of(light)

    def batch(k: Array) -> Array:
        shift = jax.random.uniform(k, (techniques, 2, len(wo)), wo.dtype)

        def add(i: int, total: Array) -> Array:
            u = shift + jnp.asarray(R2, wo.dtype)[:, None] * i
            return total + _round(brdf, light, wo, alpha, u - jnp.floor(u))

        start = jax.eval_shape(lambda: _round(brdf, light, wo, alpha, shift))
        total: Array = jax.lax.fori_loop(0, rounds, add, jnp.zeros(start.shape, start.dtype))
        return total / rounds

    means: Array = jax.lax.map(batch, jax.random.split(key, BATCHES))
    return means


def _round(brdf: Any, light: Extended, wo: Array, alpha: Array, u: Array) -> Array:
    """One direction of each technique, combined."""
    wi, arriving = drawn(light, wo, alpha, u)
    total: Array = (brdf(wi, wo) * arriving).sum(0)
    return total


def techniques_of(light: Extended) -> int:
    """How many directions a round has for each pixel."""
    return 2 + len(light.balls) + (light.sky is not None)


def drawn(
    light: Extended, wo: Float[Array, "P 3"], alpha: Array, u: Float[Array, "techniques 2 P"]
) -> tuple[Float[Array, "techniques P 3"], Float[Array, "techniques P C"]]:
    """One direction of each technique for each pixel, of ``u`` in [0, 1), and what f there is multiplied by."""
    directions = [draw_cosine(u[0]), draw_lobe(wo, alpha, u[1])]
    directions += [draw_ball(ball, u[2 + k]) for k, ball in enumerate(light.balls)]
    if light.sky is not None:
        directions.append(draw_sky(light.sky, u[-1]))
    wi = jnp.stack(directions)
    cosine = jnp.maximum(wi[..., 2], 0)
    above = cosine > 0
    density = cosine / jnp.pi + lobe_density(wi, wo, alpha, above)
    radiance = jnp.zeros(1, wo.dtype) if light.constant is None else light.constant
    for ball in light.balls:
        inside = ball_holds(ball, wi)
        density = density + inside / (2 * jnp.pi * ball.vers)
        radiance = radiance + inside[..., None] * ball.radiance
    if light.sky is not None:
        row, column = sky_pixel(light.sky, wi)
        density = density + light.sky.density[row, column]
        radiance = radiance + light.sky.radiance[row, column]
    # Guard: below the horizon cosine and density may both be 0 (tests/test_scenes_sampling.py::test_below_the_horizon).
    weight = jnp.where(above, cosine / jnp.where(above, density, 1), 0)
    return wi, radiance * weight[..., None]


def draw_cosine(u: Float[Array, "2 P"]) -> Directions:
    """A direction with density cos(theta)/pi."""
    r, phi = jnp.sqrt(u[0]), 2 * jnp.pi * u[1]
    return jnp.stack([r * jnp.cos(phi), r * jnp.sin(phi), jnp.sqrt(1 - u[0])], -1)


def draw_lobe(wo: Directions, alpha: Array, u: Float[Array, "2 P"]) -> Directions:
    """The mirror direction of wo about a normal of a GGX surface that wo sees (Dupuy & Benyoub 2023, listing 3)."""
    flat = _unit(wo * jnp.stack([alpha, alpha, jnp.ones_like(alpha)]))
    phi = 2 * jnp.pi * u[0]
    z = (1 - u[1]) * (1 + flat[..., 2]) - flat[..., 2]
    r = jnp.sqrt(jnp.maximum(1 - z * z, 0))
    cap = jnp.stack([r * jnp.cos(phi), r * jnp.sin(phi), z], -1) + flat
    m = _unit(cap * jnp.stack([alpha, alpha, jnp.ones_like(alpha)]))
    return 2 * (wo * m).sum(-1, keepdims=True) * m - wo


def lobe_density(wi: Directions, wo: Directions, alpha: Array, above: Array) -> Reals:
    """Density of :func:`draw_lobe`: G1(wo) D(h)/(4 cos_o), with Smith's G1 of GGX; 0 where not ``above``."""
    up = jnp.zeros(3, wi.dtype).at[2].set(1)
    g = from_directions(jnp.where(above[..., None], wi, up), wo)
    a2 = alpha * alpha
    d = a2 / (jnp.pi * (g.sin2_h + a2 * g.cos2_h) ** 2)
    density: Array = d / (2 * (g.cos_o + jnp.sqrt(a2 + (1 - a2) * g.cos_o**2)))
    return jnp.where(above, density, 0)


def draw_ball(ball: Ball, u: Float[Array, "2 P"]) -> Directions:
    """A direction within the cone of a luminous sphere, evenly over its solid angle."""
    vers, phi = u[0] * ball.vers, 2 * jnp.pi * u[1]
    r = jnp.sqrt(vers * (2 - vers))
    t, b = _around(ball.axis)
    return (r * jnp.cos(phi))[:, None] * t + (r * jnp.sin(phi))[:, None] * b + (1 - vers)[:, None] * ball.axis


def ball_holds(ball: Ball, wi: Directions) -> Reals:
    """Whether directions lie in the cone, 1 or 0. 1 - cos is |wi - axis|^2/2, which does not cancel for small lights."""
    return (((wi - ball.axis) ** 2).sum(-1) / 2 <= ball.vers).astype(wi.dtype)


def draw_sky(sky: Sky, u: Float[Array, "2 P"]) -> Directions:
    """A direction in proportion to the light of an image, in the frame of the surface."""
    rows, columns = sky.density.shape
    row = jnp.minimum(jnp.searchsorted(sky.rows, u[0], side="right"), rows - 1)
    column = jnp.zeros_like(row)
    for bit in reversed(range(int(np.ceil(np.log2(columns))))):  # the first column whose cumulative share exceeds u
        ahead = column + (1 << bit)
        skip = (ahead < columns) & (sky.columns[row, jnp.minimum(ahead, columns) - 1] <= u[1])
        column = jnp.where(skip, ahead, column)
    y = _share(u[0], _before(sky.rows[row - 1], row), sky.rows[row])
    x = _share(u[1], _before(sky.columns[row, column - 1], column), sky.columns[row, column])
    top, bottom = jnp.cos(jnp.pi / rows * row), jnp.cos(jnp.pi / rows * (row + 1))
    cos_up = top + y * (bottom - top)
    phi = 2 * jnp.pi / columns * (column + x)
    r = jnp.sqrt(jnp.maximum(1 - cos_up**2, 0))
    world = jnp.stack([r * jnp.sin(phi), cos_up, -r * jnp.cos(phi)], -1)
    return (sky.frame * world[:, None, :]).sum(-1)


def _before(cumulative: Array, index: Array) -> Array:
    """The cumulative share before an entry: 0 before the first."""
    return jnp.where(index > 0, cumulative, 0)


def _share(u: Array, low: Array, high: Array) -> Array:
    """How far u lies between two cumulative shares, in [0, 1]."""
    return jnp.clip((u - low) / jnp.where(high > low, high - low, 1), 0, 1)


def sky_pixel(sky: Sky, wi: Directions) -> tuple[Array, Array]:
    """Row and column of an image that directions in the frame of the surface fall into."""
    rows, columns = sky.density.shape
    world = (sky.frame * wi[..., None]).sum(-2)
    polar = jnp.arctan2(jnp.hypot(world[..., 0], world[..., 2]), world[..., 1])
    turn = jnp.arctan2(world[..., 0], -world[..., 2]) / (2 * jnp.pi)
    row = jnp.clip((polar / jnp.pi * rows).astype(jnp.int32), 0, rows - 1)
    return row, jnp.floor(turn * columns).astype(jnp.int32) % columns


def _unit(v: Array) -> Array:
    return v / jnp.sqrt((v * v).sum(-1, keepdims=True))


def _around(n: Directions) -> tuple[Directions, Directions]:
    """Two directions across n (Duff et al. 2017, listing 3)."""
    x, y, z = n[..., 0], n[..., 1], n[..., 2]
    sign = jnp.where(z >= 0, 1, -1).astype(n.dtype)
    a = -1 / (sign + z)
    b = x * y * a
    return jnp.stack([1 + sign * x * x * a, sign * b, -sign * x], -1), jnp.stack([b, sign + y * y * a, -y], -1)


__all__ = ["BATCHES", "drawn", "sampled", "techniques_of"]
