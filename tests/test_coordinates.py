"""Coordinates of a fit: the way there and back, and boxes that stay where the formula is defined."""

from __future__ import annotations

from itertools import product

import brdfit
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit.data.synthetic import RANGES
from brdfit.fitting.coordinates import charts
from brdfit.models import MODELS, parameters_of
from brdfit.models.gtr import GTR
from brdfit.models.sgd import SGD

FORMS = [cls for name in (*RANGES, "htsg", "stam_diffraction") for cls in MODELS[name]]
"""The models that have charts of their own, and Ward for all those that have the plain one."""
CASES = [(cls, plain, k) for cls in FORMS for plain in (False, True) for k in range(len(charts(cls, plain)))]
charted = pytest.mark.parametrize(
    ("cls", "plain", "k"), CASES, ids=[f"{c.__name__}-{'plain' if p else 'chart'}-{k}" for c, p, k in CASES]
)


def draw(cls, rng, channels):
    """Parameters over the search box, uniform or uniform in the logarithm; infinite ends at 10."""
    values = {}
    for p in parameters_of(cls):
        lower, upper = (np.clip(b, -10, 1e300 if p.log else 10) for b in p.search)
        u = rng.random((channels,) if p.per_channel else ())
        values[p.name] = np.exp(np.log(lower) + u * np.log(upper / lower)) if p.log else lower + u * (upper - lower)
    return values


@charted
def test_there_and_back(cls, plain, k):
    rng = np.random.default_rng(0)
    chart = charts(cls, plain)[k]
    with jax.enable_x64(True):
        for _ in range(30):
            values = draw(cls, rng, 2)
            if len(charts(cls, plain)) > 1:  # the charts of GTR end at alpha = 1, from either side
                values["alpha"] = np.minimum(values["alpha"], 0.99) if k == 0 else np.maximum(values["alpha"], 1.01)
            x = chart.raw_coordinates(values, 2)
            own, shared = chart.split(jnp.asarray(x), 2)
            for c in range(2):
                back = chart.parameters(own[c], shared)
                for name, v in values.items():
                    want = v if np.ndim(v) == 0 else v[c]
                    # logarithms of up to 40 magnify 1e-16 by as much; alpha by its distance from 1, a hundred times
                    assert float(back[name]) == pytest.approx(float(want), rel=1e-12), name
            again = chart.raw_coordinates({n: np.asarray(v) for n, v in values.items()}, 2)
            np.testing.assert_array_equal(again, x)


@charted
def test_the_box_is_within_the_formula(cls, plain, k):
    """At every corner of the box each parameter is where the formula is defined, or infinite for being on a ridge's end."""
    chart = charts(cls, plain)[k]
    lower, upper = chart.box(1)
    assert (lower < upper).all()
    with jax.enable_x64(True):
        ends = [(max(a, -1e6), min(b, 1e6)) for a, b in zip(lower, upper, strict=True)]
        for corner in product(*ends):
            own, shared = chart.split(jnp.asarray(corner), 1)
            for p in parameters_of(cls):
                value = float(chart.parameters(own[0], shared)[p.name])
                assert value in p.valid, (corner, p.name, value)


@charted
def test_starts_outside_are_moved_in(cls, plain, k):
    chart = charts(cls, plain)[k]
    with jax.enable_x64(True):
        for factor in (1e-30, 1e30):
            values = {p.name: np.full(1 if p.per_channel else (), p.default * factor) for p in parameters_of(cls)}
            x = chart.coordinates_of(values, 1)
        lower, upper = chart.box(1)
        assert np.isfinite(x).all()
        assert ((x >= lower) & (x <= upper)).all()


def test_bounds_replace_the_box():
    chart = charts(GTR, plain=True)
    assert len(chart) == 1
    lower, upper = chart[0].box(2, {"alpha": (0.1, 0.3), "diffuse": (0.0, 0.5)})
    order = [c.name for c, _ in chart[0].vector(2)]
    for name, want in (("alpha", np.log([0.1, 0.3])), ("diffuse", [0, 0.5]), ("gamma", np.log([0.01, 1e7]))):
        at = [i for i, n in enumerate(order) if n == name]
        np.testing.assert_allclose(lower[at], want[0])
        np.testing.assert_allclose(upper[at], want[1])


def test_order_of_a_vector():
    """Each channel's own coordinates, channel by channel, then the shared ones; split undoes it."""
    chart = charts(GTR)[0]
    assert [(c.name, k) for c, k in chart.vector(2)] == [
        *(("diffuse", 0), ("specular", 0), ("diffuse", 1), ("specular", 1)),
        *(("alpha", None), ("gamma", None)),
    ]
    own, shared = chart.split(jnp.arange(6.0), 2)
    np.testing.assert_array_equal(own, [[0, 1], [2, 3]])
    np.testing.assert_array_equal(shared, [4, 5])


def test_the_gaussian_limit_is_straight():
    """As gamma -> infinity only K = gamma |ln alpha^2| is determined: it is constant along a straight line of the chart."""
    chart = charts(GTR)[0]
    with jax.enable_x64(True):
        k = 8.0
        points = []
        for gamma in (1e3, 1e4, 1e5):
            values = {"diffuse": np.ones(1), "specular": np.ones(1), "alpha": np.asarray(np.exp(-k / gamma / 2))}
            x = chart.raw_coordinates({**values, "gamma": np.asarray(gamma)}, 1)
            points.append(x[-2:])
        first, second = np.diff(points, axis=0)
    np.testing.assert_allclose(first, second, atol=1e-9)


def test_sgd_keeps_the_product():
    """specular -> 0 with specular f0 finite is a point of the chart."""
    chart = charts(SGD)[0]
    names = [c.name for c in chart.channel]
    with jax.enable_x64(True):
        x = jnp.asarray([{"specular": 1e-12, "f0": 0.3, "alpha": -2.0, "p": 0.5}.get(n, 0.1) for n in names])
        back = chart.parameters(x, jnp.zeros(0))
    assert float(back["f0"] * back["specular"]) == pytest.approx(0.3, rel=1e-15)


def test_one_formula_is_fitted_one_way():
    """Put together of blocks it starts where the named model does, in the same coordinates."""
    blocks = brdfit.microfacet("gtr", "smith", "schlick", "lambert")
    assert blocks.shapes(0.1) == GTR.shapes(0.1)
    values = {p.name: np.asarray(0.3) for p in parameters_of(GTR)}
    for mine, named in zip(charts(blocks), charts(GTR), strict=True):
        assert [c.name for c in mine.coordinates] == [c.name for c in named.coordinates]
        with jax.enable_x64(True):
            np.testing.assert_array_equal(mine.coordinates_of(values, 2), named.coordinates_of(values, 2))
