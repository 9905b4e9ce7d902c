"""The stages with a closed form, from USD to pixels, through Cycles and through our renderer."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

SCENES = Path(__file__).parents[2] / "tests/scenes"
EXPECTED = json.loads((SCENES / "analytic.json").read_text())
CACHE = Path(os.environ.get("KILAUEA_CACHE", Path.home() / ".cache/kilauea"))
PYTHON = Path(os.environ.get("KILAUEA_REFERENCE_PYTHON", CACHE / "reference-env/bin/python"))

pytest.importorskip("kilauea._native", reason="the engine is not installed")


@pytest.mark.parametrize("command", ["render", "reference"])
@pytest.mark.parametrize("stage", EXPECTED)
def test_radiance(tmp_path: Path, stage: str, command: str) -> None:
    if command == "reference" and not PYTHON.exists():
        pytest.skip("no Blender: `kilauea reference` has not made its environment yet")
    expected = EXPECTED[stage]
    out = tmp_path / "out.exr"
    depth = str(expected.get("max_depth", 4))
    words = [sys.executable, "-m", "kilauea.cli", command, str(SCENES / stage), "-o", str(out)]
    words += ["-p", "256", "--filter", "box", "--max-depth", depth]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    image = oiio.ImageBuf(str(out)).get_pixels(oiio.FLOAT)[..., :3]
    mean = image.reshape(-1, 3).mean(axis=0)
    np.testing.assert_allclose(mean, expected["radiance"], rtol=expected["tolerance"])
