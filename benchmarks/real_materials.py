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
import tempfile
import time
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Any

import brdfit
from brdfit.data import published_abc, published_materials, published_sgd
from brdfit.fitting.effort import Effort
from brdfit.fitting.prepared import prepare
from brdfit.reports import write_fits

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


def processor(run: Callable[[], Any]) -> float:
    """Processor seconds of a call, of all threads."""
    begin = time.process_time()
    run()
    return time.process_time() - begin


def parts(tables: list[Path]) -> dict[str, list[dict[str, float]]]:
    """Processor seconds of each part of a fit from file to file, by model, everything compiled; one after the other."""
    out: dict[str, list[dict[str, float]]] = {m: [] for m in MODELS}
    quick = Effort(error_bars=False)
    for path in [tables[0], *tables]:  # the first time compiles
        table = brdfit.load(path)
        shared = {"read": processor(lambda p=path: brdfit.load(p)), "prepare": processor(lambda t=table: prepare(t))}
        for m in MODELS:
            fits: list[brdfit.Fit] = []
            search = processor(lambda t=table, m=m: brdfit.fit(t, m, effort=quick))
            whole = processor(lambda t=table, m=m, f=fits: f.append(brdfit.fit(t, m)))
            with tempfile.TemporaryDirectory() as folder:
                write = processor(lambda f=fits, d=folder: write_fits(d, f, {}))
            each = {n: v / len(MODELS) for n, v in shared.items()}
            out[m].append(each | {"search, every cell asked once": search, "error bars": whole - search, "write": write})
    return {m: rows[1:] for m, rows in out.items()}


def profile(tables: list[Path]) -> list[str]:
    """Where the time of a batch goes, as Markdown."""
    found = parts(tables)
    names = list(found[MODELS[0]][0])
    lines = [
        "## Where the time of a batch goes",
        "",
        f"Processor seconds of all threads for one material and model, medians of {len(tables)} materials, everything",
        "compiled, one fit after the other. Reading and preparing a table is shared by its five models, a fifth each.",
        "",
        "| model | " + " | ".join(names) + " | together |",
        "|---|" + "---|" * (len(names) + 1),
    ]
    together = []
    for m, rows in found.items():
        middle = [statistics.median(r[n] for r in rows) for n in names]
        together.append(sum(middle))
        lines.append(f"| {m} | " + " | ".join(f"{v:.3f}" for v in middle) + f" | {sum(middle):.2f} |")
    mean = statistics.mean(together)
    return [
        *lines,
        "",
        f"Mean {mean:.2f}: with {os.cpu_count()} cores no less than {mean / (os.cpu_count() or 1):.2f} s a pair.",
    ]


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
    tables = sorted(args.tables.glob("*.binary"))
    results = rows(tables)
    took = time.perf_counter() - start
    text = page(results, best, took) + "\n" + "\n".join(profile(tables[:: max(len(tables) // 5, 1)])) + "\n"
    args.out.write_text(text, encoding="utf-8")
    print(args.out)


if __name__ == "__main__":
    main()
