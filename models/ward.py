"""Ward: a Gaussian of slopes, isotropic or elliptical."""

from __future__ import annotations

from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..geometry import Geometry
from . import ndf
from .base import BRDF, NOT_NEGATIVE, POSITIVE, parameter
from .common import diffuse_parameter, stretched_shapes
from .diffuse import lambert


def width_parameter(meaning: str) -> Any:
    """Width of a Gaussian of slopes."""
    return parameter(meaning, valid=POSITIVE, search=(1e-4, 30), default=0.15, log=True)


def specular_parameter() -> Any:
    """Scale of the lobe."""
    return parameter("scale of the lobe", per_channel=True, linear=True, valid=NOT_NEGATIVE, default=0.2)


class Ward(BRDF):
    """f = diffuse/pi + specular exp(-tan^2(theta_h)/alpha^2) / (4 pi alpha^2 sqrt(n.l n.v)) (Ward 1992, eq. 4).

    The survey's prints of it (Schwenk 2011, eq. 43 and 44) have lost alpha, pi and the root over n.l n.v. By integration,
    with all of them the albedo of the lobe at normal incidence tends to specular as alpha -> 0
    (tests/test_energy.py::test_scales_by_integration).
    Reciprocal. Does not conserve energy: towards grazing the albedo of the lobe rises without bound as 0.0668
    specular/sqrt(n.l) at the worst alpha, 0.72. That exceeds specular beyond 89.73 degrees only, and is 7.15 specular at
    89.995 degrees; at 80 degrees no alpha gives more than 0.27 specular
    (tests/test_energy.py::test_ward_towards_grazing).
    Has no Fresnel term and no masking: the rise towards grazing is that of 1/sqrt(n.l n.v) alone.
    """

    name: ClassVar[str] = "ward"
    references: ClassVar[tuple[str, ...]] = ("ward1992",)

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = specular_parameter()
    alpha: Float[Array, ""] = width_parameter("lobe width (rms slope times sqrt 2)")

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Narrower and wider than the lobe is."""
        alpha = np.tan(half_width) / np.sqrt(np.log(2))
        return [{"alpha": float(np.clip(alpha * k, 2e-4, 20))} for k in (0.3, 0.6, 1.0, 2.0, 5.0, 15.0)]

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        d = ndf.gaussian(g.tan2_h, self.alpha)
        return lambert(self.diffuse) + self.specular * (d / (4 * jnp.sqrt(g.cos_i * g.cos_o)))


class WardAnisotropic(BRDF):
    """f = diffuse/pi + specular exp(-tan^2 (cos^2 phi_h/alpha_x^2 + sin^2 phi_h/alpha_y^2)) / (4 pi alpha_x alpha_y
    sqrt(n.l n.v)) (Ward 1992, eq. 5). As :class:`Ward`, which it equals for alpha_x = alpha_y; a lobe that is narrow across
    the plane of incidence and 1.1 wide along it returns 1.5 times the worst of those.
    """

    name: ClassVar[str] = "ward"
    references: ClassVar[tuple[str, ...]] = ("ward1992",)
    anisotropic: ClassVar[bool] = True

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = specular_parameter()
    alpha_x: Float[Array, ""] = width_parameter("lobe width along the tangent")
    alpha_y: Float[Array, ""] = width_parameter("lobe width along the bitangent")

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Those of the round lobe, stretched."""
        return stretched_shapes(Ward.shapes(half_width), "alpha")

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        d = ndf.anisotropic_gaussian(*g.slopes(), self.alpha_x, self.alpha_y)
        return lambert(self.diffuse) + self.specular * (d / (4 * jnp.sqrt(g.cos_i * g.cos_o)))
