"""`kilauea bench rays`; what traces needs Embree, which tests do not install."""

from __future__ import annotations

import json

import pytest
from kilauea import cli
from kilauea.benchmarks import rays
from kilauea.environments import EMBREE
from kilauea.errors import KilaueaError

needs_embree = pytest.mark.skipif(
    not EMBREE.is_complete(), reason="Embree is not installed: `kilauea bench rays` does it"
)


def row(mesh: str, kind: str, ours: float, peer: float) -> dict:
    return {
        "mesh": mesh,
        "triangles": 7,
        "rays": kind,
        "ours_name": "ours",
        "ours": ours,
        "peer_name": "Embree 4.4.0 medium",
        "peer": peer,
        "ratio": ours / peer,
    }


def test_means_are_geometric() -> None:
    rows = [row("a", "primary", 2.0, 1.0), row("b", "primary", 1.0, 8.0), row("b", "any", 4.0, 1.0)]
    found = {mean["rays"]: mean["ours/medium"] for mean in rays.means(rows)}
    assert found == pytest.approx({"primary": 0.5, "any": 4.0, "all": 1.0})
    assert list(found)[-1] == "all"


def test_modes_stand_side_by_side() -> None:
    (line,) = rays.side_by_side(
        [row("a", "primary", 2.0, 1.0), row("a", "primary", 2.0, 4.0) | {"peer_name": "E 4 high"}]
    )
    assert (line["ours"], line["medium"], line["high"], line["/high"]) == (2.0, 1.0, 4.0, 0.5)


@pytest.mark.parametrize(
    "words",
    [["--mesh", "a.mesh"], ["--rays", "a.rays"], ["--rounds", "0"], ["--dump", "no/such/folder"]],
    ids=" ".join,
)
def test_refuses_what_cannot_be_measured(words: list[str]) -> None:
    assert cli.main(["bench", "rays", "room", *words]) == 2


def test_a_mesh_that_cannot_be_loaded_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    code = cli.main(["bench", "rays", "no-such-stage.usda", "--embree", "unused"])
    assert code == 1
    assert "no-such-stage.usda" in capsys.readouterr().err


def test_a_library_that_is_none_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    code = cli.main(["bench", "rays", "room", "--n-rays", "64", "--embree", __file__])
    assert code == 1
    assert "test_bench_rays.py" in capsys.readouterr().err


@needs_embree
def test_shapes_and_stages_are_measured(write_stage, tmp_path) -> None:
    """A small run: both tracers find the same, and every figure is one."""
    stage = write_stage(
        'def Sphere "ball" { double radius = 2 }\n'
        'def Camera "cam" { double3 xformOp:translate = (0, 0, 9);'
        'uniform token[] xformOpOrder = ["xformOp:translate"] }\n'
        'def SphereLight "light" { double3 xformOp:translate = (4, 4, 9);'
        'uniform token[] xformOpOrder = ["xformOp:translate"] }\n'
    )
    target = tmp_path / "rows.json"
    words = ["room", str(stage), "--n-rays", "2000", "--rounds", "1"]
    assert cli.main(["bench", "rays", *words, "--json", str(target)]) == 0
    report = json.loads(target.read_text())
    assert {row["mesh"] for row in report["rows"]} == {"room", "stage"}
    for found in report["rows"]:
        assert found["agrees"], found
        assert found["ours"] > 0.0
        assert found["peer"] > 0.0
        assert found["peer_name"].startswith("Embree 4.")
    primary = [r["hit_fraction"] for r in report["rows"] if r["rays"] == "primary"]
    assert all(0.1 < fraction <= 1.0 for fraction in primary)
    assert all(b["seconds"] > 0.0 and b["bytes_per_triangle"] > 0.0 for b in report["builds"])


@needs_embree
def test_what_is_dumped_can_be_traced(tmp_path) -> None:
    words = ["--n-rays", "500", "--rounds", "1", "--skip-builds"]
    assert cli.main(["bench", "rays", "room", *words, "--dump", str(tmp_path)]) == 0
    files = sorted(str(file) for file in tmp_path.glob("room.*.rays"))
    target = tmp_path / "rows.json"
    words += ["--mesh", str(tmp_path / "room.mesh"), "--rays", *files, "--json", str(target)]
    assert cli.main(["bench", "rays", *words]) == 0
    kinds = {found["rays"] for found in json.loads(target.read_text())["rows"]}
    assert kinds == {"primary", "diffuse", "shadow", "occlusion", "random"}


def test_a_package_without_the_library_is_said(monkeypatch, tmp_path) -> None:
    python = tmp_path / "python"
    python.write_text(f"#!/bin/sh\necho {tmp_path}\n")
    python.chmod(0o755)
    monkeypatch.setenv("KILAUEA_EMBREE_PYTHON", str(python))
    with pytest.raises(KilaueaError, match="no libembree4"):
        rays.embree_library()
