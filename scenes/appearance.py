"""A measured table in a scene: its picture, and what that shows of it."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from ..models import model
from ..tables import HalfDifferenceGrid, Table
from .illumination import Illumination, illuminate
from .interpolated import measured
from .lobe import lobe_alpha
from .pixels import View, view
from .rendering import Rendered, render
from .scene import Reals, Scene
from .seen import Seen, seen

MEAN = 0.8
"""What the mean of a white Lambertian surface is shown as, where a scene does not set its exposure."""


@dataclass(frozen=True, eq=False)
class Look:
    """How a table looks in a scene."""

    scene: Scene
    table: Table
    view: View
    light: Illumination
    exposure: float
    """Factor from radiance to the screen, where 1 is white."""
    alpha: float
    """Width of the lobe of the table, which directions of extended light are drawn by."""
    reference: Rendered
    """The picture of the table."""
    seen: Seen
    filled: float
    """Share of the picture, by weight, that rests on cells of the table that were not measured."""

    @property
    def grid(self) -> HalfDifferenceGrid:
        """Where the cells of the table lie."""
        assert isinstance(self.table.layout, HalfDifferenceGrid)
        return self.table.layout


def look(table: Table, scene: Scene) -> Look:
    """Render a table and find what its picture shows.

    Raises InputError for a table that is not on an isotropic half/difference grid and for a scene without its object.
    """
    what, gaps = measured(table)
    pixels = view(scene)
    light = illuminate(scene, pixels, table.channels)
    alpha = lobe_alpha(what)
    exposure = exposure_of(scene, light)
    reference = render(what, light, alpha=alpha, samples=scene.samples)
    visible = seen(what, light, reference, exposure, alpha)
    filled = float((visible.cells(table.layout) * gaps).sum())  # type: ignore[arg-type]
    return Look(scene, table, pixels, light, exposure, alpha, reference, visible, filled)


def exposure_of(scene: Scene, light: Illumination) -> float:
    """The scene's exposure; by default that which shows a white Lambertian surface with a mean of 0.8."""
    if scene.exposure is not None:
        return scene.exposure
    white: Any = model("lambert", diffuse=1.0)
    mean = float(render(white, light, alpha=1.0, samples=scene.samples).values.mean())
    return MEAN / mean if mean > 0 else 1.0


@dataclass(frozen=True, eq=False)
class SceneGrid(HalfDifferenceGrid):
    """A grid whose cells count by what a picture shows of them, in place of their solid angle."""

    weight: Reals = field(default_factory=lambda: np.zeros(0))

    def solid_angle(self) -> Reals:
        """Weight of each cell, of the grid's shape; they sum to 1."""
        return self.weight


def weighted(table: Table, scene: Scene) -> Table:
    """The table with its cells weighted by what the scene shows: a fit with the measure ``"solid_angle"`` is made where it
    matters. Raises as :func:`look`.
    """
    here = look(table, scene)
    axes = {f.name: getattr(here.grid, f.name) for f in fields(HalfDifferenceGrid)}
    return replace(table, layout=SceneGrid(**axes, weight=here.seen.cells(here.grid)))


__all__ = ["Look", "exposure_of", "look", "weighted"]
