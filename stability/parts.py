"""Every model and shared part as one function of a flat array of arguments, with the points that it is measured at."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array
from numpy.typing import NDArray

from .. import models, special
from ..angles import unit_vectors
from ..geometry import Geometry, from_sums
from ..models import fresnel, masking, ndf, parameters_of
from ..models.blocks import FRESNELS, MASKINGS, NDFS
from ..models.ndf.stretched import Stretched
from . import domain
from .domain import GRAZING, Range

Reals = NDArray[np.float64]
Program = Callable[[Array], Array]
Mask = Callable[[Reals], NDArray[np.bool_]]
"""Of points ``[n, arguments]``."""

_REFLECTANCE = (1e-40, 1e-20)
DIRECTIONS = tuple(f"{end}_{axis}" for end in ("wi", "wo") for axis in "xyz")
POLAR = np.radians([0, 1e-4, 1, 20, 40, 60, 75, 85, 89, 89.9, 89.995])
"""Polar angles of maps over directions, and of those whose reference is an integral."""
LOBE = np.radians([0, 1e-6, 1e-4, 1e-2, 0.1, 1, 5, 15, 30, 45, 60, 75, 85, 89, 89.9, 89.995])
"""Angles to the normal of maps of distributions."""


@dataclass(frozen=True, eq=False)
class Part:
    """One function of the atlas. ``cosines`` are the positions of arguments that are cosines or parts of directions."""

    group: str
    name: str
    ranges: dict[str, Range]
    formula: Program
    """Of what float32 rounds first: the parameters and what ``lift`` makes of the other arguments."""
    angle: str
    """What the columns of its maps are."""
    columns: Reals
    place: Callable[[Reals], Reals]
    """The arguments beyond ``ranges`` at given columns, ``[n]`` to ``[n, m]``."""
    scatter: Callable[[np.random.Generator, int], Reals]
    """The same drawn over the whole domain."""
    extra: tuple[str, ...] = ()
    integral: bool = False
    """Whether its reference is an integral or a series, and slow."""
    kink: Mask | None = None
    """Where it has no derivative by directions or angles; None for a smooth part."""
    varied: tuple[str, ...] = ()
    """The arguments that have a map."""
    lift: Callable[[Array], Array] = lambda x: x
    """The arguments beyond ``ranges`` as the formula takes them, ``[m]`` to ``[k]``."""
    whole: Program | None = None
    """The program that users call, where it is more than the formula of lifted arguments."""
    smallest: tuple[float, float] = (1e-280, 1e-150)
    """Values and slopes below count as zero: they have lost digits to underflow in a product on the way, or the reference
    has none of its own (a reflectance of 0 that it takes from the square of a rounding)."""

    def lifted(self, x: Array) -> Array:
        """All arguments of ``formula``."""
        count = len(self.ranges)
        return jnp.concatenate([x[:count], self.lift(x[count:])])

    def program(self, x: Array) -> Array:
        """The value at one point."""
        return self.formula(self.lifted(x)) if self.whole is None else self.whole(x)

    @property
    def arguments(self) -> tuple[str, ...]:
        """Names of all arguments."""
        return (*self.ranges, *self.extra)

    @property
    def cosines(self) -> tuple[int, ...]:
        """Positions of cosines and components of directions."""
        return tuple(k for k, a in enumerate(self.arguments) if a in DIRECTIONS or a == "cosine")

    def map_points(self, varied: str, rows: int) -> tuple[Reals, Reals]:
        """Values of ``varied`` ``[rows]`` and points ``[rows, columns, arguments]``; the other arguments are as usual."""
        values = self.ranges[varied].grid(rows)
        point = np.array([r.usual for r in self.ranges.values()])
        points = np.empty((rows, len(self.columns), len(self.arguments)))
        points[..., : len(point)] = point
        points[..., list(self.ranges).index(varied)] = values[:, None]
        points[..., len(point) :] = self.place(self.columns)
        return values, points

    def drawn(self, n: int, seed: int = 0) -> Reals:
        """``n`` points over the whole domain, corners included."""
        rng = np.random.default_rng(seed)
        return np.concatenate([domain.draw(self.ranges, rng, n), self.scatter(rng, n)], -1)


def _aside(turn: float, viewer: float) -> Callable[[Reals], Reals]:
    """Pairs with the light at a polar angle, the viewer at ``viewer`` times it, ``turn`` away from the mirror direction."""
    return lambda t: np.concatenate(
        [unit_vectors(t, 0.3), unit_vectors(np.minimum(t * viewer, GRAZING), 0.3 + np.pi - turn)], -1
    )


def _sums(x: Array) -> Array:
    """l + v, l - v, n.l and n.v of two directions, which differences next to the mirror direction leave exact."""
    return jnp.concatenate([x[:3] + x[3:], x[:3] - x[3:], x[2:3], x[5:]])


def _geometry(y: Array) -> Geometry:
    return from_sums(y[:3], y[3:6], y[6], y[7])


def _with_directions(y: Array) -> Geometry:
    return replace(_geometry(y), light=(y[:3] + y[3:6]) / 2, viewer=(y[:3] - y[3:6]) / 2)


def _sine_cosine(x: Array) -> Array:
    return jnp.concatenate([jnp.sin(x), jnp.cos(x)])


def _angle(theta: Reals) -> Reals:
    return theta[:, None]


def _any_angle(rng: np.random.Generator, n: int) -> Reals:
    """Angles from 0 to 89.995 degrees, half of them small, and both ends."""
    theta = np.where(rng.uniform(0, 1, n) < 0.5, 10 ** rng.uniform(-9, -1, n), rng.uniform(0, GRAZING, n))
    return np.asarray(np.where(rng.uniform(0, 1, n) < 0.1, rng.choice([0, GRAZING], n), theta)[:, None])


def _cosine(theta: Reals) -> Reals:
    return unit_vectors(theta, 0.3)[:, 2:]


def _any_cosine(rng: np.random.Generator, n: int) -> Reals:
    return _cosine(rng.choice(POLAR, n))


def _few_directions(rng: np.random.Generator, n: int) -> Reals:
    """Mirror, retro and other pairs of equal polar angles: one integral of masking each."""
    theta = rng.choice(POLAR, n)
    across = rng.choice([0, np.pi, np.pi + 1e-8, np.pi - 1e-3, 1.0, 2.5], n)
    return np.concatenate([unit_vectors(theta, 0.3), unit_vectors(theta, 0.3 + across)], -1)


def level(points: Reals) -> NDArray[np.bool_]:
    """Where n.l = n.v, and what depends on the larger of them has a kink."""
    found: NDArray[np.bool_] = np.abs(points[:, -4] - points[:, -1]) < 1e-6
    return found


def upright(points: Reals) -> NDArray[np.bool_]:
    """Where a direction is the normal, and its polar angle has no derivative."""
    found: NDArray[np.bool_] = np.maximum(points[:, -4], points[:, -1]) > 1 - 1e-9
    return found


def crease(points: Reals) -> NDArray[np.bool_]:
    """Where n.l = n.v, or the azimuths lie at right angles: what is not negative of their cosine has a kink."""
    across = points[:, -6] * points[:, -3] + points[:, -5] * points[:, -2]
    found: NDArray[np.bool_] = level(points) | (np.abs(across) < 1e-6)
    return found


def cusp(points: Reals) -> NDArray[np.bool_]:
    """Where the half vector is the normal."""
    found: NDArray[np.bool_] = np.hypot(points[:, -6] + points[:, -3], points[:, -5] + points[:, -2]) < 1e-12
    return found


def pole(points: Reals) -> NDArray[np.bool_]:
    """Where an angle is 0."""
    found: NDArray[np.bool_] = points[:, -1] == 0
    return found


def normal_incidence(points: Reals) -> NDArray[np.bool_]:
    """Where a cosine is 1."""
    found: NDArray[np.bool_] = points[:, -1] == 1
    return found


def abreast(points: Reals) -> NDArray[np.bool_]:
    """Where light and viewer are equally steep across the tangent, and the lower of them hides what the other does."""
    found: NDArray[np.bool_] = np.abs(points[:, -5] * points[:, -1] - points[:, -2] * points[:, -4]) < 1e-6
    return found


KINKS: dict[str, Mask] = {
    **dict.fromkeys(("abc", "ashikhmin_shirley", "low_microfacet", "max_phong"), level),
    **dict.fromkeys(("cook_torrance", "cook_torrance_blinn", "cook_torrance_gaussian"), level),
    **dict.fromkeys(("oren_nayar", "oren_nayar_full"), crease),
    "strauss": upright,
    "epd": cusp,
    "poulin_fournier": abreast,
}
"""By model: those that are not here are smooth."""

DIRECTED = ("poulin_fournier",)
"""Models that ask for the directions themselves."""

_SMALLEST = {"strauss": (1e-30, 1e-20), "schwenk": (1e-280, 1e-40)}
"""Models that may be black because of a reflectance of 0, or because the square of a smoothness is."""

INTEGRALS = ("gtr", "sgd", "epd", "abc", "blinn", "gaussian")
"""Distributions whose Smith masking has no closed form; the first three are those of a named model with that masking."""
SLOW = (*INTEGRALS[:3], "htsg", "stam_diffraction")
"""Models whose reference is an integral or a series."""


def _model(cls: type[models.BRDF]) -> Part:
    specs = parameters_of(cls)
    count = len(specs)
    geometry = _with_directions if cls.name in DIRECTED else _geometry

    def whole(x: Array) -> Array:
        numbers = {p.name: x[k][None] if p.per_channel else x[k] for k, p in enumerate(specs)}
        return cls(**numbers)(x[count : count + 3], x[count + 3 :])[0]

    def formula(y: Array) -> Array:
        g = geometry(y[count:])
        return jnp.broadcast_to(cls(**{p.name: y[k] for k, p in enumerate(specs)}).evaluate(g), g.shape)

    ranges = domain.ranges_of(specs, cls.name)
    # of what comes several times, as lobes do, the first
    shapes = tuple(p.name for p in specs if not p.linear and p.name.rpartition("_")[2] not in _FURTHER)
    slow = cls.name in SLOW
    return Part(
        "models",
        cls.__name__,
        ranges,
        formula,
        "polar angle of the light",
        POLAR,
        _aside(0.3, 1.0 if slow else 0.8),
        _few_directions if slow else domain.draw_directions,
        DIRECTIONS,
        slow,
        kink=KINKS.get(cls.name),
        varied=shapes or ("diffuse",),
        lift=_sums,
        whole=whole,
        smallest=_SMALLEST.get(cls.name, _REFLECTANCE if "ior" in ranges else Part.smallest),
    )


_FURTHER = {str(k) for k in range(2, 20)}


def _declared(fields: Mapping[str, Any], owner: str) -> dict[str, Range]:
    """Ranges of the parameters that a block brings."""
    return domain.ranges_of((replace(f.metadata["parameter"], name=n) for n, f in fields.items()), owner)


def _of_model(name: str, form: int = 0) -> dict[str, Range]:
    """Ranges of what bends the lobe of a model."""
    return domain.ranges_of((p for p in parameters_of(models.MODELS[name][form]) if not p.linear), name)


def _ndf(name: str, ranges: dict[str, Range], density: Callable[..., Any]) -> Part:
    """A density of theta_m, ``density(sin^2, cos^2, *parameters)``."""

    def formula(y: Array) -> Array:
        out: Array = density(y[-2] ** 2, y[-1] ** 2, *y[:-2])
        return out

    varied, extra = tuple(ranges), ("theta",)
    kink = pole if name == "epd" else None
    return Part(
        "ndf", name, ranges, formula, "theta_m", LOBE, _angle, _any_angle, extra, kink=kink, varied=varied, lift=_sine_cosine
    )


def _directed(group: str, name: str, ranges: dict[str, Range], value: Callable[..., Any], kink: Mask | None = None) -> Part:
    """A function of two directions, ``value(geometry, *parameters)``."""

    def formula(y: Array) -> Array:
        out: Array = value(_geometry(y[-8:]), *y[:-8])
        return out

    place, scatter, varied = _aside(0.3, 0.8), domain.draw_directions, tuple(ranges)
    angle = "polar angle of the light"
    return Part(group, name, ranges, formula, angle, POLAR, place, scatter, DIRECTIONS, kink=kink, varied=varied, lift=_sums)


def _anisotropic_gaussian(g: Geometry, alpha_x: Array, alpha_y: Array) -> Array:
    slope_x2, slope_y2 = g.slopes()
    return ndf.anisotropic_gaussian(slope_x2, slope_y2, alpha_x, alpha_y)


def _smith(name: str) -> Part:
    make = NDFS[name].make
    ranges = _declared(NDFS[name].parameters, name)

    def formula(y: Array) -> Array:
        """Projected area of the facets that face the viewer, n.v/G1: what models divide by, and regular at grazing."""
        return y[-1] + masking.averted_area(make(*y[:-1]), y[-1])

    angle, slow = "polar angle", name in INTEGRALS
    # a power of the sine that is no square, below gamma = 2 or for a small exponent
    kink = normal_incidence if name in ("student_t", "blinn") else None
    return Part(
        "masking",
        f"Smith, {name}",
        ranges,
        formula,
        angle,
        POLAR,
        _cosine,
        _any_cosine,
        ("cosine",),
        slow,
        kink,
        tuple(ranges),
    )


def _masking(name: str) -> Part:
    """V of a block, where it depends on the distribution that of GGX."""
    block = MASKINGS[name]
    of_ggx = block.needs_alpha or block.integral
    ranges = _declared(NDFS["ggx"].parameters, "ggx") if of_ggx else {}
    kink = level if name in ("vcavity", "half_vector") else None

    def value(g: Geometry, *shape: Array) -> Array:
        return jnp.broadcast_to(block.visibility(ndf.GGX(*shape) if shape else None, g), g.shape)

    return _directed("masking", f"{name}, ggx" if of_ggx else name, ranges, value, kink)


def _fresnel(name: str, ranges: dict[str, Range], value: Callable[..., Any]) -> Part:
    """A reflectance, ``value(geometry, *parameters)``."""

    def formula(y: Array) -> Array:
        one = jnp.ones_like(y[-1])
        out: Array = value(Geometry(one, one, one, 0 * one, y[-1], y[-2] ** 2), *y[:-2])
        return out

    varied, extra = tuple(n for n in ranges if n != "specular") or tuple(ranges), ("theta",)
    return Part(
        "fresnel",
        name,
        ranges,
        formula,
        "theta_d",
        LOBE,
        _angle,
        _any_angle,
        extra,
        varied=varied,
        lift=_sine_cosine,
        smallest=_REFLECTANCE if "ior" in ranges else Part.smallest,
    )


def _special(name: str, ranges: dict[str, Range], formula: Program, second: str, columns: Reals) -> Part:
    """A function of its ranges and, where ``second`` names one, of an argument that runs along the columns."""
    extra = (second,) if second else ()

    def place(c: Reals) -> Reals:
        return c[:, None] if second else np.empty((len(c), 0))

    def scatter(rng: np.random.Generator, n: int) -> Reals:
        return domain.draw({second: _SGD["p"]}, rng, n) if second else np.empty((n, 0))

    return Part("special", name, ranges, formula, second or "any", columns, place, scatter, extra, varied=tuple(ranges)[:1])


_NO_COLUMNS = np.zeros(1)
_EXPM1 = Range(-50, 50, 0, log=False, special=(0.0, 1.0, -1.0))
_LOG1P = Range(-0.99, 50, 0, log=False, special=(0.0, 0.1, -0.1))

_SGD = _of_model("sgd")
_WIDTHS = _of_model("ward", 1)

PARTS: tuple[Part, ...] = (
    *(_model(c) for variants in models.MODELS.values() for c in variants),
    *(
        _ndf(name, _declared(d.parameters, name), lambda s2, c2, *shape, make=d.make: make(*shape)(s2, c2))
        for name, d in NDFS.items()
    ),
    _ndf("power_cosine", _of_model("ashikhmin_shirley"), ndf.power_cosine),
    _ndf("gaussian of slopes", _of_model("ward"), lambda s2, c2, a: ndf.gaussian(s2 / c2, a)),
    _directed(
        "ndf",
        "power_cosine_anisotropic",
        _of_model("ashikhmin_shirley", 1),
        lambda g, ex, ey: ndf.power_cosine_anisotropic(g.h_x2, g.h_y2, g.cos2_h, ex, ey),
    ),
    _directed("ndf", "anisotropic_gaussian", _WIDTHS, _anisotropic_gaussian),
    _directed("ndf", "stretched ggx", _WIDTHS, lambda g, ax, ay: Stretched(ndf.GGX(jnp.sqrt(ax * ay)), ax, ay).density(g)),
    *(_smith(name) for name in NDFS),
    *(_masking(name) for name in MASKINGS),
    *(_fresnel(name, _declared(f.parameters, name), f.value) for name, f in FRESNELS.items()),
    _fresnel(
        "sgd_fresnel",
        domain.ranges_of((p for p in parameters_of(models.MODELS["sgd"][0]) if p.name in ("f0", "f1")), "sgd"),
        lambda g, f0, f1: fresnel.sgd_fresnel(f0, f1, g),
    ),
    _special("expm1_ratio", {"x": _EXPM1}, lambda x: special.expm1_ratio(x[0]), "", _NO_COLUMNS),
    _special("log1p_ratio", {"x": _LOG1P}, lambda x: special.log1p_ratio(x[0]), "", _NO_COLUMNS),
    _special(
        "upper incomplete gamma",
        {"alpha": _SGD["alpha"]},
        lambda x: ndf.SGD(x[0], x[1]).integral(),
        "p",
        np.array([-10, -3.5, -1, 0, 0.5, 1, 1 + 1e-9, 2, 7, 20, 40, 60.0]),
    ),
)
"""All parts, group by group."""

__all__ = ["DIRECTIONS", "LOBE", "PARTS", "POLAR", "Part", "crease", "level", "upright"]
