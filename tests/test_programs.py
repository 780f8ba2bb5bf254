"""Programs of the package: the compiler's settings are optional, and threads share what is compiled."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit import programs
from brdfit.fitting.threads import in_threads
from brdfit.fitting.timing import Compilation, compilation


@pytest.fixture
def fresh():
    programs._understood.cache_clear()
    yield
    programs._understood.cache_clear()


def test_settings_are_understood_here(fresh):
    """With the JAX that this is developed with; if this fails, a fit compiles longer than it need."""
    assert programs._understood() == programs.OPTIONS


def test_an_unknown_setting_is_left_out(fresh, monkeypatch):
    monkeypatch.setattr(programs, "OPTIONS", {"xla_cpu_no_such_setting": True})
    assert programs._understood() == {}
    np.testing.assert_array_equal(programs.program(lambda x: 2 * x)(jnp.arange(3)), [0, 2, 4])


def test_threads_share_one_program():
    traces = []

    @programs.program
    def double(x, times):
        traces.append(times)  # runs while tracing only
        time.sleep(0.05)  # long enough for all threads to be there
        return times * x

    with ThreadPoolExecutor(4) as pool:
        results = list(pool.map(lambda k: float(double(jnp.asarray(float(k)), 2)), range(8)))
    assert results == [2.0 * k for k in range(8)]
    assert traces == [2], "those that ask at once wait for the one that compiles"
    assert double(jnp.asarray(1.0), 3) == 3  # what is no array is static
    double(jnp.asarray(5.0), 2)
    assert traces == [2, 3]


def test_threads_compute_in_double_precision():
    assert {x.dtype for x in in_threads(lambda k: jnp.asarray(1.0) * k, range(4))} == {np.dtype("float64")}


def test_compilation_of_threads_counts_once():
    """Time in which any of several threads compiled, each second once."""
    counted = Compilation([(0.0, 2.0), (1.0, 3.0), (1.5, 1.6), (5.0, 6.0)])
    assert counted.seconds == 4.0
    with compilation() as here:
        list(in_threads(lambda n: jax.jit(lambda x: x + n)(1.0), [1, 2]))
    assert here.seconds > 0, "threads take over the context of the one that asks"
