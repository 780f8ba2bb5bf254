"""Wave optics of a Gaussian random surface: what of HTSG and Stam no table holds, its limit, and the series of both."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from brdfit import models
from brdfit.models.kirchhoff import scattering_series
from brdfit.stability import empirical as oracle
from brdfit.stability.oracle import DIGITS


def test_mirror_term():
    """The specular term of HTSG, which no table holds, against 40 digits, from normal incidence to grazing."""
    theta = np.radians([0, 1e-3, 10, 40, 70, 85, 89, 89.99])
    light = np.stack([np.sin(theta), 0 * theta, np.sin(np.pi / 2 - theta)], -1)
    mirror = jax.jit(lambda m, w: m.mirror_reflectance(w))
    with oracle.mp.workdps(DIGITS), jax.enable_x64(True):
        for sigma, tau, ior in ((0.02, 3.0, 1.5), (0.1, 0.4, 20.0), (0.3, 1.0, 1.5), (0.5, 9.0, 1.3)):
            m = models.model("htsg", diffuse=[0.1], specular=[0.7], ior=ior, sigma=sigma, tau=tau)
            got = np.asarray(mirror(m, light))[:, 0]
            numbers = [oracle.mpf(x) for x in (0.7, ior, sigma, tau)]
            want = [float(oracle.htsg_mirror(oracle.unit([oracle.mpf(float(x)) for x in w]), *numbers)) for w in light]
            np.testing.assert_allclose(got, want, rtol=1e-11)


def test_waves_become_facets():
    """For sigma -> infinity at a given slope m = 2 sigma/tau, HTSG is F S D/(4 n.l n.v) with Beckmann's D, to 1/g."""
    sigma, m, theta = 30.0, 0.3, np.radians([[0, 5, 20, 40], [0, 10, 30, 30]])
    light, viewer = (np.stack([s * np.sin(t), 0 * t, np.cos(t)], -1) for s, t in ((1, theta[0]), (-1, theta[1])))
    half = (light + viewer) / np.linalg.norm(light + viewer, axis=-1, keepdims=True)
    cos2 = half[:, 2] ** 2
    beckmann = np.exp(-(1 / cos2 - 1) / m**2) / (np.pi * m**2 * cos2**2)
    with jax.enable_x64(True):
        waves = models.model("htsg", diffuse=0.0, specular=1.0, ior=1e6, sigma=sigma, tau=2 * sigma / m)
        got = np.asarray(jax.jit(lambda a, b: waves(a, b))(light, viewer))[:, 0]
    np.testing.assert_allclose(got, beckmann / (4 * light[:, 2] * viewer[:, 2]), rtol=5e-3)  # S: 3e-3 at 40 degrees


def test_series():
    """The sum that HTSG and Stam share, over the corners of its two arguments, against 500 and more term-by-term sums."""
    g, t = np.meshgrid(np.geomspace(1e-12, 3e3, 27), [0, *np.geomspace(1e-8, 1e5, 18)])
    with jax.enable_x64(True):
        f = jax.jit(jax.vmap(jax.value_and_grad(scattering_series, (0, 1))))
        got, slopes = f(jnp.asarray(g.ravel()), jnp.asarray(t.ravel()))
    assert all(np.isfinite(s).all() for s in slopes)
    with oracle.mp.workdps(20):  # of which 1e-25 is left out
        want = [float(oracle.series(oracle.mpf(a), oracle.mpf(b))) for a, b in zip(g.ravel(), t.ravel(), strict=True)]
    # 1e-300: below, powers of g have lost digits; exponents of some hundreds count roundings as often
    np.testing.assert_allclose(got, want, rtol=1e-12, atol=1e-290)
