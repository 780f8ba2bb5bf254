"""Every named model on every table of a folder under three losses: makes docs/comparison.md and its pictures.

    python benchmarks/comparison.py TABLES --keep comparison.jsonl --out docs/comparison.md [--every 2]

TABLES holds MERL .binary files, of which every N-th is taken. Each is fitted with each model under each loss, without error
bars. Finished fits are kept as lines of JSON, with their parameters; an interrupted run goes on from them.
"""

from __future__ import annotations

import json
import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from threading import Lock
from typing import Any

import brdfit
import kept
import numpy as np
from brdfit.fitting import Effort
from brdfit.models import MODELS
from comparison_page import LOSSES, write

USUAL = Effort(path="compressed", starts=3, rtol=1e-5, error_bars=False, errors="rows")
"""Settings of nearly all models: all their starting shapes, three of them polished."""
COSTLY = replace(USUAL, nodes=5, shapes=0.5, starts=1, rtol=1e-4)
"""Settings of the models whose passes over the table take five times those of the others, and more."""
EFFORT = dict.fromkeys(("htsg", "stam_diffraction", "granier_heidrich"), COSTLY)

ISOTROPIC = [name for name, forms in MODELS.items() if not forms[0].anisotropic]
"""MERL tables are isotropic, and do not tell a model that has no isotropic form what it wants to know."""

Row = dict[str, Any]


def fitted(table: brdfit.Table, model: str, loss: str) -> Row:
    """One fit as plain values."""
    found = brdfit.fit(table, model, loss=loss, effort=EFFORT.get(model, USUAL))
    return {
        "material": table.material,
        "model": model,
        "loss": loss,
        "error": found.errors[loss],
        "parameters": {n: v.tolist() for n, v in found.parameters.items()},
        "at_bound": list(found.at_bound),
        "converged": found.converged,
        "reason": found.reason,
        "seconds": round(found.seconds["solve"], 4),
        "compile": round(found.seconds["compile"], 4),
    }


def run(tables: list[Path], keep: Path) -> tuple[list[Row], float]:
    """All fits, those that are missing made, and the seconds that took.

    As many tables at a time as there are cores, in an order of which any first few are spread over all; costly models after
    all others.
    """
    rows = kept.rows(keep)
    done = {(r["material"], r["model"], r["loss"]) for r in rows}
    tables = [tables[i] for i in np.argsort(np.arange(len(tables)) * 0.618034 % 1)]
    begin = time.perf_counter()
    writing = Lock()

    def fit_all(k: int, path: Path, models: list[str]) -> None:
        missing = [(e, m) for e in LOSSES for m in models if (path.stem, m, e) not in done]
        # every other table begins at the end: at first all threads need programs, and none waits for those of another
        missing = missing if k % 2 else [(e, m) for e in LOSSES for m in reversed(models) if (e, m) in missing]
        table = brdfit.load(path) if missing else None
        for loss, model in missing:
            row = fitted(table, model, loss)
            with writing:
                rows.append(row)
                file.write(json.dumps(row) + "\n")
                file.flush()
        print(f"{k + 1}/{len(tables)} {path.stem} {time.perf_counter() - begin:.0f} s", file=sys.stderr, flush=True)

    with keep.open("a", encoding="utf-8") as file, ThreadPoolExecutor(os.cpu_count()) as pool:
        for models in ([m for m in ISOTROPIC if m not in EFFORT], list(EFFORT)):
            list(pool.map(lambda k, path, names=models: fit_all(k, path, names), range(len(tables)), tables))
    return rows, time.perf_counter() - begin


def all_cells(rows: list[Row], path: Path) -> list[float]:
    """How far the errors of a table's fits, those of its compressed rows, lie from those of all cells, relative."""
    table = brdfit.load(path)

    def off(row: Row) -> float:
        found = brdfit.evaluate(table, brdfit.model(row["model"], **row["parameters"]))[row["loss"]]
        return abs(row["error"] / found - 1)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(off, [r for r in rows if r["material"] == path.stem]))


def page(out: Path, rows: list[Row], tables: list[Path], every: int, took: float) -> None:
    """Write the page of some fits, which took so many seconds if one run made them all."""
    names = {p.stem for p in tables}
    chosen = [r for r in rows if r["material"] in names]
    checked = tables[len(tables) // 2]
    off = all_cells(chosen, checked)
    fitting, compiling = (sum(r[k] for r in chosen) / 60 for k in ("seconds", "compile"))
    whole = f": {took / 60:.1f} minutes in all" if took > 60 else ""
    settings = (
        f"Fits are made of rows compressed along phi_d, {USUAL.starts} starts polished, to a relative decrease of the cost "
        f"of {USUAL.rtol:g}; for {', '.join(f'`{m}`' for m in EFFORT)}, whose passes take longest, {COSTLY.starts} of half "
        f"as many shapes, with half as many nodes a row, to {COSTLY.rtol:g}. Errors are those of the compressed rows: of "
        f"the {len(off)} fits of {checked.stem} half are within {np.median(off):.1g}, relative, of the error of all "
        f"cells and all within {max(off):.1g}. The fits took {fitting:.0f} minutes and what compiled for them "
        f"{compiling:.1f}, with as many fits at a time as there are cores{whole}."
    )
    left_out = ", ".join(f"`{m}`" for m in MODELS if m not in ISOTROPIC)
    settings += f" {left_out} has no isotropic form, and these tables do not tell the azimuth that it asks for."
    write(out, chosen, sorted(names), brdfit.load(tables[0]), kept.command("comparison", "comparison", every), settings)


def main() -> None:
    """Parse, fit what is missing, write."""
    args = kept.arguments(__doc__)
    rows, took = run(args.tables, args.keep)
    page(args.out, rows, args.tables, args.every, took)
    print(args.out)


if __name__ == "__main__":
    main()
