"""Synthetic tables: the same bytes from the same seed, the noise that was asked for, and a truth that rebuilds the model."""

import json

import brdfit
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit.data import forms, published_abc, published_materials, raw
from brdfit.data.synthetic import (
    ANISOTROPIC_RANGES,
    DEFAULT_NAMES,
    FORMULAS,
    RANGES,
    Floor,
    Grazing,
    Missing,
    Noise,
    Outliers,
    Relative,
    evaluate,
    from_truth,
    generate,
    grid,
    material,
    names,
    scattered,
    write,
)
from brdfit.data.synthetic.grazing import LOWEST, GrazingStencil
from brdfit.errors import InputError
from brdfit.models import ndf, parameter_values
from brdfit.models.masking import smith_lambda
from brdfit.tables.hdf5 import read_hdf5, read_truth
from brdfit.tables.merl import read_merl

SMALL = (12, 10, 16)
CASES = (*DEFAULT_NAMES, "sgd-04", "published_sgd-nickel", "ward-aniso-03", "ashikhmin_shirley-aniso-07")


def small(name):
    return (4, *SMALL) if material(name).anisotropic else SMALL


# --- materials and truth ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CASES)
def test_truth_rebuilds_the_table(name):
    table, truth = generate(name, grid=small(name))
    rebuilt = from_truth(json.loads(json.dumps(truth)))
    wi, wo = table.layout.directions()
    with jax.enable_x64(True):
        again = np.asarray(eqx.filter_jit(lambda m, *w: m(*w))(rebuilt, wi, wo))
    # angles become vectors and back: on the sharpest lobe here, 3e-3 wide, 1e-16 at theta_h = 0.01 is 1e-11 of the value;
    # near the horizon 1/cos magnifies the 1e-16 of a cosine
    far = table.within(np.radians(88))
    np.testing.assert_allclose(table.values[far], again[far], rtol=1e-9)
    assert far.sum() > 100
    assert truth["material"] == name == table.material


@pytest.mark.parametrize("name", [n for n in CASES if not n.startswith(("misfit", "published"))])
def test_truth_goes_through_the_public_factory(name):
    _, truth = generate(name, grid=(2, 2, 2, 2) if material(name).anisotropic else (2, 2, 2))
    made = brdfit.model(truth["model"], **truth["parameters"])
    for key, v in parameter_values(made).items():
        np.testing.assert_array_equal(v, truth["parameters"][key])


def test_misfits_are_no_models_to_fit_with():
    assert not FORMULAS.keys() & brdfit.models.MODELS.keys()


def test_presets_are_the_published_fits():
    _, truth = generate("abc-nickel", grid=(2, 2, 2))
    np.testing.assert_array_equal(truth["parameters"]["specular"], published_abc("nickel").specular)


def test_every_name_is_known_and_distinct():
    assert len(set(names())) == len(names()) == 7 * 20 + 3 * 100 + 3
    assert set(DEFAULT_NAMES) <= set(names())


@pytest.mark.parametrize("name", [n for n in names() if n[-3] == "-" and n[-2:].isdigit()])
def test_draws_lie_in_their_ranges(name):
    m = material(name)
    ranges = (ANISOTROPIC_RANGES if m.anisotropic else RANGES)[name.split("-")[0]]
    for key, v in parameter_values(m.brdf(3)).items():
        assert np.all((v >= ranges[key].lower * (1 - 1e-12) - 1e-12) & (v <= ranges[key].upper * (1 + 1e-12))), key


def test_more_channels_leave_the_first_as_they_are():
    one, five = (generate("sgd-02", grid=SMALL, channels=c)[0] for c in (1, 5))
    assert (one.channels, five.channels) == (1, 5)
    # one channel or five are two programs, whose sums may round differently
    np.testing.assert_allclose(five.planes[0], one.planes[0], rtol=1e-12)


def published_range(form, name):
    v = np.concatenate([raw(form, m)[name].ravel() for m in published_materials(form)])
    return v.min(), v.max()


@pytest.mark.parametrize(
    ("model", "parameter", "form", "name"),
    [
        ("abc", "b", "abc", "B"),
        ("abc", "c", "abc", "C"),
        ("abc", "ior", "abc", "ior"),
        ("abc", "diffuse", "abc", "kD"),
        ("sgd", "alpha", "sgd", "alpha"),
        ("sgd", "f0", "sgd", "F0"),
        ("sgd", "f1", "sgd", "F1"),
        ("ward", "alpha", "ngan_ward", "roughness"),
        ("ward", "specular", "ngan_ward", "albedo"),
        ("ashikhmin_shirley", "exponent", "ngan_ashikhminshirley", "sharpness"),
        ("ashikhmin_shirley", "specular", "ngan_ashikhminshirley", "fresnelReflectance"),
    ],
)
def test_ranges_are_those_of_published_fits(model, parameter, form, name):
    assert form in forms()
    lower, upper = published_range(form, name)
    box = RANGES[model][parameter]
    assert lower <= box.lower < box.upper <= upper


# --- evaluation ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("lobe", "parameters"),
    [(ndf.SGD, (1.63e-5, 0.0)), (ndf.SGD, (0.85, 1.77)), (ndf.GTR, (0.005, 4.0)), (ndf.GTR, (0.6, 0.6))],
)
def test_grazing_table(lobe, parameters):
    u = np.random.default_rng(1).random(5000)
    cosine = np.concatenate([np.sin(np.exp(np.log(LOWEST) + u * np.log(np.pi / 2 / LOWEST))), u, [1.0, LOWEST]])
    cosine = np.maximum(cosine, LOWEST)
    with jax.enable_x64(True):
        d = lobe(*(jnp.asarray(p) for p in parameters))
        masking = jax.jit(lambda c: smith_lambda(d, c))
        direct = np.asarray(masking(jnp.asarray(cosine)))
        stencil = GrazingStencil.of(cosine)
        found = np.asarray(jax.jit(lambda nodes: stencil.interpolate(nodes))(stencil.tabulate(masking)))
    # the interpolation is exact to 1e-14; positions ln(x)/h up to 4096 are rounded to 5e-13 cells of 0.005: 2e-15
    np.testing.assert_allclose(1 + found, 1 + direct, rtol=1e-13)


def test_values_below_the_horizon_are_masked():
    table, _ = generate("ward-00")
    ci, co = table.layout.polar_cosines()
    np.testing.assert_array_equal(table.mask, (ci > LOWEST) & (co > LOWEST))
    assert (table.planes[:, ~table.mask] == -1).all()
    assert (table.planes[:, table.mask] > 0).all()


def test_convention_moves_the_angles():
    edge, centre = (generate("gtr-00", grid=SMALL, convention=c) for c in ("edge", "centre"))
    assert (edge[0].angles, centre[0].angles) == ("edge", "centre") == (edge[1]["angles"], centre[1]["angles"])
    assert edge[0].layout.theta_h[0] == 0 < centre[0].layout.theta_h[0]
    assert not np.array_equal(edge[0].planes, centre[0].planes)


def test_anisotropic_grid_shows_anisotropy():
    table, truth = generate("ward-aniso-03")
    assert truth["parameters"]["alpha_x"] != truth["parameters"]["alpha_y"]
    assert not table.isotropic
    assert np.ptp(table.planes[0, :, 10, 0, 0]) > 0
    # a turn by 180 degrees changes nothing
    half = table.layout.shape[0] // 2
    np.testing.assert_allclose(table.planes[:, :half], table.planes[:, half:], rtol=1e-9)


def test_scattered_samples():
    layout = scattered(20_000, seed=3)
    table, truth = generate("ashikhmin_shirley-aniso-01", grid=layout)
    assert truth["grid"] == {"kind": "scattered", "shape": [20_000]}
    assert table.mask.all()
    np.testing.assert_allclose(np.linalg.norm(layout.wi, axis=1), 1, rtol=1e-14)
    # the sum of measures estimates (2 pi)^2; the variance of a sum of independent draws is at most the sum of squares
    assert abs(layout.measure.sum() - (2 * np.pi) ** 2) < 4 * np.sqrt(np.sum(layout.measure**2))
    np.testing.assert_array_equal(scattered(20_000, seed=3).wi, layout.wi)


# --- noise --------------------------------------------------------------------------------------------------------


def residual(part, name="gtr-05", shape=(60, 40, 60)):
    clean, _ = generate(name, grid=shape)
    noisy, _ = generate(name, grid=shape, noise=[part], seed=11)
    return clean, noisy


def assert_standard_normal(z):
    """Mean and standard deviation within 4 standard errors: 1/sqrt(n) and 1/sqrt(2 n) for n normal deviates."""
    assert abs(z.mean()) < 4 / np.sqrt(z.size)
    assert abs(z.std() - 1) < 4 / np.sqrt(2 * z.size)


def test_relative_noise():
    clean, noisy = residual(Relative(0.02))
    assert_standard_normal((noisy.values[clean.mask] / clean.values[clean.mask] - 1) / 0.02)


def test_floor_noise():
    clean, noisy = residual(Floor(0.003))
    assert_standard_normal((noisy.values[clean.mask] - clean.values[clean.mask]) / 0.003)


def test_grazing_noise():
    clean, noisy = residual(Grazing(0.01))
    cosine, _ = evaluate(material("gtr-05").brdf(3), clean.layout)
    z = (noisy.values / clean.values - 1) * cosine[..., None] / 0.01
    assert_standard_normal(z[clean.mask])


def test_outliers():
    clean, noisy = residual(Outliers(0.05, factor=7))
    hit = noisy.values[clean.mask] != clean.values[clean.mask]
    assert (hit == hit[:, :1]).all()  # all channels of a cell together
    n, k = len(hit), hit[:, 0].sum()
    assert abs(k - 0.05 * n) < 4 * np.sqrt(n * 0.05 * 0.95)  # binomial
    np.testing.assert_allclose(noisy.values[clean.mask][hit], 7 * clean.values[clean.mask][hit], rtol=1e-15)


def test_missing_cells():
    clean, noisy = residual(Missing(0.1))
    n, k = clean.mask.sum(), (clean.mask & ~noisy.mask).sum()
    assert abs(k - 0.1 * n) < 4 * np.sqrt(n * 0.1 * 0.9)  # binomial
    assert (noisy.planes[:, ~noisy.mask] == -1).all()
    np.testing.assert_array_equal(noisy.values[noisy.mask], clean.values[noisy.mask])


def test_noise_that_makes_values_negative_masks_them():
    clean, noisy = residual(Floor(0.1))
    assert noisy.mask.sum() < clean.mask.sum()
    assert (noisy.values[noisy.mask] >= 0).all()


def test_parts_compose_and_have_streams_of_their_own():
    both, truth = generate("abc-01", grid=SMALL, noise=[Relative(0.1), Missing(0.2)], seed=4)
    alone, _ = generate("abc-01", grid=SMALL, noise=[Relative(0.1)], seed=4)
    np.testing.assert_array_equal(both.values[both.mask], alone.values[both.mask])
    assert both.mask.sum() < alone.mask.sum()
    assert truth["noise"] == [{"kind": "relative", "sigma": 0.1}, {"kind": "missing", "fraction": 0.2}]


@pytest.mark.parametrize("part", [Relative(0.1), Floor(0.1), Grazing(0.1), Outliers(0.1), Missing(0.1)])
def test_same_seed_same_values(part):
    assert isinstance(part, Noise)
    one, two, other = (generate("gtr-01", grid=SMALL, noise=[part], seed=s)[0] for s in (7, 7, 8))
    assert one.planes.tobytes() == two.planes.tobytes()
    assert one.planes.tobytes() != other.planes.tobytes()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Relative(-0.1), "sigma of the noise must be finite and at least 0, not -0.1"),
        (lambda: Floor(float("nan")), "sigma of the noise must be finite and at least 0, not nan"),
        (lambda: Missing(1.5), r"fraction of the noise must lie in \[0, 1\], not 1.5"),
        (lambda: Outliers(0.1, -2), "factor of the noise must be finite and at least 0, not -2"),
        (lambda: generate("gtr-003"), "no synthetic material 'gtr-003': did you mean gtr-0"),
        (lambda: generate("xyzzy"), "no synthetic material 'xyzzy': choose from names like gtr-00"),
        (lambda: generate("abc-nickel", channels=4), "have 3 channels, 4 were asked for"),
        (lambda: generate("gtr-00", channels=0), "a table has at least 1 channel, not 0"),
        (lambda: generate("ward-aniso-00", grid=SMALL), "ward-aniso-00 is anisotropic and the grid is not"),
        (lambda: grid((3, 4)), r"a grid has cells along theta_h, theta_d, phi_d .* \(3, 4\) is none"),
        (lambda: scattered(0), "a table has at least 1 sample, not 0"),
    ],
)
def test_errors_name_the_fault(make, message):
    with pytest.raises(ValueError, match=message):
        make()


# --- files --------------------------------------------------------------------------------------------------------

NOISE = (Relative(0.02), Missing(0.1))


def test_files_hold_the_table_and_its_truth(tmp_path):
    written = write(["gtr-00", "ward-aniso-00"], tmp_path / "new", noise=NOISE, seed=3)
    assert [p.name for p in written] == [
        "gtr-00.binary",
        "gtr-00.h5",
        "gtr-00.json",
        "ward-aniso-00.h5",
        "ward-aniso-00.json",
    ]
    table, truth = generate("gtr-00", noise=NOISE, seed=3)
    assert json.loads(written[2].read_text()) == truth == read_truth(written[1])
    exact = read_hdf5(written[1])
    np.testing.assert_array_equal(exact.planes, table.planes)
    merl = read_merl(written[0])
    np.testing.assert_array_equal(merl.mask, table.mask)
    # MERL values are divided by the scale when written and multiplied when read: one rounding each
    np.testing.assert_allclose(merl.values[merl.mask], table.values[table.mask], rtol=4e-16)


def test_same_seed_same_bytes(tmp_path):
    one, two = (write(["sgd-00"], tmp_path / d, grid=SMALL, noise=NOISE, seed=3) for d in "ab")
    assert [p.read_bytes() for p in one] == [p.read_bytes() for p in two]


def test_no_names_write_the_default_ones(tmp_path):
    written = write([], tmp_path, grid=SMALL)
    assert {p.stem for p in written} == set(DEFAULT_NAMES)
    assert len(written) == len(list(tmp_path.iterdir())) == 3 * len(DEFAULT_NAMES)


def test_unknown_name_writes_nothing(tmp_path):
    with pytest.raises(InputError, match="no synthetic material 'gtr-0': did you mean gtr-"):
        write(["gtr-00", "gtr-0"], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_out_dir_that_is_a_file(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be made a directory"):
        write(["gtr-00"], tmp_path / "file")
