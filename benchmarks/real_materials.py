"""Five models on every table of a folder, beside the published fits and the best errors known: makes docs/real_materials.md.

    python benchmarks/real_materials.py TABLES --best-known best_known.csv --out docs/real_materials.md

TABLES holds MERL .binary files; best_known.csv has the columns material, model and error (loss ``log``, solid-angle measure,
80 degrees, lower edges).
"""

from __future__ import annotations

import argparse
import csv
import os
import platform
import statistics
import sys
import time
from datetime import date
from pathlib import Path

import brdfit
from brdfit.data import published_abc, published_materials, published_sgd

MODELS = ("gtr", "abc", "sgd", "ward", "ashikhmin_shirley")
PUBLISHED = {"abc": published_abc, "sgd": published_sgd}


def rows(tables: list[Path]) -> list[tuple[str, dict[str, brdfit.Fit], dict[str, float]]]:
    """Fits by model and published errors of each table."""
    out = []
    for path in tables:
        table = brdfit.load(path)
        fits = {f.model_name: f for f in brdfit.fit_many([table], MODELS)}
        published = {
            model: brdfit.evaluate(table, preset(table.material))["log"]
            for model, preset in PUBLISHED.items()
            if table.material in published_materials(model)
        }
        out.append((table.material, fits, published))
        print(f"{len(out)}/{len(tables)} {table.material}", file=sys.stderr, flush=True)
    return out


def page(
    results: list[tuple[str, dict[str, brdfit.Fit], dict[str, float]]], best: dict[tuple[str, str], float], took: float
) -> str:
    """The page as Markdown."""
    fits = [f for _, by_model, _ in results for f in by_model.values()]
    excess = [f.errors["log"] / best[f.material, f.model_name] - 1 for f in fits if (f.material, f.model_name) in best]
    solve = {m: [by_model[m].seconds["solve"] for _, by_model, _ in results] for m in MODELS}
    lines = [
        "# Real materials",
        "",
        f"{len(results)} materials x {len(MODELS)} models with default settings, made on {date.today().isoformat()} by",
        "`python benchmarks/real_materials.py TABLES --best-known best_known.csv --out docs/real_materials.md`",
        f"in {took:.0f} s, report excluded ({os.cpu_count()} cores, {platform.machine()}, shared with other work).",
        "",
        f"- {sum(f.converged for f in fits)} of {len(fits)} fits converged.",
    ]
    lines += [f"  - {f.material}, {f.model_name}: {f.reason}" for f in fits if not f.converged]
    for model in PUBLISHED:
        both = [(by_model[model].errors["log"], p[model]) for _, by_model, p in results if model in p]
        gain = statistics.median(1 - mine / theirs for mine, theirs in both)
        lines.append(
            f"- `{model}` has a lower `log` error than the published fit on {sum(a < b for a, b in both)} of {len(both)} "
            f"materials, by {gain:.0%} in the median."
        )
    if excess:
        counts = ", ".join(f"{sum(e <= limit for e in excess)} within {limit:.0e}" for limit in (1e-5, 2e-4, 1e-2))
        lines.append(
            f"- Error relative to the best known, of {len(excess)} pairs: {counts}; largest excess {max(excess):.1e}, "
            f"largest gain {-min(excess):.1e}."
        )
    medians = ", ".join(f"{m} {statistics.median(solve[m]):.2f}" for m in MODELS)
    lines += [
        f"- Median seconds of search, exact passes and error bars, two fits at a time: {medians}.",
        "",
        "Errors under `log`; in brackets the published fit's.",
        "",
        "| material | " + " | ".join(MODELS) + " | best by `perceptual` |",
        "|---|" + "---|" * (len(MODELS) + 1),
    ]
    for material, by_model, published in results:
        cells = [f"{by_model[m].errors['log']:.5f}" + (f" ({published[m]:.5f})" if m in published else "") for m in MODELS]
        winner = min(MODELS, key=lambda m: by_model[m].errors["perceptual"])
        cells.append(f"{winner} {by_model[winner].errors['perceptual']:.4f}")
        lines.append(f"| {material} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Parse, fit, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tables", type=Path)
    parser.add_argument("--best-known", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    best = {}
    if args.best_known:
        with args.best_known.open(newline="") as file:
            best = {(r["material"], r["model"]): float(r["error"]) for r in csv.DictReader(file)}
    start = time.perf_counter()
    results = rows(sorted(args.tables.glob("*.binary")))
    args.out.write_text(page(results, best, time.perf_counter() - start), encoding="utf-8")
    print(args.out)


if __name__ == "__main__":
    main()
