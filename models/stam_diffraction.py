"""Stam: diffraction by a Gaussian random surface, with a wavelength of its own for each channel."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from jaxtyping import Array, Float

from ..geometry import Geometry
from .base import BRDF, POSITIVE, Interval, parameter
from .common import diffuse_parameter, lobe_parameter
from .diffuse import lambert
from .fresnel import dielectric
from .kirchhoff import kirchhoff


def _length(meaning: str, default: float, search: tuple[float, float]) -> Any:
    return parameter(meaning, per_channel=True, valid=POSITIVE, search=search, default=default, log=True)


class StamDiffraction(BRDF):
    """f = diffuse/pi + specular F_dielectric(ior, c_d) G D / (pi n.l n.v), G D as in :class:`HTSG` (Stam 1999, for an
    isotropic surface with Gaussian correlation).

    Stam's (1 + l.v)^2/(n.l + n.v)^2 is (c_d/(n.h))^2, and his transform of the surface is the series of He et al., of whose
    model this is the case without masking: neither S nor the effective roughness. What is his is colour: sigma and tau are
    in wavelengths, one pair for each channel, and where diffraction makes the colours they are inversely proportional to
    its wavelength. Not here: his periodic surfaces (the compact disc), which an isotropic table cannot show.
    Reciprocal. Without masking the albedo exceeds 1 at grazing. Known failures: those of :class:`HTSG`, for each channel;
    in float32 slopes are good to 2e-4 for sigma of 10.
    """

    name: ClassVar[str] = "stam_diffraction"
    references: ClassVar[tuple[str, ...]] = ("stam1999", "he1991", "cook1982")

    diffuse: Float[Array, " C"] = diffuse_parameter()
    specular: Float[Array, " C"] = lobe_parameter()
    sigma: Float[Array, " C"] = _length("rms height in wavelengths", 0.15, (1e-3, 10))
    tau: Float[Array, " C"] = _length("correlation length in wavelengths", 1.5, (0.05, 1e3))
    ior: Float[Array, ""] = parameter("index of refraction", valid=Interval(1), search=(1.01, 100), default=1.5, log=True)

    @classmethod
    def shapes(cls, half_width: float) -> list[dict[str, float]]:
        """Smooth to rough heights, with the correlation length that makes the lobe as wide, for two indices."""
        found = []
        for sigma in (0.05, 0.15, 0.5, 2.0):
            tau = np.sqrt(np.log(2) * max(1.0, (4 * np.pi * sigma) ** 2)) / (2 * np.pi * np.sin(half_width))
            found += [{"sigma": sigma, "tau": float(np.clip(tau, 0.06, 900)), "ior": n} for n in (1.5, 10.0)]
        return found

    def evaluate(self, g: Geometry) -> Float[Array, "..."]:
        """Value in 1/sr."""
        lobe = kirchhoff(self.sigma**2, self.tau, g) / (g.cos_i * g.cos_o)
        return lambert(self.diffuse) + self.specular * dielectric(self.ior, g) * lobe
