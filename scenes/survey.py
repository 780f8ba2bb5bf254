"""Everything about one material in one scene: its picture, what it shows, which effects are called for."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..fitting.starts import Summary, summarise
from ..models import BRDF
from ..models.effects import EFFECTS, compose
from ..progress import Progress
from ..tables import Table
from ..tradeoff.evaluation import Evaluation, Operations, direct
from ..tradeoff.sample import Sample
from ..tradeoff.timing import interleaved
from .appearance import Look, look
from .choose import Choice, Effects, Tried, choose
from .difference import difference
from .quick_fit import Shown, quick_fit, shown
from .ready import ready
from .rendering import Rendered, render
from .scene import MEASURES, Scene

PIECES = 3
"""Steps that :func:`study` reports to a progress."""
FITTED_ANGLE = np.radians(80)
"""Cells within this polar angle say where fits start."""
DEAR = frozenset({"interreflection", "dispersion"})
"""Effects that a search leaves out: beside others their fits take longer than all the rest of it."""
TIMED = 8192
REPEATS, BUDGET = 9, 1.5


@dataclass(frozen=True, eq=False)
class Study(Look):
    """What was found."""

    choice: Choice
    pictures: dict[str, Rendered]
    """``table``, ``chosen`` and ``everything``."""
    left_out: tuple[str, ...]
    """Effects that were not tried."""
    lights: int
    """Directions of light without extent for each pixel, by which its time is counted; at least 1."""
    seconds: float


def study(table: Table, scene: Scene, progress: Progress | None = None) -> Study:
    """Find what a scene calls for.

    Raises InputError for a table that is not on an isotropic half/difference grid and for a scene that shows nothing.
    """
    begin = time.perf_counter()
    progress = progress or Progress(PIECES, silent=True)
    progress.say(f"{table.material}: the picture of the table")
    here = look(table, scene)
    progress.advance(f"{len(here.view.wo)} pixels of the object, exposure {here.exposure:.3g}")
    used = table.within(FITTED_ANGLE)
    summary = summarise(table, used if used.any() else table.mask)
    bench = _Bench(here, shown(here), summary)
    progress.say("searching")
    left_out = [n for n in EFFECTS if n in DEAR or (n == "anisotropy" and table.isotropic)]
    lights = max(len(here.light.punctual), 1)
    budget = None if scene.budget is None else scene.budget / lights
    choice = choose(bench, scene.tolerance, budget, [n for n in EFFECTS if n not in left_out])
    progress.advance(f"{choice.chosen.label}: {MEASURES[scene.tolerance.measure][1]} {choice.chosen.error:.3g}")
    both = {"chosen": choice.chosen, "everything": choice.everything}
    progress.advance(f"{len(choice.tried)} sets of effects fitted")
    return Study(
        **vars(here),
        choice=choice,
        left_out=tuple(left_out),
        lights=lights,
        pictures={"table": here.reference} | {k: bench.pictures[t.effects] for k, t in both.items()},
        seconds=time.perf_counter() - begin,
    )


class _Bench:
    """Fits, pictures and costs of models in one scene."""

    def __init__(self, here: Look, data: Shown, summary: Summary) -> None:
        self.here, self.data, self.summary = here, data, summary
        few = here.seen.draw(TIMED)
        self.sample = Sample(few.wi, few.wo, few.measured, 90.0)
        self.pictures: dict[tuple[str, ...], Rendered] = {}
        self.evaluations: dict[tuple[str, ...], Evaluation] = {}

    def fit(self, effects: Effects, near: BRDF | None) -> tuple[BRDF, float]:
        quick = quick_fit(compose(*effects), self.data, self.summary, near)
        return quick.model, quick.error

    def error(self, tried: Tried) -> float:
        here = self.here
        picture = render(ready(tried.model), here.light, alpha=here.alpha, samples=here.scene.samples)
        self.pictures[tried.effects] = picture
        measure = here.scene.tolerance.measure
        return difference(measure, picture.values, here.reference.values, here.exposure, here.view)

    def costs(self, several: Sequence[Tried]) -> list[tuple[float, Operations]]:
        evaluations = {t.effects: self.evaluation(t) for t in several}
        took = interleaved(evaluations, REPEATS, BUDGET)
        return [(1e9 * took[t.effects].per(TIMED).median, evaluations[t.effects].operations()) for t in several]

    def evaluation(self, tried: Tried) -> Evaluation:
        if tried.effects not in self.evaluations:
            self.evaluations[tried.effects] = Evaluation(direct, ready(tried.model), self.sample)
        return self.evaluations[tried.effects]


__all__ = ["PIECES", "Study", "study"]
