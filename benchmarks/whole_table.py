"""Seconds and peak memory of fits to one whole table: the first of each model (which compiles it), and warm ones.

    python benchmarks/whole_table.py [FILE] [MODEL,...]

Without a FILE, a synthetic material that no model of the package reproduces.
"""

import resource
import sys
import time

import brdfit
from brdfit.data import synthetic

REPEATS = 3


def main(file=None, models="gtr,abc,sgd,ward,ashikhmin_shirley"):
    """Print one line a model."""
    table = brdfit.load(file) if file else synthetic.generate("misfit-two-lobes")[0]
    print(f"{table.material}: {table.mask.sum()} cells measured of {table.mask.size}")
    for model in models.split(","):
        seconds = []
        for _ in range(1 + REPEATS):
            begin = time.perf_counter()
            fit = brdfit.fit(table, model)
            seconds.append(time.perf_counter() - begin)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(
            f"{model:18s} first {seconds[0]:6.2f} s, warm {min(seconds[1:]):6.2f} s, process at most {peak:5.0f} MB, "
            f"{fit.loss} {fit.errors[fit.loss]:.6f}, {fit.cells['used']} cells, {fit.reason}"
        )


if __name__ == "__main__":
    main(*sys.argv[1:])
