use kilauea_math::hash::mix32;
use kilauea_math::{Spectrum, Vec3};

/// Where squared distances between photons would leave the range of `f32`.
const MAX_COORDINATE: f32 = 1e18;

/// Where sums of powers could leave the range of `f32`.
const MAX_POWER: f32 = 1e30;

/// How far the length of a direction may be from one.
const UNIT_TOLERANCE: f32 = 1e-3;

/// Light that arrived somewhere, as a tracer hands it over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Photon {
    /// Where it arrived, in the space in which the engine traces rays.
    pub p: Vec3,
    /// Flux that it stands for in W, already divided by the number of paths that were emitted: the
    /// sum over photons is the flux that arrives.
    pub power: Spectrum,
    /// Unit direction to where it came from.
    pub wi: Vec3,
    /// Unit geometric normal on the side where it arrived: `wi · n >= 0`.
    pub n: Vec3,
    /// Which light it is from.
    pub light_idx: u32,
    /// What its path was like.
    pub class: PhotonClass,
    /// Which path it belongs to: together with `depth` what tells it from all others of a map.
    pub path_idx: u32,
    /// How many surfaces its path had met before.
    pub depth: u16,
}

/// What a photon's path was like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PhotonClass {
    /// Straight from the light through one or more near-specular surfaces (L S⁺ D).
    Caustic {
        /// Density with which other strategies make this path, over that of the photon, for one
        /// unit of the density with which the eye samples `wi`, in m² sr: what
        /// [`LightSubpath::d_eye`](crate::LightSubpath::d_eye) says. Zero where no other strategy
        /// can.
        d_eye: f32,
    },
    /// Any other path.
    Global,
}

impl Photon {
    /// Whether everything is finite, directions have length one, and nothing is negative or
    /// astronomic (positions beyond 1e18, powers beyond 1e30).
    pub fn is_valid(&self) -> bool {
        let is_unit = |v: Vec3| (v.length() - 1.0).abs() <= UNIT_TOLERANCE;
        // A NaN fails every comparison.
        self.p.abs().cmple(Vec3::splat(MAX_COORDINATE)).all()
            && self
                .power
                .to_array()
                .iter()
                .all(|c| (0.0..=MAX_POWER).contains(c))
            && is_unit(self.wi)
            && is_unit(self.n)
            && (0.0..f32::INFINITY).contains(&self.d_eye())
    }

    /// The density that caustic photons carry; zero for others.
    pub(crate) fn d_eye(&self) -> f32 {
        match self.class {
            PhotonClass::Caustic { d_eye } => d_eye,
            PhotonClass::Global => 0.0,
        }
    }

    /// What tells it from all other photons, and orders those at one place.
    pub(crate) fn key(&self) -> u64 {
        u64::from(self.path_idx) << 16 | u64::from(self.depth)
    }

    /// Random bits of its own.
    pub(crate) fn hash(&self) -> u32 {
        mix32(self.path_idx ^ mix32(u32::from(self.depth).wrapping_add(0x9e37_79b9)))
    }
}
