"""USD's shader registry finds our shaders; each host is a process: no registry can be emptied."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from kilauea.usd import declared

PLUGIN = Path(__file__).resolve().parents[2] / "shaders" / "usd"

HOST = """
import json
from pxr import Plug, Sdr
Plug.Registry().GetPluginWithName("kilauea_shaders").Load()
registry = Sdr.Registry()
found = {}
for identifier in registry.GetShaderNodeIdentifiers():
    if identifier.startswith("kilauea:"):
        node = registry.GetShaderNodeByIdentifier(identifier)
        inputs = [node.GetShaderInput(name) for name in node.GetShaderInputNames()]
        found[str(identifier)] = {
            "role": str(node.GetRole()),
            "outputs": [str(name) for name in node.GetShaderOutputNames()],
            "types": {i.GetName(): str(i.GetTypeAsSdfType().GetSdfType()) for i in inputs},
            "defaults": {i.GetName(): i.GetDefaultValue() for i in inputs},
            "help": {i.GetName(): i.GetHelp() for i in inputs},
        }
print(json.dumps(found, default=list))
"""


@pytest.fixture(scope="module")
def host():
    environment = os.environ | {"PXR_PLUGINPATH_NAME": str(PLUGIN), "PYTHONPATH": str(PLUGIN)}
    return subprocess.run(
        [sys.executable, "-c", HOST], env=environment, capture_output=True, text=True, check=True
    )


def test_nodes_have_the_declared_inputs(host):
    found = json.loads(host.stdout)
    ours = {k: v for k, v in declared.declarations().items() if declared.is_ours(k)}
    assert set(found) == set(ours) >= {"kilauea:Matte", "kilauea:Mirror", "kilauea:Glass"}
    for shader_id, node in found.items():
        declared_types = {name: i["type"] for name, i in ours[shader_id]["inputs"].items()}
        assert node["types"] == declared_types
        assert (node["role"], node["outputs"]) == ("surface", ["surface"])
        assert all(node["help"].values())


def test_nodes_have_the_declared_defaults(host):
    found = json.loads(host.stdout)
    assert found["kilauea:Matte"]["defaults"] == {
        "albedo": pytest.approx([0.18] * 3),
        "opacity": 1.0,
    }
    assert found["kilauea:Glass"]["defaults"] == {
        "tint": [1.0] * 3,
        "ior": 1.5,
        "transmissionColor": [1.0] * 3,
        "transmissionDepth": 0.0,
        "priority": 0,
    }


def test_the_host_is_told_nothing(host):
    assert host.stderr == ""
