"""Generalised Trowbridge-Reitz distribution (Burley 2012, appendix B.2; Hoffman 2013, eq. 25-28)."""

from __future__ import annotations

from itertools import product

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...special import expm1_ratio, log1p_ratio


class GTR(eqx.Module):
    """D = k / ((n.m)^2 (alpha^2 - 1) + 1)^gamma, with k = (gamma-1)(alpha^2-1) / (pi (1 - alpha^(2 - 2 gamma))).

    ``alpha`` > 0 is the width, ``gamma`` > 0 the fall-off: 2 is Trowbridge-Reitz (GGX), 1 is Berry's distribution.

    Evaluated as  D = phi(M) / (pi phi((1-gamma) M)) / (1 + w u)^gamma,  phi(x) = (e^x - 1)/x,  M = |ln alpha^2|,
    w = e^M - 1, u = sin^2 for alpha <= 1 and cos^2 above: the same number, but without the singularities of k at gamma = 1
    and alpha = 1, without cancellation in the base, and in range from the power law (alpha -> 0) to the Gaussian
    exp(-K sin^2) that gamma -> infinity with K = gamma (1/alpha^2 - 1) fixed tends to. w is formed from alpha, since a
    rounding of M counts M times in e^M, and then gamma times.
    """

    alpha: Float[Array, ""]
    gamma: Float[Array, ""]

    @staticmethod
    def shapes(half_width: float) -> list[dict[str, float]]:
        """Parameters that a fit to a lobe of this half-width starts from."""
        s2 = np.sin(half_width) ** 2
        shapes = []
        for gamma, scale in product((1.1, 2.0, 4.0), (0.3, 1.0, 3.0)):
            kappa = np.expm1(np.log(2) / gamma) / (s2 * scale**2)
            shapes.append({"alpha": float((1 + kappa) ** -0.5), "gamma": gamma})
        # the pure power law, its gentler neighbours, the Gaussian limit, and lobes that grow towards grazing
        shapes += [{"alpha": a, "gamma": g} for a, g in ((1e-6, 1.03), (1e-6, 1.15), (1e-4, 1.15), (3e-3, 1.4))]
        for scale in (0.5, 1.0, 2.0):
            gamma = 300.0
            shapes.append({"alpha": float(np.exp(-np.log(2) / (s2 * scale**2) / gamma / 2)), "gamma": gamma})
        return shapes + [{"alpha": a, "gamma": g} for a, g in ((1.3, 2.0), (2.0, 1.0), (1.05, 20.0))]

    def __call__(self, sin2: Float[Array, "..."], cos2: Float[Array, "..."]) -> Float[Array, "..."]:
        """D in 1/sr."""
        narrow, m, w = self._base()
        u = jnp.where(narrow, sin2, cos2)
        # Guard: a reciprocal, because the derivative of a quotient a/b forms a db, 1e43 here, beyond float32
        # (tests/test_stability.py::test_random_draws_are_finite).
        k = expm1_ratio(m) * (1 / (jnp.pi * expm1_ratio((1 - self.gamma) * m)))
        # Guard: k may be 1e25 where exp is below float32, and its root is not
        # (tests/test_ndf.py::test_tails_in_single_precision).
        half = jnp.exp(-self.gamma / 2 * jnp.log1p(w * u))
        return k * half * half

    def cumulative(
        self, sin2: Float[Array, "..."], cos2: Float[Array, "..."]
    ) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
        """The share of int D (n.m) dm that lies nearer to the normal, and the rest of it.

        Of u, where D is a power of 1 + w u, it is expm1(e r M)/expm1(e M) with e = 1 - gamma, r = ln(1 + w u)/M.
        """
        narrow, m, w = self._base()
        e = 1 - self.gamma
        u = jnp.where(narrow, sin2, cos2)
        r = u * log1p_ratio(w * u) / log1p_ratio(w)
        below = r * expm1_ratio(e * r * m) / expm1_ratio(e * m)
        above = (1 - r) * jnp.exp(e * r * m) * expm1_ratio(e * m * (1 - r)) / expm1_ratio(e * m)
        return jnp.where(narrow, below, above), jnp.where(narrow, above, below)

    def quantile(
        self, share: Float[Array, "..."], rest: Float[Array, "..."]
    ) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
        """``(sin^2, cos^2)`` at a share of :meth:`cumulative` and the rest, 1 - share."""
        narrow, m, _ = self._base()
        e = 1 - self.gamma
        below, above = jnp.where(narrow, share, rest), jnp.where(narrow, rest, share)
        z = below * jnp.expm1(e * m)
        far = z < -0.5
        # Guard: the logarithm of what is left of 1 + z where it cancels, and 0/0 where it does not
        # (tests/test_ndf.py::test_quantiles_of_gtr_at_both_ends).
        near = below * expm1_ratio(e * m) * log1p_ratio(jnp.where(far, 0, z))
        # Guard: nothing is left of 1 + z at the end of a range where e^(e M) is below the smallest number, and there r is 1
        # (tests/test_ndf.py::test_quantiles_of_gtr_at_both_ends).
        left = above + below * jnp.exp(e * m)
        end = left == 0
        r = jnp.where(far, jnp.where(end, 1, jnp.log(jnp.where(end, 1, left)) / jnp.where(far, e * m, 1)), near)
        u = r * expm1_ratio(r * m) / expm1_ratio(m)
        v = (1 - r) * jnp.exp(r * m) * expm1_ratio((1 - r) * m) / expm1_ratio(m)
        return jnp.where(narrow, u, v), jnp.where(narrow, v, u)

    def _base(self) -> tuple[Array, Array, Array]:
        """Whether u is sin^2, M and w."""
        a, log_alpha2 = self.alpha, 2 * jnp.log(self.alpha)
        narrow = a <= 1
        m = jnp.where(narrow, -log_alpha2, log_alpha2)  # not abs: its derivative at alpha = 1 would be 0
        return narrow, m, jnp.where(narrow, (1 - a) / a * ((1 + a) / a), (a - 1) * (a + 1))
