"""Options that several subcommands share."""

from __future__ import annotations

import argparse
from typing import Any

from kilauea.benchmarks.engines import ENGINES


def add_engine_options(parser: argparse.ArgumentParser, engines: tuple[str, ...]) -> None:
    """Add stages, engines and the settings that all engines share."""
    parser.add_argument("stages", nargs="+", metavar="STAGE")
    parser.add_argument("--engines", nargs="+", choices=tuple(ENGINES), default=list(engines))
    parser.add_argument("-r", "--res", nargs=2, type=int, metavar=("W", "H"))
    parser.add_argument("--max-depth", type=int, default=16, metavar="BOUNCES")
    parser.add_argument("-j", "--threads", type=int, default=0, help="0 is all cores")
    parser.add_argument("--json", metavar="FILE", help="machine and rows")


def settings_of(args: argparse.Namespace) -> dict[str, Any]:
    """Return the settings that stand over the stage's: equal depth and a box filter for all."""
    settings = {"max_depth": args.max_depth, "threads": args.threads, "filter": "box"}
    return settings | ({"resolution": args.res} if args.res else {})
