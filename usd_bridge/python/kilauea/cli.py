"""The `kilauea` command."""

from __future__ import annotations

import argparse
import dataclasses
import os
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from kilauea import aovs, framespec, interrupt, output
from kilauea.arguments import (
    ArgumentParser,
    add_render_options,
    add_stage_options,
    comma_list,
    drop_unknown_flags,
    subdivision_level,
)
from kilauea.clock import process_age
from kilauea.errors import KilaueaError, MissingAssetError, TimeLimitError, UsageError

MAX_WARNINGS_SHOWN = 20

_NOT_BUILT_YET = ("worker", "console")
_FLAGS_NOT_BUILT_YET = ("noise", "gi", "denoise", "shading")


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code."""
    try:
        return _run(list(sys.argv[1:] if argv is None else argv))
    except KilaueaError as error:
        _print_error(str(error))
        return error.exit_code
    except KeyboardInterrupt:
        interrupt.leave()
    except BrokenPipeError:
        # The reader of stdout went away; there is nobody to tell.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        if os.environ.get("KILAUEA_TRACEBACK"):
            traceback.print_exc()
        _print_error(f"internal error: {type(error).__name__}: {error}")
        return 1


def _run(argv: list[str]) -> int:
    command = argv[0] if argv else ""
    if command in _NOT_BUILT_YET:
        raise UsageError(f"{command} is not built yet")
    parser = _parser(command)
    dropped: list[str] = []
    subparser = parser.commands.get(command)
    if command in ("render", "reference", "translate") and subparser:
        argv[1:], dropped = drop_unknown_flags(subparser, argv[1:])
    args = parser.parse_args(argv)
    for flag in (*dropped, *getattr(args, "ignored_flags", ())):
        _print_warning(f"{flag} has no meaning here: ignored")
    return args.run(args)


class _MainParser(ArgumentParser):
    commands: dict[str, ArgumentParser]


def _parser(command: str) -> _MainParser:
    parser = _MainParser(
        prog="kilauea",
        description="Kilauea, a production renderer for USD.",
        epilog="Every option has a default in the environment: --max-depth in KILAUEA_MAX_DEPTH.",
    )
    parser.add_argument("--version", action="version", version=f"kilauea {_version()}")
    subparsers = parser.add_subparsers(
        required=True, metavar="COMMAND", parser_class=ArgumentParser
    )
    parser.commands = {}

    def add(name: str, run: Callable[[argparse.Namespace], int], text: str) -> ArgumentParser:
        sub = subparsers.add_parser(name, help=text, description=text)
        sub.set_defaults(run=run)
        parser.commands[name] = sub
        return sub

    add_render_options(add("render", _render, "render a stage to images"))
    translate = add("translate", _translate, "print what the engine would receive")
    add_stage_options(translate)
    translate.add("--dump", action="store_true", help="as JSON (what it does anyway)")
    compare = add("compare", _compare, "measure the difference of two images")
    compare.add_argument("a", metavar="A.exr")
    compare.add_argument("b", metavar="B.exr")
    add_render_options(add("reference", _reference, "render a stage with Cycles"))
    bench = add("bench", _bench, "measure speed and error")
    if command == "bench":
        _optional("kilauea.bench", "bench").add_arguments(bench)
    return parser


def _render(args: argparse.Namespace) -> int:
    from kilauea.render import RenderOptions, render_frame, summary

    for flag in ("workers", "cluster"):
        if getattr(args, flag) is not None:
            raise UsageError(f"--{flag} is not built yet")
    for flag in _FLAGS_NOT_BUILT_YET:
        if getattr(args, flag):
            _print_warning(f"--{flag} is not built yet: ignored")
    if args.integrator == "kilauea":
        _print_warning("--integrator kilauea is not built yet: rendering with path")
    settings = _engine_settings(args)
    max_level = subdivision_level(args.complexity)
    verbosity, letters = _verbosity(args.verbose)

    started = time.monotonic()
    stage = _open_stage(args)
    frames = _frames(args, stage.start_time)
    outputs, stats_files = _output_files(args, stage, frames)
    code = 0
    for frame_time, files, stats_file in zip(frames, outputs, stats_files, strict=True):
        options = dataclasses.replace(_flatten_options(args), time=frame_time)
        frame = interrupt.run(lambda options=options: stage.flatten(options))
        load_secs = time.monotonic() - started
        _report(frame, args.strict, verbosity)
        if args.timelimit is not None and frame_time != frames[0]:
            _refuse_late_start(args.timelimit, frame_time)
        stats = render_frame(
            frame,
            RenderOptions(
                outputs=files,
                settings=settings,
                max_subdivision_level=max_level,
                time_limit=args.timelimit,
                frames_per_second=args.fps or stage.frames_per_second,
                stats_file=stats_file,
                load_secs=load_secs,
                verbosity=verbosity,
                alfred="a" in letters,
            ),
        )
        _print_warnings([w for w in stats["warnings"] if w not in _said(frame)], verbosity)
        if verbosity >= 1:
            print(summary(stats, files), flush=True)
        if args.timelimit is not None and not stats.get("full_passes", 1):
            _print_error("the time limit came before one full pass; wrote what there was")
            code = TimeLimitError.exit_code
        started = time.monotonic()
    return code


def _translate(args: argparse.Namespace) -> int:
    from kilauea.dump import as_text

    verbosity, _ = _verbosity(args.verbose)
    stage = _open_stage(args)
    frames = [
        stage.flatten(dataclasses.replace(_flatten_options(args), time=t))
        for t in _frames(args, stage.start_time)
    ]
    for frame in frames:
        _report(frame, args.strict, verbosity)
        print(as_text(frame))
    return 0


def _compare(args: argparse.Namespace) -> int:
    from kilauea.render import native

    for name in (args.a, args.b):
        if not Path(name).is_file():
            raise KilaueaError(f"{name} does not exist")
    engine = native()
    try:
        print(engine.compare(args.a, args.b))
    except (engine.RenderError, engine.SceneError, OSError, ValueError) as error:
        raise KilaueaError(str(error)) from None
    return 0


def _reference(args: argparse.Namespace) -> int:
    args.stage = _stage_path(args)
    args.output = args.output or args.positional_output
    return _optional("kilauea.reference", "reference").main(args)


def _bench(args: argparse.Namespace) -> int:
    return _optional("kilauea.bench", "bench").main(args)


def _optional(module: str, command: str) -> Any:
    import importlib

    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name != module:
            raise KilaueaError(f"{command} needs a module that is missing: {error.name}") from None
        raise UsageError(f"{command} is not built yet") from None


def _open_stage(args: argparse.Namespace) -> Any:
    path = _stage_path(args)

    def load() -> Any:
        from kilauea.usd.stage import SourceStage

        return SourceStage(path, tuple(comma_list(args.mask)))

    return interrupt.run(load)


def _stage_path(args: argparse.Namespace) -> str:
    if args.usd_input and args.stage:
        # With --usd-input, the first positional can only be the output.
        args.positional_output = getattr(args, "positional_output", None) or args.stage
    path = args.usd_input or args.stage
    if not path:
        raise UsageError("no stage given")
    return path


def _flatten_options(args: argparse.Namespace) -> Any:
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


def _frames(args: argparse.Namespace, start_time: float) -> list[float]:
    if args.default_time:
        return [start_time]
    if args.frames:
        return framespec.parse_frames(args.frames)
    if args.frame is not None and any(c in args.frame for c in ",:"):
        return framespec.parse_frames(args.frame)
    first = start_time if args.frame is None else framespec.parse_frames(args.frame)[0]
    return framespec.counted_frames(first, args.frame_count, args.frame_inc)


def _output_files(
    args: argparse.Namespace, stage: Any, frames: list[float]
) -> tuple[list[list[str]], list[str | None]]:
    """Return the images and the statistics file of each frame, after checking that they can be
    written.
    """  # noqa: D205
    named = args.output or args.positional_output
    options = _flatten_options(args)
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


def _engine_settings(args: argparse.Namespace) -> dict[str, Any]:
    """Return the RenderSettings fields that the command line sets."""
    settings: dict[str, Any] = {
        "samples_per_pixel": args.pixel_samples,
        "max_depth": args.max_depth,
        "seed": args.seed,
        "filter": args.filter,
        "filter_radius": args.filter_radius,
        "threads": args.threads,
    }
    if args.threads < 0:
        settings["threads"] = max(1, (os.cpu_count() or 1) + args.threads)
    if args.seed is not None:
        settings["seed"] = args.seed % 2**32
    if args.texture_memory is not None:
        settings["texture_memory_bytes"] = args.texture_memory << 20
    if args.aov:
        settings["aovs"] = [_aov(name) for names in args.aov for name in names.split(",")]
    return {key: value for key, value in settings.items() if value is not None}


def _aov(name: str) -> str:
    known = aovs.canonical(name)
    if known is None:
        raise UsageError(f"unknown layer {name!r}; there are {', '.join(aovs.known())}")
    return known


def _verbosity(text: str) -> tuple[int, str]:
    letters = text.lstrip("0123456789")
    digits = text[: len(text) - len(letters)]
    if letters and not letters.isalpha():
        raise UsageError(f"cannot read verbosity {text!r}")
    return int(digits or 2), letters


def _report(frame: Any, strict: bool, verbosity: int) -> None:
    faults = [*(f"missing: {m}" for m in frame.missing), *frame.warnings]
    _print_warnings([*faults, *frame.notes], verbosity)
    if strict and faults:
        raise MissingAssetError(f"--strict: {len(faults)} missing or unsupported; {faults[0]}")


def _said(frame: Any) -> set[str]:
    return {*frame.warnings, *frame.notes}


def _refuse_late_start(time_limit: float, frame: float) -> None:
    if process_age() >= time_limit:
        raise TimeLimitError(f"the time limit came before frame {framespec.format_frame(frame)}")


def _print_warnings(lines: list[str], verbosity: int) -> None:
    if verbosity < 1:
        return
    for line in lines[:MAX_WARNINGS_SHOWN]:
        _print_warning(line)
    if len(lines) > MAX_WARNINGS_SHOWN:
        _print_warning(f"and {len(lines) - MAX_WARNINGS_SHOWN} more")


def _print_warning(line: str) -> None:
    print(f"kilauea: warning: {line}", file=sys.stderr)


def _print_error(line: str) -> None:
    print("kilauea: error: " + " ".join(line.split()), file=sys.stderr)


def _version() -> str:
    from importlib import metadata

    try:
        return metadata.version("kilauea")
    except metadata.PackageNotFoundError:
        return "(not installed)"


if __name__ == "__main__":
    sys.exit(main())
