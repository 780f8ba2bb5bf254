"""How a fit grows with its cells, its parameters and the number of materials: makes docs/growth.md.

    python benchmarks/growth.py [--most 7] [--materials 1000] [--out docs/growth.md]

Cells: scattered samples, 1e4 to 1e7, fitted on every one of them (no grid, no compression). Parameters: tables of more and
more channels. Materials: tables that are fitted one after another. All of ward, synthetic, with noise. Each size runs in a
process of its own, so that the peak of memory is its own; times are of a second fit, with everything compiled.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import time
from datetime import date
from pathlib import Path

import brdfit
import numpy as np
from brdfit.tables import Table
from brdfit.tables.layout import Scattered


def directions(count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of directions up to 79 degrees from the normal, uniform in the cosine."""

    def one() -> np.ndarray:
        cosine, azimuth = rng.uniform(np.cos(np.radians(79)), 1, count), rng.uniform(0, 2 * np.pi, count)
        sine = np.sqrt(1 - cosine**2)
        return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], -1)

    return one(), one()


def truth(channels: int) -> brdfit.models.BRDF:
    """A ward whose channels all differ."""
    spread = np.linspace(0.5, 1.5, channels)
    return brdfit.model("ward", diffuse=0.2 * spread, specular=0.1 * spread[::-1], alpha=0.2)


def noisy(values: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Values with 2 % of relative noise."""
    return values * (1 + 0.02 * rng.standard_normal(values.shape))


def scattered(count: int, channels: int, seed: int = 0) -> Table:
    """A table of scattered samples."""
    rng = np.random.default_rng(seed)
    wi, wo = directions(count, rng)
    model, step = truth(channels), 1_000_000
    values = np.concatenate([np.asarray(model(wi[k : k + step], wo[k : k + step])) for k in range(0, count, step)])
    planes = np.ascontiguousarray(noisy(values, rng).T)
    return Table(planes, np.ones(count, bool), Scattered(wi, wo, np.ones(count), isotropic=True), f"scattered-{count}")


def gridded(seed: int) -> Table:
    """A half/difference table of 45 x 45 x 90 cells."""
    from brdfit.data import synthetic

    return synthetic.generate("ward-03", grid=(45, 45, 90), noise=[synthetic.Relative(0.02)], seed=seed)[0]


def measure(kind: str, size: int) -> dict[str, float]:
    """Seconds and memory of one size, in this process."""
    if kind == "materials":
        list(brdfit.fit_many([gridded(0)], ["ward"]))
        tables = (gridded(seed) for seed in range(size))
        spent, begin = 0.0, time.perf_counter()
        making = time.perf_counter()
        for table in tables:
            spent += time.perf_counter() - making
            list(brdfit.fit_many([table], ["ward"]))
            making = time.perf_counter()
        return {"size": size, "seconds": time.perf_counter() - begin - spent, "peak": _peak()}
    table = scattered(size, 1) if kind == "cells" else scattered(100_000, size)
    before = _peak()
    first = brdfit.fit(table, "ward")
    passes = []
    for _ in range(3 if size < 10**7 else 1):
        fit = brdfit.fit(table, "ward")
        passes.append(fit.seconds["solve"])
    return {
        "size": size,
        "parameters": len(fit.labels),
        "prepare": first.seconds["prepare"],
        "seconds": float(np.median(passes)),
        "passes": fit.passes,
        "peak": _peak() - before,
    }


def _peak() -> float:
    """Peak memory of this process so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def apart(kind: str, size: int) -> dict[str, float]:
    """:func:`measure` in a process of its own."""
    done = subprocess.run(
        [sys.executable, __file__, "--one", kind, str(size)], check=True, stdout=subprocess.PIPE, text=True
    )
    print(kind, size, done.stdout.strip(), file=sys.stderr, flush=True)
    found: dict[str, float] = json.loads(done.stdout)
    return found


def page(cells: list[dict[str, float]], channels: list[dict[str, float]], materials: list[dict[str, float]]) -> str:
    """The page as Markdown."""
    lines = [
        "# How a fit grows",
        "",
        f"Made on {date.today().isoformat()} by `python benchmarks/growth.py --out docs/growth.md` ({os.cpu_count()} cores,",
        f"{platform.machine()}). Synthetic `ward` with 2 % noise; seconds of a fit with everything compiled.",
        "",
        "Scattered samples, every one of them in every pass (no compression), one channel. The samples are kept once more",
        "in the order of the passes, with what the model needs of their directions; a pass itself needs the same few",
        "blocks whatever the table.",
        "",
        "| samples | prepare, s | search and error bars, s | per sample, ns | peak above table, MB | per sample, bytes |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {c['size']:,.0f} | {c['prepare']:.3g} | {c['seconds']:.3g} | {1e9 * c['seconds'] / c['size']:.0f} "
        f"| {c['peak']:.0f} | {2**20 * c['peak'] / c['size']:.0f} |"
        for c in cells
    ]
    lines += ["", "Channels, and with them parameters, of 100,000 samples.", ""]
    lines += ["| channels | parameters | search and error bars, s | per channel, s |", "|---|---|---|---|"]
    lines += [
        f"| {c['size']:.0f} | {c['parameters']:.0f} | {c['seconds']:.3g} | {c['seconds'] / c['size']:.3g} |"
        for c in channels
    ]
    lines += ["", "Tables of 45 x 45 x 90 cells, three channels, one after another; loading not counted.", ""]
    lines += ["| tables | seconds | per table, ms | peak memory, MB |", "|---|---|---|---|"]
    lines += [
        f"| {m['size']:.0f} | {m['seconds']:.3g} | {1e3 * m['seconds'] / m['size']:.0f} | {m['peak']:.0f} |"
        for m in materials
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Parse, measure, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--most", type=int, default=7, help="power of ten of the largest number of samples")
    parser.add_argument("--materials", type=int, default=1000)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.one:
        print(json.dumps(measure(args.one[0], int(args.one[1]))))
        return
    text = page(
        [apart("cells", 10**k) for k in range(4, args.most + 1)],
        [apart("channels", c) for c in (1, 2, 5, 10, 20)],
        [apart("materials", n) for n in (1, 10, 100, 1000) if n <= args.materials],
    )
    if args.out:
        args.out.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
