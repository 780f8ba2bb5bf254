"""From a command to its result in a fresh process, with and without compiled programs of an earlier run.

    python benchmarks/cold_start.py FILE [--repeats 3]

Beside it a plain script of NumPy and SciPy that fits the same table (plain_scipy.py). Then the compiler's settings of
brdfit/programs.py beside its defaults: seconds to compile one gram pass of each model, and to run it over the compressed
table.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import brdfit
import equinox as eqx
import jax
import numpy as np
from brdfit.fitting.coordinates import charts
from brdfit.fitting.given import model_class
from brdfit.fitting.gram import Problem, Span, gram
from brdfit.fitting.prepared import prepare
from brdfit.fitting.starts import starts
from brdfit.programs import OPTIONS

MODELS = "gtr,abc,sgd,ward,ashikhmin_shirley"
COMMANDS = {
    "five models and the report": ["--model", MODELS],
    "abc, no report": ["--model", "abc", "--no-report"],
}


def seconds(command: list[str], home: Path) -> tuple[float, float]:
    """Wall and processor seconds of a command with ``home`` for its cache."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begin = time.perf_counter()
    environment = {**os.environ, "HOME": str(home), "XDG_CACHE_HOME": str(home / "cache")}
    subprocess.run(command, check=False, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wall = time.perf_counter() - begin
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def commands(file: str, repeats: int) -> None:
    """Each command from an empty cache, and again."""
    found: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for _ in range(repeats):
        for name, options in COMMANDS.items():
            with tempfile.TemporaryDirectory() as home:
                call = [sys.executable, "-m", "brdfit", "fit", file, "--out", str(Path(home) / "out"), *options]
                for cache in ("empty", "warm"):
                    found.setdefault((name, cache), []).append(seconds(call, Path(home)))
        plain = [sys.executable, str(Path(__file__).with_name("plain_scipy.py")), file]
        found.setdefault(("abc by NumPy and SciPy", "no"), []).append(seconds(plain, Path.home()))
    for (name, cache), runs in found.items():
        wall, cpu = (sorted(r[k] for r in runs) for k in (0, 1))
        print(
            f"{name:28s} {cache:5s} cache: {statistics.median(wall):6.2f} s ({wall[0]:.2f} to {wall[-1]:.2f}), "
            f"{statistics.median(cpu):6.2f} s of processor"
        )


def setting(file: str, repeats: int) -> None:
    """Compile and run one gram pass of each model under both settings."""
    table = brdfit.load(file)
    with jax.enable_x64(True):
        ready = prepare(table)
        for name in MODELS.split(","):
            chart = charts(model_class(name, anisotropic=False))[0]
            problem = Problem(ready.samples, ready.loss, chart)
            x = chart.coordinates_of(next(iter(starts(chart.cls, ready.summary, 0))), table.channels)
            arrays, rest = eqx.partition((problem, np.asarray(x), Span.nodes(ready.samples)), eqx.is_array)
            taken: dict[str, list[tuple[float, float]]] = {"default": [], "ours": []}
            for _ in range(repeats):
                for label, options in (("default", {}), ("ours", OPTIONS)):
                    lowered = jax.jit(lambda a, rest=rest: gram(*eqx.combine(a, rest))).lower(arrays)
                    begin = time.perf_counter()
                    compiled = lowered.compile(compiler_options=options)
                    middle = time.perf_counter()
                    runs = []
                    for _ in range(10):
                        start = time.perf_counter()
                        jax.block_until_ready(compiled(arrays))
                        runs.append(time.perf_counter() - start)
                    taken[label].append((middle - begin, statistics.median(runs)))
            words = []
            for label, pairs in taken.items():
                to_compile, to_run = (statistics.median(p[k] for p in pairs) for k in (0, 1))
                words.append(f"{label}: compile {to_compile:.2f} s, run {1e3 * to_run:.1f} ms")
            print(f"{name:18s} " + "; ".join(words))


def main() -> None:
    """Parse and measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file")
    parser.add_argument("--repeats", type=int, default=3)
    args = parser.parse_args()
    commands(str(Path(args.file).resolve()), args.repeats)
    setting(args.file, args.repeats)


if __name__ == "__main__":
    main()
