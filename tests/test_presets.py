"""Published fits: the numbers, their conversion into models, and the exact published forms against plain transcriptions."""

import dataclasses

import brdfit
import equinox as eqx
import jax
import mpmath
import numpy as np
import pytest
from brdfit.angles import directions
from brdfit.data import (
    NGAN_SCALE,
    forms,
    formula,
    published_abc,
    published_materials,
    published_sgd,
    published_sgd_smith,
    published_start,
    raw,
    source,
)
from brdfit.data.presets import STARTS
from brdfit.errors import InputError
from brdfit.models import parameters_of, variants

FITTED = {"abc": 100, "sgd": 100, "low_": 100, "ngan_": 86}


def geometry(n=400, max_angle=80):
    """Half/difference angles and direction pairs with both polar angles at most ``max_angle`` degrees."""
    u = np.random.default_rng(5).random((20 * n, 3))
    th, td, pd = u[:, 0] ** 3 * np.pi / 2, u[:, 1] * np.pi / 2, u[:, 2] * np.pi
    wi, wo = directions(th, td, pd)
    keep = np.flatnonzero(np.minimum(wi[:, 2], wo[:, 2]) > np.cos(np.radians(max_angle)))[:n]
    return th[keep], td[keep], wi[keep], wo[keep]


@eqx.filter_jit
def evaluate(model, wi, wo):
    return model(wi, wo)


def value(model, wi, wo):
    with jax.enable_x64(True):
        return np.asarray(evaluate(model, wi, wo))


def test_forms_and_counts():
    assert len(forms()) == 14
    for form in forms():
        expected = next(n for prefix, n in FITTED.items() if form.startswith(prefix))
        assert len(published_materials(form)) == expected
        assert source(form)
        assert formula(form)
        for material in published_materials(form):
            for name, v in raw(form, material).items():
                assert v.shape in ((), (3,)), (form, material, name)
                assert np.isfinite(v).all()


def test_known_numbers():
    fit = raw("abc", "alum-bronze")
    np.testing.assert_array_equal(fit["A"], [51.714554, 37.932693, 27.373095])
    assert (fit["B"], fit["C"], fit["ior"]) == (10482.133789, 0.816737, 2.236525)


def test_errors_name_the_fault():
    with pytest.raises(InputError, match=r"no published 'abc' fit of 'nickle': did you mean nickel"):
        raw("abc", "nickle")
    with pytest.raises(InputError, match="no published 'ngan_ward' fit of 'zzzzzz': there are 86"):
        raw("ngan_ward", "zzzzzz")
    with pytest.raises(InputError, match="unknown published form 'phong': choose from abc, sgd"):
        raw("phong", "nickel")


@pytest.mark.parametrize("material", ["nickel", "black-fabric", "white-marble", "beige-fabric"])
def test_abc_is_the_published_form(material):
    th, td, wi, wo = geometry()
    m, ci, co, ch, cd = raw("abc", material), wi[:, 2], wo[:, 2], np.cos(th), np.cos(td)
    g = np.sqrt(m["ior"] ** 2 + cd**2 - 1)
    fresnel = 0.5 * ((g - cd) / (g + cd)) ** 2 * (1 + ((cd * (g + cd) - 1) / (cd * (g - cd) + 1)) ** 2)
    cavity = np.minimum(1, 2 * ch * np.minimum(ci, co) / cd)
    lobe = fresnel * cavity / (np.pi * ci * co * (1 + m["B"] * 2 * np.sin(th / 2) ** 2) ** m["C"])
    expected = m["kD"] / np.pi + m["A"] * lobe[:, None]
    # directions are rounded to 1e-16; at theta_h >= 1e-9 a lobe of width 3e-4 magnifies that to 1e-12
    np.testing.assert_allclose(value(published_abc(material), wi, wo), expected, rtol=1e-10)


def published_sgd_by_mpmath(m, j, th, td, ci, co):
    """The exact form, in 30 digits, so that c = 1e109 needs no logarithm."""
    x = {k: mpmath.mpf(float(v[j])) for k, v in m.items()}

    def g1(cosine):
        beyond = mpmath.acos(mpmath.mpf(cosine)) - x["theta0"]
        power = x["c"] * beyond ** x["k"] if beyond > 0 else mpmath.mpf(0)
        return max(mpmath.mpf(0), min(mpmath.mpf(1), 1 - x["Lambda"] * mpmath.expm1(power)))

    th, cd = mpmath.mpf(th), mpmath.cos(mpmath.mpf(td))
    s = x["alpha"] + mpmath.tan(th) ** 2 / x["alpha"]
    d = x["K"] * mpmath.exp(-s) / (s ** x["p"] * mpmath.pi * mpmath.cos(th) ** 4)
    f = x["F0"] - x["F1"] * cd + (1 - x["F0"]) * (1 - cd) ** 5
    return float((x["rhoD"] + x["rhoS"] * f * d * g1(ci) * g1(co) / (mpmath.mpf(ci) * mpmath.mpf(co))) / mpmath.pi)


def largest_c():
    return max(published_materials("sgd"), key=lambda m: raw("sgd", m)["c"].max())


@pytest.mark.parametrize("material", ["nickel", "black-fabric", "pink-fabric", largest_c()])
def test_published_sgd_is_the_exact_form(material):
    th, td, wi, wo = geometry(60, max_angle=89)
    m = raw("sgd", material)
    with mpmath.workdps(30):
        expected = [
            [published_sgd_by_mpmath(m, j, *row) for j in range(3)]
            for row in zip(th.tolist(), td.tolist(), wi[:, 2].tolist(), wo[:, 2].tolist(), strict=True)
        ]
    # G1 = 1 - Lambda expm1(c t^k) with k up to 856 magnifies the rounding of theta, 1e-16, to 1e-13, and Lambda expm1
    # near 1 leaves a small difference: hence the absolute part, relative to the largest value
    np.testing.assert_allclose(value(published_sgd(material), wi, wo), expected, rtol=1e-9, atol=1e-12 * np.max(expected))


def test_largest_c_is_out_of_range_of_a_plain_power():
    assert raw("sgd", largest_c())["c"].max() > 1e109


def test_sgd_normaliser_is_the_incomplete_gamma_function():
    # six printed digits: K within 5e-6, and K alpha Gamma(1 - p, alpha) as sensitive to those of alpha and p
    for material in published_materials("sgd"):
        m = raw("sgd", material)
        for alpha, p, k in zip(m["alpha"].tolist(), m["p"].tolist(), m["K"].tolist(), strict=True):
            assert k * alpha * float(mpmath.gammainc(1 - p, alpha)) == pytest.approx(1, rel=1e-5)


@pytest.mark.parametrize("material", ["nickel", "white-fabric", "specular-orange-phenolic"])
def test_sgd_with_smith_differs_in_masking_only(material):
    # at normal incidence of both directions nothing is masked in either form, so diffuse + peak must agree
    n = np.array([0.0, 0.0, 1.0])
    published, ours = published_sgd(material), published_sgd_smith(material)
    m = raw("sgd", material)
    with np.errstate(over="ignore"):
        g1 = np.clip(1 - m["Lambda"] * np.expm1(m["c"] * np.maximum(0, -m["theta0"]) ** m["k"]), 0, 1)
    lobe = value(published, n, n) - published.diffuse / np.pi
    # the exact Smith masking is 1 at normal incidence, the approximation need not be (theta0 < 0)
    np.testing.assert_allclose(value(ours, n, n) - ours.diffuse / np.pi, lobe / g1**2, rtol=1e-11)


@pytest.mark.parametrize("material", published_materials("abc"))
def test_every_preset_builds_within_the_range_of_its_model(material):
    assert published_abc(material).specular.shape == (3,)
    assert published_sgd(material).log_c.shape == (3,)
    assert published_sgd_smith(material).specular.shape == (3,)


def published_by_mpmath(form, m, wi, wo):
    """The published forms as printed, in 40 digits, per channel; directions taken as exact but for their length."""
    mp = mpmath.mp
    x = {k: v.reshape(-1).tolist() for k, v in m.items()}
    l, v = ([a / mp.sqrt(mp.fsum(b * b for b in w)) for a in w] for w in (wi, wo))  # noqa: E741
    h = [a + b for a, b in zip(l, v, strict=True)]
    half = mp.sqrt(mp.fsum(a * a for a in h))
    nh, cd, most = h[2] / half, half / 2, max(l[2], v[2])
    tan2 = (h[0] ** 2 + h[1] ** 2) / h[2] ** 2

    def dielectric(n, c):
        g = mp.sqrt(n * n + c * c - 1)
        return ((g - c) / (g + c)) ** 2 / 2 * (1 + ((c * (g + c) - 1) / (c * (g - c) + 1)) ** 2)

    def schlick(f0):
        return f0 + (1 - f0) * (1 - cd) ** 5

    cavity = min(1, 2 * nh * v[2] / cd, 2 * nh * l[2] / cd)
    one = {k: mpmath.mpf(c[0]) for k, c in x.items() if len(c) == 1}
    scale = NGAN_SCALE if form.startswith("ngan") else (1, 1, 1)
    body, albedo = (x.get(k) for k in ("kD" if form == "abc" else "kd", "A" if "A" in x else "albedo"))
    s = one.get("sharpness")
    if form == "abc":
        lobe = dielectric(one["ior"], cd) * cavity / (mp.pi * l[2] * v[2] * (1 + one["B"] * (1 - nh)) ** one["C"])
    elif form == "low_lowsmooth_E2":
        apart, across = (mp.fsum((l[k] + sign * v[k]) ** 2 for k in range(2)) for sign in (-1, 1))
        lobe = dielectric(one["eta"], mp.sqrt(1 - apart / 4)) / (1 + one["B"] * across) ** one["C"]
    elif "ashikhminshirley" in form:
        r = one["fresnelReflectance"]
        f = dielectric(r, cd) if form.startswith("low") else schlick(r)
        lobe = (s + 1) / (8 * mp.pi) * nh**s * f / (cd * most)
    elif "cooktorrance" in form:
        f = dielectric(one["eta"], cd) * mp.pi if form.startswith("low") else schlick(one["eta"])
        d = mp.exp(-tan2 / one["roughness"] ** 2) / (mp.pi * one["roughness"] ** 2 * nh**4)
        lobe = f * d * cavity / (mp.pi * l[2] * v[2])
    elif form == "ngan_blinnphong":
        lobe = (s + 2) / (2 * mp.pi) * nh**s
    elif form == "ngan_lafortune":
        base = one["Cxy"] * (l[0] * v[0] + l[1] * v[1]) + one["Cz"] * l[2] * v[2]
        lobe = (s + 2) / (2 * mp.pi) * max(0, base) ** s / max(one["Cz"] ** 2, one["Cxy"] ** 2) ** (s / 2)
    else:
        divisor = mp.sqrt(l[2] * v[2]) if form == "ngan_ward" else l[2] * v[2]
        lobe = mp.exp(-tan2 / one["roughness"] ** 2) / (4 * mp.pi * one["roughness"] ** 2 * divisor)
    return [float(c * (b / mp.pi + a * lobe)) for c, b, a in zip(scale, body, albedo, strict=True)]


@pytest.mark.parametrize("form", [f for f in forms() if f not in ("sgd", "ngan_he")])
def test_presets_are_the_published_forms(form):
    """To 1e-12 of their 40-digit values, of every fifteenth material at forty directions up to 80 degrees.

    Lafortune's exponents, up to 16,600, count the rounding of the angle of the lobe as often.
    """
    _, _, wi, wo = geometry(40)
    for material in published_materials(form)[::15]:
        got = value(brdfit.preset(form, material), wi, wo)
        with mpmath.workdps(40):
            pairs = zip(wi.tolist(), wo.tolist(), strict=True)
            want = [published_by_mpmath(form, raw(form, material), *map(as_exact, pair)) for pair in pairs]
        np.testing.assert_allclose(got, want, rtol=4e-12 if form == "ngan_lafortune" else 1e-12, err_msg=material)


def as_exact(direction):
    return [mpmath.mpf(x) for x in direction]


def test_every_preset_builds():
    for form in forms():
        for material in published_materials(form):
            assert brdfit.preset(form, material).diffuse.shape == (3,)
    with pytest.raises(InputError, match=r"no published 'ngan_he' fit of 'nickle': did you mean nickel"):
        brdfit.preset("ngan_he", "nickle")


def test_starts_have_the_parameters_of_their_models():
    for name in STARTS:
        start = published_start(name, "nickel")
        assert set(start) == {p.name for p in parameters_of(variants(name)[0])}
    assert published_start("gtr", "nickel") is None
    assert published_start("ward", "stuff") is None


def test_a_fit_from_the_published_one(small_table):
    """It is one start more; a material or model without a published fit has none, and another word is refused."""
    table = dataclasses.replace(small_table[0], material="nickel")
    with_it = brdfit.fit(table, "ward", start="published")
    assert with_it.starts == brdfit.fit(table, "ward").starts + 1
    assert brdfit.fit(small_table[0], "ward", start="published").starts == with_it.starts - 1
    with pytest.raises(ValueError, match="start is a mapping of parameters or 'published', not 'best'"):
        brdfit.fit(table, "ward", start="best")
