use kilauea_math::DMat4;
use serde::{Deserialize, Serialize};

use crate::SceneError;

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

/// A pinhole at the origin, whose window is a unit wide at distance one.
impl Default for Camera {
    fn default() -> Self {
        Self {
            path: "/camera".into(),
            world_from_camera: DMat4::IDENTITY,
            later_world_from_camera: Vec::new(),
            shutter: [0.0; 2],
            projection: Projection::Perspective,
            screen_window: [-0.5, -0.5, 0.5, 0.5],
            lens_radius: 0.0,
            focus_distance: 0.0,
            clipping_range: [0.01, 1e6],
            exposure_scale: 1.0,
        }
    }
}

impl Camera {
    /// Checks that all of it is numbers. What those say may be as odd as it likes.
    ///
    /// # Errors
    /// Names the camera and the attribute that is not finite.
    pub fn check(&self) -> Result<(), SceneError> {
        let mut matrices =
            std::iter::once(&self.world_from_camera).chain(&self.later_world_from_camera);
        let are_finite = [
            ("xformOps", matrices.all(DMat4::is_finite)),
            ("shutter", self.shutter.iter().all(|t| t.is_finite())),
            ("aperture", self.screen_window.iter().all(|x| x.is_finite())),
            (
                "clippingRange",
                !self.clipping_range.iter().any(|x| x.is_nan()),
            ),
            ("fStop", self.lens_radius.is_finite()),
            ("focusDistance", self.focus_distance.is_finite()),
            ("exposure", self.exposure_scale.is_finite()),
        ];
        match are_finite.iter().find(|(_, is_finite)| !is_finite) {
            None => Ok(()),
            Some((attribute, _)) => Err(SceneError::Value {
                path: self.path.clone(),
                attribute: (*attribute).into(),
                reason: "not finite".into(),
            }),
        }
    }
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
