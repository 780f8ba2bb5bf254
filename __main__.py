"""The command line's entry: ``brdfit`` and ``python -m brdfit``."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the command line; exit codes: 0 all fitted, 1 some fit failed, 2 wrong use or unreadable input."""
    from .cli import run

    sys.exit(run())


if __name__ == "__main__":
    main()
