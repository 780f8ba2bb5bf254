"""The search for the cheapest set of effects whose picture is close enough to that of the measured table."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Protocol

from ..models import BRDF
from ..models.effects import EFFECTS, in_order
from ..tradeoff.evaluation import Operations
from .scene import Tolerance
from .screen import Fitted, own

Effects = frozenset[str]

STALLED = 0.02
"""Relative decrease of the error of a fit below which two more effects do not count as progress."""
COST = {
    "body": 0.5,
    "rough_body": 1.5,
    "lobe": 1.5,
    "tail": 2.5,
    "second_lobe": 4.0,
    "anisotropy": 4.0,
    "dispersion": 4.5,
    "diffraction": 5.0,
    "fresnel": 2.0,
    "masking": 1.0,
    "interreflection": 60.0,
    "trade_off": 4.0,
    "retro": 1.5,
}
"""Nanoseconds that an effect adds to a pair of directions, about: what a search goes by before anything is compiled. Of 37
sets timed on two x86-64 cores the sums have a rank correlation of 0.97 with the times (their number of effects 0.76, the
compiler's count of operations 0.88); that of the sets that studies end with is on the page of the measurements."""
EVERY = 5.0
"""Those that every model takes."""
MASKED = {"tail": 34.0, "dispersion": 12.0}
"""What masking adds to those of a lobe: an integral read from a table, and one for each channel."""
NEARLY = 0.02
"""Relative difference of image errors within which, where no set meets the tolerance, a cheaper one is as good."""
FEW = 4
"""Effects of the sets that are all tried, if they are cheaper than one that meets the tolerance; of larger sets those are
tried that have one of its effects exchanged."""


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


def estimate(effects: Iterable[str]) -> float:
    """Nanoseconds for one pair of directions, about: the sum of :data:`COST`. A set costs more than any of its subsets."""
    have = set(effects)
    masked = sum(MASKED[n] for n in have & MASKED.keys()) if "masking" in have else 0
    return EVERY + sum(COST[n] for n in have) + masked


def possible(effects: Effects) -> bool:
    """Whether a set of effects makes a model."""
    try:
        in_order(effects)
    except ValueError:
        return False
    return True


def every(among: Sequence[str]) -> list[Effects]:
    """All sets of effects that make a model, the cheapest first."""
    sets = [frozenset(s) for k in range(1, len(among) + 1) for s in combinations(among, k)]
    return sorted(filter(possible, sets), key=estimate)


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
        """A set that meets the tolerance, if there is one: the best one otherwise.

        Effect by effect, that which lowers the error of the fit most is added; where nothing helps, all that can add to it.
        """
        way = [min(self.explore(s for n in self.among if possible(s := frozenset([n]))), key=lambda t: t.fit_error)]
        while not self.good(way[-1]):
            wider = self.explore(larger(frozenset(way[-1].effects), self.among), way[-1])
            way += [min(wider, key=lambda t: t.fit_error)] if wider else []
            if not wider or way[-1].fit_error > (1 - STALLED) * way[-3:][0].fit_error:
                return self.better(way[-1], self.widest(way[-1]))
        return way[-1]

    def wider(self, t: Tried) -> Effects:
        """The effects of a set with all others that leave it a way back."""
        effects = frozenset(t.effects)
        for n in self.among:
            if n not in effects and possible(effects | {n}) and EFFECTS[n].neutral(t.fitted.values, effects) is not None:
                effects |= {n}
        return effects

    def widest(self, t: Tried) -> Tried:
        """All effects, or those of a set with all that can only add to them, whichever is better."""
        sets = list(dict.fromkeys((frozenset(self.among), self.wider(t))))
        fits = [self.fit(s, t, *(t for t in [self.known.get(s)] if t)) for s in sets]
        self.known |= {s: Tried(f, self.bench) for s, f in zip(sets, fits, strict=True)}
        return self.better(*(self.known[s] for s in sets))

    def lean(self, t: Tried) -> Tried:
        """A set from which nothing can be left out, what costs most first: what a set needs its subsets need, too."""
        for n in sorted(t.effects, key=lambda n: -estimate([n])):
            if n in t.effects and (rest := without(frozenset(t.effects), n)):
                (less,) = self.explore([rest], t)
                t = less if self.good(less) else t
        return t

    def cheapest(self, top: Tried) -> Tried | None:
        """The cheapest set whose whole picture meets the tolerance; None if that of no set does.

        What can be left out of a set that meets it is; then what is cheaper than the rest is tried, the cheapest first.
        """
        lean = self.lean(top)
        here, limit = frozenset(lean.effects), estimate(lean.effects)
        cheaper = [s for s in every(self.among) if estimate(s) <= limit and s != here]
        rivals = [s for s in cheaper if len(s) <= FEW or len(s - here) <= 1]
        step = os.cpu_count() or 1
        for k in range(0, len(rivals), step):
            for t in self.explore(rivals[k : k + step], lean):
                if self.good(t) and self.whole(t):
                    return t
        return lean if self.whole(lean) else None

    def whole(self, t: Tried) -> bool:
        """Whether the whole picture meets the tolerance, too; if not the search asks for more."""
        _ = t.finished
        if not self.good(t):
            self.ratio = (min if self.tolerance.measure == "psnr" else max)(self.ratio, t.finished / t.seen)
        return self.good(t)

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

    def best(self, top: Tried) -> Tried:
        """As good as any set, or nearly, with nothing in it that makes no more difference than that.

        Twice, for what fewer effects lead to with all the others is sometimes better than what was known.
        """
        for _ in range(2):
            more = -NEARLY if self.tolerance.measure == "psnr" else NEARLY
            self.tolerance = replace(self.tolerance, limit=top.error * (1 + more))
            lean = self.lean(top)
            top = self.better(top, self.widest(lean))
        return lean

    def everything(self, chosen: Tried) -> Tried:
        """The chosen set with all that can only add to it, or all effects: never worse than the chosen one."""
        best = self.widest(chosen)
        _ = best.finished
        if self.better(chosen, best) is best:
            return best
        # what is compared is not quite what was fitted: the chosen model is one of those, too, with all else at nothing
        same = Tried(self.bench.extended(self.wider(chosen), chosen.fitted), self.bench)
        _ = same.finished
        return same


def choose(bench: Bench, tolerance: Tolerance, budget: float | None, among: Sequence[str]) -> Choice:
    """Search forward until the tolerance is met, then backward for what can be left out, then all that is cheaper.

    Forward, the effect whose addition lowers the error of the fit most is added. Backward, all is left out that can be, what
    costs most first. All sets of few effects that are estimated to cost less than what remains, and larger ones with one of
    its effects exchanged, are then tried, the cheapest first, until the whole picture of one, rendered by its own program,
    meets the tolerance. Where no set meets it, all is left out of the best that makes less of a difference than
    :data:`NEARLY`.
    ``budget`` is in nanoseconds for one pair of directions.
    """
    search = _Search(bench, tolerance, among)
    found = None
    while found is None and search.good(top := search.top()):
        found = search.cheapest(top)
    if found is None:
        found = search.best(top)
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


__all__ = ["Bench", "Choice", "Tried", "Verdict", "choose", "estimate", "every", "larger", "possible", "smaller", "without"]
