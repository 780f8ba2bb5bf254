"""Compiled programs shared by all workers and child processes of a run, and tables that several tests use."""

import importlib.util
import os
import shutil
import sys
import tempfile
from pathlib import Path

import pytest

SHARED = Path(__file__).resolve().parents[2] / "shared"


def pytest_configure(config):
    if not hasattr(config, "workerinput"):  # the first process; its workers inherit the environment
        config.programs = tempfile.mkdtemp(prefix="brdfit-programs-")
        os.environ["JAX_COMPILATION_CACHE_DIR"] = config.programs
        os.environ["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = "0"
        os.environ["JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES"] = "-1"


def pytest_unconfigure(config):
    if hasattr(config, "programs"):
        shutil.rmtree(config.programs, ignore_errors=True)


@pytest.fixture(autouse=True)
def _not_stored():
    """A command that a test runs stores programs; the next test may change what they are made of."""
    yield
    if "brdfit.stored_programs" in sys.modules:
        sys.modules["brdfit.stored_programs"].store_in(None)


@pytest.fixture(autouse=True, scope="module")
def _room_for_programs():
    """JAX keeps all programs that tests compile, and a process that runs out of memory maps ends (brdfit/programs.py)."""
    yield
    if "brdfit.programs" in sys.modules:
        programs = sys.modules["brdfit.programs"]
        if programs._maps() > programs._maps_allowed() / 2:
            sys.modules["jax"].clear_caches()


@pytest.fixture(scope="module")
def quickly():
    """For programs that run once: with few optimisations they compile in a third of the time."""
    import jax

    jax.config.update("jax_disable_most_optimizations", True)
    yield
    jax.config.update("jax_disable_most_optimizations", False)


@pytest.fixture(scope="session")
def small_table():
    """``ward-03`` on 24 x 12 x 12 cells, and its truth."""
    from brdfit.data import synthetic

    return synthetic.generate("ward-03", grid=(24, 12, 12))


@pytest.fixture(scope="session")
def small_file(small_table, tmp_path_factory):
    """The same as a MERL file."""
    import brdfit

    path = tmp_path_factory.mktemp("tables") / "stuff.binary"
    brdfit.save(small_table[0], path)
    return path


@pytest.fixture(scope="session")
def merl():
    """Planes ``[3, 90, 90, 180]``, as stored, of a real material by name."""
    script = SHARED / "tools" / "make_merl.py"
    if not script.exists():
        pytest.skip("the networks of real materials are not part of the repository")
    spec = importlib.util.spec_from_file_location("make_merl", script)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.table


@pytest.fixture(scope="session")
def measured():
    """A small table that one model of ``fits`` is the truth of."""
    import brdfit

    from .report_cases import GGX, half_grid, table_of

    return table_of(brdfit.model("gtr", **GGX), half_grid())


@pytest.fixture(scope="session")
def fits():
    """Three results for ``measured``, one of them failed."""
    from .report_cases import three_fits

    return three_fits()


@pytest.fixture(scope="session")
def evidence(measured, fits):
    """What the plots of a report of ``fits`` are drawn from."""
    from brdfit.reports.gather import gather

    return gather(measured, fits)


@pytest.fixture(scope="session")
def report(tmp_path_factory, fits, evidence):
    """The page of ``fits``."""
    from brdfit.reports.write import write_report

    from .report_cases import ENVIRONMENT

    return write_report(tmp_path_factory.mktemp("report"), fits, [evidence], ENVIRONMENT).read_text()
