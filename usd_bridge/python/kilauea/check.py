"""`kilauea check`: holds a stage against Cycles, or against an image, and gives a verdict."""

from __future__ import annotations

import argparse
import dataclasses
import json
import platform
import shlex
import sys
import time
from importlib import metadata
from pathlib import Path
from typing import Any

from kilauea import interrupt, request
from kilauea.arguments import ArgumentParser, add_stage_options, positive, subdivision_level
from kilauea.benchmarks.report import machine
from kilauea.checking.criteria import NAMES, parse_criteria
from kilauea.checking.errors import CannotCheckError
from kilauea.checking.images import Batches
from kilauea.checking.judge import Verdict
from kilauea.checking.plan import Budget
from kilauea.checking.report.folder import check_replaceable, write_report
from kilauea.checking.report.record import Subject, as_record
from kilauea.checking.run import Outcome, run_check
from kilauea.checking.sources import CyclesSource, KilaueaSource, Source, StoredSource
from kilauea.checking.stored import SETTINGS, Reference, read_reference, write_reference
from kilauea.environments import CYCLES
from kilauea.errors import KilaueaError, UsageError
from kilauea.output import check_writable, write_text
from kilauea.payload import Frame
from kilauea.render import DEFAULTS, RenderOptions

MIN_BATCHES = 4
"""Fewer tell too little about their own spread."""
_CYCLES = "cycles"


def add_arguments(parser: ArgumentParser) -> None:
    """Add the command's options."""
    add_stage_options(parser)
    add = parser.add
    add("--against", default=_CYCLES, metavar="cycles|FILE.exr", help="the reference; cycles")
    add(
        "--threshold",
        nargs="+",
        action="extend",
        metavar="NAME=VALUE",
        help=f"what counts as a difference: {', '.join(NAMES)}",
    )
    add("--report", metavar="DIR", help="page, JSON, JUnit XML and images")
    add("--json", metavar="FILE", help="the JSON of the report alone")
    add("--write-reference", metavar="FILE.exr", help="keep the reference for a later --against")
    add("--make-output-path", action="store_true", help="create missing folders")
    add("-p", "--pixel-samples", type=positive, metavar="SAMPLES", help="so many, not as needed")
    add("--max-samples", type=positive, default=Budget().last, metavar="SAMPLES", help="at most")
    add("--batches", type=positive, default=Budget().batches, help="renders with their own seeds")
    add("--tile", type=positive, metavar="PIXELS", help="edge of the tiles")
    add("--seed", type=int, default=1, help="of the first batch")
    add("--max-depth", type=positive, metavar="BOUNCES", help="16 by default")
    add("--filter", choices=("box", "gaussian", "blackman-harris"), help="box by default")
    add("--filter-radius", type=float, metavar="PIXELS")
    add("-j", "--threads", type=int, default=0, help="0 all cores, -1 all but one")
    add("--texture-memory", type=positive, metavar="MIB", help="1024 by default")


def main(args: argparse.Namespace) -> int:
    """Run the command: 0 for a pass, 1 for anything else that was found out."""
    try:
        outcome = _check(args)
    except KilaueaError as error:
        if error.exit_code != 1:
            raise
        # A script must be able to tell a difference from a check that could not be made.
        raise CannotCheckError(str(error)) from None
    return 0 if outcome.verdict is Verdict.PASS else 1


def _check(args: argparse.Namespace) -> Outcome:
    started = time.monotonic()
    criteria = parse_criteria(args.threshold or ())
    verbosity, _ = request.verbosity(args.verbose)
    budget = _budget(args)
    _check_outputs(args)
    stored = None if args.against == _CYCLES else read_reference(Path(args.against))
    if stored is None:
        CYCLES.python()
    frame = _frame(args, stored, verbosity)
    options = RenderOptions([], _settings(args, stored), subdivision_level(args.complexity))

    def say(line: str) -> None:
        if verbosity >= 2:
            print(f"kilauea: {line}", file=sys.stderr, flush=True)

    outcome = run_check(
        KilaueaSource(frame, options),
        _reference_source(frame, options, stored),
        criteria,
        budget,
        tile=args.tile,
        first_seed=args.seed,
        say=say,
    )
    settings = {**DEFAULTS, **frame.settings, **options.settings}
    subject = _subject(frame, outcome, settings, stored)
    if args.report:
        write_report(Path(args.report), outcome, subject, time.monotonic() - started)
    if args.json:
        write_text(Path(args.json), json.dumps(as_record(outcome, subject), indent=1) + "\n")
    if args.write_reference:
        header = {name: settings[name] for name in SETTINGS} | {"stage": frame.stage}
        _keep_reference(Path(args.write_reference), outcome, header)
    if verbosity >= 1:
        _print(outcome, frame)
    return outcome


def _budget(args: argparse.Namespace) -> Budget:
    if args.batches < MIN_BATCHES:
        raise UsageError(f"--batches {args.batches}: at least {MIN_BATCHES} are needed")
    last = args.pixel_samples or args.max_samples
    if last < args.batches:
        raise UsageError(f"{last} samples per pixel do not suffice for {args.batches} batches")
    # A given number is no limit: a quarter of it first, and then all.
    first = last // 4 if args.pixel_samples else min(Budget().first, last)
    return Budget(args.batches, first, last, is_fixed=args.pixel_samples is not None)


def _check_outputs(args: argparse.Namespace) -> None:
    check_writable([f for f in (args.json, args.write_reference) if f], args.make_output_path)
    if args.write_reference and Path(args.write_reference).suffix.lower() != ".exr":
        raise UsageError(f"{args.write_reference}: references are written as .exr")
    if args.write_reference and args.against != _CYCLES:
        raise UsageError("--write-reference keeps what Cycles renders: it needs --against cycles")
    if args.report:
        check_replaceable(Path(args.report), args.make_output_path)


def _frame(args: argparse.Namespace, stored: Reference | None, verbosity: int) -> Frame:
    """Flatten the one frame, at the resolution of a stored reference."""
    stage = request.open_stage(args)
    times = request.frames(args, stage.start_time)
    if len(times) != 1:
        raise UsageError(f"check takes one frame, not {len(times)}")
    options = dataclasses.replace(request.flatten_options(args), time=times[0])
    if stored and options.resolution is None and options.image_width is None:
        options = dataclasses.replace(options, resolution=tuple(stored.settings["resolution"]))
    frame = interrupt.run(lambda: stage.flatten(options))
    request.report(frame, args.strict, verbosity)
    width, height = (DEFAULTS | frame.settings)["resolution"]
    if stored and [width, height] != stored.settings["resolution"]:
        raise CannotCheckError(
            f"{args.against} has a resolution of {_size(stored.settings['resolution'])}, "
            f"which is not {width}x{height}"
        )
    return frame


def _settings(args: argparse.Namespace, stored: Reference | None) -> dict[str, Any]:
    """Return what stands over the stage's settings: the reference's, as far as it tells them.

    Raises
    ------
    CannotCheckError
        The command line asks for something else than the reference has.
    """
    asked = {
        "filter": args.filter,
        "filter_radius": args.filter_radius,
        "max_depth": args.max_depth,
    }
    asked = {name: value for name, value in asked.items() if value is not None}
    known = dict(stored.settings) if stored else {}
    known.pop("resolution", None)
    for name, value in asked.items():
        if known.get(name, value) != value:
            raise CannotCheckError(
                f"{args.against} was made with {name.replace('_', ' ')} {known[name]}, "
                f"which is not {value}"
            )
    settings = {"filter": "box", **known, **asked, "threads": request.n_threads(args.threads)}
    if args.texture_memory is not None:
        settings["texture_memory_bytes"] = args.texture_memory << 20
    return settings


def _size(resolution: list[int]) -> str:
    return "x".join(map(str, resolution))


def _reference_source(frame: Frame, options: RenderOptions, stored: Reference | None) -> Source:
    return CyclesSource(frame, options) if stored is None else StoredSource(stored.image)


def _subject(
    frame: Frame, outcome: Outcome, settings: dict[str, Any], stored: Reference | None
) -> Subject:
    faults = [*(f"missing: {m}" for m in frame.missing), *frame.warnings, *frame.notes]
    return Subject(
        stage=frame.stage,
        frame=frame.time,
        command=shlex.join(["kilauea", *sys.argv[1:]]),
        settings={name: settings[name] for name in SETTINGS if settings.get(name) is not None},
        versions={
            "ours": outcome.light.ours.engine,
            "reference": outcome.light.reference.engine,
            "usd-core": metadata.version("usd-core"),
            "python": platform.python_version(),
        },
        machine=machine(),
        date=time.strftime("%Y-%m-%dT%H:%M:%S%z"),
        notes=(*faults, *(stored.notes if stored else ())),
    )


def _keep_reference(file: Path, outcome: Outcome, header: dict[str, Any]) -> None:
    reference = outcome.light.reference
    if isinstance(reference, Batches):
        write_reference(file, reference, reference.n, header)


def _print(outcome: Outcome, frame: Frame) -> None:
    for finding in outcome.findings:
        print(f"{finding.verdict.value:12}  {finding.title}: {finding.summary}")
    print(f"{outcome.verdict.value:12}  {frame.stage}", flush=True)
