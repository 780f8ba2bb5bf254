"""The page of the comparison: ranks, what to use for which kind of material, a heat map, and error against cost."""

from __future__ import annotations

import csv
import json
import os
import platform
import re
from collections import Counter
from datetime import date
from itertools import pairwise
from pathlib import Path
from typing import Any

import brdfit
import numpy as np
from brdfit.models import MODELS, model, parameters_of
from brdfit.reports.plots import new_figure, styled
from brdfit.tabulated import read, tabulate
from brdfit.tradeoff.evaluation import Evaluation, direct
from brdfit.tradeoff.pareto import front
from brdfit.tradeoff.sample import draw
from brdfit.tradeoff.timing import interleaved

LOSSES = ("perceptual", "log", "ngan")
"""What people see, what a fit minimises by default, and what the published fits minimised."""
KINDS = {
    "metals": ("alum-bronze aluminium black-oxidized-steel brass chrome nickel ss440 tungsten-carbide"),
    "metallic paints": (
        "blue-metallic-paint color-changing-paint1 color-changing-paint3 gold-metallic-paint3 green-metallic-paint "
        "pearl-paint silver-metallic-paint2 two-layer-silver"
    ),
    "plain paints": "purple-paint white-paint yellow-paint",
    "plastics": (
        "blue-acrylic gray-plastic polyethylene red-phenolic red-specular-plastic specular-green-phenolic "
        "specular-orange-phenolic specular-white-phenolic white-acrylic"
    ),
    "fabrics": "black-fabric dark-specular-fabric green-fabric light-brown-fabric pink-fabric red-fabric white-fabric",
    "stones and woods": "fruitwood-241 hematite natural-209 pink-jasper special-walnut-224",
}
"""Materials by what they are."""
KIND = {material: kind for kind, materials in KINDS.items() for material in materials.split()}
CLOSE = 1.1
"""A model whose error is below this multiple of the best one's is as good in practice."""
CHEAPER, BEARABLE = 0.9, 3.0
"""A model that costs less than this share of the best one's time is named, if its error is below this multiple."""
REPEATS = 30
LISTED = 40
"""Fits that did not converge are listed up to so many."""
LETTER, LINE = 4.0, 10.0
"""Width and height of a letter of a label, in points."""
COSTLY = 3
"""Models that are fitted last and may be missing for some materials."""
SAME_AS = {"low_microfacet": "abc"}
"""Models whose lobes are those of another, which stands for both where one model is named."""

RANKS = """\
By loss and for all three: the error over the smallest of any model on the same material, geometric mean over the
materials; *worst*, the largest such ratio of any material and loss. *Numbers*: parameters of three channels. *At a
bound*: fits in which a parameter that bends the lobe ends at a bound of its search box; colours at 0 do not count.
*Fit*: seconds of the search, nothing compiled, as many fits at a time as there are cores. *ns*: one pair of directions,
three channels, float32, one core, Smith's masking read from its table (`brdfit.ready`). Both are lower quartiles."""

SCHLICK = """\
Their Fresnel factor is Schlick's: it reflects all
light at grazing even where F0 is 0, and no other scale takes the lobe away. Dark fabrics do not do that."""

Row = dict[str, Any]
Reals = np.ndarray


class Comparison:
    """Errors ``[models, materials, losses]`` of the finished fits, NaN where there is none."""

    def __init__(self, rows: list[Row], cost: dict[str, float]) -> None:
        self.cost = cost
        kinds = list(KINDS)
        count = Counter(r["material"] for r in rows)
        known = {m for m in count if count[m] >= max(count.values()) - len(LOSSES) * COSTLY}
        self.rows = [r for r in rows if r["material"] in known]
        self.materials = sorted(known, key=lambda m: (kinds.index(KIND[m]) if m in KIND else len(kinds), m))
        self.models = [m for m in MODELS if any(r["model"] == m for r in rows)]
        at = {(r["model"], r["material"], r["loss"]): r["error"] for r in rows}
        self.errors = np.array(
            [[[at.get((m, t, e), np.nan) for e in LOSSES] for t in self.materials] for m in self.models], float
        )
        self.own = [i for i, m in enumerate(self.models) if m not in SAME_AS]
        self.ratio = self.errors / np.nanmin(self.errors[self.own], 0)
        overall = {m: self.typical(m) for m in self.models}
        self.ranked = sorted(self.models, key=lambda m: overall[m])

    def over_best(self, name: str, loss: str | None = None, kind: str | None = None) -> Reals:
        """Error of a model over the smallest of any model, on the materials of a kind, under one loss or all."""
        materials = [i for i, t in enumerate(self.materials) if kind is None or KIND.get(t) == kind]
        losses = range(len(LOSSES)) if loss is None else [LOSSES.index(loss)]
        return self.ratio[self.models.index(name)][np.ix_(materials, losses)]

    def typical(self, name: str, loss: str | None = None, kind: str | None = None) -> float:
        """Geometric mean of :meth:`over_best`."""
        known = self.over_best(name, loss, kind)
        known = known[np.isfinite(known)]
        return float(np.exp(np.log(known).mean())) if known.size else np.nan

    def wins(self, name: str, loss: str, kind: str) -> int:
        """On how many materials of a kind no model has a smaller error."""
        return int((self.over_best(name, loss, kind) <= 1).sum())

    def of(self, name: str) -> list[Row]:
        return [r for r in self.rows if r["model"] == name]


def costs(rows: list[Row], table: brdfit.Table) -> dict[str, float]:
    """Nanoseconds to evaluate each model, as it was fitted to some material, in one pair of directions of a table, three
    channels, float32, on one core. Masking that is an integral is read off a table made beforehand.
    """
    sample = draw(table, 80.0, "solid_angle")
    fits = {r["model"]: r["parameters"] for r in reversed(rows)}
    calls = {}
    for name, parameters in fits.items():
        plain = model(name, **parameters)
        tabulated = tabulate(plain)
        quick = Evaluation(read, tabulated, sample) if tabulated.tables else None
        calls[name] = quick or Evaluation(direct, plain, sample)
    times = interleaved(calls, REPEATS, 60.0)
    return {name: t.low / calls[name].count * 1e9 for name, t in times.items()}


def _numbers(name: str) -> int:
    return sum(3 if p.per_channel else 1 for p in parameters_of(MODELS[name][0]))


def _bent(name: str, row: Row) -> bool:
    """Whether a parameter that bends the lobe, not a colour at 0, lies at a bound of its search box."""
    shapes = {p.name for p in parameters_of(MODELS[name][0]) if not p.linear}
    return any(re.split(r"\W", b)[0] in shapes for b in row["at_bound"])


def ranking(c: Comparison) -> list[str]:
    """The table of all models."""
    lines = [
        "| | model | " + " | ".join(LOSSES) + " | all | worst | numbers | at a bound | converged | fit, s | ns |",
        "|---|---|" + "---|" * (len(LOSSES) + 7),
    ]
    for k, m in enumerate(c.ranked, 1):
        mine = c.of(m)
        typical = ["-" if np.isnan(t) else f"{t:.2f}" for t in (c.typical(m, loss) for loss in LOSSES)]
        bent = sum(_bent(m, r) for r in mine) / len(mine)
        converged = sum(r["converged"] for r in mine)
        seconds = np.quantile([r["seconds"] for r in mine], 0.25)
        lines.append(
            f"| {k} | `{m}` | {' | '.join(typical)} | **{c.typical(m):.2f}** | {np.nanmax(c.over_best(m)):.1f} | "
            f"{_numbers(m)} | {bent:.0%} | {converged} of {len(mine)} | {seconds:.2f} | {c.cost.get(m, np.nan):.1f} |"
        )
    return lines


def below_lambert(c: Comparison) -> str:
    """Models that have a lobe and are worse than none on some materials, in words; nothing if there is none."""
    none = c.ratio[c.models.index("lambert")] * (1 + 1e-6)
    worse = {m: int((c.ratio[c.models.index(m)] > none).any(1).sum()) for m in c.ranked if "oren_nayar" not in m}
    found = ", ".join(f"`{m}` {n}" for m, n in worse.items() if n)
    return f"Worse than `lambert` on some materials, under one of the losses: {found}. {SCHLICK}" if found else ""


def able(c: Comparison, kind: str) -> list[str]:
    """Models that were fitted to all materials of a kind, by their error under the first loss."""
    known = [m for m in c.models if m not in SAME_AS and np.isfinite(c.over_best(m, None, kind)).all()]
    return sorted(known, key=lambda m: c.typical(m, LOSSES[0], kind))


def summary(c: Comparison) -> str:
    """The best model of each kind in one sentence; that of several kinds stands for all of them that it is close on."""
    best = {kind: able(c, kind)[0] for kind in KINDS if any(KIND.get(m) == kind for m in c.materials)}
    usual, _ = Counter(best.values()).most_common(1)[0]
    lead = {kind: c.typical(usual, LOSSES[0], kind) / c.typical(m, LOSSES[0], kind) for kind, m in best.items()}
    first = [kind for kind, m in best.items() if m == usual]
    close = [kind for kind, m in best.items() if m != usual and lead[kind] <= CLOSE]
    words = f"In short, judged under `{LOSSES[0]}`: `{usual}` for {', '.join(first)}"
    words += f", and within {CLOSE - 1:.0%} of the best for {', '.join(close)}" if close else ""
    rest = [kind for kind in best if kind not in first and kind not in close]
    others = [f"`{best[kind]}` for {kind} (`{usual}` {lead[kind]:.2f} times its error)" for kind in rest]
    return "; ".join([words, *others]) + "."


def advice(c: Comparison, kind: str) -> list[str]:
    """Which model to use for a kind of material, in words."""
    loss = LOSSES[0]
    members = [m for m in c.materials if KIND.get(m) == kind]
    by_error = able(c, kind)
    best, *others = by_error
    lead = c.typical(best, loss, kind)
    close = [m for m in others if c.typical(m, loss, kind) <= CLOSE * lead]
    cheap = [m for m in by_error if c.cost[m] < CHEAPER * c.cost[best] and c.typical(m, loss, kind) < BEARABLE * lead]
    words = [
        f"**{kind[0].upper()}{kind[1:]}** ({len(members)}: {', '.join(members)}). "
        f"Use `{best}`: its `{loss}` error is {lead:.2f} times the smallest of any model, on average, and it is the best "
        f"of all on {c.wins(best, loss, kind)} of {len(members)}."
    ]
    if close:
        words.append(
            f"As good within {CLOSE - 1:.0%}: " + ", ".join(f"`{m}` ({c.typical(m, loss, kind):.2f})" for m in close) + "."
        )
    else:
        words.append(f"Next is `{others[0]}` ({c.typical(others[0], loss, kind):.2f}).")
    if cheap:
        m = cheap[0]
        words.append(
            f"Of the models that cost less than {CHEAPER} of its {c.cost[best]:.0f} ns, `{m}` ({c.cost[m]:.0f} ns) loses "
            f"least: {c.typical(m, loss, kind):.2f}."
        )
    for other in LOSSES[1:]:
        m = min(by_error, key=lambda m: c.typical(m, other, kind))
        value, its = c.typical(m, other, kind), c.typical(best, other, kind)
        leads = f"leads too ({value:.2f})" if m == best else f"leads ({value:.2f}; `{best}` {its:.2f})"
        words.append(f"Fitted and judged under `{other}`, `{m}` {leads}.")
    return [" ".join(words), ""]


def heat_map(c: Comparison, path: Path) -> None:
    """Error over the best of any model: models by rank, materials by kind, a panel a loss."""
    rows = [c.models.index(m) for m in c.ranked]
    edges = [i for i in range(1, len(c.materials)) if KIND.get(c.materials[i]) != KIND.get(c.materials[i - 1])]
    with styled(grid=False):
        figure, axes = new_figure(16, 9.4, (1.6, 0.95, 1.75, 0.75), 1, len(LOSSES), sharey=True)
        figure.subplots_adjust(wspace=0.04)
        for k, (ax, loss) in enumerate(zip(axes[0], LOSSES, strict=True)):
            values = np.log2(c.ratio[rows, :, k])
            image = ax.imshow(values, aspect="auto", cmap="viridis_r", vmin=0, vmax=4, interpolation="nearest")
            for e in edges:
                ax.axvline(e - 0.5, color="white", lw=1.6)
            ax.set_title(f"fitted and judged under {loss}", pad=34)
            ax.set_facecolor("#d8d8d8")
            starts = [0, *edges, len(c.materials)]
            for a, b in pairwise(starts):
                name = KIND.get(c.materials[a], "others").replace(" ", "\n", 1)
                ax.text((a + b - 1) / 2, -0.9, name, ha="center", va="bottom", fontsize=7, color="#444444")
            ax.set_xticks(range(len(c.materials)), c.materials, rotation=90, fontsize=6.5)
            ax.tick_params(length=0)
            best = np.argwhere((values <= 0) & np.isin(rows, c.own)[:, None])
            ax.plot(best[:, 1], best[:, 0], "o", ms=2.2, color="#D55E00", lw=0)
        axes[0, 0].set_yticks(range(len(rows)), c.ranked, fontsize=8)
        box = axes[0, -1].get_position()
        bar = figure.colorbar(image, cax=figure.add_axes((0.952, box.y0, 0.009, box.height)), extend="max")
        bar.set_ticks(range(5), labels=["1", "2", "4", "8", "16"])
        bar.set_label("error over that of the best model of the material (dots)")
        bar.outline.set_linewidth(0.4)
        figure.savefig(path, dpi=100)


def pareto(c: Comparison, path: Path) -> None:
    """Error over the best against the cost of evaluation, of all materials and of each kind."""
    kinds = [None, *KINDS]
    with styled():
        figure, axes = new_figure(15, 8.4, (0.7, 0.15, 0.6, 0.35), 2, 4)
        figure.subplots_adjust(wspace=0.18, hspace=0.24)
        axes[1, 3].axis("off")
        for ax, kind in zip(axes.ravel(), kinds, strict=False):
            models = [m for m in c.models if m not in SAME_AS]
            points = [(c.cost[m], c.typical(m, LOSSES[0], kind)) for m in models]
            if not np.isfinite(points).all(-1).any():
                ax.axis("off")  # no material of this kind
                continue
            best = front(points)
            x, y = np.array(points).T
            ax.set_xscale("log")
            ax.set_yscale("log")
            ax.set_xlim(x.min() / 3.2, x.max() * 1.3)
            ax.set_ylim(0.8, np.nanmax(y) * 1.15)
            ax.plot(x, y, "o", ms=4, mfc="white", mec="#8a8a8a", lw=0)
            ax.plot(x[best], y[best], "o-", ms=5, color="#0072B2", lw=0.9, drawstyle="steps-post")
            placed: list[tuple[float, float]] = []
            for i in best:  # to the left of each point and below it no point lies; but labels may
                right, height = ax.transData.transform(points[i]) * 72 / figure.dpi
                left, drop = right - 5 - LETTER * len(models[i]), -6.0
                while any(left < r and abs(height + drop - h) < LINE for r, h in placed):
                    drop -= 1
                placed.append((right, height + drop))
                ax.annotate(
                    models[i], points[i], (-5, drop), textcoords="offset points", ha="right", va="center", fontsize=7
                )
            ax.set_title("all materials" if kind is None else kind)
            ticks = [t for t in (1, 1.5, 2, 3, 5, 10, 20, 50) if t < np.nanmax(y) * 1.15]
            ax.set_yticks(ticks, [f"{t:g}" for t in ticks])
            ax.yaxis.set_minor_locator(_none())
        for ax in axes[:, 0]:
            ax.set_ylabel(f"{LOSSES[0]} error over the best model's")
        for ax in (*axes[1, :3], axes[0, 3]):
            ax.set_xlabel("evaluation, ns for a pair of directions")
        text = (
            "Each point is a model; filled, on the line:\nno other model is both cheaper and better.\n\n"
            "Error: geometric mean over the materials of\nthe error over the smallest of any model.\n\n"
            "Cost: one core, float32, three channels,\ncompiled, 8,192 directions at a time;\nSmith's integral from a table."
        )
        axes[1, 3].text(0.05, 0.95, text, va="top", fontsize=9, color="#333333")
        figure.savefig(path, dpi=100)


def _none() -> Any:
    from matplotlib.ticker import NullLocator

    return NullLocator()


def winners(c: Comparison) -> list[str]:
    """The best model of each material."""
    lines = ["| material | kind | " + " | ".join(LOSSES) + " |", "|---|---|" + "---|" * len(LOSSES)]
    for i, t in enumerate(c.materials):
        cells = []
        for k in range(len(LOSSES)):
            j = c.own[int(np.nanargmin(c.errors[c.own, i, k]))]
            cells.append(f"`{c.models[j]}` {c.errors[j, i, k]:.5f}")
        lines.append(f"| {t} | {KIND.get(t, '')} | " + " | ".join(cells) + " |")
    return lines


def table(rows: list[Row], path: Path) -> None:
    """Every fit with its parameters, as CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["material", "model", "loss", "error", "converged", "seconds", "at_bound", "parameters"])
        for r in sorted(rows, key=lambda r: (r["material"], r["model"], r["loss"])):
            short = {n: np.vectorize(lambda v: float(f"{v:.6g}"))(v).tolist() for n, v in r["parameters"].items()}
            numbers = json.dumps(short, separators=(",", ":"))
            bounds = "; ".join(r["at_bound"])
            out.writerow(
                [r["material"], r["model"], r["loss"], f"{r['error']:.7g}", r["converged"], r["seconds"], bounds, numbers]
            )


def _missing(c: Comparison, materials: list[str]) -> str:
    """What of the comparison has not been done yet, in words; nothing if all has."""
    words = []
    if left := [m for m in materials if m not in c.materials]:
        words.append(
            f"Not done yet, left out of all numbers: {len(left)} of {len(materials)} materials ({', '.join(left)})."
        )
    partly = {m: len(c.of(m)) for m in c.models if len(c.of(m)) < len(c.materials) * len(LOSSES)}
    if partly:
        some = ", ".join(f"`{m}` {n}" for m, n in partly.items())
        words.append(
            f"Of {len(c.materials) * len(LOSSES)} fits a model some have fewer, over which their means are: {some}."
        )
    return " ".join([*words, "The same command goes on from the fits that are kept."]) if words else ""


def write(out: Path, rows: list[Row], materials: list[str], first: brdfit.Table, command: str, settings: str) -> None:
    """The page, its two pictures and the table of all fits, side by side."""
    c = Comparison(rows, costs(rows, first))
    rows = c.rows
    base = out.with_suffix("")
    heat_map(c, base.with_name(base.name + "_errors.png"))
    pareto(c, base.with_name(base.name + "_cost.png"))
    table(rows, out.with_suffix(".csv"))
    failed = sorted((r for r in rows if not r["converged"]), key=lambda r: (c.ranked.index(r["model"]), r["material"]))
    lines = [
        "# Which model for which material",
        "",
        f"{len(c.models)} models x {len(c.materials)} materials x {len(LOSSES)} losses, {len(rows)} fits, made on "
        f"{date.today().isoformat()} by",
        f"`{command}`",
        f"({os.cpu_count()} cores, {platform.machine()}). {settings}",
        "",
        *([missing, ""] if (missing := _missing(c, materials)) else []),
        "Each fit is judged under the loss that it was fitted with. `perceptual` ranks fits as people do, `log` is what a",
        "fit minimises by default, and `ngan` compares the values themselves, so that peaks decide. Every fit, with its",
        f"parameters, is in [{base.name}.csv]({base.name}.csv).",
        "",
        "## Which model to use",
        "",
        "These sentences are made from the numbers below. *On average* is the geometric mean, over the materials, of the",
        "error over the smallest of any model on the same material.",
        "",
    ]
    lines += [summary(c), ""]
    for kind in KINDS:
        if any(KIND.get(m) == kind for m in c.materials):
            lines += advice(c, kind)
    lines += [
        f"![Error over that of the best model, for each model, material and loss]({base.name}_errors.png)",
        "",
        "## All models, ranked",
        "",
        RANKS,
        "",
        *ranking(c),
        "",
        "`low_microfacet` is `abc` with another scale; `lambert`, `oren_nayar` and `oren_nayar_full` have no lobe and say",
        f"how much a lobe is worth. {below_lambert(c)}".strip(),
        "",
        "## Error against the cost of evaluation",
        "",
        f"![Error against evaluation cost, with the models that are worth their cost]({base.name}_cost.png)",
        "",
        "## The best model of each material",
        "",
        *winners(c),
        "",
    ]
    if failed:
        lines += [
            "## Fits that did not converge",
            "",
            f"{len(failed)} of {len(rows)}:"
            if len(failed) <= LISTED
            else f"{LISTED} of {len(failed)}; all are in the CSV file:",
            "",
            *(f"- `{r['model']}`, {r['material']}, `{r['loss']}`: {r['reason']}" for r in failed[:LISTED]),
            "",
        ]
    out.write_text("\n".join(lines), encoding="utf-8")
