use kilauea_math::DMat4;
use serde::{Deserialize, Serialize};

/// Where the picture is taken from. Looks along −z of camera space, +y up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Source prim, or a word for the default framing.
    pub path: String,
    /// From camera space to world space, column vectors.
    pub world_from_camera: DMat4,
    /// The same at the later motion keys, evenly spaced over the shutter and linear in between;
    /// empty where the camera stands still. `world_from_camera` is the first key then.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub later_world_from_camera: Vec<DMat4>,
    /// When the shutter opens and closes, in time codes relative to the frame; equal where nothing
    /// blurs. All motion keys of a scene span this interval.
    #[serde(default)]
    pub shutter: [f64; 2],
    /// How the screen window maps to rays.
    pub projection: Projection,
    /// (left, bottom, right, top) of the display window: on the plane at distance one for
    /// perspective, in scene units for orthographic. Aperture offsets and the conform policy are
    /// already applied.
    pub screen_window: [f64; 4],
    /// Scene units; zero is a pinhole.
    pub lens_radius: f64,
    /// Scene units along −z to the plane in focus.
    pub focus_distance: f64,
    /// (near, far) in scene units; nothing outside is seen by camera rays.
    pub clipping_range: [f64; 2],
    /// Multiplies every radiance on its way into the film.
    pub exposure_scale: f32,
}

/// Projections of [`Camera`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Projection {
    /// Rays from one point (or lens).
    Perspective,
    /// Parallel rays.
    Orthographic,
}
