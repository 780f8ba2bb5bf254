"""The atlas: for every model and part the worst errors, where they occur, and maps of the digits that are kept."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import reference
from .measure import HELD, errors, evaluate, moved, not_finite
from .parts import PARTS, Part

Reals = NDArray[np.float64]
Points = list[tuple[str, str, Reals, tuple[int, ...]]]

PRECISIONS = {"float64": np.float64, "float32": np.float32}
ROWS, ROWS_OF_INTEGRALS = 8, 4
SCATTERED, SCATTERED_INTEGRALS = 100, 8
SCATTERED_SINGLE = 4000
"""Points over the whole domain in float32, whose reference is float64."""
DRAWS, DRAWS_OF_INTEGRALS = 20_000, 2_000
"""Random draws that must be finite, unless asked for more."""


@dataclass(frozen=True)
class Worst:
    """The largest relative error of a value or slope, and the arguments where it occurs."""

    error: float
    argument: str
    at: dict[str, float]


@dataclass(frozen=True)
class Map:
    """Relative errors ``[rows, columns]``; rows are values of one argument, columns angles (radians) or another."""

    varied: str
    rows: Reals
    columns: Reals
    value: Reals
    slope: Reals


@dataclass(frozen=True)
class Record:
    """What was found of one part in one precision."""

    group: str
    name: str
    precision: str
    angle: str
    value: Worst
    slope: Worst
    points: int
    draws: int
    values_not_finite: int
    slopes_not_finite: int
    maps: tuple[Map, ...]
    beyond: Worst
    """The largest error of a value or slope where the precision cannot hold it, which ``value`` and ``slope`` leave out."""
    beyond_moved: float
    """How far one rounding of the arguments moves the value or slope there, relative."""
    beyond_share: float
    """Of the points, those with a value or slope that the precision cannot hold."""


def survey(draws: int | None = None, say: Callable[[str], None] = lambda text: None) -> list[Record]:
    """Measure every part. ``draws`` random points of each must be finite; by default few enough for three minutes."""
    plans = {part: _plan(part) for part in PARTS}
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        waiting = [(keys, pool.submit(_tabulate, jobs)) for keys, jobs in _bundles(plans)]
        found: dict[Any, Any] = {}

        def draw(part: Part) -> list[Record]:
            say(f"{part.group}: {part.name}")
            count = draws or (DRAWS_OF_INTEGRALS if part.integral else DRAWS)
            return [_finite_record(part, p, not_finite(part, count, dtype), count) for p, dtype in PRECISIONS.items()]

        def measure(records: list[Record], part: Part) -> list[Record]:
            return [_measured(record, part, plans[part], found) for record in records]

        # while the references are summed, programs are compiled, most of the work, and random draws made
        with ThreadPoolExecutor(2) as threads:
            drawn = list(threads.map(draw, PARTS))
            for keys, future in waiting:
                found.update(zip(keys, future.result(), strict=True))
                say(f"references: {len(found)}")
            return [record for records in threads.map(measure, drawn, PARTS) for record in records]


def _plan(part: Part) -> list[tuple[str, Reals, Reals]]:
    """Maps as (varied argument, its values, points)."""
    rows = ROWS_OF_INTEGRALS if part.integral else ROWS
    return [(varied, *part.map_points(varied, rows)) for varied in part.varied]


def _bundles(plans: dict[Part, list[tuple[str, Reals, Reals]]]) -> list[tuple[list[Any], Points]]:
    """Reference jobs with their keys, the slow ones first; those that share integrals go to one process together."""
    bundles: dict[Any, tuple[list[Any], Points]] = {}
    for part, maps in plans.items():
        shape = part.name.removeprefix("Smith, ").lower()
        for varied, _, points in maps:
            for row, line in enumerate(points):
                where = (shape, varied, row) if part.integral and varied in ("alpha", "gamma", "p") else (part, varied)
                keys, jobs = bundles.setdefault(where, ([], []))
                keys.append((part, varied, row))
                jobs.append((part.group, part.name, line, part.cosines))
        count = SCATTERED_INTEGRALS if part.integral else SCATTERED
        bundles[part] = ([(part, "", 0)], [(part.group, part.name, part.drawn(count), part.cosines)])
    return sorted(bundles.values(), key=lambda b: -any(k[0].integral for k in b[0]))


def _tabulate(jobs: Points) -> list[tuple[Reals, Reals]]:
    return [reference.tabulate(*job) for job in jobs]


def _finite_record(part: Part, precision: str, bad: tuple[int, int], draws: int) -> Record:
    nothing = Worst(0.0, "", {})
    return Record(part.group, part.name, precision, part.angle, nothing, nothing, 0, draws, *bad, (), nothing, 0.0, 0.0)


def _measured(record: Record, part: Part, plan: list[tuple[str, Reals, Reals]], found: dict[Any, Any]) -> Record:
    """``record`` with errors at all points. float32 is measured against float64 on numbers that float32 holds exactly."""
    double = record.precision == "float64"
    maps, seen = [], []

    def compare(points: Reals, want: tuple[Reals, Reals] | None) -> tuple[Reals, Reals]:
        dtype = PRECISIONS[record.precision]
        points = points if double else points.astype(np.float32).astype(np.float64)
        against = want if double and want is not None else evaluate(part, points)
        found = errors(part, points, evaluate(part, points, dtype), against, dtype)
        least = np.zeros_like(found[0]), np.zeros_like(found[1])
        if not double:  # what the best of formulas would err by
            by_value, by_slope = moved(part, points)
            least = errors(part, points, (against[0] + by_value, against[1] + by_slope), against, dtype)
        seen.append((points, *(np.column_stack(both) for both in (found, least))))
        return found

    for varied, values, points in plan:
        rows = [found[part, varied, k] for k in range(len(values))]
        want = tuple(np.concatenate(a) for a in zip(*rows, strict=True))
        value, slope = compare(points.reshape(-1, points.shape[-1]), want)  # type: ignore[arg-type]
        worst = np.where(np.isnan(slope), 0, slope).max(1)
        maps.append(Map(varied, values, part.columns, *(e.reshape(points.shape[:2]) for e in (value, worst))))
    if double:
        scattered = SCATTERED_INTEGRALS if part.integral else SCATTERED
        compare(part.drawn(scattered), found[part, "", 0])
    else:
        compare(part.drawn(SCATTERED_SINGLE // (8 if part.integral else 1)), None)
    points, error, least = (np.concatenate(a) for a in zip(*seen, strict=True))  # errors of the value, then of each slope
    names = ("value", *part.arguments)
    held = ~(least > HELD)  # NaN, where a slope does not exist, is no limit of the precision
    value, slope = np.where(held, error, 0)[:, :1], np.where(held, error, 0)[:, 1:]
    beyond, moved_there = _worst(part, points, np.where(held, 0, error), names, least)
    return replace(
        record,
        value=_worst(part, points, value, names)[0],
        slope=_worst(part, points, slope, part.arguments)[0],
        points=len(points),
        maps=tuple(maps),
        beyond=beyond,
        beyond_moved=moved_there,
        beyond_share=float((~held).any(1).mean()),
    )


def _worst(part: Part, points: Reals, error: Reals, names: Sequence[str], least: Reals | None = None) -> tuple[Worst, float]:
    """The largest of errors ``[n, names]`` and ``least`` there."""
    error = np.where(np.isnan(error), 0, error)
    k, column = np.unravel_index(np.argmax(error), error.shape)
    at = {a: float(x) for a, x in zip(part.arguments, points[k], strict=True)}
    return Worst(float(error[k, column]), names[int(column)], at), 0.0 if least is None else float(least[k, column])


__all__ = ["Map", "Record", "Worst", "survey"]
