"""Löw's microfacet model as it was published, with its scale in place of a normalised lobe."""

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
from .fresnel import dielectric
from .masking import vcavity


class LowMicrofacet(BRDF):
    """f = diffuse/pi + scale F_dielectric(ior, c_d) G_vcavity / (pi n.l n.v (1 + b (1 - n.h))^c) (Löw et al. 2012, eq. 15).

    The same lobes as ``abc``, whose specular = 4 scale/(pi k) has D normalised: fit that one, where scale and b do not run
    against each other. Reciprocal; no form bounds the energy: published fits have scale up to 2e5. Known failures: as for
    ``abc``, and scale, b and c trade off along a ridge for narrow lobes, where only scale/b^c is determined.
    """

    name: ClassVar[str] = "low_microfacet"
    references: ClassVar[tuple[str, ...]] = ("low2012", "church1990", "cook1982")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    scale: Float[Array, " C"] = parameter(
        "scale of the lobe, A", per_channel=True, linear=True, valid=NOT_NEGATIVE, default=1.0
    )
    b: Float[Array, ""] = parameter("inverse width of the lobe", valid=POSITIVE, search=(1e-2, 1e9), default=100, log=True)
    c: Float[Array, ""] = parameter("fall-off of the tail", valid=NOT_NEGATIVE, search=(1e-3, 1e4), default=1, log=True)
    ior: Float[Array, ""] = parameter("index of refraction", valid=Interval(1), search=(1.001, 1001), default=1.5, log=True)

    @classmethod
    def shapes(cls, half_width: float) -> Iterable[dict[str, float]]:
        """Those of ``abc``."""
        return ABC.shapes(half_width)

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        lobe = jnp.exp(-self.c * jnp.log1p(self.b * g.vers_h))
        return lambert(self.diffuse) + self.scale * dielectric(self.ior, g) * (lobe * (4 / jnp.pi * vcavity(g)))
