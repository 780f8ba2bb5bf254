"""Sampled light against quadrature and closed forms. Deviations are counted in the noise that the samples say they have."""

import brdfit
import jax
import numpy as np
import pytest
from brdfit.scenes.illumination import illuminate
from brdfit.scenes.pixels import view
from brdfit.scenes.rendering import render
from brdfit.scenes.sampling import draw_cosine, draw_lobe, draw_sky, lobe_density, sky_pixel
from brdfit.scenes.scene import Ambient, Area, Camera, Environment, Plane, Point, Scene, Sphere

SMALL = Camera(pixels=(32, 32))
WARD = brdfit.model("ward", diffuse=[0.2, 0.1, 0.05], specular=0.2, alpha=0.25)
GGX = brdfit.model("gtr", diffuse=0.0, specular=[0.9, 0.6, 0.3], alpha=0.3, gamma=2.0)


def picture(model, *lights, shape=None, camera=SMALL, **options):
    scene = Scene("test", shape or Sphere(), camera, lights)
    return render(model, illuminate(scene, view(scene), isotropic=not model.anisotropic), **options)


def deviation(sampled, exact):
    """RMS deviation over the picture in units of its RMS noise: 1 to the luck of a thousand pixels.

    Over the picture, because four batches do not know the noise of one pixel well.
    """
    return np.sqrt(((sampled.values - exact) ** 2).mean() / (sampled.noise**2).mean())


def off(sampled, exact):
    """Deviation of the mean of the picture, in its noise: pixels are independent."""
    noise = np.sqrt((sampled.noise**2).mean() / len(sampled.noise))
    return abs((sampled.values - exact).mean()) / noise


def test_white_furnace_by_sampling():
    """An even image over a sphere of albedo 1: every pixel has radiance 1, though no sample knows of it."""
    got = picture(brdfit.model("lambert", diffuse=1.0), Environment(np.ones((4, 8, 3))), samples=16)
    assert deviation(got, 1.0) < 1.3
    assert off(got, 1.0) < 4


def test_sampling_against_quadrature():
    """The same even light, once as an image that is sampled, once as ambient light that is integrated."""
    got = picture(WARD, Environment(np.ones((4, 8, 3))), samples=64, alpha=0.25, dtype="float64")
    exact = picture(WARD, Ambient((1.0,) * 3), dtype="float64").values
    assert deviation(got, exact) < 1.3
    assert off(got, exact) < 4
    assert got.noise.mean() / exact.mean() < 0.03


def test_anisotropic_models_sample_ambient_light():
    """A brushed surface whose two widths are equal is an ordinary one."""
    brushed = brdfit.model("ward", diffuse=[0.2, 0.1, 0.05], specular=0.2, alpha_x=0.25, alpha_y=0.25)
    got = picture(brushed, Ambient((1.0,) * 3), samples=64, alpha=0.25)
    exact = picture(WARD, Ambient((1.0,) * 3)).values
    assert deviation(got, exact) < 1.3


@pytest.mark.parametrize("radius", [0.02, 0.3])
def test_luminous_sphere(radius):
    """On a white plane: irradiance is pi L sin^2(angle) cos_i for a sphere above the horizon (Lambert), at any size."""
    lamp = Area((0.3, 0.2, 1.5), radius, (2.0 / radius**2,) * 3)
    plane = Plane(size=(2.0, 2.0))
    got = picture(brdfit.model("lambert", diffuse=1.0), lamp, shape=plane, samples=64)
    exact = picture(
        brdfit.model("lambert", diffuse=1.0), Point(lamp.centre, (np.pi * 2.0,) * 3), shape=plane, dtype="float64"
    ).values  # pi L r^2 is the intensity of the sphere
    assert deviation(got, exact) < 1.3
    assert off(got, exact) < 4


def test_the_mean_does_not_depend_on_the_drawn_lobe():
    rng = np.random.default_rng(5)
    sky = Environment(rng.random((6, 12, 3)) ** 6)
    one, other = (picture(WARD, sky, samples=64, alpha=a) for a in (0.25, 0.7))
    assert deviation(one, other.values) < 1.3 * np.sqrt(1 + (other.noise**2).mean() / (one.noise**2).mean())


def test_pictures_share_their_directions():
    """Twice the reflectance is exactly twice the picture: noise does not count as difference."""
    sky = Environment(np.random.default_rng(6).random((4, 8, 3)))
    one, two = (picture(brdfit.model("lambert", diffuse=d), sky, samples=4, dtype="float64").values for d in (0.3, 0.6))
    np.testing.assert_allclose(two, 2 * one, rtol=1e-12)


def test_densities_integrate_to_one():
    """Share of drawn half-vector directions above the horizon = integral of the density there, for a slanted viewer."""
    rng = np.random.default_rng(7)
    with jax.enable_x64(True):
        u = rng.random((2, 200_000))
        alpha = np.float64(0.4)
        wo = np.broadcast_to([np.sin(1.2), 0.0, np.cos(1.2)], (u.shape[1], 3))
        drawn = np.asarray(draw_lobe(wo, alpha, u))
        even = np.asarray(draw_cosine(u))
        np.testing.assert_allclose(np.linalg.norm(drawn, axis=1), 1, atol=1e-12)
        density = np.asarray(lobe_density(even, wo, alpha, even[:, 2] > 0)) * np.pi / even[:, 2]
    error = density.std() / np.sqrt(len(density)) + 0.5 / np.sqrt(len(density))
    assert abs((drawn[:, 2] > 0).mean() - density.mean()) < 4 * error


def test_black_rows():
    """Directions of an image are drawn in proportion to its light, never from where it is black."""
    image = np.random.default_rng(8).random((5, 7, 3))
    image[[0, 3]] = 0
    image[1, 2] = 0
    scene = Scene("", Plane(), Camera(pixels=(1, 1)), (Environment(image),))
    sky = illuminate(scene, view(scene)).extended.sky
    n = 40_000
    with jax.enable_x64(True):
        sky = jax.tree.map(np.asarray, sky)
        many = type(sky)(sky.radiance, sky.density, sky.rows, sky.columns, np.broadcast_to(sky.frame, (n, 3, 3)))
        drawn = np.asarray(draw_sky(many, np.random.default_rng(9).random((2, n))))
        row, column = (np.asarray(a) for a in sky_pixel(many, drawn))
    count = np.zeros((5, 7))
    np.add.at(count, (row, column), 1)
    edges = np.cos(np.linspace(0, np.pi, 6))
    share = image.mean(-1) * (edges[:-1] - edges[1:])[:, None]
    expected = n * share / share.sum()
    assert count[expected == 0].sum() == 0
    z = (count - expected)[expected > 0] / np.sqrt(expected[expected > 0])
    assert np.abs(z).max() < 4.5
    solid_angle = (edges[:-1] - edges[1:])[:, None] * 2 * np.pi / 7
    np.testing.assert_allclose((sky.density * solid_angle).sum(), 1)


def test_below_the_horizon():
    """A light wholly behind the surface: nothing arrives, and nothing is NaN."""
    behind = Area((0.0, 0.0, -3.0), 0.5, (1.0,) * 3)
    got = picture(WARD, behind, shape=Plane(), samples=4)
    assert (got.values == 0).all()
    assert (got.noise == 0).all()
