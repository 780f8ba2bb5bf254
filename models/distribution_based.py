"""Ashikhmin and Premoze: a tabulated distribution of half vectors, estimated from the data, in place of a formula."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from .base import BRDF, REAL, Interval, parameter
from .common import diffuse_parameter, lobe_parameter
from .diffuse import lambert
from .fresnel import schlick

KNOTS = 12
WIDTH = 2e-3
"""Of sin(theta_h): below, knots are evenly spaced in sin^2(theta_h), above in its logarithm."""
_RANGE = math.log1p(1 / WIDTH**2)


def _fall(knot: int, half_width: float, power: float) -> float:
    """ln p at a knot for a lobe p = (1 + x sin^2)^-power that halves at ``half_width``."""
    sin2 = WIDTH**2 * math.expm1(_RANGE * knot / (KNOTS - 1))
    return -power * math.log1p(math.expm1(math.log(2) / power) * sin2 / math.sin(half_width) ** 2)


def _log_density(knot: int) -> Any:
    sine = math.sqrt(WIDTH**2 * math.expm1(_RANGE * knot / (KNOTS - 1)))
    meaning = f"ln p(h)/p(n) at sin(theta_h) = {sine:.3g}"
    return parameter(meaning, valid=REAL, search=(-60, 30), default=_fall(knot, 0.1, 2.0))


def _basis(x: Float[Array, "..."]) -> Float[Array, "..."]:
    """The cubic B-spline of unit knots, centred at 0."""
    a = jnp.abs(x)
    return (jnp.maximum(2 - a, 0) ** 3 - 4 * jnp.maximum(1 - a, 0) ** 3) / 6


class DistributionBased(BRDF):
    """f = diffuse/pi + specular p(h) F_schlick(f0, c_d)/(n.l + n.v - (n.l)(n.v)) (Ashikhmin & Premoze 2007).

    ln p is a cubic B-spline of u = ln(1 + sin^2(theta_h)/0.002^2), straight beyond its ends, with coefficients 0, p_1 ...
    p_11 at twelve evenly spaced u: p(n) = 1, and its scale is specular, one for each channel. The paper tabulates p from
    retro-reflection, where p = f (2 cos - cos^2)/F(1), and divides by its integral; here all of the table determines it, as
    parameters of the fit. One distribution and f0 for all channels. The body term is an addition, as for metals it is 0.
    Reciprocal. Energy is not bounded by the form. Known failures: a knot that no datum is near is undetermined; specular and
    f0 trade off where c_d near 0 is not measured; in float32 values are good to 1e-4 where knots of +-60 cancel.
    """

    name: ClassVar[str] = "distribution_based"
    references: ClassVar[tuple[str, ...]] = ("ashikhmin2007", "schlick1994")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = lobe_parameter()
    f0: Float[Array, ""] = parameter(
        "reflectance at normal incidence", valid=Interval(0, 1), search=(1e-3, 1), default=0.2, log=True
    )
    p_1: Float[Array, ""] = _log_density(1)
    p_2: Float[Array, ""] = _log_density(2)
    p_3: Float[Array, ""] = _log_density(3)
    p_4: Float[Array, ""] = _log_density(4)
    p_5: Float[Array, ""] = _log_density(5)
    p_6: Float[Array, ""] = _log_density(6)
    p_7: Float[Array, ""] = _log_density(7)
    p_8: Float[Array, ""] = _log_density(8)
    p_9: Float[Array, ""] = _log_density(9)
    p_10: Float[Array, ""] = _log_density(10)
    p_11: Float[Array, ""] = _log_density(11)

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Lobes of this width with heavy, middling and light tails."""
        found = [{f"p_{k}": _fall(k, half_width, power) for k in range(1, KNOTS)} for power in (0.7, 1.5, 4.0)]
        return [{**p, "f0": f0} for p in found for f0 in (0.05, 0.7)]

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        p = [jnp.zeros_like(self.p_1), *(getattr(self, f"p_{k}") for k in range(1, KNOTS))]
        p = [2 * p[0] - p[1], *p, 2 * p[-1] - p[-2]]  # without curvature at its ends
        x = jnp.log1p(g.sin2_h / WIDTH**2) * ((KNOTS - 1) / _RANGE)
        log_p = sum((c * _basis(x - k) for k, c in enumerate(p, -1)), jnp.zeros_like(x))
        lobe = jnp.exp(log_p) / (g.cos_i + g.cos_o - g.cos_i * g.cos_o)
        return lambert(self.diffuse) + self.specular * schlick(self.f0, g) * lobe
