use std::borrow::Cow;

use kilauea_accel::PlacementError;
use kilauea_math::{Bounds3, DAffine3, DVec3, Mat3, Vec3};
use kilauea_scene::Visibility;

use super::keys::{TransformKeys, key_before};

/// A prototype placed in engine space.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub(super) prototype: u32,
    pub(super) motion: PlacedMotion,
    /// Index into the geometry's slots of the prototype's first chunk.
    pub(super) first_slots: u32,
    /// Which per-instance primvars apply: prototype, its instances, and the index in them.
    pub(super) attributes: Option<(u32, u32, u32)>,
    pub(super) visibility: Visibility,
    /// Number of the placement among all that are not the world: the instanceId.
    pub(super) instance_id: i32,
}

/// Where a placement is at any time.
#[derive(Clone, Debug)]
pub(super) enum PlacedMotion {
    Still(EngineTransform),
    /// By motion key.
    Moving(Box<[EngineTransform]>),
}

/// Takes a chunk's positions to engine space.
#[derive(Clone, Copy, Debug)]
pub(super) struct EngineTransform {
    engine_from_chunk: DAffine3,
    is_identity: bool,
    error: PlacementError,
    /// Matrix of `engine_from_chunk`.
    linear: Mat3,
    /// −1 where it mirrors.
    handedness: f32,
}

impl PlacedMotion {
    pub(super) fn new(engine_from_chunk: &TransformKeys) -> Self {
        match engine_from_chunk {
            TransformKeys::Still(transform) => Self::Still(EngineTransform::new(transform)),
            TransformKeys::Moving(keys) => {
                Self::Moving(keys.iter().map(EngineTransform::new).collect())
            }
        }
    }

    /// The transform at a time in [0, 1].
    #[inline]
    pub(super) fn at(&self, time: f32) -> Cow<'_, EngineTransform> {
        match self {
            Self::Still(transform) => Cow::Borrowed(transform),
            Self::Moving(keys) => {
                let (before, share) = key_before(keys.len(), time);
                Cow::Owned(keys[before].toward(&keys[before + 1], share))
            }
        }
    }

    /// Around what fills `bounds` before it is placed, at all times.
    pub(super) fn bounds(&self, bounds: &Bounds3) -> Bounds3 {
        /// Of what boxes of trees may be larger than what is in them, some times over.
        const MARGIN: f32 = 64.0 * f32::EPSILON;
        let keys = match self {
            Self::Still(transform) => std::slice::from_ref(transform),
            Self::Moving(keys) => keys,
        };
        let (low, high) = (bounds.min, bounds.max);
        let corners = (0..8).map(|corner| {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { low } else { high }[axis];
            Vec3::new(pick(0), pick(1), pick(2))
        });
        // Between keys, points are on straight lines between those of the keys.
        let points = corners.flat_map(|p| keys.iter().map(move |key| key.point(p)));
        let placed = Bounds3::from_points(points);
        let reach = placed.min.abs().max(placed.max.abs()).max_element();
        let margin = MARGIN * (reach + placed.diagonal().max_element());
        Bounds3 {
            min: placed.min - margin,
            max: placed.max + margin,
        }
    }

    pub(super) fn is_moving(&self) -> bool {
        matches!(self, Self::Moving(_))
    }
}

impl EngineTransform {
    fn new(engine_from_chunk: &DAffine3) -> Self {
        let linear = engine_from_chunk.matrix3;
        let is_identity = *engine_from_chunk == DAffine3::IDENTITY;
        Self {
            engine_from_chunk: *engine_from_chunk,
            is_identity,
            error: if is_identity {
                PlacementError::NONE
            } else {
                PlacementError::of(engine_from_chunk)
            },
            linear: linear.as_mat3(),
            handedness: if linear.determinant() < 0.0 {
                -1.0
            } else {
                1.0
            },
        }
    }

    fn toward(&self, next: &Self, share: f32) -> Self {
        let (share, a, b) = (
            f64::from(share),
            &self.engine_from_chunk,
            &next.engine_from_chunk,
        );
        Self::new(&DAffine3 {
            matrix3: a.matrix3 * (1.0 - share) + b.matrix3 * share,
            translation: a.translation.lerp(b.translation, share),
        })
    }

    /// A point in engine space before it is rounded, as the acceleration structure places it.
    #[inline]
    pub(super) fn exact_point(&self, p: Vec3) -> DVec3 {
        if self.is_identity {
            p.as_dvec3()
        } else {
            self.engine_from_chunk.transform_point3(p.as_dvec3())
        }
    }

    /// A point in engine space.
    #[inline]
    pub(super) fn point(&self, p: Vec3) -> Vec3 {
        self.exact_point(p).as_vec3()
    }

    /// What placing loses of triangles' points.
    #[inline]
    pub(super) fn error(&self) -> &PlacementError {
        &self.error
    }

    #[inline]
    pub(super) fn vector(&self, v: Vec3) -> Vec3 {
        if self.is_identity { v } else { self.linear * v }
    }

    /// A normal in engine space, up to its length.
    #[inline]
    pub(super) fn normal(&self, n: Vec3) -> Vec3 {
        if self.is_identity {
            return n;
        }
        let m = &self.linear;
        let cofactor = Mat3::from_cols(
            m.y_axis.cross(m.z_axis),
            m.z_axis.cross(m.x_axis),
            m.x_axis.cross(m.y_axis),
        );
        (cofactor * n) * self.handedness
    }

    /// A point of engine space as the chunk's positions have it.
    #[inline]
    pub(super) fn point_of_chunk(&self, p: Vec3) -> Vec3 {
        if self.is_identity {
            p
        } else {
            let from_origin = p.as_dvec3() - self.engine_from_chunk.translation;
            (self.engine_from_chunk.matrix3.inverse() * from_origin).as_vec3()
        }
    }

    #[inline]
    pub(super) fn handedness(&self) -> f32 {
        self.handedness
    }

    /// The largest coordinate that placing adds; zero where it does nothing.
    #[inline]
    pub(super) fn reach(&self) -> f32 {
        if self.is_identity {
            0.0
        } else {
            self.engine_from_chunk.translation.abs().max_element() as f32
        }
    }
}
