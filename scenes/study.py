"""Everything about one material in one scene: its picture, what it shows, which effects are called for."""

from __future__ import annotations

import time
from dataclasses import dataclass
from threading import Lock
from typing import Any

import numpy as np

from ..fitting.starts import Summary, summarise
from ..models import BRDF, model
from ..models.effects import EFFECTS, compose
from ..progress import Progress
from ..tables import Table
from ..tradeoff.evaluation import Evaluation, Operations, direct
from ..tradeoff.sample import Sample
from ..tradeoff.timing import interleaved
from .choose import Choice, Effects, Tried, choose
from .difference import difference
from .illumination import Illumination, illuminate
from .lobe import lobe_alpha
from .measured import measured
from .quick_fit import Shown, quick_fit, shown
from .ready import ready
from .render import Rendered, render
from .scene import MEASURES, Reals, Scene
from .seen import Seen, seen
from .view import View, view

PIECES = 4
"""Steps that :func:`study` reports to a progress."""
MEAN = 0.8
"""What the mean of a white Lambertian surface is shown as, where a scene does not set its exposure."""
FITTED_ANGLE = np.radians(80)
"""Cells within this polar angle say where fits start."""
DEAR = frozenset({"interreflection", "dispersion"})
"""Effects that a search leaves out: beside others their fits take longer than all the rest of it."""
TIMED = 8192
REPEATS, BUDGET = 5, 1.0


@dataclass(frozen=True, eq=False)
class Study:
    """What was found."""

    scene: Scene
    table: Table
    view: View
    exposure: float
    alpha: float
    """Width of the lobe of the table, which directions of extended light are drawn by."""
    reference: Rendered
    """The picture of the measured table."""
    seen: Seen
    filled: float
    """Share of the picture, by weight, that rests on cells of the table that were not measured."""
    choice: Choice
    pictures: dict[str, Rendered]
    """``table``, ``chosen`` and ``everything``."""
    times: dict[str, float]
    """Nanoseconds a pair of directions of ``chosen`` and ``everything``, measured in turns."""
    seconds: float


def study(table: Table, scene: Scene, progress: Progress | None = None) -> Study:
    """Find what a scene calls for.

    Raises InputError for a table that is not on an isotropic half/difference grid and for a scene that shows nothing.
    """
    begin = time.perf_counter()
    progress = progress or Progress(PIECES, silent=True)
    progress.say(f"{table.material}: the picture of the table")
    what, gaps = measured(table)
    pixels = view(scene)
    light = illuminate(scene, pixels, table.channels)
    alpha = lobe_alpha(what)
    exposure = exposure_of(scene, light)
    reference = render(what, light, alpha=alpha, samples=scene.samples)
    progress.advance(f"{len(light.wo)} pixels of the object, exposure {exposure:.3g}")
    visible = seen(what, light, reference, exposure, alpha)
    filled = float((visible.cells(table.layout) * gaps).sum())  # type: ignore[arg-type]
    progress.advance(f"{len(visible.weight)} pairs of directions behind them")
    used = table.within(FITTED_ANGLE)
    summary = summarise(table, used if used.any() else table.mask)
    bench = _Bench(scene, pixels, light, exposure, alpha, reference, shown(visible), summary, visible)
    progress.say("searching")
    among = [n for n in EFFECTS if n not in DEAR and (n != "anisotropy" or not table.isotropic)]
    choice = choose(bench, scene.tolerance, scene.budget, among)
    progress.advance(f"{choice.chosen.label}: {MEASURES[scene.tolerance.measure][1]} {choice.chosen.error:.3g}")
    both = {"chosen": choice.chosen, "everything": choice.everything}
    timed = interleaved({k: bench.evaluation(t) for k, t in both.items()}, REPEATS, BUDGET)
    progress.advance(f"{len(choice.tried)} sets of effects fitted")
    return Study(
        scene,
        table,
        pixels,
        exposure,
        alpha,
        reference,
        visible,
        filled,
        choice,
        {"table": reference} | {k: bench.pictures[t.effects] for k, t in both.items()},
        {k: 1e9 * t.per(TIMED).median for k, t in timed.items()},
        time.perf_counter() - begin,
    )


class _Bench:
    """Fits, pictures and costs of models in one scene."""

    def __init__(
        self,
        scene: Scene,
        pixels: View,
        light: Illumination,
        exposure: float,
        alpha: float,
        reference: Rendered,
        data: Shown,
        summary: Summary,
        visible: Seen,
    ) -> None:
        self.scene, self.pixels, self.light, self.exposure, self.alpha = scene, pixels, light, exposure, alpha
        self.reference, self.data, self.summary = reference, data, summary
        few = visible.draw(TIMED)
        self.sample = Sample(few.wi, few.wo, few.measured, 90.0)
        self.pictures: dict[tuple[str, ...], Rendered] = {}
        self.evaluations: dict[tuple[str, ...], Evaluation] = {}
        self.timing = Lock()

    def fit(self, effects: Effects, near: BRDF | None) -> tuple[BRDF, float]:
        quick = quick_fit(compose(*effects), self.data, self.summary, near)
        return quick.model, quick.error

    def error(self, tried: Tried) -> float:
        picture = render(ready(tried.model), self.light, alpha=self.alpha, samples=self.scene.samples)
        self.pictures[tried.effects] = picture
        measure = self.scene.tolerance.measure
        return difference(measure, picture.values, self.reference.values, self.exposure, self.pixels)

    def cost(self, tried: Tried) -> tuple[float, Operations]:
        evaluation = self.evaluation(tried)
        with self.timing:
            took = interleaved({0: evaluation}, 3, 0.1)[0].per(TIMED).median
        return 1e9 * took, evaluation.operations()

    def evaluation(self, tried: Tried) -> Evaluation:
        if tried.effects not in self.evaluations:
            self.evaluations[tried.effects] = Evaluation(direct, ready(tried.model), self.sample)
        return self.evaluations[tried.effects]


def exposure_of(scene: Scene, light: Illumination) -> float:
    """The scene's exposure; by default that which shows a white Lambertian surface with a mean of 0.8."""
    if scene.exposure is not None:
        return scene.exposure
    white: Any = model("lambert", diffuse=1.0)
    mean: Reals = render(white, light, alpha=1.0, samples=scene.samples).values.mean()
    return MEAN / float(mean) if mean > 0 else 1.0


__all__ = ["PIECES", "Study", "exposure_of", "study"]
