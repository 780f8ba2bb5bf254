"""The plots: error over cost, with the choices that are worth having joined and named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..reports.plots import MARKERS, OTHERS, PALETTE, as_svg, log_ticks, new_figure, styled
from .pareto import front

GAP = 11.0
"""Least distance of two labels, points."""


@dataclass(frozen=True)
class Point:
    """One choice: its cost and error, and how they are drawn."""

    label: str
    group: str
    """Points of a group share colour and marker."""
    cost: float
    error: float
    low: float | None = None
    """Quartiles of the cost."""
    high: float | None = None
    named: bool = False
    """Whether it is labelled even if it is not on the front."""


@dataclass(frozen=True)
class Panel:
    """Points that compete, and what the axes mean."""

    points: Sequence[Point]
    cost: str
    error: str
    floor: float = 0.0
    """Errors below are drawn here, as the last one that can be told from rounding."""
    apart: bool = False
    """Whether each group has a front of its own."""


def pareto(panels: Sequence[Panel], alt: str, salt: str) -> str:
    """Panels side by side, logarithmic; filled points lie on the front, bars are quartiles of the time. SVG text."""
    groups = list(dict.fromkeys(p.group for panel in panels for p in panel.points))
    look = {g: _look(g, k) for k, g in enumerate(groups)}
    with styled(salt):
        figure, axes = new_figure(10, 3.9, (0.75, 0.1, 0.5, 0.4), 1, len(panels))
        figure.subplots_adjust(wspace=0.24)
        for ax, panel in zip(axes[0], panels, strict=True):
            _draw(ax, panel, look)
        handles = {label: h for ax in axes[0] for h, label in zip(*ax.get_legend_handles_labels(), strict=True)}
        figure.legend(handles.values(), handles.keys(), loc="upper center", ncols=min(len(handles), 9), handletextpad=0.3)
        return as_svg(figure, alt)


def _look(group: str, k: int) -> dict[str, Any]:
    return {"color": PALETTE.get(group, OTHERS[k % len(OTHERS)]), "marker": MARKERS[k % len(MARKERS)]}


def _draw(ax: Any, panel: Panel, look: dict[str, dict[str, Any]]) -> None:
    shown = [p for p in panel.points if np.isfinite(p.error) and np.isfinite(p.cost) and p.cost > 0]
    if not shown:
        ax.text(0.5, 0.5, "nothing to show", ha="center", transform=ax.transAxes)
        return
    least = min((p.error for p in shown if p.error > panel.floor), default=1.0)
    floor = panel.floor or least / 10
    ax.set_xscale("log")
    ax.set_yscale("log")
    costs, errors = np.array([p.cost for p in shown]), np.maximum([p.error for p in shown], floor)
    span = np.log10(costs.max() / costs.min()), np.log10(errors.max() / errors.min())
    ax.set_xlim(costs.min() / 10 ** (0.12 + 0.30 * span[0]), costs.max() * 10 ** (0.15 + 0.16 * span[0]))
    ax.set_ylim(errors.min() / 10 ** (0.10 + 0.22 * span[1]), errors.max() * 10 ** (0.05 + 0.08 * span[1]))
    seen: set[str] = set()
    for competing in list(dict.fromkeys(p.group for p in shown)) if panel.apart else [None]:
        members = [i for i, p in enumerate(shown) if competing in (None, p.group)]
        best = [members[i] for i in front([(costs[i], errors[i]) for i in members])]
        colour = look[competing]["color"] if competing else "#555555"
        ax.plot(costs[best], errors[best], color=colour, lw=0.9, alpha=0.6, drawstyle="steps-post", zorder=1)
        for i in members:
            p, style = shown[i], look[shown[i].group]
            face = style["color"] if i in best else "white"
            label = None if p.group in seen else p.group
            seen.add(p.group)
            ax.plot(p.cost, errors[i], lw=0, ms=5.5, **style, mfc=face, label=label, zorder=3)
            if p.low is not None and p.high is not None:
                ax.plot([p.low, p.high], [errors[i]] * 2, color=style["color"], lw=0.9, zorder=2)
        _name(ax, [(p.label, costs[i], errors[i]) for i, p in enumerate(shown) if i in best])
        others = [i for i in members if shown[i].named and i not in best]
        for i in others:
            _label(ax, shown[i].label, (costs[i], errors[i]), (5, 4), "left")
    ax.set_xlabel(panel.cost)
    ax.set_ylabel(panel.error)
    log_ticks(ax)


def _name(ax: Any, best: Sequence[tuple[str, float, float]]) -> None:
    """Name the points of a front to their lower left, where by its definition no point lies."""
    height = float("inf")
    for label, x, y in sorted(best, key=lambda b: b[1]):
        at = ax.transData.transform((x, y))[1] * 72 / ax.figure.dpi
        drop = min(-5.0, height - GAP - at)
        height = at + drop
        _label(ax, label, (x, y), (-5, drop), "right")


def _label(ax: Any, text: str, at: tuple[float, float], shift: tuple[float, float], side: str) -> None:
    ax.annotate(text, at, xytext=shift, textcoords="offset points", ha=side, va="center", fontsize=7.5, color="#222222")


__all__ = ["Panel", "Point", "pareto"]
