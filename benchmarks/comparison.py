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
    }


def run(tables: list[Path], keep: Path) -> list[Row]:
    """All fits, those that are missing made.

    Those of costly models come last, and tables in an order of which any first few are spread over all.
    """
    rows = kept.rows(keep)
    done = {(r["material"], r["model"], r["loss"]) for r in rows}
    tables = [tables[i] for i in np.argsort(np.arange(len(tables)) * 0.618034 % 1)]
    begin = time.perf_counter()
    with ThreadPoolExecutor(os.cpu_count()) as pool, keep.open("a", encoding="utf-8") as file:
        for models in ([m for m in MODELS if m not in EFFORT], list(EFFORT)):
            for k, path in enumerate(tables):
                table = None
                for loss in LOSSES:
                    missing = [m for m in models if (path.stem, m, loss) not in done]
                    if not missing:
                        continue
                    table = table or brdfit.load(path)
                    for row in pool.map(lambda m, t=table, on=loss: fitted(t, m, on), missing):
                        rows.append(row)
                        file.write(json.dumps(row) + "\n")
                    file.flush()
                took = time.perf_counter() - begin
                print(f"{k + 1}/{len(tables)} {path.stem} {took:.0f} s", file=sys.stderr, flush=True)
    return rows


def main() -> None:
    """Parse, fit what is missing, write."""
    args = kept.arguments(__doc__)
    tables = args.tables
    rows = run(tables, args.keep)
    names = {p.stem for p in tables}
    command = kept.command("comparison", "comparison", args.every)
    chosen = [r for r in rows if r["material"] in names]
    settings = (
        f"Errors are over all cells. Fits are made of rows compressed along phi_d, {USUAL.starts} starts polished, to a "
        f"relative decrease of the cost of {USUAL.rtol:g}; for {', '.join(f'`{m}`' for m in EFFORT)}, whose passes take "
        f"longest, {COSTLY.starts} of half as many shapes, with half as many nodes a row, to {COSTLY.rtol:g}. Their seconds "
        f"add up to {sum(r['seconds'] for r in chosen) / 60:.0f} minutes, as many fits at a time as there are cores, beside "
        "whatever else the machine did."
    )
    write(args.out, chosen, sorted(names), brdfit.load(tables[0]), command, settings)
    print(args.out)


if __name__ == "__main__":
    main()
