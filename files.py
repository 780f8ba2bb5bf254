"""Opening files with their faults in words, replacing them whole, and values as JSON has them."""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from io import BufferedReader
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import numpy as np

from .errors import InputError

StrPath = str | os.PathLike[str]


@contextmanager
def reading(path: StrPath) -> Iterator[BufferedReader]:
    """The regular file at ``path``, open for reading bytes.

    Raises InputError if there is none, if it is empty, or if it cannot be opened.
    """
    target = Path(path)
    try:
        if target.is_dir():
            raise InputError(f"{path}: is a directory; name a file in it")
        if target.exists() and not target.is_file():  # opening a pipe would wait for its other end
            raise InputError(f"{path}: is not a regular file; save it to disk first")
        file = target.open("rb")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; check the path") from None
    except OSError as fault:
        raise InputError(f"{path}: cannot be opened ({fault.strerror or fault}); check path and permissions") from None
    with file:
        if os.fstat(file.fileno()).st_size == 0:
            raise InputError(f"{path}: is empty (0 bytes); copy or download it again")
        yield file


@contextmanager
def replacing(path: StrPath) -> Iterator[Path]:
    """A temporary path in the same directory, renamed to ``path`` when the block ends and removed if it fails.

    Raises InputError if the file cannot be written.
    """
    target = Path(path)
    temporary = target.with_name(f".{uuid.uuid4().hex}.tmp{target.suffix}")  # some libraries go by the suffix
    try:
        yield temporary
        os.replace(temporary, target)
    except OSError as fault:
        why = os.strerror(fault.errno) if fault.errno else fault
        raise InputError(f"{path}: cannot be written ({why}); check its directory, permissions and free space") from fault
    finally:
        temporary.unlink(missing_ok=True)


def folder(path: StrPath) -> Path:
    """A directory that can be written to, made if need be. Raises InputError if nothing can be written there."""
    out = Path(path)
    try:
        out.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=out):
            return out
    except OSError as fault:
        raise InputError(
            f"{path}: nothing can be written there ({fault.strerror or fault}); choose another directory"
        ) from None


def plain(value: Any) -> Any:
    """JSON values of arrays and dicts of them; numbers that JSON does not have become None."""
    if isinstance(value, dict):
        return {k: plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return value


__all__ = ["StrPath", "folder", "plain", "reading", "replacing"]
