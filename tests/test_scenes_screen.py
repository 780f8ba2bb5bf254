"""Fits of many sets of effects by one program, against the models that these sets are."""

from types import SimpleNamespace

import brdfit
import jax
import numpy as np
import pytest
from brdfit.fitting.starts import summarise
from brdfit.models import parameter_values, parameters_of
from brdfit.models.effects import EFFECTS, in_order
from brdfit.scenes.appearance import look
from brdfit.scenes.fitted_pixels import shown
from brdfit.scenes.linear import factor
from brdfit.scenes.scene import Ambient, Area, Camera, Directional, Plane, Scene, Sphere
from brdfit.scenes.screen import Fitted, Screen, alone, own

from .cases import WI, WO
from .test_effects import truth_of

AMONG = [n for n in EFFECTS if n not in ("anisotropy", "interreflection")]
SETS = (
    "body",
    "diffraction+fresnel",
    "body+rough_body+retro",
    "body+lobe+trade_off",
    "body+lobe+second_lobe+masking",
    "body+lobe+fresnel+masking+trade_off",
    "lobe+tail+dispersion+second_lobe+diffraction+fresnel",
)


def test_a_set_is_the_whole_model_with_the_rest_left_out():
    """To the rounding of GTR against GGX and of the sums."""
    screen = Screen(AMONG, SimpleNamespace(arriving=np.zeros((1, 3))), None)
    whole = jax.jit(lambda m: m(WI, WO))
    for name in SETS:
        names = in_order(name.split("+"))
        values = {k: np.asarray(v, float) for k, v in truth_of("+".join(names)).items()}
        fitted = screen.extended(names, Fitted(names, screen._whole(names, values), 0.0))
        model = own(fitted)
        assert model.effects == names
        with jax.enable_x64(True):
            np.testing.assert_allclose(whole(screen.model(fitted)), model(WI, WO), rtol=1e-9, atol=1e-300, err_msg=name)


@pytest.fixture(scope="module")
def scene(small_table):
    """A screen of four effects, two lights, a small table; and what it is made of."""
    lights = (Directional((0.3, 0.4, 1.0), (3.0,) * 3), Ambient((0.7,) * 3))
    here = look(small_table[0], Scene("", Sphere(), Camera(pixels=(24, 24)), lights))
    data, summary = shown(here), summarise(here.table, here.table.mask)
    return Screen(("body", "lobe", "second_lobe", "masking"), data, summary), data, summary


def test_slopes(scene):
    """Cost and gradient from the factor: the sum of squared residuals of the model itself, and its differences."""
    screen, data, _ = scene
    names = ("body", "lobe", "second_lobe", "masking")
    values = {
        "diffuse": [0.2, 0.1, 0.3],
        "specular": [0.1, 0.2, 0.3],
        "alpha": 0.2,
        "share": [0.2, 0.4, 0.6],
        "alpha_2": 0.5,
    }
    x = screen._vector(screen._whole(names, {k: np.asarray(v) for k, v in values.items()}))

    def cost(x):
        return screen.linear(x)[-1, -1]

    with jax.enable_x64(True):
        model = brdfit.model("+".join(names), **values)
        f = np.stack([np.asarray(type(model)(**one).evaluate(data.geometry)) for one in channels_of(model)], -1)
        assert cost(x) == pytest.approx(float((np.asarray(data.residual(data.values(f))) ** 2).sum()), rel=1e-9)
    slopes, step = 2 * screen.linear(x)[-1, :-1], 1e-5
    for k in range(len(slopes)):
        moved = np.eye(len(x))[k] * step
        assert (cost(x + moved) - cost(x - moved)) / (2 * step) == pytest.approx(slopes[k], rel=1e-5, abs=1e-6)


def test_no_direction_below_the_horizon(small_table):
    """Of lights behind the surface, of samples that missed the hemisphere, of nodes of an albedo."""
    lights = (Directional((1.0, 0.0, -0.5), (3.0,) * 3), Area((2.0, 0.0, 0.0), 0.5, (9.0,) * 3), Ambient((0.7,) * 3))
    data = shown(look(small_table[0], Scene("", Sphere(), Camera(pixels=(12, 12)), lights)))
    assert (np.asarray(data.geometry.cos_i) > 0).all()
    assert (data.arriving == 0).all(1).any()  # some were below
    assert np.isfinite(data.target).all()


def test_one_angle(small_table):
    """A plane far away: one polar angle for all pixels, whose albedo is that of the angle."""
    scene = Scene("", Plane(normal=(0.0, 0.0, 1.0)), Camera(pixels=(8, 8)), (Ambient((0.7,) * 3),))
    data = shown(look(small_table[0], scene))
    np.testing.assert_allclose(data.ambient.spread.sum(1), 1)


def test_factors():
    """Of products of columns of which two are alike and one is 0, with a rounding that makes them no squares."""
    columns = np.random.default_rng(0).normal(size=(30, 5)) * [1, 1e-6, 1e6, 0, 1]
    columns[:, 4] = columns[:, 0]
    products = columns.T @ columns
    products[0, 4] = products[4, 0] = products[0, 0] * (1 + 1e-9)
    size = np.linalg.norm(columns, axis=0)
    got = factor(products)
    assert (np.abs(got.T @ got - products) <= 1e-8 * np.outer(size, size) + 1e-290).all()


def channels_of(model):
    """The model of each channel."""
    specs = parameters_of(model)
    given = parameter_values(model)
    return [{p.name: given[p.name][k] if p.per_channel else given[p.name] for p in specs} for k in range(3)]


def test_more_effects_are_no_worse(scene):
    """A fit that starts where one of fewer effects ended: the error cannot rise, for effects that leave a way back."""
    screen, data, summary = scene
    body = screen.fit(["body"])
    lobe = screen.fit(["body", "lobe"], [body])
    both = screen.fit(["body", "lobe", "second_lobe"], [lobe])
    assert body.error > lobe.error >= both.error
    same = screen.extended(["body", "lobe", "second_lobe"], lobe)
    with jax.enable_x64(True):
        np.testing.assert_allclose(own(same)(WI, WO), own(lobe)(WI, WO), rtol=1e-13)
    again = alone(lobe, data, summary)  # by the program of these two effects
    assert again.error == pytest.approx(lobe.error, rel=1e-3)
    assert set(parameter_values(own(again))) == {"diffuse", "specular", "alpha"}
