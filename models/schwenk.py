"""Schwenk: a half-vector lobe, a Fresnel term and one smoothness for its width and height."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from .base import BRDF, NOT_NEGATIVE, Interval, parameter
from .common import diffuse_parameter, exponent_shapes
from .diffuse import lambert
from .fresnel import schlick
from .ndf.power_cosine import log_cosine


class Schwenk(BRDF):
    """f = [diffuse + scale s^2/c_d F_schlick(specular, c_d) (n.h)^(2/(1 + 1/255 - s))]/pi, s = smoothness (Schwenk 2011,
    eq. 50 to 52).

    Both prints of the exponent give 2/(1.00392 - s), from 2 at s = 0 to 510 at s = 1, as the text says. Over pi, as all of
    the survey's intensities, it is Lambert's law at s = 0. Deviations: the survey makes the reflectance at normal
    incidence of the colour C and a metalness m, specular = 1 - m + m C/lum(C), and has diffuse = C, scale = 1 (its k_s)
    and an attenuation 1 - s k of C that is 1 by default. Here channels are independent, so specular is free.
    Reciprocal; energy is not bounded by the form. Known failure: no lobe is narrower than that of exponent 510.
    """

    name: ClassVar[str] = "schwenk"
    references: ClassVar[tuple[str, ...]] = ("schwenk2011", "schlick1994")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = parameter(
        "reflectance at normal incidence, F0", per_channel=True, linear=True, valid=NOT_NEGATIVE, default=0.5
    )
    smoothness: Float[Array, ""] = parameter("smoothness s", valid=Interval(0, 1), default=0.7)
    scale: Float[Array, ""] = parameter("scale of the lobe", valid=NOT_NEGATIVE, search=(1e-6, 1e4), default=1, log=True)

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """The smoothness whose lobe is as wide, and others, at three scales."""
        smooth = [max(0.1, min(1 + 1 / 255 - 2 / e["exponent"], 0.999)) for e in exponent_shapes(half_width)[:5]]
        return [{"smoothness": s, "scale": k} for s in smooth for k in (0.1, 1.0, 10.0)]

    def normal_reflectance(self) -> Float[Array, ""]:
        """F0, a parameter of the model."""
        return self.specular

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        s = self.smoothness
        lobe = s**2 / g.cos_d * jnp.exp(2 / ((1 - s) + 1 / 255) * log_cosine(g.sin2_h, g.cos2_h))
        return lambert(self.diffuse) + self.scale / jnp.pi * schlick(self.specular, g) * lobe
