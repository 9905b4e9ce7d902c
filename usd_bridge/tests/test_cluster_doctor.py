"""What `kilauea cluster doctor` says of machines; with Ray itself, `ray_tests`."""

from __future__ import annotations

import dataclasses
import importlib.util

import pytest
from kilauea import cli
from kilauea.cluster_doctor import Machine, diagnose, examine

OURS = Machine(
    host="here",
    build="b0",
    error="",
    cores=4,
    memory_bytes=8 << 30,
    shared_memory_bytes=2 << 30,
    tile_files="/cache",
    has_tile_files=True,
    clock=1000.0,
)
LATER = dataclasses.replace(OURS, clock=1005.0)


def test_machines_that_are_alike_have_nothing_wrong() -> None:
    there = dataclasses.replace(OURS, host="there", clock=1003.0, cores=64)
    assert diagnose(OURS, LATER, [OURS, there]) == []


@pytest.mark.parametrize(
    ("change", "is_error", "text"),
    [
        ({"build": None, "error": "no module"}, True, "cannot be loaded: no module"),
        ({"build": "b1"}, True, "another build of kilauea: b1, and here b0"),
        ({"clock": 1008.5}, False, "off by 3.5 s"),
        ({"clock": 990.0}, False, "off by 10.0 s"),
        ({"shared_memory_bytes": 32 << 20}, False, "/dev/shm has 32 MiB"),
        ({"has_tile_files": False}, False, "/cache is not there"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_wrong_is_found(change, is_error, text) -> None:
    there = dataclasses.replace(OURS, host="there", clock=1003.0)
    (finding,) = diagnose(OURS, LATER, [OURS, dataclasses.replace(there, **change)])
    assert (finding.host, finding.is_error) == ("there", is_error)
    assert text in finding.text


def test_this_machine_can_be_examined() -> None:
    pytest.importorskip("kilauea._native")
    machine = examine()
    assert machine.error == ""
    assert machine.build is not None
    assert len(machine.build) == 16
    assert machine.memory_bytes > 1 << 28


@pytest.mark.skipif(importlib.util.find_spec("ray") is not None, reason="Ray is installed")
@pytest.mark.parametrize("words", [["cluster", "doctor"], ["render", "STAGE", "--cluster", "auto"]])
def test_without_ray_one_is_told_how_to_install_it(words, write_stage, tmp_path, capsys) -> None:
    stage = str(write_stage('def Sphere "S" {}'))
    words = [stage if word == "STAGE" else word for word in words]
    if words[0] == "render":
        words += ["-o", str(tmp_path / "a.exr")]
    assert cli.main(words) == 2
    assert "pip install 'kilauea[cluster]'" in capsys.readouterr().err
