"""The search for the cheapest set of effects whose picture is close enough to that of the measured table."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from ..models import BRDF
from ..models.effects import EFFECTS, compose
from ..tradeoff.evaluation import Operations
from .scene import Tolerance

Effects = frozenset[str]

STALLED = 0.02
"""Relative decrease of the error of a fit below which one more effect does not count as progress."""
ALIKE = 0.05
"""Relative difference of times that is not told from none: the model with fewer operations then counts as cheaper."""
NEARLY = 0.01
"""Relative difference of image errors within which, where no set meets the tolerance, the cheaper one is better."""


class Bench(Protocol):
    """Where models are tried: a scene and a table."""

    def fit(self, effects: Effects, near: BRDF | None) -> tuple[BRDF, float]:
        """The model of a set of effects under the scene's weight, and the error of that fit."""

    def error(self, tried: Tried) -> float:
        """Error of its picture."""

    def costs(self, several: Sequence[Tried]) -> list[tuple[float, Operations]]:
        """Nanoseconds and operations for one pair of directions and all channels, in float32, timed in turns."""


@dataclass(frozen=True, eq=False)
class Tried:
    """A set of effects, fitted under the scene's weight; what else is known of it is found out when it is asked for."""

    effects: tuple[str, ...]
    model: BRDF
    fit_error: float
    """What the fit minimised (:class:`.quick_fit.Quick`)."""
    bench: Bench

    @property
    def label(self) -> str:
        """Names joined by +."""
        return " + ".join(self.effects)

    @cached_property
    def error(self) -> float:
        """Image error under the scene's tolerance."""
        return self.bench.error(self)

    @cached_property
    def costs(self) -> tuple[float, Operations]:
        """Nanoseconds and operations."""
        return self.bench.costs([self])[0]

    @property
    def nanoseconds(self) -> float:
        """For one pair of directions and all channels, in float32."""
        return self.costs[0]

    @property
    def operations(self) -> Operations:
        """The compiler's count of the same."""
        return self.costs[1]


@dataclass(frozen=True)
class Verdict:
    """Whether a scene calls for an effect, and the figures that say so."""

    effect: str
    called: bool
    other: Tried | None
    """The chosen set without it, or with it, fitted again; None where there is no such set."""


@dataclass(frozen=True, eq=False)
class Choice:
    """How a search went."""

    chosen: Tried
    """The cheapest set that meets the tolerance, or the best one if none does."""
    met: bool
    affordable: bool
    """Whether it is within the scene's budget."""
    ladder: tuple[Tried, ...]
    """From one effect to the chosen set, one more each."""
    everything: Tried
    verdicts: tuple[Verdict, ...]
    tried: tuple[Tried, ...]
    """Every set that was fitted, by number of effects."""


def possible(effects: Effects) -> bool:
    """Whether a set of effects makes a model."""
    try:
        compose(*effects)
    except ValueError:
        return False
    return True


def without(effects: Effects, name: str) -> Effects:
    """A set without an effect and without those that need it."""
    left = effects - {name}
    while left and not possible(left):
        needy = {n for n in left if any(not set(need.split(" or ")) & left for need in EFFECTS[n].needs)}
        left -= needy or left
    return left


def smaller(effects: Effects) -> list[Effects]:
    """All sets that lack one effect (and what needs it)."""
    return [s for s in dict.fromkeys(without(effects, n) for n in EFFECTS if n in effects) if s]


def larger(effects: Effects, among: Iterable[str]) -> list[Effects]:
    """All sets with one effect more."""
    return [s for n in among if n not in effects and possible(s := effects | {n})]


def choose(bench: Bench, tolerance: Tolerance, budget: float | None, among: Sequence[str]) -> Choice:
    """Search forward until the tolerance is met, then backward for what can be left out.

    Forward, the effect whose addition lowers the error of the fit most is added; one that lowered its square by less before
    than another does now is not fitted again. Where that stalls, everything is tried. Backward, the effect is dropped whose
    loss leaves the cheapest model that still meets the tolerance. Of all sets met on the way that do, the cheapest is
    chosen, and one that is within the budget, nanoseconds for one pair of directions, if there is one.
    """
    known: dict[Effects, Tried] = {}

    def explore(sets: Iterable[Effects], near: BRDF | None = None, pictures: bool = False) -> list[Tried]:
        sets = list(sets)

        def one(s: Effects) -> Tried:
            tried = known[s] if s in known else Tried(compose(*s).effects, *bench.fit(s, near), bench)
            if pictures:
                _ = tried.error
            return tried

        with ThreadPoolExecutor(os.cpu_count()) as pool:  # programs are compiled and run outside Python's lock
            known.update(zip(sets, pool.map(one, sets), strict=True))
        return [known[s] for s in sets]

    singles = [s for n in among if possible(s := frozenset([n]))]
    here = min(explore(singles), key=lambda t: t.fit_error)
    gains: dict[str, float] = {}
    for _ in among:
        if tolerance.met(here.error):
            break
        best = _step(here, among, gains, explore)
        if best.fit_error > (1 - STALLED) * here.fit_error:
            break
        here = best
    everything = explore([frozenset(among)], here.model, pictures=True)[0]
    if not tolerance.met(here.error) and tolerance.met(everything.error):
        here = everything
    for _ in among:
        less = explore(smaller(frozenset(here.effects)), here.model, pictures=True)
        good = [t for t in less if tolerance.met(t.error)]
        if not good:
            break
        here = _cheapest(good)
    seen = [t for t in known.values() if "error" in vars(t)]
    good = [t for t in seen if tolerance.met(t.error)]
    if good:
        _time(good)
        fine = [t for t in good if budget is None or t.nanoseconds <= budget]
        chosen = _cheapest(fine or good)
    else:
        sign = -1 if tolerance.measure == "psnr" else 1
        least = min(sign * t.error for t in seen)
        chosen = _cheapest([t for t in seen if sign * t.error <= least + NEARLY * abs(least)])
    here_set = frozenset(chosen.effects)
    explore([*smaller(here_set), *larger(here_set, among)], chosen.model, pictures=True)
    ladder = _ladder(chosen, known)
    explore([frozenset(t.effects) for t in (*ladder, everything)], pictures=True)
    _time([t for t in known.values() if "error" in vars(t)])
    return Choice(
        chosen,
        bool(good),
        budget is None or chosen.nanoseconds <= budget,
        ladder,
        everything,
        tuple(_verdict(name, chosen, known) for name in among),
        tuple(sorted(known.values(), key=lambda t: (len(t.effects), t.fit_error))),
    )


def _step(here: Tried, among: Iterable[str], gains: dict[str, float], explore: Callable[..., list[Tried]]) -> Tried:
    """The best set with one effect more, or the given one; what each effect gained is kept in ``gains``."""
    best, at_once = here, os.cpu_count() or 1
    wider = {n: s for n in among for s in larger(frozenset(here.effects), [n])}
    order = sorted(wider, key=lambda n: -gains.get(n, np.inf))
    for k in range(0, len(order), at_once):
        names = order[k : k + at_once]
        # an effect seldom gains more beside others than without them
        names = [n for n in names if gains.get(n, np.inf) > here.fit_error**2 - best.fit_error**2]
        for n, t in zip(names, explore([wider[n] for n in names], here.model), strict=True):
            gains[n] = here.fit_error**2 - t.fit_error**2
            best = min(best, t, key=lambda t: t.fit_error)
    return best


def _time(several: Sequence[Tried]) -> None:
    """Find the costs of several models together, so that they can be compared."""
    for t, costs in zip(several, several[0].bench.costs(several), strict=True):
        vars(t)["costs"] = costs


def _cheapest(several: Sequence[Tried]) -> Tried:
    """The model that takes the least time; of those that are :data:`ALIKE`, that with the fewest operations."""
    _time(several)
    least = min(t.nanoseconds for t in several)
    alike = [t for t in several if t.nanoseconds <= (1 + ALIKE) * least]
    return min(alike, key=lambda t: (t.operations.flops + t.operations.transcendentals, len(t.effects)))


def _verdict(name: str, chosen: Tried, known: dict[Effects, Tried]) -> Verdict:
    here = frozenset(chosen.effects)
    other = without(here, name) if name in here else here | {name}
    return Verdict(name, name in here, known.get(other))


def _ladder(chosen: Tried, known: dict[Effects, Tried]) -> tuple[Tried, ...]:
    """Sets seen on the way, each within the next, that end with the chosen one; of several, those with the least error."""
    rungs = [chosen]
    while below := [t for s, t in known.items() if s < frozenset(rungs[-1].effects)]:
        most = max(len(t.effects) for t in below)
        rungs.append(min((t for t in below if len(t.effects) == most), key=lambda t: t.fit_error))
    return tuple(reversed(rungs))


__all__ = ["Choice", "Tried", "Verdict", "choose", "larger", "possible", "smaller", "without"]
