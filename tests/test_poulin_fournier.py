"""Cylinders on a floor: what is lit and seen by tracing rays, and the limits of the formula."""

from __future__ import annotations

from collections.abc import Sequence

import brdfit
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit.angles import unit_vectors
from brdfit.cli import run
from brdfit.geometry import Geometry
from brdfit.models.poulin_fournier import _free
from brdfit.stability import measure, reference
from brdfit.stability.parts import PARTS
from numpy.typing import NDArray

from .cases import WI, WO

Reals = NDArray[np.float64]
pytestmark = pytest.mark.usefixtures("quickly")

PROFILES = [(2.0, 1.0), (2.0, 0.0), (2.3, -0.6), (3.0, 0.4), (4.0, 1.0), (9.0, -0.2), (2.5, -0.99)]
"""Spacing and elevation."""
LOBE = 0.3, 0.5, 40.0
"""Diffuse, specular, exponent."""
PART = next(p for p in PARTS if p.name == "PoulinFournier")


def points(parameters: Sequence[float], wi: Reals, wo: Reals) -> Reals:
    return np.concatenate([np.broadcast_to(parameters, (len(wi), 5)), wi, wo], -1)


def value(parameters: Sequence[float], wi: Reals, wo: Reals) -> Reals:
    return measure.evaluate(PART, points(parameters, wi, wo))[0]


def blocked(y: Reals, z: Reals, w: Reals, spacing: float, elevation: float) -> NDArray[np.bool_]:
    """Whether a ray from (y, z) towards w meets any of 81 cylinders: the square of its distance to an axis ahead of it."""
    w = w[1:] / np.hypot(*w[1:])
    axes = spacing * np.arange(-40, 41)[:, None]
    along = (axes - y) * w[0] + (elevation - z) * w[1]
    across = (axes - y) * w[1] - (elevation - z) * w[0]
    return np.asarray(((np.abs(across) < 1) & (along > 0)).any(0))


def traced(l: Reals, v: Reals, spacing: float, elevation: float) -> float:  # noqa: E741
    """Mean over one period of (m.l)(m.v)/((n.l)(n.v)), of cosines that are not negative, by the midpoint rule."""
    total, count = 0.0, 20_000
    theta = -np.pi + 2 * np.pi * (np.arange(count) + 0.5) / count
    floor = spacing * (np.arange(count) + 0.5) / count
    bare = np.minimum(floor, spacing - floor) ** 2 + elevation**2 > 1
    for y, z, m_y, m_z, there, step in (
        # a little off the circle, from which the ray would otherwise begin inside by rounding
        (np.sin(theta), np.cos(theta), np.sin(theta), np.cos(theta), np.cos(theta) + elevation > 0, 2 * np.pi / count),
        (floor, 0 * floor, 0 * floor, 0 * floor + 1, bare, spacing / count),
    ):
        lifted = (y * (1 + 1e-9), z * (1 + 1e-9) + elevation) if step == 2 * np.pi / count else (y, z)
        cosines = [m_y * w[1] + m_z * w[2] for w in (l, v)]
        free = there & (cosines[0] > 0) & (cosines[1] > 0)
        for w in (l, v):
            free &= ~blocked(*lifted, w, spacing, elevation)
        total += step * float(np.sum(np.where(free, cosines[0] * cosines[1], 0)))
    return total / (spacing * l[2] * v[2])


def test_against_traced_rays():
    """The body term for pairs of directions in all quarters: 1e-3 is what a sample at the edge of a shadow counts."""
    rng = np.random.default_rng(3)
    for spacing, elevation in PROFILES:
        wi, wo = (unit_vectors(np.arccos(rng.uniform(0.05, 1, 3)), rng.uniform(0, 2 * np.pi, 3)) for _ in range(2))
        found = value((np.pi, 0.0, 1.0, spacing, elevation), wi, wo)
        np.testing.assert_allclose(found, [traced(a, b, spacing, elevation) for a, b in zip(wi, wo, strict=True)], rtol=1e-3)


def test_projected_area():
    """What one direction sees of arc and floor, projected, is the period, projected: sin(right - alpha) + sin(left + alpha)
    + width cos(alpha) = d cos(alpha), for every direction.
    """
    alpha = np.radians([-89.995, -80, -45, -10, -1e-6, 0, 1e-6, 3, 30, 60, 85, 89, 89.995])
    with jax.enable_x64(True):
        for spacing, elevation in PROFILES:
            free = _free(jnp.sin(alpha), jnp.cos(alpha), jnp.asarray(spacing), jnp.asarray(elevation))
            width = np.maximum(spacing - free.shade_right - free.shade_left, 0)
            area = np.sin(free.right - alpha) + np.sin(free.left + alpha) + width * np.cos(alpha)
            # rounding of sums of numbers of a few units
            np.testing.assert_allclose(area, spacing * np.cos(alpha), rtol=0, atol=4e-15)


def test_sunken_cylinders():
    """With the tops of the cylinders in the floor the model is ``modified_blinn_phong``."""
    want = reference.values("models", "ModifiedBlinnPhong", np.delete(points((*LOBE, 2.0, -1.0), WI, WO), [3, 4], 1))
    np.testing.assert_allclose(value((*LOBE, 2.0, -1.0), WI, WO), want, rtol=1e-13)  # exponents of 40 magnify rounding


def test_cylinders_far_apart():
    """Where their shadows do not meet what they change falls as 1/d."""
    wi, wo = (unit_vectors(np.radians(t), np.array([0.2, 1.9])) for t in (20.0, 50.0))
    flat = value((*LOBE, 2.0, -1.0), wi, wo)
    near, far = (value((*LOBE, d, 0.7), wi, wo) - flat for d in (1e3, 1e6))
    np.testing.assert_allclose(near, 1e3 * far, rtol=1e-6)  # the difference has lost six digits
    assert (np.abs(near) < 0.01 * flat).all()


def test_cylinders_that_touch():
    """At a spacing of 2 nothing is hidden at normal incidence, where slopes are those of wider spacings. Next to it the end
    of the arc moves with spacing as 1/theta, and slopes are right all the same.
    """
    normal = unit_vectors(np.zeros(2), np.zeros(2))
    at, wider = (measure.evaluate(PART, points((*LOBE, d, 0.3), normal, normal))[1][0, :5] for d in (2.0, 2 + 1e-9))
    assert np.isfinite(at).all()
    np.testing.assert_allclose(at, wider, rtol=1e-7)
    beside = unit_vectors(np.array([1e-6, 1e-2]), np.full(2, 1.3))
    for exponent in (0.0, 0.4, 1e4):
        x = points((0.3, 0.5, exponent, 2.0, 0.3), beside, -beside * [1, 1, -1])
        want = reference.tabulate("models", PART.name, x, PART.cosines)
        value_error, slope_error = measure.errors(PART, x, measure.evaluate(PART, x), want, np.float64)
        assert value_error.max() <= 1e-11
        # 1e-16 of the integrand's terms at the end of the arc, over 1e-6
        assert np.nanmax(slope_error) <= 1e-8


def test_isotropic_tables(small_file, tmp_path, capsys):
    """One line that says so, from the library and the command, before anything is compiled or written."""
    said = (
        "an anisotropic model needs the azimuth of the half vector, and this table is isotropic: fit poulin_fournier to an"
    )
    with pytest.raises(brdfit.InputError, match=said):
        brdfit.fit(brdfit.load(small_file), "poulin_fournier")
    for verb in (
        ["fit", str(small_file), "--model", "gtr,poulin_fournier"],
        ["tradeoff", str(small_file), "--model", "poulin_fournier"],
    ):
        assert run([*verb, "--out", str(tmp_path / "out")]) == 2
        out, line = capsys.readouterr()
        assert line.startswith(f"brdfit: {small_file}: {said}")
        assert line.count("\n") == 1
        assert not out
    assert not (tmp_path / "out").exists()
    with pytest.raises(ValueError, match="this model needs the directions themselves"), jax.enable_x64(True):
        brdfit.models.evaluate_channels(
            brdfit.models.poulin_fournier.PoulinFournier(*[np.ones(1)] * 5), Geometry(*[jnp.ones(1)] * 6)
        )
