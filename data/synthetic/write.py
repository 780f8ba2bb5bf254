"""Synthetic tables as files, each with its truth beside it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from ...errors import InputError
from ...files import StrPath, replacing
from ...tables.hdf5 import write_hdf5
from ...tables.layout import HalfDifferenceGrid
from ...tables.merl import Angles, write_merl
from .generate import generate
from .materials import DEFAULT_NAMES, material
from .noise import Noise


def write(
    names: Sequence[str],
    out_dir: StrPath,
    *,
    grid: tuple[int, ...] | None = None,
    convention: Angles = "edge",
    noise: Sequence[Noise] = (),
    seed: int = 0,
) -> list[Path]:
    """Write NAME.binary, NAME.h5 and NAME.json for each name (none: :data:`DEFAULT_NAMES`); returns the paths.

    The .binary is a MERL table of three channels and is left out for anisotropic materials, which it cannot hold. The
    .json is the truth of :func:`generate`, whose arguments the others are; the .h5 holds it too. Files are replaced whole.

    Raises InputError for an unknown name before anything is written, and if a file cannot be written.
    """
    chosen = [material(name).name for name in names or DEFAULT_NAMES]
    out = Path(out_dir)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        raise InputError(f"{out_dir}: cannot be made a directory ({fault.strerror or fault}); choose another") from fault
    written = []
    for name in chosen:
        made, truth = generate(name, grid=grid, convention=convention, noise=noise, seed=seed)
        if isinstance(made.layout, HalfDifferenceGrid) and made.isotropic:
            write_merl(out / f"{name}.binary", made)
            written.append(out / f"{name}.binary")
        write_hdf5(out / f"{name}.h5", made, truth=truth)
        with replacing(out / f"{name}.json") as temporary:
            temporary.write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")
        written += [out / f"{name}.h5", out / f"{name}.json"]
    return written


__all__ = ["write"]
