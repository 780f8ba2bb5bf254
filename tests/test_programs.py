"""Programs of the package: the compiler's settings are optional, threads share what is compiled, and so do runs."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from brdfit import programs, stored_programs
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


def test_maps_do_not_run_out(monkeypatch):
    """A process that is allowed a hundred maps more drops the programs not used for longest, and makes them again."""
    if not programs._maps():  # not Linux: maps are neither counted nor limited there; as if a program took as many
        monkeypatch.setattr(programs, "_maps", lambda: 12 * len(programs._programs))
    traces = []

    @programs.program
    def wave(x, times):
        traces.append(times)
        return jnp.sort(jnp.sin(times * x)) + jnp.cumsum(x)

    x = jnp.arange(3.0)
    programs._programs.clear()
    wave(x, 0)
    begin, most = programs._maps(), 0
    monkeypatch.setattr(programs, "_maps_allowed", lambda: (begin + 100) / programs.MAPS)
    for times in range(1, 61):
        want = np.sort(np.sin(times * x)) + np.cumsum(x)
        np.testing.assert_allclose(wave(x, times), want, rtol=1e-6, atol=1e-6)  # float32
        most = max(most, programs._maps())
        wave(x, 1)  # used all along: never dropped
    assert most < begin + 150, "60 programs take some 700"
    assert traces == list(range(61))
    wave(x, 2)
    assert traces[-1] == 2, "dropped, and made again"


def test_threads_compute_in_double_precision():
    assert {x.dtype for x in in_threads(lambda k: jnp.asarray(1.0) * k, range(4))} == {np.dtype("float64")}


def test_compilation_of_threads_counts_once():
    """Time in which any of several threads compiled, each second once."""
    counted = Compilation([(0.0, 2.0), (1.0, 3.0), (1.5, 1.6), (5.0, 6.0)])
    assert counted.seconds == 4.0
    with compilation() as here:
        list(in_threads(lambda n: jax.jit(lambda x: x + n)(1.0), [1, 2]))
    assert here.seconds > 0, "threads take over the context of the one that asks"


def test_waiting_for_other_fits_is_not_solving():
    """A piece that finds all threads busy with those of another fit says how long it waited; no piece waits for its own."""
    cores, piece = os.cpu_count() or 1, 0.1
    busy = in_threads(lambda n: time.sleep(0.2), range(cores))
    begin = time.perf_counter()
    with compilation() as here:
        list(in_threads(lambda n: time.sleep(piece), range(2 * cores)))
    # however busy the machine, the two rounds of its own pieces are no waiting
    assert 0.1 < here.away < time.perf_counter() - begin - 2 * piece
    assert here.seconds == 0
    list(busy)


SCRIPT = """
import sys
import jax, jax.numpy as jnp
from brdfit import stored_programs
from brdfit.programs import program

stored_programs.KNOWN.add("__main__")
stored_programs.store_in(sys.argv[1])
traced = []

@program
def smallest(matrix, power, names):
    traced.append(power)
    return {"value": jnp.linalg.eigvalsh(matrix ** power)[0], "names": names, "none": None}

matrix = jnp.asarray([[2.0, 1.0], [1.0, 3.0]])
for power in (1, 2):
    found = smallest(matrix, power, ("a", "b"))
print(len(traced), f"{float(found['value']):.9g}", found["names"], found["none"])
"""


def test_stored_programs(tmp_path):
    """A second process reads what the first compiled, linear algebra included, and traces nothing; what was damaged is
    compiled again."""

    own = {"JAX_COMPILATION_CACHE_DIR": str(tmp_path / "p"), "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0"}
    own |= {"JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES": "-1"}

    def run():
        command = [sys.executable, "-c", SCRIPT, tmp_path / "p"]
        done = subprocess.run(command, capture_output=True, text=True, check=True, env=os.environ | own)
        return done.stdout.split(maxsplit=1)

    first, second = run(), run()
    assert first[0] == "2"
    assert second == ["0", first[1]]
    stored = list((tmp_path / "p").rglob("version-*/*"))
    assert len(stored) == 2
    stored[0].write_bytes(stored[0].read_bytes()[:100])
    assert run() == ["1", first[1]]
    assert run()[0] == "0"
    assert not list((tmp_path / "p").glob("*smallest*")), "JAX's copy of a stored program is never found again"


@pytest.fixture
def store(tmp_path):
    stored_programs.store_in(tmp_path)
    yield stored_programs
    stored_programs.store_in(None)


def test_what_a_program_is_found_by(store):
    """Shapes, types, static arguments, precision and what a function closes over; nothing from outside this package."""
    from brdfit.fitting.losses import LOSSES
    from brdfit.fitting.search import solve
    from brdfit.models import MODELS

    base = solve.__wrapped__, (stored_programs.Array((3,), "float64"), LOSSES["log"], MODELS["ward"][0])
    others = [
        (solve.__wrapped__, (stored_programs.Array((4,), "float64"), *base[1][1:])),
        (solve.__wrapped__, (stored_programs.Array((3,), "float32"), *base[1][1:])),
        (solve.__wrapped__, (base[1][0], LOSSES["low"], MODELS["ward"][0])),
        (solve.__wrapped__, (*base[1][:2], MODELS["ward"][1])),
        (programs.program, base[1]),
    ]
    keys = {store.key(f, arguments, {}) for f, arguments in (base, *others)} | {store.key(*base, {"option": True})}
    with jax.enable_x64(True):
        keys.add(store.key(*base, {}))
    assert len(keys) == len(others) + 3
    assert None not in keys
    assert store.key(*base, {}) in keys
    transform, inverse = LOSSES["log"].transform, LOSSES["log"].inverse  # two functions on one line of the source
    assert store.key(transform, (), {}) != store.key(inverse, (), {})
    for outside in (lambda: 0, type("Mine", (MODELS["ward"][0],), {}), test_stored_programs):
        assert store.key(solve.__wrapped__, (outside,), {}) is None


def test_programs_of_old_versions_are_deleted(store, tmp_path):
    for name, days in (("version-old", 31), ("version-new", 1)):
        (tmp_path / name).mkdir()
        then = time.time() - 86400 * days
        os.utime(tmp_path / name, (then, then))
    run = jax.jit(lambda x: 2 * x).lower(1.0).compile()
    store.save(tmp_path / "version-mine" / "program", run, stored_programs.Placeholder())
    assert sorted(p.name for p in tmp_path.iterdir()) == ["version-mine", "version-new"]
