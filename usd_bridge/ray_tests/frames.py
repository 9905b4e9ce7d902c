"""Frames that tests of Ray clusters render, and the clusters."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from kilauea import cli
from kilauea.benchmarks.layers import read_layers
from ray.cluster_utils import Cluster

STAGE = Path(__file__).parents[2] / "tests/scenes/box_rect_light.usda"


@contextmanager
def cluster_of(n_nodes: int) -> Iterator[Cluster]:
    """Run so many nodes of one core on this machine."""
    # What Ray starts finds the package as we do.
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))
    # Or its workers wait for whatever else runs on this machine.
    os.environ.update(RAY_worker_niceness="0")
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    try:
        for _ in range(n_nodes - 1):
            cluster.add_node(num_cpus=1)
        cluster.wait_for_nodes()
        yield cluster
    finally:
        cluster.shutdown()


def words(folder: Path, name: str, *flags: str) -> list[str]:
    """Return the command that renders `NAME.exr` with its statistics beside it."""
    image, stats = folder / f"{name}.exr", folder / f"{name}.json"
    fixed = ["render", str(STAGE), "-o", str(image), "-r", "96", "64", "--stats", str(stats)]
    return [*fixed, *flags]


def read(folder: Path, name: str) -> tuple[np.ndarray, dict]:
    """Return all layers of a frame, and its statistics."""
    stats = json.loads((folder / f"{name}.json").read_text())
    return read_layers(folder / f"{name}.exr"), stats


def render(folder: Path, name: str, *flags: str) -> tuple[np.ndarray, dict]:
    """Render a frame in this process."""
    assert cli.main(words(folder, name, *flags)) == 0
    return read(folder, name)
