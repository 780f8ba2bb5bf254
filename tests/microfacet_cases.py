"""Cases of the microfacet models: twelve parameter sets each."""

from __future__ import annotations

from .empirical_cases import LEVEL, Row, row

GLOSS = {"diffuse": 0.1, "specular": 0.04, "alpha": 0.2}
WIDTHS = [{"alpha": a} for a in (1e-4, 0.02, 1.0, 5.0, 30.0)] + [{"specular": 1.0}, {"diffuse": 0.0, "specular": 0.0}]
FULL = [{"diffuse": 0.0, "specular": 1.0, "alpha": a} for a in (0.1, 0.5, 1.0, 3.0)]
POWERS = [{"alpha": a, "p": p} for a, p in ((0.02, 0.3), (0.5, 0.5), (1e-3, 0.7), (1.0, 1.2), (5.0, 0.15))]
TAILS = [{"gamma": g, "alpha": a} for g, a in ((2.0, 1.0), (40.0, 0.3), (3.0, 1e-3), (2.5, 5.0), (100.0, 1e-2))]
SCALED = {"diffuse": 0.1, "scale": 20.0, "b": 200.0, "c": 1.3, "ior": 1.5}
LOBES = [{"b": 8e6, "c": 2.7, "scale": 2e4}, {"b": 11.0, "c": 0.02}, {"b": 1e-2}, {"c": 0.0}, {"ior": 100.0}, {"ior": 1.0}]
LONG = {"diffuse": 0.1, "specular": 0.2, "alpha_x": 0.1, "alpha_y": 0.3}
LONGER = [{"alpha_x": x, "alpha_y": y} for x, y in ((1e-4, 1e-4), (0.02, 2.0), (30.0, 1.0), (0.05, 0.05))]
WARD = {"diffuse": 0.1, "specular": 0.2, "alpha": 0.15}
PAINT = {
    "base_color": 0.3,
    "subsurface": 0.4,
    "metallic": 0.3,
    "specular": 0.6,
    "roughness": 0.4,
    "sheen": 0.1,
    "clearcoat": 0.5,
    "clearcoat_gloss": 0.7,
}
PAINTS = [{"roughness": r} for r in (0.0, 1.0, 0.02)] + [{"metallic": 1.0}, {"metallic": 0.0, "clearcoat_gloss": 0.0}]

MICROFACETS: tuple[Row, ...] = (
    row("ggx", GLOSS, *WIDTHS, energy=FULL, truth=None),
    row("beckmann", GLOSS, *WIDTHS, energy=FULL, truth=None),
    row("pbr", GLOSS, *WIDTHS, truth=None, single=False),
    row("cook_torrance", GLOSS, *WIDTHS, kink=LEVEL, truth=None, single=False),
    row(
        "cook_torrance_blinn",
        {"diffuse": 0.1, "specular": 0.04, "exponent": 50.0},
        {"exponent": 0.0},
        {"exponent": 1e6},
        kink=LEVEL,
        truth=None,
    ),
    row("cook_torrance_gaussian", GLOSS, *WIDTHS, kink=LEVEL, truth=None),
    row("epd", {**GLOSS, "p": 0.7}, *POWERS, tolerance=1e-8, truth=None),
    row("student_t", {**GLOSS, "gamma": 2.5}, *TAILS, {"gamma": 1.7}, truth={"alpha": 0.3, "gamma": 3.0}),
    row("low_microfacet", SCALED, *LOBES, kink=LEVEL, truth=None),
    row("abc_smooth", SCALED, *LOBES, truth=SCALED),
    row("ward_duer", WARD, *({"alpha": a} for a in (1e-3, 0.5, 3.0)), truth=None),
    row("ward_duer", LONG, *LONGER, form=1, truth=None, single=False),
    row("ward_bounded", WARD, *({"alpha": a} for a in (1e-3, 0.5, 3.0)), energy=FULL, truth=None),
    row("ward_bounded", LONG, *LONGER, form=1, truth=None, single=False),
    row("disney", PAINT, *PAINTS, truth=None),
    row("disney", {**PAINT, "anisotropy": 0.6}, *PAINTS, {"anisotropy": 1.0}, form=1, truth=None, single=False),
)
