"""Frames rendered on a Ray cluster.

`make test-ray` installs Ray and runs these.
"""

from __future__ import annotations

import json
import os
import signal
import threading
import time
from contextlib import suppress
from itertools import product
from pathlib import Path

import numpy as np
from conftest import N_NODES
from frames import read, render, words
from kilauea import cli
from kilauea.ray_workers import RayWorkers


def test_a_cluster_gives_the_pixels_of_one_process(address, tmp_path) -> None:
    for flags in (["-p", "16"], ["-p", "32", "--noise", "0.1"], ["-p", "8", "--gi", "consistent"]):
        alone, _ = render(tmp_path, "alone", *flags)
        together, stats = render(tmp_path, "together", *flags, "--cluster", address)
        assert np.array_equal(alone, together, equal_nan=True)
        assert [worker["rank"] for worker in stats["workers"]] == list(range(N_NODES))
        assert all(worker["lost"] is None for worker in stats["workers"])
        assert stats["network"]["bytes_received"] > alone.nbytes


def test_a_scene_that_is_spread_over_machines_gives_the_pixels_of_one_process(
    address, tmp_path
) -> None:
    for integrator, broadcast in product(("path", "kilauea"), ("culled", "full")):
        flags = ["-p", "8", "--integrator", integrator]
        alone, _ = render(tmp_path, "alone", *flags)
        spread = ["--cluster", address, "--set-size", str(N_NODES), "--broadcast", broadcast]
        together, stats = render(tmp_path, "together", *flags, *spread)
        assert np.array_equal(alone, together, equal_nan=True)
        members = [worker["seat"]["member"] for worker in stats["workers"]]
        assert sorted(members) == list(range(N_NODES))
        assert all(worker["seat"]["links"]["messages"] for worker in stats["workers"])


def test_a_worker_that_is_killed_changes_no_bit(address, tmp_path, monkeypatch) -> None:
    start = RayWorkers.start
    first = threading.Event()

    def start_and_kill(self: RayWorkers, ticket: str) -> None:
        if not first.is_set():
            first.set()
            of_earlier_frames = workers_here()
            threading.Thread(target=kill_a_worker, args=[of_earlier_frames], daemon=True).start()
        start(self, ticket)

    monkeypatch.setattr(RayWorkers, "start", start_and_kill)
    flags = ["-p", "256"]
    alone, _ = render(tmp_path, "alone", *flags)
    for name, spread in (("replicated", []), ("spread", ["--set-size", str(N_NODES)])):
        first.clear()
        together, stats = render(tmp_path, name, *flags, *spread, "--cluster", address)
        lost = [worker for worker in stats["workers"] if worker["lost"]]
        assert len(lost) == 1
        again = [
            w for w in stats["workers"] if w["rank"] == lost[0]["rank"] and w["incarnation"] == 1
        ]
        assert len(again) == 1
        assert np.array_equal(alone, together, equal_nan=True)


def test_workers_stay_from_frame_to_frame(address, tmp_path) -> None:
    # So many samples that no worker is late for the first frame, and goes without its scene.
    flags = ["-p", "512", "-n", "2", "--integrator", "kilauea"]
    alone, _ = render_two(tmp_path, *flags)
    together, (first, second) = render_two(tmp_path, *flags, "--cluster", address)
    assert np.array_equal(alone, together, equal_nan=True)
    kept = [[worker["kept_scene"] for worker in stats["workers"]] for stats in (first, second)]
    assert kept == [[False] * N_NODES, [True] * N_NODES]


def render_two(folder: Path, *flags: str) -> tuple[list[np.ndarray], list[dict]]:
    """Render two frames of a range; return their layers and statistics."""
    assert cli.main(words(folder, "%04d", "-f", "1", *flags)) == 0
    frames = [read(folder, name) for name in ("0001", "0002")]
    return [layers for layers, _ in frames], [stats for _, stats in frames]


def workers_here() -> set[int]:
    """Return the processes that render, by their names."""
    found = set()
    for words_of_process in Path("/proc").glob("[0-9]*/cmdline"):
        # Others end while we look.
        with suppress(OSError):
            if words_of_process.read_bytes().startswith(b"ray::RenderNode.work"):
                found.add(int(words_of_process.parent.name))
    return found


def kill_a_worker(but: set[int]) -> None:
    """Kill a worker as soon as it is there."""
    while not (found := workers_here() - but):
        time.sleep(0.01)
    os.kill(min(found), signal.SIGKILL)


def test_the_doctor_finds_machines_that_go_together(address, tmp_path, capsys) -> None:
    report = tmp_path / "report.json"
    assert cli.main(["cluster", "doctor", "--cluster", address, "--json", str(report)]) == 0
    found = json.loads(report.read_text())
    assert len(found["machines"]) == N_NODES
    assert not [finding for finding in found["findings"] if finding["is_error"]]
    assert "they can render together" in capsys.readouterr().out


def test_there_is_no_cluster(tmp_path, capsys) -> None:
    assert cli.main(words(tmp_path, "a", "--cluster", "127.0.0.1:1")) == 1
    assert "no Ray cluster at 127.0.0.1:1" in capsys.readouterr().err
    assert not list(tmp_path.glob("*.exr"))
