"""Writes a stage of many small lights in a room: `many_lights.py OUT.usda [--lights 1000]`.

Every surface is Lambert and every light a sphere of a few millimetres that the camera does not
see, so that all engines mean the same. Few of the lights matter at any one point: blocks are in
the way, and the powers spread over four orders of magnitude.
"""

from __future__ import annotations

import argparse
import random
from pathlib import Path

HALF_WIDTH, HEIGHT = 4.0, 3.0
"""The room, in metres."""
RADIUS = 0.004
"""Of a light, in metres."""
BLOCKS = 24


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path, help="USDA to write")
    parser.add_argument("--lights", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args()


def stage(n_lights: int, seed: int) -> str:
    """Return the text of the stage."""
    generator = random.Random(seed)
    prims = [camera(), *walls()]
    prims += [block(idx, generator) for idx in range(BLOCKS)]
    lights = [light(idx, generator) for idx in range(n_lights)]
    return "\n".join((HEADER, *prims, LIGHTS, *lights, "    }", "}", ""))


HEADER = """#usda 1.0
(
    doc = "Many small lights in a room, written by pipeline/many_lights.py"
    upAxis = "Y"
    metersPerUnit = 1
    defaultPrim = "World"
    renderSettingsPrimPath = "/Render"
)

def RenderSettings "Render"
{
    rel camera = </World/Camera>
    uniform int2 resolution = (512, 288)
}

def Xform "World"
{"""

# Seen as dots, they would be most of the noise.
LIGHTS = """    def Xform "Lights"
    {
        int primvars:ri:attributes:visibility:camera = 0
"""


def camera() -> str:
    """Look into the room from one of its walls."""
    return """    def Camera "Camera"
    {
        float focalLength = 18
        float horizontalAperture = 24
        float verticalAperture = 13.5
        float2 clippingRange = (0.01, 100)
        double3 xformOp:translate = (0, 1.6, 3.9)
        float xformOp:rotateX = -8
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
    }"""


def walls() -> list[str]:
    """Return the six sides of the room."""
    x, y, z = HALF_WIDTH, HEIGHT, HALF_WIDTH
    sides = {
        "Floor": [(-x, 0, z), (x, 0, z), (x, 0, -z), (-x, 0, -z)],
        "Ceiling": [(-x, y, -z), (x, y, -z), (x, y, z), (-x, y, z)],
        "Back": [(-x, 0, -z), (x, 0, -z), (x, y, -z), (-x, y, -z)],
        "Front": [(x, 0, z), (-x, 0, z), (-x, y, z), (x, y, z)],
        "Left": [(-x, 0, z), (-x, 0, -z), (-x, y, -z), (-x, y, z)],
        "Right": [(x, 0, -z), (x, 0, z), (x, y, z), (x, y, -z)],
    }
    return [
        f"""    def Mesh "{name}"
    {{
        uniform token subdivisionScheme = "none"
        uniform bool doubleSided = 1
        point3f[] points = {corners}
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        color3f[] primvars:displayColor = [(0.6, 0.6, 0.6)]
    }}"""
        for name, corners in sides.items()
    ]


def block(idx: int, generator: random.Random) -> str:
    """Return a box that stands somewhere on the floor."""
    width, height = generator.uniform(0.2, 0.6), generator.uniform(0.3, 1.8)
    x, z = generator.uniform(-3.5, 3.5), generator.uniform(-3.5, 1.5)
    colour = tuple(round(generator.uniform(0.2, 0.8), 3) for _ in range(3))
    place = f"({x:.4f}, {0.5 * height:.4f}, {z:.4f})"
    return f"""    def Cube "Block{idx}"
    {{
        double size = 1
        color3f[] primvars:displayColor = [{colour}]
        double3 xformOp:translate = {place}
        float xformOp:rotateY = {generator.uniform(0.0, 90.0):.2f}
        double3 xformOp:scale = ({width:.4f}, {height:.4f}, {width:.4f})
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY", "xformOp:scale"]
    }}"""


def light(idx: int, generator: random.Random) -> str:
    """Return a light somewhere in the room, below its ceiling."""
    x, z = (generator.uniform(-3.9, 3.9) for _ in range(2))
    y = generator.uniform(0.05, HEIGHT - 0.05)
    intensity = 10.0 ** generator.uniform(0.0, 4.0)
    colour = tuple(round(generator.uniform(0.3, 1.0), 3) for _ in range(3))
    return f"""        def SphereLight "Light{idx}"
        {{
            float inputs:intensity = {intensity:.2f}
            color3f inputs:color = {colour}
            float inputs:radius = {RADIUS}
            double3 xformOp:translate = ({x:.4f}, {y:.4f}, {z:.4f})
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }}"""


def main() -> None:
    """Run the command."""
    args = parse_arguments()
    args.out.write_text(stage(args.lights, args.seed), encoding="utf-8")


if __name__ == "__main__":
    main()
