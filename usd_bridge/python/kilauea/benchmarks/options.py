"""Options that several subcommands share."""

from __future__ import annotations

import argparse
from typing import Any

from kilauea.benchmarks.engines import ENGINES


def add_engine_options(parser: argparse.ArgumentParser, engines: tuple[str, ...]) -> None:
    """Add stages, engines and the settings that all engines share."""
    parser.add_argument("stages", nargs="+", metavar="STAGE")
    parser.add_argument(
        "--engines",
        type=engine_names,
        default=list(engines),
        metavar="NAME,NAME",
        help=", ".join(ENGINES),
    )
    parser.add_argument("-r", "--res", nargs=2, type=int, metavar=("W", "H"))
    parser.add_argument("--max-depth", type=int, default=16, metavar="BOUNCES")
    parser.add_argument("-j", "--threads", type=int, default=0, help="0 is all cores")
    parser.add_argument("--json", metavar="FILE", help="machine and rows")


def engine_names(text: str) -> list[str]:
    """Split at commas; every name must be known."""
    names = text.split(",")
    unknown = [name for name in names if name not in ENGINES]
    if unknown:
        raise argparse.ArgumentTypeError(f"{', '.join(unknown)}: not among {', '.join(ENGINES)}")
    return names


def settings_of(args: argparse.Namespace) -> dict[str, Any]:
    """Return the settings that stand over the stage's: equal depth and a box filter for all."""
    settings = {"max_depth": args.max_depth, "threads": args.threads, "filter": "box"}
    return settings | ({"resolution": args.res} if args.res else {})
