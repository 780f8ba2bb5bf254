"""How this package compiles: with the compiler's settings that pay for programs that run for a second or two."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Hashable
from functools import cache, wraps
from threading import Lock
from typing import Any, ParamSpec, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp

P = ParamSpec("P")
R = TypeVar("R")

OPTIONS = {"xla_cpu_use_fusion_emitters": False}
"""XLA's newer way of generating loops takes up to twice as long to compile as the older one, and the programs are no faster
for it (benchmarks/cold_start.py): the first fit of five models took 38 s of processor without it, 54 s with it."""

_making = Lock()


def program(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function for the shapes of its arrays; all else is static. For calls from Python, not from a program.

    Threads that ask at once for the same program wait for the one that compiles it.
    """

    @cache
    def compiled() -> Any:
        compiler: Any = eqx.filter_jit  # passes on what it does not know
        return compiler(function, compiler_options=_understood())

    first: defaultdict[Hashable, Lock] = defaultdict(Lock)
    made: set[Hashable] = set()

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        kind = _kind((args, kwargs))
        result: R
        if kind in made:
            result = compiled()(*args, **kwargs)
            return result
        with _making:
            it, turn = compiled(), first[kind]
        with turn:
            result = it(*args, **kwargs)
            made.add(kind)
        return result

    return call


def _kind(arguments: Any) -> Hashable:
    """What a program is compiled for: shapes and types of arrays, and all else as it is."""
    leaves, structure = jax.tree.flatten(arguments)
    kinds = ((x.shape, x.dtype) if hasattr(x, "dtype") else x for x in leaves)
    return structure, *kinds, jnp.result_type(float)


@cache
def _understood() -> dict[str, bool]:
    """The options, or none: a compiler that does not know one of them refuses every program."""
    try:
        jax.jit(lambda: 0, compiler_options=OPTIONS)()
    except jax.errors.JaxRuntimeError:
        return {}
    return OPTIONS


__all__ = ["program"]
