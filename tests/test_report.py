"""The files of a fit: what the report says is what the fits hold, and what cannot be shown is said."""

import json
import math
import re
from dataclasses import replace
from html.parser import HTMLParser

import brdfit
import jax
import numpy as np
import pytest
from brdfit import references
from brdfit.errors import InputError
from brdfit.fitting.result import Fit, Optimum
from brdfit.models import MODELS, build, parameters_of
from brdfit.reports import materials, physics, words
from brdfit.reports.colours import delta_e, encode, exposure_of, screen
from brdfit.reports.evidence import load_evidence, save_evidence
from brdfit.reports.gather import gather, interpolate
from brdfit.reports.write import read_fits, rebuild_report, write_fits, write_report
from brdfit.tables import HalfDifferenceGrid, Scattered, SphericalGrid, table

VOID = {"meta", "img", "br", "link", "hr", "input"}
ENVIRONMENT = {"python": "3.11", "when": "some day"}

GGX = {"diffuse": [0.05, 0.04, 0.03], "specular": [0.95, 0.64, 0.54], "alpha": 0.2, "gamma": 2.0}
WARD = {"diffuse": [0.05, 0.04, 0.03], "specular": [0.3, 0.2, 0.1], "alpha": 0.2}
"""Two models of one small table; the first one is the table's truth."""


def half_grid(h=18, d=15, p=12):
    th, td, pd = (np.linspace(0, 1, h + 1) ** 2 * np.pi / 2, np.linspace(0, np.pi / 2, d + 1), np.linspace(0, np.pi, p + 1))
    return HalfDifferenceGrid(th[:-1], td[:-1], pd[:-1], th, td, pd)


def table_of(brdf, layout, material="stuff"):
    wi, wo = layout.directions()
    with jax.enable_x64(True):
        values = np.asarray(brdf(wi, wo))
    below = (wi[..., 2] <= 0) | (wo[..., 2] <= 0)
    planes = np.where(below, -1.0, np.moveaxis(values, -1, 0))
    return table(planes, layout, material, source=f"{material}.binary", sha256="0123456789abcdef")


def fit_of(name, parameters, error, material="stuff", **changes):
    model = build(MODELS[name][0], parameters)
    values = {p.name: np.asarray(getattr(model, p.name)) for p in parameters_of(model)}
    labels = tuple(f"{n}[{k}]" if v.ndim else n for n, v in values.items() for k in range(v.size))
    fields = {
        "material": material,
        "source": f"{material}.binary",
        "sha256": "0123456789abcdef",
        "angles": "edge",
        "model_name": name,
        "loss": "log",
        "measure": "solid_angle",
        "max_angle": 80.0,
        "model": model,
        "parameters": values,
        "stderr": {n: 1e-4 * np.abs(v) for n, v in values.items()},
        "spread": {n: 1e-2 * np.abs(v) for n, v in values.items()},
        "covariance": {},
        "converged": True,
        "reason": "at a minimum",
        "errors": {"log": error / 2, "ngan": error * 3, "perceptual": error},
        "cells": {"used": 1234567, "masked": 200, "total": 1234800},
        "seconds": {"load": 0.1, "prepare": 0.2, "compile": 1.0, "solve": 0.5},
        "labels": labels,
        "correlation": np.eye(len(labels)),
        "starts": 12,
        "optima": (Optimum(error / 2, 9), Optimum(error, 2)),
        "passes": 10,
    }
    return Fit(**{**fields, **changes})


def failed(name="sgd", material="stuff"):
    nothing = {"model": None, "parameters": {}, "stderr": {}, "spread": {}, "errors": {}, "labels": (), "optima": ()}
    reason = "every start ended at infinite cost"
    return replace(fit_of("ward", WARD, 0.5, material), model_name=name, converged=False, reason=reason, **nothing)


@pytest.fixture(scope="module")
def measured():
    return table_of(brdfit.model("gtr", **GGX), half_grid())


@pytest.fixture(scope="module")
def fits():
    return [fit_of("ward", WARD, 0.0333), fit_of("gtr", GGX, 0.00123), failed()]


@pytest.fixture(scope="module")
def evidence(measured, fits):
    return gather(measured, fits)


@pytest.fixture(scope="module")
def report(tmp_path_factory, fits, evidence):
    out = tmp_path_factory.mktemp("report")
    return write_report(out, fits, [evidence], ENVIRONMENT).read_text()


class Reader(HTMLParser):
    """Checks that elements nest, and collects text, ids and attributes."""

    def __init__(self, text):
        super().__init__()
        self.open, self.words, self.ids, self.tags = [], [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.ids += [v for k, v in attrs if k == "id"]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.ids += [v for k, v in attrs if k == "id"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not self.open or self.open[-1] != "style":
            self.words.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())


# --- the page


def test_headline_names_the_best_and_what_its_error_means(report):
    text = Reader(report).text
    assert "Best of three for stuff: gtr. Perceptual error 0.0012: hardly anyone sees a difference." in text
    assert "Next is ward with 0.033" in text
    assert "Failed or not converged: sgd." in text


def test_page_is_well_formed_and_self_contained(report):
    reader = Reader(report)
    assert reader.open == []
    assert len(reader.ids) == len(set(reader.ids))
    sources = [a.get("src", "") for _, a in reader.tags if "src" in a]
    assert sources
    assert all(s.startswith("data:image/png;base64,") for s in sources)
    links = [a[k] for _, a in reader.tags for k in ("href", "xlink:href") if k in a]
    assert all(link.startswith("#") for link in links)
    assert {link[1:] for link in links} <= set(reader.ids)
    assert not re.search(r"url\(\s*['\"]?https?:|@import|<script|<link", report)
    # the names of the two XML languages are no addresses that anything is loaded from
    rest = report.replace("http://www.w3.org/2000/svg", "").replace("http://www.w3.org/1999/xlink", "")
    assert "http://" not in rest
    assert "https://" not in rest


def test_pictures_have_words(report):
    tags = Reader(report).tags
    assert all(a.get("alt") for t, a in tags if t == "img")
    drawings = [a for t, a in tags if t == "svg"]
    assert len(drawings) == 4  # lobes, channels, albedo, error over time
    assert all(a.get("role") == "img" and a.get("aria-label") for a in drawings)


def test_numbers_are_those_of_the_fit(report, fits):
    text = Reader(report).text
    assert "1 234 567 of 1 234 800 cells fitted, 200 masked" in text
    assert "0.00123" in text  # perceptual error of gtr
    assert "0.0999" in text  # ngan error of ward
    # specular R of gtr: 0.95 with 0.0095 over angular bands and 0.000095 noise
    assert "0.9500 ± 9.5·10⁻⁵ noise ± 0.0095 bands" in text
    assert "50 ms" in text  # 0.5 s over 10 passes
    assert "12 starts: nine reached" not in text
    assert "Twelve starts: nine reached the best optimum (log error 0.0006150), two reached 0.001230" in text


def test_failed_fit_is_a_row_with_its_reason(report):
    text = Reader(report).text
    assert "failed: every start ended at infinite cost" in text
    assert "Failed: every start ended at infinite cost." in text


def test_f0_is_held_against_substances(report):
    text = Reader(report).text
    assert "0.950 0.640 0.540" in text
    assert "copper" in text
    assert "no parameter that is a reflectance" in text  # ward


def test_same_input_same_bytes(tmp_path, measured, fits, evidence, report):
    once_more = gather(measured, fits)
    assert write_report(tmp_path, fits, [once_more], ENVIRONMENT).read_text() == report
    other = write_report(tmp_path, fits, [once_more], {"when": "another day"}).read_text()
    cut = re.compile(r'<section id="environment">.*?</section>', re.S)
    assert cut.sub("", other) == cut.sub("", report)
    assert other != report
    first = save_evidence(tmp_path, [evidence]).read_bytes()
    assert save_evidence(tmp_path, [once_more]).read_bytes() == first


def test_nothing_is_left_beside_the_files(tmp_path, fits, evidence):
    write_fits(tmp_path, fits, ENVIRONMENT)
    save_evidence(tmp_path, [evidence])
    write_report(tmp_path, fits, [evidence], ENVIRONMENT)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["evidence.h5", "fits.json", "report.html"]


def test_rebuild_from_files_shows_the_same(tmp_path, fits, evidence, report):
    write_fits(tmp_path, fits, ENVIRONMENT)
    save_evidence(tmp_path, [evidence])
    rebuilt = rebuild_report(tmp_path).read_text()
    assert Reader(rebuilt).text == Reader(report).text


def test_without_evidence_the_report_says_what_is_missing(tmp_path, fits):
    write_fits(tmp_path, fits, ENVIRONMENT)
    text = Reader(rebuild_report(tmp_path).read_text()).text
    assert "evidence.h5) is not here, so its lobe plots, residual maps, spheres and directional albedo are missing" in text
    assert "Best of three for stuff: gtr" in text


def test_evidence_of_an_earlier_fit_is_not_shown(tmp_path, fits, evidence):
    later = replace(fits[0], parameters={**fits[0].parameters, "alpha": np.array(0.21)})
    text = Reader(write_report(tmp_path, [later, *fits[1:]], [evidence], ENVIRONMENT).read_text()).text
    assert "The evidence kept here (evidence.h5) is not of the present fit of ward, which is not drawn." in text


def test_many_materials_begin_with_an_overview(tmp_path, fits, evidence):
    others = [
        fit_of("ward", WARD, 0.005, "velvet"),
        fit_of("gtr", GGX, 0.2, "velvet", converged=False),
        failed("sgd", "velvet"),
    ]
    text = write_report(tmp_path, [*fits, *others], [evidence], ENVIRONMENT).read_text()
    reader = Reader(text)
    assert "Six fits of two materials; three fits failed or did not converge." in reader.text
    assert "Best most often: gtr 1, ward 1." in reader.text or "Best most often: ward 1, gtr 1." in reader.text
    assert "0.20 *" in reader.text
    assert text.index('id="overview"') < text.index('id="m0-stuff"') < text.index('id="m1-velvet"')


def test_text_from_outside_is_escaped(tmp_path):
    text = write_report(tmp_path, [fit_of("ward", WARD, 0.1, "<b>&\"x'")], [], {"<i>": "<script>"}).read_text()
    assert "<script" not in text
    assert "<b>" not in text
    assert "&lt;b&gt;&amp;" in text


def test_same_model_under_two_losses_is_told_apart(tmp_path):
    pair = [fit_of("ward", WARD, 0.02), fit_of("ward", WARD, 0.03, loss="ngan")]
    text = Reader(write_report(tmp_path, pair, [], {}).read_text()).text
    assert "ward, log" in text
    assert "ward, ngan" in text


def test_bounds_and_undetermined_are_said(tmp_path):
    zero = {**WARD, "diffuse": [0.0, 0.04, 0.03]}
    fit = fit_of(
        "ward", zero, 0.02, at_bound=("diffuse[0] = 0", "alpha = 30"), undetermined=("specular[2]",), fixed=("alpha",)
    )
    text = Reader(write_report(tmp_path, [fit], [], {}).read_text()).text
    assert "At the limit of what the model allows: diffuse R = 0." in text
    assert "At a bound of the search box: alpha = 30. A wider box may fit better." in text
    assert "Not determined by the data: specular B." in text
    assert "Held fixed: alpha." in text


@pytest.mark.parametrize("channels", [1, 5])
def test_other_numbers_of_channels(tmp_path, channels):
    ward = {**WARD, "diffuse": np.full(channels, 0.1), "specular": np.linspace(0.2, 0.5, channels)}
    fit = fit_of("ward", ward, 0.01)
    e = gather(table_of(fit.model, half_grid()), [fit])
    assert e.lobes.measured.shape[-1] == channels
    text = Reader(write_report(tmp_path, [fit], [e], {}).read_text()).text
    assert "shown as grey, the mean of the channels" in text
    assert "Mean of the channels of the BRDF" in text
    if channels == 5:
        assert "0.4250 ± 4.2·10⁻⁵ noise" in text or "0.4250 ± 4.3·10⁻⁵ noise" in text


def spherical():
    polar, azimuth = np.radians(np.linspace(0, 85, 18)), np.radians(np.arange(0, 360, 30.0))
    edges = np.radians(np.append(np.append(0, np.linspace(2.5, 82.5, 17)), 87.5))
    return SphericalGrid(polar, polar, azimuth, edges, edges, np.radians(np.arange(-15, 360, 30.0)))


def scattered():
    rng = np.random.default_rng(7)
    v = rng.normal(size=(2, 500, 3))
    v[..., 2] = np.abs(v[..., 2])
    v /= np.linalg.norm(v, axis=-1, keepdims=True)
    return Scattered(v[0], v[1], np.full(500, 1e-2), isotropic=True)


def test_tables_on_other_grids(tmp_path):
    fit = fit_of("ward", WARD, 0.01)
    grid = gather(table_of(fit.model, spherical()), [fit])
    assert "nearest to the plane of incidence" in grid.lobes.how
    # where the table holds the model's own values, its lobes are the model's
    known = np.isfinite(grid.lobes.measured)
    assert known.mean() > 0.9
    np.testing.assert_allclose(grid.lobes.measured[known], grid.lobes.fitted[0][known], rtol=1e-9)
    loose = gather(table_of(fit.model, scattered()), [fit])
    assert loose.lobes is None
    assert np.nanmax(np.abs(loose.maps.signed)) < 1e-9
    text = Reader(write_report(tmp_path, [fit], [loose], {}).read_text()).text
    assert "No lobe plots: lobes need values in planes of incidence" in text
    assert "only the fits are shown" in text


# --- evidence


def test_residual_of_the_truth_vanishes(evidence, measured):
    assert evidence.maps.signed.shape[0] == 3
    assert np.nanmax(np.abs(evidence.maps.rms[1])) < 1e-12  # gtr made the table
    assert np.nanmax(evidence.maps.rms[0]) > 0.05  # ward did not
    assert np.isnan(evidence.maps.signed[2]).all()  # sgd failed


def test_interpolation_is_exact_at_the_cells_and_never_reads_a_masked_one(measured):
    wi, wo = (d.reshape(-1, 3) for d in measured.layout.directions())
    got = interpolate(measured, wi, wo)
    known = measured.mask.ravel()
    np.testing.assert_allclose(got[known], measured.values.reshape(-1, 3)[known], rtol=1e-6)
    assert np.isnan(got[~known]).all()
    assert not (got < 0).any()


def test_lobes_follow_the_table_between_its_cells(evidence):
    inside = np.abs(evidence.lobes.theta_o) < 70
    m, f = evidence.lobes.measured[inside], evidence.lobes.fitted[1][inside]
    assert np.isfinite(m).mean() > 0.85
    # a grid of 18 x 15 x 12 cells: linear interpolation is good to a tenth of the value, at the median
    assert np.nanmedian(np.abs(m - f) / f) < 0.1
    k = int(np.argmin(np.abs(evidence.lobes.theta_i - 30)))
    peak = evidence.lobes.theta_o[k, np.argmax(evidence.lobes.fitted[1, k, :, 0])]
    assert 25 < peak < 40  # on the mirror side, a little beyond the mirror direction


def test_masked_pixels_are_counted_not_black(measured, fits):
    hole = np.array(measured.planes)
    hole[:, 6:9] = -1
    with_hole = gather(table(hole, measured.layout, "stuff"), fits)
    unknown = np.isnan(with_hole.sphere.measured).any(-1)
    assert unknown.sum() > 500
    assert np.isnan(with_hole.sphere.difference[:, unknown]).all()


def test_evidence_survives_its_file(tmp_path, evidence):
    save_evidence(tmp_path, [evidence])
    (back,) = load_evidence(tmp_path)
    assert back.keys == evidence.keys
    assert back.lobes.how == evidence.lobes.how
    assert isinstance(back.sphere.exposure, float)
    np.testing.assert_allclose(back.albedo.fitted, evidence.albedo.fitted, rtol=1e-6)


# --- fits.json


def test_fits_json_is_the_contract(tmp_path, fits):
    path = write_fits(tmp_path, fits, ENVIRONMENT)
    document = json.loads(path.read_text())
    assert {k: document[k] for k in ("format", "version", "environment")} == {
        "format": "brdfit-fits",
        "version": 1,
        "environment": ENVIRONMENT,
    }
    assert document["fits"] == [f.record() for f in fits]
    back, environment = read_fits(tmp_path)
    assert environment == ENVIRONMENT
    assert [f.record() for f in back] == document["fits"]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (None, "no such file"),
        ("", "is empty"),
        ("{", "is not JSON"),
        ("[]", "is not a brdfit fits file"),
        ('{"format": "brdfit-fits", "version": 2}', "has version 2, this brdfit reads 1"),
        ('{"format": "brdfit-fits", "version": 1}', "holds no list of fits"),
        ('{"format": "brdfit-fits", "version": 1, "fits": [{}]}', "fit 0 has no 'parameters'"),
        ('{"format": "brdfit-fits", "version": 1, "fits": [3]}', "fit 0 cannot be read"),
    ],
)
def test_broken_fits_json_is_one_line(tmp_path, text, fault):
    if text is not None:
        (tmp_path / "fits.json").write_text(text)
    with pytest.raises(InputError) as caught:
        read_fits(tmp_path)
    assert fault in str(caught.value)
    assert "fits.json" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_broken_evidence_is_one_line(tmp_path):
    (tmp_path / "evidence.h5").write_bytes(b"not HDF5 at all")
    with pytest.raises(InputError, match="cannot be read as evidence of a fit"):
        load_evidence(tmp_path)


# --- physics


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


def test_f0_of_models_that_have_no_such_parameter():
    n = 2.0
    of = physics.normal_reflectance
    abc = of("abc", {"specular": np.array([1.3, 0.9]), "b": np.array(5.0), "c": np.array(1.0), "ior": np.array(n)})
    np.testing.assert_allclose(abc.value, np.array([1.3, 0.9]) / 9)  # ((2 - 1)/(2 + 1))^2
    sgd = of("sgd", {"specular": np.array([0.5]), "f0": np.array([0.9]), "f1": np.array([0.1])})
    np.testing.assert_allclose(sgd.value, [0.4])
    assert of("ward", {"specular": np.array([0.3])}) is None
    assert of("lambert", {"diffuse": np.array([0.3])}) is None


DISTRIBUTIONS = [
    ("gtr", {"alpha": 0.05, "gamma": 1.3}, lambda s2: (s2 + 0.05**2 * (1 - s2)) ** -1.3),
    ("abc", {"b": 700.0, "c": 1.9}, lambda s2: (1 + 700 * (1 - np.sqrt(1 - s2))) ** -1.9),
    (
        "sgd",
        {"alpha": 0.02, "p": 0.6},
        lambda s2: np.exp(-(0.02 + s2 / (1 - s2) / 0.02)) * (0.02 + s2 / (1 - s2) / 0.02) ** -0.6 / (1 - s2) ** 2,
    ),
    ("ward", {"alpha": 0.1}, lambda s2: np.exp(-s2 / (1 - s2) / 0.01)),
    ("ashikhmin_shirley", {"exponent": 300.0}, lambda s2: (1 - s2) ** 150),
]
"""Models, parameters and their D up to a factor, as MODELS.md writes it, of sin^2(theta_h)."""


@pytest.mark.parametrize(("name", "parameters", "d"), DISTRIBUTIONS, ids=[c[0] for c in DISTRIBUTIONS])
def test_half_width_is_where_d_halves(name, parameters, d):
    width = physics.lobe_width(name, {k: np.array(v) for k, v in parameters.items()})
    assert d(np.sin(width.half_width) ** 2) / d(0.0) == pytest.approx(0.5, rel=1e-9)


def test_no_half_width_no_number():
    assert physics.lobe_width("lambert", {"diffuse": np.array([0.5])}) is None
    assert physics.lobe_width("gtr", {"alpha": np.array(1.5), "gamma": np.array(2.0)}) is None
    assert physics.lobe_width("abc", {"b": np.array(1.0), "c": np.array(0.1)}) is None
    assert physics.lobe_width("ashikhmin_shirley", {"exponent": np.array(0.0)}) is None


def test_equivalents_of_ggx_are_exact():
    width = physics.lobe_width("gtr", {"alpha": np.array(0.3), "gamma": np.array(2.0)})
    assert width.alpha == pytest.approx(0.3)
    assert width.roughness == pytest.approx(math.sqrt(0.3))
    assert width.exponent == pytest.approx(2 / 0.09 - 2)


# --- words and colours


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
    assert references.cite(["ward1992", "ward1992"]) == [references.REFERENCES["ward1992"]]
    assert references.cite(["my own paper, 2026"]) == ["my own paper, 2026"]


def test_references_are_those_of_what_was_used(report):
    text = Reader(report).text
    assert "Measuring and modeling anisotropic reflection" in text  # ward
    assert "Physically-based shading at Disney" in text  # gtr
    assert "Shifted Gamma" not in text  # sgd failed: nothing of it was used
    assert "Perceptual quality of BRDF approximations" in text
