"""Max-Phong: a mirror-direction lobe that brightens towards grazing and stays reciprocal."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from .base import BRDF
from .common import diffuse_parameter, exponent_parameter, exponent_shapes, lobe_parameter
from .diffuse import lambert
from .mirror import cosine_power, mirror_deficit


class MaxPhong(BRDF):
    """f = diffuse/pi + specular (e + 1)/(2 pi) (r.v)^e / max(n.l, n.v) (Neumann & Neumann 1998; Schwenk 2011, eq. 29).

    The survey prints the lobe without a factor. Since n.v/max(n.l, n.v) <= 1 and the integral of cos^e over a hemisphere is
    2 pi/(e + 1), this factor bounds the albedo of the lobe by specular at every angle.
    Reciprocal; conserves energy for diffuse + specular <= 1. Has a kink where n.l = n.v, and no Fresnel term.
    """

    name: ClassVar[str] = "max_phong"
    references: ClassVar[tuple[str, ...]] = ("neumann1998", "schwenk2011")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = lobe_parameter()
    exponent: Float[Array, ""] = exponent_parameter()

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Narrower and wider than the lobe is, which is twice as wide about r as about the normal."""
        return exponent_shapes(2 * half_width)

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        lobe = (self.exponent + 1) / (2 * jnp.pi) * cosine_power(mirror_deficit(g), self.exponent)
        return lambert(self.diffuse) + self.specular * (lobe / jnp.maximum(g.cos_i, g.cos_o))
