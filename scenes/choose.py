"""The search for the cheapest set of effects whose picture is close enough to that of the measured table."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

from ..models import BRDF
from ..models.effects import EFFECTS, compose
from ..tradeoff.evaluation import Operations
from .scene import Tolerance
from .screen import Fitted, own

Effects = frozenset[str]

STALLED = 0.02
"""Relative decrease of the error of a fit below which one more effect does not count as progress."""
ALIKE = 0.5
"""Relative difference of times within which the model with fewer operations counts as cheaper: other work on the machine
moves times by as much, and the choice is not to depend on it."""
CALL = 20
"""Operations that an exp, a log or a root counts as: the times of compositions of two to eleven effects grow like that."""
PLAIN = ("body", "rough_body", "lobe", "fresnel", "masking", "trade_off")
"""Effects that take few operations each: no exponential, no logarithm, no further lobe."""
NEARLY = 0.02
"""Relative difference of image errors within which, where no set meets the tolerance, a cheaper one is as good."""
EXHAUSTED = 6
"""Effects of a set of which all subsets that meet the tolerance are looked at; of larger sets only the best."""
EXCHANGED = 2
"""Sets of which each effect is exchanged for each other one, at most: those with the fewest effects."""
TIMED = 4
"""Sets that compete for being the cheapest, at most: those with the fewest effects."""


class Bench(Protocol):
    """Where models are tried: a scene and a table."""

    def fit(self, effects: Effects, near: Sequence[Fitted]) -> Fitted:
        """A set of effects under the scene's weight, from fits of other sets."""

    def alone(self, fitted: Fitted) -> Fitted:
        """A fit once more, by the program of its own effects and no others."""

    def extended(self, effects: Effects, fitted: Fitted) -> Fitted:
        """A fit as one of more effects that do nothing."""

    def seen(self, fitted: Fitted) -> float:
        """Error of its picture, by the program of all effects and not of all pixels where there are many."""

    def finished(self, fitted: Fitted) -> float:
        """Error of the whole picture, by the program of its own effects and no others."""

    def costs(self, several: Sequence[Tried]) -> list[tuple[float, Operations]]:
        """Nanoseconds and operations for one pair of directions and all channels, in float32, timed in turns."""


@dataclass(frozen=True, eq=False)
class Tried:
    """A set of effects, fitted under the scene's weight; what else is known of it is found out when it is asked for."""

    fitted: Fitted
    bench: Bench

    @property
    def effects(self) -> tuple[str, ...]:
        """Their names."""
        return self.fitted.effects

    @property
    def label(self) -> str:
        """Names joined by +."""
        return " + ".join(self.effects)

    @property
    def fit_error(self) -> float:
        """What the fit minimised (:class:`.screen.Fitted`)."""
        return self.fitted.error

    @cached_property
    def seen(self) -> float:
        """Image error under the scene's tolerance, as the search sees it."""
        return self.bench.seen(self.fitted)

    @cached_property
    def finished(self) -> float:
        """Image error of the whole picture, as the model itself is rendered."""
        return self.bench.finished(self.fitted)

    @property
    def model(self) -> BRDF:
        """The model of these effects and no others."""
        return own(self.fitted)

    @property
    def error(self) -> float:
        """Image error: that of the whole picture if it is known."""
        return self.finished if "finished" in vars(self) else self.seen

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
    """The cheapest set that meets the tolerance, or one that is as good as can be if none does."""
    met: bool
    affordable: bool
    """Whether it is within the scene's budget."""
    ladder: tuple[Tried, ...]
    """From one effect to the chosen set, one or more each."""
    everything: Tried
    """The chosen set with all that can only improve it, or all effects if that is better: never worse than the chosen."""
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


class _Search:
    """Sets that were fitted."""

    def __init__(self, bench: Bench, tolerance: Tolerance, among: Sequence[str]) -> None:
        self.bench, self.tolerance, self.among = bench, tolerance, among
        self.known: dict[Effects, Tried] = {}
        self.exhausted = EXHAUSTED
        self.ratio = 1.0
        """How much worse whole pictures were than what the search sees of them."""

    def explore(self, sets: Iterable[Effects], *near: Tried) -> list[Tried]:
        """Fit what was not fitted before, starting from other fits and from the best one of fewer effects."""
        sets = list(dict.fromkeys(sets))
        new = [s for s in sets if s not in self.known]

        with ThreadPoolExecutor(os.cpu_count()) as pool:  # programs run outside Python's lock
            fits = list(pool.map(lambda s: self.fit(s, *near), new))
        self.known |= {s: Tried(f, self.bench) for s, f in zip(new, fits, strict=True)}
        return [self.known[s] for s in sets]

    def fit(self, effects: Effects, *near: Tried) -> Fitted:
        within = [t for s, t in self.known.items() if s < effects]
        best = sorted(within, key=lambda t: t.fit_error)[:1]
        return self.bench.fit(effects, [t.fitted for t in dict.fromkeys([*near, *best])])

    def good(self, tried: Tried) -> bool:
        return self.tolerance.met(tried.error if "finished" in vars(tried) else tried.seen * self.ratio)

    def top(self) -> Tried:
        """A set that meets the tolerance, if there is one: the best one otherwise."""
        here = self.upwards(self.among)
        if self.good(here):
            return here
        other = self.upwards(self.among, self.upwards(PLAIN))
        if self.good(other):
            return other
        return self.better(here, other, *self.explore([frozenset(self.among)], here, other))

    def upwards(self, among: Sequence[str], here: Tried | None = None) -> Tried:
        """Effect by effect, that which lowers the error of the fit most, until the tolerance is met or nothing helps."""
        among = [n for n in among if n in self.among]
        if here is None:
            here = min(self.explore(s for n in among if possible(s := frozenset([n]))), key=lambda t: t.fit_error)
        while not self.good(here):
            wider = self.explore(larger(frozenset(here.effects), among), here)
            if not wider:
                break
            best = min(wider, key=lambda t: t.fit_error)
            if best.fit_error > (1 - STALLED) * here.fit_error:
                break
            here = best
            if self.good(here):  # another one of as many effects may meet it, too, and cost less
                _ = [self.good(t) for t in wider]
        return here

    def downwards(self, top: Tried) -> None:
        """What can be left out of a set that meets the tolerance; of small sets in every order, of large ones in one."""
        level = [top]
        while level:
            below: dict[Effects, Tried] = {}
            for t in level:
                for less in self.explore(smaller(frozenset(t.effects)), t):
                    if self.good(less):
                        below[frozenset(less.effects)] = less
            level = list(below.values())
            if level and max(len(t.effects) for t in level) > self.exhausted:
                level = [min(level, key=lambda t: t.fit_error)]

    def smallest(self) -> list[Tried]:
        """The first few sets that meet the tolerance and of which nothing can be left out, as far as is known."""
        good = [t for t in self.known.values() if "seen" in vars(t) and self.good(t)]
        rest = [t for t in good if not any(set(o.effects) < set(t.effects) for o in good)]
        return sorted(rest, key=lambda t: (len(t.effects), t.fit_error))[:TIMED]

    def exchanged(self, t: Tried) -> list[Tried]:
        """What also meets the tolerance with one effect exchanged for another."""
        here = frozenset(t.effects)
        sets = [s for less in smaller(here) for s in larger(less, self.among) if s != here and len(s) <= len(here)]
        return [other for other in self.explore(sets, t) if self.good(other)]

    def fastest(self) -> Tried | None:
        """The cheapest of the smallest sets whose whole picture meets the tolerance; None if that of no set does."""
        while rest := self.smallest():
            _time(rest)
            while rest:
                t = _cheapest(rest)
                _ = t.finished
                if self.good(t):
                    return t
                rest.remove(t)
                self.ratio = (min if self.tolerance.measure == "psnr" else max)(self.ratio, t.finished / t.seen)
        return None

    def alone(self, chosen: Tried) -> Tried:
        """The chosen set fitted once more, by the program of its own effects, if that keeps what it is chosen for."""
        again = Tried(self.bench.alone(chosen.fitted), self.bench)
        _ = again.finished, chosen.finished
        if self.good(chosen) and not self.good(again):
            return chosen
        self.known[frozenset(chosen.effects)] = again
        return again

    def better(self, *several: Tried) -> Tried:
        """The one with the least image error."""
        sign = -1 if self.tolerance.measure == "psnr" else 1
        return min(several, key=lambda t: sign * t.error)

    def settle_for(self, t: Tried) -> None:
        """Ask for no more than what a set achieves, or nearly, and look along one path for less that does."""
        more = -NEARLY if self.tolerance.measure == "psnr" else NEARLY
        self.tolerance = replace(self.tolerance, limit=t.error * (1 + more))
        self.exhausted = 0

    def everything(self, chosen: Tried) -> Tried:
        """All effects, or the chosen ones with all that can only add to them, whichever is better."""
        nested = frozenset(chosen.effects)
        for n in self.among:
            if n not in nested and possible(nested | {n}) and EFFECTS[n].neutral(chosen.fitted.values, nested) is not None:
                nested |= {n}
        sets = list(dict.fromkeys((frozenset(self.among), nested)))
        fits = [self.fit(s, chosen, *(t for t in [self.known.get(s)] if t)) for s in sets]
        self.known |= {s: Tried(f, self.bench) for s, f in zip(sets, fits, strict=True)}
        best = self.better(*(self.known[s] for s in sets))
        _ = best.finished
        if self.better(chosen, best) is best:
            return best
        # what is compared is not quite what was fitted: the chosen model is one of those, too, with all else at nothing
        same = Tried(self.bench.extended(nested, chosen.fitted), self.bench)
        _ = same.finished
        return same


def choose(bench: Bench, tolerance: Tolerance, budget: float | None, among: Sequence[str]) -> Choice:
    """Search forward until the tolerance is met, then backward for what can be left out, then sideways.

    Forward, the effect whose addition lowers the error of the fit most is added. The same is done with effects that cost
    little alone (:data:`PLAIN`), for a set of more of them may still be the faster one; where the first search stalls, the
    second goes on with all effects from there, and then everything is tried.
    Backward, all that can be left out of the set is; sideways, each effect is exchanged for each other one. Of the sets
    that remain, of which nothing can be left out, the fastest is chosen whose whole picture, rendered by its own program,
    meets the tolerance. Where no set meets it, the same search is made for one that is as good as any. ``budget`` is in
    nanoseconds for one pair of directions.
    """
    search = _Search(bench, tolerance, among)
    found = None
    while found is None and search.good(top := search.top()):
        search.downwards(top)
        if search.good(plain := search.upwards(PLAIN)):
            search.downwards(plain)
        for t in search.smallest()[:EXCHANGED]:
            for other in search.exchanged(t):
                search.downwards(other)
        found = search.fastest()
    if found is None:
        search.settle_for(top)
        search.downwards(top)
        found = search.better(*search.smallest())
    chosen = search.alone(found)
    here = frozenset(chosen.effects)
    search.explore([*smaller(here), *larger(here, among)], chosen)
    everything = search.everything(chosen)
    ladder = _ladder(chosen, search.known)
    _time(list({id(t): t for t in (chosen, everything, *ladder)}.values()))
    return Choice(
        chosen,
        tolerance.met(chosen.error),
        budget is None or chosen.nanoseconds <= budget,
        ladder,
        everything,
        tuple(_verdict(name, chosen, search.known) for name in among),
        tuple(sorted(search.known.values(), key=lambda t: (len(t.effects), t.fit_error))),
    )


def _time(several: Sequence[Tried]) -> None:
    """Find the costs of several models together, so that they can be compared."""
    for t, costs in zip(several, several[0].bench.costs(several), strict=True):
        vars(t)["costs"] = costs


def _cheapest(several: Sequence[Tried]) -> Tried:
    """The model that takes the least time; of those that are :data:`ALIKE`, that with the fewest operations."""
    least = min(t.nanoseconds for t in several)
    alike = [t for t in several if t.nanoseconds <= (1 + ALIKE) * least]
    return min(alike, key=lambda t: (t.operations.flops + CALL * t.operations.transcendentals, len(t.effects)))


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


__all__ = ["Bench", "Choice", "Tried", "Verdict", "choose", "larger", "possible", "smaller", "without"]
