"""Effects: each term against its paper, absent where not asked for, stable at the corners, recovered by fits."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from functools import cache
from itertools import combinations
from typing import Any

import brdfit
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit.angles import unit_vectors
from brdfit.data.synthetic.layouts import grid as grid_of
from brdfit.fitting.result import from_record
from brdfit.geometry import from_directions
from brdfit.models import EFFECTS, build, ndf, parameters_of, variants
from brdfit.models.effects import effect, in_order, parts_of
from brdfit.models.gtr import GTR
from brdfit.models.interreflection import compensation
from brdfit.physics import hemisphere
from brdfit.references import REFERENCES
from brdfit.scenes.choose import without

from .cases import WI, WO
from .effect_cases import TERMS, drawn, wanted
from .report_cases import table_of

Reals = np.ndarray

TRUTH: dict[str, Any] = {
    "diffuse": [0.2, 0.1, 0.05],
    "sigma": 0.5,
    "specular": [0.5, 0.3, 0.1],
    "alpha": 0.15,
    "alpha_x": 0.1,
    "alpha_y": 0.3,
    "gamma": 1.6,
    "share": [0.1, 0.25, 0.4],
    "alpha_2": 0.5,
    "retro": [0.02, 0.03, 0.04],
    "alpha_retro": 0.2,
    "scatter": [0.5, 0.4, 0.3],
    "b": 60.0,
    "c": 1.4,
}
DISPERSED = {"alpha": [0.1, 0.15, 0.2], "gamma": [1.6, 1.8, 2.1]}


def truth_of(name: str) -> dict[str, Any]:
    (cls,) = variants(name)
    return {
        p.name: DISPERSED[p.name] if p.per_channel and p.name in DISPERSED else TRUTH[p.name] for p in parameters_of(cls)
    }


# Values ---------------------------------------------------------------------------------------------------------------


def stacked(name: str, cases: tuple[dict[str, float], ...], dtype: type = np.float64) -> Any:
    """All cases as one instance with a leading axis, one channel each."""
    (cls,) = variants(name)
    columns = {p.name: np.array([c[p.name] for c in cases], dtype) for p in parameters_of(cls)}
    return cls(**{p.name: columns[p.name][:, None] if p.per_channel else columns[p.name] for p in parameters_of(cls)})


_first = jax.jit(jax.vmap(lambda m, a, b: m(a, b)[..., 0], (0, None, None)))
"""Compiled once for each model and precision: all tests ask for as many directions."""


def values(name: str, wi: Reals, wo: Reals, dtype: type = np.float64) -> Reals:
    """``[cases, directions]``."""
    with jax.enable_x64(dtype is np.float64):
        out = np.asarray(_first(stacked(name, drawn(name), dtype), wi.astype(dtype), wo.astype(dtype)))
        assert out.dtype == dtype
        return out.astype(float)


@pytest.mark.parametrize("name", TERMS)
def test_terms(name: str):
    """1e-11 of the value: half of the digits of a product of exponentials to the 1e3; 1e-9 of it where two vectors that
    graze the surface differ (float64 holds their difference to 1e-16/1e-8).
    """
    got, want = values(name, WI, WO), wanted(name)
    assert got.size >= 500
    error = np.abs(got - want) / (np.abs(want) + 1e-280)
    worst = np.unravel_index(np.argmax(error), error.shape)
    assert error.max() <= 1e-9, (error.max(), drawn(name)[worst[0]], WI[worst[1]], WO[worst[1]], want[worst])


# Absence --------------------------------------------------------------------------------------------------------------


def program(evaluate: Callable[[Any, Any], Any], m: Any, g: Any) -> str:
    return str(jax.make_jaxpr(evaluate)(m, g))


def by_hand(name: str) -> Callable[[Any, Any], Any]:
    """The formula of some compositions, written out."""

    def body(m: Any, g: Any) -> Any:
        return m.diffuse / jnp.pi

    def lobe(m: Any, g: Any) -> Any:
        cos2 = g.cos_h * g.cos_h
        d = (m.alpha / (g.sin2_h + m.alpha**2 * cos2)) ** 2 / jnp.pi
        return m.specular * (d * 0.25)

    def rising(m: Any, g: Any) -> Any:
        cos2 = g.cos_h * g.cos_h
        d = (m.alpha / (g.sin2_h + m.alpha**2 * cos2)) ** 2 / jnp.pi
        f = m.specular + (1 - m.specular) * (g.sin2_d / (1 + g.cos_d)) ** 5
        return f * (d * 0.25)

    def smooth(m: Any, g: Any) -> Any:
        d2 = 4 * g.cos_d**2 * g.sin2_h
        return m.scatter * jnp.exp(-m.c * jnp.log1p(m.b * d2))

    formulas: dict[str, Callable[[Any, Any], Any]] = {
        "body": body,
        "lobe": lobe,
        "body+lobe": lambda m, g: body(m, g) + lobe(m, g),
        "body+lobe+fresnel": lambda m, g: body(m, g) + rising(m, g),
        "diffraction": smooth,
        "body+diffraction": lambda m, g: body(m, g) + smooth(m, g),
    }
    return formulas[name]


HAND = ("body", "lobe", "body+lobe", "body+lobe+fresnel", "diffraction", "body+diffraction")


@pytest.mark.parametrize("name", HAND)
def test_absent_effects_are_not_in_the_program(name: str):
    with jax.enable_x64(True):
        g = from_directions(WI, WO)
        (cls,) = variants(name)
        m = cls(**{p.name: jnp.asarray(0.5) for p in parameters_of(cls)})
        assert program(lambda m, g: m.evaluate(g), m, g) == program(by_hand(name), m, g)


def test_gtr_is_a_composition():
    """The same program, and so are fits' coordinates and starts."""
    cls = brdfit.compose("masking", "fresnel", "tail", "lobe", "body")
    with jax.enable_x64(True):
        g = from_directions(WI, WO)
        numbers = {p.name: jnp.asarray(0.5) for p in parameters_of(GTR)}
        assert program(lambda m, g: m.evaluate(g), cls(**numbers), g) == program(
            lambda m, g: m.evaluate(g), GTR(**numbers), g
        )
    assert [p.name for p in parameters_of(cls)] == [p.name for p in parameters_of(GTR)]
    assert list(cls.shapes(0.1)) == list(GTR.shapes(0.1))


def test_a_new_effect_changes_nothing_for_others(monkeypatch: pytest.MonkeyPatch):
    """An effect put into the library leaves the program of every other composition as it is."""
    names = ("body+lobe+fresnel+masking", "body+rough_body+retro")
    with jax.enable_x64(True):
        g = from_directions(WI[:3], WO[:3])

        def programs() -> list[str]:
            out = []
            for name in names:
                (cls,) = variants(name)
                m = cls(**{p.name: jnp.asarray(0.5) for p in parameters_of(cls)})
                parts = parts_of(*name.split("+"))
                out.append(program(parts.evaluate, m, g))
            return out

        before = programs()
        glow = effect.Effect("glow", "a glow", "1", {}, lambda parts, names: parts, effect.at())
        monkeypatch.setattr("brdfit.models.effects.EFFECTS", {"glow": glow, **EFFECTS})
        assert programs() == before


# Nesting --------------------------------------------------------------------------------------------------------------

REPLACING = {"fresnel", "masking", "interreflection"}
"""Effects that put another term in place of one: no value of a parameter takes that back."""


@pytest.mark.parametrize("name", EFFECTS)
def test_a_model_with_an_effect_contains_the_one_without(name: str):
    """Equal values where the effect's parameters are neutral; to the rounding of a lobe written in another form."""
    beside = {"body", "lobe", "second_lobe", "retro"}
    full = frozenset({*beside, *EFFECTS[name].needs, name} if name != "fresnel" else {*beside, name})
    bare = without(full, name)
    numbers = truth_of("+".join(in_order(bare)))
    embedded = EFFECTS[name].neutral({k: np.asarray(v) for k, v in numbers.items()}, bare)
    if name in REPLACING:
        assert embedded is None
        return
    assert embedded is not None
    declared = {p.name: p.default for p in parameters_of(variants("+".join(in_order(full)))[0])}
    with jax.enable_x64(True):
        small, large = (
            build(variants("+".join(in_order(names)))[0], values)(WI, WO)
            for names, values in ((bare, numbers), (full, {k: embedded.get(k, v) for k, v in declared.items()}))
        )
    np.testing.assert_allclose(large, small, rtol=1e-9 if name == "tail" else 1e-13, atol=1e-300)


def test_effects_that_replace_a_term_beside_fresnel():
    """F0 = 0 still rises towards grazing, and the body is not only scaled by what the surface leaves."""
    numbers = {"specular": np.array([0.1]), "diffuse": np.array([0.2])}
    for name in ("lobe", "trade_off"):
        assert EFFECTS[name].neutral(numbers, frozenset({"body", "diffraction", "fresnel"})) is None
    assert EFFECTS["trade_off"].neutral(numbers | {"specular": np.ones(1)}, frozenset({"body", "lobe"})) is None


# Names ----------------------------------------------------------------------------------------------------------------


def test_every_effect_is_complete():
    for e in EFFECTS.values():
        assert e.meaning
        assert e.formula
        assert e.references
        assert set(e.references) <= set(REFERENCES), e.name
        for need in e.needs:
            assert set(need.split(" or ")) <= set(EFFECTS), e.name
    asked = {name for term in TERMS for name in term.split("+")}
    assert set(EFFECTS) - asked == {"dispersion", "interreflection"}  # with tests of their own


def test_composing():
    cls = brdfit.compose("fresnel", "body", "lobe")
    assert cls is brdfit.compose("body", "lobe", "fresnel")
    assert cls.name == "body+lobe+fresnel"
    assert variants("lobe+fresnel+body") == (cls,)
    m = brdfit.model("body+lobe+fresnel", diffuse=0.1, specular=0.04, alpha=0.2)
    assert type(m) is cls
    again = pickle.loads(pickle.dumps(m))
    assert type(again) is cls
    assert (again.diffuse == m.diffuse).all()
    both = brdfit.compose("body", "lobe", "tail", "anisotropy", "dispersion")
    assert [p.name for p in parameters_of(both) if p.per_channel] == ["diffuse", "specular", "alpha_x", "alpha_y", "gamma"]
    assert both.anisotropic


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (
            ("body", "glare"),
            "unknown effect 'glare': choose from body, rough_body, lobe, tail, second_lobe, anisotropy, dis",
        ),
        (("body", "tail"), "effect 'tail' needs lobe, which is not among body, tail"),
        (("rough_body",), "effect 'rough_body' needs body, which is not among rough_body"),
        (("body", "fresnel"), "effect 'fresnel' needs lobe or diffraction, which is not among body, fresnel"),
        (("lobe", "interreflection"), "effect 'interreflection' needs masking, which is not among lobe, interreflection"),
        (("body", "body"), "effect 'body' is asked for twice"),
        ((), "a model needs an effect: choose from body,"),
    ],
)
def test_effects_that_do_not_go_together(names: tuple[str, ...], message: str):
    with pytest.raises(ValueError, match=message):
        brdfit.compose(*names)


def test_unknown_names_list_models_and_effects():
    with pytest.raises(ValueError, match=r"unknown model 'glare': choose from gtr, abc, .* join effects by \+: body, rough"):
        brdfit.model("glare")
    with pytest.raises(ValueError, match="unknown effect 'glare': choose from body"):
        brdfit.model("body+glare")


def test_every_pair_of_effects_that_goes_together_evaluates():
    """Finite, per channel as declared; what does not go together says so."""
    wi, wo = WI[:2], WO[:2]
    base = ("body", "lobe", "masking")
    with jax.enable_x64(True):
        for pair in combinations(EFFECTS, 2):
            names = in_order(dict.fromkeys((*base, *pair)))
            name = "+".join(names)
            m = build(variants(name)[0], truth_of(name))
            assert jax.eval_shape(m, wi, wo).shape == (2, 3), name


# Corners --------------------------------------------------------------------------------------------------------------

CORNERS = (
    "body+rough_body+lobe+fresnel+trade_off+retro",
    "lobe+tail+anisotropy+masking",
    "lobe+masking+interreflection",
    "diffraction+fresnel",
)
ENDS: dict[str, tuple[float, ...]] = {
    **dict.fromkeys(("diffuse", "specular", "share", "retro", "scatter"), (0.0, 1.0)),
    **dict.fromkeys(("alpha", "alpha_2", "alpha_x", "alpha_y", "alpha_retro"), (1e-4, 1.0, 10.0)),
    "gamma": (0.5, 1.0, 2.0),
    "sigma": (0.0, 1.5),
    "b": (1e-2, 1e6),
    "c": (1e-3, 4.0),
}


def corner_cases(name: str) -> tuple[dict[str, float], ...]:
    """Every parameter at every end of its range, the others in the middle, and all at their first or last ends."""
    middle = {p.name: p.default for p in parameters_of(variants(name)[0])}
    cases = [{**middle, n: end} for n in middle for end in ENDS[n]]
    return (*cases, {n: ENDS[n][0] for n in middle}, {n: ENDS[n][-1] for n in middle})


@pytest.mark.parametrize("name", CORNERS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64], ids=["float32", "float64"])
def test_finite_at_corners(name: str, dtype: type):
    """Value and gradient by every parameter and direction, at grazing, mirror, retro and normal directions."""

    def one(m: Any, wi: Any, wo: Any) -> Any:
        return m(wi, wo)[0]

    few = np.r_[0:6, 12:26:2, len(WI) - 5 : len(WI)]
    with jax.enable_x64(dtype is np.float64):
        m = stacked(name, corner_cases(name), dtype)
        inner = jax.vmap(jax.value_and_grad(one, (0, 1, 2)), (None, 0, 0))
        out = jax.jit(jax.vmap(inner, (0, None, None)))(m, WI[few].astype(dtype), WO[few].astype(dtype))
        assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(out))


@pytest.mark.parametrize("name", CORNERS)
def test_reciprocity(name: str):
    """To the rounding of sums of six terms, magnified by up to 1e3 where two grazing vectors are all but equal."""
    there, back_again = values(name, WI, WO), values(name, WO, WI)
    np.testing.assert_allclose(there, back_again, rtol=1e-11, atol=1e-290)


@pytest.mark.parametrize("name", [n for n in TERMS if n != "body"])
def test_single_precision(name: str):
    """float32 against 30 digits on numbers that it holds, up to 89 degrees: 1e-4 of the value, where a term depends on the
    fourth power of a cosine of 0.02 that is right to 6e-8; a lobe of 1e-6 of its peak need only be small.
    """
    up = np.flatnonzero(np.minimum(WI[:, 2], WO[:, 2]) > 0.015)
    wi, wo = WI.astype(np.float32), WO.astype(np.float32)
    got = values(name, wi, wo, np.float32)[:, up]
    exact = values(name, wi.astype(float), wo.astype(float))[:, up]
    assert np.isfinite(got).all()
    error = np.abs(got - exact) / (np.abs(exact) + 1e-6 * np.abs(exact).max(1, keepdims=True))
    assert error.max() <= 1e-4, error.max()


# Energy ---------------------------------------------------------------------------------------------------------------


ANGLES = np.array([0.0, 30.0, 60.0, 80.0, 85.0])
_first_channel = jax.jit(lambda m, a, b: m(a, b)[:, 0])


@cache
def _directions(thetas: tuple[float, ...]) -> tuple[Reals, Reals, Reals]:
    rules = [hemisphere(np.radians(t), (300, 100)) for t in thetas]
    light = np.concatenate([np.broadcast_to(a, b.shape) for a, b, _ in rules])
    return light, np.concatenate([b for _, b, _ in rules]), np.stack([w for _, _, w in rules])


def albedo(name: str, thetas: Reals = ANGLES, **parameters: float) -> Reals:
    """Directional albedo at angles in degrees by 300 x 100 nodes in the half vector."""
    light, viewer, weight = _directions(tuple(thetas))
    with jax.enable_x64(True):
        m = brdfit.model(name, **{k: [v] if k in ("diffuse", "specular") else v for k, v in parameters.items()})
        f = np.asarray(_first_channel(m, light, viewer))
    return np.sum(weight * f.reshape(weight.shape), 1)


@pytest.mark.parametrize("alpha", [0.05, 0.1, 0.3, 0.6, 1.0])
def test_white_furnace(alpha: float):
    """A lobe that reflects all, with interreflection, returns all light: to 5e-4 up to 85 degrees. Without, it does not."""
    np.testing.assert_allclose(albedo("lobe+masking+interreflection", specular=1.0, alpha=alpha), 1, atol=5e-4)
    missing = 1 - albedo("lobe+masking", specular=1.0, alpha=alpha)
    assert missing.max() > 0.05


def test_energy():
    """At most all light comes back: with the trade-off of a perfect body, with interreflection of a metal with a tail."""
    assert albedo("body+lobe+fresnel+masking+trade_off", diffuse=1.0, specular=0.3, alpha=0.2).max() <= 1
    full = albedo("lobe+tail+masking+interreflection", specular=1.0, alpha=0.3, gamma=1.5)
    np.testing.assert_allclose(full, 1, atol=1e-3)  # the quadrature of a tail


def test_compensation_of_a_colour():
    """Kulla & Conty 2017: the compensating term is F_avg^2 E_avg/(1 - F_avg (1 - E_avg)) of that of a white lobe, with E_avg
    measured by quadrature of the lobe alone.
    """
    x, w = np.polynomial.legendre.leggauss(12)
    mu = (x + 1) / 2
    mean = np.sum(w * mu * albedo("lobe+masking", np.degrees(np.arccos(mu)), specular=1.0, alpha=0.6))
    f = 0.4
    share = f**2 * mean / (1 - f * (1 - mean))

    def extra(specular: float) -> Reals:
        with_it = albedo("lobe+masking+interreflection", specular=specular, alpha=0.6)
        return with_it - albedo("lobe+masking", specular=specular, alpha=0.6)

    # 2e-3: 12 nodes for the mean
    np.testing.assert_allclose(extra(f) / extra(1.0), share, rtol=2e-3)


# Dispersion, stretching -----------------------------------------------------------------------------------------------


def test_dispersion_is_one_lobe_a_channel():
    numbers = truth_of("body+lobe+dispersion+fresnel+masking")
    with jax.enable_x64(True):
        together = np.asarray(brdfit.model("body+lobe+dispersion+fresnel+masking", **numbers)(WI, WO))
        for k in range(3):
            one = {n: [v[k]] if n in ("diffuse", "specular") else v[k] for n, v in numbers.items()}
            alone = np.asarray(brdfit.model("body+lobe+fresnel+masking", **one)(WI, WO))
            np.testing.assert_allclose(together[:, k : k + 1], alone, rtol=1e-12)


def test_anisotropy_of_equal_widths_is_round():
    """Also with a tail, whose masking is then an integral at the angle itself."""
    numbers = {"specular": 0.5, "gamma": 1.6}
    with jax.enable_x64(True):
        round_lobe = brdfit.model("lobe+tail+fresnel+masking", alpha=0.3, **numbers)(WI, WO)
        stretched = brdfit.model("lobe+tail+anisotropy+fresnel+masking", alpha_x=0.3, alpha_y=0.3, **numbers)(WI, WO)
    np.testing.assert_allclose(stretched, round_lobe, rtol=1e-11)


# Fits -----------------------------------------------------------------------------------------------------------------

RECOVERED = (
    "body+lobe+second_lobe+fresnel",
    "body+lobe+fresnel+masking+interreflection+trade_off",
    "body+lobe+anisotropy+fresnel",
    "body+rough_body+lobe+dispersion+diffraction+retro",
)


@pytest.mark.parametrize("name", RECOVERED)
def test_recovery(name: str):
    """A table without noise, fitted from automatic starts: parameters come back to 1e-6."""
    truth = truth_of(name)
    layout = grid_of((6, 10, 8, 10) if variants(name)[0].anisotropic else (24, 16, 16), "edge")
    fit = brdfit.fit(table_of(brdfit.model(name, **truth), layout), name)
    assert fit.converged, fit.reason
    assert fit.model_name == name
    assert not fit.undetermined
    for parameter, value in truth.items():
        np.testing.assert_allclose(fit.parameters[parameter], value, rtol=1e-6, err_msg=parameter)
    again = from_record(fit.record())
    assert type(again.model) is variants(name)[0]


def test_narrow_lobes():
    """Energy that lobes of any width miss: finite in float32 with its slopes, and right to 1 % from 1e-2 on."""

    def returned(alpha, gamma, wi, wo):
        return compensation(ndf.GTR(alpha, gamma), jnp.asarray(0.9, wi.dtype), from_directions(wi, wo))

    widths = np.array([1e-9, 1e-6, 1e-5, 1e-4, 1e-2, 0.1, 1, 1.5])
    widths, tails = (a.ravel() for a in np.meshgrid(widths, [0.5, 1.03, 1.5, 2, 4, 100]))
    ends = [
        np.stack([unit_vectors(np.radians(t), 0.3) for t in (0.0, 20.0, 70.0, 89.9)]),
        np.stack([unit_vectors(0.5, 3.0)] * 4),
    ]

    def every(function):
        return jax.jit(jax.vmap(jax.vmap(function, (None, None, 0, 0)), (0, 0, None, None)))

    slopes = jax.value_and_grad(returned, argnums=(0, 1, 2))
    single = every(slopes)(*(jnp.asarray(a, jnp.float32) for a in (widths, tails, *ends)))
    assert all(np.isfinite(a).all() for a in jax.tree.leaves(single))
    with jax.enable_x64(True):
        double = every(returned)(*(jnp.asarray(a) for a in (widths, tails, *ends)))
    assert np.isfinite(double).all()
    seen = np.asarray(double) > 1e-2  # below, what is missing is close to the rounding of 1
    wide = (widths >= 1e-2)[:, None] & seen
    assert wide.sum() > 40
    # 1 - E of 1e-2 is a difference from 1, a sum of a thousand roundings, and enters three times
    np.testing.assert_allclose(np.asarray(single[0])[wide], np.asarray(double)[wide], rtol=1e-2)


def test_a_mirror_takes_no_light_away():
    """What lobes this narrow miss is rounding of either sign, and what is returned for it is neither negative nor seen."""
    with jax.enable_x64(True):
        g = from_directions(*(jnp.asarray(unit_vectors(t, 0.3)) for t in (0.4, 1.1)))
        widths = jnp.asarray(np.geomspace(1e-30, 1e-6, 40))
        returned = jax.jit(jax.vmap(lambda alpha: compensation(ndf.GGX(alpha), jnp.asarray(0.9), g)))(widths)
    assert (np.asarray(returned) >= 0).all()
    assert (np.asarray(returned) < 1e-10).all()
