"""Properties that every public model has, over the table of cases."""

from __future__ import annotations

import inspect

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit import models
from brdfit.models import BRDF, MODELS, parameters_of

from . import cases, oracle
from .cases import TABLE, Row

rows = pytest.mark.parametrize("row", TABLE, ids=lambda r: r.name)


def evaluate(row: Row, wi: np.ndarray, wo: np.ndarray, dtype: type = np.float64) -> np.ndarray:
    """Values ``[cases, directions]`` in the given precision."""
    with jax.enable_x64(dtype is np.float64):
        stacked = jax.tree.map(jnp.asarray, row.stacked(dtype))
        f = jax.jit(jax.vmap(lambda m: m(wi.astype(dtype), wo.astype(dtype))[..., 0]))
        out = np.asarray(f(stacked))
        assert out.dtype == dtype
        return out


def slopes(row: Row, wi: np.ndarray, wo: np.ndarray, dtype: type = np.float64) -> dict[str, np.ndarray]:
    """Derivatives ``[cases, directions]`` by parameter and by component of the directions, named as the oracle does."""
    specs = parameters_of(row.model)

    def one(m: BRDF, wi: jax.Array, wo: jax.Array) -> jax.Array:
        return m(wi, wo)[0]

    with jax.enable_x64(dtype is np.float64):
        stacked = jax.tree.map(jnp.asarray, row.stacked(dtype))
        inner = jax.vmap(jax.grad(one, (0, 1, 2)), (None, 0, 0))
        by_model, by_wi, by_wo = jax.jit(jax.vmap(inner, (0, None, None)))(stacked, wi.astype(dtype), wo.astype(dtype))
    shape = (len(row.cases), len(wi))
    out = {p.name: np.asarray(getattr(by_model, p.name)).reshape(shape) for p in specs}
    for name, by in (("wi", by_wi), ("wo", by_wo)):
        out |= {f"{name}_{k}": np.asarray(by)[..., k] for k in range(3)}
    return out


def test_every_model_has_cases():
    assert {r.model for r in TABLE} == {v for variants in MODELS.values() for v in variants}
    assert {r.name for r in TABLE} == set(oracle.MODELS)
    for r in TABLE:
        for case in r.cases:
            models.build(r.model, dict(case))  # each lies where the formula is defined


def test_every_part_has_cases():
    functions = {n for n, f in vars(cases.ndf).items() if not n.startswith("_") and callable(f)}
    assert functions == set(cases.NDFS) | set(cases.ANISOTROPIC_NDFS)
    for package, names in cases.PARTS.items():
        assert {n for n, f in vars(package).items() if not n.startswith("_") and inspect.isfunction(f)} == names


@rows
def test_value(row: Row):
    """Against 40 digits on the very same numbers; the tolerance of each row is the one promised for it."""
    wi, wo = row.directions()
    got, want = evaluate(row, wi, wo), cases.expected_values(row.name)
    # 1e-280: what is smaller has lost digits in products on the way, which is no error of the model
    error = np.abs(got - want) / (np.abs(want) + 1e-280)
    worst = np.unravel_index(np.nanargmax(error), error.shape)
    assert np.isfinite(got).all()
    assert error.max() <= row.tolerance, (error.max(), row.cases[worst[0]], wi[worst[1]], wo[worst[1]], want[worst])
