"""Disney's principled shading model of 2012: a few parameters from 0 to 1 for the look of most materials."""

from __future__ import annotations

from typing import Any, ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from . import ndf
from .base import BRDF, Interval, parameter
from .fresnel import schlick

UNIT = Interval(0, 1)
Value = Float[Array, "..."]


def _share(meaning: str, default: float = 0.0, **options: Any) -> Any:
    return parameter(meaning, valid=UNIT, default=default, **options)


def _colour(meaning: str, default: float) -> Any:
    return _share(meaning, default, per_channel=True, linear=True)


def _towards(end: Value, cosine: Value) -> Value:
    """1 + (end - 1)(1 - cos)^5 as 1 - (1 - cos)^5, a polynomial that does not cancel at grazing, and the rest."""
    return cosine * (5 + cosine * (-10 + cosine * (10 + cosine * (-5 + cosine)))) + end * (1 - cosine) ** 5


def _visibility(alpha: Any, g: Geometry) -> Value:
    """G1(l) G1(v)/(4 n.l n.v) of GGX, each 1/(n.l + sqrt(alpha^2 + (1 - alpha^2)(n.l)^2)) (Walter et al. 2007, eq. 34)."""
    a2 = alpha**2
    light, viewer = (c + jnp.sqrt(a2 + (1 - a2) * c * c) for c in (g.cos_i, g.cos_o))
    return 1 / (light * viewer)


def _body(m: Any, g: Geometry) -> Value:
    """Body, subsurface and sheen."""
    retro = m.roughness * g.cos_d**2
    rough = _towards(0.5 + 2 * retro, g.cos_i) * _towards(0.5 + 2 * retro, g.cos_o)
    flat = _towards(retro, g.cos_i) * _towards(retro, g.cos_o)
    under = 1.25 * (flat * (1 / (g.cos_i + g.cos_o) - 0.5) + 0.5)
    body = m.base_color / jnp.pi * (rough + m.subsurface * (under - rough))
    value: Value = (1 - m.metallic) * (body + m.sheen * g.vers_d**5)
    return value


def _coat(m: Any, g: Geometry) -> Value:
    """The clear coat: GTR of gamma = 1 with fixed reflectance 0.04 and masking."""
    lobe = ndf.GTR(0.1 - 0.099 * m.clearcoat_gloss, jnp.asarray(1.0))
    value: Value = m.clearcoat * schlick(jnp.asarray(0.04), g) * (lobe(g.sin2_h, g.cos2_h) * _visibility(0.25, g)) / 4
    return value


def _f0(m: Any) -> Value:
    value: Value = 0.08 * m.specular * (1 - m.metallic) + m.base_color * m.metallic
    return value


class Disney(BRDF):
    """f = (1 - metallic)(base_color/pi mix(f_d, f_s, subsurface) + sheen (1 - c_d)^5) + F D_ggx V + clearcoat/4 F_c D_c V_c
    (Burley 2012, section 5, with the subsurface term and the constants of the implementation he published with it).

    f_d = (1 + (F90 - 1)(1 - n.l)^5)(1 + (F90 - 1)(1 - n.v)^5), F90 = 1/2 + 2 roughness c_d^2; f_s = 1.25 (f_ss (1/(n.l +
    n.v) - 1/2) + 1/2), f_ss as f_d with F90 = roughness c_d^2. F = Schlick of mix(0.08 specular, base_color, metallic),
    D_ggx of alpha = max(0.001, roughness^2), V of GGX's separable masking with alpha = (1/2 + roughness/2)^2. F_c =
    Schlick of 0.04, D_c = GTR of gamma = 1 and alpha = mix(0.1, 0.001, clearcoat_gloss), V_c with alpha = 0.25.

    Deviations: a channel knows nothing of the others, so the tints, which mix white with base_color over its luminance, are
    not parameters: specular and sheen are colours, the scale and the tint in one. Of max(0.001, roughness^2) the
    derivative is 0 below. Reciprocal. Does not conserve energy: base_color = 1 returns up to 1.16 at 60 degrees, 1.5 at 80
    and 1.62 at grazing, with sheen and clear coat 1.2, 1.6 and 1.76
    (tests/test_microfacet_models.py::test_energy_of_models).
    Known failures: most parameters are not determined by one material: subsurface and roughness of the body, specular and
    clearcoat, metallic and base_color (a metal needs metallic = 1; between 0 and 1 specular and metallic trade off).
    """

    name: ClassVar[str] = "disney"
    references: ClassVar[tuple[str, ...]] = ("burley2012", "walter2007", "schlick1994")

    base_color: Float[Array, " C"] = _colour("colour of the body, or of the lobe of a metal", 0.5)
    subsurface: Float[Array, ""] = _share("part of the body term that is the subsurface form")
    metallic: Float[Array, ""] = _share("from dielectric (0) to metal (1)")
    specular: Float[Array, " C"] = _colour("reflectance of a dielectric at normal incidence over 0.08", 0.5)
    roughness: Float[Array, ""] = _share("root of the lobe width, and the body's retro-reflection", 0.5)
    sheen: Float[Array, " C"] = _colour("further light at grazing", 0.0)
    clearcoat: Float[Array, ""] = _share("strength of the clear coat", linear=True)
    clearcoat_gloss: Float[Array, ""] = _share("from satin (0) to gloss (1)", 1.0)

    def normal_reflectance(self) -> Value:
        """F0 under the clear coat: mix(0.08 specular, base_color, metallic)."""
        return _f0(self)

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        d = ndf.GGX(jnp.maximum(self.roughness**2, 1e-3))(g.sin2_h, g.cos2_h)
        visible = _visibility(((1 + self.roughness) / 2) ** 2, g)
        return _body(self, g) + schlick(_f0(self), g) * (d * visible) + _coat(self, g)


class DisneyAnisotropic(BRDF):
    """As :class:`Disney` with D = 1/(pi a_x a_y (h_x^2/a_x^2 + h_y^2/a_y^2 + (n.h)^2)^2),
    a_x = max(0.001, roughness^2/aspect), a_y = max(0.001, roughness^2 aspect), aspect = sqrt(1 - 0.9 anisotropy)
    (Burley 2012, section 5.4 and appendix B.2). The lobe is longer along the tangent alone: where a fit ends at
    anisotropy = 0, turn the table by 90 degrees.
    """

    name: ClassVar[str] = "disney"
    references: ClassVar[tuple[str, ...]] = ("burley2012", "walter2007", "schlick1994")
    anisotropic: ClassVar[bool] = True

    base_color: Float[Array, " C"] = _colour("colour of the body, or of the lobe of a metal", 0.5)
    subsurface: Float[Array, ""] = _share("part of the body term that is the subsurface form")
    metallic: Float[Array, ""] = _share("from dielectric (0) to metal (1)")
    specular: Float[Array, " C"] = _colour("reflectance of a dielectric at normal incidence over 0.08", 0.5)
    roughness: Float[Array, ""] = _share("root of the lobe width, and the body's retro-reflection", 0.5)
    anisotropy: Float[Array, ""] = _share("from a round lobe (0) to one stretched along the tangent (1)")
    sheen: Float[Array, " C"] = _colour("further light at grazing", 0.0)
    clearcoat: Float[Array, ""] = _share("strength of the clear coat", linear=True)
    clearcoat_gloss: Float[Array, ""] = _share("from satin (0) to gloss (1)", 1.0)

    def normal_reflectance(self) -> Value:
        """F0 under the clear coat: mix(0.08 specular, base_color, metallic)."""
        return _f0(self)

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        aspect = jnp.sqrt(1 - 0.9 * self.anisotropy)
        ax, ay = (jnp.maximum(a, 1e-3) for a in (self.roughness**2 / aspect, self.roughness**2 * aspect))
        x2, y2 = g.tangential()
        d = (1 / (ax * ay)) / (x2 / ax**2 + y2 / ay**2 + g.cos2_h) ** 2 / jnp.pi
        visible = _visibility(((1 + self.roughness) / 2) ** 2, g)
        return _body(self, g) + schlick(_f0(self), g) * (d * visible) + _coat(self, g)
