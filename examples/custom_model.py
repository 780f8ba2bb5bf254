"""A model of one's own: declared parameters and a formula for one channel.

    python examples/custom_model.py [DIR]

Fits Minnaert's model beside a built-in one to a table made from Minnaert's, and writes DIR/report.html.
"""

import sys
from typing import ClassVar

import brdfit
import jax.numpy as jnp
import numpy as np
from brdfit.data import synthetic
from brdfit.tables import table
from jaxtyping import Array, Float


class Minnaert(brdfit.BRDF):
    """f = albedo (k + 1)/(2 pi) (n.l n.v)^(k - 1): dark towards the limb for k > 1, bright for k < 1 (Minnaert 1941)."""

    name: ClassVar[str] = "minnaert"

    albedo: Float[Array, " C"] = brdfit.parameter("scale; the albedo at normal incidence", per_channel=True, linear=True)
    k: Float[Array, ""] = brdfit.parameter("darkening towards the limb", search=(0.1, 5), default=1.0, log=True)

    def evaluate(self, g: brdfit.Geometry) -> Array:
        """Value in 1/sr."""
        return self.albedo * (self.k + 1) / (2 * jnp.pi) * (g.cos_i * g.cos_o) ** (self.k - 1)


def main(out="out/custom-model"):
    """Fit and report."""
    truth = Minnaert(albedo=np.array([0.4, 0.3, 0.2]), k=np.array(1.3))
    layout = synthetic.grid((30, 15, 12))
    _, planes = synthetic.evaluate(truth, layout)
    moon = table(planes, layout, "moon", source="synthetic:moon", angles="edge")
    fits = [brdfit.fit(moon, model) for model in (Minnaert, "lambert")]
    for fit in fits:
        print(f"{fit.model_name:10s} error {fit.errors['log']:.5f}, {fit.reason}")
    print(f"report: {brdfit.report(out, fits, moon)}")


if __name__ == "__main__":
    main(*sys.argv[1:])
