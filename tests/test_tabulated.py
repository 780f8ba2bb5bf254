"""Models whose masking is read from a table: the same values and slopes as the models themselves."""

import brdfit
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit.angles import unit_vectors
from brdfit.tabulated import Ready

LOBES = {
    "gtr": [{"specular": 0.3, "alpha": a, "gamma": c} for a, c in ((1e-3, 2.0), (1e-2, 1.5), (0.2, 1.5), (0.6, 0.6))],
    "sgd": [{"specular": 0.3, "alpha": a, "p": p, "f0": 0.9, "f1": 0.1} for a, p in ((1e-4, 0.2), (0.05, 0.6))],
}
CASES = [brdfit.model(name, diffuse=0.1, **shape) for name, shapes in LOBES.items() for shape in shapes]
GTR = CASES[2]


def pairs(count=500):
    """Directions up to 89.999 degrees, half of them close to the horizon and every other one near the mirror direction."""
    rng = np.random.default_rng(1)
    x = np.radians(np.where(rng.random((2, count)) < 0.5, 90 * rng.random((2, count)), 10 ** rng.uniform(-3, 1, (2, count))))
    x[1, ::2] = x[0, ::2]
    phi = np.where(np.arange(count) % 2 == 0, np.pi + 1e-3 * rng.normal(size=count), 2 * np.pi * rng.random(count))
    return unit_vectors(np.pi / 2 - x[0], 0.0), unit_vectors(np.pi / 2 - x[1], phi)


@pytest.mark.parametrize("model", CASES, ids=lambda m: f"{m.name} {float(np.ravel(m.alpha)[0]):g}")
def test_same_values(model):
    fast = brdfit.ready(model)
    assert isinstance(fast, Ready)
    wi, wo = pairs()
    with jax.enable_x64(True):
        call = jax.jit(lambda m, *w: m(*w))
        exact = np.asarray(call(model, wi, wo))
        # 5e-9 for each of two directions
        np.testing.assert_allclose(np.asarray(call(fast, wi, wo)), exact, rtol=1e-8)
    # positions on a table of 4096 intervals round to 1e-6 of a distance to the horizon
    single = [jnp.asarray(w, jnp.float32) for w in (wi, wo)]
    own = np.asarray(call(model, *single))
    np.testing.assert_allclose(np.asarray(call(fast, *single)), own, rtol=4e-6)


def test_models_without_an_integral_are_ready():
    ward = brdfit.model("ward", diffuse=0.1, specular=0.2, alpha=0.3)
    assert brdfit.ready(ward) is ward
    cylinders = brdfit.model("poulin_fournier", diffuse=0.1, specular=0.2, exponent=9.0, spacing=3.0, elevation=0.0)
    assert brdfit.ready(cylinders) is cylinders, "it asks for the directions themselves"


def test_normal_incidence():
    """A unit vector in float32 may be longer than 1, and the slope of an arccosine at 1 is infinite."""
    fast = brdfit.ready(GTR)
    longer = jnp.asarray([0, 0, 1 + 2.4e-7], jnp.float32)
    np.testing.assert_allclose(fast(longer, longer), GTR(longer, longer), rtol=4e-6)
    assert np.isfinite(jax.grad(lambda w: fast(w, longer)[0])(longer)).all()


def test_slopes():
    """Along the sphere of directions: what a formula does off it is its own affair."""
    wo = unit_vectors(0.4, 0.3)
    for theta in (1e-3, 0.3, 1.2, 1.5):
        wi = unit_vectors(theta, 2.0)
        with jax.enable_x64(True):
            found, own = (
                np.asarray(jax.grad(lambda w, m=m: m(w, wo)[0])(jnp.asarray(wi))) for m in (brdfit.ready(GTR), GTR)
            )
        # slopes of the table are those of a cubic: its error of 5e-9 over a step of 4e-3
        difference = found - own
        np.testing.assert_allclose(difference - wi * (difference @ wi), 0, atol=1e-6 * np.linalg.norm(own))


def test_below_the_horizon():
    """0, and so are all derivatives, where light or viewer lie on the horizon, below it, or opposite each other."""
    fast = brdfit.ready(GTR)
    up, down, side = np.array([[0.6, 0, 0.8], [0.6, 0, -0.8], [1.0, 0, 0]])
    pairs = [(up, down), (down, up), (down, down), (up, side), (side, up), (side, -side), (up, -up)]
    wi, wo = np.array(pairs).swapaxes(0, 1)
    with jax.enable_x64(True):
        value, slopes = jax.value_and_grad(lambda a, b: fast(a, b).sum(), (0, 1))(jnp.asarray(wi), jnp.asarray(wo))
    np.testing.assert_array_equal(value, 0)
    np.testing.assert_array_equal(slopes, 0)
