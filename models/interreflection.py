"""Light that masking stops goes on to other facets: how much a lobe misses of it, and how it comes out again."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.typing import NDArray

from ..geometry import Geometry
from ..quadrature import gauss_legendre
from . import ndf
from .masking import averted_area

ANGLES = 20
"""Chebyshev nodes of the angle of incidence."""
FACETS, AZIMUTHS = 24, 8
"""Gauss-Legendre nodes along theta_m, and along each quarter turn of phi_m."""


@lru_cache(maxsize=1)
def _interpolation() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Chebyshev nodes of x on [0, 1], and the matrix from values there to Chebyshev coefficients."""
    angle = np.pi * (np.arange(ANGLES) + 0.5) / ANGLES
    matrix = 2 / ANGLES * np.cos(np.arange(ANGLES)[:, None] * angle)
    matrix[0] /= 2
    return (np.cos(angle) + 1) / 2, matrix


class MissingEnergy(eqx.Module):
    """1 - E(theta) of a microfacet lobe that reflects all (F = 1), E its directional albedo.

    E(v) = int (v.m) G(l, v) / ((n.v)(n.m)) D(m) (n.m) dm with l the mirror image of v in m (Heitz 2014, eq. 20), over the m
    that send v above the horizon: for each azimuth a known range of theta_m, which is taken by its share of D (n.m). It is
    found at 20 angles of incidence. With tan(psi) = a tan(theta), a = min(1, 2 N(pi/2)), (1 - E)/(sin^2(psi) + a^2) is
    interpolated by Chebyshev polynomials in x = (1 - 2 psi/pi)^1/2: it stays near 1 however narrow the lobe is, and psi
    follows the layer near grazing where facets hide each other.

    Absolute error of 1 - E for GGX: 4e-4 for alpha >= 0.05, below that 1e-3 (tests/test_effects.py::test_white_furnace).
    """

    coefficients: Float[Array, " ANGLES"]
    width: Float[Array, ""]

    @staticmethod
    def of(facets: Any) -> MissingEnergy:
        """Of a GTR or GGX lobe."""
        dtype = jnp.result_type(facets.alpha)
        # Guard: powers of a width near the smallest number underflow, and 0/0 = NaN. In float32 lobes narrower than 1e-4
        # (half-widths are alpha/sqrt(gamma)) are compensated as if that wide (tests/test_effects.py::test_narrow_lobes).
        least = float(np.finfo(np.dtype(dtype)).tiny) ** 0.1055
        if isinstance(facets, ndf.GTR):
            facets = ndf.GTR(jnp.maximum(facets.alpha, least * jnp.sqrt(jnp.maximum(facets.gamma, 1))), facets.gamma)
        else:
            facets = ndf.GGX(jnp.maximum(facets.alpha, least))
        lobe = facets if isinstance(facets, ndf.GTR) else _GGX(facets.alpha)
        nodes, matrix = _interpolation()
        # Guard: of a lobe without a tail nothing faces away near grazing: 0/0 (tests/test_effects.py::test_narrow_lobes).
        a = jnp.clip(2 * averted_area(facets, jnp.asarray(1e-4, dtype)), least, 1)
        psi = (1 - nodes**2) * (np.pi / 2)
        sin_psi, cos_psi = (jnp.asarray(f(psi), dtype) for f in (np.sin, np.cos))
        norm = jnp.sqrt(sin_psi**2 + a**2 * cos_psi**2)
        missing = _missing(facets, lobe, a * cos_psi / norm, sin_psi / norm)
        return MissingEnergy(jnp.asarray(matrix, dtype) @ (missing / (sin_psi**2 + a**2)), a)

    def __call__(self, cosine: Float[Array, "..."]) -> Float[Array, "..."]:
        """1 - E at cos(theta)."""
        sin2 = (1 - cosine) * (1 + cosine)
        # Guard: the slope of the root at normal incidence (tests/test_effects.py::test_finite_at_corners).
        sine = jnp.sqrt(jnp.maximum(sin2, float(np.finfo(np.dtype(jnp.result_type(cosine))).tiny) ** 0.5))
        y = 2 * jnp.sqrt(2 / jnp.pi * jnp.arctan2(cosine, self.width * sine)) - 1
        before, last = jnp.zeros_like(y), jnp.zeros_like(y)  # Clenshaw's recurrence
        for c in self.coefficients[:0:-1]:
            before, last = last, 2 * y * last - before + c
        a2 = self.width**2
        return (y * last - before + self.coefficients[0]) * (a2 * sin2 / (cosine**2 + a2 * sin2) + a2)

    def mean(self) -> Float[Array, ""]:
        """1 - E_avg = 2 int (1 - E) cos d(cos), by nodes cos = a sinh(u) that are dense near grazing."""
        x, weight = (jnp.asarray(a, self.width.dtype) for a in gauss_legendre(32))
        end = jnp.arcsinh(1 / self.width)
        cosine = jnp.minimum(self.width * jnp.sinh(end * x), 1)
        return jnp.sum(2 * weight * end * self.width * jnp.cosh(end * x) * cosine * self(cosine))


class _GGX(ndf.GGX):
    """With what :class:`ndf.GTR` has for any gamma."""

    def cumulative(self, sin2: Array, cos2: Array) -> tuple[Array, Array]:
        near, far = sin2, self.alpha**2 * cos2
        return near / (near + far), far / (near + far)

    def quantile(self, share: Array, rest: Array) -> tuple[Array, Array]:
        sin2 = self.alpha**2 * share
        return sin2 / (sin2 + rest), rest / (sin2 + rest)


def _missing(facets: Any, lobe: ndf.GTR | _GGX, cosine: Float[Array, " n"], sine: Float[Array, " n"]) -> Float[Array, " n"]:
    """1 - E at cosines and sines of theta."""
    dtype = cosine.dtype
    x, wx = (jnp.asarray(a, dtype) for a in gauss_legendre(FACETS))
    y, wy = gauss_legendre(AZIMUTHS)
    offset = np.pi / 2 * y**2  # nodes crowd where, for grazing light, the range ends abruptly
    cos_phi = jnp.asarray(np.cos(np.r_[np.pi / 2 - offset, np.pi / 2 + offset]), dtype)[:, None]
    around = jnp.asarray(np.r_[y * wy, y * wy], dtype)
    c, s = cosine[:, None, None], sine[:, None, None]
    end = jnp.arctan2(c, -s * cos_phi) / 2  # half of pi/2 + delta, tan(delta) = tan(theta) cos(phi)
    share, rest = lobe.cumulative(jnp.sin(end) ** 2, jnp.cos(end) ** 2)
    far = (1 - x) ** 3  # and towards the end of the range, where the lobe's tail is
    sin2, cos2 = lobe.quantile(share * (1 - far), rest + share * far)
    # Guard: 0/0 at the end of the range, and shares that rounding takes below 0 (tests/test_effects.py::test_narrow_lobes).
    tiny = float(np.finfo(np.dtype(dtype)).tiny)
    sin_m, cos_m = jnp.sqrt(jnp.maximum(sin2, tiny)), jnp.sqrt(jnp.maximum(cos2, tiny))
    facing = s * sin_m * cos_phi + c * cos_m
    out = jnp.maximum(2 * facing * cos_m - c, 0)  # at the end of the range it is 0 to rounding
    # Guard: 0/0 on the horizon, where nothing is seen (tests/test_effects.py::test_narrow_lobes).
    above = jnp.clip(out, 1e-4, 1)
    light, viewer = averted_area(facets, above), averted_area(facets, c)
    # Guard: two quotients, because the derivative of one squares its divisor, 1e-22 here, beyond float32
    # (tests/test_effects.py::test_finite_at_corners).
    seen = out / (c * (out + light) + out * viewer) * (facing / cos_m)
    lost = jnp.sum(3 * wx * (1 - x) ** 2 * share * (1 - seen), -1) + rest[..., 0]
    return jnp.sum(around * lost, -1)


def compensation(facets: Any, mean_reflectance: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """F_ms (1 - E(l)) (1 - E(v)) / (pi (1 - E_avg)), F_ms = F^2 E_avg / (1 - F (1 - E_avg)), in 1/sr.

    Kulla & Conty (2017), with the mean reflectance F of one facet. Reciprocal; with F = 1 the lobe and this return all
    light, and with F <= 1 no more than that.
    """
    missing = MissingEnergy.of(facets)
    light, viewer = g.at_polar(missing)
    mean = missing.mean()
    f = mean_reflectance**2 * (1 - mean) / (1 - mean_reflectance * mean)
    # Guard: what a lobe narrower than 1e-6 misses is rounding, of either sign, and of the quotient of such the sign is, too
    # (tests/test_effects.py::test_a_mirror_takes_no_light_away).
    least = 100 * float(np.finfo(np.dtype(mean.dtype)).eps)
    return f / (jnp.pi * (mean + least)) * (light * viewer)


__all__ = ["MissingEnergy", "compensation"]
