"""Materials that none of the five models can reproduce, as measured ones cannot be: what a fit leaves over is known.

Each is a closed formula: GGX(alpha) stands for D G/(4 n.l n.v) of that distribution. All are reciprocal. Their parts are the
models' own, since no formula is tested against them: it is the sum that no model has.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...geometry import Geometry
from ...models.base import BRDF, NOT_NEGATIVE, POSITIVE, Interval, parameter
from ...models.common import diffuse_parameter
from ...models.diffuse import lambert, oren_nayar
from ...models.fresnel import dielectric, schlick
from ...models.masking import smith_correlated
from ...models.microfacet import microfacet
from ...models.ndf import GGX


def _each(meaning: str, valid: Interval = NOT_NEGATIVE) -> Any:
    return parameter(meaning, valid=valid, per_channel=True)


def _shared(meaning: str, valid: Interval = POSITIVE, unit: str = "1") -> Any:
    return parameter(meaning, valid=valid, unit=unit)


def _ggx(alpha: Float[Array, ""], fresnel: Float[Array, "..."], g: Geometry) -> Float[Array, "..."]:
    """F D G/(4 n.l n.v) with the GGX distribution and height-correlated masking (Walter et al. 2007; Heitz 2014)."""
    lobe = GGX(alpha)
    return microfacet(lobe(g.sin2_h, g.cos2_h), fresnel, smith_correlated(lobe, g))


class TwoLobes(BRDF):
    """f = rough body + F_schlick(specular) [(1 - haze) GGX(alpha) + haze GGX(alpha_haze)], haze per channel.

    A polished surface with a scratched or scattering layer; the body is that of Oren & Nayar, flat and bright towards
    the light. One lobe has one width, and a Lambertian body no roughness.
    """

    name: ClassVar[str] = "two_lobes"
    references: ClassVar[tuple[str, ...]] = ("walter2007", "heitz2014", "oren1994", "schlick1994")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    sigma: Float[Array, ""] = _shared("roughness of the body", NOT_NEGATIVE, unit="rad")
    specular: Float[Array, " C"] = _each("reflectance at normal incidence, F0")
    alpha: Float[Array, ""] = _shared("width of the narrow lobe")
    haze: Float[Array, " C"] = _each("share of the wide lobe", Interval(0, 1))
    alpha_haze: Float[Array, ""] = _shared("width of the wide lobe")

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        f = schlick(self.specular, g)
        lobes = _ggx(self.alpha, (1 - self.haze) * f, g) + _ggx(self.alpha_haze, self.haze * f, g)
        return oren_nayar(self.diffuse, self.sigma, g) + lobes


class Retro(BRDF):
    """f = diffuse/pi + F_schlick(specular) GGX(alpha) + retro exp(-tan^2(theta_d)/width^2)/(pi width^2).

    A surface that also sends light back where it came from (theta_d = 0), as cloth and road paint do. The microfacet
    models know theta_d through the Fresnel term only, which rises the other way.
    """

    name: ClassVar[str] = "retro"
    references: ClassVar[tuple[str, ...]] = ("walter2007", "heitz2014", "schlick1994")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = _each("reflectance at normal incidence, F0")
    alpha: Float[Array, ""] = _shared("lobe width")
    retro: Float[Array, " C"] = _each("scale of the return")
    width: Float[Array, ""] = _shared("width of the return, as tan(theta_d)")

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        back = jnp.exp(-g.sin2_d / (g.cos_d * self.width) ** 2) / (jnp.pi * self.width**2)
        return lambert(self.diffuse) + _ggx(self.alpha, schlick(self.specular, g), g) + self.retro * back


class Coated(BRDF):
    """f = F GGX(coat_alpha) + T(l) T(v) [diffuse/pi + F_schlick(specular) GGX(alpha)], F = F_dielectric(ior).

    A dispersive varnish on a metallic paint: the coat's index (so its F, and T = 1 - F at the polar angles of light and
    viewer) and the width of the base differ per channel. The colour of the highlight changes across it and with the
    angle. Refraction bends no directions here: it is a model of a table, not of a varnish.
    """

    name: ClassVar[str] = "coated"
    references: ClassVar[tuple[str, ...]] = ("walter2007", "heitz2014", "cook1982", "schlick1994")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = _each("reflectance of the base at normal incidence, F0")
    alpha: Float[Array, " C"] = _each("lobe width of the base", POSITIVE)
    ior: Float[Array, " C"] = _each("index of refraction of the coat", Interval(1, open_lower=True))
    coat_alpha: Float[Array, ""] = _shared("lobe width of the coat")

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        light, viewer = (1 - dielectric(self.ior, replace(g, cos_d=c)) for c in (g.cos_i, g.cos_o))
        base = lambert(self.diffuse) + _ggx(self.alpha, schlick(self.specular, g), g)
        return _ggx(self.coat_alpha, dielectric(self.ior, g), g) + light * viewer * base


__all__ = ["Coated", "Retro", "TwoLobes"]
