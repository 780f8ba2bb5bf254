"""Schlick: rational functions in place of microfacet integrals, for one layer or two."""

from __future__ import annotations

from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import Geometry
from .base import BRDF, Interval, parameter
from .fresnel import schlick


def _color(meaning: str, default: float) -> Any:
    return parameter(meaning, per_channel=True, linear=True, valid=Interval(0, 1), default=default)


def _roughness(meaning: str, default: float) -> Any:
    return parameter(meaning, valid=Interval(0, 1, open_lower=True), search=(1e-9, 1), default=default, log=True)


def _roughnesses(half_width: float) -> list[float]:
    return [float(np.clip(np.tan(half_width) ** 2 / 0.41 * k, 1e-8, 1)) for k in (0.1, 0.3, 1.0, 3.0, 10.0)]


def _visible(roughness: Float[Array, ""], cosine: Float[Array, "..."]) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
    """G/cos and 1 - G, G = cos/(r - r cos + cos): neither is a difference of numbers that are nearly equal."""
    inverse = 1 / (roughness + (1 - roughness) * cosine)
    return inverse, roughness * (1 - cosine) * inverse


def _directional(roughness: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """D = (1 - G(l) G(v))/pi + G(l) G(v) Z/(4 pi n.l n.v), Z = r/(1 + r (n.h)^2 - (n.h)^2)^2, in 1/sr."""
    z = roughness / (g.sin2_h + roughness * g.cos2_h) ** 2
    light, hidden = _visible(roughness, g.cos_i)
    viewer, masked = _visible(roughness, g.cos_o)
    return (hidden + (1 - hidden) * masked) / jnp.pi + light * viewer * z / (4 * jnp.pi)


def _transmitted(f0: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """1 - F = (1 - F0)(1 - (1 - c_d)^5), the last as a polynomial that does not cancel at grazing."""
    c = g.cos_d
    return (1 - f0) * c * (5 + c * (-10 + c * (10 + c * (-5 + c))))


class Schlick(BRDF):
    """f = F D, F = specular + (1 - specular)(1 - c_d)^5, D = (1 - G G')/pi + G G' Z/(4 pi n.l n.v),
    Z = r/(1 + r (n.h)^2 - (n.h)^2)^2, G = n.l/(r - r n.l + n.l), G' of n.v likewise, r = roughness (Schlick 1994; Schwenk
    2011, eq. 49), for a single layer.

    The survey's eq. 49 has lost pi: the integral of (n.h) Z/pi over the hemisphere is 1 (Z/pi is Trowbridge and Reitz's
    distribution with alpha^2 = r), so the lobe stands over 4 pi; what it masks returns diffusely, over pi. The azimuthal
    factor A is 1, isotropy p = 1: isotropic surfaces only.
    Reciprocal. roughness 1 is a nearly Lambertian body, and there is no other. Does not conserve energy: for roughness 1 and
    specular 1 the albedo at grazing is 5/4. Known failure: one roughness has to be that of body and highlight.
    """

    name: ClassVar[str] = "schlick"
    references: ClassVar[tuple[str, ...]] = ("schlick1994", "schwenk2011")

    specular: Float[Array, " C"] = _color("reflectance at normal incidence", 0.3)
    roughness: Float[Array, ""] = _roughness("roughness, alpha^2 of the distribution", 0.1)

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Narrower and wider than the lobe is, which halves where sin^2/cos^2 = 0.41 r."""
        return [{"roughness": r} for r in _roughnesses(half_width)]

    def normal_reflectance(self) -> Float[Array, ""]:
        """F0, a parameter of the model."""
        return self.specular

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        return schlick(self.specular, g) * _directional(self.roughness, g)


class SchlickTwoLayers(BRDF):
    """f = F D + (1 - F) F' D', each as of :class:`Schlick`: a layer of specular and roughness over one of base and
    base_roughness (Schlick 1994; Schwenk 2011, eq. 48).

    Reciprocal. Energy is not bounded by the form. Known failure: light that the second layer reflects passes the first one
    once, so that a base is too bright at grazing.
    """

    name: ClassVar[str] = "schlick_two_layers"
    references: ClassVar[tuple[str, ...]] = ("schlick1994", "schwenk2011")

    specular: Float[Array, " C"] = _color("reflectance of the upper layer at normal incidence", 0.04)
    base: Float[Array, " C"] = _color("reflectance of the lower layer at normal incidence", 0.3)
    roughness: Float[Array, ""] = _roughness("roughness of the upper layer", 0.02)
    base_roughness: Float[Array, ""] = _roughness("roughness of the lower layer", 0.8)

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Those of one layer over two bodies."""
        return [{"roughness": r, "base_roughness": b} for r in _roughnesses(half_width) for b in (0.2, 0.9)]

    def normal_reflectance(self) -> Float[Array, ""]:
        """F0 of the upper layer."""
        return self.specular

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        below = _transmitted(self.specular, g) * schlick(self.base, g) * _directional(self.base_roughness, g)
        return schlick(self.specular, g) * _directional(self.roughness, g) + below
