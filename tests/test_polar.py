"""Functions of a polar angle through a table of it."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit.models import masking, ndf
from brdfit.polar import PolarStencil

LIMIT = float(np.radians(80))


def through_table(f, cosine, limit=LIMIT):
    with jax.enable_x64(True):
        stencil = PolarStencil.of(cosine, limit)
        return np.asarray(stencil.interpolate(stencil.tabulate(f)))


LOBES = [
    *((ndf.GTR, (alpha, gamma)) for alpha in (1e-4, 1e-2, 0.1, 0.6, 2.0) for gamma in (0.6, 2.0, 6.0)),
    (ndf.GTR, (1e-7, 1.05)),
    *((ndf.SGD, shape) for shape in ((1e-6, 0.2), (1e-4, 0.2), (0.05, 0.6), (0.85, 0.0), (5.0, 20.0))),
]


@pytest.mark.parametrize(("degrees", "promised"), [(80, 3e-9), (85, 1e-8), (89, 5e-8), (89.9, 2e-7), (89.999, 2e-6)])
def test_smith_through_the_table(degrees, promised):
    """What the module says of tables for fits."""
    check(lambda f, c: through_table(f, c, float(np.radians(degrees))), degrees, promised)


def test_smith_through_the_fine_table():
    def through(f, cosine):
        with jax.enable_x64(True):
            c = jnp.asarray(cosine)
            stencil = PolarStencil.to_horizon(c, jnp.sqrt((1 - c) * (1 + c)))
            return np.asarray(stencil.interpolate(stencil.tabulate(f)))

    check(through, 89.999, 5e-9)


def check(through, degrees, promised):
    """G1 of all lobes at angles that are dense towards the horizon."""
    x = np.radians(np.concatenate([90 - np.linspace(0, degrees, 2001), np.geomspace(90 - degrees, 90, 2001)]))
    cosine = np.sin(x)
    for lobe, parameters in LOBES:
        with jax.enable_x64(True):
            f = partial(masking.averted_area, lobe(*map(jnp.asarray, parameters)))
            exact = np.asarray(f(jnp.asarray(cosine)))
        found = through(f, cosine)
        said = f"{lobe.__name__} {parameters} at {degrees}"
        np.testing.assert_allclose(cosine / (cosine + found), cosine / (cosine + exact), rtol=promised, err_msg=said)


def test_beyond_one():
    """n.v of a vector normalised to rounding may be 1 + 2e-16: it is 1."""
    f = lambda c: 1 + jnp.arccos(c)  # noqa: E731
    assert through_table(f, np.array([1 + 2.3e-16])) == pytest.approx(1, abs=1e-12)


def test_stencil_is_cubic():
    """Exact for cubics in t, up to both ends of the table: 1024 intervals of values of size 1 round to 1e-12."""
    end = np.tan((np.pi / 2 - LIMIT) / 2)
    t = lambda c, xp: xp.arcsinh((c / (1 + xp.sqrt((1 - c) * (1 + c))) - end) / end)  # noqa: E731
    cubic = lambda c, xp=jnp: 1 + t(c, xp) - 2 * t(c, xp) ** 3  # noqa: E731
    cosine = np.cos(np.linspace(0, LIMIT, 777))
    np.testing.assert_allclose(through_table(cubic, cosine), cubic(cosine, np), atol=1e-11)
