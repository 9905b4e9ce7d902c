//! What an image file says about the frame besides its pixels.

use std::collections::BTreeMap;
use std::time::{Duration, SystemTime};

use kilauea_math::{DMat4, DVec3};
use kilauea_scene::{Camera, Projection};

/// Facts for the header of an EXR file.
#[derive(Clone, Debug)]
pub struct ImageMetadata {
    /// World-space point that engine-space positions are relative to.
    pub origin_world: DVec3,
    /// Width of a pixel over its height.
    pub pixel_aspect_ratio: f32,
    /// Gives `worldToCamera`, `worldToNDC` and the screen window.
    pub camera: Option<Camera>,
    /// Frame rate; written as a fraction.
    pub frames_per_second: Option<f64>,
    /// When the frame was rendered; `capDate`, in UTC. Absent, two renders of a frame have equal
    /// headers.
    pub capture_time: Option<SystemTime>,
    /// How long the frame took; `renderTime` in seconds.
    pub render_time: Option<Duration>,
    /// How the pixels are packed.
    pub packing: Packing,
    /// Store radiance in half precision, with 65504 as the largest value.
    pub half_radiance: bool,
    /// Texts by attribute name, `kilauea/stats` for one.
    pub attributes: BTreeMap<String, String>,
}

impl Default for ImageMetadata {
    fn default() -> Self {
        Self {
            origin_world: DVec3::ZERO,
            pixel_aspect_ratio: 1.0,
            camera: None,
            frames_per_second: None,
            capture_time: None,
            render_time: None,
            packing: Packing::default(),
            half_radiance: false,
            attributes: BTreeMap::new(),
        }
    }
}

/// Time against size of an EXR file; the pixels read back are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Packing {
    /// ZIP, one line at a time, as compositors read it best. On a noisy picture with all layers,
    /// 16 lines at a time took 2.4 times as long for the same size.
    #[default]
    Small,
    /// Run lengths: four times as fast as ZIP for a third more bytes.
    Fast,
}

/// A camera as the OpenEXR standard attributes describe it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ExrCamera {
    /// Left-handed: x right, y up, z forwards.
    pub(crate) world_to_camera: [f32; 16],
    /// (0, 0) at the upper left and (1, 1) at the lower right corner of the display window, after
    /// division by w; depth 0 at the near and 1 at the far plane.
    pub(crate) world_to_ndc: [f32; 16],
    /// Center of the display window at distance one, in a space where its y points up.
    pub(crate) screen_window_center: [f32; 2],
    /// Width of the display window at distance one.
    pub(crate) screen_window_width: f32,
}

impl ExrCamera {
    /// OpenEXR multiplies row vectors from the left and stores row after row, which is column
    /// after column of our matrices.
    pub(crate) fn new(camera: &Camera) -> Self {
        let exr_camera_from_camera = DMat4::from_scale(DVec3::new(1.0, 1.0, -1.0));
        let camera_from_world = exr_camera_from_camera * camera.world_from_camera.inverse();
        let ndc_from_world = ndc_from_camera(camera) * camera_from_world;
        let [left, bottom, right, top] = camera.screen_window;
        Self {
            world_to_camera: camera_from_world.as_mat4().to_cols_array(),
            world_to_ndc: ndc_from_world.as_mat4().to_cols_array(),
            screen_window_center: [(left + right) * 0.5, (bottom + top) * 0.5].map(|v| v as f32),
            screen_window_width: (right - left) as f32,
        }
    }
}

/// From the left-handed camera space to the unit square of the display window.
fn ndc_from_camera(camera: &Camera) -> DMat4 {
    let [left, bottom, right, top] = camera.screen_window;
    let [near, far] = camera.clipping_range;
    let (scale_x, scale_y) = (1.0 / (right - left), 1.0 / (bottom - top));
    let (shift_x, shift_y) = (-left * scale_x, -top * scale_y);
    let depth = 1.0 / (far - near);
    match camera.projection {
        // What is shifted is multiplied by z, as the division by w = z follows.
        Projection::Perspective => DMat4::from_cols_array_2d(&[
            [scale_x, 0.0, 0.0, 0.0],
            [0.0, scale_y, 0.0, 0.0],
            [shift_x, shift_y, far * depth, 1.0],
            [0.0, 0.0, -far * near * depth, 0.0],
        ]),
        Projection::Orthographic => DMat4::from_cols_array_2d(&[
            [scale_x, 0.0, 0.0, 0.0],
            [0.0, scale_y, 0.0, 0.0],
            [0.0, 0.0, depth, 0.0],
            [shift_x, shift_y, -near * depth, 1.0],
        ]),
    }
}

/// A frame rate as a fraction; the NTSC rates are 1000/1001 of a whole number.
pub(crate) fn fraction(frames_per_second: f64) -> Option<(i32, u32)> {
    if !(frames_per_second > 0.0 && frames_per_second < 1e6) {
        return None;
    }
    let whole = frames_per_second.round();
    let is = |rate: f64| (frames_per_second - rate).abs() < 1e-3 * rate * 0.5;
    Some(if (frames_per_second - whole).abs() < 1e-6 * whole {
        (whole as i32, 1)
    } else if is(whole * 1000.0 / 1001.0) {
        (whole as i32 * 1000, 1001)
    } else {
        ((frames_per_second * 1000.0).round() as i32, 1000)
    })
}

/// `YYYY:MM:DD hh:mm:ss` in UTC, as `capDate` has it.
pub(crate) fn cap_date(time: SystemTime) -> String {
    let seconds = time
        .duration_since(SystemTime::UNIX_EPOCH)
        .map_or(0, |since| since.as_secs());
    let (days, of_day) = (seconds / 86_400, seconds % 86_400);

    // Proleptic Gregorian date; years begin in March so that the leap day comes last. Days are
    // counted from 0000-03-01 (719468 days before 1970).
    let days = days + 719_468;
    let era = days / 146_097;
    let of_era = days % 146_097;
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = (month_from_march + 2) % 12 + 1;
    let year = era * 400 + year_of_era + u64::from(month <= 2);

    let (hour, minute, second) = (of_day / 3600, of_day / 60 % 60, of_day % 60);
    format!("{year:04}:{month:02}:{day:02} {hour:02}:{minute:02}:{second:02}")
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn camera(projection: Projection) -> Camera {
        Camera {
            // At (10, 20, 30), looking along -x, up +z.
            world_from_camera: DMat4::from_cols_array_2d(&[
                [0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, 1.0, 0.0],
                [1.0, 0.0, 0.0, 0.0],
                [10.0, 20.0, 30.0, 1.0],
            ]),
            projection,
            screen_window: [-0.5, -0.25, 1.5, 0.75],
            focus_distance: 5.0,
            clipping_range: [1.0, 100.0],
            ..Camera::default()
        }
    }

    /// A point times a matrix, written as row vectors.
    fn times(p: [f64; 3], matrix: [f32; 16]) -> [f64; 3] {
        let row = [p[0], p[1], p[2], 1.0];
        let column =
            |j: usize| -> f64 { (0..4).map(|i| row[i] * f64::from(matrix[4 * i + j])).sum() };
        [0, 1, 2].map(|j| column(j) / column(3))
    }

    fn check_near(found: [f64; 3], expected: [f64; 3]) {
        for (f, e) in found.iter().zip(expected) {
            assert!((f - e).abs() < 1e-4, "{found:?} instead of {expected:?}");
        }
    }

    #[test]
    fn camera_space_is_left_handed() {
        let exr = ExrCamera::new(&camera(Projection::Perspective));
        check_near(times([10.0, 20.0, 30.0], exr.world_to_camera), [0.0; 3]);
        // Four ahead, one to the right, two up.
        check_near(
            times([6.0, 21.0, 32.0], exr.world_to_camera),
            [1.0, 2.0, 4.0],
        );
    }

    #[test]
    fn the_window_corners_are_the_unit_square() {
        for (projection, spread) in [
            (Projection::Perspective, 4.0),
            (Projection::Orthographic, 1.0),
        ] {
            let exr = ExrCamera::new(&camera(projection));
            // A point on the screen window, four units ahead.
            let at = |x: f64, y: f64| {
                let [x, y, _] = times(
                    [6.0, 20.0 + spread * x, 30.0 + spread * y],
                    exr.world_to_ndc,
                );
                [x, y, 0.0]
            };
            check_near(at(-0.5, 0.75), [0.0, 0.0, 0.0]);
            check_near(at(1.5, -0.25), [1.0, 1.0, 0.0]);
            check_near(at(0.5, 0.25), [0.5, 0.5, 0.0]);

            let depth = |distance: f64| times([10.0 - distance, 20.0, 30.0], exr.world_to_ndc)[2];
            check_near([depth(1.0), depth(100.0), 0.0], [0.0, 1.0, 0.0]);
        }
    }

    #[test]
    fn frame_rates_are_fractions() {
        for (fps, expected) in [
            (24.0, Some((24, 1))),
            (23.976, Some((24_000, 1001))),
            (30_000.0 / 1001.0, Some((30_000, 1001))),
            (59.94, Some((60_000, 1001))),
            (12.5, Some((12_500, 1000))),
            (0.0, None),
            (f64::NAN, None),
        ] {
            assert_eq!(fraction(fps), expected, "{fps}");
        }
    }

    #[test]
    fn dates_are_the_calendars() {
        for (seconds, expected) in [
            (0, "1970:01:01 00:00:00"),
            (951_782_399, "2000:02:28 23:59:59"),
            (951_782_400, "2000:02:29 00:00:00"),
            (1_709_251_199, "2024:02:29 23:59:59"),
            (1_767_225_599, "2025:12:31 23:59:59"),
            (4_107_542_400, "2100:03:01 00:00:00"),
        ] {
            let time = SystemTime::UNIX_EPOCH + Duration::from_secs(seconds);
            assert_eq!(cap_date(time), expected);
        }
    }
}
