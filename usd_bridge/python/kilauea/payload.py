"""What the bridge hands to the engine: one frame of a stage, flattened.

These records are the whole contract between `kilauea.usd` (which fills them in) and
`kilauea._native` (which reads their attributes). They hold no USD objects. Arrays are C-contiguous
`float32` and `int32` NumPy arrays and are read in place; an array made from a `Vt` array without a
copy is as good as any other.

A matrix is a tuple of 16 floats in USD's order: row vectors, rows one after the other, translation
last.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

Matrix = tuple[float, ...]
FloatArray = Any
"""A C-contiguous float32 array."""
IntArray = Any
"""A C-contiguous int32 array."""

WORLD = 0
"""The prototype that is the stage itself; every other one is placed by `Instances`."""

IDENTITY: Matrix = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)


CAMERA_RAYS = 1
"""Rays from the camera; a bit of every `visibility`."""
SHADOW_RAYS = 2
"""Rays toward lights."""
INDIRECT_RAYS = 4
"""Rays that a surface scattered."""
ALL_RAYS = CAMERA_RAYS | SHADOW_RAYS | INDIRECT_RAYS


@dataclass(slots=True)
class Primvar:
    """A primvar, or the normals of a mesh."""

    name: str
    """Without the `primvars:` prefix."""
    width: int
    """Floats per value, 1 to 4 (elementSize times the components of the type)."""
    interpolation: str
    """constant, uniform, varying, vertex or faceVarying."""
    values: FloatArray
    """`n_values * width` floats."""
    indices: IntArray | None = None
    """Which value belongs to each element; in order when absent."""


@dataclass(slots=True)
class Subset:
    """Faces of a mesh with a material of their own."""

    faces: IntArray
    material: int


@dataclass(slots=True)
class Subdivision:
    """A mesh's subdivision attributes, named and spelt as in UsdGeomMesh."""

    scheme: str
    """catmullClark, loop or bilinear."""
    interpolate_boundary: str
    face_varying_linear_interpolation: str
    triangle_subdivision_rule: str
    crease_indices: IntArray
    crease_lengths: IntArray
    crease_sharpnesses: FloatArray
    corner_indices: IntArray
    corner_sharpnesses: FloatArray


@dataclass(slots=True)
class MeshKey:
    """A mesh at a motion key after the first; keys are evenly spaced over the shutter."""

    points: FloatArray
    """(n, 3), as many as the mesh has."""
    normals: Primvar | None = None
    """Laid out as the mesh's; those of the first key when absent."""


@dataclass(slots=True)
class Mesh:
    """A polygon mesh or a subdivision cage, placed in a prototype."""

    path: str
    prototype: int
    prototype_from_mesh: Matrix
    points: FloatArray
    """(n, 3)."""
    face_vertex_counts: IntArray
    face_vertex_indices: IntArray
    material: int
    hole_indices: IntArray | None = None
    left_handed: bool = False
    """`orientation`; mirroring in the matrix is found by the engine."""
    double_sided: bool = False
    normals: Primvar | None = None
    """Absent: faceted, or computed from the limit surface where subdivided."""
    primvars: list[Primvar] = field(default_factory=list)
    """Only those that a bound material reads."""
    subsets: list[Subset] = field(default_factory=list)
    subdivision: Subdivision | None = None
    later_keys: list[MeshKey] = field(default_factory=list)
    """Empty where the mesh stands still."""
    visibility: int = ALL_RAYS
    """Which rays meet it: a sum of `CAMERA_RAYS`, `SHADOW_RAYS` and `INDIRECT_RAYS`."""


@dataclass(slots=True)
class Implicit:
    """A sphere, cube, cylinder, cone, capsule or plane."""

    path: str
    prototype: int
    prototype_from_mesh: Matrix
    kind: str
    """Sphere, Cube, Cylinder, Cone, Capsule or Plane."""
    axis: str
    """X, Y or Z."""
    dimensions: tuple[float, float, float]
    """Sphere (radius, 0, 0); Cube (size, 0, 0); Cylinder and Capsule (radius at -axis, radius at
    +axis, height); Cone (radius, 0, height); Plane (width, length, 0)."""
    material: int
    left_handed: bool = False
    double_sided: bool = False
    primvars: list[Primvar] = field(default_factory=list)
    """Constant ones only."""
    visibility: int = ALL_RAYS


@dataclass(slots=True)
class Curves:
    """Curves, named and spelt as in UsdGeomBasisCurves, placed in a prototype."""

    path: str
    prototype: int
    prototype_from_curves: Matrix
    points: FloatArray
    """(n, 3), at the first motion key."""
    curve_vertex_counts: IntArray
    curve_type: str
    """linear or cubic."""
    basis: str
    """bezier, bspline or catmullRom."""
    wrap: str
    """nonperiodic, periodic or pinned."""
    material: int
    widths: Primvar | None = None
    """Diameters; 1 when absent."""
    normals: Primvar | None = None
    """Makes ribbons of the curves; tubes when absent."""
    primvars: list[Primvar] = field(default_factory=list)
    """Only those that the material reads."""
    later_points: list[FloatArray] = field(default_factory=list)
    """At the later motion keys; empty where the curves stand still."""
    visibility: int = ALL_RAYS


@dataclass(slots=True)
class Points:
    """Points, each a sphere, placed in a prototype."""

    path: str
    prototype: int
    prototype_from_points: Matrix
    points: FloatArray
    """(n, 3), at the first motion key."""
    material: int
    widths: Primvar | None = None
    """Diameters; 1 when absent."""
    primvars: list[Primvar] = field(default_factory=list)
    """Only those that the material reads."""
    later_points: list[FloatArray] = field(default_factory=list)
    """At the later motion keys; empty where the points stand still."""
    visibility: int = ALL_RAYS


@dataclass(slots=True)
class Instances:
    """A prototype placed many times inside another."""

    path: str
    parent: int
    """The prototype that holds them; `WORLD` for the stage."""
    prototype: int
    """The prototype that is placed."""
    parent_from_prototype: Any
    """A C-contiguous float64 array (n, 4, 4), each as `Matrix`, at the first motion key."""
    primvars: list[Primvar] = field(default_factory=list)
    """One value per instance (`vertex`), or `constant`; they stand in for the prototype's."""
    later_parent_from_prototype: list[Any] = field(default_factory=list)
    """At the later motion keys; empty where the instances stand still."""
    visibility: int = ALL_RAYS
    """Which rays meet them, as far as the prototype lets them."""


@dataclass(slots=True)
class Frame:
    """One frame of a stage. The JSON records are the serde form of `kilauea-scene`'s types."""

    stage: str
    """Root layer, for messages and the EXR header."""
    time: float
    """Time code."""
    prototypes: list[str] = field(default_factory=lambda: [""])
    """Prim path of each prototype; entry 0 is the world."""
    meshes: list[Mesh] = field(default_factory=list)
    implicits: list[Implicit] = field(default_factory=list)
    curves: list[Curves] = field(default_factory=list)
    points: list[Points] = field(default_factory=list)
    instances: list[Instances] = field(default_factory=list)
    materials: list[dict[str, Any]] = field(default_factory=list)
    """`kilauea_scene::Material` records."""
    textures: list[dict[str, Any]] = field(default_factory=list)
    """`kilauea_scene::TextureSource` records."""
    lights: list[dict[str, Any]] = field(default_factory=list)
    """`kilauea_scene::Light` records."""
    camera: dict[str, Any] = field(default_factory=dict)
    """A `kilauea_scene::Camera` record."""
    settings: dict[str, Any] = field(default_factory=dict)
    """Authored fields of `kilauea_scene::RenderSettings`; the rest have defaults."""
    warnings: list[str] = field(default_factory=list)
    """What was found and is not rendered, each with the prim path."""
    notes: list[str] = field(default_factory=list)
    """What was chosen where the stage says nothing, and USD's own remarks; never an error."""
    missing: list[str] = field(default_factory=list)
    """Layers, textures and shaders that could not be found; `--strict` makes them an error."""
