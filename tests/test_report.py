"""The page of a report: what it says is what the fits hold, and what cannot be shown is said."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from brdfit.reports import words
from brdfit.reports.evidence import Evidence, Published
from brdfit.reports.gather import fit_key, gather
from brdfit.reports.write import rebuild_report, write_fits, write_report

from .report_cases import ENVIRONMENT, GGX, WARD, Reader, failed, fit_of, half_grid, table_of


def test_headline_names_the_best_and_what_its_error_means(report):
    text = Reader(report).text
    assert "Best of three for stuff: gtr. Perceptual error 0.0012: hardly anyone sees a difference." in text
    assert "Next is ward with 0.033" in text
    assert "Failed or not converged: sgd." in text


@pytest.mark.parametrize("changes", [{"measure": "cells"}, {"measure": "scene office"}])
def test_no_word_for_an_error_that_was_measured_otherwise(tmp_path, changes):
    fits = [fit_of("ward", WARD, 0.0333, **changes), fit_of("gtr", GGX, 0.00123, **changes)]
    html = write_report(tmp_path, fits, [], {}).read_text()
    text = Reader(html).text
    assert "Perceptual error 0.0012 (no word:" in text
    assert "Next is ward with 0.033." in text
    assert not any(said in text for _, said in words.GRADES)
    assert not re.search(r'class="[^"]*heat\d', html)


def test_no_word_for_what_is_nearly_black(tmp_path, fits, evidence):
    """Under a thousandth of the light every error is small and says nothing."""
    shown = evidence.albedo
    dark = replace(evidence, albedo=replace(shown, measured=shown.measured * 1e-4), lobes=None, maps=None, sphere=None)
    text = Reader(write_report(tmp_path, fits, [dark], {}).read_text()).text
    assert re.search(r"Perceptual error 0.0012 \(no word: nearly black, 0.00\d+ % of the light is returned\)", text)
    assert "Dashed" not in text


def test_fits_without_a_perceptual_error_did_not_fail(tmp_path):
    """Those made with ``errors="rows"`` under another loss."""
    fits = [fit_of("ward", WARD, 0.1, errors={"log": 0.1, "perceptual": math.nan}), failed()]
    text = Reader(write_report(tmp_path, fits, [], {}).read_text()).text
    assert "Fits to stuff without a perceptual error to rank them." in text
    assert "perceptual error not asked for" in text
    assert "failed: every start ended at infinite cost" in text
    assert "failed: at a minimum" not in text


def test_sphere_and_ranking_that_disagree_are_said(tmp_path, fits, evidence):
    """The ranking has gtr before ward."""
    off = evidence.sphere.difference.copy()
    rows = {f.model_name: evidence.keys.index(fit_key(f)) for f in fits[:2]}
    for ward, gtr, said in ((9.8, 13.0, True), (13.0, 9.8, False), (0.3, 0.4, False)):
        off[rows["ward"]], off[rows["gtr"]] = ward, gtr
        sphere = replace(evidence.sphere, difference=off)
        alone = replace(evidence, sphere=sphere, lobes=None, maps=None, albedo=None)
        text = Reader(write_report(tmp_path, fits, [alone], {}).read_text()).text
        assert ("On the sphere below ward comes closest to the material (mean CIEDE2000 9.8; gtr 13)" in text) == said


@pytest.mark.parametrize(
    ("log", "perceptual", "said"), [(0.02, 0.02, True), (0.01, 0.02, False), (0.02, 0.04, False)], ids=str
)
def test_a_published_fit_that_wins_where_it_ranks_is_said(tmp_path, log, perceptual, said):
    fit = fit_of("ward", WARD, 0.03)  # 0.015 by log
    other = Published("someone", "ward1992", {"log": log, "perceptual": perceptual})
    beside = Evidence("stuff", fit.source, fit.sha256, (fit_key(fit),), ("R", "G", "B"), published={fit_key(fit): other})
    text = Reader(write_report(tmp_path, [fit], [beside], {}).read_text()).text
    assert "beside the published fit" in text
    assert ("fit by it: --loss perceptual" in text) == said


def test_an_error_bar_beyond_its_value_is_said(tmp_path):
    fit = fit_of("ward", WARD, 0.02)
    fit.spread["specular"][1] = 1.2
    fit.spread["alpha"] = np.asarray(0.19)
    text = Reader(write_report(tmp_path, [fit], [], {}).read_text()).text
    assert "Not determined by these data, with error bars beyond the values themselves: specular G (0.2 ± 1.2)." in text


def test_the_form_limits_only_what_is_clear_of_the_noise(tmp_path):
    alike = fit_of("ward", WARD, 0.02)
    alike.spread.update({n: 1.5 * v for n, v in alike.stderr.items()})
    text = Reader(write_report(tmp_path, [alike], [], {}).read_text()).text
    assert "no sign that the form of the model limits these numbers" in text
    assert "what limits these numbers is the form" not in text


def test_marks_of_cross_references_are_no_text(tmp_path):
    from brdfit.models import MODELS, build, parameters_of

    cls = MODELS["ward"][1]
    values = {p.name: np.asarray(p.default) for p in parameters_of(cls)}
    fit = replace(fit_of("ward", WARD, 0.1), model=build(cls, values), parameters=values, stderr={}, spread={}, labels=())
    text = Reader(write_report(tmp_path, [fit], [], {}).read_text()).text
    assert ":class:" in cls.__doc__.split("\n\n")[0]
    assert ":class:" not in text
    assert "`" not in text


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
    assert "compile 1.00 s, solve 500 ms" in text
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
    assert "nothing that is a reflectance" in text  # ward


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


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"path": "compressed", "passes": 1},
            "no parameter would move by more than 0.02 standard errors (compressed search, 1 pass over the table).",
        ),
        (
            {"path": "exact", "shift": 0.5},
            "no parameter would move by more than 0.5 standard errors (search that ended on every cell, 10 passes over the "
            "table).",
        ),
        ({"shift": 1e-7}, "no parameter would move by more than 0.001 standard errors"),
        ({"shift": math.inf}, "how far the parameters would move cannot be said"),
    ],
)
def test_what_the_whole_table_says_of_the_optimum(tmp_path, changes, said):
    text = Reader(write_report(tmp_path, [fit_of("ward", WARD, 0.1, **changes)], [], {}).read_text()).text
    assert text.count(f"Every cell asked once more: {said}") == 1


def test_a_fit_of_nothing_asked_no_cell(tmp_path):
    assert "asked once more" not in write_report(tmp_path, [failed()], [], {}).read_text()


@pytest.mark.parametrize(
    ("sources", "titles"),
    [
        (("a/x.binary", "b/x.binary"), ("x (a/x.binary)", "x (b/x.binary)")),
        (("x.binary", "b/x.binary"), ("x (x.binary)", "x (b/x.binary)")),
        (("r/1/s/x.binary", "r/2/s/x.binary", "q/x.h5"), ("x (1/s/x.binary)", "x (2/s/x.binary)", "x (x.h5)")),
        (("a/x.binary", "a/x.binary"), ("x (a/x.binary, 000000)", "x (a/x.binary, 111111)")),
        (("", ""), ("x (000000)", "x (111111)")),
    ],
)
def test_materials_of_one_name_are_told_apart(tmp_path, sources, titles):
    same = [fit_of("ward", WARD, 0.1, "x", source=s, sha256=str(k) * 64) for k, s in enumerate(sources)]
    page = write_report(tmp_path, [*same, fit_of("ward", WARD, 0.1, "velvet")], [], {}).read_text()
    headings = re.findall(r"<h2>(.*?)</h2>", page)
    assert headings[1:-2] == [*titles, "velvet"]
    assert re.findall(r'<th scope="row"><a href="#m\d[^>]*>(.*?)</a>', page) == [*titles, "velvet"]


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


def test_references_are_those_of_what_was_used(report):
    text = Reader(report).text
    assert "Measuring and modeling anisotropic reflection" in text  # ward
    assert "Physically-based shading at Disney" in text  # gtr
    assert "Shifted Gamma" not in text  # sgd failed: nothing of it was used
    assert "Perceptual quality of BRDF approximations" in text
