"""A small table, fits of it and a reader of pages, for the tests of reports."""

from dataclasses import replace
from html.parser import HTMLParser

import jax
import numpy as np
from brdfit.fitting.result import Fit, Optimum
from brdfit.models import MODELS, build, parameters_of
from brdfit.tables import HalfDifferenceGrid, table

VOID = {"meta", "img", "br", "link", "hr", "input"}
ENVIRONMENT = {"python": "3.11", "when": "some day"}

GGX = {"diffuse": [0.05, 0.04, 0.03], "specular": [0.95, 0.64, 0.54], "alpha": 0.2, "gamma": 2.0}
WARD = {"diffuse": [0.05, 0.04, 0.03], "specular": [0.3, 0.2, 0.1], "alpha": 0.2}
"""Two models of one small table; the first one is the table's truth."""


def half_grid(h=18, d=15, p=12):
    th, td, pd = (np.linspace(0, 1, h + 1) ** 2 * np.pi / 2, np.linspace(0, np.pi / 2, d + 1), np.linspace(0, np.pi, p + 1))
    return HalfDifferenceGrid(th[:-1], td[:-1], pd[:-1], th, td, pd)


def table_of(brdf, layout, material="stuff"):
    wi, wo = layout.directions()
    with jax.enable_x64(True):
        values = np.asarray(brdf(wi, wo))
    below = (wi[..., 2] <= 0) | (wo[..., 2] <= 0)
    planes = np.where(below, -1.0, np.moveaxis(values, -1, 0))
    return table(planes, layout, material, source=f"{material}.binary", sha256="0123456789abcdef")


def fit_of(name, parameters, error, material="stuff", **changes):
    model = build(MODELS[name][0], parameters)
    values = {p.name: np.asarray(getattr(model, p.name)) for p in parameters_of(model)}
    labels = tuple(f"{n}[{k}]" if v.ndim else n for n, v in values.items() for k in range(v.size))
    fields = {
        "material": material,
        "source": f"{material}.binary",
        "sha256": "0123456789abcdef",
        "angles": "edge",
        "model_name": name,
        "loss": "log",
        "measure": "solid_angle",
        "max_angle": 80.0,
        "model": model,
        "parameters": values,
        "stderr": {n: 1e-4 * np.abs(v) for n, v in values.items()},
        "spread": {n: 1e-2 * np.abs(v) for n, v in values.items()},
        "covariance": {},
        "converged": True,
        "reason": "at a minimum",
        "errors": {"log": error / 2, "ngan": error * 3, "perceptual": error},
        "cells": {"used": 1234567, "masked": 200, "total": 1234800},
        "seconds": {"load": 0.1, "prepare": 0.2, "compile": 1.0, "solve": 0.5},
        "labels": labels,
        "correlation": np.eye(len(labels)),
        "starts": 12,
        "optima": (Optimum(error / 2, 9), Optimum(error, 2)),
        "passes": 10,
        "shift": 0.0172,
    }
    return Fit(**{**fields, **changes})


def failed(name="sgd", material="stuff"):
    nothing = {"model": None, "parameters": {}, "stderr": {}, "spread": {}, "errors": {}, "labels": (), "optima": ()}
    reason = "every start ended at infinite cost"
    return replace(fit_of("ward", WARD, 0.5, material), model_name=name, converged=False, reason=reason, **nothing)


def three_fits():
    return [fit_of("ward", WARD, 0.0333), fit_of("gtr", GGX, 0.00123), failed()]


class Reader(HTMLParser):
    """Checks that elements nest, and collects text, ids and attributes."""

    def __init__(self, text):
        super().__init__()
        self.open, self.words, self.ids, self.tags = [], [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.ids += [v for k, v in attrs if k == "id"]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.ids += [v for k, v in attrs if k == "id"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not self.open or self.open[-1] != "style":
            self.words.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())
