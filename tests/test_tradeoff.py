"""What accuracy costs: that the measurements measure what they say, and that the advice follows from them."""

import json
import math
from dataclasses import replace

import brdfit
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit import cli, models
from brdfit.angles import unit_vectors
from brdfit.fitting import Effort, spike
from brdfit.geometry import from_directions
from brdfit.models import ndf, parameter_values
from brdfit.models.masking.smith import NODES, REACH, averted_area
from brdfit.quadrature import smith_kernel
from brdfit.stability import oracle
from brdfit.tabulated import read, tabulate
from brdfit.tradeoff import advice, approximations, page, rendering, sample, settings, smith, survey, timing
from brdfit.tradeoff.evaluation import Evaluation, Operations, direct
from brdfit.tradeoff.exchange import COUNTERPART, FRESNELS, MASKINGS, PARTS, exchanged
from brdfit.tradeoff.pareto import front
from brdfit.tradeoff.timing import Timing

from .report_cases import Reader, fit_of

MICROFACET = {
    "gtr": {"diffuse": [0.1, 0.05, 0.02], "specular": [0.9, 0.5, 0.04], "alpha": 0.15, "gamma": 1.7},
    "abc": {"diffuse": 0.1, "specular": [0.9, 0.8, 0.7], "b": 900.0, "c": 1.1, "ior": 1.6},
    "sgd": {"diffuse": 0.1, "specular": 0.5, "alpha": [0.02, 0.1, 0.4], "p": [0.2, 0.8, 1.3], "f0": 0.1, "f1": 0.01},
}


def sampled(count=400, seed=0):
    rng = np.random.default_rng(seed)
    wi, wo = (unit_vectors(rng.uniform(0, np.radians(79.9), count), rng.uniform(0, 2 * np.pi, count)) for _ in range(2))
    return sample.Sample(wi, wo, rng.uniform(0, 1, (count, 3)), 80.0)


def took(seconds, width=0.0):
    return Timing(seconds, seconds * (1 - width), seconds * (1 + width), 5)


# ---- the front


@pytest.mark.parametrize(
    ("points", "kept"),
    [
        ([], []),
        ([(1, 1)], [0]),
        ([(1, 3), (2, 2), (3, 1)], [0, 1, 2]),
        ([(3, 1), (1, 3), (2, 4), (2, 3)], [1, 0]),  # no better than a cheaper one: left out
        ([(1, 2), (1, 1), (2, 1)], [1]),
        ([(1, 1), (1, 1)], [0]),
        ([(1, math.nan), (2, 1), (math.nan, 0)], [1]),
    ],
)
def test_front(points, kept):
    assert front(points) == kept


def test_front_is_not_dominated():
    points = [tuple(p) for p in np.random.default_rng(3).uniform(0, 1, (200, 2))]
    kept = front(points)
    for i, (c, e) in enumerate(points):
        beaten = any(points[k][0] <= c and points[k][1] <= e and points[k] != (c, e) for k in kept)
        assert beaten != (i in kept)


# ---- timing


def test_calls_take_turns(monkeypatch):
    now, log = [0.0], []
    monkeypatch.setattr(timing.time, "perf_counter", lambda: now[0])

    def call(name, seconds):
        log.append(name)
        now[0] += seconds

    result = timing.interleaved({"a": lambda: call("a", 1.0), "b": lambda: call("b", 3.0)}, repeats=4, budget=1e9)
    assert "".join(log) == "aabb" + "ab" * 4
    assert result == {"a": Timing(1.0, 1.0, 1.0, 4), "b": Timing(3.0, 3.0, 3.0, 4)}
    short = timing.interleaved({"a": lambda: call("a", 1.0)}, repeats=9, budget=4.5)
    assert short["a"].repeats == 3, "three rounds at least, and none that begins beyond the budget"
    quick = timing.interleaved({"a": lambda: call("a", timing.SHORTEST / 10)}, repeats=3, budget=1e9)
    assert quick["a"].median == pytest.approx(timing.SHORTEST / 10), "of one call, though ten are made in a row"


def test_timing_is_a_median_with_quartiles():
    t = Timing.of([5.0, 1.0, 2.0, 4.0, 3.0])
    assert t == Timing(3.0, 2.0, 4.0, 5)
    assert t.per(2) == Timing(1.5, 1.0, 2.0, 5)


# ---- models with other parts


@pytest.mark.parametrize("name", MICROFACET)
def test_nothing_exchanged_is_the_model(name):
    m, s = models.model(name, **MICROFACET[name]), sampled()
    same = exchanged(type(m))(**parameter_values(m))
    with jax.enable_x64(True):
        np.testing.assert_allclose(same(s.wi, s.wo), m(s.wi, s.wo), rtol=1e-14)  # a few roundings


@pytest.mark.parametrize("name", MICROFACET)
def test_masking_never_adds_light(name):
    m, s = models.model(name, **MICROFACET[name]), sampled()
    with jax.enable_x64(True):
        f = {
            k: np.asarray(exchanged(type(m), masking=v.visibility)(**parameter_values(m))(s.wi, s.wo))
            for k, v in MASKINGS.items()
        }
    for form in ("Smith, height-correlated", "Smith, separable", "V-cavity"):
        assert (f[form] <= f["none"] * (1 + 1e-12)).all()
        assert (f[form] < f["none"]).any()
    assert (f["Smith, separable"] <= f["Smith, height-correlated"] * (1 + 1e-12)).all()  # Heitz 2014, section 6.3


@pytest.mark.parametrize("cls", FRESNELS)
def test_fresnel_terms_agree_at_normal_incidence_and_only_there(cls):
    m = models.build(cls, MICROFACET[cls.name])
    one = jax.tree.map(lambda x: jnp.asarray(np.ravel(x)[0]), m)
    with jax.enable_x64(True):
        theta = np.radians([0.0, 60.0])
        g = from_directions(unit_vectors(theta, 0.0), unit_vectors(theta, np.pi))
        own, other = (np.asarray(f(one, g)) for f in FRESNELS[cls].values())
    assert own[0] == pytest.approx(other[0], rel=1e-7)  # float32 in one of them would show
    assert abs(own[1] / other[1] - 1) > 1e-3


# ---- Smith's integral


def test_rules_against_forty_digits():
    """The reference of the page, and Gauss-Legendre in t, against a transcription of another form of the integral."""
    alpha, gamma = 0.15, 1.7
    for angle in (20.0, 60.0, 79.0):
        cosine = math.cos(math.radians(angle))
        want = float(oracle.gtr_masking(alpha, gamma, cosine))
        with jax.enable_x64(True):
            lobe, at = ndf.GTR(jnp.asarray(alpha), jnp.asarray(gamma)), jnp.asarray(cosine)
            for rule in (smith_kernel(smith.REFERENCE, REACH), smith.plain(64)):
                got = cosine / (cosine + float(averted_area(lobe, at, rule)))
                assert got == pytest.approx(want, rel=2e-11)  # what the panels of the transcription are good to


@pytest.mark.parametrize("name", ["gtr", "sgd"])
def test_masking_from_a_table(name):
    m, s = models.model(name, **MICROFACET[name]), sampled()
    got = Evaluation(read, tabulate(m), s, "float64").values()
    np.testing.assert_allclose(
        got, Evaluation(direct, m, s, "float64").values(), rtol=1e-8
    )  # 5e-9 for each direction (polar.py)


# ---- evaluation


def test_the_compilers_account():
    s = sampled(1000)
    lambert = Evaluation(direct, models.model("lambert", diffuse=0.3), s)
    gtr = Evaluation(direct, models.model("gtr", **MICROFACET["gtr"]), s)
    np.testing.assert_allclose(lambert.values(), 0.3 / np.pi, rtol=1e-6)
    assert 0 < lambert.operations().flops < 20
    assert gtr.operations().flops > 2 * NODES, "the integral has so many nodes for light and viewer"
    assert gtr.operations().transcendentals > 2 * NODES


def test_sample_estimates_the_error_of_the_table(small_table):
    table, _ = small_table
    m = models.model("lambert", diffuse=[0.2, 0.3, 0.4])
    drawn = sample.draw(table, 80.0, "solid_angle")
    with jax.enable_x64(True):
        values = np.asarray(m(drawn.wi, drawn.wo))
    whole = brdfit.evaluate(table, m)
    for loss in ("log", "perceptual"):
        assert drawn.error(values, loss) == pytest.approx(whole[loss], rel=0.1)  # 8192 draws; the peak is in few of them
    empty = replace(table, mask=np.zeros_like(table.mask))
    with pytest.raises(brdfit.InputError, match="no measured cell has both polar angles within 80 degrees; choose a larger"):
        sample.draw(empty, 80.0, "solid_angle")


# ---- settings


@pytest.fixture(scope="module")
def measured():
    from brdfit.data import synthetic

    table = synthetic.generate("misfit-two-lobes", grid=(24, 24, 36))[0]
    best = brdfit.fit(table, "ward")
    choices = (
        settings.Choice("default", "default", Effort()),
        settings.Choice("tolerance", "loose", Effort(rtol=1e-1)),
        settings.Choice("nodes", "3 nodes", Effort(path="compressed", nodes=3)),
        settings.Choice("cells", "every cell", Effort(path="exact")),
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(settings, "ROUNDS", 1)
        optimum, found = settings.settings(table, best, 1e9, choices)
    return best, optimum, {s.label: s for s in found}


def test_settings_are_measured_against_the_optimum_of_all_cells(measured):
    best, optimum, found = measured
    assert optimum.path == "exact"
    assert optimum.errors["log"] <= best.errors["log"] * (1 + 1e-9)
    assert found["every cell"].path == "exact"
    assert found["every cell"].standard_errors < 1e-2
    assert found["every cell"].excess < 1e-8  # rtol of the search
    assert found["3 nodes"].path == "compressed"
    assert found["3 nodes"].standard_errors > 3 * found["every cell"].standard_errors
    for s in found.values():
        assert s.excess > -1e-9
        assert s.seconds.repeats == 1, "in one round"
        assert s.seconds.median == pytest.approx(s.solve.median + s.prepare.median)
        assert s.errors["log"] >= optimum.errors["log"] * (1 - 1e-9)
    assert found["default"].prepare == found["loose"].prepare, "settings of one preparation share it"


def test_settings_are_repeated_while_there_is_time(monkeypatch, small_table):
    from .report_cases import WARD, fit_of

    now, log = [0.0], []
    monkeypatch.setattr(settings.time, "perf_counter", lambda: now[0])

    def fit(table, model, effort, **options):
        took = 10.0 if effort.path == "exact" else 1.0
        now[0] += took
        log.append(effort.nodes)
        return fit_of("ward", WARD, 0.1, seconds={"load": 0.0, "prepare": 0.5, "compile": 0.0, "solve": took})

    monkeypatch.setattr(settings, "fit", fit)
    choices = (
        settings.Choice("default", "default", Effort()),
        settings.Choice("nodes", "3 nodes", Effort(path="compressed", nodes=3)),
        settings.Choice("cells", "every cell", Effort(path="exact", nodes=99)),
    )
    best = fit_of("ward", WARD, 0.1)
    monkeypatch.setattr(settings, "LEAST", 5.0)
    _, found = settings.settings(small_table[0], best, 18.0, choices)
    assert log[:7] == [10, 3, 99, 10, 3, 10, 3], "in turns, and what takes too long is not repeated"
    assert [s.seconds.repeats for s in found] == [3, 3, 1]
    assert [s.seconds.median for s in found] == [1.5, 1.5, 10.5]
    monkeypatch.setattr(settings, "LEAST", 11.0)
    _, found = settings.settings(small_table[0], best, 11.5, choices)
    assert [s.seconds.repeats for s in found] == [6, 5, 1], "11 seconds after the first round, whatever that took"
    _, found = settings.settings(small_table[0], best, 0.5, choices)
    assert [s.label for s in found] == ["default"], "no time for the others"


def test_errors_of_parameters():
    from .report_cases import GGX, fit_of

    optimum = fit_of("gtr", GGX, 0.01)  # standard errors are 1e-4 of a value, spreads 1e-2
    moved = fit_of("gtr", {**GGX, "alpha": 0.2 * 1.003}, 0.01)
    relative, standard, spread = settings._distance(moved, optimum)
    assert (relative, standard, spread) == pytest.approx((0.003, 30, 0.3))
    unknown = replace(optimum, stderr={**optimum.stderr, "alpha": np.asarray(np.nan)})
    assert settings._distance(moved, unknown)[:2] == (0, 0), "what the data do not determine does not count"


# ---- advice


def setting(label, seconds, standard, relative, family="nodes", **effort):
    t = took(seconds)
    return settings.Setting(family, label, Effort(**effort), t, t, t, "compressed", relative, standard, 0.0, 0.0, {})


def test_settings_advice():
    class Optimum:
        model_name = "abc"

    default = setting("default", 0.4, 0.01, 1e-5, "default")
    quick, rough = setting("quick", 0.2, 0.05, 1e-4), setting("rough", 0.1, 3.0, 5e-3)
    exact = setting("every cell", 2.0, 1e-4, 1e-6, "cells", path="exact")
    said = advice.settings_advice([default, quick, rough, exact], Optimum())
    assert "default settings takes 400 ms" in said
    assert "every cell: 2.00 s" in said
    assert "quick takes 200 ms and stays within 0.1 standard errors" in said
    assert "rough takes 100 ms" in said
    assert "nothing that stays within 0.1 is clearly faster" in advice.settings_advice([default, exact], Optimum())
    assert "no setting stays within 0.1" in advice.settings_advice([rough], Optimum())
    assert "could be fitted" in advice.settings_advice([], None)


def drawn(label, seconds, error):
    t = took(seconds * 1e-9, 0.1)
    return rendering.Rendering(label, label, "", 5, t, t, Operations(1, 1, 1), {"perceptual": error, "log": error}, 0.0)


@pytest.mark.parametrize(
    ("renderings", "words"),
    [
        (
            [drawn("a", 10, 0.05), drawn("b", 100, 0.02)],
            "Render with b: 100 ns a direction for a perceptual error of 0.0200",
        ),
        (
            [drawn("a", 10, 0.05), drawn("b", 100, 0.02)],
            "no dearer model is better on this material, and a is 10 times as fast",
        ),
        ([drawn("a", 10, 0.021), drawn("b", 100, 0.02)], "Render with a: 10 ns a direction"),  # as good within a tenth
        ([drawn("a", 10, 0.009), drawn("b", 11, 0.005)], "Render with b"),  # nearly as fast, and so much better
        ([drawn("a", 10, 0.009), drawn("b", 100, 0.002)], "which hardly anyone sees; b has 77.8 % less error for 10 times"),
        ([], "none can be rendered"),
    ],
)
def test_rendering_advice(renderings, words):
    assert words in advice.rendering_advice(renderings)


def form(name, own, seconds, error, flops=100.0):
    both = {"log": error, "perceptual": error}
    t, operations = took(seconds * 1e-9, 0.1), Operations(flops, 0.0, 0.0)
    return approximations.Approximation("masking", "gtr", name, own, t, operations, 0.0, 0.02, both, both)


@pytest.mark.parametrize(
    ("seconds", "flops", "error", "words"),
    [
        (
            *(10, 50, 0.0105),
            "In gtr take V-cavity masking, not Smith masking: to the eye about as good, with fewer operations; V-cavity "
            "masking is 10 times as fast (\u221250.0 % operations)",
        ),
        (
            10,
            50,
            0.0120,
            "In gtr keep Smith masking, not V-cavity masking: the perceptual error is larger; V-cavity masking is 10 times",
        ),
        (
            *(100, 95, 0.0101),
            "keep Smith masking, not V-cavity masking: to the eye about as good, and not clearly cheaper; "
            "V-cavity masking takes the same time as far as can be told (\u22125.0 % operations), moves 1 value in 100 by "
            "more than 2.0 % and, fitted again, changes the error by +1.0 %",
        ),
        (
            300,
            300,
            0.0080,
            "take V-cavity masking, not Smith masking: the perceptual error is smaller; V-cavity masking takes 3.0 times",
        ),
    ],
)
def test_masking_advice(seconds, flops, error, words):
    own = form("Smith, height-correlated", True, 100, 0.01)
    other = form("V-cavity", False, seconds, error, flops)
    assert words in advice.masking_advice([own, other])
    assert "keep Smith masking: no fit with V-cavity" in advice.masking_advice([own, replace(other, refitted={})])


@pytest.mark.parametrize("seconds", [10, 70, 100, 140, 1000])
def test_no_time_decides(seconds):
    """What a busy moment does to a time changes no verdict: of the operations there are a tenth more, or half."""
    own = form("Smith, height-correlated", True, 100, 0.01)
    for flops, verdict, never in ((110, "keep", "as fast"), (50, "take", "times the time")):
        said = advice.masking_advice([own, form("V-cavity", False, seconds, 0.01, flops)])
        assert f"In gtr {verdict} " in said
        assert never not in said


def test_a_spike_is_no_advice(small_table):
    table, _ = small_table
    largest = spike.largest_value(table)
    best = brdfit.fit(table, "ward").model
    assert not spike.is_spike(best, largest)
    narrow = models.model("gtr", diffuse=[0.1] * 3, specular=[0.5] * 3, alpha=1e-4, gamma=2.0)
    assert spike.is_spike(narrow, largest)
    assert "Left out: gtr and abc, fitted with a lobe that is a spike" in advice.without_spikes("Take it.", ["gtr", "abc"])
    assert advice.without_spikes("Take it.", []) == "Take it."


def test_nothing_is_unseen_where_that_was_not_measured():
    both = [drawn("a", 10, 0.009), drawn("b", 100, 0.002)]
    assert "hardly anyone sees" in advice.rendering_advice(both)
    said = advice.rendering_advice(both, seen=0.0)
    assert "Render with b" in said
    assert "hardly anyone sees" not in said


def test_every_form_has_a_counterpart():
    own = {*(p.masking for p in PARTS.values()), *(next(iter(f)) for f in FRESNELS.values())}
    assert own <= set(COUNTERPART)
    assert set(COUNTERPART.values()) <= {*MASKINGS, *(k for f in FRESNELS.values() for k in f)}


# ---- the command


@pytest.fixture
def quick(monkeypatch):
    """Few directions and settings, and one model besides the one that is asked about."""
    monkeypatch.setattr(survey, "MODELS", ("gtr",))
    monkeypatch.setattr(settings, "ROUNDS", 2)
    monkeypatch.setattr(survey, "WHOLE", 1e9)
    monkeypatch.setattr(sample, "COUNT", 64)
    monkeypatch.setattr(smith, "FEW", 32)
    monkeypatch.setattr(smith, "COUNTS", (8, NODES))
    monkeypatch.setattr(smith, "PLAIN_COUNTS", (8,))
    chosen = (settings.CHOICES[0], settings.Choice("nodes", "3 nodes", Effort(path="compressed", nodes=3)))
    monkeypatch.setattr(settings.settings, "__defaults__", (chosen,))


def test_models_with_tables_are_timed_with_them(monkeypatch):
    """Whatever their name: Smith's integral read from its table is what one renders with."""
    monkeypatch.setattr(rendering, "BUDGET", 0.0)
    model = models.model("epd", diffuse=0.1, specular=[0.9, 0.5, 0.4], alpha=0.2, p=0.8)
    fit = fit_of("epd", {n: np.asarray(v) for n, v in parameter_values(model).items()}, 0.1)
    drawn = rendering.renderings([fit], sampled(64))
    assert [(r.label, r.masking) for r in drawn] == [("epd", "integral"), ("epd, table", "table")]
    assert drawn[1].operations.flops < drawn[0].operations.flops
    assert max(r.deviation for r in drawn) < 1e-3  # float32


def test_command(small_file, tmp_path, quick, capfd):
    out = tmp_path / "deep" / "out"
    assert cli.run(["tradeoff", str(small_file), "--out", str(out), "--model", " Ward,"]) == 0
    said = capfd.readouterr()
    assert said.out == f"tradeoff: {out / 'tradeoff.html'}\n"
    assert [line.split("] ")[1].split(":")[0] for line in said.err.splitlines()][2:] == [
        "rendering",
        "quadrature",
        "fresnel",
        "masking",
        "settings",
    ]
    assert {p.name for p in out.iterdir()} == {"tradeoff.html", "tradeoff.json"}

    document = json.loads((out / "tradeoff.json").read_text())
    assert (document["format"], document["version"], document["material"]) == ("brdfit-tradeoff", 1, "stuff")
    assert {"jax", "device", "when"} <= set(document["environment"])
    assert document["optimum"]["model"] == "ward"
    assert [r["label"] for r in document["renderings"]] == ["gtr", "gtr, table", "ward"]
    assert [s["label"] for s in document["settings"]] == ["default", "3 nodes"]
    for kind in ("settings", "renderings", "quadratures", "fresnel", "masking"):
        for record in document[kind]:
            t = record["seconds"]
            assert 0 < t["low"] <= t["median"] <= t["high"]
            assert t["repeats"] >= (1 if kind == "settings" else 2)
    eight = {q["rule"]: q["largest"] for q in document["quadratures"] if q["nodes"] == 8}
    assert eight["even in u"] > 1e-4 > 1e-6 > document["quadratures"][1]["largest"]

    html = (out / "tradeoff.html").read_text()
    reader = Reader(html)
    assert not reader.open
    for sentence in document["advice"].values():
        assert sentence.endswith(".")
        assert " ".join(sentence.split()) in reader.text
    assert html.count("<svg") == 5
    assert "src=" not in html.replace('src="data:', "")
    assert "href=" not in html.replace("xlink:href=", "").replace('href="#', "")


def test_wrong_use_is_one_line_and_nothing_is_written(small_file, tmp_path, capfd):
    for arguments, words in (
        ([str(small_file), "--model", "minnaert"], "unknown model 'minnaert': choose from gtr"),
        ([str(small_file), "--model", "gtr,phong"], "--model takes one model here"),
        ([str(small_file), "--loss", "l2"], "unknown loss 'l2'"),
        ([str(tmp_path / "none.binary")], "no such file"),
    ):
        assert cli.run(["tradeoff", *arguments, "--out", str(tmp_path / "out")]) == 2
        said = capfd.readouterr()
        assert words in said.err
        assert said.err.count("\n") == 1
        assert not (tmp_path / "out" / page.PAGE).exists()


def test_a_model_that_fails_is_said_and_the_rest_goes_on(small_file, tmp_path, quick, monkeypatch, capfd):
    from brdfit.fitting import batch

    def fit(table, model, **options):
        if model == "gtr":
            raise FloatingPointError("out of luck")
        return brdfit.fit(table, model, **options)

    monkeypatch.setattr(batch, "fit", fit)
    assert cli.run(["tradeoff", str(small_file), "--out", str(tmp_path), "--model", "ward"]) == 1
    capfd.readouterr()
    text = Reader((tmp_path / "tradeoff.html").read_text()).text
    assert "out of luck" in text
    assert "No model with Smith's integral could be fitted." in text
    assert "Render with ward" in text
