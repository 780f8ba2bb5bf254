"""Phong: a power of the cosine to the mirror direction, divided by that of the light."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from .base import BRDF
from .common import diffuse_parameter, exponent_parameter, exponent_shapes, lobe_parameter
from .diffuse import lambert
from .mirror import cosine_power, mirror_deficit


class Phong(BRDF):
    """f = diffuse/pi + specular (e + 2)/(2 pi) (r.v)^e / n.l, r the mirror of l about n (Phong 1975; Schwenk 2011, eq. 24).

    Phong scales intensities, so that his lobe has no (e + 2)/(2 pi) and cancels the cosine of the light: that is the 1/n.l.
    With the factor, that of :class:`ModifiedPhong`, the albedo of the lobe at normal incidence is specular
    (tests/test_energy.py::test_scales_by_integration).
    Not reciprocal. Does not conserve energy: the albedo grows as 1/n.l. No Fresnel term. Known failure: the lobe of a rough
    measured material is narrower across than along the plane of incidence at grazing, and this one is round.
    """

    name: ClassVar[str] = "phong"
    references: ClassVar[tuple[str, ...]] = ("phong1975", "schwenk2011")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = lobe_parameter()
    exponent: Float[Array, ""] = exponent_parameter()

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Narrower and wider than the lobe is, which is twice as wide about r as about the normal."""
        return exponent_shapes(2 * half_width)

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        lobe = (self.exponent + 2) / (2 * jnp.pi) * cosine_power(mirror_deficit(g), self.exponent)
        return lambert(self.diffuse) + self.specular * (lobe / g.cos_i)
