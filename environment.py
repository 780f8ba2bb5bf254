"""Where and with what a result was made: the one block of a file that differs from run to run."""

from __future__ import annotations

import platform
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version


def environment() -> dict[str, str | int]:
    """Versions, device, precision, and when."""
    import os

    import jax

    def of(package: str) -> str:
        try:
            return version(package)
        except PackageNotFoundError:
            return "unknown"

    return {
        **{name: of(name) for name in ("brdfit", "jax", "jaxlib", "optimistix", "equinox", "lineax", "numpy")},
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "device": f"{jax.devices()[0].platform} ({os.cpu_count()} cores)",
        "precision": "float64",
        "when": datetime.now(UTC).isoformat(timespec="seconds"),
    }


__all__ = ["environment"]
