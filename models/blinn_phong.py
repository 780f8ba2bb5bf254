"""Blinn-Phong: a power of the cosine of the half vector, in its common scale."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from .base import BRDF
from .common import diffuse_parameter, exponent_parameter, exponent_shapes, lobe_parameter
from .diffuse import lambert
from .ndf.power_cosine import log_cosine


class BlinnPhong(BRDF):
    """f = diffuse/pi + specular (e + 2)/(2 pi) (n.h)^e (Blinn 1977; in this scale Ngan et al. 2005).

    The factor is the one of Phong's lobe; here it makes the albedo at normal incidence 4 (2^(-e/2) + e)/(e + 4)
    specular, 4 times specular for large e (tests/test_energy.py::test_scales_by_integration). Blinn divides by n.l, which is
    not reciprocal and is left out, as in the published fits.
    Reciprocal; does not conserve energy for diffuse + specular <= 1. No Fresnel term: darkens towards grazing.
    """

    name: ClassVar[str] = "blinn_phong"
    references: ClassVar[tuple[str, ...]] = ("blinn1977", "ngan2005")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = lobe_parameter()
    exponent: Float[Array, ""] = exponent_parameter()

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Narrower and wider than the lobe is."""
        return exponent_shapes(half_width)

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        lobe = (self.exponent + 2) / (2 * jnp.pi) * jnp.exp(self.exponent * log_cosine(g.sin2_h, g.cos2_h))
        return lambert(self.diffuse) + self.specular * lobe
