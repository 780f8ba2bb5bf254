"""Blocks of microfacet models against 40 digits, and the models that any choice of them makes."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from itertools import product
from typing import Any

import brdfit
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit import models
from brdfit.data.synthetic.layouts import grid
from brdfit.fitting.result import from_record
from brdfit.geometry import from_directions
from brdfit.models import blocks, fresnel, masking, ndf, parameters_of
from brdfit.stability import microfacets as oracle
from brdfit.stability.oracle import DIGITS, dielectric, mp, mpf, schlick

from .cases import WI, WO
from .report_cases import table_of
from .test_energy import albedo

GEOMETRY_CASES = range(0, len(WI), 3)


def by_oracle(f: Callable[..., Any], *columns: np.ndarray) -> np.ndarray:
    """40-digit values of rows of numbers."""
    with mp.workdps(DIGITS):
        return np.array([float(f(*(mpf(float(x)) for x in row))) for row in zip(*map(np.ravel, columns), strict=True)])


def points(*axes: Any) -> list[np.ndarray]:
    return [x.ravel() for x in np.meshgrid(*axes, indexing="ij")]


COSINES = np.sin(np.pi / 2 - np.radians([1e-4, 5.0, 30.0, 60.0, 80.0, 89.0, 89.995]))


@pytest.mark.parametrize(
    ("cls", "parameters", "exact"),
    [
        (ndf.GGX, [np.array([1e-9, 1e-3, 0.3, 1.0, 10.0])], oracle.ggx_lambda),
        (ndf.Beckmann, [np.array([1e-4, 1e-2, 0.3, 1.0, 30.0])], oracle.beckmann_lambda),
        (ndf.StudentT, [np.array([1e-4, 0.3, 10.0]), np.array([1.52, 1.8, 2.0, 5.0, 100.0])], oracle.student_t_lambda),
    ],
)
def test_own_masking(cls: type, parameters: list[np.ndarray], exact: Any):
    """Lambda of the closed forms: 1 + Lambda to a few roundings, up to 89.995 degrees."""
    *shape, cosine = points(*parameters, COSINES)
    with jax.enable_x64(True):
        f = jax.jit(jax.vmap(lambda p, c: masking.smith_lambda(cls(*p), c)))
        got = np.asarray(f([jnp.asarray(x) for x in shape], jnp.asarray(cosine)))
        bend = jax.jit(jax.grad(jax.grad(lambda c, p: masking.averted_area(cls(*p), c))))
        assert np.isfinite(bend(jnp.asarray(1.0), [jnp.asarray(x[0]) for x in shape]))
    np.testing.assert_allclose(1 + got, 1 + by_oracle(exact, *shape, cosine), rtol=1e-13)


def test_own_masking_is_the_integral():
    """The closed forms against the rule that serves every distribution, where that is good to 1e-9."""
    for cls, *shape in ((ndf.GGX, 0.3), (ndf.Beckmann, 0.3), (ndf.StudentT, 0.3, 4.0)):
        with jax.enable_x64(True):
            lobe = cls(*map(jnp.asarray, shape))
            own = masking.averted_area(lobe, jnp.asarray(COSINES))
            rule = masking.averted_area(lambda s2, c2, lobe=lobe: lobe(s2, c2), jnp.asarray(COSINES))
        np.testing.assert_allclose(COSINES + np.asarray(own), COSINES + np.asarray(rule), rtol=1e-9)


def test_approximate_masking():
    """G = 4 n.l n.v V of each approximation as printed; Hammon's is 1 for alpha = 0."""
    light, viewer = WI[GEOMETRY_CASES], WO[GEOMETRY_CASES]
    over = 4 * light[:, 2] * viewer[:, 2]
    with jax.enable_x64(True):
        g = from_directions(light, viewer)
        for alpha in (0.0, 0.05, 0.5, 1.0):
            a = jnp.asarray(alpha)
            columns = np.full(len(light), alpha), light[:, 2], viewer[:, 2]
            hammon = by_oracle(lambda a, x, y: oracle.hammon(a, [0, 0, x], [0, 0, y]), *columns)
            karis = by_oracle(lambda a, x, y: oracle.schlick_smith(a, [0, 0, x], [0, 0, y]), *columns)
            np.testing.assert_allclose(over * masking.hammon(a, g), hammon, rtol=1e-13)
            np.testing.assert_allclose(over * masking.schlick_smith(a, g), karis, rtol=1e-13)
            if not alpha:
                continue
            # its range ends in a jump at a = 1.6, which none of these lies next to
            separable = by_oracle(lambda a, x, y: oracle.walter_g1(a, x) * oracle.walter_g1(a, y), *columns)
            correlated = by_oracle(
                lambda a, x, y: 1 / (1 / oracle.walter_g1(a, x) + 1 / oracle.walter_g1(a, y) - 1), *columns
            )
            np.testing.assert_allclose(over * masking.walter_separable(a, g), separable, rtol=1e-12)
            np.testing.assert_allclose(over * masking.walter_correlated(a, g), correlated, rtol=1e-12)
        cd, most = np.asarray(g.cos_d), np.maximum(light[:, 2], viewer[:, 2])
        np.testing.assert_allclose(masking.kelemen(g), 1 / (4 * cd**2), rtol=1e-14)
        np.testing.assert_allclose(masking.half_vector(g), 1 / (4 * cd * most), rtol=1e-14)


def test_approximations_are_near():
    """Walter's rational form is within 0.4 % of Beckmann's G1."""
    c = np.cos(np.radians(np.linspace(0, 85, 18)))
    with jax.enable_x64(True):
        g = from_directions(*(np.stack([np.sqrt(1 - c * c), 0 * c, c], -1) for _ in range(2)))
        for alpha in (0.05, 0.3, 0.8):
            a = jnp.asarray(alpha)
            exact = masking.smith_separable(ndf.Beckmann(a), g)
            np.testing.assert_allclose(masking.walter_separable(a, g), exact, rtol=8e-3)  # of G1 twice


@pytest.mark.parametrize("name", ["conductor", "lazanyi"])
def test_conductors(name: str):
    """Against amplitudes of the complex index in 40 digits, from normal incidence to grazing, next to a dielectric too."""
    wi, wo = WI[GEOMETRY_CASES], WO[GEOMETRY_CASES]
    n, k = points([0.05, 0.5, 1.2, 1.5, 20.0], [0.0, 1e-6, 0.1, 3.0, 80.0])
    with jax.enable_x64(True):
        g = from_directions(wi, wo)
        f = jax.jit(jax.vmap(lambda n, k: getattr(fresnel, name)(n, k, g)))
        got = np.asarray(f(jnp.asarray(n), jnp.asarray(k)))
        slopes = jax.vmap(jax.jacfwd(lambda n, k: getattr(fresnel, name)(n, k, g), (0, 1)))(jnp.asarray(n), jnp.asarray(k))
    assert all(np.isfinite(s).all() for s in slopes)
    cosine = np.broadcast_to(np.asarray(g.cos_d), got.shape)
    want = by_oracle(getattr(oracle, name), *(np.repeat(x, got.shape[1]) for x in (n, k)), cosine)
    # the cosine of 89.995 degrees is rounded before it is given to the oracle; a dozen operations else
    np.testing.assert_allclose(got.ravel(), want, rtol=2e-12)


def test_reflectances_agree():
    """A conductor without absorption is a dielectric; Schlick's form of the index is that of its F0, Lazanyi's without k."""
    with jax.enable_x64(True):
        g = from_directions(WI, WO)
        n, none = jnp.asarray(1.5), jnp.asarray(0.0)
        np.testing.assert_allclose(fresnel.conductor(n, none, g), fresnel.dielectric(n, g), rtol=1e-12)
        np.testing.assert_allclose(fresnel.lazanyi(n, none, g), fresnel.schlick_ior(n, g), rtol=1e-14)
        np.testing.assert_allclose(fresnel.schlick_ior(n, g), fresnel.schlick(fresnel.dielectric_f0(n), g), rtol=1e-13)


SHAPES = {
    "ggx": (0.3,),
    "beckmann": (0.3,),
    "blinn": (30.0,),
    "gaussian": (0.3,),
    "epd": (0.3, 0.8),
    "student_t": (0.3, 3.0),
}
DENSITIES = {n: getattr(oracle, n) for n in SHAPES}
GIVEN = {"specular": 0.3, "f0": 0.2, "ior": 1.8, "k": 2.5, "diffuse": 0.4}


def reflectance(name: str, c: Any) -> Any:
    s, f0, n, k = (mpf(GIVEN[p]) for p in ("specular", "f0", "ior", "k"))
    return {
        "schlick": lambda: schlick(s, c),
        "schlick_scaled": lambda: s * schlick(f0, c),
        "schlick_ior": lambda: s * oracle.lazanyi(n, mpf(0), c),
        "lazanyi": lambda: s * oracle.lazanyi(n, k, c),
        "dielectric": lambda: s * dielectric(n, c),
        "conductor": lambda: s * oracle.conductor(n, k, c),
        "none": lambda: s,
    }[name]()


@pytest.mark.parametrize("name", SHAPES)
def test_any_blocks(name: str):
    """Every Fresnel and body term with each distribution, under masking that a formula has, at a few directions."""
    some = [0, 5, 13, 21, 30]
    wi, wo = WI[some], WO[some]
    with jax.enable_x64(True):
        g = from_directions(wi, wo)
    for f_name, b_name in product(blocks.FRESNELS, blocks.BODIES) if name == "ggx" else [("schlick", "lambert")]:
        cls = brdfit.microfacet(name, "kelemen", f_name, b_name)
        shape = dict(zip(blocks.NDFS[name].parameters, SHAPES[name], strict=True))
        values = {
            p.name: GIVEN[p.name] if p.name in GIVEN and p.name not in shape else shape[p.name] for p in parameters_of(cls)
        }
        with jax.enable_x64(True):
            got = np.asarray(models.build(cls, values)(wi, wo))[:, 0]
        with mp.workdps(DIGITS):
            for k in range(len(some)):
                c, nh = mpf(float(g.cos_d[k])), mpf(float(g.cos_h[k]))
                f, body = reflectance(f_name, c), mpf(GIVEN["diffuse"]) / mp.pi
                lobe = f * DENSITIES[name](*map(mpf, SHAPES[name]), nh) / (4 * c * c)
                want = lobe + {"lambert": body, "transmitted": (1 - f) * body, "none": 0}[b_name]
                # n.h is rounded before it is given to the oracle
                assert got[k] == pytest.approx(float(want), rel=1e-9), (f_name, b_name)


def test_named_models_are_blocks():
    for name, (cls, *_) in models.MODELS.items():
        if hasattr(cls, "blocks"):
            same = brdfit.microfacet(*cls.blocks)
            assert same.parts is cls.parts
            assert parameters_of(same) == parameters_of(cls), name


def test_factory_names_and_errors():
    cls = brdfit.microfacet("beckmann", masking="walter", fresnel="conductor", body="transmitted")
    name = "microfacet(beckmann,walter,conductor,transmitted)"
    assert cls.name == name
    assert models.variants(name) == (cls,)
    m = brdfit.model(name, diffuse=0.1, specular=1.0, ior=0.2, k=3.0, alpha=0.1)
    assert isinstance(pickle.loads(pickle.dumps(m)), cls)
    with pytest.raises(ValueError, match="masking 'walter' needs a distribution with a width alpha, and 'blinn' has none"):
        brdfit.microfacet("blinn", "walter")
    with pytest.raises(ValueError, match="unknown ndf 'box': choose from ggx, beckmann, blinn"):
        brdfit.microfacet("box")
    with pytest.raises(ValueError, match="unknown body 'wet': choose from lambert, transmitted, none"):
        brdfit.microfacet(body="wet")
    with pytest.raises(ValueError, match=r"is no microfacet model: name all four parts, microfacet\(ndf,"):
        brdfit.model("microfacet(ggx)")


def test_composed_model_fits_and_saves():
    """A table of a model of blocks, fitted by its name: parameters come back, and the record has them."""
    name = "microfacet(ggx,schlick_smith,schlick,transmitted)"
    truth = {"diffuse": [0.3, 0.2], "specular": [0.3, 0.1], "alpha": 0.25}
    fit = brdfit.fit(table_of(brdfit.model(name, **truth), grid((16, 12, 10))), name)
    assert fit.converged, fit.reason
    for parameter, value in truth.items():
        np.testing.assert_allclose(fit.parameters[parameter], value, rtol=1e-6)
    assert isinstance(from_record(fit.record()).model, models.variants(name)[0])


def test_energy_of_models():
    """What their docstrings say they return, by quadrature over half vectors."""

    def most(name: str, angle: float, **sets: Any) -> float:
        return float(albedo(models.MODELS[name][0], angle, (96, 48), **sets).max())

    alpha = np.array([0.03, 0.3, 0.5, 0.72, 1.0])
    lobe = {"diffuse": 0.0, "specular": 1.0}
    for angle in (0.0, 60.0, 85.0):
        for name in ("ggx", "beckmann", "cook_torrance", "cook_torrance_gaussian", "ward_bounded"):
            assert most(name, angle, **lobe, alpha=alpha) <= 1 + 1e-5, (name, angle)  # 1e-5: what the rule leaves out
    grows = [most("ward_duer", angle, **lobe, alpha=alpha) for angle in (85.0, 89.0, 89.9)]
    assert grows == pytest.approx([1.33, 5.15, 0.085 / np.cos(np.radians(89.9))], rel=0.02)
    body = [most("pbr", angle, diffuse=1.0, specular=0.0, alpha=alpha) for angle in (60.0, 80.0, 89.995)]
    assert body == pytest.approx([1.03, 1.34, 1.64], abs=0.01)
    paint = {
        "base_color": 1.0,
        "subsurface": 0.0,
        "metallic": 0.0,
        "specular": 1.0,
        "roughness": 1.0,
        "clearcoat_gloss": 0.0,
    }
    coats = {"sheen": np.array([0.0, 1.0]), "clearcoat": np.array([0.0, 1.0])}
    found = albedo(models.MODELS["disney"][0], 89.9, (96, 48), **paint, **coats)
    assert found == pytest.approx([1.62, 1.76], abs=0.01)
