"""`kilauea bench needs`: what each piece of work that a stage can do without would have cost."""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from kilauea import interrupt
from kilauea.benchmarks.layers import read_layers
from kilauea.benchmarks.report import print_table, write_json
from kilauea.errors import KilaueaError
from kilauea.payload import Frame
from kilauea.render import MAX_CHUNK_TRIANGLES, RenderOptions, native, settings_record

STAGES = (
    "01_cornell/usdpreviewsurface/cornell-box.usda",
    "02_kitchen/kitchen_day.usda",
    "05_chess/chess_outdoor.usda",
    "06_carkit/carpark_2500.usda",
    "09_curves/hair_straight.usda",
    "16_caustic/caustic_dice.usdc",
)
"""Measured by default where `KILAUEA_ASSETS` has them."""

RAYS = "instances, motion, curves, points, masks: walks"
"""The walks of the trees are one skip, chosen when they are built."""

_IN_WALKS = ("instances", "curves", "points", "masks")
"""Features that nothing but the walks asks for."""


@dataclass(slots=True)
class Variant:
    """One way of rendering a stage."""

    render: Callable[[], tuple[dict[str, Any], Any]]
    """Renders once: statistics and pixels."""
    seconds: list[tuple[float, float]] = field(default_factory=list)
    """Of frames with every skip, and of those rendered this way right after them."""
    saved_bytes: int = 0
    is_same: bool = True


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the subcommand's options."""
    parser.add_argument(
        "stages", nargs="*", metavar="STAGE", help="else representative ones of KILAUEA_ASSETS"
    )
    parser.add_argument("-r", "--res", nargs=2, type=int, default=[160, 90], metavar=("W", "H"))
    parser.add_argument("-p", "--pixel-samples", type=int, default=16, metavar="SAMPLES")
    parser.add_argument("-j", "--threads", type=int, default=1, help="0 is all cores")
    parser.add_argument("--rounds", type=int, default=5, help="pairs of frames for each skip")
    parser.add_argument("--json", metavar="FILE", help="machine and rows")


def run(args: argparse.Namespace) -> int:
    """Measure, print and write; 1 where a skip changes a picture."""
    rows: list[dict[str, Any]] = []
    for stage in args.stages or default_stages():
        try:
            rows += measure(stage, args)
        except KilaueaError as error:
            print(f"kilauea: {stage}: {error}", file=sys.stderr)
        # After every stage, so that a long run that is interrupted leaves what it has.
        write_json(args.json, rows)
    print_table(rows)
    return 0 if rows and all(row["same_pixels"] for row in rows) else 1


def default_stages() -> list[str]:
    """Return the representative stages that are there."""
    assets = os.environ.get("KILAUEA_ASSETS")
    stages = [Path(assets) / stage for stage in STAGES] if assets else []
    return [str(stage) for stage in stages if stage.is_file()]


def measure(stage: str, args: argparse.Namespace) -> list[dict[str, Any]]:
    """Render in pairs, with every skip and without one, so that what else the machine does and
    how fast it runs are alike for both.
    """  # noqa: D205
    from kilauea.usd.options import FlattenOptions
    from kilauea.usd.stage import flatten

    frame = flatten(stage, FlattenOptions(resolution=tuple(args.res)))
    settings = {
        "samples_per_pixel": args.pixel_samples,
        "threads": args.threads,
        # What `kilauea` learns is no part of the scene: it makes another, equally good image.
        "integrator": "path",
    }
    special = build(frame, args, specialize_rays=True)
    render_special = partial(render, frame, special, settings)
    stats, expected = render_special()

    variants: dict[str, Variant] = {}
    for name in (n for n in stats["skipped"] if n not in _IN_WALKS):
        general = {**settings, "general": [name]}
        variants[name] = Variant(partial(render, frame, special, general))
    walks = build(frame, args, specialize_rays=False)
    variants[RAYS] = Variant(partial(render, frame, walks, settings))
    everything = {**settings, "specialize": False}
    variants["all of them"] = Variant(partial(render, frame, walks, everything))

    for _ in range(args.rounds):
        for variant in variants.values():
            with_skip, _ = render_special()
            without, pixels = variant.render()
            variant.seconds.append((with_skip["times"]["render"], without["times"]["render"]))
            variant.saved_bytes = n_bytes(without) - n_bytes(with_skip)
            variant.is_same &= np.array_equal(pixels, expected, equal_nan=True)
    return [row(Path(stage).name, name, variant) for name, variant in variants.items()]


def n_bytes(stats: dict[str, Any]) -> int:
    """Return what trees, lights and film take."""
    return sum(stats["memory"][key] for key in ("accel", "lights", "film"))


def row(stage: str, skip: str, variant: Variant) -> dict[str, Any]:
    """Tell what a skip saves: the median over the pairs, and half of what the middle half spans."""
    saved = [100.0 * (1.0 - special / general) for special, general in variant.seconds]
    low, median, high = np.percentile(saved, [25.0, 50.0, 75.0])
    return {
        "stage": stage,
        "skip": skip,
        "special_s": min(special for special, _ in variant.seconds),
        "general_s": min(general for _, general in variant.seconds),
        "saved_percent": float(median),
        "spread_percent": float(high - low) / 2.0,
        "saved_bytes": variant.saved_bytes,
        "same_pixels": variant.is_same,
    }


def build(frame: Frame, args: argparse.Namespace, *, specialize_rays: bool) -> Any:
    """Build a scene, with the walks of its trees as they fit it, or with the general one."""
    engine = native()
    options = {
        "resolution": args.res,
        "max_chunk_triangles": MAX_CHUNK_TRIANGLES,
        "specialize_rays": specialize_rays,
    }
    try:
        return interrupt.run(lambda: engine.build_scene(frame, json.dumps(options)))
    except (engine.SceneError, engine.RenderError) as error:
        raise KilaueaError(str(error)) from None


def render(frame: Frame, scene: Any, settings: dict[str, Any]) -> tuple[dict[str, Any], Any]:
    """Render a built scene; return its statistics and the values of all layers."""
    engine = native()
    record = settings_record(frame, RenderOptions([], settings))
    metadata = {"stage": frame.stage, "frame": frame.time, "camera": frame.camera["path"]}
    with tempfile.TemporaryDirectory(prefix="kilauea-") as folder:
        image = Path(folder) / "image.exr"
        try:
            job = scene.render(json.dumps(record), json.dumps(metadata))
            stats = interrupt.run(lambda: json.loads(job.finish([str(image)])))
        except (engine.SceneError, engine.RenderError) as error:
            raise KilaueaError(str(error)) from None
        return stats, read_layers(image)
