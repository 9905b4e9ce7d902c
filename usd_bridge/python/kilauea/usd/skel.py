"""UsdSkel: meshes posed by a skeleton and blend shapes at the frame's time."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt

from kilauea import payload
from kilauea.usd import primvars
from kilauea.usd.arrays import indices_within, read_points
from kilauea.usd.context import Context, Space
from kilauea.usd.moving_space import transform_attributes, world_from


@dataclass(slots=True)
class Skinning:
    """How one prim follows its skeleton."""

    prim: Usd.Prim
    query: UsdSkel.SkinningQuery
    skeleton: UsdSkel.SkeletonQuery

    def poses(
        self, cx: Context, mesh: UsdGeom.Mesh, face_vertex_indices: Any, space: Space
    ) -> tuple[Gf.Matrix4d, list[payload.MeshKey]]:
        """Return the transform from the first pose to the space, and the poses at their keys."""
        matrices, poses = [], []
        for time in self._times(cx, mesh):
            at = Usd.TimeCode(time)
            points = read_points(mesh.GetPointsAttr(), at)
            normals = primvars.normals(self.prim, mesh, at)
            world_from_points = self._world_from_points(cx.motion.xforms(time), at)
            matrices.append(world_from_points * world_from(cx, space, time).GetInverse())
            poses.append(payload.MeshKey(*self._deform(points, normals, face_vertex_indices, at)))
        for matrix, pose in zip(matrices[1:], poses[1:], strict=True):
            if matrix != matrices[0]:
                _transform(pose, matrix * matrices[0].GetInverse())
        if all(np.array_equal(pose.points, poses[0].points) for pose in poses):
            poses = poses[:1]
        return matrices[0], poses

    def _times(self, cx: Context, mesh: UsdGeom.Mesh) -> list[float]:
        """Return key times; joints turn, so that straight lines need one more."""
        animation = self.skeleton.GetAnimQuery()
        animated = animation.GetPrim().GetAttributes() if animation else []
        placed = transform_attributes(self.skeleton.GetPrim(), with_ancestors=True)
        attributes = [mesh.GetPointsAttr(), *animated, *placed]
        return cx.motion.times(self.prim, attributes, n_intervals=2)

    def _deform(
        self,
        points: Any,
        normals: payload.Primvar | None,
        face_vertex_indices: Any,
        time: Usd.TimeCode,
    ) -> tuple[Any, payload.Primvar | None]:
        """Return posed points and normals, in the space of `_world_from_points`."""
        posed = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points, np.float32))
        if self.query.HasBlendShapes():
            self._apply_blend_shapes(posed, time)
        if self.query.HasJointInfluences() and not self.query.IsRigidlyDeformed():
            joints = self.skeleton.ComputeSkinningTransforms(time)
            if joints and self.query.ComputeSkinnedPoints(joints, posed, time):
                normals = self._skin_normals(joints, normals, len(posed), face_vertex_indices, time)
        return np.asarray(posed), normals

    def _world_from_points(self, xforms: UsdGeom.XformCache, time: Usd.TimeCode) -> Gf.Matrix4d:
        """Return the transform from where `_deform` leaves the points to the world."""
        joints = self.skeleton.ComputeSkinningTransforms(time)
        if not self.query.HasJointInfluences() or not joints:
            return xforms.GetLocalToWorldTransform(self.prim)
        world_from_skel = self._world_from_skeleton(xforms)
        if not self.query.IsRigidlyDeformed():
            return world_from_skel
        return self.query.ComputeSkinnedTransform(joints, time) * world_from_skel

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

    def _apply_blend_shapes(self, points: Vt.Vec3fArray, time: Usd.TimeCode) -> None:
        animation = self.skeleton.GetAnimQuery()
        weights = animation.ComputeBlendShapeWeights(time) if animation else None
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
        time: Usd.TimeCode,
    ) -> payload.Primvar | None:
        """Pose normals given per point or per face corner; others are dropped."""
        if normals is None:
            return None
        values = normals.values.reshape(-1, 3)
        if normals.indices is not None:
            if not indices_within(normals.indices, len(values)):
                return None
            values = values[normals.indices]
        influences = self.query.ComputeVaryingJointInfluences(n_points, time)
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
            _normal_matrix(self.query.GetGeomBindTransform(time)),
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
            cx.skins[prim.GetPath()] = Skinning(prim, query, skeleton)


def _transform(pose: payload.MeshKey, m: Gf.Matrix4d) -> None:
    """Move a pose by a matrix of row vectors."""
    matrix = np.array(m)
    points = pose.points @ matrix[:3, :3] + matrix[3, :3]
    pose.points = np.ascontiguousarray(points, np.float32)
    if pose.normals:
        turned = pose.normals.values.reshape(-1, 3) @ np.array(m.GetInverse())[:3, :3].T
        values = np.ascontiguousarray(turned, np.float32).reshape(-1)
        pose.normals = dataclasses.replace(pose.normals, values=values)


def _normal_matrix(m: Gf.Matrix4d) -> Gf.Matrix3d:
    return m.ExtractRotationMatrix().GetInverse().GetTranspose()
