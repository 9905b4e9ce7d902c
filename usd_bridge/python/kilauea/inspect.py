"""`kilauea inspect`: the passes before the final one, as pictures and figures."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from kilauea import interrupt
from kilauea.errors import KilaueaError, UsageError
from kilauea.render import RenderOptions, build_scene, native, settings_record

_SUFFIXES = (".exr", ".png")
LEARNT = ["guided_lights", "guided_directions"]
"""What paths can be told, as `general` in `kilauea_scene::RenderSettings` has it."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the subcommand's options."""
    parser.add_argument("stage", metavar="STAGE")
    parser.add_argument(
        "-o",
        "--output",
        nargs="+",
        required=True,
        metavar="FILE",
        help="what photons light or paths are told, as .exr with layers or as .png",
    )
    parser.add_argument("-c", "--camera", metavar="PRIM")
    parser.add_argument("-r", "--res", nargs=2, type=int, default=[640, 360], metavar=("W", "H"))
    parser.add_argument("--emitted", type=int, default=1_000_000, help="photons that leave lights")
    parser.add_argument("--max-depth", type=int, default=16, metavar="SURFACES")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-j", "--threads", type=int, default=0, help="0 is one per core")
    parser.add_argument("--stats", metavar="FILE", help="write the figures there as well")
    told = parser.add_argument_group("what paths are told, in place of photons")
    told.add_argument("--estimates", metavar="FILE", help="by what render --save-estimates wrote")
    told.add_argument("--pilot", action="store_true", help="by a pilot of its own")
    told.add_argument(
        "-p", "--pixel-samples", type=int, metavar="SAMPLES", help="of the frame that has the pilot"
    )
    told.add_argument(
        "--always", action="store_true", help="make the pilot tell all, whether that pays or not"
    )
    told.add_argument(
        "--show", choices=("lights", "directions"), help="what the picture is of; lights by default"
    )


def main(args: argparse.Namespace) -> int:
    """Write the pictures and print the figures as JSON."""
    from kilauea.usd.options import FlattenOptions
    from kilauea.usd.stage import flatten

    check(args)
    frame = flatten(args.stage, FlattenOptions(camera=args.camera, resolution=tuple(args.res)))
    options = RenderOptions(outputs=args.output, settings=settings(args))
    scene = build_scene(frame, options)
    engine = native()
    record = settings_record(frame, options)

    def inspect() -> tuple[dict[str, Any], bool]:
        if is_of_estimates(args):
            request = json.dumps(estimate_request(args, record))
            report, is_written = engine.inspect_estimates(scene, request, args.output)
        else:
            request = json.dumps(photon_request(args))
            report, is_written = engine.inspect_photons(scene, request, args.output), True
        return json.loads(report), is_written

    try:
        report, is_written = interrupt.run(inspect)
    except engine.RenderError as error:
        raise KilaueaError(f"{args.stage}: {error}") from None
    text = json.dumps(report, indent=2)
    if args.stats:
        Path(args.stats).write_text(text + "\n", encoding="utf-8")
    print(text)
    if not is_written:
        reasons = "; ".join(report["skipped"])
        raise KilaueaError(f"{args.stage}: paths are not told what is to be shown: {reasons}")
    return 0


def is_of_estimates(args: argparse.Namespace) -> bool:
    """Whether the pictures are of what paths are told."""
    return args.pilot or args.estimates is not None


def check(args: argparse.Namespace) -> None:
    """Refuse what cannot be done, before anything is loaded."""
    if args.emitted < 1 or args.max_depth < 1 or min(args.res) < 1:
        raise UsageError("--emitted, --max-depth and --res must be positive")
    if args.pilot and args.estimates is not None:
        raise UsageError("--estimates has what a --pilot told before: one of them is enough")
    if not args.pilot and (args.always or args.pixel_samples is not None):
        raise UsageError("--always and --pixel-samples are of a --pilot")
    if args.pixel_samples is not None and args.pixel_samples < 1:
        raise UsageError("--pixel-samples must be positive")
    if args.show is not None and not is_of_estimates(args):
        raise UsageError("--show is of --estimates or a --pilot")
    for output in args.output:
        if Path(output).suffix.lower() not in _SUFFIXES:
            raise UsageError(f"{output}: expected a name that ends with .exr or .png")


def settings(args: argparse.Namespace) -> dict[str, Any]:
    """Return the settings that the command line asks for."""
    record: dict[str, Any] = {"resolution": args.res}
    if args.pilot:
        record |= {"max_depth": args.max_depth, "seed": args.seed, "integrator": "kilauea"}
        if args.pixel_samples is not None:
            record["samples_per_pixel"] = args.pixel_samples
        if args.always:
            record["general"] = LEARNT
    if is_of_estimates(args):
        record["threads"] = args.threads
    return record


def photon_request(args: argparse.Namespace) -> dict[str, Any]:
    """Say what the engine is to trace."""
    return {
        "resolution": args.res,
        "emitted": args.emitted,
        "max_depth": args.max_depth,
        "seed": args.seed,
        "threads": args.threads,
    }


def estimate_request(args: argparse.Namespace, record: dict[str, Any]) -> dict[str, Any]:
    """Say where the engine finds what paths are told, and what is to be shown of it."""
    return {"settings": record, "estimates": args.estimates, "shown": args.show}
