"""Many tables, many models: results as they complete, and no failure takes another fit with it."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import StrPath
from ..tables import Table, load
from .effort import DEFAULT
from .fit_table import failed, fit
from .given import Model, model_class
from .losses import named_loss
from .prepared import prepare
from .result import Fit


def fit_many(
    tables: Table | StrPath | Iterable[Table | StrPath],
    models: Model | Sequence[Model] = ("gtr", "abc", "sgd", "ward", "ashikhmin_shirley"),
    *,
    workers: int | None = None,
    angles: str = "edge",
    **options: Any,
) -> Iterator[Fit]:
    """Fit every model to every table; yields each :class:`~brdfit.Fit` as it completes, table after table.

    Args:
        tables: Tables, or paths of table files, read when their turn comes; or one.
        models: Names, classes or instances, as :func:`brdfit.fit` takes them; or one.
        workers: Fits at a time; one per core by default. Programs are compiled and run outside Python's lock.
        angles: Convention of MERL files given by path.
        options: Further arguments of :func:`brdfit.fit`.

    A file that cannot be read and a fit that raises are failed results, with the reason in words. Wrong arguments (an
    unknown model or loss) raise ValueError or TypeError before the first fit.
    """
    tables = [tables] if isinstance(tables, Table | str | os.PathLike) else tables
    models = models if isinstance(models, Sequence) and not isinstance(models, str) else [models]
    for m in models:
        model_class(m, anisotropic=False)
    named_loss(options.get("loss", "log"))
    return _results(tables, models, workers or os.cpu_count() or 1, angles, options)


def _results(
    tables: Iterable[Table | StrPath], models: Sequence[Model], workers: int, angles: str, options: dict[str, Any]
) -> Iterator[Fit]:
    pool = ThreadPoolExecutor(workers)
    try:
        for entry in tables:
            try:
                table = entry if isinstance(entry, Table) else load(entry, angles=angles)  # type: ignore[arg-type]
                prepare(
                    table,
                    options.get("max_angle", 80.0),
                    options.get("measure", "solid_angle"),
                    named_loss(options.get("loss", "log")),
                    options.get("effort", DEFAULT),
                )
            except InputError as fault:
                for m in models:
                    yield failed(Path(os.fspath(entry)).stem, m, str(fault), options)  # type: ignore[arg-type]
                continue
            running = {pool.submit(fit, table, m, **options): m for m in models}
            for done in as_completed(running):
                try:
                    yield done.result()
                except Exception as fault:
                    reason = f"{type(fault).__name__}: {' '.join(str(fault).split())}"
                    yield failed(table.material, running[done], reason, options)
    finally:
        # an interrupted run does not begin what is still waiting
        pool.shutdown(wait=True, cancel_futures=True)
