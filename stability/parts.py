"""Every model and shared part as one function of a flat array of arguments, with the points that it is measured at."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array
from numpy.typing import NDArray

from .. import models, special
from ..geometry import Geometry, from_sums
from ..models import fresnel, masking, ndf, parameters_of
from . import domain
from .domain import GRAZING, Range

Reals = NDArray[np.float64]
Program = Callable[[Array], Array]

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
    """Whether its reference is an integral, and slow."""
    kinked: bool = False
    """Whether it has no derivative in the directions where n.l = n.v."""
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
        [domain.unit(t, 0.3), domain.unit(np.minimum(t * viewer, GRAZING), 0.3 + np.pi - turn)], -1
    )


def _sums(x: Array) -> Array:
    """l + v, l - v, n.l and n.v of two directions, which differences next to the mirror direction leave exact."""
    return jnp.concatenate([x[:3] + x[3:], x[:3] - x[3:], x[2:3], x[5:]])


def _geometry(y: Array) -> Geometry:
    return from_sums(y[:3], y[3:6], y[6], y[7])


def _sine_cosine(x: Array) -> Array:
    return jnp.concatenate([jnp.sin(x), jnp.cos(x)])


def _angle(theta: Reals) -> Reals:
    return theta[:, None]


def _any_angle(rng: np.random.Generator, n: int) -> Reals:
    """Angles from 0 to 89.995 degrees, half of them small, and both ends."""
    theta = np.where(rng.uniform(0, 1, n) < 0.5, 10 ** rng.uniform(-9, -1, n), rng.uniform(0, GRAZING, n))
    return np.asarray(np.where(rng.uniform(0, 1, n) < 0.1, rng.choice([0, GRAZING], n), theta)[:, None])


def _cosine(theta: Reals) -> Reals:
    return domain.unit(theta, 0.3)[:, 2:]


def _any_cosine(rng: np.random.Generator, n: int) -> Reals:
    return _cosine(rng.choice(POLAR, n))


def _few_directions(rng: np.random.Generator, n: int) -> Reals:
    """Mirror, retro and other pairs of equal polar angles: one integral of masking each."""
    theta = rng.choice(POLAR, n)
    across = rng.choice([0, np.pi, np.pi + 1e-8, np.pi - 1e-3, 1.0, 2.5], n)
    return np.concatenate([domain.unit(theta, 0.3), domain.unit(theta, 0.3 + across)], -1)


def _model(cls: type[models.BRDF], integral: bool) -> Part:
    specs = parameters_of(cls)
    count = len(specs)

    def whole(x: Array) -> Array:
        numbers = {p.name: x[k][None] if p.per_channel else x[k] for k, p in enumerate(specs)}
        return cls(**numbers)(x[count : count + 3], x[count + 3 :])[0]

    def formula(y: Array) -> Array:
        g = _geometry(y[count:])
        return jnp.broadcast_to(cls(**{p.name: y[k] for k, p in enumerate(specs)}).evaluate(g), g.shape)

    name = cls.__name__
    ranges = domain.PARAMETERS[name]
    shapes = tuple(n for n in ranges if n not in ("diffuse", "specular", "f0", "f1"))
    place = _aside(0.3, 1.0 if integral else 0.8)
    scatter = _few_directions if integral else domain.draw_directions
    return Part(
        "models",
        name,
        {p.name: ranges[p.name] for p in specs},
        formula,
        "polar angle of the light",
        POLAR,
        place,
        scatter,
        DIRECTIONS,
        integral,
        kinked=name in ("ABC", "AshikhminShirley", "AshikhminShirleyAnisotropic"),
        varied=shapes or ("diffuse",),
        lift=_sums,
        whole=whole,
        smallest=_REFLECTANCE if "ior" in ranges else Part.smallest,
    )


def _ndf(name: str, shape: str, density: Callable[..., Any]) -> Part:
    """A density of theta_m, ``density(*parameters, sin^2, cos^2)``."""
    ranges = domain.SHAPES[shape]

    def formula(y: Array) -> Array:
        out: Array = density(*y[:-2], y[-2] ** 2, y[-1] ** 2)
        return out

    varied, extra = tuple(ranges), ("theta",)
    return Part("ndf", name, ranges, formula, "theta_m", LOBE, _angle, _any_angle, extra, varied=varied, lift=_sine_cosine)


def _anisotropic(name: str, shape: str, density: Callable[..., Any]) -> Part:
    """A density of the half vector, ``density(*parameters, geometry)``."""
    ranges = domain.SHAPES[shape]

    def formula(y: Array) -> Array:
        out: Array = density(*y[:-8], _geometry(y[-8:]))
        return out

    place, scatter = _aside(0.3, 0.8), domain.draw_directions
    angle, varied = "polar angle of the light", tuple(ranges)
    return Part("ndf", name, ranges, formula, angle, POLAR, place, scatter, DIRECTIONS, varied=varied, lift=_sums)


def _smith(shape: str, lobe: type) -> Part:
    def formula(y: Array) -> Array:
        """Projected area of the facets that face the viewer, n.v/G1: what models divide by, and regular at grazing."""
        return y[2] + masking.averted_area(lobe(y[0], y[1]), y[2])

    ranges = domain.SHAPES[shape]
    angle, name = "polar angle", f"Smith, {shape}"
    return Part(
        "masking", name, ranges, formula, angle, POLAR, _cosine, _any_cosine, ("cosine",), True, varied=tuple(ranges)
    )


def _fresnel(name: str) -> Part:
    ranges = domain.FRESNEL[name]
    function = getattr(fresnel, name)

    def formula(y: Array) -> Array:
        one = jnp.ones_like(y[-1])
        out: Array = function(*y[:-2], Geometry(one, one, one, 0 * one, y[-1], y[-2] ** 2))
        return out

    varied, extra = tuple(ranges)[:1], ("theta",)
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
        smallest=_REFLECTANCE if name == "dielectric" else Part.smallest,
    )


def _special(name: str, ranges: dict[str, Range], formula: Program, second: str, columns: Reals) -> Part:
    """A function of its ranges and, where ``second`` names one, of an argument that runs along the columns."""
    extra = (second,) if second else ()

    def place(c: Reals) -> Reals:
        return c[:, None] if second else np.empty((len(c), 0))

    def scatter(rng: np.random.Generator, n: int) -> Reals:
        return domain.draw({second: domain.PARAMETERS["SGD"]["p"]}, rng, n) if second else np.empty((n, 0))

    return Part("special", name, ranges, formula, second or "any", columns, place, scatter, extra, varied=tuple(ranges)[:1])


_NO_COLUMNS = np.zeros(1)
_EXPM1 = Range(-50, 50, 0, log=False, special=(0.0, 1.0, -1.0))
_LOG1P = Range(-0.99, 50, 0, log=False, special=(0.0, 0.1, -0.1))

PARTS: tuple[Part, ...] = (
    *(
        _model(c, c.__name__ in ("GTR", "SGD"))
        for variants in models.MODELS.values()
        for c in variants
        if c.__name__ in domain.PARAMETERS
    ),
    _ndf("GTR", "GTR", lambda a, g, s2, c2: ndf.GTR(a, g)(s2, c2)),
    _ndf("SGD", "SGD", lambda a, p, s2, c2: ndf.SGD(a, p)(s2, c2)),
    _ndf("ABC", "ABC", lambda b, c, s2, c2: ndf.ABC(b, c)(s2, c2)),
    _ndf("power_cosine", "AshikhminShirley", lambda e, s2, c2: ndf.power_cosine(s2, c2, e)),
    _ndf("gaussian", "Ward", lambda a, s2, c2: ndf.gaussian(s2 / c2, a)),
    _anisotropic(
        "power_cosine_anisotropic",
        "AshikhminShirleyAnisotropic",
        lambda ex, ey, g: ndf.power_cosine_anisotropic(g.tangential()[0], g.tangential()[1], g.cos2_h, ex, ey),
    ),
    _anisotropic(
        "anisotropic_gaussian",
        "WardAnisotropic",
        lambda ax, ay, g: ndf.anisotropic_gaussian(g.slopes()[0], g.slopes()[1], ax, ay),
    ),
    _smith("GTR", ndf.GTR),
    _smith("SGD", ndf.SGD),
    Part(
        "masking",
        "vcavity",
        {},
        lambda y: masking.vcavity(_geometry(y)),
        "polar angle of the light",
        POLAR,
        _aside(0.3, 0.8),
        domain.draw_directions,
        DIRECTIONS,
        kinked=True,
        lift=_sums,
    ),
    *(_fresnel(name) for name in domain.FRESNEL),
    _special("expm1_ratio", {"x": _EXPM1}, lambda x: special.expm1_ratio(x[0]), "", _NO_COLUMNS),
    _special("log1p_ratio", {"x": _LOG1P}, lambda x: special.log1p_ratio(x[0]), "", _NO_COLUMNS),
    _special(
        "upper incomplete gamma",
        {"alpha": domain.SHAPES["SGD"]["alpha"]},
        lambda x: ndf.SGD(x[0], x[1]).integral(),
        "p",
        np.array([-10, -3.5, -1, 0, 0.5, 1, 1 + 1e-9, 2, 7, 20, 40, 60.0]),
    ),
)
"""All parts, group by group."""

__all__ = ["DIRECTIONS", "LOBE", "PARTS", "POLAR", "Part"]
