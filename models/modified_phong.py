"""Modified Phong: the power of the cosine to the mirror direction as a reciprocal BRDF that conserves energy."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from .base import BRDF
from .common import diffuse_parameter, exponent_parameter, exponent_shapes, lobe_parameter
from .diffuse import lambert
from .mirror import cosine_power, mirror_deficit


class ModifiedPhong(BRDF):
    """f = diffuse/pi + specular (e + 2)/(2 pi) (r.v)^e (Lafortune & Willems 1994; Schwenk 2011, eq. 27).

    The bound of the survey, garbled to "ks <= e+2 / 2", is its scale in units of 1/pi: the integral of cos^(e+1) over the
    hemisphere is 2 pi/(e + 2), so that the albedo of the lobe is specular at normal incidence and less elsewhere.
    Reciprocal; conserves energy for diffuse + specular <= 1. Known failure: darkens towards grazing, as materials do not.
    """

    name: ClassVar[str] = "modified_phong"
    references: ClassVar[tuple[str, ...]] = ("lafortune1994", "schwenk2011")

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
        return lambert(self.diffuse) + self.specular * lobe
