"""Published fits: the numbers, their conversion into models, and the exact published forms against plain transcriptions."""

import equinox as eqx
import jax
import mpmath
import numpy as np
import pytest
from brdfit.angles import directions
from brdfit.data import (
    forms,
    formula,
    published_abc,
    published_materials,
    published_sgd,
    published_sgd_smith,
    raw,
    source,
)
from brdfit.errors import InputError

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
