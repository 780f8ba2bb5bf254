"""What a user asks of a fit: names, bounds, fixed values, starts, channels, batches, and reasons in words."""

from __future__ import annotations

import math
from collections.abc import Callable

import brdfit
import equinox as eqx
import jax
import jax.monitoring
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit.data.synthetic import Floor, Missing, Relative, generate, scattered
from brdfit.fitting.batch import fit_many
from brdfit.fitting.losses import check_loss, named_loss
from brdfit.fitting.result import from_record
from brdfit.fitting.spike import spike_warning
from brdfit.models import variants
from brdfit.models.base import BRDF, parameter
from brdfit.models.ward import Ward
from brdfit.tables.table import table as make_table
from jaxtyping import Array, Float

from .report_cases import WARD, failed, fit_of, half_grid, table_of

GRID = (30, 20, 24)
NOISE = (Relative(0.02), Floor(0.0005))


def noisy(name: str = "ward-06", **options):
    return generate(name, **({"grid": GRID, "noise": NOISE} | options))


def test_names_classes_and_instances_are_the_same_fit():
    table, truth = noisy()
    by_name = brdfit.fit(table, "ward")
    by_class = brdfit.fit(table, Ward)
    instance = brdfit.model("ward", **truth["parameters"])
    by_instance = brdfit.fit(table, instance)
    assert by_name.model_name == by_class.model_name == by_instance.model_name == "ward"
    assert by_instance.starts == by_name.starts + 1
    for n, v in by_name.parameters.items():
        np.testing.assert_array_equal(by_class.parameters[n], v)
        # the cost is flat to 1e-9 where they stop
        assert (np.abs(by_instance.parameters[n] - v) < 0.02 * by_name.stderr[n]).all()


def test_the_result():
    table, truth = noisy(noise=[*NOISE, Missing(0.1)])
    fit = brdfit.fit(table, "ward")
    assert fit.converged
    assert fit.reason.startswith("at a minimum")
    assert (
        set(fit.parameters) == set(fit.stderr) == set(fit.spread) == set(fit.covariance) == {"diffuse", "specular", "alpha"}
    )
    for n, v in fit.parameters.items():
        assert v.shape == fit.stderr[n].shape == fit.spread[n].shape == np.shape(truth["parameters"][n])
        np.testing.assert_allclose(np.sqrt(np.diag(fit.covariance[n][n].reshape(v.size, v.size))), fit.stderr[n].ravel())
    assert fit.errors["log"] == pytest.approx(brdfit.evaluate(table, fit.model)["log"], rel=1e-12)
    assert set(fit.seconds) == {"load", "prepare", "compile", "solve"}
    assert fit.cells["used"] < fit.cells["total"]
    assert fit.optima[0].error == pytest.approx(fit.errors["log"], rel=1e-6)
    np.testing.assert_allclose(np.diag(fit.correlation), 1)
    with jax.enable_x64(True):
        f = fit.model(np.array([0.6, 0, 0.8]), np.array([-0.6, 0, 0.8]))
    assert f.shape == (3,)
    assert f.dtype == np.float64


def test_a_fit_and_a_table_print_short():
    fit = fit_of("ward", WARD, 0.02, at_bound=("diffuse[0] = 0 (lower)", "alpha = 30 (upper)"))
    assert repr(fit).splitlines() == [
        "Fit(stuff by ward, converged: at a minimum",
        "    log error 0.01 (fitted), perceptual 0.02",
        "    at a bound: diffuse[0] = 0 (lower) and 1 more)",
    ]
    assert repr(failed()) == "Fit(stuff by sgd, not converged: every start ended at infinite cost)"
    table = table_of(fit.model, half_grid(6, 5, 4))
    masked = 100 * (1 - table.mask.mean())
    assert repr(table).splitlines() == [
        "Table(stuff from stuff.binary",
        f"    isotropic HalfDifferenceGrid 6 x 5 x 4, channels 3, {masked:.1f} % masked)",
    ]


def test_parameters_held_fixed():
    table, _ = noisy()
    fit = brdfit.fit(table, "ward", fixed={"alpha": 0.1, "diffuse": [0.01, 0.02, 0.03]})
    assert fit.converged, fit.reason
    assert fit.parameters["alpha"] == pytest.approx(0.1, rel=1e-15)
    np.testing.assert_array_equal(fit.parameters["diffuse"], [0.01, 0.02, 0.03])
    assert set(fit.fixed) == {"alpha", "diffuse"}
    assert np.isnan(fit.stderr["alpha"])  # held, not certain
    assert np.isnan(fit.stderr["diffuse"]).all()
    assert (fit.stderr["specular"] > 0).all()
    # the rest is at its optimum: moving it either way is worse
    for factor in (0.99, 1.01):
        worse = brdfit.model("ward", **(fit.parameters | {"specular": fit.parameters["specular"] * factor}))
        assert brdfit.evaluate(table, worse)["log"] > fit.errors["log"]


def test_fixed_may_lie_outside_the_search_box():
    table, _ = noisy("sgd-12", noise=())
    fit = brdfit.fit(table, "ward", fixed={"alpha": 40.0})
    assert fit.parameters["alpha"] == pytest.approx(40, rel=1e-14)


def test_everything_held_is_an_evaluation():
    table, truth = noisy()
    fit = brdfit.fit(table, "ward", fixed=truth["parameters"])
    for n, v in truth["parameters"].items():
        np.testing.assert_allclose(fit.parameters[n], v, rtol=1e-15)
    assert fit.errors == pytest.approx(brdfit.evaluate(table, brdfit.model("ward", **truth["parameters"])))


def test_bounds_are_respected_and_reported():
    table, truth = noisy()
    alpha = truth["parameters"]["alpha"]
    fit = brdfit.fit(table, "ward", bounds={"alpha": (2 * alpha, 1.0)})
    assert fit.converged, fit.reason
    assert fit.parameters["alpha"] == pytest.approx(2 * alpha, rel=1e-14)
    assert any(b.startswith("alpha = ") for b in fit.at_bound), fit.at_bound
    assert np.isnan(fit.stderr["alpha"])
    wide = brdfit.fit(table, "ward", bounds={"alpha": (alpha / 2, 2 * alpha)})
    assert wide.at_bound == ()
    assert wide.parameters["alpha"] == pytest.approx(alpha, rel=0.02)


def test_start_is_one_more():
    table, truth = noisy()
    plain = brdfit.fit(table, "ward")
    fit = brdfit.fit(table, "ward", start={"alpha": truth["parameters"]["alpha"]})
    assert fit.starts == plain.starts + 1
    assert fit.errors["log"] <= plain.errors["log"] * (1 + 1e-9)


@pytest.mark.parametrize("channels", [1, 2, 5])
def test_any_number_of_channels(channels):
    table, truth = noisy(channels=channels, noise=())
    fit = brdfit.fit(table, "ward")
    assert fit.parameters["specular"].shape == (channels,)
    for n, v in truth["parameters"].items():
        np.testing.assert_allclose(fit.parameters[n], v, rtol=1e-6)  # noiseless: as in test_recovery.py
    assert fit.model(np.array([0, 0, 1.0]), np.array([0.6, 0, 0.8])).shape == (channels,)


def test_channels_on_their_own():
    """Lambert ties no channels together: each is fitted alone, and comes out as it would in a table of its own."""
    table, _ = noisy("misfit-retro", noise=())
    fit = brdfit.fit(table, "lambert")
    for c in range(3):
        alone = make_table(table.planes[c : c + 1], table.layout, "one")
        single = brdfit.fit(alone, "lambert")
        # both stop where the cost is flat to 1e-9
        assert abs(fit.parameters["diffuse"][c] - single.parameters["diffuse"][0]) < 1e-3 * single.stderr["diffuse"][0]
        assert fit.stderr["diffuse"][c] == pytest.approx(single.stderr["diffuse"][0], rel=1e-6)


def test_scattered_samples_fit():
    layout = scattered(6000, 1)
    for name, model, anisotropic in (("ward-06", "ward", False), ("ward-aniso-03", "ward", None)):
        table, truth = generate(name, grid=layout)
        fit = brdfit.fit(table, model, anisotropic=anisotropic)
        for n, v in truth["parameters"].items():
            np.testing.assert_allclose(fit.parameters[n], v, rtol=1e-6)


def test_an_anisotropic_model_needs_the_azimuth():
    table, _ = noisy()
    with pytest.raises(
        ValueError, match="an anisotropic model needs the azimuth of the half vector, and this table is isotropic"
    ):
        brdfit.fit(table, "ward", anisotropic=True)


@pytest.mark.parametrize(
    ("options", "error", "text"),
    [
        ({"model": "wrad"}, ValueError, r"unknown model 'wrad': did you mean ward\?"),
        ({"model": "minnaert"}, ValueError, "unknown model 'minnaert': choose from gtr, abc"),
        (
            {"loss": lambda p, m, g: jnp.sum(p - m)},
            ValueError,
            r"returns \[\] of values \[n, 3\]: it must return a residual",
        ),
        ({"loss": lambda p, m, g: (p - m) * g.cos_i}, ValueError, r"cannot take values \[n, 3\] and a geometry \[n\]: .*"),
        ({"model": 3}, TypeError, "a model is a name, a brdfit.BRDF or a subclass"),
        ({"loss": "lgo"}, ValueError, "unknown loss 'lgo'"),
        ({"measure": "area"}, ValueError, "unknown measure 'area'"),
        ({"max_angle": 95}, ValueError, "max_angle must lie in"),
        ({"fixed": {"roughness": 1}}, ValueError, "Ward has no parameter 'roughness': it has diffuse, specular, alpha"),
        ({"start": {"roughness": 1}}, ValueError, "Ward has no parameter 'roughness'"),
        ({"bounds": {"roughness": (0, 1)}}, ValueError, "Ward has no parameter 'roughness'"),
        ({"fixed": {"alpha": -1}}, ValueError, r"parameter 'alpha' must lie in \(0, inf\), not -1"),
        ({"fixed": {"alpha": [0.1, 0.2, 0.3]}}, ValueError, r"parameter 'alpha' is a scalar, not of shape \[3\]"),
        ({"start": {"diffuse": [0.1, 0.2]}}, ValueError, r"parameter 'diffuse' is a scalar or 3 values, not of shape \[2\]"),
        ({"bounds": {"alpha": (0.5, 0.1)}}, ValueError, r"bounds of 'alpha'.*0\.5.*0\.1"),
        ({"bounds": {"alpha": (np.nan, 0.1)}}, ValueError, "bounds of 'alpha'"),
    ],
)
def test_wrong_arguments(options, error, text):
    table, _ = generate("ward-06", grid=(4, 4, 4))
    with pytest.raises(error, match=text):
        brdfit.fit(table, **({"model": "ward"} | options))


def test_nothing_to_fit_is_a_result():
    table, _ = generate("ward-06", grid=(6, 5, 4), noise=[Missing(1.0)])
    fit = brdfit.fit(table, "ward")
    assert not fit.converged
    assert fit.reason == "no measured cell has both polar angles within 80 degrees: nothing to fit"
    assert fit.model is None
    assert fit.parameters == {}
    assert fit.cells == {"used": 0, "masked": table.mask.size, "total": table.mask.size}
    assert all(np.isnan(e) for e in fit.errors.values())
    assert fit.record()["errors"]["log"] is None


def traced(run: Callable[[], object]) -> int:
    """Programs compiled while running."""
    count = 0

    def listen(event: str, duration: float, **_: object) -> None:
        nonlocal count
        count += event == "/jax/core/compile/backend_compile_duration"

    jax.monitoring.register_event_duration_secs_listener(listen)
    run()
    seen, count = count, 0
    return seen


def test_a_second_table_of_the_same_shape_compiles_nothing():
    first, second, third = (noisy(seed=s)[0] for s in (1, 2, 3))
    brdfit.fit(first, "ward")
    brdfit.fit(second, "ward", start={"alpha": 0.2})  # one more start, the same programs
    assert traced(lambda: brdfit.fit(third, "ward")) == 0
    assert traced(lambda: brdfit.fit(noisy(name="ward-13", seed=4)[0], "ward")) == 0
    assert brdfit.fit(first, "ward", bounds={"alpha": (0.2, 0.9)}).parameters["alpha"] >= 0.2
    assert traced(lambda: brdfit.fit(second, "ward", bounds={"alpha": (0.1, 0.8), "specular": (0, 1)})) == 0


def test_configuration_stays_as_it_was():
    before = jax.config.jax_enable_x64
    table, _ = noisy()
    fit = brdfit.fit(table, "ward")
    brdfit.evaluate(table, fit.model)
    assert jax.config.jax_enable_x64 == before
    assert not before
    assert fit.parameters["alpha"].dtype == np.float64
    assert (jnp.ones(3) * 2).dtype == jnp.float32
    # and the model that came back works in the precision it is called in
    f = jax.jit(lambda m, a, b: m(a, b))(fit.model, jnp.array([0.6, 0, 0.8]), jnp.array([0.0, 0, 1]))
    assert f.dtype == jnp.float32


def test_preparing_is_told_by_every_fit_that_shares_it():
    table, _ = noisy(seed=9)
    fits = list(brdfit.fit_many(table, ("ward", "lambert")))
    assert fits[0].seconds["prepare"] == fits[1].seconds["prepare"] > 1e-4, "reading 1e5 values takes longer than that"


def test_a_loss_may_ask_for_the_azimuth_where_there_is_one():
    """The form of a loss is checked on a geometry that has all that those of tables have."""
    check_loss(named_loss(lambda p, m, g: (p - m) * sum(g.tangential())[:, None]), 3)


def test_spaces_and_capitals_of_names_do_not_count():
    assert variants("GGX") == variants("ggx")
    assert variants("Microfacet(ggx, smith, schlick, lambert)") == variants("microfacet(ggx,smith,schlick,lambert)")
    assert variants("body + lobe") == variants("body+lobe")


def test_warnings():
    """A lobe between the cells costs a fit nothing, and a published start that does not exist is none."""
    table, _ = noisy()
    plain = brdfit.fit(table, "ward")
    assert plain.warnings == ()
    spike = brdfit.fit(table, "ward", fixed={"alpha": 1e-4, "specular": 1.0}, start="published")
    unknown, narrow = spike.warnings
    assert unknown.startswith("no published fit of this model to this material is known")
    assert "a lobe narrower than the cells" in narrow
    assert narrow.endswith("fit under the loss perceptual or ngan")
    assert spike_warning(1e4, 1.0, "ngan").endswith("fit under the loss perceptual")
    assert spike_warning(math.nan, 1.0, "log") == "its value at normal incidence is nan: do not render with it"
    assert from_record(spike.record()).warnings == spike.warnings


class Cosine(BRDF):
    """A model from outside: a body and a power of the cosine of the half vector, half of it linear."""

    name = "cosine"

    diffuse: Float[Array, " C"] = parameter("body", per_channel=True, linear=True, default=0.1)
    scale: Float[Array, " C"] = parameter("lobe", per_channel=True, linear=True, default=0.1)
    power: Float[Array, ""] = parameter("exponent", search=(0.1, 1e4), default=10.0, log=True)

    def evaluate(self, g):
        return self.diffuse / jnp.pi + self.scale * g.cos_h**self.power


def test_a_model_from_outside():
    truth = Cosine(diffuse=np.array([0.1, 0.2, 0.3]), scale=np.array([1.0, 0.5, 0.2]), power=np.asarray(37.0))
    layout = noisy()[0].layout
    with jax.enable_x64(True):
        values = np.moveaxis(np.asarray(truth(*layout.directions())), -1, 0)
    table = make_table(values, layout, "outside")
    fit = brdfit.fit(table, Cosine)
    assert fit.model_name == "cosine"
    assert isinstance(fit.model, Cosine)
    np.testing.assert_allclose(fit.parameters["power"], 37, rtol=1e-9)
    np.testing.assert_allclose(fit.parameters["scale"], truth.scale, rtol=1e-9)


class Broken(eqx.Module):
    x: float = 1.0


def test_what_is_no_model():
    table, _ = generate("ward-06", grid=(4, 4, 4))
    with pytest.raises(TypeError, match="a model is a name"):
        brdfit.fit(table, Broken())
    with pytest.raises(TypeError, match="evaluate takes a model"):
        brdfit.evaluate(table, "ward")


def test_what_is_no_table():
    for call in (lambda t: brdfit.fit(t, "ward"), lambda t: brdfit.evaluate(t, brdfit.model("lambert", diffuse=0.5))):
        with pytest.raises(TypeError, match=r"a table is what brdfit.load .* not 'nickel.binary'"):
            call("nickel.binary")


def test_scattered_samples_of_which_none_is_above_the_horizon():
    down = np.tile([0.0, 0.6, -0.8], (5, 1))
    fit = brdfit.fit(brdfit.measurements(down, down, np.ones((5, 2))), "ward")
    assert not fit.converged
    assert "nothing to fit" in fit.reason


# --- many ---------------------------------------------------------------------------------------------------------


def test_many_go_on_after_a_broken_file(tmp_path):
    broken = tmp_path / "broken.binary"
    broken.write_bytes(b"nothing")
    tables = [noisy(seed=1)[0], broken, noisy(seed=2)[0]]
    fits = list(fit_many(tables, ["ward", "lambert"]))
    assert len(fits) == 6
    assert sorted(f.model_name for f in fits) == ["lambert"] * 3 + ["ward"] * 3
    bad = [f for f in fits if f.material == "broken"]
    assert len(bad) == 2
    assert all(not f.converged and "broken.binary" in f.reason and f.model is None for f in bad)
    assert all(f.converged for f in fits if f.material != "broken")
    # results come table after table, as each completes
    assert [f.material for f in fits] == ["ward-06"] * 2 + ["broken"] * 2 + ["ward-06"] * 2


def raises(f, m, g):
    raise RuntimeError("out of luck\nentirely")


def test_many_make_a_result_of_an_exception():
    (fit,) = fit_many([noisy()[0]], ["ward"], loss=raises)
    assert not fit.converged
    assert fit.reason.endswith("cannot take values [n, 3] and a geometry [n]: RuntimeError: out of luck entirely")
    assert fit.loss == "raises"


@pytest.mark.parametrize("options", [{"models": ["wrad"]}, {"models": ["ward"], "loss": "lgo"}])
def test_many_refuse_wrong_names_before_the_first_fit(options):
    def tables():
        raise AssertionError("a table was asked for")
        yield

    with pytest.raises(ValueError, match="unknown"):
        fit_many(tables(), **options)


def test_many_are_lazy():
    asked = []

    def tables():
        for seed in range(3):
            asked.append(seed)
            yield noisy(seed=seed)[0]

    results = fit_many(tables(), ["lambert"])
    next(results)
    assert asked == [0]
    results.close()
