"""Frames that several processes render, any of which may die."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import numpy as np
import pytest
from prometheus_client.parser import text_string_to_metric_families

pytest.importorskip("kilauea._native")
oiio = pytest.importorskip("OpenImageIO")

COMMAND = Path(sys.executable).with_name("kilauea")
SCENES = Path(__file__).parents[2] / "tests/scenes"
BOX = SCENES / "cornell_box/cornell-box.usda"


def start(out, *flags):
    flags = ("-r", 96, 64, "-j", 1, "--stats", out.with_suffix(".json"), *flags)
    argv = [COMMAND, "render", BOX, "-o", out, *flags]
    return subprocess.Popen([*map(str, argv)], stderr=subprocess.PIPE, text=True)


def finish(process, code=0):
    _, errors = process.communicate(timeout=120)
    assert process.returncode == code, errors
    return errors


def render(out, *flags):
    finish(start(out, *flags))
    return pixels(out), json.loads(out.with_suffix(".json").read_text())


def pixels(file):
    image = oiio.ImageBuf(str(file))
    assert not image.has_error, image.geterror()
    return image.get_pixels(oiio.FLOAT)


def children(pid):
    """Processes that the threads of a process have started."""
    threads = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for listed in threads for child in listed.read_text().split()]


def wait_for(condition):
    deadline = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < deadline, "it did not happen"
        time.sleep(0.005)


@pytest.mark.parametrize(
    "flags", [[], ["--integrator", "kilauea"], ["--gi", "consistent"]], ids=str
)
def test_workers_render_the_same_pixels(tmp_path, flags):
    flags = [*flags, "-p", 8]
    alone, stats = render(tmp_path / "alone.exr", *flags)
    assert stats["workers"] == []
    assert stats["network"] == {
        "bytes_sent": 0,
        "bytes_received": 0,
        "messages": 0,
        "stale_messages": 0,
    }
    for n_workers in (1, 2):
        shared, stats = render(tmp_path / "shared.exr", *flags, "--workers", n_workers)
        np.testing.assert_array_equal(alone, shared)
        assert [worker["rank"] for worker in stats["workers"]] == list(range(n_workers))
        assert all(worker["lost"] is None for worker in stats["workers"])
        assert sum(worker["units"] for worker in stats["workers"]) >= 6
        assert stats["network"]["bytes_sent"] > 1000


@pytest.mark.parametrize("flags", [["--set-size", 2], ["--set-size", 2, "--broadcast", "full"]])
def test_sets_render_the_same_pixels(tmp_path, flags):
    alone, stats = render(tmp_path / "alone.exr", "-p", 8)
    assert stats["set"] is None
    shared, stats = render(tmp_path / "shared.exr", "-p", 8, "--workers", 2, *flags)
    np.testing.assert_array_equal(alone, shared)
    assert [worker["seat"]["member"] for worker in stats["workers"]] == [0, 1]
    assert all(worker["seat"]["links"]["bytes_sent"] > 0 for worker in stats["workers"])
    assert all(member["asked"] > 0 for member in stats["set"]["members"])


def test_a_worker_that_is_killed_is_replaced(tmp_path):
    # So many that a second is left when two of six tiles are done.
    flags = ("-p", 256)
    alone, _ = render(tmp_path / "alone.exr", *flags)
    journal = tmp_path / "shared.exr.journal"
    process = start(tmp_path / "shared.exr", *flags, "--workers", 2)
    # Two tiles and the manifest.
    wait_for(lambda: journal.exists() and journal.stat().st_size > 300_000)
    os.kill(children(process.pid)[0], signal.SIGKILL)
    finish(process)
    np.testing.assert_array_equal(alone, pixels(tmp_path / "shared.exr"))
    stats = json.loads((tmp_path / "shared.json").read_text())
    assert [w["incarnation"] for w in stats["workers"] if w["lost"]] == [0]


def test_a_command_that_is_killed_goes_on(tmp_path):
    flags = ("-p", 256, "--workers", 2)
    out = tmp_path / "out.exr"
    journal = tmp_path / "out.exr.journal"
    alone, alone_stats = render(tmp_path / "alone.exr", "-p", 256)
    process = start(out, *flags)
    # Two tiles and the manifest.
    wait_for(lambda: journal.exists() and journal.stat().st_size > 300_000)
    workers = children(process.pid)
    process.kill()
    process.communicate()
    wait_for(lambda: not any(is_running(pid) for pid in workers))
    assert not out.exists()

    shared, stats = render(out, *flags, "--resume")
    np.testing.assert_array_equal(alone, shared)
    assert not journal.exists()
    assert stats["rays"] == alone_stats["rays"]
    traced = sum(worker["rays"] for worker in stats["workers"])
    assert 0 < traced < sum(stats["rays"].values())


def test_a_journal_is_gone_on_from_only_where_that_is_asked_for(tmp_path):
    out = tmp_path / "out.exr"
    journal = tmp_path / "out.exr.journal"
    journal.write_bytes(b"of something else")
    errors = finish(start(out, "-p", 1, "--workers", 1, "--resume"), code=1)
    assert str(journal) in errors
    render(out, "-p", 1, "--workers", 1)
    assert not journal.exists()
    # Until a pass fits, however slow the machine is; all samples never do.
    for limit in (3, 12, 48):
        limited = start(out, "-p", 65536, "--workers", 1, "--timelimit", limit)
        _, errors = limited.communicate(timeout=120)
        if limited.returncode != 5:
            break
    assert limited.returncode == 0, errors
    assert not journal.exists()


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (("--workers", 3, "--set-size", 2), "sets of 2"),
        (("--workers", 2, "--worker-memory", "1K"), "of 2048 bytes together"),
    ],
)
def test_sets_that_cannot_be_are_refused(tmp_path, flags, message):
    out = tmp_path / "out.exr"
    assert message in finish(start(out, *flags), code=1)
    assert not list(tmp_path.iterdir())


def test_a_set_of_workers_shares_the_scene_and_gives_the_same_image(tmp_path):
    alone, _ = render(tmp_path / "alone.exr", "-p", 2)
    shared, stats = render(tmp_path / "shared.exr", "-p", 2, "--workers", 2, "--set-size", 2)
    np.testing.assert_array_equal(alone, shared)
    assert [worker["seat"]["member"] for worker in stats["workers"]] == [0, 1]
    assert all(worker["seat"]["links"]["messages"] > 0 for worker in stats["workers"])
    assert len(stats["set"]["members"]) == 2


def is_running(pid):
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


def test_workers_stay_from_frame_to_frame(tmp_path):
    # The first lasts until both workers have a part in it, a second at least: one that has not
    # started yet goes.
    commands = [
        f"render -o {tmp_path / 'first.exr'} --stats {tmp_path / 'first.json'} -p 256 {{}}",
        "set /cornell_box/camera/camera.focalLength 40",
        f"render -o {tmp_path / 'second.exr'} --stats {tmp_path / 'second.json'} -p 1 {{}}",
    ]

    def render_all(*flags):
        flags = " ".join(map(str, ("-r", 96, 64, "-j", 1, *flags)))
        lines = "\n".join(commands).format(flags, flags)
        argv = [COMMAND, "console", BOX]
        subprocess.run(argv, input=lines, check=True, timeout=120, text=True)
        names = ("first", "second")
        stats = [json.loads((tmp_path / f"{name}.json").read_text()) for name in names]
        return [pixels(tmp_path / f"{name}.exr") for name in names], stats

    alone, _ = render_all()
    shared, (first, second) = render_all("--workers", 2)
    np.testing.assert_array_equal(alone, shared)
    assert {w["pid"] for w in first["workers"]} == {w["pid"] for w in second["workers"]}
    kept = [[worker["kept_scene"] for worker in stats["workers"]] for stats in (first, second)]
    assert kept == [[False, False], [True, True]]
    # Workers that have to be told the scene are sent more.
    _, told = render(tmp_path / "told.exr", "-p", 1, "--workers", 2)
    assert second["network"]["bytes_sent"] < told["network"]["bytes_sent"] / 2


def test_figures_are_served_while_workers_render(tmp_path):
    process = start(tmp_path / "out.exr", "-p", 4096, "--workers", 2, "--metrics", "127.0.0.1:0")
    (address,) = re.findall(r"figures at (http://\S+/metrics)", process.stderr.readline())

    def figures():
        with urllib.request.urlopen(address, timeout=10) as answer:
            assert answer.headers["Content-Type"] == "text/plain; version=0.0.4; charset=utf-8"
            families = text_string_to_metric_families(answer.read().decode())
            return {
                (sample.name, *sample.labels.values()): sample.value
                for family in families
                for sample in family.samples
            }

    wait_for(lambda: figures()["kilauea_units_done_total",] > 0)
    seen = figures()
    process.kill()
    process.communicate()
    assert seen["kilauea_workers", "working"] + seen["kilauea_workers", "suspect"] > 0
    assert 0 < seen["kilauea_frame_done_ratio",] <= 1
    by_worker = [seen["kilauea_worker_units_done_total", str(rank)] for rank in range(2)]
    assert sum(by_worker) == seen["kilauea_units_done_total",]
    assert seen["kilauea_network_received_bytes_total",] > 10_000


def test_figures_need_workers_and_a_free_address(tmp_path):
    errors = finish(start(tmp_path / "out.exr", "--metrics", "127.0.0.1:0"), code=2)
    assert "--metrics" in errors
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        errors = finish(start(tmp_path / "out.exr", "--workers", 1, "--metrics", address), code=1)
    assert address in errors


def test_the_token_can_be_read_nowhere(tmp_path):
    process = start(tmp_path / "out.exr", "-p", 65536, "--workers", 1)
    wait_for(lambda: children(process.pid))
    (worker,) = children(process.pid)

    def words(pid):
        return Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")

    # Until it runs a program of its own, a new process has the words of the one that started it.
    wait_for(lambda: words(worker) != words(process.pid))
    command = words(worker)
    environment = Path(f"/proc/{worker}/environ").read_bytes().split(b"\0")
    console = Path(f"/proc/{process.pid}/environ").read_bytes().split(b"\0")
    process.kill()
    process.communicate()
    assert command[1:] == [b"-m", b"kilauea.worker", b""]
    assert set(environment) <= set(console)


def test_a_worker_without_a_ticket_says_so():
    done = subprocess.run(
        [COMMAND, "worker"], input="nonsense\n", capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 1
    assert "ticket" in done.stderr
    assert len(done.stderr.splitlines()) == 1
