"""Everything about one material in one scene: its picture, what it shows, which effects are called for."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..fitting.starts import summarise
from ..models.effects import EFFECTS
from ..progress import Progress
from ..tables import Table
from ..tabulated import ready
from ..tradeoff.evaluation import Evaluation, Operations, direct
from ..tradeoff.sample import Sample
from ..tradeoff.timing import interleaved
from .appearance import Look, look
from .choose import Choice, Effects, Tried, choose
from .difference import difference
from .fitted_pixels import shown
from .illumination import Illumination
from .interpolated import measured
from .rendering import Rendered, render
from .sampling import techniques_of
from .scene import MEASURES, Reals, Scene
from .screen import Fitted, Screen, alone, own

PIECES = 3
"""Steps that :func:`study` reports to a progress."""
FITTED_ANGLE = np.radians(80)
"""Cells within this polar angle say where fits start."""
DEAR = frozenset({"interreflection"})
"""Effects that a search leaves out: with a tail each of its evaluations takes seconds, a hundred times all the rest."""
SEEN, PIXELS = 1 << 14, 1024
"""Pairs of directions of a picture that a search looks at, and pixels at least: some of them, if the scene has more."""
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
    progress.say("searching")
    unused = left_out(table)
    among = [n for n in EFFECTS if n not in unused]
    bench = SceneBench(here, among)
    lights = max(len(here.light.punctual), 1)
    budget = None if scene.budget is None else scene.budget / lights
    choice = choose(bench, scene.tolerance, budget, among)
    progress.advance(f"{choice.chosen.label}: {MEASURES[scene.tolerance.measure][1]} {choice.chosen.error:.3g}")
    both = {"chosen": choice.chosen, "everything": choice.everything}
    progress.advance(f"{len(choice.tried)} sets of effects fitted")
    return Study(
        **vars(here),
        choice=choice,
        left_out=unused,
        lights=lights,
        pictures={"table": here.reference} | {k: bench.pictures[t.effects] for k, t in both.items()},
        seconds=time.perf_counter() - begin,
    )


def left_out(table: Table) -> tuple[str, ...]:
    """Effects that a search does not try."""
    return tuple(n for n in EFFECTS if n in DEAR or (n == "anisotropy" and table.isotropic))


class SceneBench:
    """Fits, pictures and costs of models in one scene."""

    def __init__(self, here: Look, among: Sequence[str]) -> None:
        self.here = here
        used = here.table.within(FITTED_ANGLE)
        self.summary = summarise(here.table, used if used.any() else here.table.mask)
        self.data = shown(here)
        self.screen = Screen(among, self.data, self.summary)
        timed = here.seen.draw(TIMED)
        self.sample = Sample(timed.wi, timed.wo, timed.measured, 90.0)
        self.light, self.reference = self._fewer()
        self.pictures: dict[tuple[str, ...], Rendered] = {}
        self.evaluations: dict[tuple[str, ...], Evaluation] = {}

    def _fewer(self) -> tuple[Illumination, Reals]:
        """The light on as many pixels as a search looks at, and their picture with the measured table."""
        here, light = self.here, self.here.light
        extended = light.extended
        each = len(light.punctual) + (here.scene.samples * techniques_of(extended) if extended is not None else 0)
        count = max(SEEN // max(each, 1), PIXELS)
        if count >= len(light.wo) or here.scene.tolerance.measure == "ssim":
            return light, here.reference.values
        some = np.sort(np.random.default_rng(0).choice(len(light.wo), count, replace=False))
        part = light.part(some)
        if extended is None:
            return part, here.reference.values[some]
        return part, self._render(measured(here.table)[0], part).values

    def _render(self, what: Any, light: Illumination) -> Rendered:
        return render(what, light, alpha=self.here.alpha, samples=self.here.scene.samples)

    def _difference(self, values: Reals, reference: Reals) -> float:
        return difference(self.here.scene.tolerance.measure, values, reference, self.here.exposure, self.here.view)

    def fit(self, effects: Effects, near: Sequence[Fitted] = ()) -> Fitted:
        """See :class:`.choose.Bench`, as for all that follows."""
        return self.screen.fit(effects, near)

    def alone(self, fitted: Fitted) -> Fitted:
        """By the program of its own effects."""
        return alone(fitted, self.data, self.summary)

    def extended(self, effects: Effects, fitted: Fitted) -> Fitted:
        """With effects that do nothing."""
        return self.screen.extended(effects, fitted)

    def seen(self, fitted: Fitted) -> float:
        """By the program of all effects, on some pixels."""
        return self._difference(self._render(ready(self.screen.model(fitted)), self.light).values, self.reference)

    def finished(self, fitted: Fitted) -> float:
        """By its own program, on all pixels."""
        picture = self._render(ready(own(fitted)), self.here.light)
        self.pictures[fitted.effects] = picture
        return self._difference(picture.values, self.here.reference.values)

    def costs(self, several: Sequence[Tried]) -> list[tuple[float, Operations]]:
        """In float32, on directions of the scene; lower quartiles, which other work on the machine moves least."""
        evaluations = {t.effects: self._evaluation(t) for t in several}
        took = interleaved(evaluations, REPEATS, BUDGET)
        return [(1e9 * took[t.effects].per(TIMED).low, evaluations[t.effects].operations()) for t in several]

    def _evaluation(self, tried: Tried) -> Evaluation:
        if tried.effects not in self.evaluations:
            self.evaluations[tried.effects] = Evaluation(direct, ready(tried.model), self.sample)
        return self.evaluations[tried.effects]


__all__ = ["PIECES", "SceneBench", "Study", "left_out", "study"]
