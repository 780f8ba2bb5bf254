"""Coordinates a fit works in: where each model's valleys are straight and its bounds are a box.

Models know physical parameters only. A chart maps them to coordinates and back, one channel at a time. The plain chart of
any model takes logarithms where a parameter says so; the models whose plain parameters trade off along curved or infinite
valleys have a chart of their own (the reason stands at each).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..models import BRDF, parameters_of
from ..models.abc import ABC
from ..models.ashikhmin_shirley import AshikhminShirley, AshikhminShirleyAnisotropic
from ..models.base import Parameter
from ..models.fresnel import dielectric_f0
from ..models.htsg import HTSG
from ..models.parts import Composition
from ..models.sgd import SGD
from ..models.stam_diffraction import StamDiffraction
from ..programs import program

Scalars = dict[str, Array]
Map = Callable[[Scalars], Scalars]


@dataclass(frozen=True)
class Coordinate:
    """One coordinate: the parameter it stands for in messages, its box, and whether the BRDF is affine in it.

    A shared coordinate ``folds`` if the shape that it makes turns back inside its box: the derivative vanishes there, and
    an optimum beyond the turn lies where it does.
    """

    name: str
    parameter: str
    per_channel: bool
    lower: float
    upper: float
    linear: bool
    folds: bool = False


@dataclass(frozen=True)
class Chart:
    """Coordinates of a model and the maps to and from its parameters (for one channel, all scalars)."""

    cls: type[BRDF]
    coordinates: tuple[Coordinate, ...]
    to_parameters: Map
    from_parameters: Map
    end: Callable[[dict[str, float]], bool] | None = None
    """Whether shared coordinates lie where the model's next chart takes over; None if there is none."""

    @property
    def channel(self) -> tuple[Coordinate, ...]:
        """Coordinates that each channel has its own of."""
        return tuple(c for c in self.coordinates if c.per_channel)

    @property
    def shared(self) -> tuple[Coordinate, ...]:
        """Coordinates that all channels share."""
        return tuple(c for c in self.coordinates if not c.per_channel)

    @property
    def own_lobes(self) -> bool:
        """Whether channels differ in more than what the BRDF is affine in."""
        return any(not c.linear for c in self.channel)

    def vector(self, channels: int) -> list[tuple[Coordinate, int | None]]:
        """Order of the vector a solver works on: each channel's coordinates, channel by channel, then the shared ones."""
        own = [(c, k) for k in range(channels) for c in self.channel]
        return [*own, *((c, None) for c in self.shared)]

    def split(self, x: Array, channels: int) -> tuple[Array, Array]:
        """``(own [C, K], shared [S])`` of a vector."""
        k = len(self.channel)
        return x[: channels * k].reshape(channels, k), x[channels * k :]

    def parameters(self, own: Sequence[Array] | Array, shared: Sequence[Array] | Array) -> Scalars:
        """Parameters of one channel from its own coordinates ``[K]`` and the shared ones ``[S]``."""
        values = {c.name: own[i] for i, c in enumerate(self.channel)} | {
            c.name: shared[i] for i, c in enumerate(self.shared)
        }
        return self.to_parameters(values)

    def model(self, own: Sequence[Array] | Array, shared: Sequence[Array] | Array) -> BRDF:
        """The model of one channel, its parameters scalars."""
        return self.cls(**self.parameters(own, shared))

    def vectors(self, proposals: Sequence[Mapping[str, np.ndarray]], channels: int) -> np.ndarray:
        """A vector ``[n]`` for each of some sets of parameters (arrays ``[]`` or ``[C]``), wherever it lies."""
        names = list(proposals[0])
        each = {n: np.stack([np.broadcast_to(np.asarray(p[n], float), channels) for p in proposals]) for n in names}
        found = {n: np.asarray(v) for n, v in _coordinates(self, each).items()}
        return np.stack([found[c.name][:, k or 0] for c, k in self.vector(channels)], -1)

    def raw_coordinates(self, parameters: Mapping[str, np.ndarray], channels: int) -> np.ndarray:
        """Vector of given parameters (arrays ``[]`` or ``[C]``)."""
        vector: np.ndarray = self.vectors([parameters], channels)[0]
        return vector

    def coordinates_of(self, parameters: Mapping[str, np.ndarray], channels: int) -> np.ndarray:
        """Vector of given parameters, moved into the box where outside."""
        return into(self.raw_coordinates(parameters, channels), *self.box(channels))

    def continues(self, x: np.ndarray, channels: int) -> bool:
        """Whether an optimum at x may go on in the next chart."""
        shared = x[channels * len(self.channel) :]
        return self.end is not None and self.end({c.name: float(v) for c, v in zip(self.shared, shared, strict=True)})

    def box(self, channels: int, bounds: Mapping[str, tuple[float, float]] | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds of a vector. ``bounds`` of parameters, in a plain chart, replace those of the search."""
        order = self.vector(channels)
        own = {p.name: _ends(p, *bounds[p.name]) for p in parameters_of(self.cls) if p.name in bounds} if bounds else {}
        ends = [own.get(c.parameter, (c.lower, c.upper)) for c, _ in order]
        return np.array([lower for lower, _ in ends]), np.array([upper for _, upper in ends])


@program
def _coordinates(chart: Chart, parameters: Mapping[str, Any]) -> Scalars:
    return chart.from_parameters(dict(parameters))


def into(x: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Vectors moved into a box where outside; what is not a number, to 0."""
    inside: np.ndarray = np.clip(np.nan_to_num(x, nan=0.0, posinf=1e300, neginf=-1e300), lower, upper)
    return inside


def _ends(p: Parameter, lower: float, upper: float) -> tuple[float, float]:
    """Ends of a parameter's coordinate; a logarithm begins with the smallest number that a formula can take, not with 0."""
    return (float(np.log(max(lower, 1e-300))), float(np.log(upper))) if p.log else (float(lower), float(upper))


def plain_chart(cls: type[BRDF]) -> Chart:
    """Each parameter its own coordinate, logarithms where it says so."""
    logs = frozenset(p.name for p in parameters_of(cls) if p.log)
    coordinates = [Coordinate(p.name, p.name, p.per_channel, *_ends(p, *p.search), p.linear) for p in parameters_of(cls)]

    def to_parameters(x: Scalars) -> Scalars:
        return {n: jnp.exp(v) if n in logs else v for n, v in x.items()}

    def from_parameters(p: Scalars) -> Scalars:
        return {n: jnp.log(v) if n in logs else v for n, v in p.items()}

    return Chart(cls, tuple(coordinates), to_parameters, from_parameters)


def _rewritten(chart: Chart, to_parameters: Map, from_parameters: Map, **boxes: tuple[float, float]) -> Chart:
    """A chart with other maps, and another box for the coordinates named."""
    coordinates = tuple(
        replace(c, lower=boxes[c.name][0], upper=boxes[c.name][1]) if c.name in boxes else c for c in chart.coordinates
    )
    return Chart(chart.cls, coordinates, to_parameters, from_parameters)


def _composed_chart(cls: type[Composition], narrow: bool = True) -> Chart:
    """Of a composition of effects: those of its tail and its trade-off, where it has them."""
    chart = plain_chart(cls)
    # A refit of the colours settles these too, though the BRDF is affine in them only while others are held.
    coordinates = tuple(replace(c, linear=c.linear or c.name in ("scatter", "specular", "share")) for c in chart.coordinates)
    chart = replace(chart, coordinates=coordinates)
    if {"alpha", "gamma"} <= {c.name for c in coordinates}:
        chart = _with_tail(chart, narrow)
    if "second_lobe" in cls.effects and not {"tail", "anisotropy", "dispersion"} & set(cls.effects):
        chart = _with_order(chart)
    return _with_trade_off(chart) if "trade_off" in cls.effects else chart


def _with_order(chart: Chart) -> Chart:
    """The second lobe by how much wider it is than the first: two lobes of one kind could change places."""

    def to_parameters(x: Scalars) -> Scalars:
        p = chart.to_parameters(x)
        return {**p, "alpha_2": p["alpha_2"] * p["alpha"]}

    def from_parameters(p: Scalars) -> Scalars:
        return chart.from_parameters({**p, "alpha_2": p["alpha_2"] / p["alpha"]})

    return _rewritten(chart, to_parameters, from_parameters, alpha_2=(0.0, float(np.log(1e10))))


def _with_tail(chart: Chart, narrow: bool) -> Chart:
    """Alpha of GTR by the logarithm of |ln alpha^2|, on either side of 1.

    As gamma -> infinity only K = gamma |ln alpha^2| is determined. In (ln alpha, ln gamma) that valley bends
    exponentially (condition 1e7 to 1e9); in (ln |ln alpha^2|, ln gamma) it is a straight line.
    """
    sign = -0.5 if narrow else 0.5
    limit = abs(2 * np.log(1e-9 if narrow else 10.0))

    def to_parameters(x: Scalars) -> Scalars:
        p = chart.to_parameters(x)
        return {**p, "alpha": jnp.exp(sign * p["alpha"])}

    def from_parameters(p: Scalars) -> Scalars:
        # on the wrong side of 1 the nearest point of this chart is its end at 1
        size = jnp.maximum(jnp.log(p["alpha"]) / sign, 1e-9)
        return chart.from_parameters({**p, "alpha": size})

    def flat(x: dict[str, float]) -> bool:
        """Whether D is all but constant, K < 0.1: what lies beyond has alpha on the other side of 1."""
        return bool(x["alpha"] + x["gamma"] < np.log(0.1))

    box = (float(np.log(1e-9)), float(np.log(limit)))
    tailed = _rewritten(chart, to_parameters, from_parameters, alpha=box)
    return tailed if tailed.own_lobes else replace(tailed, end=flat)


def _with_trade_off(chart: Chart) -> Chart:
    """Diffuse times what the surface leaves of it in place of diffuse, which is not determined as it leaves nothing."""

    def to_parameters(x: Scalars) -> Scalars:
        p = chart.to_parameters(x)
        return {**p, "diffuse": p["diffuse"] / (1 - p["specular"])}

    def from_parameters(p: Scalars) -> Scalars:
        return chart.from_parameters({**p, "diffuse": p["diffuse"] * (1 - p["specular"])})

    return _rewritten(chart, to_parameters, from_parameters)


def _abc_chart() -> Chart:
    """The lobe's scale by specular F(0), and ior - 1 by its logarithm.

    F(0) runs from 1e-7 to 1 with the index; specular alone would have to run against it by as much. F/F(0) at some
    fixed angle falls with the index up to about 9 and returns to 1 beyond it: there it folds.
    """
    plain = plain_chart(ABC)

    def to_parameters(x: Scalars) -> Scalars:
        ior = 1 + jnp.exp(x["ior"])
        return {
            "diffuse": x["diffuse"],
            "specular": x["specular"] / dielectric_f0(ior),
            "b": jnp.exp(x["b"]),
            "c": jnp.exp(x["c"]),
            "ior": ior,
        }

    def from_parameters(p: Scalars) -> Scalars:
        return {
            "diffuse": p["diffuse"],
            "specular": p["specular"] * dielectric_f0(p["ior"]),
            "b": jnp.log(p["b"]),
            "c": jnp.log(p["c"]),
            "ior": jnp.log(p["ior"] - 1),
        }

    chart = _rewritten(plain, to_parameters, from_parameters, ior=(float(np.log(1e-3)), float(np.log(1e3))))
    coordinates = tuple(replace(c, folds=c.name == "ior") for c in chart.coordinates)
    return replace(chart, coordinates=coordinates)


def _wave_chart(cls: type[BRDF]) -> Chart:
    """The lobe's scale by specular F(0), which a fit can tell from the index, while specular would run against it: F(0)
    runs from 2.5e-5 to 1.
    """
    plain = plain_chart(cls)

    def to_parameters(x: Scalars) -> Scalars:
        p = plain.to_parameters(x)
        return {**p, "specular": p["specular"] / dielectric_f0(p["ior"])}

    def from_parameters(p: Scalars) -> Scalars:
        return plain.from_parameters({**p, "specular": p["specular"] * dielectric_f0(p["ior"])})

    return _rewritten(plain, to_parameters, from_parameters)


def _sgd_chart() -> Chart:
    """specular f0 and specular f1 in place of f0 and f1: the BRDF is linear in them, and some channels have their optimum
    at specular -> 0 with specular f0 finite, where f0 is infinite.
    """
    plain = plain_chart(SGD)

    def to_parameters(x: Scalars) -> Scalars:
        s = x["specular"]
        return {**x, "alpha": jnp.exp(x["alpha"]), "f0": x["f0"] / s, "f1": x["f1"] / s}

    def from_parameters(p: Scalars) -> Scalars:
        s = p["specular"]
        return {**p, "alpha": jnp.log(p["alpha"]), "f0": p["f0"] * s, "f1": p["f1"] * s}

    # The derivative by specular is a difference of terms of size f0: at 1e-12 it is rounding, and the search led astray
    # (tests/test_hostile.py::test_hostile_tables).
    return _rewritten(plain, to_parameters, from_parameters, specular=(1e-10, float("inf")))


@lru_cache(maxsize=256)
def charts(cls: type[BRDF], plain: bool = False) -> tuple[Chart, ...]:
    """The charts a fit of ``cls`` searches in, cached so that a second fit finds its program compiled.

    ``plain`` asks for one coordinate a parameter, which held or bounded parameters need.
    """
    if not plain:
        if issubclass(cls, Composition) and cls.effects:
            chart = _composed_chart(cls)
            return (chart, _composed_chart(cls, narrow=False)) if chart.end else (chart,)
        if getattr(cls, "blocks", ("",))[0] == "gtr":
            return tuple(_with_tail(plain_chart(cls), narrow) for narrow in (True, False))
        if cls is ABC:
            return (_abc_chart(),)
        if cls is SGD:
            return (_sgd_chart(),)
        if cls in (HTSG, StamDiffraction):
            return (_wave_chart(cls),)
        if cls in (AshikhminShirley, AshikhminShirleyAnisotropic):
            return (_with_trade_off(plain_chart(cls)),)
    return (plain_chart(cls),)
