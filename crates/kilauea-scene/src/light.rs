use kilauea_math::{DMat4, Spectrum};
use serde::{Deserialize, Serialize};

/// A light source; emission from meshes comes from their materials instead.
///
/// Lights emit and are seen, and do not block other light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Light {
    /// Source prim.
    pub path: String,
    /// Shape in light space; area lights face −z.
    pub shape: LightShape,
    /// From light space to world space, column vectors, may scale.
    pub world_from_light: DMat4,
    /// Emitted radiance in nits: color, intensity, exposure, temperature and `normalize` are
    /// already multiplied in. For [`LightShape::Dome`] it multiplies the texture.
    pub radiance: Spectrum,
    /// Index into [`crate::Scene::textures`]: lat-long for domes, stretched over a rect.
    pub texture: Option<u32>,
    /// Multiplies what diffuse lobes reflect of this light.
    pub diffuse: f32,
    /// Multiplies what specular lobes reflect of this light.
    pub specular: f32,
    /// Absent where no ShapingAPI is applied.
    pub shaping: Option<Shaping>,
    /// Whether camera rays see it.
    pub visible_to_camera: bool,
}

/// Shapes of [`Light`], in light space.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum LightShape {
    /// In the xy plane, centred, emitting toward −z.
    Rect {
        /// Along x.
        width: f64,
        /// Along y.
        height: f64,
    },
    /// In the xy plane, centred, emitting toward −z.
    Disk {
        /// Radius.
        radius: f64,
    },
    /// Centred, emitting outward.
    Sphere {
        /// Radius; zero is a point of no light.
        radius: f64,
    },
    /// Along x, centred, emitting outward from its side; no caps.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Along x.
        length: f64,
    },
    /// Infinitely far, shining toward −z.
    Distant {
        /// Angular diameter.
        angle_degrees: f64,
    },
    /// Infinitely far, all around; texture centre toward +z, +y up, +x at a quarter turn.
    Dome,
}

/// UsdLuxShapingAPI.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shaping {
    /// Half angle around the light's −z beyond which nothing is emitted.
    pub cone_angle_degrees: f32,
    /// 0 is a hard edge, 1 fades from the axis on.
    pub cone_softness: f32,
    /// Exponent of the cosine to the axis; 0 leaves emission as it is.
    pub focus: f32,
    /// What is left where `focus` removes light.
    pub focus_tint: Spectrum,
}
