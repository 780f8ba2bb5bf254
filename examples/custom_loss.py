"""A loss of one's own: any JAX function of the predicted values, the measured values and the geometry.

    python examples/custom_loss.py [DIR]

Fits Ward's model to a synthetic material by a named loss and by this one, and writes DIR/report.html.
"""

import sys

import brdfit
from brdfit.data import synthetic


def reflected_light(predicted, measured, geometry):
    """Difference of the light that reaches a viewer, relative to what would be white."""
    return (predicted - measured) * (geometry.cos_i * geometry.cos_o)[..., None]


def main(out="out/custom-loss"):
    """Fit and report."""
    table, _ = synthetic.generate("misfit-two-lobes", grid=(30, 15, 12))
    fits = [brdfit.fit(table, "ward", loss=loss) for loss in ("log", reflected_light)]
    for fit in fits:
        print(f"{fit.loss:16s} alpha {fit.parameters['alpha']:.4f}, {fit.reason}")
    print(f"report: {brdfit.report(out, fits, table)}")


if __name__ == "__main__":
    main(*sys.argv[1:])
