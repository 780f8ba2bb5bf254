"""What each rung of settings gives and takes on real materials: makes fitting/rungs.json, and says how many tries hold.

    python benchmarks/rungs.py TABLES --best-known best_known.csv --keep rungs.jsonl --out rungs.json

TABLES holds MERL .binary files. Every rung of ``brdfit.fitting.plan.RUNGS`` fits every model to every table; its error is
compared with the smallest of any rung and of the best known. Of the tables in turn one half says what to expect, and the
other half is tried with ``--tolerance`` 1 % and 0.1 %: how many kept it is printed. Finished tables are kept as lines of
JSON; an interrupted run goes on from them.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
from pathlib import Path
from typing import Any

import brdfit
import numpy as np
from brdfit.fitting.plan import RUNGS, yardstick

MODELS = ("gtr", "abc", "sgd", "ward", "ashikhmin_shirley")
TOLERANCES = (0.01, 0.001)

Row = dict[str, Any]


def fitted(path: Path) -> Row:
    """Error, gain and seconds of every model and rung on one table."""
    table = brdfit.load(path)
    out: Row = {"material": table.material, "models": {}}
    for model in MODELS:
        rows = []
        for effort in RUNGS:
            f = brdfit.fit(table, model, effort=effort)
            if f.seconds["compile"] > 0.01:  # time it as a table does that finds everything compiled
                f = brdfit.fit(table, model, effort=effort)
            rows.append({"error": f.errors["log"], "gain": f.gain, "seconds": f.seconds["solve"], "cells": f.cells["used"]})
        out["models"][model] = rows
    begin = brdfit.fit(brdfit.load(path), "lambert")
    out["prepare"] = begin.seconds["prepare"]
    return out


def best_known(path: Path | None) -> dict[tuple[str, str], float]:
    if path is None:
        return {}
    with path.open(encoding="utf-8") as file:
        return {(r["material"], r["model"]): float(r["error"]) for r in csv.DictReader(file)}


def excesses(rows: list[Row], model: str, known: dict[tuple[str, str], float]) -> np.ndarray:
    """Error above the best, relative, ``[materials, rungs]``."""
    errors = np.array([[r["error"] for r in row["models"][model]] for row in rows])
    best = [min(e.min(), known.get((row["material"], model), np.inf)) for e, row in zip(errors, rows, strict=True)]
    return errors / np.array(best)[:, None] - 1


def expectation(rows: list[Row], known: dict[tuple[str, str], float]) -> dict[str, list[dict[str, float]]]:
    """What rungs.json says of each model: of the excesses the one that 19 of 20 stay below, and the median time."""
    out = {}
    for model in MODELS:
        over = np.quantile(excesses(rows, model, known), 0.95, axis=0, method="higher")
        seconds = np.median([[r["seconds"] + row["prepare"] for r in row["models"][model]] for row in rows], 0)
        out[model] = [
            {"excess": float(f"{max(e, 1e-9):.2g}"), "seconds": float(f"{s:.2g}")}
            for e, s in zip(over, seconds, strict=True)
        ]
    return out


def tries(rows: list[Row], known: dict[tuple[str, str], float], tolerance: float) -> list[tuple[bool, float]]:
    """Whether each pair kept the tolerance with what the other half of the materials foretold, and its share of the time."""
    halves = rows[::2], rows[1::2]
    out = []
    for expecting, tried in (halves, halves[::-1]):
        said = expectation(expecting, known)
        for model in MODELS:
            over = excesses(tried, model, known)
            for row, e in zip(tried, over, strict=True):
                measured = row["models"][model]
                last = len(RUNGS) - 1
                rung = next((i for i in range(last) if said[model][i]["excess"] <= tolerance), last)
                spent = measured[rung]["seconds"]
                while rung < last and measured[rung]["gain"] > tolerance / 2:
                    rung = next((i for i in range(rung + 1, last) if said[model][i]["excess"] <= tolerance), last)
                    spent += measured[rung]["seconds"]
                out.append((bool(e[rung] <= tolerance), spent / measured[last]["seconds"]))
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("tables", type=Path)
    parser.add_argument("--best-known", type=Path)
    parser.add_argument("--keep", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    rows = [json.loads(line) for line in given.keep.read_text().splitlines()] if given.keep.exists() else []
    done = {r["material"] for r in rows}
    for path in sorted(given.tables.glob("*.binary")):
        if path.stem not in done:
            rows.append(fitted(path))
            with given.keep.open("a", encoding="utf-8") as file:
                file.write(json.dumps(rows[-1]) + "\n")
            print(path.stem, file=sys.stderr)
    known = best_known(given.best_known)
    cells = int(np.median([r["cells"] for row in rows for m in row["models"].values() for r in m]))
    document = {"yardstick": float(f"{yardstick():.3g}"), "cells": cells, "models": expectation(rows, known)}
    given.out.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    for tolerance in TOLERANCES:
        kept = tries(rows, known, tolerance)
        share = np.mean([k for k, _ in kept])
        print(
            f"tolerance {tolerance:g}: kept in {sum(k for k, _ in kept)} of {len(kept)} tries ({share:.1%}), "
            f"median time {np.median([t for _, t in kept]):.2f} of the usual settings"
        )


if __name__ == "__main__":
    main()
