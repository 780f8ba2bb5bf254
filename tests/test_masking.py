"""Masking-shadowing: Smith's integral against its definition and closed forms, and the V-cavity."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit.geometry import from_directions
from brdfit.models import masking, ndf
from brdfit.stability import oracle
from mpmath import mpf

from . import cases

COSINES = np.sin(np.pi / 2 - np.radians([5.0, 30.0, 60.0, 80.0, 89.0, 89.995]))


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        *[("GTR", p) for p in [(0.2, 2.0), (1e-7, 1.05), (1.0, 1.0), (0.01, 1e3), (10.0, 1e7), (0.5, 0.01)]],
        *[("SGD", p) for p in [(0.05, 0.6), (0.1, -10.0), (30.0, 60.0), (1e-4, 1.0), (3.0, -2.0)]],
    ],
)
def test_against_the_projected_area(name: str, parameters: tuple[float, float]):
    """G1 = n.v / integral of max(0, v.m) D(m), in 40 digits; 1e-8 is promised. The rule errs by 1e-10 and the
    oracle leaves out 4e-11 at either end.
    """
    density, area = {"GTR": (ndf.GTR, oracle.gtr_masking), "SGD": (ndf.SGD, oracle.sgd_masking)}[name]
    with jax.enable_x64(True):
        got = 1 / (1 + masking.smith_lambda(density(*map(jnp.asarray, parameters)), jnp.asarray(COSINES)))
    with oracle.mp.workdps(oracle.DIGITS):
        want = [float(area(*map(mpf, parameters), mpf(float(c)))) for c in COSINES]
    np.testing.assert_allclose(got, want, rtol=2e-10)


@pytest.mark.parametrize("alpha", [1e-4, 0.1, 1.0, 5.0])
def test_ggx(alpha: float):
    """Walter et al. (2007), eq. 34: the closed form for gamma = 2, where the rule's error is below its rounding."""
    tan2 = (1 - COSINES) * (1 + COSINES) / COSINES**2
    want = (np.sqrt(1 + alpha**2 * tan2) - 1) / 2
    with jax.enable_x64(True):
        got = np.asarray(masking.smith_lambda(ndf.GTR(jnp.asarray(alpha), jnp.asarray(2.0)), jnp.asarray(COSINES)))
    np.testing.assert_allclose(1 + got, 1 + want, rtol=1e-13)


@pytest.mark.parametrize(("density", "parameters"), [(ndf.GTR, (0.3, 1.5)), (ndf.SGD, (0.1, 0.8)), (ndf.ABC, (50.0, 1.2))])
def test_projected_area_is_conserved(density: type, parameters: tuple[float, float]):
    """The integral of G1 D max(0, v.m) over microfacets is n.v (Heitz 2014, eq. 15), by a rule in both angles.

    The kink of max(0, .) leaves about 1/n^2 of a rule with n nodes: 400 in the azimuth give 1e-5.
    """
    x, w = np.polynomial.legendre.leggauss(300)
    theta, weight = (x + 1) * np.pi / 4, w * np.pi / 4
    phi = (np.arange(400) + 0.5) * np.pi / 400
    with jax.enable_x64(True):
        lobe = density(*map(jnp.asarray, parameters))
        d = np.asarray(lobe(jnp.asarray(np.sin(theta) ** 2), jnp.asarray(np.cos(theta) ** 2)))
        for cosine in COSINES[:4]:
            g1 = 1 / (1 + float(masking.smith_lambda(lobe, jnp.asarray(cosine))))
            sine = np.sqrt(1 - cosine**2)
            facing = np.maximum(0, cosine * np.cos(theta)[:, None] + sine * np.sin(theta)[:, None] * np.cos(phi))
            area = np.sum(weight * np.sin(theta) * d * facing.mean(1) * 2 * np.pi)
            assert g1 * area == pytest.approx(cosine, rel=2e-5)


@pytest.mark.parametrize("density", [ndf.GTR, ndf.SGD, ndf.ABC])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_normal_incidence(density: type, dtype: type):
    """Lambda is 0, with finite derivatives of both orders, at normal incidence and next to it."""
    with jax.enable_x64(dtype is np.float64):
        f = lambda v: masking.smith_lambda(density(v[0], v[1]), v[2])  # noqa: E731
        orders = jax.jit(lambda v: (f(v), jax.grad(f)(v), jax.hessian(f)(v)))
        for cosine in (1.0, 1 - np.finfo(dtype).eps):
            value, first, second = orders(jnp.asarray([0.3, 1.2, cosine], dtype))
            assert abs(value) < 10 * np.finfo(dtype).eps
            assert np.isfinite(first).all()
            assert np.isfinite(second).all()


def test_correlated_and_separable():
    """1/(1 + L(l) + L(v)) and G1(l) G1(v), from the closed form of GGX; correlated masking is never the smaller."""
    with jax.enable_x64(True):
        g = from_directions(cases.WI, cases.WO)
        lobe = ndf.GTR(jnp.asarray(0.4), jnp.asarray(2.0))
        light, viewer = ((np.sqrt(1 + 0.16 * (1 / c**2 - 1)) - 1) / 2 for c in (cases.WI[:, 2], cases.WO[:, 2]))
        over = 4 * g.cos_i * g.cos_o
        correlated, separable = over * masking.smith_correlated(lobe, g), over * masking.smith_separable(lobe, g)
    # 1e-12: the closed form as written here cancels near normal incidence
    np.testing.assert_allclose(correlated, 1 / (1 + light + viewer), rtol=1e-12)
    np.testing.assert_allclose(separable, 1 / ((1 + light) * (1 + viewer)), rtol=1e-12)
    assert (correlated >= separable).all()


def test_vcavity():
    """min(1, 2 n.h n.v/c_d, 2 n.h n.l/c_d) from the directions (Cook & Torrance 1982), over 4 n.l n.v."""
    with jax.enable_x64(True):
        got = 4 * cases.WI[:, 2] * cases.WO[:, 2] * masking.vcavity(from_directions(cases.WI, cases.WO))
    h = cases.WI + cases.WO
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    cd = np.sum(h * cases.WI, 1)
    want = np.minimum(1, 2 * h[:, 2] * np.minimum(cases.WI[:, 2], cases.WO[:, 2]) / cd)
    # c_d of the plain product has no more digits where both directions graze at 89.995 degrees: 1e-16/c_d^2 = 1e-8
    np.testing.assert_allclose(got, want, rtol=1e-7)
