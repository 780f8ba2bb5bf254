"""Functions of a polar angle through a table of it."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit.models import masking, ndf
from brdfit.polar import PolarStencil

LIMIT = float(np.radians(80))


def through_table(f, cosine):
    with jax.enable_x64(True):
        stencil = PolarStencil.of(cosine, LIMIT)
        return np.asarray(stencil.interpolate(stencil.tabulate(f)))


@pytest.mark.parametrize(
    ("lobe", "parameters"),
    [(ndf.GTR, (0.1, 2.0)), (ndf.GTR, (1e-7, 1.05)), (ndf.GTR, (0.3, 0.5)), (ndf.SGD, (0.05, 0.6)), (ndf.SGD, (0.85, 0.0))],
)
def test_smith_through_the_table(lobe: type, parameters: tuple[float, float]):
    """3e-9 is what 64 Chebyshev nodes give for the lobes in use, and the cubic stencil 1e-10."""
    cosine = np.cos(np.linspace(0, LIMIT, 4001))
    with jax.enable_x64(True):
        f = lambda c: masking.averted_area(lobe(*map(jnp.asarray, parameters)), c)  # noqa: E731
        exact = np.asarray(f(jnp.asarray(cosine)))
    np.testing.assert_allclose(cosine / (cosine + through_table(f, cosine)), cosine / (cosine + exact), rtol=3e-9)


def test_beyond_one():
    """n.v of a vector normalised to rounding may be 1 + 2e-16: it is 1."""
    f = lambda c: 1 + jnp.arccos(c)  # noqa: E731
    assert through_table(f, np.array([1 + 2.3e-16])) == pytest.approx(1, abs=1e-12)


def test_stencil_is_cubic():
    """Exact for cubics, up to both ends of the table: 1024 intervals of values of size 1 round to 1e-12."""
    theta = np.linspace(0, LIMIT, 777)
    cubic = lambda c: 1 + jnp.arccos(c) - 2 * jnp.arccos(c) ** 3  # noqa: E731
    np.testing.assert_allclose(through_table(cubic, np.cos(theta)), 1 + theta - 2 * theta**3, atol=1e-12)
