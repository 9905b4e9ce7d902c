"""`kilauea bench sets`: a scene spread over the members of a set, against the whole of it.

Frames of the whole scene and of sets of several sizes take turns in one process. Each set is asked
in batches as bytes, plain and packed, so that all that would cross a network is counted.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from kilauea import interrupt
from kilauea.benchmarks.layers import read_layers
from kilauea.benchmarks.report import print_table, write_json
from kilauea.errors import KilaueaError
from kilauea.output import write_text
from kilauea.render import DEFAULTS, native

_WAIT_SECS = 3600.0
WHOLE = ("inline", "queued")
"""Ways of rendering the whole scene that sets are compared with."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the subcommand's options."""
    parser.add_argument("stages", nargs="+", metavar="STAGE")
    parser.add_argument(
        "--members", nargs="+", type=int, default=[2, 3, 5, 8], metavar="M", help="sizes of sets"
    )
    parser.add_argument("-r", "--res", nargs=2, type=int, default=[128, 72], metavar=("W", "H"))
    parser.add_argument("-p", "--pixel-samples", type=int, default=4, metavar="SAMPLES")
    parser.add_argument("--max-depth", type=int, default=8, metavar="BOUNCES")
    parser.add_argument("--chunk", type=int, default=65536, help="most triangles of a chunk")
    parser.add_argument("--rounds", type=int, default=3, help="frames; the best of these counts")
    parser.add_argument("--broadcast", choices=("culled", "full"), default="culled")
    parser.add_argument(
        "--trace", metavar="FILE", help="rays for the simulation, of the first stage"
    )
    parser.add_argument("--json", metavar="FILE", help="machine and rows")


@dataclass(slots=True)
class Way:
    """One way of rendering a stage."""

    scene: Any
    settings: dict[str, Any]
    conditions: dict[str, Any]
    cpu: list[float] = field(default_factory=list)
    stats: dict[str, Any] = field(default_factory=dict)
    pixels: Any = None


def run(args: argparse.Namespace) -> int:
    """Measure, print and write; 1 where a set changes a picture."""
    rows: list[dict[str, Any]] = []
    for stage in args.stages:
        try:
            rows += interrupt.run(lambda stage=stage: measure(stage, args))
        except (native().RenderError, native().SceneError) as error:
            raise KilaueaError(f"{stage}: {error}") from None
        write_json(args.json, rows)
    print_table(rows)
    return 0 if all(row["same_pixels"] for row in rows) else 1


def measure(stage: str, args: argparse.Namespace) -> list[dict[str, Any]]:
    """Let the whole scene and all sets take turns, and give each set a row."""
    from kilauea.usd.options import FlattenOptions
    from kilauea.usd.stage import flatten

    frame = flatten(stage, FlattenOptions(resolution=tuple(args.res)))
    build = {"resolution": args.res, "max_chunk_triangles": args.chunk}
    whole = native().build_scene(frame, json.dumps(build))
    settings = DEFAULTS | frame.settings | {"resolution": args.res, "threads": 1}
    settings |= {"samples_per_pixel": args.pixel_samples, "max_depth": args.max_depth}
    settings |= {"filter": "box"}

    ways: dict[Any, Way] = {
        shading: Way(whole, settings | {"shading": shading}, {}) for shading in WHOLE
    }
    for n in args.members:
        scene = whole.spread(n)
        asked = {"broadcast": args.broadcast}
        ways[n, "values"] = Way(scene, settings | {"shading": "queued"}, asked)
        for packing in ("plain", "lz4"):
            conditions = asked | {"packing": packing}
            ways[n, packing] = Way(scene, settings | {"shading": "bytes"}, conditions)
    for _ in range(args.rounds):
        for way in ways.values():
            render(way)
    if args.trace and stage == args.stages[0]:
        write_trace(Path(args.trace), ways[args.members[-1], "plain"])
    name = Path(stage).name
    return [row(name, n, ways) for n in args.members]


def render(way: Way) -> None:
    """Render one frame, and note what it took."""
    metadata = json.dumps({"stage": "", "frame": 0.0, "camera": ""})
    with tempfile.TemporaryDirectory(prefix="kilauea-") as folder:
        image = Path(folder) / "image.exr"
        cpu = time.process_time()
        job = way.scene.render(json.dumps(way.settings), metadata, json.dumps(way.conditions))
        job.wait(_WAIT_SECS)
        way.cpu.append(time.process_time() - cpu)
        way.stats = json.loads(job.finish([str(image)]))
        way.pixels = read_layers(image)


def row(stage: str, n_members: int, ways: dict[Any, Way]) -> dict[str, Any]:
    """Compare a set with the whole scene."""
    whole = ways["inline"]
    values, plain, lz4 = (ways[n_members, way] for way in ("values", "plain", "lz4"))
    memory = whole.stats["memory"]
    n_bytes = memory["scene"] + memory["accel"]
    members = plain.stats["set"]["members"]
    asked = [member["asked"] for member in members]
    held = [member["bytes"]["scene"] + member["bytes"]["accel"] for member in members]
    cells: dict[str, Any] = {
        "stage": stage,
        "members": n_members,
        "chunks": whole.stats["scene"]["chunks"],
        "same_pixels": all(
            np.array_equal(way.pixels, whole.pixels, equal_nan=True)
            for way in (ways["queued"], values, plain, lz4)
        ),
        "memory": max(held) / n_bytes,
        "balance": max(asked) * n_members / max(sum(asked), 1),
        "cpu/inline": min(values.cpu) / min(whole.cpu),
        "cpu/queued": min(values.cpu) / min(ways["queued"].cpu),
        "bytes_cpu/inline": min(plain.cpu) / min(whole.cpu),
        "lz4_cpu/inline": min(lz4.cpu) / min(whole.cpu),
    }
    packed = {rays["kind"]: rays for rays in lz4.stats["set"]["rays"]}
    for rays in plain.stats["set"]["rays"]:
        kind, n_rays = rays["kind"], max(rays["rays"], 1)
        cells[f"{kind}_asked"] = rays["asked"] / n_rays
        cells[f"{kind}_met"] = rays["met"] / n_rays
        for name, one in (("", rays), ("_lz4", packed[kind])):
            cells[f"{kind}_to{name}"] = one["bytes_to_members"] / n_rays
            cells[f"{kind}_from{name}"] = one["bytes_from_members"] / n_rays
    return cells


def write_trace(path: Path, way: Way) -> None:
    """Render once more and write a sample of the rays, for `kilauea-sim`."""
    n_rays = sum(rays["rays"] for rays in way.stats["set"]["rays"])
    way.conditions = way.conditions | {"sample_one_in": max(n_rays // 50_000, 1)}
    render(way)
    found = way.stats["set"]
    shares: dict[str, float] = defaultdict(float)
    for rays in found["rays"]:
        shares[rays["kind"]] = rays["met"] / max(rays["asked"], 1)
    trace = {"rays": found["samples"], "box_bytes": found["box_bytes"], "met_share": shares}
    write_text(path, json.dumps(trace) + "\n")
