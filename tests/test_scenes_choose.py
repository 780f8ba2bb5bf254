"""The search over effects with errors and costs that are known beforehand, and what a picture shows."""

from itertools import pairwise

import brdfit
import brdfit.angles
import colour
import jax
import numpy as np
import pytest
from brdfit.colours import luminance
from brdfit.models.effects import EFFECTS, in_order
from brdfit.scenes.appearance import look, weighted
from brdfit.scenes.choose import choose, possible, smaller, without
from brdfit.scenes.difference import delta_itp, difference, ssim
from brdfit.scenes.fitted_pixels import _drawn, shown
from brdfit.scenes.illumination import illuminate
from brdfit.scenes.pixels import view
from brdfit.scenes.rendering import render
from brdfit.scenes.scene import Ambient, Camera, Directional, Point, Scene, Sphere, Tolerance
from brdfit.scenes.screen import Fitted
from brdfit.scenes.seen import itp, pq, visibility
from brdfit.tradeoff.evaluation import Operations

AMONG = ("body", "lobe", "tail", "fresnel", "masking", "second_lobe")
PRICE = {"body": 6, "lobe": 40, "tail": 30, "fresnel": 35, "masking": 50, "second_lobe": 60}


class Known:
    """Each effect that a material shows adds its error where it is missing, in squares; no others do anything."""

    def __init__(self, whole=1.0, **shown):
        self.shown, self.whole, self.fits, self.rendered = shown, whole, [], []

    def fit(self, effects, near):
        self.fits.append(effects)
        return Fitted(in_order(effects), {}, self.of(effects))

    def of(self, effects):
        return float(np.sqrt(sum(e**2 for n, e in self.shown.items() if n not in effects) + 1e-4))

    def alone(self, fitted):
        return fitted

    def extended(self, effects, fitted):
        return Fitted(in_order(effects), {}, fitted.error)

    def seen(self, fitted):
        return fitted.error

    def finished(self, fitted):
        self.rendered.append(fitted.effects)
        return fitted.error * self.whole

    def costs(self, several):
        work = [sum(PRICE[n] for n in t.effects) for t in several]
        return [(w / 10, Operations(w, 0, 0)) for w in work]


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        ({"body": 50}, {"body"}),
        ({"lobe": 50}, {"lobe"}),
        ({"body": 40, "lobe": 30}, {"body", "lobe"}),
        ({"body": 40, "lobe": 30, "tail": 1, "fresnel": 1}, {"body", "lobe"}),  # below the tolerance, both together
        ({"body": 40, "lobe": 30, "fresnel": 5}, {"body", "lobe", "fresnel"}),
        ({"body": 40, "lobe": 30, "masking": 5, "tail": 2.5}, {"body", "lobe", "masking"}),
        ({"body": 2, "lobe": 30, "tail": 9, "masking": 6}, {"lobe", "tail", "masking"}),
        (dict.fromkeys(AMONG, 10), set(AMONG)),
    ],
)
def test_what_is_visible_is_chosen_and_nothing_else(shown, expected):
    bench = Known(**shown)
    choice = choose(bench, Tolerance(), None, AMONG)
    assert set(choice.chosen.effects) == expected
    assert choice.met
    assert choice.affordable
    assert {v.effect for v in choice.verdicts if v.called} == expected
    again = {frozenset(AMONG), frozenset(choice.everything.effects)}  # fitted once more, beside the chosen set
    assert len([f for f in bench.fits if f not in again]) == len({f for f in bench.fits if f not in again})
    assert len(set(bench.rendered)) <= 3  # few models get programs of their own
    assert choice.everything.error <= choice.chosen.error
    rungs = [set(t.effects) for t in choice.ladder]
    assert rungs[-1] == expected
    assert all(a < b for a, b in pairwise(rungs))


def test_the_whole_picture_decides():
    """The search looks at some pixels; where the whole picture is worse, a set with more effects is chosen."""
    shown = {"body": 40, "lobe": 30, "tail": 2.8}
    assert set(choose(Known(**shown), Tolerance(), None, AMONG).chosen.effects) == {"body", "lobe"}
    choice = choose(Known(whole=1.2, **shown), Tolerance(), None, AMONG)
    assert choice.met
    assert set(choice.chosen.effects) == {"body", "lobe", "tail"}


def test_no_set_meets_the_tolerance():
    choice = choose(Known(body=40, lobe=30, something_else=8), Tolerance(), None, AMONG)
    assert not choice.met
    assert set(choice.chosen.effects) == {"body", "lobe"}  # the cheapest of those that are as good as can be


def test_budget():
    shown = {"body": 40, "lobe": 30, "masking": 20}
    choice = choose(Known(**shown), Tolerance(), 5.0, AMONG)
    assert choice.met
    assert not choice.affordable  # 9.6 ns, and no cheaper set meets the tolerance


def test_effects_take_along_what_needs_them():
    assert without(frozenset({"body", "lobe", "fresnel"}), "lobe") == {"body"}
    assert without(frozenset({"lobe", "fresnel"}), "lobe") == frozenset()
    assert not possible(frozenset({"fresnel"}))
    every = frozenset(EFFECTS)
    assert all(possible(s) and s < every for s in smaller(every))


def test_pq_is_the_standard_curve():
    """Against the colour library; DARK shifts it by 1e-4 of white."""
    shown = np.array([0.01, 0.18, 1.0, 5.0])
    expected = colour.models.eotf_inverse_ST2084((shown + 1e-4) * 100)
    np.testing.assert_allclose(pq(shown), expected, rtol=1e-12)
    step = 1e-5
    slope = (pq(shown * np.exp(step)) - pq(shown * np.exp(-step))) / (2 * step)
    np.testing.assert_allclose(visibility(shown), slope, rtol=1e-5)


def test_measures_of_difference():
    """Known cases: one code value in 255 is 48.13 dB; 10 % of radiance is 10 %; grey that is doubled, by the PQ curve."""
    scene = Scene("", Sphere(), Camera(pixels=(24, 24)), (Directional((0, 0, 1), (1,) * 3),))
    pixels = view(scene)
    a = np.random.default_rng(0).uniform(0.1, 0.9, (len(pixels.wo), 3))
    assert difference("relative", 1.1 * a, a, 1.0, pixels) == pytest.approx(0.1)
    for measure, same in {"itp": 0, "ciede2000": 0, "ssim": 0}.items():
        assert difference(measure, a, a, 1.0, pixels) == pytest.approx(same, abs=1e-9)
    code = np.full_like(a, 0.5)
    shifted = colour.cctf_decoding(code + 1 / 255, function="sRGB")
    assert difference("psnr", shifted, colour.cctf_decoding(code, function="sRGB"), 1.0, pixels) == pytest.approx(
        20 * np.log10(255), abs=1e-3
    )
    grey = np.full_like(a, 0.2)
    expected = 720 * np.diff(colour.models.eotf_inverse_ST2084(np.array([20.0, 40.0])))[0]  # I alone differs
    np.testing.assert_allclose(delta_itp(2 * grey, grey, 1.0), expected, rtol=2e-3)  # grey is grey to 1e-3 in LMS


def test_ssim():
    """1 for equal pictures; of two constant ones the luminance term alone, (2ab + c)/(a^2 + b^2 + c) (eq. 6)."""
    a, b = np.full((31, 31), 0.4), np.full((31, 31), 0.6)
    got = ssim(a, b)[15, 15]
    assert got == pytest.approx((2 * 0.4 * 0.6 + 1e-4) / (0.4**2 + 0.6**2 + 1e-4))
    assert ssim(a, a) == pytest.approx(np.ones_like(a))


@pytest.fixture(scope="module")
def here(small_table):
    lights = (Directional((0.3, 0.4, 1.0), (3.0,) * 3), Point((-2.0, 1.0, 2.0), (4.0,) * 3))
    return look(small_table[0], Scene("test", Sphere(), Camera(pixels=(40, 40)), lights))


def test_cells_hold_what_is_seen(here):
    """Weights sum to 1, lie where the directions of the pixels lie, and count each pixel by what is seen of it."""
    cells = here.seen.cells(here.grid)
    assert cells.shape == here.table.layout.shape
    assert cells.sum() == pytest.approx(1)
    assert (cells >= 0).all()
    light = illuminate(here.scene, here.view, here.table.channels)
    pairs = sum(int((np.asarray(p.wi)[:, 2] > 0).sum()) for p in light.punctual)
    assert len(here.seen.weight) == pairs
    shown = here.reference.values @ [0.2126, 0.7152, 0.0722] * here.exposure
    whole = visibility(shown) ** 2
    lit = sum((np.asarray(p.arriving) > 0).any(1) for p in light.punctual) > 0
    # shares of a pixel sum to 1: float32 pictures against float64 shares
    by_pixel = np.zeros(len(whole))
    at = np.concatenate([np.flatnonzero(np.asarray(p.wi)[:, 2] > 0) for p in light.punctual])
    np.add.at(by_pixel, at, here.seen.weight)
    np.testing.assert_allclose(by_pixel[lit], (whole / whole[lit].sum())[lit], rtol=1e-4, atol=1e-9)


def test_each_sort_of_light_has_its_share(small_table):
    """Sampled pairs weigh together what their light contributes to the pictures, beside a light that is not sampled."""
    table, _ = small_table
    lights = (Directional((0.3, 0.4, 1.0), (3.0,) * 3), Ambient((0.7,) * 3))
    camera = Camera(pixels=(40, 40))
    whole = look(table, Scene("", Sphere(), camera, lights, exposure=1.0))
    ambient = look(table, Scene("", Sphere(), camera, lights[1:], exposure=1.0))
    total, part = (luminance(x.reference.values) for x in (whole, ambient))
    counts = visibility(total) ** 2
    expected = (counts * part / total).sum() / counts.sum()
    lit = int((np.asarray(whole.light.punctual[0].arriving) > 0).any(1).sum())
    got = whole.seen.weight[lit:].sum()  # lights without extent come first
    assert got == pytest.approx(expected, rel=0.01)  # 16 rounds for a thousand pixels


def test_draws_follow_the_shares(here):
    """Systematic sampling: the share of drawn pairs below any theta_h is that of all, to one step."""
    few = here.seen.draw(500)
    order = np.argsort(brdfit_theta_h(here.seen), kind="stable")
    steps = np.cumsum(here.seen.share[order])
    limits = np.quantile(brdfit_theta_h(few), [0.1, 0.5, 0.9])
    for limit in limits:
        share = steps[np.searchsorted(brdfit_theta_h(here.seen)[order], limit, side="right") - 1]
        assert abs((brdfit_theta_h(few) <= limit).mean() - share) <= 2 / 500
    assert few.weight.sum() == pytest.approx(1)


def test_what_is_fitted_are_pixels_of_the_picture(small_table):
    """By the renderer's finer rule: to the noise of float32 under lights without extent, and under ambient light to what 48
    nodes miss of a lobe of 0.003 degrees, which no pair of directions meets and which brightens every pixel.
    """
    scene = Scene("", Sphere(), Camera(pixels=(24, 24)), (Directional((0.3, 0.4, 1.0), (3.0,) * 3), Ambient((0.7,) * 3)))
    there = look(small_table[0], scene)
    data, at = shown(there), _drawn(there)[0]
    spike = {"diffuse": 0.1, "specular": 0.5, "alpha": 6e-5}
    with jax.enable_x64(True):
        one = brdfit.compose("body", "lobe")(**spike).evaluate(data.geometry)
        got = np.asarray(data.values(np.repeat(one[:, None], 3, 1)))[: len(at)]
    for name, tolerance in (("body+lobe", 0.01), ("lambert", 1e-5)):
        model = brdfit.model(name, **{n: v for n, v in spike.items() if name != "lambert" or n == "diffuse"})
        expected = render(model, there.light).values[at] * there.exposure
        if name == "lambert":
            assert (got > 1.05 * expected).all()  # the spike is seen
            with jax.enable_x64(True):
                got = np.asarray(data.values(np.full((len(one), 3), 0.1 / np.pi)))[: len(at)]
        np.testing.assert_allclose(got, expected, rtol=tolerance)


def test_itp_is_the_measure(small_table):
    """ΔE ITP of the colour library, but for what is added to dark values."""
    a, b = np.random.default_rng(0).uniform(0.05, 2, (2, 50, 3))
    with jax.enable_x64(True):
        got = np.linalg.norm(np.asarray(itp(a) - itp(b)), axis=1)
    np.testing.assert_allclose(got, delta_itp(a, b, 1.0), rtol=5e-3)


def brdfit_theta_h(pairs):
    return brdfit.angles.half_difference(pairs.wi, pairs.wo)[0]


def test_weighted_tables_fit_where_it_matters(here, small_table):
    """Same cells, other weights; the truth is found, as it is everywhere the truth."""
    table, truth = small_table
    changed = weighted(table, here.scene)
    np.testing.assert_allclose(changed.layout.solid_angle(), here.seen.cells(here.grid))
    fit = brdfit.fit(changed, "ward", max_angle=85.0)
    assert fit.converged
    for name, value in truth["parameters"].items():
        np.testing.assert_allclose(fit.parameters[name], value, rtol=1e-6)
