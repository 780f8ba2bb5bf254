"""Fits of many sets of effects by one program: that of the model of all of them, in which each can be left out.

A set as a model of its own takes the compiler seconds, and a search compares dozens. Here a set is the model of all effects
with switches at 0, other effects at the values at which they do nothing (:attr:`.Effect.neutral`), and the rest free. It is
for the search only: what the search ends with is fitted, rendered and timed as the model that it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..fitting.starts import Summary, starts
from ..models import BRDF, build, parameter_values, parameters_of
from ..models.effects import EFFECTS, SWITCH, SWITCHED, compose, in_order, switchable
from ..models.effects.effect import Values
from .fitted_pixels import Shown
from .linear import Linear, factor
from .scene import Reals

STEPS = 30
RTOL = 1e-5
"""Relative decrease of the cost in a step below which a search ends: the pictures then differ by far less than is seen."""
POLISHED = 4
"""Starts that are polished: that with the least error, and those with the least once what is affine is fitted."""
PROPOSED = 12
"""Starts that the data suggests where there are others, at most."""
AFFINE = ("diffuse", "specular", "share", "scatter", "retro")
"""Parameters that such a refit takes: the model is affine in each of them while the others are held."""


class Fitted(NamedTuple):
    """A set of effects at an optimum."""

    effects: tuple[str, ...]
    values: Values
    """Parameters of the model of all effects."""
    error: float
    """RMS ΔE ITP of the pixels that were fitted, and of cells beside them (:mod:`.fitted_pixels`)."""


@dataclass(frozen=True)
class _Free:
    """Coordinates that a set of effects leaves free: each a group of those of the whole model, which move together."""

    groups: list[list[int]]
    affine: NDArray[np.bool_]

    def of(self, x: Reals) -> Reals:
        return np.array([x[g].mean() for g in self.groups])

    def put(self, y: Reals, x: Reals) -> Reals:
        out = x.copy()
        for g, v in zip(self.groups, y, strict=True):
            out[g] = v
        return out

    def factor(self, products: Reals) -> Reals:
        """Of [J r] by what is free."""
        moves = np.zeros((len(products), len(self.groups) + 1))
        for k, g in enumerate(self.groups):
            moves[g, k] = 1
        moves[-1, -1] = 1
        return factor(moves.T @ products @ moves)


class _Start(NamedTuple):
    """Where a fit starts: a point, its cost, and the point with what the model is affine in fitted."""

    x: Reals
    cost: float
    refitted: Reals
    promise: float
    """What the slopes at x say of the cost there."""


class Screen:
    """Fits of subsets of the effects ``among``; without switches of all of them only, by the program of just that model."""

    def __init__(self, among: Sequence[str], data: Shown, summary: Summary, switches: bool = True) -> None:
        self.among = in_order(among)
        self.cls = switchable(*self.among) if switches else compose(*self.among)
        self.switches = {name: SWITCH + name for name in SWITCHED if switches and name in self.among}
        self.linear = Linear(self.cls, data, tuple(self.switches.values()))
        self.summary = summary
        self.lower, self.upper = self.linear.chart.box(self.linear.channels)
        c, k = self.linear.channels, len(self.linear.own)
        self.places = {n: [i * k + j for i in range(c)] for j, n in enumerate(self.linear.own)}
        self.places |= {n: [c * k + j] for j, n in enumerate(self.linear.shared)}
        self.specs = {p.name: p for p in parameters_of(self.cls)}

    def fit(self, effects: Iterable[str], near: Sequence[Fitted] = ()) -> Fitted:
        """Fit a set of effects from where fits of smaller or larger sets ended, and, where those lead to a model that
        differs by more than its values, from what the data suggests.

        The error is no larger than that of a fit in ``near`` whose effects are among these and need no switch.
        """
        names = in_order(effects)
        begin = [v for fitted in near for v in self._beside(names, fitted)]
        if not any(self._nested(names, fitted) for fitted in near):
            proposed = list(starts(compose(*names), self.summary, 0))
            fewer = proposed[:: -(-len(proposed) // PROPOSED)] if near else proposed
            begin += [self._whole(names, v) for v in fewer]
        free = self._free(names)
        begun = [self._begun(self._vector(v), free) for v in begin]
        safe = min(begun, key=lambda start: start.cost)
        ends = [safe, *sorted((s for s in begun if s is not safe), key=lambda start: start.promise)]
        cost, x = min((self._polished(start, free) for start in ends[:POLISHED]), key=lambda end: end[0])
        return Fitted(names, self._values(x), float(np.sqrt(cost)))

    def extended(self, effects: Iterable[str], fitted: Fitted) -> Fitted:
        """The same values as a fit with more effects, all of which they leave without anything to do."""
        names = in_order(effects)
        return Fitted(names, self._whole(names, self._neutral(names, fitted)), fitted.error)

    def model(self, fitted: Fitted) -> BRDF:
        """A fit as the model of all effects, with the others left out by their values: pictures of many by one program."""
        return build(self.cls, dict(fitted.values))

    def _whole(self, names: tuple[str, ...], values: Values) -> Values:
        """Parameters of the whole model that make it that of some effects."""
        full = {n: np.asarray(p.default) for n, p in self.specs.items()} | values
        have = frozenset(names)
        for name in self.among:
            if name in self.switches:
                full[self.switches[name]] = np.asarray(float(name in names))
            elif name not in have:
                found = EFFECTS[name].neutral(full, have)
                assert found is not None
                full = found
        return full

    def _nested(self, names: tuple[str, ...], near: Fitted) -> bool:
        """Whether the effects that are switched are the same."""
        return {n for n in names if n in self.switches} == {n for n in near.effects if n in self.switches}

    def _neutral(self, names: tuple[str, ...], fitted: Fitted) -> Values:
        """The values of a fit at which further effects do nothing, where there are such values."""
        values = fitted.values
        for name in names:
            if name not in fitted.effects:
                values = EFFECTS[name].neutral(values, frozenset(names) - {name}) or values
        return values

    def _beside(self, names: tuple[str, ...], near: Fitted) -> list[Values]:
        """Where a fit of more or fewer effects says to start; of effects that it lacks all shapes are tried, one by one."""
        same = self._neutral(names, near)
        begin = [same]
        for name in names:
            if name not in near.effects:
                shapes = EFFECTS[name].start(self.summary.half_width, [{}])
                begin += [same | {k: np.asarray(v) for k, v in s.items()} for s in shapes if s]
        return [self._whole(names, v) for v in begin]

    def _vector(self, values: Values) -> Reals:
        x = np.zeros(len(self.lower))
        for name, places in self.places.items():
            value = np.asarray(values[name], float)
            with np.errstate(divide="ignore"):
                x[places] = np.log(value) if self.specs[name].log else value
        return np.clip(x, self.lower, self.upper)

    def _values(self, x: Reals) -> Values:
        found = {n: np.exp(x[p]) if self.specs[n].log else x[p] for n, p in self.places.items()}
        return {n: v if self.specs[n].per_channel else v[0] for n, v in found.items()}

    def _free(self, names: tuple[str, ...]) -> _Free:
        groups, affine = [], []
        for p in parameters_of(compose(*names)):
            places = self.places[p.name]
            parts = [[i] for i in places] if p.per_channel else [places]
            groups += parts
            affine += [p.name in AFFINE] * len(parts)
        return _Free(groups, np.array(affine))

    def _begun(self, x: Reals, free: _Free) -> _Start:
        from scipy.optimize import lsq_linear

        both, y = free.factor(self.linear(x)), free.of(x)
        columns, r = both[:, :-1][:, free.affine], both[:, -1]
        lower, upper = (free.of(b)[free.affine] for b in (self.lower, self.upper))
        end = lsq_linear(columns, columns @ y[free.affine] - r, (lower, upper))
        y[free.affine] = np.clip(end.x, lower, upper)
        return _Start(x, float(r @ r), free.put(y, x), 2 * end.cost)

    def _polished(self, start: _Start, free: _Free) -> tuple[float, Reals]:
        from scipy.optimize import least_squares

        at = _Once(lambda y: free.factor(self.linear(free.put(y, start.x))))
        y = free.of(start.refitted)
        if (at(y)[:, -1] ** 2).sum() > start.cost:
            y = free.of(start.x)
        end = least_squares(
            lambda y: at(y)[:, -1], y, lambda y: at(y)[:, :-1], (free.of(self.lower), free.of(self.upper)),
            x_scale="jac", ftol=RTOL, xtol=RTOL, gtol=None, max_nfev=STEPS,
        )  # fmt: skip
        return 2 * end.cost, free.put(end.x, start.x)


def own(fitted: Fitted) -> BRDF:
    """A fit as the model of its effects and no others."""
    cls = compose(*fitted.effects)
    values = {p.name: fitted.values[p.name] for p in parameters_of(cls)}
    return build(cls, {p.name: values[p.name] if p.per_channel else values[p.name].flat[0] for p in parameters_of(cls)})


def alone(fitted: Fitted, data: Shown, summary: Summary) -> Fitted:
    """A fit once more, by the program of its own effects and no others."""
    near = fitted._replace(values=fitted.values | parameter_values(own(fitted)))
    again = Screen(fitted.effects, data, summary, switches=False).fit(fitted.effects, [near])
    return again._replace(values=fitted.values | again.values)


class _Once:
    """A function that is not evaluated twice in a row at the same point."""

    def __init__(self, function: Callable[[Reals], Reals]) -> None:
        self.function, self.last = function, np.zeros(0)

    def __call__(self, x: Reals) -> Reals:
        if not np.array_equal(x, self.last):
            self.last, self.value = x.copy(), self.function(x)
        return self.value


__all__ = ["Fitted", "Screen", "alone", "own"]
