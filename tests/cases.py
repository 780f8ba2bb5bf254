"""Every public model, distribution and shared part, with the parameters and directions it is tested at.

test_models.py::test_every_model_has_cases fails for one that is missing here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from brdfit.models import BRDF, MODELS, fresnel, masking, ndf, parameters_of
from brdfit.stability import reference
from brdfit.stability.domain import GRAZING, NEAR, unit
from numpy.typing import NDArray

Reals = NDArray[np.float64]

PARAMETER_SETS = 42
"""Of a closed form, random ones filled up to it: with 48 directions more than 2,000 oracle cases of value and derivative."""
RANDOM_PARAMETERS = 6
"""Random ones in any case, all that models with a slow oracle have; raise both to search for failures."""
RANDOM_DIRECTIONS = 12


# Directions -----------------------------------------------------------------------------------------------------------


POLAR = np.radians([0.0, 1e-6, 20.0, 45.0, 75.0, 89.0, 89.995])
"""Polar angles of all directions but the random and nearly mirrored ones: oracles of masking are cached by them."""


def directions() -> tuple[Reals, Reals]:
    """Pairs ``(wi, wo)``, each ``[n, 3]``: ordinary, mirror, retro, and the corners of the domain."""
    rng = np.random.default_rng(7)
    # polar angles from the fixed set, so that masking is not a new integral for each pair
    angles = rng.choice(POLAR[2:], (RANDOM_DIRECTIONS, 2))
    ordinary = [(unit(a, rng.uniform(0, 7)), unit(b, rng.uniform(0, 7))) for a, b in angles]
    mirror = [(unit(t, 0.3), unit(t, 0.3 + np.pi)) for t in POLAR]
    retro = [(unit(t, 0.3), unit(t, 0.3)) for t in POLAR]
    off_across = [
        (unit(t, 0.3), unit(t, 0.3 + np.pi + offset)) for t in POLAR[[2, 4, 6]] for offset in 10.0 ** np.array([-8, -5, -2])
    ]
    off_within = [(unit(POLAR[3], 1.0), unit(POLAR[3] + offset, 1.0 + np.pi)) for offset in (1e-8, -1e-8, 1e-4, 1e-2)]
    along_tangent = [(unit(t, 0.0), unit(POLAR[2], np.pi)) for t in POLAR[[4, 6]]]
    along_bitangent = [(unit(t, np.pi / 2), unit(POLAR[2], -np.pi / 2)) for t in POLAR[[4, 6]]]
    normal = np.array([0.0, 0.0, 1.0])
    corners = [
        (normal, normal),
        (normal, unit(POLAR[4], 2.0)),
        (unit(GRAZING, 0.1), normal),
        (unit(GRAZING, 0.1), unit(GRAZING, 0.2)),  # half vector on the horizon
        (unit(GRAZING, 0.1), unit(POLAR[5], 3.0)),
    ]
    pairs = ordinary + mirror + retro + off_across + off_within + along_tangent + along_bitangent + corners
    wi, wo = (np.stack(side) for side in zip(*pairs, strict=True))
    return wi, wo


WI, WO = directions()
FEW = np.r_[0:4, 12:19, 20, 23, 25, 26, 29, 33, 35, 39, len(WI) - 5 : len(WI)]
"""A selection of directions for the models whose oracle is an integral."""


# Models ---------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Row:
    """One class under test: one channel's parameters a case, and how well it must agree with its oracle."""

    model: type[BRDF]
    cases: tuple[Mapping[str, float], ...]
    tolerance: float
    """Relative error of the value: 1e-11 for closed forms, 1e-8 where Smith's integral enters."""
    few: bool = False
    """Whether the oracle is slow: the selection ``FEW`` of directions then stands for all."""
    kinked: bool = False
    """Whether it has no derivative in the directions where n.l = n.v."""

    @property
    def name(self) -> str:
        return self.model.__name__

    def directions(self) -> tuple[Reals, Reals]:
        return (WI[FEW], WO[FEW]) if self.few else (WI, WO)

    def stacked(self, dtype: Any = np.float64) -> BRDF:
        """All cases as one instance with a leading axis of cases, and one channel."""
        specs = parameters_of(self.model)
        columns = {p.name: np.array([c[p.name] for c in self.cases], dtype) for p in specs}
        return self.model(**{p.name: columns[p.name][:, None] if p.per_channel else columns[p.name] for p in specs})


def _with(base: Mapping[str, float], *changes: Mapping[str, float]) -> list[Mapping[str, float]]:
    return [{**base, **c} for c in changes]


def _random(model: type[BRDF], count: int) -> list[Mapping[str, float]]:
    """Parameters from the search boxes, uniform in the logarithm where a fit works in it."""
    rng = np.random.default_rng(11)
    cases: list[Mapping[str, float]] = []
    for _ in range(count):
        case = {}
        for p in parameters_of(model):
            low, high = p.search
            low, high = (low if np.isfinite(low) else -1.0), (high if np.isfinite(high) else 2.0)
            case[p.name] = float(np.exp(rng.uniform(*np.log([low, high])))) if p.log else float(rng.uniform(low, high))
        cases.append(case)
    return cases


def _row(model: type[BRDF], cases: list[Mapping[str, float]], tolerance: float, **options: bool) -> Row:
    missing = 0 if options.get("few") else PARAMETER_SETS - len(cases)
    return Row(model, tuple(cases + _random(model, max(missing, RANDOM_PARAMETERS))), tolerance, **options)


def _gtr() -> list[Mapping[str, float]]:
    base = {"diffuse": 0.1, "specular": 0.04, "alpha": 0.2, "gamma": 2.0}
    cases = _with(
        base,
        {},
        {"alpha": 0.03, "gamma": 1.4, "diffuse": 0.0},
        {"specular": 1.0},
        {"specular": 0.0, "diffuse": 0.0},
        {"alpha": 1.0},
        {"gamma": 1.0},
        {"alpha": 1.0, "gamma": 1.0},
        {"alpha": 1e-9, "gamma": 1.05},  # power law
        {"alpha": 1e-9, "gamma": 2.5},
        {"alpha": 1e-9, "gamma": 0.01},
        {"alpha": 10.0, "gamma": 0.01},
        {"alpha": 10.0, "gamma": 1e7},
        {"alpha": 1e-9, "gamma": 1e7},
        {"alpha": (1 + 30 / 1e7) ** -0.5, "gamma": 1e7, "diffuse": 0.0},  # exp(-30 sin^2)
        {"alpha": (1 + 200 / 1e5) ** -0.5, "gamma": 1e5},
        {"alpha": 1 - 1e-12, "gamma": 1e7},
    )
    for d in NEAR[::3]:
        cases += _with(base, {"alpha": 1 + d}, {"gamma": 1 + d})
    return cases


def _abc() -> list[Mapping[str, float]]:
    base = {"diffuse": 0.1, "specular": 0.7, "b": 200.0, "c": 1.3, "ior": 1.5}
    cases = _with(
        base,
        {},
        {"b": 8.1e6, "c": 2.67, "diffuse": 0.0},
        {"b": 11.0, "c": 0.024},
        {"b": 1e4, "ior": 100.0},
        {"b": 1e-8},
        {"b": 1e-8, "c": 1e4, "diffuse": 0.0},
        {"b": 1e9},
        {"b": 1e9, "c": 1e4, "diffuse": 0.0},
        {"b": 1e9, "c": 0.0},
        {"c": 0.0},
        {"c": 1.0},
        {"c": 2.0},
        {"c": 1e4, "diffuse": 0.0},
        {"ior": 1.0},
        {"ior": 1 + 1e-12, "diffuse": 0.0},
        {"ior": 1001.0},
    )
    for d in NEAR:
        cases += _with(base, {"c": 1 + d}, {"c": 2 + d}, {"c": 1 + d, "b": 1e-4})
    return cases


def _sgd() -> list[Mapping[str, float]]:
    base = {"diffuse": 0.1, "specular": 0.6, "alpha": 0.05, "p": 0.6, "f0": 0.05, "f1": 0.01}
    cases = _with(
        base,
        {},
        {"alpha": 1.2e-4, "p": 1.44},
        {"alpha": 0.85, "p": 0.0, "diffuse": 0.0},
        {"f0": 8.5, "f1": 7.0, "specular": 1e-6},
        {"specular": 0.0, "diffuse": 0.0},
        {"p": 1.0},
        {"p": 2.0},
        {"p": 7.0},
        {"alpha": 1e-7, "p": -10.0},
        {"alpha": 1e-7, "p": 1.0},
        {"alpha": 1e-7, "p": 60.0},
        {"alpha": 30.0, "p": -10.0},
        {"alpha": 30.0, "p": 60.0},
        {"alpha": 3.0, "p": -2.0, "diffuse": 0.0},
    )
    for d in NEAR[::3]:
        cases += _with(base, {"p": 1 + d}, {"p": 2 + d})
    return cases


def _ward(*names: str) -> list[Mapping[str, float]]:
    def widths(x: float, y: float) -> dict[str, float]:
        return dict(zip(names, (x, y), strict=False))

    base = {"diffuse": 0.1, "specular": 0.2, **widths(0.15, 0.15)}
    cases = _with(base, {}, {"diffuse": 0.0, **widths(0.3, 0.2)}, {"specular": 0.0, "diffuse": 0.0})
    corners = ((1e-4, 1e-4), (30.0, 30.0), (1e-4, 30.0), (5.8, 1.0), (0.05, 0.4))
    return cases + _with(base, *(widths(x, y) for x, y in corners)) + _with({**base, "diffuse": 0.0}, widths(1e-3, 1e-3))


def _ashikhmin_shirley(*names: str) -> list[Mapping[str, float]]:
    def exponents(x: float, y: float) -> dict[str, float]:
        return dict(zip(names, (x, y), strict=False))

    base = {"diffuse": 0.1, "specular": 0.04, **exponents(100.0, 100.0)}
    cases = _with(base, {}, {"diffuse": 0.0, **exponents(6.2e5, 20.0)}, {"specular": 1.0}, {"specular": 0.0, "diffuse": 0.0})
    corners = ((0.0, 0.0), (1e7, 1e7), (0.0, 1e7), (2e-3, 5.0), (1.0, 1000.0))
    return cases + _with({**base, "diffuse": 0.0}, *(exponents(x, y) for x, y in corners))


TABLE: tuple[Row, ...] = tuple(
    row
    for name, variants in MODELS.items()
    for row in {
        "gtr": lambda v: [_row(v[0], _gtr(), 1e-8, few=True)],
        "abc": lambda v: [_row(v[0], _abc(), 1e-11, kinked=True)],
        "sgd": lambda v: [_row(v[0], _sgd(), 1e-8, few=True)],
        "ward": lambda v: [_row(v[0], _ward("alpha"), 1e-11), _row(v[1], _ward("alpha_x", "alpha_y"), 1e-11)],
        "ashikhmin_shirley": lambda v: [
            _row(v[0], _ashikhmin_shirley("exponent"), 1e-11, kinked=True),
            _row(v[1], _ashikhmin_shirley("exponent_x", "exponent_y"), 1e-11, kinked=True),
        ],
        "lambert": lambda v: [_row(v[0], [{"diffuse": 0.5}, {"diffuse": 0.0}], 1e-11)],
    }.get(name, lambda v: [])(variants)
)


@cache
def expected(name: str) -> tuple[Reals, dict[str, Reals]]:
    """Oracle values of a row, ``[cases, directions]``, and derivatives by parameter and component, ``wi_0`` to ``wo_2``."""
    row = next(r for r in TABLE if r.name == name)
    wi, wo = row.directions()
    names = [p.name for p in parameters_of(row.model)]
    arguments = [*names, *(f"{end}_{k}" for end in ("wi", "wo") for k in range(3))]
    points = np.array([[*(c[n] for n in names), *l, *v] for c in row.cases for l, v in zip(wi, wo, strict=True)])  # noqa: E741
    cosines = range(len(names), len(arguments))
    value, slope = reference.tabulate("models", name, points, cosines)
    shape = len(row.cases), len(wi)
    return value.reshape(shape), {key: s.reshape(shape) for key, s in zip(arguments, slope.T, strict=True)}


# Distributions and shared parts ---------------------------------------------------------------------------------------

NDFS: dict[str, tuple[Callable[..., Any], tuple[tuple[float, ...], ...]]] = {
    "GTR": (ndf.GTR, ((0.2, 2.0), (1.0, 1.0), (1e-4, 1.3), (0.9, 100.0), (3.0, 2.0), (0.5, 0.1))),
    "SGD": (ndf.SGD, ((0.05, 0.6), (0.85, 0.0), (1e-3, 1.44), (0.1, -10.0), (30.0, 60.0), (0.2, 2.0))),
    "ABC": (ndf.ABC, ((200.0, 1.3), (8.1e6, 2.67), (11.0, 0.024), (1e-4, 1.0), (50.0, 2.0))),
    "power_cosine": (ndf.power_cosine, ((0.0,), (100.0,), (6.2e5,))),
    "gaussian": (ndf.gaussian, ((0.15,), (1e-3,), (1.0,))),
    "GGX": (ndf.GGX, ((0.2,), (1e-4,), (3.0,))),
    "Beckmann": (ndf.Beckmann, ((0.2,), (1e-4,), (30.0,))),
    "Blinn": (ndf.Blinn, ((0.0,), (100.0,), (6e5,))),
    "GaussianAngles": (ndf.GaussianAngles, ((0.2,), (1e-4,), (30.0,))),
    "EPD": (ndf.EPD, ((0.2, 1.0), (0.2, 0.3), (1e-3, 0.7), (0.5, 1.2))),
    "StudentT": (ndf.StudentT, ((0.2, 2.0), (0.2, 1.55), (1e-3, 1.9), (3.0, 4.0), (0.3, 100.0))),
}
"""Densities of theta_m with parameter sets; see test_ndf.py for what each is normalised to."""

ANISOTROPIC_NDFS = {"power_cosine_anisotropic": "power_cosine", "anisotropic_gaussian": "gaussian"}
"""Each with the isotropic density that it equals for equal widths."""

PARTS = {
    masking: {
        "averted_area",
        "half_vector",
        "hammon",
        "kelemen",
        "schlick_smith",
        "walter_correlated",
        "walter_separable",
        "smith_correlated",
        "smith_lambda",
        "smith_separable",
        "vcavity",
    },
    fresnel: {
        "conductor",
        "dielectric",
        "dielectric_at",
        "lazanyi",
        "schlick_ior",
        "dielectric_f0",
        "schlick",
        "sgd_fresnel",
    },
}
"""Parts with a test of their own, by package: in test_masking.py, test_microfacet_models.py and test_models.py."""
