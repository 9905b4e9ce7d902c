"""`kilauea bench shading`: what the dataflow engine costs, against a plain loop over the samples.

Ways of answering the questions of shades take turns at short frames of one scene in one process, so
that what else the machine does hits all of them alike.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from statistics import median
from typing import Any

from kilauea import interrupt
from kilauea.benchmarks.report import print_table, write_json
from kilauea.errors import KilaueaError
from kilauea.render import DEFAULTS, native

WAYS = ("plain", "inline", "queued", "bytes")
"""`plain` is the loop without the engine; the others are values of `--shading`."""

_WAIT_SECS = 3600.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the subcommand's options."""
    parser.add_argument("stages", nargs="+", metavar="STAGE")
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=list(WAYS))
    parser.add_argument("-r", "--res", nargs=2, type=int, default=[64, 64], metavar=("W", "H"))
    parser.add_argument("-p", "--pixel-samples", type=int, default=16, metavar="SAMPLES")
    parser.add_argument("--max-depth", type=int, default=16, metavar="BOUNCES")
    parser.add_argument("-j", "--threads", nargs="+", type=int, default=[1], metavar="N")
    parser.add_argument("--rounds", type=int, default=20, help="frames of each way")
    parser.add_argument("--shade-memory", type=int, nargs="+", default=[64], metavar="MIB")
    parser.add_argument("--answer-delay", type=float, default=0.0, metavar="MS", help="at most")
    parser.add_argument(
        "--first-come", action="store_true", help="queued: without the rule that bounds memory"
    )
    parser.add_argument(
        "--apart",
        action="store_true",
        help="instead of N threads at a frame, one thread each at N frames of N copies of the "
        "scene: what the machine gains from N threads that share nothing",
    )
    parser.add_argument("--json", metavar="FILE", help="machine and rows")


@dataclass(frozen=True, slots=True)
class Way:
    """One way to render the frames of a stage."""

    name: str
    threads: int
    memory_mib: int

    def settings(self) -> dict[str, Any]:
        """Return its fields of `RenderSettings`."""
        shading = "inline" if self.name == "plain" else self.name
        memory = self.memory_mib << 20
        return {"shading": shading, "threads": self.threads, "shade_memory_bytes": memory}

    def plain(self) -> Way:
        """Return what it is compared with."""
        return Way("plain", self.threads, self.memory_mib)


@dataclass(slots=True)
class Turns:
    """What the frames of one way took, in the order of the rounds; times are ns a ray."""

    cpu: list[float] = field(default_factory=list)
    wall: list[float] = field(default_factory=list)
    n_rays: int = 0
    """Of a round."""
    stats: dict[str, Any] = field(default_factory=dict)
    """Of the last frame."""


@dataclass(frozen=True, slots=True)
class Subject:
    """A stage, built as often as frames are rendered at once."""

    name: str
    scenes: list[Any]
    settings: dict[str, Any]
    conditions: dict[str, Any]

    @classmethod
    def load(cls, stage: str, args: argparse.Namespace) -> Subject:
        """Flatten and build a stage."""
        from kilauea.usd.options import FlattenOptions
        from kilauea.usd.stage import flatten

        frame = flatten(stage, FlattenOptions(resolution=tuple(args.res)))
        build = json.dumps({"resolution": args.res})
        n_scenes = max(args.threads) if args.apart else 1
        settings = DEFAULTS | frame.settings
        settings |= {"resolution": args.res, "samples_per_pixel": args.pixel_samples}
        settings |= {"max_depth": args.max_depth, "filter": "box"}
        conditions = {"first_come": args.first_come, "answer_delay_ms": args.answer_delay}
        scenes = [native().build_scene(frame, build) for _ in range(n_scenes)]
        return cls(Path(stage).name, scenes, settings, conditions)

    def turn(self, way: Way, *, apart: bool, turns: Turns) -> None:
        """Render one frame, or one for each thread, and note what it took."""
        scenes = self.scenes[: way.threads] if apart else self.scenes[:1]
        threads = {"threads": 1} if apart else {}
        settings = json.dumps(self.settings | way.settings() | threads)
        conditions = json.dumps(self.conditions | {"plain_loop": way.name == "plain"})
        metadata = json.dumps({"stage": self.name, "frame": 0.0, "camera": ""})
        cpu, wall = time.process_time(), time.perf_counter()
        jobs = [scene.render(settings, metadata, conditions) for scene in scenes]
        for job in jobs:
            job.wait(_WAIT_SECS)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        stats = [json.loads(job.finish([])) for job in jobs]
        n_rays = sum(sum(one["rays"].values()) for one in stats)
        turns.cpu.append(1e9 * cpu / n_rays)
        turns.wall.append(1e9 * wall / n_rays)
        turns.n_rays = n_rays
        turns.stats = stats[0]


def run(args: argparse.Namespace) -> int:
    """Measure, print and write."""
    rows: list[dict[str, Any]] = []
    for stage in args.stages:
        try:
            rows += interrupt.run(
                lambda stage=stage: list(measure(Subject.load(stage, args), args))
            )
        except (native().RenderError, native().SceneError) as error:
            raise KilaueaError(f"{stage}: {error}") from None
        write_json(args.json, rows)
    print_table(rows)
    return 0


def measure(subject: Subject, args: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """Let the ways take turns, and give each a row."""
    ways = [Way(*way) for way in product(args.ways, args.threads, args.shade_memory)]
    turns = {way: Turns() for way in ways}
    for _ in range(args.rounds):
        for way in ways:
            subject.turn(way, apart=args.apart, turns=turns[way])
    for way in ways:
        yield row(subject, way, turns)


def row(subject: Subject, way: Way, turns: dict[Way, Turns]) -> dict[str, Any]:
    """Summarise the turns of a way: the least time, and the median of the ratios by round."""
    ours = turns[way]
    plain = turns.get(way.plain())
    alone = turns.get(Way(way.name, 1, way.memory_mib))
    shades, peak = ours.stats["shades"], ours.stats["memory"]["shades_in_flight_peak"]
    return {
        "stage": subject.name,
        "way": way.name,
        "threads": way.threads,
        "memory_mib": way.memory_mib,
        "rays": ours.n_rays,
        "rounds": len(ours.cpu),
        "cpu_ns": min(ours.cpu),
        "/plain": plain and min(ours.cpu) / min(plain.cpu),
        "median": plain and median_ratio(ours.cpu, plain.cpu),
        "wall_ns": min(ours.wall),
        "speedup": alone and min(alone.wall) / min(ours.wall),
        "median_speedup": alone and median_ratio(alone.wall, ours.wall),
        "peak_bytes": peak,
        "bytes/question": peak / shades["questions_at_peak"] if peak else None,
        "bytes/shade": peak / shades["in_flight_peak"] if peak else None,
        "busy": shades["busy"] if peak else None,
    }


def median_ratio(ours: list[float], theirs: list[float]) -> float:
    """Return the median over rounds of the ratio of two times."""
    return median(a / b for a, b in zip(ours, theirs, strict=True))
