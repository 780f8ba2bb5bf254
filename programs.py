"""How this package compiles: once for each kind of arguments, with the settings that pay for programs of a second or two."""

from __future__ import annotations

import time
import uuid
from collections import OrderedDict, defaultdict
from collections.abc import Callable, Hashable, Sequence
from contextlib import suppress
from functools import cache, wraps
from pathlib import Path
from threading import Lock
from typing import Any, NamedTuple, ParamSpec, TypeVar

import jax
import jax.numpy as jnp

from . import stored_programs
from .stored_programs import Array, Placeholder

P = ParamSpec("P")
R = TypeVar("R")

OPTIONS: dict[str, bool | int | str] = {
    "xla_cpu_parallel_codegen_split_count": 4,
    "xla_cpu_use_fusion_emitters": False,
    "xla_disable_hlo_passes": "while-loop-invariant-code-motion",
}
"""XLA's newer way of generating loops takes up to twice as long to compile as the older one, and the programs are no faster
for it (benchmarks/cold_start.py): the first fit of five models took 38 s of processor without it, 54 s with it.

Into up to 32 parts XLA cuts a program, to compile them side by side, and each part takes memory maps of its own (see
:data:`MAPS`). Of 4 parts the programs of six models took 1950 maps instead of 3320, and no longer to compile.

What does not change in a loop over blocks, functions of the parameters, XLA moves out of it before it looks for calculations
that are done twice: each column of a Jacobian then has its own copy, and all that depends on it is done again for each. Left
in the loop they are found to be one: a pass of ``gtr`` takes 0.85 of the time, of ``lafortune`` a half, of ``htsg`` a third.
"""

MAPS = 0.75
"""Share of a process's memory maps at which programs are dropped, those first that have not been used for longest. Guard: a
program takes some fifty maps, Linux allows a process 65,530 (vm.max_map_count), and the compiler ends the process when it
gets no more: fits of every model under every loss would come near it (tests/test_programs.py::test_maps_do_not_run_out).
"""


class _Compiled(NamedTuple):
    """A program from arrays to arrays, and what its result is beside them."""

    run: Callable[..., Sequence[Any]]
    result: Any
    """The result with a :class:`Placeholder` for each array."""

    def __call__(self, arrays: list[Any]) -> Any:
        out = iter(self.run(*arrays))
        return jax.tree.map(lambda x: next(out) if isinstance(x, Placeholder) else x, self.result)


_programs: OrderedDict[Hashable, _Compiled] = OrderedDict()
"""By function and kind of arguments, in the order of their last use."""
_access, _making_room = Lock(), Lock()
_turns: defaultdict[Hashable, Lock] = defaultdict(Lock)
"""Of threads that ask for the same program."""


def program(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function for the shapes of its arrays; all else is static. For calls from Python, not from a program.

    Threads that ask at once for the same program wait for the one that compiles it. Where programs are stored
    (:func:`brdfit.stored_programs.store_in`) one that an earlier run compiled is not even traced again. A process that nears
    the number of memory maps that it may have drops programs (:data:`MAPS`).
    """

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        leaves, structure = jax.tree.flatten((args, kwargs))
        kinds = [Array(x.shape, str(x.dtype)) if hasattr(x, "dtype") else x for x in leaves]
        kind = function, structure, *kinds, jnp.result_type(float)
        made = _used(kind)
        if made is None:
            asked = time.perf_counter()
            with _access:
                turn = _turns[kind]
            with turn:
                made = _used(kind)
                if made is None:
                    _make_room()
                    made = _compiled(function, structure, leaves, kinds)
                    with _access:
                        _programs[kind] = made
                        _turns.pop(kind, None)
                else:
                    jax.monitoring.record_event_duration_secs(stored_programs.LOADED, time.perf_counter() - asked)
        result: R = made([x for x in leaves if hasattr(x, "dtype")])
        return result

    return call


def _used(kind: Hashable) -> _Compiled | None:
    """The program for such arguments, if there is one, now the last used."""
    with _access:
        made = _programs.get(kind)
        if made is not None:
            _programs.move_to_end(kind)
        return made


def _make_room() -> None:
    """Drop the half of all programs that has not been used for longest if the process is short of memory maps."""
    with _making_room:  # the next thread counts when they are gone
        if _maps() > MAPS * _maps_allowed():
            with _access:
                dropped = [_programs.pop(kind) for kind in list(_programs)[: (len(_programs) + 1) // 2]]
            del dropped  # here, where no thread waits for it


def _maps() -> int:
    """Memory maps of this process; 0 where they are not counted."""
    with suppress(OSError):
        return Path("/proc/self/maps").read_bytes().count(b"\n")
    return 0


@cache
def _maps_allowed() -> float:
    """How many it may have."""
    with suppress(OSError, ValueError):
        return float(Path("/proc/sys/vm/max_map_count").read_text())
    return float("inf")


def _compiled(function: Callable[..., Any], structure: Any, leaves: list[Any], kinds: list[Any]) -> _Compiled:
    """The program for arguments like these, stored or compiled."""
    options = _understood()
    key = stored_programs.key(function, jax.tree.unflatten(structure, kinds), options)
    if key is not None and (kept := stored_programs.load(key)) is not None:
        return _Compiled(*kept)
    result: Any = None

    def flat(*arrays: Any) -> list[Any]:
        nonlocal result
        given = iter(arrays)
        args, kwargs = jax.tree.unflatten(structure, [next(given) if isinstance(k, Array) else k for k in kinds])
        out, form = jax.tree.flatten(function(*args, **kwargs))
        traced = [hasattr(x, "dtype") for x in out]
        result = jax.tree.unflatten(form, [Placeholder() if t else x for x, t in zip(out, traced, strict=True)])
        return [x for x, t in zip(out, traced, strict=True) if t]

    # Guard: JAX finds a compiled program again by its text and name, and what it found cannot be stored: functions are
    # missing from it when it runs (tests/test_programs.py::test_stored_programs). A name of its own is never found.
    own = uuid.uuid4().hex
    flat.__name__ = function.__name__ + ("" if key is None else f"_{own}")
    arrays = [x for x in leaves if hasattr(x, "dtype")]
    run = jax.jit(flat, compiler_options=options).lower(*arrays).compile()
    if key is not None:
        stored_programs.save(key, run, result)
        stored_programs.forget(own)
    return _Compiled(run, result)


@cache
def _understood() -> dict[str, bool | int | str]:
    """The options, or none: a compiler that does not know one of them refuses every program."""
    try:
        jax.jit(lambda: 0, compiler_options=OPTIONS)()
    except jax.errors.JaxRuntimeError:
        return {}
    return OPTIONS


__all__ = ["program"]
