"""Granier-Heidrich: a transparent layer over a mirror-like or diffuse base, with interference between what both reflect."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from .base import BRDF, NOT_NEGATIVE, Interval, parameter
from .common import diffuse_parameter, exponent_parameter, exponent_shapes, lobe_parameter
from .diffuse import lambert
from .mirror import cosine_power, mirror_deficit


def _layer(ior: Float[Array, ""], cosine: Float[Array, "..."]) -> tuple[Float[Array, "..."], ...]:
    """Fresnel's unpolarised reflectance R of the layer's surface at a polar angle, 1 - R, and the cosine inside.

    With s = ior times the cosine inside; R does not cancel for ior near 1, nor 1 - R at grazing.
    """
    n2m1 = (ior - 1) * (ior + 1)
    s = jnp.sqrt(n2m1 + cosine**2)
    across, along = (cosine + s) ** 2, ior**2 * cosine + s
    reflected = (n2m1**2 / across**2 + (n2m1 * (cosine - 1 / (cosine + s)) / along) ** 2) / 2
    return reflected, 2 * cosine * s * (1 / across + ior**2 / along**2), s / ior


class GranierHeidrich(BRDF):
    """f = diffuse/pi + specular (e + 2)/(2 pi) [a + b + 2 sqrt(a b) cos(4 pi thickness ior c)], where
    a = sqrt(R(l) R(v)) (r.v)^e is reflected by the surface of a layer and b = T(l) T(v) (r'.v')^e' by its base: R is
    Fresnel's reflectance, T = 1 - R, l' and v' are refracted into the layer, r' is the mirror of l', e' = base_exponent, and
    c is the mean of the cosines of l' and v' (after Granier & Heidrich 2003).

    Each channel has an index, and a thickness in its wavelength: that is the paper's RGB in place of a spectrum. Deviations:
    the paper draws thicknesses and normals from a noise; here the layer is even and flat. There R and the phase are of one
    direction; their means make it reciprocal. The lobes have no scale there; here that of the first scales both. The body
    term, there an interference that is the same in all directions, is diffuse.
    Reciprocal. Energy is not bounded by the form. Known failures: the BRDF oscillates in thickness, so that layers of many
    wavelengths have as many optima; a thickness of lobes too narrow to show more than one angle trades off with specular.
    """

    name: ClassVar[str] = "granier_heidrich"
    references: ClassVar[tuple[str, ...]] = ("granier2003", "schwenk2011")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = lobe_parameter()
    ior: Float[Array, " C"] = parameter(
        "index of refraction of the layer",
        per_channel=True,
        valid=Interval(1, open_lower=True),
        search=(1.01, 4),
        default=1.5,
    )
    thickness: Float[Array, " C"] = parameter(
        "thickness of the layer in wavelengths", per_channel=True, valid=NOT_NEGATIVE, search=(0, 3), default=0.3
    )
    exponent: Float[Array, ""] = exponent_parameter("exponent of the surface")
    base_exponent: Float[Array, ""] = exponent_parameter("exponent of the base")

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Both lobes as wide as that of the data, or one much wider, for three thicknesses."""
        e = exponent_shapes(2 * half_width)[2]["exponent"]
        pairs = [(e, e), (e, max(0.1 * e, 0.5))]
        return [{"thickness": d, "exponent": a, "base_exponent": b} for d in (0.1, 0.25, 0.4) for a, b in pairs]

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        light, entered, inside_i = _layer(self.ior, g.cos_i)
        viewer, left, inside_o = _layer(self.ior, g.cos_o)
        # 1 - r'.v' = (|l_xy + v_xy|^2/ior^2 + (n.l' - n.v')^2)/2, and n.l'^2 - n.v'^2 = (n.l^2 - n.v^2)/ior^2
        apart = (g.cos_i - g.cos_o) * (g.cos_i + g.cos_o) / (self.ior**2 * (inside_i + inside_o))
        below = 2 * g.cos_d**2 * g.sin2_h / self.ior**2 + apart**2 / 2
        # amplitudes: sqrt(a) and sqrt(b), whose product the interference takes
        top = jnp.sqrt(jnp.sqrt(light * viewer)) * cosine_power(mirror_deficit(g), self.exponent / 2)
        base = jnp.sqrt(entered * left) * cosine_power(below, self.base_exponent / 2)
        phase = 2 * jnp.pi * self.thickness * self.ior * (inside_i + inside_o)
        lobe = top**2 + base**2 + 2 * top * base * jnp.cos(phase)
        return lambert(self.diffuse) + self.specular * ((self.exponent + 2) / (2 * jnp.pi)) * lobe
