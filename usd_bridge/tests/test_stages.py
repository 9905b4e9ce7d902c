"""Every stage of the asset set can be flattened."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

ASSETS = Path(
    os.environ.get("KILAUEA_ASSETS")
    or Path(__file__).resolve().parents[2].parent / "shared" / "assets"
)
LIST = ASSETS / "stages.txt"
STAGES = LIST.read_text().split() if LIST.is_file() else []


@pytest.fixture(scope="module", autouse=True)
def tiles(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("KILAUEA_TEXTURE_CACHE", str(tmp_path_factory.mktemp("tiles")))
        yield


@pytest.mark.skipif(not STAGES, reason=f"no stages.txt in {ASSETS}")
@pytest.mark.parametrize("name", STAGES)
def test_flattens(name):
    from kilauea.usd.stage import flatten

    frame = flatten(str(ASSETS / name))
    for mesh in frame.meshes:
        assert 0 <= mesh.material < len(frame.materials)
        assert mesh.prototype < len(frame.prototypes)
        assert mesh.points.dtype == np.float32
    for instances in frame.instances:
        assert 0 <= instances.parent < len(frame.prototypes)
        assert 0 < instances.prototype < len(frame.prototypes)
        assert instances.parent_from_prototype.shape[1:] == (4, 4)
    assert len(frame.camera["world_from_camera"]) == 16
