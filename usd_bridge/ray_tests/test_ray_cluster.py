"""Frames rendered on a Ray cluster: three of its nodes, each on its own, on this machine.

`make test-ray` installs Ray and runs these.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from kilauea import cli
from kilauea.ray_workers import RayWorkers
from ray.cluster_utils import Cluster

STAGE = Path(__file__).parents[2] / "tests/scenes/box_rect_light.usda"
N_NODES = 3


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    # What Ray starts finds the package as we do.
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    for _ in range(N_NODES - 1):
        cluster.add_node(num_cpus=1)
    cluster.wait_for_nodes()
    yield cluster.address
    cluster.shutdown()


def render(folder: Path, name: str, *flags: str) -> tuple[np.ndarray, dict]:
    image, stats = folder / f"{name}.exr", folder / f"{name}.json"
    words = ["render", str(STAGE), "-o", str(image), "-r", "96", "64", "--stats", str(stats)]
    assert cli.main([*words, *flags]) == 0
    reader = oiio.ImageInput.open(str(image))
    try:
        pixels = reader.read_image(0, 0, 0, reader.spec().nchannels, "float")
    finally:
        reader.close()
    return pixels, json.loads(stats.read_text())


def test_a_cluster_gives_the_pixels_of_one_process(address, tmp_path) -> None:
    for flags in (["-p", "16"], ["-p", "32", "--noise", "0.1"], ["-p", "8", "--gi", "consistent"]):
        alone, _ = render(tmp_path, "alone", *flags)
        together, stats = render(tmp_path, "together", *flags, "--cluster", address)
        assert np.array_equal(alone, together, equal_nan=True)
        assert [worker["rank"] for worker in stats["workers"]] == list(range(N_NODES))
        assert all(worker["lost"] is None for worker in stats["workers"])
        assert stats["network"]["bytes_received"] > alone.nbytes


def test_a_worker_that_is_killed_changes_no_bit(address, tmp_path, monkeypatch) -> None:
    start = RayWorkers.start
    first = threading.Event()

    def start_and_kill(self: RayWorkers, ticket: str) -> None:
        start(self, ticket)
        if not first.is_set():
            first.set()
            threading.Thread(target=kill_a_worker, daemon=True).start()

    monkeypatch.setattr(RayWorkers, "start", start_and_kill)
    flags = ["-p", "256"]
    together, stats = render(tmp_path, "together", *flags, "--cluster", address)
    lost = [worker for worker in stats["workers"] if worker["lost"]]
    assert len(lost) == 1
    again = [w for w in stats["workers"] if w["rank"] == lost[0]["rank"] and w["incarnation"] == 1]
    assert len(again) == 1
    alone, _ = render(tmp_path, "alone", *flags)
    assert np.array_equal(alone, together, equal_nan=True)


def kill_a_worker() -> None:
    """Kill the first worker that there is, as soon as it is there."""
    while True:
        found = subprocess.run(
            ["pgrep", "-f", "^ray::RenderNode.work"], capture_output=True, text=True, check=False
        )
        if found.stdout:
            os.kill(int(found.stdout.split()[0]), signal.SIGKILL)
            return


def test_the_doctor_finds_machines_that_go_together(address, tmp_path, capsys) -> None:
    report = tmp_path / "report.json"
    assert cli.main(["cluster", "doctor", "--cluster", address, "--json", str(report)]) == 0
    found = json.loads(report.read_text())
    assert len(found["machines"]) == N_NODES
    assert not [finding for finding in found["findings"] if finding["is_error"]]
    assert "they can render together" in capsys.readouterr().out


def test_there_is_no_cluster(tmp_path, capsys) -> None:
    words = ["render", str(STAGE), "-o", str(tmp_path / "a.exr"), "--cluster", "127.0.0.1:1"]
    assert cli.main(words) == 1
    assert "no Ray cluster at 127.0.0.1:1" in capsys.readouterr().err
    assert not list(tmp_path.glob("*.exr"))
