"""What the flags of `kilauea render` and `kilauea reference` ask for."""

from __future__ import annotations

import argparse
import dataclasses
import os
import sys
from typing import Any

from kilauea import aovs, framespec, interrupt, output
from kilauea.arguments import comma_list
from kilauea.errors import MissingAssetError, UsageError

_MAX_WARNINGS_SHOWN = 20


def open_stage(args: argparse.Namespace) -> Any:
    """Open the stage that the command line names."""
    path = stage_path(args)

    def load() -> Any:
        from kilauea.usd.stage import SourceStage

        return SourceStage(path, tuple(comma_list(args.mask)))

    return interrupt.run(load)


def stage_path(args: argparse.Namespace) -> str:
    """Return the stage, however it is named."""
    if args.usd_input and args.stage:
        # With --usd-input, the first positional can only be the output.
        args.positional_output = getattr(args, "positional_output", None) or args.stage
    path = args.usd_input or args.stage
    if not path:
        raise UsageError("no stage given")
    return path


def flatten_options(args: argparse.Namespace) -> Any:
    """Return how the stage is to be flattened."""
    from kilauea.usd.options import FlattenOptions

    return FlattenOptions(
        camera=args.camera,
        settings=args.settings,
        purposes=_purposes(args.purposes),
        resolution=tuple(args.res) if args.res else None,
        image_width=args.image_width,
        resolution_scale=args.res_scale / 100.0,
        pixel_aspect_ratio=args.pixel_aspect,
        mask=tuple(comma_list(args.mask)),
        scene_lights=not args.disable_scene_lights,
        scene_materials=not args.disable_scene_materials,
        motion_blur=not args.disable_motion_blur,
        depth_of_field=not args.disable_depth_of_field,
    )


def _purposes(text: str | None) -> frozenset[str] | None:
    if text is None:
        return None
    # husk calls the default purpose "geometry".
    names = frozenset("default" if n == "geometry" else n for n in comma_list(text))
    unknown = names - {"default", "render", "proxy", "guide"}
    if unknown:
        raise UsageError(f"unknown purpose {sorted(unknown)[0]!r}")
    return names


def frames(args: argparse.Namespace, start_time: float) -> list[float]:
    """Return the time codes to render."""
    if args.default_time:
        return [start_time]
    if args.frames:
        return framespec.parse_frames(args.frames)
    if args.frame is not None and any(c in args.frame for c in ",:"):
        return framespec.parse_frames(args.frame)
    first = start_time if args.frame is None else framespec.parse_frames(args.frame)[0]
    return framespec.counted_frames(first, args.frame_count, args.frame_inc)


def output_files(
    args: argparse.Namespace, stage: Any, frames: list[float]
) -> tuple[list[list[str]], list[str | None]]:
    """Return the images and the statistics file of each frame, after checking that they can be
    written.
    """  # noqa: D205
    named = args.output or args.positional_output
    options = flatten_options(args)
    images = []
    for index, frame in enumerate(frames):
        pattern = named or stage.product_name(dataclasses.replace(options, time=frame))
        if not pattern:
            raise UsageError("no output: name one with -o, or in a RenderProduct")
        names = output.image_patterns(pattern)
        images.append([framespec.expand(name, frame, index) for name in names])
    framespec.refuse_shared(images)
    stats: list[str | None] = [None] * len(frames)
    if args.stats:
        stats = [name for (name,) in framespec.output_files([args.stats], frames)]
    every_file = [name for names in images for name in names] + [s for s in stats if s]
    output.check_writable(every_file, args.make_output_path)
    return images, stats


def engine_settings(args: argparse.Namespace) -> dict[str, Any]:
    """Return the RenderSettings fields that the command line sets."""
    settings: dict[str, Any] = {
        "samples_per_pixel": args.pixel_samples,
        "noise": args.noise,
        "max_depth": args.max_depth,
        "integrator": args.integrator,
        "gi": args.gi,
        "seed": args.seed,
        "filter": args.filter,
        "filter_radius": args.filter_radius,
        "threads": n_threads(args.threads),
        "shading": args.shading,
    }
    if args.seed is not None:
        settings["seed"] = args.seed % 2**32
    if args.texture_memory is not None:
        settings["texture_memory_bytes"] = args.texture_memory << 20
    if args.shade_memory is not None:
        settings["shade_memory_bytes"] = args.shade_memory << 20
    if args.aov:
        settings["aovs"] = [_aov(name) for names in args.aov for name in names.split(",")]
    return {key: value for key, value in settings.items() if value is not None}


def n_threads(asked: int) -> int:
    """Return how many threads to use, 0 for all cores; negative numbers leave cores free."""
    return max(1, (os.cpu_count() or 1) + asked) if asked < 0 else asked


def _aov(name: str) -> str:
    known = aovs.canonical(name)
    if known is None:
        raise UsageError(f"unknown layer {name!r}; there are {', '.join(aovs.known())}")
    return known


def verbosity(text: str) -> tuple[int, str]:
    """Split a level such as `3te` into its number and its letters."""
    letters = text.lstrip("0123456789")
    digits = text[: len(text) - len(letters)]
    if letters and not letters.isalpha():
        raise UsageError(f"cannot read verbosity {text!r}")
    return int(digits or 2), letters


def report(frame: Any, strict: bool, verbosity: int) -> None:
    """Print what the stage has and the picture will lack; an error if `strict`."""
    faults = [*(f"missing: {m}" for m in frame.missing), *frame.warnings]
    print_warnings([*faults, *frame.notes], verbosity)
    if strict and faults:
        raise MissingAssetError(f"--strict: {len(faults)} missing or unsupported; {faults[0]}")


def print_warnings(lines: list[str], verbosity: int) -> None:
    """Print the first lines, and how many more there are."""
    if verbosity < 1:
        return
    for line in lines[:_MAX_WARNINGS_SHOWN]:
        print_warning(line)
    if len(lines) > _MAX_WARNINGS_SHOWN:
        print_warning(f"and {len(lines) - _MAX_WARNINGS_SHOWN} more")


def print_warning(line: str) -> None:
    """Print one line."""
    print(f"kilauea: warning: {line}", file=sys.stderr)
