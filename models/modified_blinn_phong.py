"""Modified Blinn-Phong: the half-vector lobe in the scale that makes its albedo at normal incidence exact."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from .base import BRDF
from .common import diffuse_parameter, exponent_parameter, exponent_shapes, lobe_parameter
from .diffuse import lambert
from .ndf.power_cosine import log_cosine


def half_vector_scale(exponent: Float[Array, ""]) -> Float[Array, ""]:
    """(e + 2)(e + 4)/(8 pi (2^(-e/2) + e)), of which (n.h)^e has the albedo 1 at normal incidence."""
    return (exponent + 2) * (exponent + 4) / (8 * jnp.pi * (jnp.exp2(-exponent / 2) + exponent))


class ModifiedBlinnPhong(BRDF):
    """f = diffuse/pi + specular (e + 2)(e + 4)/(8 pi (2^(-e/2) + e)) (n.h)^e (Schwenk 2011, eq. 28).

    The survey gives the scale as (e + 8)/(8 pi) and doubts it. At normal incidence theta_h is half of theta_o, and the
    integral of cos^e(theta/2) cos(theta) over the hemisphere is 8 pi (2^(-e/2) + e)/((e + 2)(e + 4)): this is the exact
    scale, of which the other is the limit at e = 0 and, up to 2/e, at e -> infinity.
    Reciprocal; the albedo of the lobe is specular at normal incidence and does not exceed it. Fits as :class:`BlinnPhong`
    does, from which it differs by a factor that depends on e alone.
    """

    name: ClassVar[str] = "modified_blinn_phong"
    references: ClassVar[tuple[str, ...]] = ("blinn1977", "schwenk2011")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = lobe_parameter()
    exponent: Float[Array, ""] = exponent_parameter()

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Narrower and wider than the lobe is."""
        return exponent_shapes(half_width)

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        e = self.exponent
        return lambert(self.diffuse) + self.specular * (half_vector_scale(e) * jnp.exp(e * log_cosine(g.sin2_h, g.cos2_h)))
