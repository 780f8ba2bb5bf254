"""The light that reaches each pixel of an object, prepared once for a scene and used for every material.

Each sort of light has its own part, and a scene has only the parts that it calls for: those it has not are None or empty and
leave nothing in the program of its pictures.
"""

from __future__ import annotations

from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float
from numpy.typing import NDArray

from ..physics import FINE, hemisphere
from ..polar import PolarStencil
from .pixels import View, to_local
from .scene import Ambient, Area, Directional, Environment, Point, Reals, Scene, Vector, unit


class Punctual(eqx.Module):
    """A light of no extent: one direction for each pixel."""

    wi: Float[Array, "P 3"]
    """Unit vectors to the light in the frame of the surface."""
    arriving: Float[Array, "P C"]
    """Irradiance of the surface: that of a surface facing the light times cos_i; 0 below the horizon."""


class Everywhere(eqx.Module):
    """The same radiance from everywhere, and the rule by which the albedo of a material is integrated.

    albedo(theta_o) = int f cos_i dwi at 64 polar angles, interpolated at those of the pixels: accurate to the quadrature
    (half vectors, crowded where narrow lobes are), whose error :func:`brdfit.physics.directional_albedo` states.
    """

    radiance: Float[Array, " C"]
    wi: Float[Array, "n nodes 3"]
    wo: Float[Array, "nodes 3"]
    weight: Float[Array, "n nodes"]
    """Such that the albedo is sum over n of weight f(wi, wo)."""
    stencil: PolarStencil
    """Where the pixels' polar angles lie between the nodes."""


class Ball(eqx.Module):
    """A luminous sphere as each pixel sees it: a cone of directions."""

    axis: Float[Array, "P 3"]
    """Unit vectors to its centre in the frame of the surface."""
    vers: Float[Array, " P"]
    """1 - cos of the cone's half angle."""
    radiance: Float[Array, " C"]


class Sky(eqx.Module):
    """An image of light from all directions, constant over each of its pixels, and how to draw from it.

    Directions are drawn in proportion to the mean radiance of the channels: a row, then a column, then evenly within.
    """

    radiance: Float[Array, "rows columns C"]
    density: Float[Array, "rows columns"]
    """Probability of a direction for each steradian."""
    rows: Float[Array, " rows"]
    """Cumulative probability of the rows, ending with 1."""
    columns: Float[Array, "rows columns"]
    """Cumulative probability of the columns within each row."""
    frame: Float[Array, "P 3 3"]


class Extended(eqx.Module):
    """Lights of some extent, to be sampled."""

    balls: tuple[Ball, ...]
    sky: Sky | None
    constant: Float[Array, " C"] | None
    """Radiance from everywhere that could not be integrated beforehand; None otherwise."""


class Illumination(eqx.Module):
    """Everything that arrives at the P pixels of an object."""

    wo: Float[Array, "P 3"]
    punctual: tuple[Punctual, ...]
    everywhere: Everywhere | None
    extended: Extended | None

    def part(self, pixels: NDArray[np.intp]) -> Illumination:
        """The light on some of the pixels."""
        extended, everywhere = self.extended, self.everywhere
        if extended is not None:
            balls = tuple(Ball(b.axis[pixels], b.vers[pixels], b.radiance) for b in extended.balls)
            sky = extended.sky
            if sky is not None:
                sky = Sky(sky.radiance, sky.density, sky.rows, sky.columns, sky.frame[pixels])
            extended = Extended(balls, sky, extended.constant)
        if everywhere is not None:
            at = everywhere.stencil
            at = PolarStencil(at.index[pixels], at.fraction[pixels], at.max_angle)
            everywhere = Everywhere(everywhere.radiance, everywhere.wi, everywhere.wo, everywhere.weight, at)
        punctual = tuple(Punctual(p.wi[pixels], p.arriving[pixels]) for p in self.punctual)
        return Illumination(self.wo[pixels], punctual, everywhere, extended)


def illuminate(scene: Scene, view: View, channels: int = 3, isotropic: bool = True) -> Illumination:
    """The light of a scene on the pixels of its view, in float64 NumPy arrays.

    Three channels are taken as red, green and blue; with any other number lights are grey, the mean of their colour. The
    albedo of a material that is not isotropic depends on more than one angle: its ambient light is sampled.
    """
    punctual, balls, ambient, sky = [], [], np.zeros(1), None
    for light in scene.lights:
        if isinstance(light, Directional | Point):
            punctual.append(_punctual(light, view, channels))
        elif isinstance(light, Area):
            balls.append(_ball(light, view, channels))
        elif isinstance(light, Ambient):
            ambient = ambient + _colour(light.radiance, channels)
        else:
            sky = _sky(light, view, channels)
    even = ambient if ambient.max() > 0 else None
    constant: Any = None if isotropic else even
    return Illumination(
        wo=_array(view.wo),
        punctual=tuple(punctual),
        everywhere=_everywhere(even, view) if isotropic and even is not None else None,
        extended=Extended(tuple(balls), sky, constant) if balls or sky is not None or constant is not None else None,
    )


def _array(a: Any) -> Any:
    """NumPy arrays stand for JAX arrays until a program takes them, in the precision that it works in."""
    return np.asarray(a, float)


def _colour(colour: Vector, channels: int) -> Reals:
    return np.asarray(colour if channels == 3 else [float(np.mean(colour))], float)


def _punctual(light: Directional | Point, view: View, channels: int) -> Punctual:
    if isinstance(light, Directional):
        wi = to_local(view.frame, unit(light.direction))
        facing = _colour(light.irradiance, channels)[None]
    else:
        to = np.asarray(light.position) - view.position
        distance2 = (to**2).sum(-1, keepdims=True)
        wi = to_local(view.frame, to / np.sqrt(distance2))
        facing = _colour(light.intensity, channels) / distance2
    return Punctual(_array(wi), _array(facing * np.maximum(wi[:, 2:], 0)))


def _ball(light: Area, view: View, channels: int) -> Ball:
    to = np.asarray(light.centre) - view.position
    distance = np.linalg.norm(to, axis=1)
    sin2 = np.minimum((light.radius / distance) ** 2, 1.0)
    # 1 - cos = sin^2/(1 + cos) does not cancel for small lights
    vers = sin2 / (1 + np.sqrt(1 - sin2))
    return Ball(
        _array(to_local(view.frame, to / distance[:, None])), _array(vers), _array(_colour(light.radiance, channels))
    )


def _sky(light: Environment, view: View, channels: int) -> Sky:
    image = light.image if channels == 3 else light.image.mean(-1, keepdims=True)
    rows, columns = image.shape[:2]
    edges = np.cos(np.linspace(0, np.pi, rows + 1))
    solid_angle = (edges[:-1] - edges[1:])[:, None] * 2 * np.pi / columns
    bright = image.mean(-1)
    share = bright * solid_angle
    total = share.sum()
    row = share.sum(1)
    # Guard: 0/0 in a row without light; it is never drawn (tests/test_scenes_sampling.py::test_black_rows).
    within = np.cumsum(share, 1) / np.where(row > 0, row, 1)[:, None]
    return Sky(_array(image), _array(bright / total), _array(np.cumsum(row) / total), _array(within), _array(view.frame))


def _everywhere(radiance: Reals, view: View) -> Everywhere:
    limit = np.pi / 2
    parts = [hemisphere(float(np.arccos(c)), FINE) for c in PolarStencil.cosines(limit)]
    return Everywhere(
        _array(radiance),
        _array(np.stack([p[1] for p in parts], 1)),
        _array(np.stack([p[0] for p in parts])),
        _array(np.stack([p[2] for p in parts], 1)),
        PolarStencil.of(view.wo[:, 2], limit),
    )


__all__ = ["Ball", "Everywhere", "Extended", "Illumination", "Punctual", "Sky", "illuminate"]
