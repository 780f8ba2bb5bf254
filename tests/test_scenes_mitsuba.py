"""Pictures against Mitsuba 3, an independent renderer: a rough GGX conductor, a sphere and a plane, three sorts of light.

Mitsuba samples the area of a pixel: ours is rendered with 8 x 8 rays for each of its pixels and averaged, and pixels that
are not wholly of the object are left out. Its own noise is measured over four renderings with other seeds.
"""

from typing import ClassVar

import brdfit
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit.models import ndf
from brdfit.models.fresnel import conductor
from brdfit.models.masking import smith_separable
from brdfit.models.microfacet import microfacet
from brdfit.scenes.illumination import illuminate
from brdfit.scenes.pixels import view
from brdfit.scenes.rendering import render
from brdfit.scenes.scene import Area, Camera, Directional, Environment, Plane, Scene, Sphere

mitsuba = pytest.importorskip("mitsuba", reason="compares with Mitsuba 3, which is not installed: pip install mitsuba")

ALPHA, INDEX, ABSORPTION = 0.3, (0.2, 0.9, 1.4), (3.9, 2.4, 1.6)
SHAPES = {"sphere": (Sphere(), 2.2), "plane": (Plane(normal=(0.0, 1.0, 1.0), size=(2.0, 2.0)), 3.0)}
LIGHTS = {
    "directional": Directional((0.5, 0.6, 1.0), (2.0, 1.5, 1.0)),
    "area": Area((1.5, 2.2, 2.5), 0.5, (4.0, 3.0, 2.0)),
    "environment": Environment(0.2 + np.random.default_rng(10).random((8, 16, 3)) ** 3),
}
PIXELS, FINER, SEEDS = 16, 8, 4


class Conductor(brdfit.BRDF):
    """F D G/(4 n.l n.v) with separable masking, which is Mitsuba's."""

    name: ClassVar[str] = "conductor"
    index: object = brdfit.parameter("index of refraction", per_channel=True)
    absorption: object = brdfit.parameter("extinction", per_channel=True)

    def evaluate(self, g):
        lobe = ndf.GGX(jnp.asarray(ALPHA, g.cos_i.dtype))
        return microfacet(lobe(g.sin2_h, g.cos2_h), conductor(self.index, self.absorption, g), smith_separable(lobe, g))


def mine(shape, light):
    """Mean and noise of each pixel, and which pixels are wholly of the object."""
    solid, width = SHAPES[shape]
    n = PIXELS * FINER
    scene = Scene("", solid, Camera(pixels=(n, n), width=width), (LIGHTS[light],))
    seen = view(scene)
    got = render(Conductor(np.array(INDEX), np.array(ABSORPTION)), illuminate(scene, seen), alpha=ALPHA, samples=16)

    def blocks(a):
        return a.reshape(PIXELS, FINER, PIXELS, FINER, -1).swapaxes(1, 2).reshape(PIXELS, PIXELS, FINER**2, -1)

    noise = np.zeros_like(got.values) if got.noise is None else got.noise
    whole = blocks(seen.object).all((2, 3))
    variance = blocks(seen.picture(noise**2)).mean(2) / FINER**2
    return blocks(seen.picture(got.values)).mean(2), np.sqrt(variance), whole


def theirs(shape, light):
    """Mean and noise of each pixel."""
    mi = mitsuba
    mi.set_variant("scalar_rgb")
    solid, width = SHAPES[shape]
    look = mi.ScalarTransform4f().look_at(origin=[0, 0, 5], target=[0, 0, 0], up=[0, 1, 0])
    rough = {"type": "roughconductor", "distribution": "ggx", "alpha": ALPHA}
    rough |= {"eta": {"type": "rgb", "value": list(INDEX)}, "k": {"type": "rgb", "value": list(ABSORPTION)}}
    if isinstance(solid, Sphere):
        body = {"type": "sphere", "bsdf": rough}
    else:
        turned = mi.ScalarTransform4f().look_at(origin=[0, 0, 0], target=list(solid.normal), up=[1, 0, 0])
        body = {"type": "rectangle", "to_world": turned, "bsdf": rough}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "hide_emitters": True},
            "sensor": {
                "type": "orthographic",
                "to_world": look @ mi.ScalarTransform4f().scale([width / 2, width / 2, 1]),
                "film": {"type": "hdrfilm", "width": PIXELS, "height": PIXELS, "rfilter": {"type": "box"}},
            },
            "body": body,
            "light": emitter(mi, LIGHTS[light]),
        }
    )
    samples = 64 if light == "directional" else 256
    pictures = np.array([np.array(mi.render(scene, spp=samples, seed=k))[..., :3] for k in range(SEEDS)], float)
    return pictures.mean(0), pictures.std(0, ddof=1) / np.sqrt(SEEDS)


def emitter(mi, light):
    if isinstance(light, Directional):
        away = [-x for x in light.direction]
        return {"type": "directional", "direction": away, "irradiance": {"type": "rgb", "value": list(light.irradiance)}}
    if isinstance(light, Area):
        glow = {"type": "area", "radiance": {"type": "rgb", "value": list(light.radiance)}}
        return {"type": "sphere", "center": list(light.centre), "radius": light.radius, "emitter": glow}
    # Mitsuba interpolates between pixels: many for each of ours, so that it hardly does
    fine = np.kron(light.image, np.ones((32, 32, 1))).astype(np.float32)
    return {"type": "envmap", "bitmap": mi.Bitmap(fine)}


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("shape", SHAPES)
def test_against_mitsuba(shape, light):
    ours, noise, whole = mine(shape, light)
    other, their_noise = theirs(shape, light)
    assert whole.sum() >= 60
    a, b = ours[whole], other[whole]
    # 0.3 %: what 8 x 8 midpoints leave of the curvature of the picture within a pixel
    sigma = np.sqrt(noise[whole] ** 2 + their_noise[whole] ** 2 + (0.003 * b.mean()) ** 2)
    z = (a - b) / sigma
    assert np.sqrt((z**2).mean()) < 2, (np.sqrt((z**2).mean()), (a / b).mean())
    assert abs((a - b).mean()) < 0.004 * b.mean()
