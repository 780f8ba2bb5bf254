"""SGD in the exact form that Bagher et al. fitted, with their approximation of its masking."""

from __future__ import annotations

from typing import Any, ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry
from ..models.base import BRDF, NOT_NEGATIVE, POSITIVE, REAL, Interval, parameter
from ..models.common import diffuse_parameter
from ..models.diffuse import lambert
from ..models.fresnel import sgd_fresnel


def _each(meaning: str, valid: Interval = REAL, unit: str = "1") -> Any:
    return parameter(meaning, valid=valid, unit=unit, per_channel=True)


class PublishedSGD(BRDF):
    """f = [diffuse + specular F D G1(l) G1(v)/(n.l n.v)]/pi (Bagher et al. 2012), all per channel.

    D = normaliser exp(-x)/(x^p pi cos^4), x = alpha + tan^2(theta_h)/alpha; F = f0 - f1 c_d + (1 - f0)(1 - c_d)^5;
    G1(theta) = clamp01(1 + lam (1 - exp(c max(0, theta - theta0)^k))), which approximates the Smith masking of D.

    c reaches 1e109 in the published numbers, with k near 200 and above: its logarithm is the parameter, and c t^k is
    formed as exp(log_c + k ln t). For a model to fit with, use ``sgd``: its masking follows from D.
    """

    name: ClassVar[str] = "published_sgd"
    references: ClassVar[tuple[str, ...]] = ("bagher2012",)

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = _each("scale of the lobe", NOT_NEGATIVE)
    alpha: Float[Array, " C"] = _each("lobe width (mean square slope)", POSITIVE)
    p: Float[Array, " C"] = _each("fall-off of the tail")
    f0: Float[Array, " C"] = _each("Fresnel constant")
    f1: Float[Array, " C"] = _each("Fresnel linear term")
    normaliser: Float[Array, " C"] = _each("K, equal to 1/(alpha Gamma(1 - p, alpha)) up to rounding", POSITIVE)
    lam: Float[Array, " C"] = _each("Lambda of G1", POSITIVE)
    log_c: Float[Array, " C"] = _each("ln c of G1, c in rad^-k")
    k: Float[Array, " C"] = _each("k of G1", POSITIVE)
    theta0: Float[Array, " C"] = _each("polar angle where masking sets in", unit="rad")

    def masking(self, theta: Float[Array, "..."]) -> Float[Array, "..."]:
        """G1 at polar angles in radians."""
        beyond = theta - self.theta0
        masked = beyond > 0
        log = self.log_c + self.k * jnp.log(jnp.where(masked, beyond, 1.0))
        # e^(e^4) = 5e23 times the smallest published Lambda, 4.5e-8, is far above 1: G1 is 0 there, and nothing overflows.
        loss = self.lam * jnp.expm1(jnp.exp(jnp.minimum(log, 4.0)))
        return jnp.where(masked, jnp.clip(1 - loss, 0, 1), 1.0)

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        x = self.alpha + g.tan2_h / self.alpha
        d = self.normaliser * jnp.exp(-x - self.p * jnp.log(x) + 2 * jnp.log1p(g.tan2_h)) / jnp.pi
        visible = self.masking(g.theta_i) * self.masking(g.theta_o) / (jnp.pi * g.cos_i * g.cos_o)
        return lambert(self.diffuse) + self.specular * sgd_fresnel(self.f0, self.f1, g) * (d * visible)
