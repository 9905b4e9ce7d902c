//! Forecasts: what cells would bring is told by records of paths that had none.

#![forbid(unsafe_code)]

use kilauea_gather::{
    Arrival, GatherField, GatherRecord, PictureEstimate, PictureSample, forecast,
};
use kilauea_math::{Frame, Vec2, Vec3, warp};
use kilauea_testing::uniforms;

const SIDE: i32 = 64;
const SHARE: f32 = 0.5;

fn picture() -> PictureEstimate {
    let pixels = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| [x, y]));
    let samples: Vec<PictureSample> = pixels
        .map(|pixel| PictureSample {
            pixel,
            luminance: 1.0,
            n_rays: 1.0,
        })
        .collect();
    PictureEstimate::fit([0; 2], [SIDE; 2], &samples).expect("there is light")
}

/// What cosine-distributed directions find of light within a cone about the zenith of a floor, and of
/// `noise` about that.
fn records(stream: u32, n: u32, cos_cone: f32, noise: impl Fn(u32) -> f32) -> Vec<GatherRecord> {
    let frame = Frame::from_z(Vec3::Y);
    (0..n)
        .map(|i| {
            let [a, b, x, z] = uniforms(stream, i);
            let wi = frame.from_local(warp::cosine_hemisphere(Vec2::new(a, b)));
            let found = if wi.y > cos_cone { noise(i) } else { 0.0 };
            GatherRecord {
                p: Vec3::new(x, 0.0, z),
                n: Vec3::Y,
                arrival: Arrival {
                    wi,
                    irradiance: std::f32::consts::PI * found,
                    pdf: warp::cosine_hemisphere_pdf(wi.y),
                },
                pixel: [i as i32 % SIDE, i as i32 / SIDE % SIDE],
                brought: found,
            }
        })
        .collect()
}

/// The second moment that plain paths have over that of paths which really draw from cells of other
/// records.
fn gain(n_records: u32, cos_cone: f32) -> f32 {
    let others = records(4, n_records, cos_cone, |_| 1.0);
    let field = GatherField::fit(&others).expect("there are records");
    let frame = Frame::from_z(Vec3::Y);
    let (mut plain, mut guided) = (0.0_f64, 0.0_f64);
    for i in 0..40_000 {
        let [a, b, x, z, choice] = uniforms(5, i);
        let tree = field.directions(Vec3::new(x, 0.0, z), Vec3::Y);
        let tree = tree.expect("light arrives everywhere");
        let u = Vec2::new(a, b);
        let by_cosine = frame.from_local(warp::cosine_hemisphere(u));
        plain += f64::from(u8::from(by_cosine.y > cos_cone));
        let wi = if choice < SHARE {
            tree.sample(u)
        } else {
            by_cosine
        };
        if wi.y > cos_cone {
            let pdf = warp::cosine_hemisphere_pdf(wi.y);
            let mixed = (1.0 - SHARE) * pdf + SHARE * tree.pdf(wi);
            guided += f64::from(pdf / mixed).powi(2);
        }
    }
    (plain / guided) as f32
}

#[test]
fn what_is_promised_is_what_guided_paths_gain() {
    for cos_cone in [0.95, 0.9] {
        let records = records(3, 40_000, cos_cone, |_| 1.0);
        let promised = forecast(&records, &picture(), SHARE).expect("light is found");
        let gained = gain(20_000, cos_cone);
        assert!(gained > 1.5, "{gained}");
        let ratio = promised / gained;
        assert!((ratio - 1.0).abs() < 0.1, "{promised}, {gained}");
    }
}

#[test]
fn noise_is_not_taken_for_knowledge() {
    // One direction in fifty brings all the light, whichever it is.
    let rare = |i: u32| {
        if uniforms::<1>(9, i)[0] < 0.02 {
            4.0
        } else {
            0.0
        }
    };
    let found = forecast(&records(3, 4_000, 0.0, rare), &picture(), SHARE).expect("light is found");
    assert!(found < 1.0, "{found}");
}

#[test]
fn where_nothing_is_found_nothing_is_told() {
    assert_eq!(forecast(&[], &picture(), SHARE), None);
    let dark = records(3, 1_000, 0.9, |_| 0.0);
    assert_eq!(forecast(&dark, &picture(), SHARE), None);
}
