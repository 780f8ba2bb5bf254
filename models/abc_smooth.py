"""Löw's model of smooth surfaces: an ABC lobe of the difference of projected directions."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from .abc import ABC
from .base import BRDF, NOT_NEGATIVE, POSITIVE, Interval, parameter
from .common import diffuse_parameter
from .diffuse import lambert
from .fresnel import dielectric_at


class ABCSmooth(BRDF):
    """f = diffuse/pi + scale F_dielectric(ior, cos_p) / (1 + b |D_p|^2)^c, D_p = l_xy + v_xy (Löw et al. 2012).

    Scatter by small heights is a function of the difference of projected directions, D_p, alone but for Fresnel. With
    l_p = l_xy and the mirrored v_p = -v_xy, F is taken in the middle of the two projections, where the cosine is
    cos_p = sqrt(1 - |l_xy - v_xy|^2/4). Here |D_p| = 2 cos(theta_d) sin(theta_h) and |l_xy - v_xy|^2/4 = sin^2(theta_d) -
    (n.l - n.v)^2/4, so that nothing cancels near the mirror direction and isotropic tables serve.

    Reciprocal; no form bounds the energy, and there is no masking: the albedo with the cosine falls towards grazing. Known
    failures: scale, b and c trade off along a ridge for narrow lobes; ior and scale as for ``abc``; in float32 slopes
    between two grazing directions are good to 5e-4.
    """

    name: ClassVar[str] = "abc_smooth"
    references: ClassVar[tuple[str, ...]] = ("low2012", "church1990", "cook1982")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    scale: Float[Array, " C"] = parameter(
        "value of the lobe at its peak over F, A",
        unit="1/sr",
        per_channel=True,
        linear=True,
        valid=NOT_NEGATIVE,
        default=1.0,
    )
    b: Float[Array, ""] = parameter("inverse width of the lobe", valid=POSITIVE, search=(1e-2, 1e9), default=100, log=True)
    c: Float[Array, ""] = parameter("fall-off of the tail", valid=NOT_NEGATIVE, search=(1e-3, 1e4), default=1, log=True)
    ior: Float[Array, ""] = parameter("index of refraction", valid=Interval(1), search=(1.001, 1001), default=1.5, log=True)

    @classmethod
    def shapes(cls, half_width: float) -> Iterable[dict[str, float]]:
        """Those of ``abc``, whose 1 - n.h is half of sin^2(theta_h) near the pole."""
        return [{**s, "b": s["b"] / 8} for s in ABC.shapes(half_width)]

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        apart2 = 4 * g.cos_d**2 * g.sin2_h
        cosine = jnp.sqrt(g.cos_d**2 + ((g.cos_i - g.cos_o) / 2) ** 2)
        lobe = jnp.exp(-self.c * jnp.log1p(self.b * apart2))
        return lambert(self.diffuse) + self.scale * dielectric_at(self.ior, cosine) * lobe
