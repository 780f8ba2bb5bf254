"""Every public model, distribution and shared part, with the parameters and directions it is tested at.

test_models.py::test_every_model_has_cases and test_every_part_has_cases fail for one that is missing here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from brdfit.angles import unit_vectors
from brdfit.models import BRDF, MODELS, fresnel, masking, ndf, parameters_of
from brdfit.stability.domain import GRAZING, NEAR
from brdfit.stability.parts import PARTS, Part
from numpy.typing import NDArray

Reals = NDArray[np.float64]

PARAMETER_SETS, FEW_SETS = 42, 12
"""Random ones filled up to as many: with 48 directions 2,000 or 500 oracle cases of the value."""
RANDOM_PARAMETERS = 6
"""Random ones in any case; raise all three to search for failures."""
RANDOM_DIRECTIONS = 12


# Directions -----------------------------------------------------------------------------------------------------------


POLAR = np.radians([0.0, 1e-6, 20.0, 45.0, 75.0, 89.0, 89.995])
"""Polar angles of all directions but the random and nearly mirrored ones: oracles of masking are cached by them."""


def directions() -> tuple[Reals, Reals]:
    """Pairs ``(wi, wo)``, each ``[n, 3]``: ordinary, mirror, retro, and the corners of the domain."""
    rng = np.random.default_rng(7)
    # polar angles from the fixed set, so that masking is not a new integral for each pair
    angles = rng.choice(POLAR[2:], (RANDOM_DIRECTIONS, 2))
    ordinary = [(unit_vectors(a, rng.uniform(0, 7)), unit_vectors(b, rng.uniform(0, 7))) for a, b in angles]
    mirror = [(unit_vectors(t, 0.3), unit_vectors(t, 0.3 + np.pi)) for t in POLAR]
    # not at 45 degrees, where the cosine to the mirror direction is 0 but for rounding, and lobes about it end
    retro = [
        (unit_vectors(t, 0.3), unit_vectors(t, 0.3)) for t in np.where(np.arange(len(POLAR)) == 3, np.radians(40), POLAR)
    ]
    off_across = [
        (unit_vectors(t, 0.3), unit_vectors(t, 0.3 + np.pi + offset))
        for t in POLAR[[2, 4, 6]]
        for offset in 10.0 ** np.array([-8, -5, -2])
    ]
    off_within = [
        (unit_vectors(POLAR[3], 1.0), unit_vectors(POLAR[3] + offset, 1.0 + np.pi)) for offset in (1e-8, -1e-8, 1e-4, 1e-2)
    ]
    along_tangent = [(unit_vectors(t, 0.0), unit_vectors(POLAR[2], np.pi)) for t in POLAR[[4, 6]]]
    along_bitangent = [(unit_vectors(t, np.pi / 2), unit_vectors(POLAR[2], -np.pi / 2)) for t in POLAR[[4, 6]]]
    normal = np.array([0.0, 0.0, 1.0])
    corners = [
        (normal, normal),
        (normal, unit_vectors(POLAR[4], 2.0)),
        (unit_vectors(GRAZING, 0.1), normal),
        (unit_vectors(GRAZING, 0.1), unit_vectors(GRAZING, 0.2)),  # half vector on the horizon
        (unit_vectors(GRAZING, 0.1), unit_vectors(POLAR[5], 3.0)),
    ]
    pairs = ordinary + mirror + retro + off_across + off_within + along_tangent + along_bitangent + corners
    wi, wo = (np.stack(side) for side in zip(*pairs, strict=True))
    return wi, wo


WI, WO = directions()
FEW = np.r_[0:4, 12:19, 20, 23, 25, 26, 29, 33, 35, 39, len(WI) - 5 : len(WI)]
"""A selection of directions for the models whose oracle is an integral."""


# Models ---------------------------------------------------------------------------------------------------------------

Case = Mapping[str, float]
SLOPES = np.array([0, 3, 12, 14, 20, 28, 34, 37, -4, -2])
"""Directions whose derivatives have an oracle in the rows of few sets: five for each case in turn."""


@dataclass(frozen=True, eq=False)
class Row:
    """One class under test: one channel's parameters a case, and what its docstring claims."""

    model: type[BRDF]
    cases: tuple[Case, ...]
    tolerance: float = 1e-11
    """Relative error of the value: 1e-11 for closed forms, 1e-8 where Smith's integral enters."""
    few: bool = False
    """Whether the oracle is an integral for each set: the selection ``FEW`` of directions then stands for all."""
    thorough: bool = False
    """Whether derivatives, too, are compared at every direction."""
    reciprocal: bool = True
    energy: tuple[Case, ...] = ()
    """Cases whose albedo must not exceed 1; those of other claims are in test_energy.py."""
    truth: Mapping[str, Any] = field(default_factory=dict)
    """A synthetic material that is fitted, where it differs from the defaults."""
    grid: tuple[int, ...] = (16, 12, 10)
    """Of its table: theta_h, theta_d, phi_d, or with phi_h first."""

    @property
    def name(self) -> str:
        return self.model.__name__

    @property
    def part(self) -> Part:
        """The same in the atlas."""
        return next(p for p in PARTS if p.group == "models" and p.name == self.name)

    def directions(self) -> tuple[Reals, Reals]:
        return (WI[FEW], WO[FEW]) if self.few else (WI, WO)

    def points(self, wi: Reals, wo: Reals) -> Reals:
        """Arguments of all cases at all directions, ``[cases, directions, arguments]``."""
        numbers = np.array([[c[p.name] for p in parameters_of(self.model)] for c in self.cases])
        shape = len(numbers), len(wi)
        both = np.concatenate([wi, wo], -1)
        return np.concatenate([np.broadcast_to(x, (*shape, x.shape[-1])) for x in (numbers[:, None], both[None])], -1)

    def compared(self) -> NDArray[np.bool_]:
        """Which cases and directions have an oracle of their derivatives, ``[cases, directions]``."""
        chosen = np.ones((len(self.cases), len(self.directions()[0])), bool)
        if not self.thorough:
            chosen[:] = False
            for k in range(len(self.cases)):
                chosen[k, SLOPES[k % 2 :: 2]] = True
        return chosen


def _with(base: Case, *changes: Case) -> list[Case]:
    return [{**base, **c} for c in changes]


def _random(model: type[BRDF], count: int) -> list[Case]:
    """Parameters from the search boxes, uniform in the logarithm where a fit works in it."""
    rng = np.random.default_rng(11)
    cases: list[Case] = []
    for _ in range(count):
        case: dict[str, float] = {}
        for p in parameters_of(model):
            low, high = p.search
            low, high = (low if np.isfinite(low) else -1.0), (high if np.isfinite(high) else 2.0)
            case[p.name] = float(np.exp(rng.uniform(*np.log([low, high])))) if p.log else float(rng.uniform(low, high))
        cases.append(case)
    return cases


def _row(name: str, cases: list[Case], form: int = 0, sets: int = FEW_SETS, **options: Any) -> Row:
    model = MODELS[name][form]
    energy = tuple({**cases[0], **c} for c in options.pop("energy", ()))
    return Row(model, tuple(cases + _random(model, max(sets - len(cases), 0))), energy=energy, **options)


def _closed(name: str, cases: list[Case], form: int = 0, **options: Any) -> Row:
    """A closed form with 2,000 oracle cases of value and derivative."""
    return _row(name, cases, form, max(PARAMETER_SETS, len(cases) + RANDOM_PARAMETERS), thorough=True, **options)


def _integral(name: str, cases: list[Case], **options: Any) -> Row:
    """A model with Smith's integral, with 500."""
    sets = len(cases) + RANDOM_PARAMETERS
    return _row(name, cases, 0, sets, tolerance=1e-8, few=True, thorough=True, **options)


def _gtr() -> list[Case]:
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


def _abc() -> list[Case]:
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


def _sgd() -> list[Case]:
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


def _ward(*names: str) -> list[Case]:
    def widths(x: float, y: float) -> dict[str, float]:
        return dict(zip(names, (x, y), strict=False))

    base = {"diffuse": 0.1, "specular": 0.2, **widths(0.15, 0.15)}
    cases = _with(base, {}, {"diffuse": 0.0, **widths(0.3, 0.2)}, {"specular": 0.0, "diffuse": 0.0})
    corners = ((1e-4, 1e-4), (30.0, 30.0), (1e-4, 30.0), (5.8, 1.0), (0.05, 0.4))
    return cases + _with(base, *(widths(x, y) for x, y in corners)) + _with({**base, "diffuse": 0.0}, widths(1e-3, 1e-3))


def _ashikhmin_shirley(*names: str) -> list[Case]:
    def exponents(x: float, y: float) -> dict[str, float]:
        return dict(zip(names, (x, y), strict=False))

    base = {"diffuse": 0.1, "specular": 0.04, **exponents(100.0, 100.0)}
    cases = _with(base, {}, {"diffuse": 0.0, **exponents(6.2e5, 20.0)}, {"specular": 1.0}, {"specular": 0.0, "diffuse": 0.0})
    corners = ((0.0, 0.0), (1e7, 1e7), (0.0, 1e7), (2e-3, 5.0), (1.0, 1000.0))
    return cases + _with({**base, "diffuse": 0.0}, *(exponents(x, y) for x, y in corners))


GLOSS = {"diffuse": 0.1, "specular": 0.04, "alpha": 0.2}
WIDTHS = [{"alpha": a} for a in (1e-4, 0.02, 1.0, 5.0, 30.0)] + [{"specular": 1.0}, {"diffuse": 0.0, "specular": 0.0}]
FULL_WIDTHS = [{"diffuse": 0.0, "specular": 1.0, "alpha": a} for a in (0.1, 0.5, 1.0, 3.0)]
POWERS = [{"alpha": a, "p": p} for a, p in ((0.02, 0.3), (0.5, 0.5), (1e-3, 0.7), (1.0, 1.2), (5.0, 0.15))]
TAILS = [{"gamma": g, "alpha": a} for g, a in ((2.0, 1.0), (40.0, 0.3), (3.0, 1e-3), (2.5, 5.0), (100.0, 1e-2))]
SCALED = {"diffuse": 0.1, "scale": 20.0, "b": 200.0, "c": 1.3, "ior": 1.5}
FALLS = [{"b": 8e6, "c": 2.7, "scale": 2e4}, {"b": 11.0, "c": 0.02}, {"b": 1e-2}, {"c": 0.0}, {"ior": 100.0}, {"ior": 1.0}]
LONG = {"diffuse": 0.1, "specular": 0.2, "alpha_x": 0.1, "alpha_y": 0.3}
LONGER = [{"alpha_x": x, "alpha_y": y} for x, y in ((1e-4, 1e-4), (0.02, 2.0), (30.0, 1.0), (0.05, 0.05))]
WARD = {"diffuse": 0.1, "specular": 0.2, "alpha": 0.15}
PAINT = {
    "base_color": 0.3,
    "subsurface": 0.4,
    "metallic": 0.3,
    "specular": 0.6,
    "roughness": 0.4,
    "sheen": 0.1,
    "clearcoat": 0.5,
    "clearcoat_gloss": 0.7,
}
PAINTS = [{"roughness": r} for r in (0.0, 1.0, 0.02)] + [{"metallic": 1.0}, {"metallic": 0.0, "clearcoat_gloss": 0.0}]

BLINN = {"diffuse": 0.1, "specular": 0.04, "exponent": 50.0}
ROUGHNESSES = [{"roughness": r} for r in (1.0, 1e-9, 1e-4)]
ANISOTROPIC = (8, 14, 9, 12)
LOBE = {"diffuse": 0.1, "specular": 0.2, "exponent": 50.0}
EXPONENTS = [{"exponent": e} for e in (1.0, 3.0, 1e3, 1e7)] + [{"diffuse": 0.0, "exponent": 300.0}]
FULL_POWERS = [{"diffuse": 0.0, "specular": 1.0, "exponent": e} for e in (0.0, 1.0, 4.0, 60.0)]
ROUGH = {"diffuse": 0.5, "sigma": 0.4}
ROUGHER = [{"sigma": s} for s in (0.0, 1e-2, 1.0, 3.0)] + [{"diffuse": 0.0}, {"diffuse": 1.0}]
TILTED = {"diffuse": 0.1, "specular": 0.2, "tilt": 0.75, "exponent": 50.0}
TILTS = [{"tilt": t} for t in (0.0, -0.7, -0.9, 0.9, 1.5, np.pi / 2, -np.pi / 2)]
TWO = {
    "diffuse": 0.1,
    "specular_1": 0.2,
    "specular_2": 0.1,
    "tilt_1": 0.82,
    "tilt_2": -0.7,
    "exponent_1": 90.0,
    "exponent_2": 5.0,
}
THREE = {**TWO, "specular_3": 0.05, "tilt_3": 0.6, "exponent_3": 9.0}
TILTS_1 = [{"tilt_1": t, "exponent_1": e} for t in (0.0, -0.8, 1.0) for e in (3.0, 1e4)]
LAYERS = {"specular": 0.04, "base": 0.3, "roughness": 0.02, "base_roughness": 0.8}
PLASTIC = {"diffuse": 0.4, "smoothness": 0.6, "metalness": 0.3, "transparency": 0.1}
SMOOTH = [{"smoothness": s} for s in (0.0, 0.9, 0.999)] + [{"metalness": 1.0, "transparency": 0.0}, {"transparency": 0.9}]
GLOSSY = {"diffuse": 0.1, "specular": 0.5, "smoothness": 0.7, "scale": 1.0}
TABULATED = {p.name: p.default for p in parameters_of(MODELS["distribution_based"][0])} | {"diffuse": 0.1}
WAVES = {"diffuse": 0.1, "specular": 0.5, "ior": 1.5, "sigma": 0.15, "tau": 1.5}
SURFACES = [
    {"sigma": s, "tau": t}
    for s, t in (
        (1e-3, 0.05),
        (1e-3, 200.0),
        (0.05, 3.0),
        (0.3, 1.0),
        (0.6, 0.8),
        (0.6, 20.0),
        (0.62, 2.0),
        (1.2, 9.0),
        (2.5, 60.0),
    )
]
LAYERED = {"diffuse": 0.1, "specular": 0.3, "ior": 1.5, "thickness": 0.2, "exponent": 50.0, "base_exponent": 20.0}
FILMS = [{"thickness": 0.0}, {"thickness": 3.0}, {"ior": 1.001}, {"ior": 4.0}, {"exponent": 1e6}, {"base_exponent": 1e6}]
CYLINDERS = {"diffuse": 0.1, "specular": 0.2, "exponent": 50.0, "spacing": 2.6, "elevation": 0.3}
PROFILES = [
    {"elevation": -1.0},
    {"elevation": 1.0, "spacing": 2.01},
    {"elevation": -0.4, "exponent": 1e7, "spacing": 2.1},
    {"exponent": 0.0, "spacing": 2.05},
    {"exponent": 0.3, "elevation": 0.9, "diffuse": 0.0},
    {"spacing": 100.0, "elevation": 1.0},
]
FULL_PROFILES = [
    {"diffuse": 0.0, "specular": 1.0, "exponent": e, "elevation": h} for e, h in ((0.0, 1.0), (5.0, 0.0), (60.0, -0.5))
]

TABLE: tuple[Row, ...] = (
    _integral("gtr", _gtr()),
    _closed("abc", _abc()),
    _integral("sgd", _sgd()),
    _closed("ward", _ward("alpha")),
    _closed("ward", _ward("alpha_x", "alpha_y"), form=1),
    _closed("ashikhmin_shirley", _ashikhmin_shirley("exponent")),
    _closed("ashikhmin_shirley", _ashikhmin_shirley("exponent_x", "exponent_y"), form=1),
    _closed("lambert", [{"diffuse": 0.5}, {"diffuse": 0.0}]),
    _row("ggx", _with(GLOSS, {}, *WIDTHS), energy=FULL_WIDTHS),
    _row("beckmann", _with(GLOSS, {}, *WIDTHS), energy=FULL_WIDTHS),
    _row("pbr", _with(GLOSS, {}, *WIDTHS)),
    _row("cook_torrance", _with(GLOSS, {}, *WIDTHS), energy=FULL_WIDTHS),
    _row("cook_torrance_blinn", _with(BLINN, {}, {"exponent": 0.0}, {"exponent": 1e6})),
    _row("cook_torrance_gaussian", _with(GLOSS, {}, *WIDTHS), energy=FULL_WIDTHS),
    _row("epd", _with({**GLOSS, "p": 0.7}, {}, *POWERS), tolerance=1e-8, truth={"p": 0.7}),
    _row("student_t", _with({**GLOSS, "gamma": 2.5}, {}, *TAILS, {"gamma": 1.7}), truth={"alpha": 0.3, "gamma": 3.0}),
    _row("low_microfacet", _with(SCALED, {}, *FALLS), truth=SCALED),
    _row("abc_smooth", _with(SCALED, {}, *FALLS), truth=SCALED),
    _row("ward_duer", _with(WARD, {}, *({"alpha": a} for a in (1e-3, 0.5, 3.0)))),
    _row("ward_duer", _with(LONG, {}, *LONGER), form=1, truth=LONG, grid=ANISOTROPIC),
    _row("ward_bounded", _with(WARD, {}, *({"alpha": a} for a in (1e-3, 0.5, 3.0))), energy=FULL_WIDTHS),
    _row("ward_bounded", _with(LONG, {}, *LONGER), form=1, truth=LONG, grid=ANISOTROPIC),
    _row("disney", _with(PAINT, {}, *PAINTS), truth=PAINT),
    _row(
        "disney",
        _with({**PAINT, "anisotropy": 0.6}, {}, *PAINTS, {"anisotropy": 1.0}),
        form=1,
        truth={**PAINT, "anisotropy": 0.6},
        grid=ANISOTROPIC,
    ),
    _row("phong", _with(LOBE, {}, *EXPONENTS), reciprocal=False, truth={"exponent": 40.0}),
    _row("modified_phong", _with(LOBE, {}, *EXPONENTS), energy=FULL_POWERS),
    _row("max_phong", _with(LOBE, {}, *EXPONENTS), energy=FULL_POWERS),
    _row("blinn_phong", _with(LOBE, {}, *EXPONENTS, {"exponent": 0.0}), truth={"exponent": 80.0}),
    _row("modified_blinn_phong", _with(LOBE, {}, *EXPONENTS, {"exponent": 0.0}), energy=FULL_POWERS),
    _row("oren_nayar", _with(ROUGH, {}, *ROUGHER), energy=[{"diffuse": 0.984, "sigma": s} for s in (0.1, 0.2, 0.5, 3.0)]),
    _row("oren_nayar_full", _with(ROUGH, {}, *ROUGHER)),
    _row("lafortune", _with(TILTED, {}, *TILTS, *EXPONENTS[1:]), truth={"tilt": 0.85}),
    _row("lafortune2", _with(TWO, {}, *TILTS_1), truth=TWO),
    _row("lafortune3", _with(THREE, {}, *TILTS_1), truth=THREE),
    _row("schlick", _with({"specular": 0.3, "roughness": 0.1}, {}, *ROUGHNESSES, {"specular": 1e-3})),
    _row(
        "schlick_two_layers",
        _with(LAYERS, {}, {"roughness": 1e-9}, {"base_roughness": 1.0, "specular": 0.0}, {"specular": 1.0}),
    ),
    _row("strauss", _with(PLASTIC, {}, *SMOOTH), reciprocal=False),
    _row(
        "schwenk",
        _with(GLOSSY, {}, {"smoothness": 0.0}, {"smoothness": 1.0, "diffuse": 0.0}, {"specular": 0.0}, {"scale": 0.0}),
    ),
    _row(
        "distribution_based",
        _with(TABULATED, {}, {"f0": 1.0}, {"p_3": -20.0}, {"p_1": 3.0, "p_2": 3.0}),
        grid=(48, 8, 6),
    ),
    _row("granier_heidrich", _with(LAYERED, {}, *FILMS), truth={"ior": [1.5, 1.7], "thickness": [0.2, 0.3]}),
    _row("htsg", _with(WAVES, {}, *SURFACES, {"ior": 1.0}, {"ior": 20.0}), grid=(9, 7, 6)),
    _row("stam_diffraction", _with(WAVES, {}, *SURFACES, {"ior": 20.0}), grid=(9, 7, 6)),
    _row("poulin_fournier", _with(CYLINDERS, {}, *PROFILES), energy=FULL_PROFILES, truth=CYLINDERS, grid=(6, 10, 6, 8)),
)


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

COVERED = {
    ndf: {
        "ABC": "abc",
        "Beckmann": "beckmann",
        "Blinn": "blinn",
        "EPD": "epd",
        "GGX": "ggx",
        "GTR": "gtr",
        "GaussianAngles": "gaussian",
        "SGD": "sgd",
        "StudentT": "student_t",
        "anisotropic_gaussian": "anisotropic_gaussian",
        "gaussian": "gaussian of slopes",
        "power_cosine": "power_cosine",
        "power_cosine_anisotropic": "power_cosine_anisotropic",
    },
    masking: {
        "averted_area": "Smith, gtr",
        "half_vector": "half_vector",
        "hammon": "hammon, ggx",
        "kelemen": "kelemen",
        "schlick_smith": "schlick_smith, ggx",
        "smith_correlated": "smith, ggx",
        "smith_lambda": "Smith, gtr",
        "smith_separable": "smith_separable, ggx",
        "vcavity": "vcavity",
        "walter_correlated": "walter, ggx",
        "walter_separable": "walter_separable, ggx",
    },
    fresnel: {
        "conductor": "conductor",
        "dielectric": "dielectric",
        "dielectric_at": "dielectric",
        "dielectric_f0": "schlick_ior",
        "lazanyi": "lazanyi",
        "schlick": "schlick",
        "schlick_ior": "schlick_ior",
        "sgd_fresnel": "sgd_fresnel",
    },
}
"""What the packages of blocks export, and the part of the atlas that it is or is of."""
