"""Strauss: smoothness, metalness and transparency in place of physical parameters."""

from __future__ import annotations

from typing import Any, ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from .base import BRDF, Interval, parameter
from .common import diffuse_parameter, exponent_shapes
from .mirror import cosine_power, mirror_deficit

K_F, K_G, K_J = 1.12, 1.01, 0.1
"""Strauss's constants of the Fresnel and shadowing curves and of the rise of reflectivity at grazing."""


def _share(meaning: str, default: float, upper: float = 1.0) -> Any:
    return parameter(meaning, valid=Interval(0, 1, open_upper=upper < 1), search=(0, upper), default=default)


def _fresnel(x: Float[Array, "..."]) -> Float[Array, "..."]:
    """[1/(x - k)^2 - 1/k^2]/[1/(1 - k)^2 - 1/k^2] of x = 2 theta/pi, k = K_F, from 0 to 1, as one fraction."""
    end = (2 * K_F - 1) / (1 - K_F) ** 2
    return x * (2 * K_F - x) / (x - K_F) ** 2 / end


def _unshadowed(y: Float[Array, "..."]) -> Float[Array, "..."]:
    """[1/(1 - k)^2 - 1/(x - k)^2]/[1/(1 - k)^2 - 1/k^2], k = K_G, from 1 to 0, of y = 1 - x, which is small at grazing."""
    return y * (2 * (K_G - 1) + y) / (y + K_G - 1) ** 2 * K_G**2 / (2 * K_G - 1)


class Strauss(BRDF):
    """f = [(1 - m s) r_d diffuse + r_j (r.v)^(3/(1 - s)) (1 + m (1 - F(l)) (diffuse - 1))/n.l]/pi, with
    r_d = (1 - s^3)(1 - t), r_n = (1 - t) - r_d, r_j = min(1, r_n + (r_n + 0.1) F(l) G(l) G(v)); F and G are rational in
    the polar angles (Strauss 1990; Schwenk 2011, eq. 46).

    s, m, t = smoothness, metalness, transparency; diffuse is the colour C. The survey's formula gives intensities under a
    light of intensity 1; over pi, it is Lambert's law at s = m = t = 0, F = 0. It prints r_j without its last bracket.
    Not reciprocal, does not conserve energy. Known failures: the highlight has no scale of its own and is at most
    1/(pi n.l) high, far below those of measured glossy materials; r_j has a kink where it reaches 1; in float32 slopes at
    the horizon are good to 5e-5.
    """

    name: ClassVar[str] = "strauss"
    references: ClassVar[tuple[str, ...]] = ("strauss1990", "schwenk2011")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    smoothness: Float[Array, ""] = _share("smoothness s", 0.6, upper=0.99999)
    metalness: Float[Array, ""] = _share("metalness m", 0.3)
    transparency: Float[Array, ""] = _share("transparency t", 0.1)

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """The smoothness whose lobe is as wide, and less of it, for plastics and metals."""
        smooth = [max(0.05, min(1 - 3 / e["exponent"], 0.9999)) for e in exponent_shapes(2 * half_width)[:4]]
        return [{"smoothness": s, "metalness": m} for s in (*smooth, 0.3) for m in (0.1, 0.9)]

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        s, m, t = self.smoothness, self.metalness, self.transparency
        f = _fresnel(2 / jnp.pi * jnp.arctan2(g.sin_i, g.cos_i))
        light, viewer = (2 / jnp.pi * jnp.arctan2(c, away) for c, away in ((g.cos_i, g.sin_i), (g.cos_o, g.sin_o)))
        normal = (1 - t) * s**3
        reflectivity = jnp.minimum(1, normal + (normal + K_J) * f * _unshadowed(light) * _unshadowed(viewer))
        lobe = reflectivity * cosine_power(mirror_deficit(g), 3 / (1 - s)) / g.cos_i
        body = (1 - m * s) * (1 - s**3) * (1 - t)
        return (body * self.diffuse + lobe * (1 + m * (1 - f) * (self.diffuse - 1))) / jnp.pi
