"""`kilauea bench workers`: frames of N processes beside that of one, with their pixels."""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import tempfile
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from kilauea.benchmarks.layers import read_layers
from kilauea.benchmarks.report import print_table, write_json
from kilauea.child import Finished, run_apart
from kilauea.errors import KilaueaError, UsageError

_TIMES = ("photon", "gather", "render")
_LINKS = ("tcp", "tls", "channels", "ray")
_DIGITS = 12
"""Of a digest of pixels."""


@dataclass(slots=True)
class Variant:
    """One way of sharing a frame out, and the frames that were rendered that way."""

    workers: int
    """0 is this process alone."""
    set_size: int = 1
    broadcast: str = "culled"
    links: str = "tcp"
    commands: list[Finished] = field(default_factory=list)
    stats: list[dict[str, Any]] = field(default_factory=list)
    is_same: bool = True
    """Whether all pixels of all layers are those of one process."""
    pixels: str = ""
    """A digest of them."""

    def flags(self, cluster: str | None) -> list[str]:
        """Return what `kilauea render` is told; `cluster` is the address of a Ray cluster."""
        if not self.workers:
            return []
        flags = ["--workers", str(self.workers), "--links", self.links]
        if self.links == "ray":
            flags = ["--cluster", str(cluster)]
        if self.set_size > 1:
            flags += ["--set-size", str(self.set_size), "--broadcast", self.broadcast]
        return flags


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the subcommand's options."""
    parser.add_argument("stages", nargs="+", metavar="STAGE")
    parser.add_argument("--workers", nargs="+", type=int, default=[1, 2], metavar="N")
    parser.add_argument(
        "--set-size", nargs="+", type=int, default=[1], metavar="M", help="1 is the whole scene"
    )
    parser.add_argument(
        "--broadcast", nargs="+", choices=("culled", "full"), default=["culled"], help="of sets"
    )
    parser.add_argument("--links", nargs="+", choices=_LINKS, default=["tcp"], help="between them")
    parser.add_argument(
        "--cluster", metavar="ADDRESS", help="for the links ray: N machines of a Ray cluster"
    )
    parser.add_argument("--integrator", nargs="+", default=["path"], metavar="NAME")
    parser.add_argument("-r", "--res", nargs=2, type=int, default=[256, 144], metavar=("W", "H"))
    parser.add_argument("-p", "--pixel-samples", type=int, default=16, metavar="SAMPLES")
    parser.add_argument("-j", "--threads", type=int, default=1, help="of each process")
    parser.add_argument("--rounds", type=int, default=3, help="of all ways, in turns")
    parser.add_argument("--json", metavar="FILE", help="machine and rows")


def run(args: argparse.Namespace) -> int:
    """Measure, print and write; 1 where a pixel differs."""
    rows: list[dict[str, Any]] = []
    for stage in args.stages:
        for integrator in args.integrator:
            rows += measure(stage, integrator, args)
            # After each, so that a long run that is interrupted leaves what it has.
            write_json(args.json, rows)
    print_table(rows)
    return 0 if all(row["same_pixels"] for row in rows) else 1


def variants(args: argparse.Namespace) -> list[Variant]:
    """Return all ways that are asked for, one process first.

    Raises
    ------
    UsageError
        No number of workers can be divided into sets of a size, or there is no cluster for links.
    """
    if ("ray" in args.links) != (args.cluster is not None):
        raise UsageError("the links ray are those of a --cluster")
    found = [Variant(0)]
    for size in args.set_size:
        numbers = [n for n in args.workers if n % size == 0]
        if not numbers:
            raise UsageError(f"no number of --workers can be divided into sets of {size}")
        rules = args.broadcast if size > 1 else ["culled"]
        found += [Variant(*way) for way in product(numbers, [size], rules, args.links)]
    return found


def measure(stage: str, integrator: str, args: argparse.Namespace) -> list[dict[str, Any]]:
    """Let all ways take turns, so that what else the machine does hits all of them."""
    found = variants(args)
    for _ in range(args.rounds):
        expected: Any = None
        for variant in found:
            pixels = render(stage, integrator, variant, args)
            variant.pixels = digest(pixels)
            expected = pixels if expected is None else expected
            variant.is_same &= np.array_equal(pixels, expected, equal_nan=True)
        print(f"kilauea: {stage}: {integrator}: a round of {len(found)}", file=sys.stderr)
    alone = found[0]
    return [row(Path(stage).stem, integrator, variant, alone) for variant in found]


def render(stage: str, integrator: str, variant: Variant, args: argparse.Namespace) -> Any:
    """Render a frame by a command of its own, keep what it cost, and return all its layers."""
    with tempfile.TemporaryDirectory(prefix="kilauea-") as folder:
        flags = variant.flags(args.cluster)
        image, stats = Path(folder) / "image.exr", Path(folder) / "stats.json"
        words = [sys.executable, "-m", "kilauea.cli", "render", stage, "-o", image, "-V", "0"]
        words += ["-r", *args.res, "-p", args.pixel_samples, "-j", args.threads]
        words += ["--integrator", integrator, "--stats", stats, *flags]
        what = " ".join(["render", *flags])
        variant.commands.append(run_apart([str(word) for word in words], what))
        told = json.loads(stats.read_text())
        variant.stats.append(told)
        # One that was started again is there twice.
        n_workers = len({worker["rank"] for worker in told["workers"]})
        if n_workers != variant.workers:
            raise KilaueaError(f"{what}: {n_workers} workers, not {variant.workers}")
        return read_layers(image)


def digest(pixels: np.ndarray) -> str:
    """Return a digest of all layers, every bit of them."""
    return hashlib.sha256(np.ascontiguousarray(pixels).tobytes()).hexdigest()[:_DIGITS]


def row(stage: str, integrator: str, variant: Variant, alone: Variant) -> dict[str, Any]:
    """Tell the fastest frame of a way, and how it compares with one process of one thread."""
    fastest = min(range(len(variant.commands)), key=lambda i: variant.commands[i].wall_s)
    stats = variant.stats[fastest]
    cpu_s = min(command.cpu_s for command in variant.commands)
    render_s = rendering_s(variant)
    peaks = [worker["peak_rss"] for worker in stats["workers"]]
    links = [worker["seat"]["links"] for worker in stats["workers"] if worker["seat"]]
    between = sum(link["bytes_sent"] for link in links)
    return {
        "stage": stage,
        "integrator": integrator,
        "workers": variant.workers,
        "set": variant.set_size,
        "broadcast": variant.broadcast if variant.set_size > 1 else None,
        "links": variant.links if variant.workers else None,
        "same_pixels": variant.is_same,
        "pixels": variant.pixels,
        "seconds": variant.commands[fastest].wall_s,
        **{f"{name}_s": stats["times"].get(name, 0.0) for name in _TIMES},
        "speedup": rendering_s(alone) / render_s,
        "cpu_s": cpu_s,
        "cpu_ratio": cpu_s / min(command.cpu_s for command in alone.commands),
        "peak_rss": max([*peaks, 0]) or stats["memory"]["peak_rss"],
        "bytes_a_ray": between / sum(stats["rays"].values()) if links else None,
    }


def rendering_s(variant: Variant) -> float:
    """Return seconds of the passes of the fastest frame, without reading and writing."""
    return min(sum(stats["times"].get(name, 0.0) for name in _TIMES) for stats in variant.stats)
