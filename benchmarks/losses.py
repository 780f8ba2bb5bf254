"""Which loss and measure to fit with: perceptual error and image difference of every one, per model: makes docs/losses.md.

    python benchmarks/losses.py TABLES --keep losses.jsonl --out docs/losses.md [--every 2]

TABLES holds MERL .binary files, of which every N-th is taken. Each is fitted with each model under each loss and measure.
The perceptual error is that of reports, with the solid-angle measure whatever was fitted; the image difference is the mean
CIEDE2000 of the sphere that reports render. Finished fits are kept as lines of JSON; an interrupted run goes on from them.
"""

from __future__ import annotations

import json
import os
import platform
import sys
from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import Any

import brdfit
import kept
import numpy as np
from brdfit.fitting import LOSSES
from brdfit.reports.gather import sphere, sphere_directions
from brdfit.values import values_of

MODELS = ("gtr", "abc", "sgd", "ward", "ashikhmin_shirley")
MEASURES = ("solid_angle", "cells")
DEFAULT = ("log", "solid_angle")
ERRORS = {"perceptual": "perceptual error", "image": "image difference (mean CIEDE2000)"}

Row = dict[str, Any]


def measured(path: Path) -> Iterator[Row]:
    """Every model, loss and measure on one table."""
    table = brdfit.load(path)
    directions = sphere_directions()
    fits = [
        brdfit.fit(table, model, loss=loss, measure=measure) for measure in MEASURES for loss in LOSSES for model in MODELS
    ]
    for fit in fits:
        values = values_of(fit.model, *directions[1:], table.channels)
        difference = sphere(table, directions, values[None], {}).difference
        yield {
            "material": table.material,
            "model": fit.model_name,
            "loss": fit.loss,
            "measure": fit.measure,
            "converged": fit.converged,
            "perceptual": brdfit.evaluate(table, fit.model)["perceptual"],
            "image": float(np.nanmean(difference)),
        }


def ratios(rows: list[Row], model: str, error: str) -> dict[tuple[str, str], np.ndarray]:
    """Error of each loss and measure over the smallest of any on the same material, ``[materials]``."""
    mine = {(r["loss"], r["measure"], r["material"]): r[error] for r in rows if r["model"] == model}
    materials = sorted({key[2] for key in mine})
    choices = [(loss, measure) for loss in LOSSES for measure in MEASURES]
    errors = np.array([[mine[*choice, material] for material in materials] for choice in choices])
    return dict(zip(choices, errors / errors.min(0), strict=True))


def typical(values: np.ndarray) -> float:
    """Geometric mean."""
    return float(np.exp(np.log(values).mean()))


def named(choice: tuple[str, str]) -> str:
    return f"`{choice[0]}` over {'solid angle' if choice[1] == 'solid_angle' else choice[1]}"


def verdict(rows: list[Row], model: str, error: str) -> str:
    """One row of the summary: the best choice, and the default beside it."""
    all_ratios = ratios(rows, model, error)
    best = min(all_ratios, key=lambda c: typical(all_ratios[c]))
    mine, default = all_ratios[best], all_ratios[DEFAULT]
    quotient = default / mine
    low, middle, high = np.percentile(quotient, [25, 50, 75])
    spread = f"{middle:.2f} ({low:.2f} to {high:.2f})"
    return f"| {model} | {ERRORS[error]} | {named(best)} | {spread} | {int((quotient > 1).sum())} of {len(quotient)} |"


def page(rows: list[Row], command: str) -> str:
    """The page as Markdown."""
    materials = sorted({r["material"] for r in rows})
    lines = [
        "# Which loss to fit with",
        "",
        f"{len(materials)} materials x {len(MODELS)} models x {len(LOSSES)} losses x {len(MEASURES)} measures, made on "
        f"{date.today().isoformat()} by",
        f"`{command}`",
        f"({os.cpu_count()} cores, {platform.machine()}).",
        "",
        f"{sum(r['converged'] for r in rows)} of {len(rows)} fits converged.",
        "",
        "Two errors say how a fit looks: the `perceptual` error over all cells, with the solid-angle measure whatever was",
        "fitted, and the mean CIEDE2000 between the sphere of the material and that of the fit, as reports render it. A fit",
        "with the `perceptual` loss minimises the first by definition: the second is what tests it.",
        "",
        "## What a better choice than the default would gain",
        "",
        f"The default is {named(DEFAULT)}. *Default over best*: its error over that of the choice that is best on average,",
        "median (quartiles) over the materials; the last column counts the materials on which the default is worse.",
        "",
        "| model | error | best on average | default over best | default worse on |",
        "|---|---|---|---|---|",
        *(verdict(rows, model, error) for model in MODELS for error in ERRORS),
        "",
        "The default stays what published fits and the best errors known are stated under, so that a result can be held",
        "against them as it comes. To render with a fit, choose by the tables below.",
        "",
    ]
    for error, title in ERRORS.items():
        lines += [
            f"## {title[0].upper()}{title[1:]}",
            "",
            "Geometric mean over the materials of the error over the smallest of any choice on the same material and model;",
            "in brackets on how many materials the choice is the best one.",
            "",
            "| loss | measure | " + " | ".join(MODELS) + " | all models |",
            "|---|---|" + "---|" * (len(MODELS) + 1),
        ]
        by_model = {m: ratios(rows, m, error) for m in MODELS}
        smallest = {m: min(typical(v) for v in by_model[m].values()) for m in MODELS}
        for choice in by_model[MODELS[0]]:
            cells = []
            for m in MODELS:
                value = typical(by_model[m][choice])
                mark = "**" if value == smallest[m] else ""
                cells.append(f"{mark}{value:.3f}{mark} ({int((by_model[m][choice] == 1).sum())})")
            together = typical(np.concatenate([by_model[m][choice] for m in MODELS]))
            lines.append(f"| {choice[0]} | {choice[1].replace('_', ' ')} | " + " | ".join(cells) + f" | {together:.3f} |")
        lines.append("")
    lines.append("Materials: " + ", ".join(materials) + ".")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Parse, fit what is missing, write."""
    args = kept.arguments(__doc__)
    rows = kept.rows(args.keep)
    tables = args.tables
    for k, path in enumerate(tables):
        if not any(r["material"] == path.stem for r in rows):
            rows += (new := list(measured(path)))
            with args.keep.open("a") as file:
                file.writelines(json.dumps(r) + "\n" for r in new)
        print(f"{k + 1}/{len(tables)} {path.stem}", file=sys.stderr, flush=True)
    command = kept.command("losses", "losses", args.every)
    args.out.write_text(page([r for r in rows if r["material"] in {p.stem for p in tables}], command), encoding="utf-8")
    print(args.out)


if __name__ == "__main__":
    main()
