"""`kilauea bench error`: error at equal time, over times (or sample counts) and seeds."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import Any

from kilauea.benchmarks import error_tables, kept, plot, strips
from kilauea.benchmarks.converged import Effort, converged
from kilauea.benchmarks.engines import render
from kilauea.benchmarks.job import Job, name_of
from kilauea.benchmarks.measurement import Measurement
from kilauea.benchmarks.options import add_engine_options, engine_names, settings_of
from kilauea.benchmarks.pace import CLOCKS, Pace, pilot
from kilauea.benchmarks.reference import find_references
from kilauea.benchmarks.report import machine, print_table, write_json
from kilauea.benchmarks.summary import summarise
from kilauea.errors import KilaueaError, UsageError

PILOT_SEED = 20_001


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the subcommand's options."""
    add_engine_options(parser, engines=("kilauea", "path", "cycles", "mitsuba", "luxcore"))
    parser.add_argument(
        "--witnesses",
        type=engine_names,
        default=[],
        metavar="NAME,NAME",
        help="further engines for the reference, which are not measured",
    )
    parser.add_argument("-c", "--camera", metavar="PRIM", help="of all stages, or its name")
    parser.add_argument("-w", "--width", type=int, help="the height follows from the camera")
    parser.add_argument(
        "--times",
        type=_positive_numbers,
        default=[2.0, 5.0, 10.0, 30.0],
        metavar="S,S",
        help="seconds of the whole command, load included",
    )
    parser.add_argument(
        "--clock", choices=CLOCKS, default="wall", help="of --times; cpu where others work too"
    )
    parser.add_argument(
        "-p", "--pixel-samples", type=_positive_numbers, metavar="N,N", help="instead of times"
    )
    parser.add_argument("--seeds", type=int, default=8, help="renders at each time")
    parser.add_argument("--reference-time", type=float, default=60.0, metavar="S")
    parser.add_argument("--reference-seeds", type=int, default=8, metavar="N")
    parser.add_argument(
        "--clay", action="store_true", help="without materials, which engines model differently"
    )
    parser.add_argument(
        "--keep", action="store_true", help="keep what the file of --json has of other stages"
    )
    parser.add_argument("--plot", type=Path, metavar="STEM", help="writes STEM.svg and STEM.png")
    parser.add_argument("--table", type=Path, metavar="FILE.md", help="writes a Markdown table")
    parser.add_argument(
        "--pictures", type=Path, metavar="FOLDER", help="writes the engines side by side"
    )


def run(args: argparse.Namespace) -> int:
    """Measure, print and write."""
    if min(args.seeds, args.reference_seeds) < 2:
        raise UsageError("variance needs at least two seeds")
    earlier_rows, earlier_stages = kept.read(args.json if args.keep else None)
    rows: list[dict[str, Any]] = []
    stages: list[dict[str, Any]] = []
    for stage in args.stages:
        with tempfile.TemporaryDirectory(prefix="kilauea-") as folder:
            try:
                found, about = measure_stage(stage, Path(folder) / "job", args)
            except KilaueaError as error:
                print(f"kilauea: {stage}: {error}", file=sys.stderr)
                name = name_of(stage, args.camera)
                found, about = [], {"stage": name, "skipped": {"all": str(error)}}
        rows += found
        stages.append(about | {"machine": machine()})
        # Written after each stage: a run may take hours.
        all_rows = kept.with_measured(earlier_rows, rows)
        all_stages = kept.with_measured(earlier_stages, stages)
        write_json(args.json, all_rows, stages=all_stages, summary=summarise(all_rows))
    report(rows, args)
    return 0 if rows else 1


def measure_stage(
    stage: str, folder: Path, args: argparse.Namespace
) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Measure all engines at one stage; returns rows and what is to be said of the stage."""
    job = Job.prepare(
        stage,
        folder,
        settings_of(args),
        image_width=args.width,
        materials=not args.clay,
        camera=args.camera,
    )
    names = list(dict.fromkeys([*args.engines, *args.witnesses]))
    paces, skipped, notes = find_paces(job, names, args.clock)
    effort = Effort(args.reference_time, args.reference_seeds)
    references = find_references(
        list(paces), lambda engine: converged(job, engine, paces[engine], effort)
    )
    measured = {engine: pace for engine, pace in paces.items() if engine in args.engines}
    measurement = Measurement(job, references, measured, skipped)
    if args.pixel_samples:
        measurement.take_counts([round(count) for count in args.pixel_samples], args.seeds)
    else:
        measurement.take_times(args.times, args.seeds)
    if args.pictures:
        strips.write(args.pictures / f"{job.name}.jpg", references, measurement.last_images())
    about = {
        "stage": job.name,
        "resolution": job.settings["resolution"],
        "max_depth": job.settings["max_depth"],
        "materials": not args.clay,
        "clock": args.clock,
        "skipped": skipped,
        "notes": notes,
        "unreached": measurement.unreached,
        "reference": references.record(),
    }
    return measurement.rows, about


def find_paces(
    job: Job, names: list[str], clock: str
) -> tuple[dict[str, Pace], dict[str, str], dict[str, list[str]]]:
    """Try each engine: the pace of those that can render the job, reasons for the others."""
    paces: dict[str, Pace] = {}
    skipped: dict[str, str] = {}
    notes: dict[str, list[str]] = {}
    for engine in names:
        try:
            paces[engine], run = pilot(
                lambda samples, engine=engine: render(engine, job, samples, PILOT_SEED), clock
            )
        except KilaueaError as error:
            skipped[engine] = str(error)
            print(f"kilauea: {job.name}: {engine}: {error}", file=sys.stderr)
            continue
        if run.warnings:
            notes[engine] = run.warnings
    return paces, skipped, notes


def report(rows: list[dict[str, Any]], args: argparse.Namespace) -> None:
    """Print the summary and write what else was asked for."""
    summary = summarise(rows)
    print_table(summary)
    if args.table:
        args.table.write_text(error_tables.comparison({"summary": summary}), encoding="utf-8")
    if args.plot and rows:
        plot.write(rows, args.plot)


def _positive_numbers(text: str) -> list[float]:
    values = sorted(float(word) for word in text.split(","))
    if not values or values[0] <= 0.0:
        raise argparse.ArgumentTypeError(f"{text} are not numbers above zero")
    return values
