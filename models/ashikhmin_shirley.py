"""Ashikhmin-Shirley: a Phong lobe of the half vector with Schlick's Fresnel and a body term that gives way to it."""

from __future__ import annotations

from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import Geometry
from . import ndf
from .base import BRDF, NOT_NEGATIVE, Interval, parameter
from .common import diffuse_parameter, stretched_shapes
from .diffuse import ashikhmin_shirley_body
from .fresnel import schlick


def _exponent(meaning: str) -> Any:
    return parameter(meaning, valid=NOT_NEGATIVE, search=(1e-3, 1e7), default=100, log=True)


def _specular() -> Any:
    return parameter(
        "reflectance at normal incidence, Rs",
        per_channel=True,
        linear=True,
        valid=Interval(0, 1),
        search=(0, 1 - 1e-9),
        default=0.04,
    )


class AshikhminShirley(BRDF):
    """f = 28 diffuse/(23 pi) (1 - specular)(1 - (1 - n.v/2)^5)(1 - (1 - n.l/2)^5)
    + (e + 1)/(8 pi) (n.h)^e F_schlick(specular, c_d) / (c_d max(n.l, n.v)) (Ashikhmin & Shirley 2000, eq. 4 and 5).

    The survey's print of it (Schwenk 2011, eq. 41) has lost pi and the root over (e_x + 1)(e_y + 1). By integration the
    paper's form returns what falls on it, or less.
    Reciprocal; conserves energy for diffuse, specular <= 1 (tests/test_energy.py::test_ashikhmin_shirley_conserves_energy).
    Known failure: on rough materials the best fit uses the lobe (exponent -> 0) as body term.
    """

    name: ClassVar[str] = "ashikhmin_shirley"
    references: ClassVar[tuple[str, ...]] = ("ashikhmin2000", "schlick1994")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = _specular()
    exponent: Float[Array, ""] = _exponent("Phong exponent of the lobe")

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Narrower and wider than the lobe is, and lobes that serve as body."""
        exponent = -np.log(2) / np.log(np.cos(half_width))
        shapes = [{"exponent": float(np.clip(exponent * k, 2e-3, 5e6))} for k in (0.1, 0.3, 1.0, 3.0, 10.0)]
        return shapes + [{"exponent": e} for e in (0.05, 1.0, 5.0)]

    def normal_reflectance(self) -> Float[Array, ""]:
        """F0, a parameter of the model."""
        return self.specular

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        d = ndf.power_cosine(g.sin2_h, g.cos2_h, self.exponent)
        lobe = schlick(self.specular, g) * (d / (4 * g.cos_d * jnp.maximum(g.cos_i, g.cos_o)))
        return ashikhmin_shirley_body(self.diffuse, self.specular, g) + lobe


class AshikhminShirleyAnisotropic(BRDF):
    """As :class:`AshikhminShirley` with sqrt((e_x+1)(e_y+1)) (n.h)^((e_x h_x^2 + e_y h_y^2)/(h_x^2 + h_y^2)) for the lobe
    (Ashikhmin & Shirley 2000, eq. 4), which it equals for exponent_x = exponent_y.
    """

    name: ClassVar[str] = "ashikhmin_shirley"
    references: ClassVar[tuple[str, ...]] = ("ashikhmin2000", "schlick1994")
    anisotropic: ClassVar[bool] = True

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = _specular()
    exponent_x: Float[Array, ""] = _exponent("Phong exponent along the tangent")
    exponent_y: Float[Array, ""] = _exponent("Phong exponent along the bitangent")

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Those of the round lobe, stretched."""
        return stretched_shapes(AshikhminShirley.shapes(half_width), "exponent")

    def normal_reflectance(self) -> Float[Array, ""]:
        """F0, a parameter of the model."""
        return self.specular

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        d = ndf.power_cosine_anisotropic(*g.tangential(), g.cos2_h, self.exponent_x, self.exponent_y)
        lobe = schlick(self.specular, g) * (d / (4 * g.cos_d * jnp.maximum(g.cos_i, g.cos_o)))
        return ashikhmin_shirley_body(self.diffuse, self.specular, g) + lobe
