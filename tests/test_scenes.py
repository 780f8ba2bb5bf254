"""Scenes against what can be known of them without rendering: geometry, closed forms, energy, and the files."""

import brdfit
import jax
import numpy as np
import pytest
from brdfit.angles import half_difference
from brdfit.reports.gather import interpolate
from brdfit.scenes.illumination import illuminate
from brdfit.scenes.interpolated import Measured, measured
from brdfit.scenes.interpolated import half_difference as traced_half_difference
from brdfit.scenes.pixels import view
from brdfit.scenes.rendering import cast, radiance, render
from brdfit.scenes.scene import (
    Ambient,
    Camera,
    Directional,
    Environment,
    Frustum,
    Plane,
    Point,
    Scene,
    Sphere,
    unit,
)
from brdfit.scenes.surface import frames, intersect

SMALL = Camera(pixels=(48, 48))
TILTED = Camera(eye=(1.0, 2.0, 6.0), pixels=(48, 40), width=None, field=35.0)
SHAPES = {
    "sphere": Sphere((0.1, 0.0, -0.2), 0.8),
    "plane": Plane((0.1, 0.0, 0.0), (0.2, 1.0, 1.0), (1.5, 1.0)),
    "cylinder": Frustum((0.0, 0.1, 0.0), (0.3, 1.0, 0.2), 1.4, 0.6, 0.6),
    "cone": Frustum((0.0, 0.0, 0.0), (0.3, 1.0, 0.2), 1.6, 0.9, 0.0),
}
LIGHT = Directional((0.3, 0.4, 1.0), (np.pi, 2.0, 1.0))
WARD = brdfit.model("ward", diffuse=[0.2, 0.1, 0.05], specular=0.1, alpha=0.2)
WHITE = brdfit.model("lambert", diffuse=1.0)


def lit(*lights, shape=SHAPES["sphere"], camera=SMALL, **options):
    scene = Scene("test", shape, camera, lights)
    seen = view(scene)
    return seen, illuminate(scene, seen, **options)


def inside(shape, x):
    """Whether points lie in a solid; its own definition, not the one that rays are cut with."""
    x = x - np.asarray(shape.centre)
    if isinstance(shape, Sphere):
        return (x**2).sum(-1) < shape.radius**2
    z = x @ unit(shape.axis)
    radius = shape.bottom + (shape.top - shape.bottom) * (z / shape.height + 0.5)
    return (np.abs(z) < shape.height / 2) & ((x**2).sum(-1) - z**2 < radius**2) & (radius > 0)


@pytest.mark.parametrize("name", ["sphere", "cylinder", "cone"])
def test_rays_end_at_the_surface(name):
    """By walking along rays: outside up to the point found, inside just behind it, and never inside where none is."""
    shape = SHAPES[name]
    rng = np.random.default_rng(1)
    origin = 4 * unit_rows(rng.normal(size=(400, 3)))
    ray = unit_rows(rng.uniform(-0.8, 0.8, (400, 3)) - origin)
    distance, normals = intersect(shape, origin, ray)
    steps = np.linspace(0, 8, 4001)
    walked = inside(shape, origin[:, None] + steps[:, None] * ray[:, None])
    first = np.where(walked.any(1), steps[walked.argmax(1)], np.inf)
    hit = np.isfinite(distance)
    assert hit.sum() > 150
    assert not walked[~hit].any()
    grazed = hit & ~walked.any(1)  # a ray may cross less than one step
    assert grazed.sum() < 5
    both = hit & ~grazed
    gap = first[both] - distance[both]
    assert gap.min() > -1e-9
    assert gap.max() <= steps[1] + 1e-9
    at = origin[hit] + distance[hit, None] * ray[hit]
    assert not inside(shape, at + 1e-6 * normals[hit]).any()
    assert inside(shape, at - 1e-6 * normals[hit]).mean() > 0.99  # but for points at an edge
    np.testing.assert_allclose(np.linalg.norm(normals[hit], axis=1), 1, atol=1e-12)
    assert ((normals[hit] * ray[hit]).sum(1) < 0).all()


def unit_rows(v):
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def test_plane_is_a_rectangle_seen_from_its_front():
    plane = SHAPES["plane"]
    n = unit(plane.normal)
    t, b, _ = frames(plane, n[None])[0]
    corner = np.asarray(plane.centre) + 0.74 * t + 0.49 * b
    for end, found in ((corner, True), (corner + 0.02 * t, False), (corner + 0.02 * b, False)):
        for side in (1.0, -1.0):
            origin = end + side * 3 * n + 0.5 * t
            ray = unit(end - origin)
            distance, _ = intersect(plane, origin[None], ray[None])
            assert np.isfinite(distance[0]) == (found and side > 0)


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES.keys())
def test_frames(shape):
    """Right-handed and orthonormal, at poles too."""
    n = np.concatenate([unit_rows(np.random.default_rng(2).normal(size=(50, 3))), np.eye(3), -np.eye(3)])
    f = frames(shape, n)
    np.testing.assert_allclose(np.einsum("pij,pkj->pik", f, f), np.broadcast_to(np.eye(3), f.shape), atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(f), 1, atol=1e-9)


def test_perspective_goes_over_into_parallel_rays():
    far = Camera(eye=(0.0, 0.0, 1e6), pixels=(48, 48), width=None, field=float(np.degrees(2 * np.arctan(1.1 / 1e6))))
    a, b = (view(Scene("", Sphere(), c, (LIGHT,))) for c in (far, SMALL))
    assert (a.object == b.object).all()
    np.testing.assert_allclose(a.wo, b.wo, atol=1e-4)


def test_punctual_lights_are_the_closed_form():
    """L = f E cos_i (Hoffman 2013, eq. 13) with world vectors, for two lights and a perspective camera."""
    lamp = Point((2.0, 1.0, 3.0), (5.0, 4.0, 3.0))
    seen, light = lit(LIGHT, lamp, camera=TILTED)
    got = render(WARD, light, dtype="float64")
    assert got.noise is None
    n = seen.frame[:, 2]
    expected = np.zeros((len(n), 3))
    with jax.enable_x64(True):
        to_lamp = np.asarray(lamp.position) - seen.position
        distance = np.linalg.norm(to_lamp, axis=1, keepdims=True)
        for w, irradiance in (
            (np.broadcast_to(unit(LIGHT.direction), n.shape), np.asarray(LIGHT.irradiance)),
            (to_lamp / distance, np.asarray(lamp.intensity) / distance**2),
        ):
            f = np.asarray(WARD(np.einsum("pij,pj->pi", seen.frame, w), seen.wo))
            expected += f * irradiance * np.maximum((n * w).sum(1), 0)[:, None]
    np.testing.assert_allclose(got.values, expected, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(seen.wo, axis=1), 1, rtol=1e-12)


def test_lambert_facing_its_light_has_its_albedo():
    """c_light of eq. 13 is the radiance of a white surface that faces the light: E = pi makes it 1, at every pixel."""
    _, light = lit(Directional((0, 1, 1), (np.pi,) * 3), shape=Plane(normal=(0, 1, 1)), camera=TILTED)
    np.testing.assert_allclose(render(WHITE, light, dtype="float64").values, 1, rtol=1e-14)


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES.keys())
def test_lambert_under_ambient_light(shape):
    """White furnace: a surface of albedo rho under radiance 1 has radiance rho, whatever its shape."""
    _, light = lit(Ambient((1.0, 0.5, 0.25)), shape=shape, camera=TILTED)
    got = render(brdfit.model("lambert", diffuse=0.7), light, dtype="float64").values
    np.testing.assert_allclose(got, np.broadcast_to([0.7, 0.35, 0.175], got.shape), rtol=1e-6)  # the quadrature's error


def test_energy():
    """A furnace of radiance 1: no pixel of a lossless surface is brighter, and single scattering loses some."""
    _, light = lit(Ambient((1.0,) * 3))
    lossless = brdfit.model("gtr", diffuse=0.0, specular=1.0, alpha=0.3, gamma=2.0)
    got = render(brdfit.ready(lossless), light, dtype="float64").values
    assert got.max() < 1


def test_program_of_a_punctual_scene_is_the_formula_by_hand():
    _, light = lit(LIGHT)
    light, model = cast((light, WARD), "float32")
    p = light.punctual[0]
    by_hand = jax.make_jaxpr(lambda m, wi, wo, e: (m(wi, wo) * e)[None])(model, p.wi, light.wo, p.arriving)
    traced = jax.make_jaxpr(radiance)(model, light)
    # the same equations; only the order in which the arguments are named differs
    named = jax.make_jaxpr(lambda m, li: (m(li.punctual[0].wi, li.wo) * li.punctual[0].arriving)[None])(model, light)
    assert str(traced) == str(named)
    assert len(traced.eqns) == len(by_hand.eqns)
    for word in ("random", "while", "scan", "cond"):
        assert word not in str(traced)


def test_each_sort_of_light_leaves_only_its_own_terms():
    ambient = lit(Ambient((1.0,) * 3))[1]
    sky = lit(Environment(np.ones((4, 8, 3))))[1]
    text = {
        name: str(jax.make_jaxpr(lambda m, a, li, n=rounds: radiance(m, li, a, n))(*cast((WARD, 0.2, light), "float32")))
        for name, light, rounds in (("ambient", ambient, 0), ("sky", sky, 1))
    }
    assert "random" not in text["ambient"]
    assert "random" in text["sky"]
    assert ambient.extended is None
    assert sky.everywhere is None
    assert not sky.punctual


def test_a_ready_model_gives_the_same_picture():
    """Masking from a table errs by 5e-9 for each direction (brdfit.tabulated), also at pixels that graze."""
    model = brdfit.model("gtr", diffuse=0.1, specular=0.3, alpha=0.2, gamma=1.5)
    _, light = lit(LIGHT)
    exact = render(model, light, dtype="float64").values
    np.testing.assert_allclose(render(brdfit.ready(model), light, dtype="float64").values, exact, rtol=1e-8)
    np.testing.assert_allclose(render(brdfit.ready(model), light).values, exact, rtol=1e-5, atol=1e-7)


def test_opposite():
    """Half vectors as NumPy's own give them, and no NaN where light and viewer are opposite."""
    rng = np.random.default_rng(3)
    wi, wo = (unit_rows(np.abs(rng.normal(size=(200, 3))) * [1, 1, 1]) for _ in range(2))
    with jax.enable_x64(True):
        for got, expected in zip(traced_half_difference(wi, wo), half_difference(wi, wo)[:3], strict=True):
            np.testing.assert_allclose(got, expected, atol=1e-9)
        assert np.isfinite(np.asarray(traced_half_difference(wi, -wi))).all()


def test_measured_table_is_interpolated(small_table):
    """As the report's own interpolation where every neighbour is measured; a value everywhere else."""
    table, _ = small_table
    model, gaps = measured(table)
    assert isinstance(model, Measured)
    assert (gaps == ~table.mask).all()
    rng = np.random.default_rng(4)
    wi, wo = (unit_rows(rng.normal(size=(4000, 3)) * [1, 1, 1] + [0, 0, 1.0]) for _ in range(2))
    keep = (wi[:, 2] > 0.02) & (wo[:, 2] > 0.02)
    wi, wo = wi[keep], wo[keep]
    expected = interpolate(table, wi, wo)
    known = np.isfinite(expected).all(1)
    with jax.enable_x64(True):
        got = np.asarray(model(wi, wo))
    np.testing.assert_allclose(got[known], expected[known], rtol=1e-9)
    assert np.isfinite(got).all()
    assert (got >= 0).all()
    assert (got.max(0) <= table.planes.max((1, 2, 3))).all()
