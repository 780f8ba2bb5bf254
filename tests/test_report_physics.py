"""The numbers and words of a report: albedo, F0, widths, digits, grades, colours."""

import math

import brdfit
import numpy as np
import pytest
from brdfit import physics, references
from brdfit.colours import delta_e, encode, exposure_of, screen
from brdfit.models import MODELS, build, parameters_of, variants
from brdfit.reports import materials, words
from brdfit.reports.model_section import _f0_error, physics_view

from .report_cases import GGX, fit_of


def test_albedo_of_lambert_is_its_diffuse():
    rho, error = physics.directional_albedo(brdfit.model("lambert", diffuse=[0.2, 0.5, 0.8]))
    # the quadrature of a constant: its own error estimate holds, and is small up to grazing
    np.testing.assert_allclose(rho, np.broadcast_to([0.2, 0.5, 0.8], rho.shape), atol=2e-3)
    assert (np.abs(rho - [0.2, 0.5, 0.8]) <= error + 1e-9).mean() > 0.9


@pytest.mark.parametrize("alpha", [0.003, 0.05, 0.3, 0.9])
def test_quadrature_in_a_weak_white_furnace(alpha):
    """D / (4 cos_i cos_o) at normal incidence returns what GGX has within 45 degrees: 1/(1 + alpha^2), in closed form."""

    def lobe(wi, wo):
        h = wi + wo
        h /= np.linalg.norm(h, axis=-1, keepdims=True)
        sin2, cos2 = h[..., 0] ** 2 + h[..., 1] ** 2, h[..., 2] ** 2
        d = alpha**2 / (np.pi * (sin2 + alpha**2 * cos2) ** 2)
        # the weight of a viewer at the horizon is 0: its value is not needed
        return (d / (4 * wi[..., 2] * np.maximum(wo[..., 2], 1e-12)))[..., None]

    rho, error = physics.directional_albedo(lobe, (0.0,))
    assert rho[0, 0] == pytest.approx(1 / (1 + alpha**2), abs=1e-6)
    assert abs(rho[0, 0] - 1 / (1 + alpha**2)) <= error[0, 0] + 1e-9


@pytest.mark.parametrize("alpha", [0.003, 0.3, 0.9])
def test_white_furnace(alpha):
    """A lobe of F = 1 with masking returns no more than all, and no more than without masking."""
    mirror = brdfit.model("gtr", diffuse=[0.0], specular=[1.0], alpha=alpha, gamma=2.0)
    rho, error = physics.directional_albedo(mirror)
    assert (rho <= 1 + error + 1e-6).all()
    assert rho[0, 0] < 1 / (1 + alpha**2) + error[0, 0]
    assert rho[0, 0] > 0.999 or alpha > 0.003
    assert "conserves energy" in physics.energy_verdict(rho, error)


def test_ward_returns_too_much_and_the_verdict_says_from_where():
    alpha = 0.1
    rho, error = physics.directional_albedo(brdfit.model("ward", diffuse=[0.3], specular=[0.9], alpha=alpha))
    # at normal incidence, by midpoints in theta_h: cos_o = cos 2 theta, do = 4 cos theta dh
    t = (np.arange(100_000) + 0.5) / 100_000 * np.pi / 4
    part = np.exp(-((np.tan(t) / alpha) ** 2)) / (np.pi * alpha**2) * np.sqrt(np.cos(2 * t)) * np.cos(t)
    exact = 0.3 + 0.9 * np.sum(part * 2 * np.pi * np.sin(t)) * np.pi / 4 / 100_000
    assert rho[0, 0] == pytest.approx(exact, abs=1e-5)
    verdict = physics.energy_verdict(rho, error)
    assert verdict.startswith("returns more light than falls on it: albedo ≤ 1 nowhere")
    falling = physics.energy_verdict(np.array([[0.5], [0.9], [1.2]]), np.zeros((3, 1)), (0.0, 45.0, 80.0))
    assert falling == "returns more light than falls on it: albedo ≤ 1 only up to 45°, 1.20 at 80°"


def test_copper_is_copper():
    substance, distance = materials.nearest([0.95, 0.64, 0.54])
    assert substance.name == "copper"
    assert distance < 0.01
    assert materials.nearest([0.04, 0.04, 0.04])[0].kind == "dielectric"
    assert "hardly any material" in materials.kind_of([0.3, 0.3, 0.3])
    assert "dielectrics" in materials.kind_of(0.04)
    assert "metals" in materials.kind_of([0.9, 0.9, 0.9])
    with pytest.raises(ValueError, match="linear RGB"):
        materials.nearest([0.5])


@pytest.mark.parametrize(
    ("specular", "spread", "said"),
    [
        ([0.95, 0.64, 0.54], 0.01, "copper"),
        ([0.95, 0.64, 0.54], 0.2, "none named: F0 is known to ± 20.0 % only"),
        ([0.185, 0.166, 0.145], 0.01, "none within 10.0 %"),  # a rough nickel: as low as diamond, but coloured
    ],
)
def test_a_substance_is_named_where_it_means_something(specular, spread, said):
    fit = fit_of("gtr", GGX | {"specular": specular}, 0.02)
    fit.spread["specular"] = spread * np.array(specular)
    f0 = physics_view(fit, "gtr", None, {})["f0"]
    assert (f0["nearest"] or f0["why"]) == said


def test_error_of_f0_follows_from_those_of_what_makes_it():
    """F0 of abc is specular ((ior - 1)/(ior + 1))^2: a quarter more of the one may be undone by the other."""
    values = {"diffuse": [0.1], "specular": [1.3], "b": 900.0, "c": 1.1, "ior": 2.0}
    fit = fit_of("abc", values, 0.02)
    # d ln F0 = d ln specular + 4/(ior^2 - 1) d ior
    fit.spread.update({"specular": np.array([0.3 * 1.3]), "ior": np.asarray(0.3)})
    k, m = fit.labels.index("specular[0]"), fit.labels.index("ior")
    f0 = physics.normal_reflectance(fit.model)
    for r in (0.0, -0.9):
        fit.correlation[k, m] = fit.correlation[m, k] = r
        assert _f0_error(fit, f0) == pytest.approx(np.sqrt(0.3**2 + 0.4**2 + 2 * r * 0.3 * 0.4), rel=1e-6)


def test_a_coloured_dielectric_is_doubted():
    assert "coloured as none is" in materials.kind_of([0.185, 0.166, 0.145])
    assert materials.kind_of([0.171, 0.173, 0.177]) == "in the range of dielectrics"  # diamond, index 2.41 to 2.45


def of(name, **parameters):
    """A model with these parameters and defaults for the others."""
    form = variants(name)[0]
    return build(form, {p.name: p.default for p in parameters_of(form)} | parameters)


F0 = [
    ("abc", {"specular": [1.3, 0.9], "ior": 2.0}, [1.3 / 9, 0.1]),  # ((2 - 1)/(2 + 1))^2
    ("sgd", {"specular": [0.5], "f0": [0.9], "f1": [0.1]}, [0.4]),
    ("disney", {"specular": [0.5, 1.0], "metallic": 0.5, "base_color": [0.2, 0.6]}, [0.12, 0.34]),
    ("microfacet(epd,vcavity,schlick_scaled,none)", {"specular": [2.0], "f0": 0.1}, [0.2]),
    ("microfacet(ggx,smith,conductor,none)", {"specular": [1.0], "ior": 1.0, "k": 2.0}, [0.5]),  # k^2/(4 + k^2)
    *(
        (name, {"specular": [0.1, 0.7]}, [0.1, 0.7])
        for name in (
            *("gtr", "ggx", "beckmann", "pbr", "epd", "student_t", "schlick", "schlick_two_layers", "schwenk"),
            *("ashikhmin_shirley", "cook_torrance", "cook_torrance_blinn", "cook_torrance_gaussian"),
            *("body+lobe", "lobe+second_lobe+fresnel+masking"),
        )
    ),
]


@pytest.mark.parametrize(("name", "parameters", "f0"), F0, ids=[c[0] for c in F0])
def test_f0(name, parameters, f0):
    np.testing.assert_allclose(physics.normal_reflectance(of(name, **parameters)), f0, rtol=1e-12)


def test_f0_of_models_that_have_none():
    for name in ("ward", "lambert", "body+diffraction"):
        assert physics.normal_reflectance(of(name)) is None
    assert physics.normal_reflectance(None) is None


DISTRIBUTIONS = [
    ("gtr", {"alpha": 0.05, "gamma": 1.3}, lambda s2: (s2 + 0.05**2 * (1 - s2)) ** -1.3),
    ("abc", {"b": 700.0, "c": 1.9}, lambda s2: (1 + 700 * (1 - np.sqrt(1 - s2))) ** -1.9),
    (
        "sgd",
        {"alpha": 0.02, "p": 0.6},
        lambda s2: np.exp(-(0.02 + s2 / (1 - s2) / 0.02)) * (0.02 + s2 / (1 - s2) / 0.02) ** -0.6 / (1 - s2) ** 2,
    ),
    ("ward", {"alpha": 0.1}, lambda s2: np.exp(-s2 / (1 - s2) / 0.01)),
    ("ashikhmin_shirley", {"exponent": 300.0, "diffuse": 0.0}, lambda s2: (1 - s2) ** 150),
]
"""Models, parameters and their D up to a factor, as MODELS.md writes it, of sin^2(theta_h)."""


@pytest.mark.parametrize(("name", "parameters", "d"), DISTRIBUTIONS, ids=[c[0] for c in DISTRIBUTIONS])
def test_half_width_is_where_d_halves(name, parameters, d):
    width = physics.lobe_width(of(name, **parameters))
    # a distribution is interpolated between angles 1.3 % apart; of the last two, values are asked for, in which the lobe is
    # divided by cosines that fall by 0.5 % up to its half-width
    tolerance = 1e-2 if name in ("ward", "ashikhmin_shirley") else 1e-4
    assert d(np.sin(width.half_width) ** 2) / d(0.0) == pytest.approx(0.5, rel=tolerance)


def test_no_half_width_no_number():
    for model in (of("lambert"), of("gtr", alpha=1.5), of("abc", b=1.0, c=0.1), of("ashikhmin_shirley", exponent=0.0), None):
        assert physics.lobe_width(model) is None
    assert physics.lobe_width(of("oren_nayar", sigma=1.0)) is None


def test_equivalents_of_ggx_are_its_own():
    for name in ("gtr", "ggx", "lobe+second_lobe+fresnel", "microfacet(ggx,vcavity,none,none)"):
        width = physics.lobe_width(of(name, alpha=0.3))
        assert width.alpha == pytest.approx(0.3, rel=1e-4)  # interpolated, as above
    assert width.roughness == pytest.approx(math.sqrt(0.3), rel=1e-4)
    assert width.exponent == pytest.approx(2 / 0.09 - 2, rel=3e-4)


@pytest.mark.parametrize(
    ("value", "sigma", "text"),
    [
        (0.951234, 0.0123, "0.951"),
        (0.951234, 0.000123, "0.95123"),
        (1234567.0, 89.0, "1.234567·10⁶"),
        (200.0, 1200.0, "200"),
        (-0.5, 0.01, "\u22120.500"),
        (0.25, math.nan, "0.2500"),
        (0.0, 0.1, "0"),
        (9.999, 0.1, "10.0"),
    ],
)
def test_digits_follow_the_uncertainty(value, sigma, text):
    assert words.uncertain(value, sigma) == text


def test_grades_follow_the_error():
    assert words.grade(0.012) == "hardly anyone sees a difference"
    assert words.grade(0.0121) != words.grade(0.012)
    assert words.grade(math.nan) == "no error could be computed"
    assert [words.grade_index(e) for e in (0.001, 0.02, 0.03, 0.3)] == [0, 1, 2, 3]


def test_colours_stay_linear_until_the_end():
    # IEC 61966-2-1: 12.92 x near black, 1.055 x^(1/2.4) - 0.055 above
    np.testing.assert_allclose(encode(np.array([0.0, 0.002, 0.18, 1.0])), [0, 0.02584, 0.461356, 1], atol=1e-5)
    grey = np.array([[0.18, 0.18, 0.18]])
    assert delta_e(grey, grey)[0] == pytest.approx(0, abs=1e-9)
    assert np.isnan(delta_e(grey, grey * np.nan)).all()
    values = np.full((4, 3), 7.0)
    assert screen(values, exposure_of(values)) == pytest.approx(0.18)


def test_every_reference_of_a_model_is_known():
    for forms in MODELS.values():
        for form in forms:
            assert set(form.references) <= set(references.REFERENCES), form
