use glam::Vec3;

/// A right-handed orthonormal basis; local +z is the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Local x in the outer space.
    pub x: Vec3,
    /// Local y in the outer space.
    pub y: Vec3,
    /// Local z, the normal, in the outer space.
    pub z: Vec3,
}

impl Frame {
    /// A frame around the unit vector `z`, without a branch on its direction
    /// (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
    #[inline]
    pub fn from_z(z: Vec3) -> Self {
        let sign = 1.0_f32.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Self {
            x: Vec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: Vec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// A direction of the outer space in this frame.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }

    /// A direction of this frame in the outer space.
    #[inline]
    pub fn from_local(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn from_z_is_orthonormal_and_right_handed() {
        for z in [
            Vec3::Z,
            -Vec3::Z,
            Vec3::X,
            Vec3::new(1e-4, -2e-4, -1.0),
            Vec3::ONE,
        ] {
            let f = Frame::from_z(z.normalize());
            assert!(f.x.cross(f.y).distance(f.z) < 1e-6);
            assert!((f.x.length() - 1.0).abs() < 1e-6 && (f.y.length() - 1.0).abs() < 1e-6);
            let v = Vec3::new(0.3, -0.7, 0.2);
            assert!(f.from_local(f.to_local(v)).distance(v) < 1e-6);
        }
    }
}
