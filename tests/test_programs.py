"""Programs of the package: the compiler's settings are optional, and threads share what is compiled."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import jax.numpy as jnp
import numpy as np
import pytest
from brdfit import programs


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
        return times * x

    with ThreadPoolExecutor(4) as pool:
        results = list(pool.map(lambda k: float(double(jnp.asarray(float(k)), 2)), range(8)))
    assert results == [2.0 * k for k in range(8)]
    assert double(jnp.asarray(1.0), 3) == 3  # what is no array is static
    assert traces[-1] == 3
    assert len(traces) <= 1 + 4  # threads that ask at once may each trace, but none a second time
    before = len(traces)
    double(jnp.asarray(5.0), 2)
    assert len(traces) == before
