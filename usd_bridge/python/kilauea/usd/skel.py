"""UsdSkel: meshes posed by a skeleton and blend shapes at the frame's time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt

from kilauea import payload
from kilauea.usd.arrays import indices_within
from kilauea.usd.context import Context


@dataclass(slots=True)
class Skinning:
    """How one prim follows its skeleton."""

    prim: Usd.Prim
    query: UsdSkel.SkinningQuery
    skeleton: UsdSkel.SkeletonQuery
    time: Usd.TimeCode

    def deform(
        self, points: Any, normals: payload.Primvar | None, face_vertex_indices: Any
    ) -> tuple[Any, payload.Primvar | None]:
        """Return posed points and normals, in the space of `world_from_points`."""
        posed = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points, np.float32))
        if self.query.HasBlendShapes():
            self._apply_blend_shapes(posed)
        if self.query.HasJointInfluences() and not self.query.IsRigidlyDeformed():
            joints = self._joint_transforms()
            if joints and self.query.ComputeSkinnedPoints(joints, posed, self.time):
                normals = self._skin_normals(joints, normals, len(posed), face_vertex_indices)
        return np.asarray(posed), normals

    def world_from_points(self, xforms: UsdGeom.XformCache) -> Gf.Matrix4d:
        """Return the transform from where `deform` leaves the points to the world."""
        joints = self._joint_transforms()
        if not self.query.HasJointInfluences() or not joints:
            return xforms.GetLocalToWorldTransform(self.prim)
        world_from_skel = self._world_from_skeleton(xforms)
        if not self.query.IsRigidlyDeformed():
            return world_from_skel
        return self.query.ComputeSkinnedTransform(joints, self.time) * world_from_skel

    def _world_from_skeleton(self, xforms: UsdGeom.XformCache) -> Gf.Matrix4d:
        """Place the skeleton; inside an instance UsdSkel names the one in the USD prototype."""
        root = skeleton = self.skeleton.GetPrim()
        matrix = xforms.GetLocalToWorldTransform(skeleton)
        if not skeleton.IsInPrototype():
            return matrix
        while not root.IsPrototype():
            root = root.GetParent()
        owner = self.prim
        while owner and not (owner.IsInstance() and owner.GetPrototype() == root):
            owner = owner.GetParent()
        return matrix * xforms.GetLocalToWorldTransform(owner) if owner else matrix

    def _joint_transforms(self) -> Any:
        return self.skeleton.ComputeSkinningTransforms(self.time)

    def _apply_blend_shapes(self, points: Vt.Vec3fArray) -> None:
        animation = self.skeleton.GetAnimQuery()
        weights = animation.ComputeBlendShapeWeights(self.time) if animation else None
        if not weights:
            return
        mapper = self.query.GetBlendShapeMapper()
        if mapper:
            weights = mapper.Remap(weights)
        shapes = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(self.prim))
        sub_weights, shape_indices, sub_shape_indices = shapes.ComputeSubShapeWeights(weights)
        shapes.ComputeDeformedPoints(
            sub_weights,
            shape_indices,
            sub_shape_indices,
            shapes.ComputeBlendShapePointIndices(),
            shapes.ComputeSubShapePointOffsets(),
            points,
        )

    def _skin_normals(
        self,
        joints: Any,
        normals: payload.Primvar | None,
        n_points: int,
        face_vertex_indices: Any,
    ) -> payload.Primvar | None:
        """Pose normals given per point or per face corner; others are dropped."""
        if normals is None:
            return None
        values = normals.values.reshape(-1, 3)
        if normals.indices is not None:
            if not indices_within(normals.indices, len(values)):
                return None
            values = values[normals.indices]
        influences = self.query.ComputeVaryingJointInfluences(n_points, self.time)
        if not influences:
            return None
        joint_indices, joint_weights = (np.asarray(a).reshape(n_points, -1) for a in influences)
        if normals.interpolation == "faceVarying":
            if not indices_within(face_vertex_indices, n_points):
                return None
            joint_indices = joint_indices[face_vertex_indices]
            joint_weights = joint_weights[face_vertex_indices]
        if len(joint_indices) != len(values):
            return None
        mapper = self.query.GetJointMapper()
        if mapper and not mapper.IsIdentity():
            joints = mapper.RemapTransforms(joints, Vt.Matrix4dArray())
        posed = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values))
        done = UsdSkel.SkinNormals(
            self.query.GetSkinningMethod(),
            _normal_matrix(self.query.GetGeomBindTransform(self.time)),
            Vt.Matrix3dArray([_normal_matrix(m) for m in joints]),
            Vt.IntArray.FromNumpy(np.ascontiguousarray(joint_indices.reshape(-1))),
            Vt.FloatArray.FromNumpy(np.ascontiguousarray(joint_weights.reshape(-1))),
            joint_indices.shape[1],
            posed,
        )
        if not done:
            return None
        return payload.Primvar(
            name=normals.name,
            width=3,
            interpolation=normals.interpolation,
            values=np.asarray(posed).reshape(-1),
        )


def find_skinned(cx: Context, root: Usd.Prim) -> None:
    """Note every skinned prim below a SkelRoot."""
    cache = UsdSkel.Cache()
    skel_root = UsdSkel.Root(root)
    predicate = Usd.TraverseInstanceProxies()
    cache.Populate(skel_root, predicate)
    for binding in cache.ComputeSkelBindings(skel_root, predicate):
        skeleton = cache.GetSkelQuery(binding.GetSkeleton())
        if not skeleton:
            cx.notes.add("Skeleton is invalid: its meshes stay at rest", root)
            continue
        for query in binding.GetSkinningTargets():
            prim = query.GetPrim()
            cx.skins[prim.GetPath()] = Skinning(prim, query, skeleton, cx.time)


def _normal_matrix(m: Gf.Matrix4d) -> Gf.Matrix3d:
    return m.ExtractRotationMatrix().GetInverse().GetTranspose()
