"""What right digits cost: each model on 1.1 million pairs of directions against the formula as printed, side by side.

    python benchmarks/evaluation.py [REPEATS]

Closed forms are compared with their formulas typed plainly (no guard, no series, cosines only); Smith's exact integral,
through the table of polar angles of a grid, with the closed form of GGX in its place. Runs alternate; medians and quartiles.
"""

import sys
import time

import jax
import jax.numpy as jnp
import numpy as np
from brdfit import models
from brdfit.angles import unit_vectors
from brdfit.geometry import Geometry, from_directions
from brdfit.models import fresnel, ndf
from brdfit.polar import PolarStencil

COUNT = 1_100_000
LIMIT = np.radians(80)
REPEATS = 15


def geometries():
    """The same pairs without and with a table of polar angles."""
    rng = np.random.default_rng(0)
    angles = rng.uniform(0, LIMIT, (2, COUNT))
    wi, wo = (unit_vectors(t, rng.uniform(0, 2 * np.pi, COUNT)) for t in angles)
    g = from_directions(wi, wo)
    stencils = (PolarStencil.of(w[:, 2], float(np.arccos(min(wi[:, 2].min(), wo[:, 2].min())))) for w in (wi, wo))
    fields = (g.cos_i, g.cos_o, g.cos_h, g.sin2_h, g.cos_d, g.sin2_d, g.h_x2, g.h_y2)
    return g, Geometry(*fields, *stencils)


def schlick(f0, g):
    return f0 + (1 - f0) * (1 - g.cos_d) ** 5


def lambert(p, g):
    return jnp.broadcast_to(p["diffuse"] / jnp.pi, g.shape)


def ward(p, g):
    tan2 = (1 - g.cos_h**2) / g.cos_h**2
    lobe = jnp.exp(-tan2 / p["alpha"] ** 2) / (4 * jnp.pi * p["alpha"] ** 2 * jnp.sqrt(g.cos_i * g.cos_o))
    return p["diffuse"] / jnp.pi + p["specular"] * lobe


def ward_anisotropic(p, g):
    slope = (g.h_x2 / p["alpha_x"] ** 2 + g.h_y2 / p["alpha_y"] ** 2) / g.cos_h**2
    lobe = jnp.exp(-slope) / (4 * jnp.pi * p["alpha_x"] * p["alpha_y"] * jnp.sqrt(g.cos_i * g.cos_o))
    return p["diffuse"] / jnp.pi + p["specular"] * lobe


def ashikhmin_shirley(p, g):
    x, y = (p["exponent"], p["exponent"]) if "exponent" in p else (p["exponent_x"], p["exponent_y"])
    power = x if "exponent" in p else (x * g.h_x2 + y * g.h_y2) / (1 - g.cos_h**2)
    body = 28 * p["diffuse"] / (23 * jnp.pi) * (1 - p["specular"])
    body = body * (1 - (1 - g.cos_i / 2) ** 5) * (1 - (1 - g.cos_o / 2) ** 5)
    lobe = jnp.sqrt((x + 1) * (y + 1)) / (8 * jnp.pi) * g.cos_h**power
    return body + lobe * schlick(p["specular"], g) / (g.cos_d * jnp.maximum(g.cos_i, g.cos_o))


def abc(p, g):
    b, c, ior, cd = p["b"], p["c"], p["ior"], g.cos_d
    power = (1 + b) ** c
    k = b**2 * power * (c - 2) * (c - 1) / (2 * jnp.pi * ((1 + b) ** 2 + power * (b * (c - 2) - 1)))
    d = k / (1 + b * (1 - g.cos_h)) ** c
    root = jnp.sqrt(ior**2 + cd**2 - 1)
    f = (root - cd) ** 2 / (root + cd) ** 2 / 2 * (1 + ((cd * (root + cd) - 1) / (cd * (root - cd) + 1)) ** 2)
    masking = jnp.minimum(1, 2 * g.cos_h * jnp.minimum(g.cos_i, g.cos_o) / cd)
    return p["diffuse"] / jnp.pi + p["specular"] * f * d * masking / (4 * g.cos_i * g.cos_o)


def ggx_lambda(a2, g):
    """Walter et al. (2007), eq. 34, at both directions."""
    return ((jnp.sqrt(1 + a2 * (1 - c**2) / c**2) - 1) / 2 for c in (g.cos_i, g.cos_o))


def gtr(p, g):
    """The same distribution and Fresnel, with the closed masking of GGX."""
    d = ndf.GTR(p["alpha"], p["gamma"])(g.sin2_h, g.cos2_h)
    light, viewer = ggx_lambda(p["alpha"] ** 2, g)
    masking = 1 / (1 + light + viewer)
    return p["diffuse"] / jnp.pi + schlick(p["specular"], g) * d * masking / (4 * g.cos_i * g.cos_o)


def sgd(p, g):
    """The same distribution and Fresnel, with the closed masking of GGX."""
    d = ndf.SGD(p["alpha"], p["p"])(g.sin2_h, g.cos2_h)
    light, viewer = ggx_lambda(p["alpha"], g)
    f = p["specular"] * fresnel.sgd_fresnel(p["f0"], p["f1"], g)
    return p["diffuse"] / jnp.pi + f * d / ((1 + light) * (1 + viewer)) / (4 * g.cos_i * g.cos_o)


BODY = {"diffuse": 0.1, "specular": 0.3}
CASES = (
    ("lambert", {"diffuse": 0.1}, lambert, "formula as printed", 1.3),
    ("ward", {**BODY, "alpha": 0.15}, ward, "formula as printed", 1.3),
    ("ward", {**BODY, "alpha_x": 0.1, "alpha_y": 0.2}, ward_anisotropic, "formula as printed", 1.3),
    ("ashikhmin_shirley", {**BODY, "exponent": 90.0}, ashikhmin_shirley, "formula as printed", 1.3),
    ("ashikhmin_shirley", {**BODY, "exponent_x": 90.0, "exponent_y": 30.0}, ashikhmin_shirley, "formula as printed", 1.3),
    ("abc", {**BODY, "b": 300.0, "c": 1.3, "ior": 1.5}, abc, "formula as printed", 1.3),
    ("gtr", {**BODY, "alpha": 0.15, "gamma": 2.0}, gtr, "masking of closed GGX", 2.0),
    ("sgd", {**BODY, "alpha": 0.05, "p": 0.6, "f0": 0.05, "f1": 0.01}, sgd, "masking of closed GGX", 2.0),
)


def scalar(name, parameters):
    """One channel of a model, as ``evaluate`` takes it."""
    m = models.model(name, **parameters)
    return jax.tree.map(lambda x: jnp.asarray(np.asarray(x).reshape(-1)[0]), m)


def main(repeats=REPEATS):
    """Print the table."""
    plain, tabulated = geometries()
    print("| model | against | ms | quartiles | ms of the other | quartiles | ratio | wanted |")
    print("|---|---|---|---|---|---|---|---|")
    for name, parameters, formula, title, wanted in CASES:
        m = scalar(name, parameters)
        numbers = {k: jnp.asarray(v) for k, v in parameters.items()}
        ours = jax.jit(lambda m, g: jnp.broadcast_to(m.evaluate(g), g.shape))
        theirs = jax.jit(formula)
        calls = ((ours, m, tabulated if wanted == 2 else plain), (theirs, numbers, plain))
        seconds = np.empty((repeats, 2))
        for k in range(-2, repeats):  # two to compile and warm up
            for side, (f, a, g) in enumerate(calls):
                begin = time.perf_counter()
                f(a, g).block_until_ready()
                seconds[max(k, 0), side] = time.perf_counter() - begin
        (low, mid, high) = np.percentile(seconds * 1e3, [25, 50, 75], axis=0)
        spread = [f"{low[k]:.1f} to {high[k]:.1f}" for k in range(2)]
        ratio = np.median(seconds[:, 0] / seconds[:, 1])
        kind = name + (" (anisotropic)" if any(p.endswith("_x") for p in parameters) else "")
        print(f"| {kind} | {title} | {mid[0]:.1f} | {spread[0]} | {mid[1]:.1f} | {spread[1]} | {ratio:.2f} | {wanted} |")


if __name__ == "__main__":
    with jax.enable_x64(True):
        main(*map(int, sys.argv[1:]))
