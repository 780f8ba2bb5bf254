"""He, Torrance, Sillion and Greenberg: wave optics of a Gaussian random surface, with masking."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jax.scipy.special import erfc
from jaxtyping import Array, ArrayLike, Float

from ..geometry import Geometry, from_directions
from ..special import lambert_w, sine
from .base import BRDF, POSITIVE, Interval, parameter
from .common import diffuse_parameter, lobe_parameter
from .diffuse import lambert
from .fresnel import dielectric
from .kirchhoff import kirchhoff


class HTSG(BRDF):
    """f = diffuse/pi + specular F_dielectric(ior, c_d) S(l) S(v) G D / (pi n.l n.v) (He et al. 1991, eq. 24, 25 and 76 to
    83): the uniform-diffuse and the directional-diffuse term. The third term, the light that leaves in the mirror direction
    alone, is in no table: :meth:`mirror_reflectance`.

    sigma and tau, height and correlation length of the surface, are in wavelengths and, as in Ngan et al. (2005), shared
    by the channels: the paper has lengths, and a wavelength and complex index for each channel. The scale ``specular``, 1
    in the paper, is theirs too. D is a series, of which less than 1e-15 is left out
    (:func:`~brdfit.models.kirchhoff.scattering_series`). The roughness that light sees, sigma/sqrt(1 + (z/sigma)^2) with
    z by eq. 80, is closed by Lambert's W. Eq. 25 as printed lacks the exp(-a^2) that Smith's Lambda and its errata have, and
    v in eq. 78 has to carry 2 pi/lambda: so, for sigma -> infinity, F S D/(4 n.l n.v) with Beckmann's D is left.
    Reciprocal; energy is not bounded by the scale. Known failures: for sigma above 1 only sigma/tau is determined, for sigma
    below 0.05 only specular sigma^2; specular and ior trade off; in float32 slopes are good to 1e-4 for
    sigma of 10. The slowest of the models: up to 120 terms a value.
    """

    name: ClassVar[str] = "htsg"
    references: ClassVar[tuple[str, ...]] = ("he1991", "ngan2005", "cook1982", "smith1967")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = lobe_parameter()
    ior: Float[Array, ""] = parameter("index of refraction", valid=Interval(1), search=(1.01, 100), default=1.5, log=True)
    sigma: Float[Array, ""] = parameter(
        "rms height in wavelengths", valid=POSITIVE, search=(1e-3, 10), default=0.15, log=True
    )
    tau: Float[Array, ""] = parameter(
        "correlation length in wavelengths", valid=POSITIVE, search=(0.05, 1e3), default=1.5, log=True
    )

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Smooth to rough heights, with the correlation length that makes the lobe as wide, for two indices."""
        found = []
        for sigma in (0.05, 0.15, 0.6, 2.0):
            orders = max(1.0, (4 * np.pi * sigma) ** 2)
            tau = np.sqrt(np.log(2) * orders) / (2 * np.pi * np.sin(half_width))
            found += [{"sigma": sigma, "tau": float(np.clip(tau, 0.06, 900)), "ior": n} for n in (1.5, 10.0)]
        return found

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        seen, visible = self._surface(g)
        lobe = kirchhoff(seen, self.tau, g) * visible
        return lambert(self.diffuse) + self.specular * dielectric(self.ior, g) * lobe

    def mirror_reflectance(self, wi: ArrayLike) -> Float[Array, "... C"]:
        """F e^(-g) S: the part of the light from ``wi`` ``[..., 3]`` that leaves in the mirror direction, ``[..., C]``
        (He et al. 1991, the specular term).
        """
        wi = jnp.asarray(wi)
        g = from_directions(wi, wi * jnp.array([-1, -1, 1], wi.dtype))
        seen, visible = self._surface(g)
        returned = dielectric(self.ior, g) * jnp.exp(-16 * jnp.pi**2 * seen * g.cos_i**2) * visible * g.cos_i**2
        return returned[..., None] * self.specular

    def _surface(self, g: Geometry) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
        """The variance of the heights that light and viewer see, and S(l) S(v)/(n.l n.v)."""
        steep_i, visible_i = self._polar(g.cos_i)
        steep_o, visible_o = self._polar(g.cos_o)
        # z/sigma = x: x exp(x^2/2) = (K_i + K_r)/(4 sqrt(pi/2)), so that x^2 = W of the square of the right side
        rise = lambert_w((steep_i + steep_o) ** 2 / (8 * jnp.pi))
        return self.sigma**2 / (1 + rise), visible_i * visible_o

    def _polar(self, cosine: Float[Array, "..."]) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
        """K = tan(theta) erfc(a) (He et al. 1991, eq. 82) and S/cos(theta), S = (1 - erfc(a)/2)/(1 + Lambda) (eq. 24), for
        a = tau cot(theta)/(2 sigma). cos(theta) Lambda has no 1/cot: the quotient is finite at grazing.
        """
        s = sine(cosine)
        a = self.tau * cosine / (2 * self.sigma * s)
        facing = 1 - erfc(a) / 2
        spread = s * self.sigma / (self.tau * jnp.sqrt(jnp.pi)) * jnp.exp(-a * a)
        return s / cosine * erfc(a), facing / (cosine * facing + spread)
