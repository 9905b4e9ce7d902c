"""What becomes of a frame whose Ray cluster breaks down."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from frames import cluster_of, read, render, words
from ray.cluster_utils import Cluster

_N_NODES = 2
_SHORT = ["-p", "256"]
_LONG = ["-p", "3000"]
"""Some times longer than Ray takes to notice, on any machine that we know."""
_SOON_NOTICED = {
    "RAY_gcs_rpc_server_reconnect_timeout_s": "2",
    "RAY_health_check_initial_delay_ms": "0",
    "RAY_health_check_period_ms": "300",
    "RAY_raylet_death_check_interval_milliseconds": "100",
    "RAY_raylet_liveness_self_check_interval_ms": "500",
}
"""In place of the minute that Ray waits for a head, and of 20 seconds for a node."""
_JOURNALED_BYTES = 100_000


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> tuple[np.ndarray, dict]:
    """Return the long frame that one process renders."""
    return render(tmp_path_factory.mktemp("whole"), "alone", *_LONG)


def begin(folder: Path, name: str, cluster: Cluster, *flags: str) -> subprocess.Popen[str]:
    """Begin a frame in a process of its own and wait until some of it has been rendered."""
    command = [sys.executable, "-m", "kilauea.cli", *words(folder, name, *flags)]
    frame = subprocess.Popen(
        [*command, "--cluster", cluster.address], stderr=subprocess.PIPE, text=True
    )
    journal = folder / f"{name}.exr.journal"
    while not journal.exists() or journal.stat().st_size < _JOURNALED_BYTES:
        assert frame.poll() is None, frame.communicate()
        time.sleep(0.02)
    return frame


def end_of(frame: subprocess.Popen[str]) -> tuple[int, str]:
    """Wait for the end of a frame; return its exit code and what it said."""
    try:
        _, said = frame.communicate(timeout=120)
    finally:
        frame.kill()
    return frame.returncode, said


def test_a_frame_outlives_the_head_of_its_cluster(tmp_path) -> None:
    with cluster_of(_N_NODES) as cluster:
        frame = begin(tmp_path, "together", cluster, *_SHORT)
        cluster.head_node.kill_gcs_server()
        code, said = end_of(frame)
    assert code == 0, said
    assert "does not answer; it was left" in said
    alone, _ = render(tmp_path, "alone", *_SHORT)
    together, stats = read(tmp_path, "together")
    assert np.array_equal(alone, together, equal_nan=True)
    assert all(worker["lost"] is None for worker in stats["workers"])


def kill_head(cluster: Cluster) -> None:
    cluster.head_node.kill_gcs_server()


def kill_node_here(cluster: Cluster) -> None:
    os.kill(cluster.head_node.all_processes["raylet"][0].process.pid, 9)


@pytest.mark.parametrize("kill", [kill_head, kill_node_here])
def test_a_frame_that_its_cluster_leaves_can_be_gone_on_from(
    tmp_path, monkeypatch, whole, kill: Callable[[Cluster], None]
) -> None:
    for name, value in _SOON_NOTICED.items():
        monkeypatch.setenv(name, value)
    with cluster_of(_N_NODES) as cluster:
        frame = begin(tmp_path, "together", cluster, *_LONG)
        kill(cluster)
        code, said = end_of(frame)
    assert code == 1, said
    assert "the Ray cluster at" in said
    assert "is gone" in said
    assert "--resume goes on" in said
    assert not (tmp_path / "together.exr").exists()
    monkeypatch.undo()
    with cluster_of(_N_NODES) as cluster:
        resumed = [*_LONG, "--resume", "--cluster", cluster.address]
        together, stats = render(tmp_path, "together", *resumed)
    alone, stats_alone = whole
    assert np.array_equal(alone, together, equal_nan=True)
    assert sum(worker["rays"] for worker in stats["workers"]) < sum(stats_alone["rays"].values())
