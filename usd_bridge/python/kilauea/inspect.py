"""`kilauea inspect`: the passes before the final one, as pictures and figures."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from kilauea import interrupt
from kilauea.errors import KilaueaError, UsageError
from kilauea.render import RenderOptions, build_scene, native

_SUFFIXES = (".exr", ".png")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the subcommand's options."""
    parser.add_argument("stage", metavar="STAGE")
    parser.add_argument(
        "-o",
        "--output",
        nargs="+",
        required=True,
        metavar="FILE",
        help="what photons light, as .exr with layers or as .png",
    )
    parser.add_argument("-c", "--camera", metavar="PRIM")
    parser.add_argument("-r", "--res", nargs=2, type=int, default=[640, 360], metavar=("W", "H"))
    parser.add_argument("--emitted", type=int, default=1_000_000, help="photons that leave lights")
    parser.add_argument("--max-depth", type=int, default=16, metavar="SURFACES")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-j", "--threads", type=int, default=0, help="0 is one per core")
    parser.add_argument("--stats", metavar="FILE", help="write the figures there as well")


def main(args: argparse.Namespace) -> int:
    """Trace photons, write the pictures and print the figures as JSON."""
    from kilauea.usd.options import FlattenOptions
    from kilauea.usd.stage import flatten

    check(args)
    frame = flatten(args.stage, FlattenOptions(camera=args.camera, resolution=tuple(args.res)))
    settings = {"resolution": args.res}
    scene = build_scene(frame, RenderOptions(outputs=args.output, settings=settings))
    engine = native()
    try:
        report = interrupt.run(
            lambda: engine.inspect_photons(scene, json.dumps(photon_request(args)), args.output)
        )
    except engine.RenderError as error:
        raise KilaueaError(f"{args.stage}: {error}") from None
    text = json.dumps(json.loads(report), indent=2)
    if args.stats:
        Path(args.stats).write_text(text + "\n", encoding="utf-8")
    print(text)
    return 0


def check(args: argparse.Namespace) -> None:
    """Refuse what cannot be done, before anything is loaded."""
    if args.emitted < 1 or args.max_depth < 1 or min(args.res) < 1:
        raise UsageError("--emitted, --max-depth and --res must be positive")
    for output in args.output:
        if Path(output).suffix.lower() not in _SUFFIXES:
            raise UsageError(f"{output}: expected a name that ends with .exr or .png")


def photon_request(args: argparse.Namespace) -> dict[str, Any]:
    """Say what the engine is to trace."""
    return {
        "resolution": args.res,
        "emitted": args.emitted,
        "max_depth": args.max_depth,
        "seed": args.seed,
        "threads": args.threads,
    }
