"""Compiled programs from run to run: a program that an earlier run compiled is read, not traced and compiled again.

JAX keeps what it compiles, but finds it by the program's text, for which it has to be traced and lowered first: most of
what a first fit then takes. Here a program is found by what it was asked for: the function, the arguments' shapes and all
that is static among them, the sources of this package, the versions of those it stands on, and the processor. It is stored
only if all of that can be described by name or by value: not if a model, a loss or anything else comes from outside.
"""

from __future__ import annotations

import hashlib
import io
import os
import pickle
import platform
import shutil
import sys
import time
import zlib
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib import metadata
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .files import replacing

FOUNDATIONS = ("jax", "jaxlib", "equinox", "lineax", "optimistix", "numpy")
"""Packages whose versions are part of what a program is found by."""
KNOWN = {__package__, *FOUNDATIONS, "jaxtyping", "builtins", "collections", "functools", "operator"}
"""Where classes and functions come from that have a name and do not change with it."""
PREFIX = "version-"
LOADED = "/brdfit/programs/load"
"""Event that says how long reading a program took, or waiting for the thread that has it."""
UNUSED_DAYS = 30
"""Programs of other versions of this package are deleted after so long without use."""

_directory: Path | None = None


class Array(NamedTuple):
    """What is known of an array when a program is compiled."""

    shape: tuple[int, ...]
    dtype: str


class Placeholder:
    """Stands for an array."""


def store_in(directory: str | os.PathLike[str] | None) -> None:
    """Store programs in a directory and look for them there; None: no longer.

    Programs are machine code: the directory must be one that only its user can write to.
    """
    global _directory
    _directory = None if directory is None else Path(directory)


def key(function: Callable[..., Any], arguments: Any, options: dict[str, bool | int | str]) -> Path | None:
    """Where the program of a function for such arguments is stored; None if nowhere."""
    if _directory is None:
        return None
    text = io.BytesIO()
    settings = {name: repr(value) for name, value in jax.config.values.items()}
    try:
        _Describer(text).dump((function, arguments, options, str(jnp.result_type(float)), settings))
    except (pickle.PicklingError, TypeError, AttributeError):
        return None
    return _directory / _version() / hashlib.sha256(text.getvalue()).hexdigest()


def load(path: Path) -> tuple[Callable[..., Any], Any] | None:
    """A stored program and its result; None if there is none that can be read."""
    from jax.experimental.serialize_executable import deserialize_and_load

    begin = time.perf_counter()
    _find_linear_algebra()
    try:
        program, arguments, results, result = pickle.loads(zlib.decompress(path.read_bytes()))
        forms = jax.tree.structure(((0,) * arguments, {})), jax.tree.structure([0] * results)
        run: Callable[..., Any] = deserialize_and_load(program, *forms)
    except FileNotFoundError:
        return None
    except Exception:  # cut short, or by another version of what it stands on: compile as if there were none
        with suppress(OSError):
            path.unlink()
        return None
    with suppress(OSError):
        os.utime(path.parent)  # in use
    jax.monitoring.record_event_duration_secs(LOADED, time.perf_counter() - begin)
    return run, result


@cache
def _find_linear_algebra() -> None:
    """Guard: JAX looks up LAPACK when it lowers a call of it, and a program that is read is not lowered: it would call what
    has no address yet (tests/test_programs.py::test_stored_programs).
    """
    jax.jit(jax.lax.linalg.cholesky).lower(np.eye(1))


def save(path: Path, run: jax.stages.Compiled, result: Any) -> None:
    """Store a program and its result. Where that cannot be done nothing is: it is compiled again next time."""
    from jax.experimental.serialize_executable import serialize

    with suppress(Exception):
        program, arguments, results = serialize(run)
        whole = pickle.dumps((program, arguments.num_leaves, results.num_leaves, result))
        if not path.parent.exists():
            _delete_unused(path.parents[1])
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        with replacing(path) as temporary:
            temporary.write_bytes(zlib.compress(whole, 1))


def forget(name: str) -> None:
    """Delete the copy that JAX keeps in the same directory of a program whose name will not be asked for again."""
    for copy in _directory.glob(f"*{name}*") if _directory else ():
        with suppress(OSError):
            copy.unlink()


def _delete_unused(directory: Path) -> None:
    """Delete programs of versions that have not been used for long."""
    for version in directory.glob(f"{PREFIX}*"):
        if time.time() - version.stat().st_mtime > UNUSED_DAYS * 86400:
            shutil.rmtree(version, ignore_errors=True)


@cache
def _version() -> str:
    """Digest of this package's sources, of the versions that it stands on, and of the processor."""
    root = Path(__file__).parent
    packages = [root, *(d for d in root.iterdir() if (d / "__init__.py").exists())]
    sources = sorted(f for d in packages for f in (d.glob("*.py") if d == root else d.rglob("*.py")))
    stats = [(str(f.relative_to(root)), f.stat().st_mtime_ns, f.stat().st_size) for f in sources]
    versions = [metadata.version(name) for name in FOUNDATIONS]
    text = repr((stats, versions, os.environ.get("XLA_FLAGS"), sys.version, platform.platform(), _processor()))
    return PREFIX + hashlib.sha256(text.encode()).hexdigest()[:16]


def _processor() -> str:
    """What instructions there are: a home directory may be shared by different machines."""
    with suppress(OSError), open("/proc/cpuinfo", encoding="utf-8") as file:
        return "".join(sorted({line for line in file if line.startswith(("flags", "Features", "model name"))}))
    return platform.processor()


class _Describer(pickle.Pickler):
    """Pickles what a program is found by. Not for reading back: a function is described by where it stands in its source
    and by what it closes over.
    """

    def reducer_override(self, value: Any) -> Any:
        """Raises PicklingError for a class or function that may be another one in the next run."""
        if not isinstance(value, type | FunctionType):
            return NotImplemented
        if value.__module__.partition(".")[0] not in KNOWN:
            raise pickle.PicklingError(f"{value!r} comes from outside")
        if isinstance(value, type):
            return NotImplemented  # by its name; PicklingError if it is not found there
        where = value.__module__, value.__qualname__, tuple(value.__code__.co_positions())
        enclosed = tuple(cell.cell_contents for cell in value.__closure__ or ())
        return tuple, ((*where, value.__defaults__, enclosed),)


__all__ = ["Array", "Placeholder", "key", "load", "save", "store_in"]
