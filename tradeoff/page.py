"""The survey as files: one self-contained page, and JSON with all numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from ..environment import environment
from ..files import StrPath, plain
from ..reports.beside import write_beside
from ..reports.words import NONE, significant, thousands
from ..reports.words import seconds as duration
from .approximations import Approximation
from .plots import Panel, Point, pareto
from .rendering import Rendering
from .settings import CHOICES, Setting
from .smith import Quadrature
from .survey import Tradeoff
from .timing import Timing

PAGE = "tradeoff.html"
NUMBERS = "tradeoff.json"
FLOOR_OF_STANDARD_ERRORS = 1e-4
FLOOR_OF_EXCESS = 1e-12
FLOOR_OF_DIFFERENCE = 1e-15
SHORT = {"Smith, height-correlated": "correlated", "Smith, separable": "separable", "exact dielectric": "exact"}
"""Forms as plots name them."""


def write_tradeoff(out_dir: StrPath, result: Tradeoff) -> Path:
    """Write DIR/tradeoff.json and DIR/tradeoff.html, each replaced whole; returns the path of the page."""
    where = environment()
    template = Path(__file__).parent / "tradeoff.html.j2"
    return write_beside(out_dir, template, _context(result, where), (PAGE, NUMBERS), document(result, where))


def document(result: Tradeoff, where: dict[str, Any]) -> dict[str, Any]:
    """All numbers as plain JSON values; where and when they were measured is in ``environment``. NaN becomes null."""
    table = result.table
    first = result.fits[0]
    found: dict[str, Any] = plain(
        {
            "format": "brdfit-tradeoff",
            "version": 1,
            "environment": where,
            "material": table.material,
            "source": table.source,
            "sha256": table.sha256,
            "angles": table.angles,
            "loss": first.loss,
            "measure": first.measure,
            "max_angle": first.max_angle,
            "advice": result.advice,
            "optimum": None if result.optimum is None else result.optimum.record(),
            **{k: [asdict(r) for r in getattr(result, k)] for k in _MEASURED},
            "fits": [f.record() for f in result.fits],
        }
    )
    return found


_MEASURED = ("settings", "renderings", "quadratures", "fresnel", "masking")


def _context(result: Tradeoff, where: dict[str, Any]) -> dict[str, Any]:
    loss = result.fits[0].loss
    model = result.optimum.model_name if result.optimum else ""
    return {
        "material": result.table.material,
        "source": Path(result.table.source).name,
        "sha256": result.table.sha256[:12],
        "cells": thousands(result.fits[0].cells["used"]),
        "loss": loss,
        "model": model,
        "where": where,
        "advice": result.advice,
        "problems": [f"{f.model_name}: {f.reason}" for f in result.fits if not f.converged],
        "settings": {
            "plot": _settings_plot(result.settings, model),
            "rows": [_setting(s, loss) for s in result.settings],
            "left_out": [c.label for c in CHOICES if c.label not in {s.label for s in result.settings}],
        },
        "rendering": {"plot": _rendering_plot(result.renderings), "rows": [_rendering(r) for r in result.renderings]},
        "quadrature": {"plot": _quadrature_plot(result.quadratures), "rows": [_quadrature(q) for q in result.quadratures]},
        "exchange": [
            {
                "key": key,
                "plot": _exchange_plot(forms, loss, key),
                "rows": [_exchange(f, loss) for f in forms],
                "perceptual": loss != "perceptual",
            }
            for key, forms in (("fresnel", result.fresnel), ("masking", result.masking))
        ],
    }


def _spread(t: Timing) -> str:
    return f"{duration(t.low)} to {duration(t.high)}" if t.repeats > 1 else NONE


def _nano(t: Timing) -> dict[str, str]:
    return {
        "time": significant(1e9 * t.median),
        "spread": f"{significant(1e9 * t.low)} to {significant(1e9 * t.high)}",
    }


def _setting(s: Setting, loss: str) -> dict[str, Any]:
    return {
        "label": s.label,
        "time": duration(s.seconds.median),
        "spread": _spread(s.seconds),
        "repeats": s.seconds.repeats,
        "path": s.path,
        "relative": significant(s.relative, 2),
        "standard": significant(s.standard_errors, 2),
        "spreads": significant(s.spreads, 2),
        "excess": significant(s.excess, 2),
        "error": significant(s.errors[loss], 6),
        "perceptual": significant(s.errors["perceptual"], 6),
    }


def _rendering(r: Rendering) -> dict[str, Any]:
    return {
        "label": r.label,
        "masking": {"integral": "integral", "table": "table"}.get(r.masking, "closed"),
        "numbers": r.numbers,
        "narrow": _nano(r.seconds),
        "wide": significant(1e9 * r.seconds_float64.median),
        "flops": thousands(r.operations.flops),
        "transcendentals": thousands(r.operations.transcendentals),
        "perceptual": significant(r.errors["perceptual"]),
        "log": significant(r.errors["log"]),
        "deviation": significant(r.deviation, 1),
    }


def _quadrature(q: Quadrature) -> dict[str, Any]:
    return {
        "model": q.model,
        "rule": "from a table" if q.rule == "table" else q.rule,
        "nodes": q.nodes,
        "time": _nano(q.seconds),
        "largest": significant(q.largest, 2),
        "typical": significant(q.typical, 2),
        "excess": ", ".join(f"{significant(100 * v, 2)} %" for v in q.excess.values()),
    }


def _exchange(a: Approximation, loss: str) -> dict[str, Any]:
    def both(errors: dict[str, float]) -> list[str]:
        return [significant(errors[k], 4) if k in errors else "\u2013" for k in dict.fromkeys((loss, "perceptual"))]

    return {
        "model": a.model,
        "form": a.form,
        "own": a.own,
        "time": _nano(a.seconds),
        "operations": thousands(a.operations.count),
        "typical": f"{significant(100 * a.typical, 2)} %",
        "large": f"{significant(100 * a.large, 2)} %",
        "errors": both(a.errors),
        "refitted": both(a.refitted),
    }


def _settings_plot(measured: Sequence[Setting], model: str) -> str:
    def points(error: str) -> list[Point]:
        return [
            Point(
                s.label, s.family, s.seconds.median, getattr(s, error), s.seconds.low, s.seconds.high, s.family == "default"
            )
            for s in measured
        ]

    panels = (
        Panel(
            points("standard_errors"), "prepare and solve, seconds", "parameter error, std. errors", FLOOR_OF_STANDARD_ERRORS
        ),
        Panel(points("excess"), "prepare and solve, seconds", "excess of the cost over the optimum", FLOOR_OF_EXCESS),
    )
    return pareto(panels, f"Error over time of each setting of a fit of {model}", "tradeoff-settings")


def _timed(label: str, group: str, t: Timing, error: float) -> Point:
    """A point whose cost is the time of one direction in nanoseconds."""
    return Point(label, group, 1e9 * t.median, error, 1e9 * t.low, 1e9 * t.high, named=True)


def _rendering_plot(drawn: Sequence[Rendering]) -> str:
    def points(flops: bool) -> list[Point]:
        out = []
        for r in drawn:
            error = r.errors["perceptual"]
            if flops:
                out.append(Point(r.label, r.model, r.operations.flops + r.operations.transcendentals, error, named=True))
            else:
                out.append(_timed(r.label, r.model, r.seconds, error))
        return out

    panels = (
        Panel(points(False), "float32, nanoseconds a direction", "perceptual error"),
        Panel(points(True), "operations a direction, by the compiler's count", "perceptual error"),
    )
    return pareto(panels, "Perceptual error over the cost of evaluation of each model", "tradeoff-rendering")


def _quadrature_plot(rules: Sequence[Quadrature]) -> str:
    def points(nodes: bool) -> list[Point]:
        out = []
        for q in rules:
            label = "table" if q.rule == "table" else f"{q.nodes} in {q.rule[-1]}"
            if not nodes:
                out.append(replace(_timed(label, q.model, q.seconds, q.largest), named=False))
            elif q.rule != "table":
                out.append(Point(label, q.model, q.nodes, q.largest))
        return out

    panels = (
        Panel(points(True), "nodes", "largest relative error of the BRDF", FLOOR_OF_DIFFERENCE, apart=True),
        Panel(
            points(False),
            "float64, nanoseconds a direction",
            "largest relative error of the BRDF",
            FLOOR_OF_DIFFERENCE,
            apart=True,
        ),
    )
    return pareto(panels, "Quadrature error of Smith masking over nodes and over time", "tradeoff-quadrature")


def _exchange_plot(forms: Sequence[Approximation], loss: str, key: str) -> str:
    def points(error: str) -> list[Point]:
        return [_timed(SHORT.get(a.form, a.form), a.model, a.seconds, a.refitted.get(error, float("nan"))) for a in forms]

    names = tuple(dict.fromkeys((loss, "perceptual")))
    panels = [Panel(points(n), "float32, nanoseconds a direction", f"{n} error, fitted again", apart=True) for n in names]
    return pareto(panels, f"Error over cost of each form of {key}", f"tradeoff-{key}")


__all__ = ["document", "write_tradeoff"]
