"""One render node: all of it is in Rust, and nothing here knows USD."""

from __future__ import annotations

import importlib
import sys

COMMAND = [sys.executable, "-m", "kilauea.worker"]
"""What starts a worker; it reads its ticket from standard input."""


def main() -> int:
    """Work for the console whose ticket is on standard input, until there is nothing to do."""
    engine = importlib.import_module("kilauea._native")
    try:
        engine.run_worker()
    except engine.RenderError as error:
        print(f"kilauea: worker: error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
