"""Everything about one material in one scene: its picture, what it shows, which effects are called for."""

from __future__ import annotations

import time
from dataclasses import dataclass
from threading import Lock

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
REPEATS, BUDGET = 9, 3.0


@dataclass(frozen=True, eq=False)
class Study(Look):
    """What was found."""

    choice: Choice
    pictures: dict[str, Rendered]
    """``table``, ``chosen`` and ``everything``."""
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
    among = [n for n in EFFECTS if n not in DEAR and (n != "anisotropy" or not table.isotropic)]
    choice = choose(bench, scene.tolerance, scene.budget, among)
    progress.advance(f"{choice.chosen.label}: {MEASURES[scene.tolerance.measure][1]} {choice.chosen.error:.3g}")
    both = {"chosen": choice.chosen, "everything": choice.everything}
    bench.time([t for t in choice.tried if "error" in vars(t)])
    progress.advance(f"{len(choice.tried)} sets of effects fitted")
    return Study(
        **vars(here),
        choice=choice,
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
        self.timing = Lock()

    def fit(self, effects: Effects, near: BRDF | None) -> tuple[BRDF, float]:
        quick = quick_fit(compose(*effects), self.data, self.summary, near)
        return quick.model, quick.error

    def error(self, tried: Tried) -> float:
        here = self.here
        picture = render(ready(tried.model), here.light, alpha=here.alpha, samples=here.scene.samples)
        self.pictures[tried.effects] = picture
        measure = here.scene.tolerance.measure
        return difference(measure, picture.values, here.reference.values, here.exposure, here.view)

    def cost(self, tried: Tried) -> tuple[float, Operations]:
        evaluation = self.evaluation(tried)
        with self.timing:
            took = interleaved({0: evaluation}, 3, 0.1)[0].per(TIMED).low
        return 1e9 * took, evaluation.operations()

    def time(self, several: list[Tried]) -> None:
        """Time models in turns, so that they can be compared: what :meth:`cost` found under load is replaced.

        The lower quartile counts, as other programs only ever add.
        """
        evaluations = {t.effects: self.evaluation(t) for t in several}
        took = interleaved(evaluations, REPEATS, BUDGET)
        for t in several:
            vars(t)["costs"] = 1e9 * took[t.effects].per(TIMED).low, evaluations[t.effects].operations()

    def evaluation(self, tried: Tried) -> Evaluation:
        if tried.effects not in self.evaluations:
            self.evaluations[tried.effects] = Evaluation(direct, ready(tried.model), self.sample)
        return self.evaluations[tried.effects]


__all__ = ["PIECES", "Study", "study"]
