"""A search for the worst case of each model, and the cases that it found.

Hypothesis is steered towards larger errors (``target``); what is found is kept in ``FOUND`` as examples. It is held to the
domain of ``stability/domain.py``: a component of a direction is 0 or at least ``SMALLEST``, as an angle is known to no
better than 1e-8 rad, and so is an albedo. Without it the search ends at denormal numbers, whose squares are 0.
"""

from __future__ import annotations

import numpy as np
import pytest
from brdfit.angles import unit_vectors
from brdfit.stability import domain, measure, reference
from brdfit.stability.parts import PARTS, POLAR, Part
from hypothesis import HealthCheck, Phase, given, settings, target
from hypothesis import strategies as st

MODELS = {p.name: p for p in PARTS if p.group == "models"}
MASKING = {p.name: p for p in PARTS if p.name.startswith("Smith") and p.integral}
LONGER = {"ABC", "Ward", "WardAnisotropic", "AshikhminShirley", "AshikhminShirleyAnisotropic", "Smith, gtr", "Smith, sgd"}
"""Searched longer: what is fitted by default."""
SMALLEST = 1e-8
HUNT = settings(
    deadline=None,
    derandomize=True,
    database=None,
    phases=[Phase.generate, Phase.target],
    suppress_health_check=list(HealthCheck),
)

pytestmark = pytest.mark.usefixtures("quickly")

FOUND: tuple[tuple[str, dict[str, float]], ...] = (
    # Gaussians of K = gamma (1/alpha^2 - 1) of some hundreds: slopes were 6e-8 off with 140 nodes of Smith's rule
    ("Smith, gtr", {"alpha": 0.999, "gamma": 152454.641, "cosine": 0.107427772}),
    ("Smith, gtr", {"alpha": 0.999, "gamma": 9163838.95, "cosine": 0.00727593845}),
    # width e^10 times the horizon's: what is beyond the reach of the rule counts
    ("Smith, gtr", {"alpha": 10.0, "gamma": 1e7, "cosine": 8.74259883e-05}),
    ("Smith, sgd", {"alpha": 0.05, "p": -10.0, "cosine": 0.5}),
    ("Smith, sgd", {"alpha": 0.05071175, "p": -10.0, "cosine": 0.02066097}),
    ("Smith, sgd", {"alpha": 30.0, "p": 60.0, "cosine": 0.06409359}),
)
"""Part and arguments."""


def worst(part: Part, point: np.ndarray) -> tuple[float, float]:
    """Errors of the value and of the worst slope at one point, both over what is promised: 1 is the limit."""
    points = point[None]
    want = reference.tabulate(part.group, part.name, points, part.cosines)
    got = measure.evaluate(part, points)
    assert all(np.isfinite(x).all() for x in got)
    value, slope = measure.errors(part, points, got, want, np.float64)
    return float(value.max()) / (1e-8 if part.integral else 1e-11), float(np.nanmax(slope, initial=0)) / 1e-8


@pytest.mark.parametrize(("name", "arguments"), FOUND)
def test_found(name: str, arguments: dict[str, float]):
    part = {**MODELS, **MASKING}[name]
    assert max(worst(part, np.array([arguments[a] for a in part.arguments]))) <= 1


def hunted(part: Part, beyond: st.SearchStrategy[np.ndarray], examples: int) -> None:
    """Maximise the error of ``part`` over its parameters and ``beyond``, the arguments after them."""

    def value(r: domain.Range) -> st.SearchStrategy[float]:
        low, high = (np.log(r.low), np.log(r.high)) if r.log else (r.low, r.high)
        inside = st.floats(low, high, allow_subnormal=False).map(
            lambda x: float(np.clip(np.exp(x), r.low, r.high) if r.log else 0 if abs(x) < SMALLEST else x)
        )
        beside = st.sampled_from([s + d for s in r.special for d in (0.0, *domain.NEAR) if s + d >= min(r.low, s)])
        return st.one_of(inside, beside) if r.special else inside

    @settings(HUNT, max_examples=examples)
    @given(st.tuples(*(value(r) for r in part.ranges.values())), beyond)
    def search(parameters: tuple[float, ...], others: np.ndarray) -> None:
        point = np.array([*parameters, *others])
        errors = worst(part, point)
        for label, error in zip(("value", "slope"), errors, strict=True):
            target(float(np.log10(error + 1e-9)), label=label)
        assert max(errors) <= 1, (dict(zip(part.arguments, point.tolist(), strict=True)), errors)

    search()


@st.composite
def directions(draw: st.DrawFn) -> np.ndarray:
    """Pairs of directions, with the viewer near the mirror or retro direction or anywhere."""
    theta, phi = draw(st.floats(0, domain.GRAZING)), draw(st.floats(0, 2 * np.pi))
    turn = draw(st.one_of(st.sampled_from([0.0, np.pi]), st.floats(0, 2 * np.pi)))
    tilt, twist = (draw(st.one_of(st.just(0.0), st.floats(-8, -1).map(lambda e: 10.0**e))) for _ in range(2))
    other = draw(st.one_of(st.just(min(theta + tilt, domain.GRAZING)), st.floats(0, domain.GRAZING)))
    pair = np.concatenate([unit_vectors(theta, phi), unit_vectors(other, phi + turn + twist)])
    return np.asarray(np.where(np.abs(pair) < SMALLEST, 0, pair))


@pytest.mark.parametrize("part", [p for p in MODELS.values() if not p.integral], ids=lambda p: p.name)
def test_hunt_in_closed_forms(part: Part):
    hunted(part, directions(), 120 if part.name in LONGER else 30)


@pytest.mark.parametrize("part", MASKING.values(), ids=lambda p: p.name)
def test_hunt_in_masking(part: Part):
    """Few, since each is several integrals in 75 digits: a hundred of them are 40 seconds."""
    cosines = st.sampled_from(list(POLAR[1:])).map(lambda t: np.array([np.sin(np.pi / 2 - t)]))
    hunted(part, cosines, 30 if part.name in LONGER else 10)
