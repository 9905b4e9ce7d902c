//! With `noise`, sampling stops where the picture is clean, says so, and is as wrong as it says.

use kilauea_math::Spectrum;
use kilauea_render::{Conditions, PreparedScene};
use kilauea_scene::{Light, RenderSettings, Shading};
use kilauea_tests::{Picture, Stage, rect_light};
use std::sync::Arc;

const THRESHOLD: f32 = 0.05;

/// A glossy ball on a floor beside a wall, under a lamp.
fn prepared() -> Arc<PreparedScene> {
    let mut stage = Stage::sphere_beside_wall();
    stage.lights = vec![Light {
        radiance: Spectrum::splat(20.0),
        ..rect_light(0.5, 0.5, 2.0)
    }];
    stage.prepare(&settings(None))
}

fn settings(noise: Option<f32>) -> RenderSettings {
    RenderSettings {
        // More than one tile, of which some are narrow.
        resolution: [48, 40],
        samples_per_pixel: 128,
        max_depth: 4,
        noise,
        ..Stage::settings()
    }
}

fn luminance(picture: &Picture) -> Vec<f64> {
    let [r, g, b] = ["R", "G", "B"].map(|channel| picture.channel(channel));
    let of_pixel =
        |i: usize| 0.2126 * f64::from(r[i]) + 0.7152 * f64::from(g[i]) + 0.0722 * f64::from(b[i]);
    (0..r.len()).map(of_pixel).collect()
}

#[test]
fn the_error_is_what_it_is_said_to_be() {
    let prepared = prepared();
    let adaptive = Picture::render(&prepared, settings(Some(THRESHOLD)));
    let n_pixels = adaptive.channel("R").len();
    let n_stopped = adaptive.stats.pixels_stopped as usize;
    assert!(n_stopped > n_pixels / 4, "{n_stopped} pixels stopped");
    assert!(
        n_stopped < n_pixels,
        "there is noise that takes more samples"
    );
    assert!(adaptive.stats.is_complete);
    let counts = adaptive.channel("sample_count");
    let n_samples: f64 = counts.iter().map(|&n| f64::from(n)).sum();
    assert_eq!(n_samples, adaptive.stats.samples as f64);
    assert!(counts.iter().all(|&n| n >= 16.0));

    let full = RenderSettings {
        seed: 1,
        samples_per_pixel: 512,
        ..settings(None)
    };
    let full = Picture::render(&prepared, full);
    let (found, truth) = (luminance(&adaptive), luminance(&full));
    let (mut n_beyond, mut relative_sq) = ([0.0; 2], 0.0);
    for i in 0..n_pixels {
        let variance = |picture: &Picture| f64::from(picture.channel("variance")[i]);
        let error_sq = (found[i] - truth[i]).powi(2);
        let estimate_sq = variance(&adaptive) + variance(&full);
        for (n, widths) in n_beyond.iter_mut().zip([1.0_f64, 2.0]) {
            *n += f64::from(u8::from(error_sq > widths.powi(2) * estimate_sq));
        }
        if counts[i] < 128.0 {
            let excess_sq = error_sq - variance(&full);
            relative_sq += excess_sq / (truth[i] * truth[i] + 0.01) / n_stopped as f64;
        }
    }
    // Of normal errors, 32 % are beyond one standard error and 5 % beyond two.
    let shares = n_beyond.map(|n| n / n_pixels as f64);
    assert!(shares[0] < 0.37 && shares[1] < 0.08, "{shares:?}");
    assert!(relative_sq.sqrt() < f64::from(THRESHOLD), "{relative_sq}");
}

#[test]
fn what_stops_does_not_depend_on_threads() {
    let prepared = prepared();
    let settings = RenderSettings {
        samples_per_pixel: 32,
        ..settings(Some(THRESHOLD))
    };
    let expected = Picture::render(&prepared, settings.clone());
    assert!(expected.stats.pixels_stopped > 0);
    for (threads, shading) in [(3, Shading::Inline), (2, Shading::Queued)] {
        let settings = RenderSettings {
            threads,
            shading,
            ..settings.clone()
        };
        let picture = Picture::render(&prepared, settings);
        let what = format!("{threads} threads, {shading:?}");
        picture.check_same_bits(&expected, &what);
        assert_eq!(
            picture.stats.pixels_stopped, expected.stats.pixels_stopped,
            "{what}"
        );
    }
    let plain = Conditions {
        plain_loop: true,
        ..Conditions::default()
    };
    let picture = Picture::render_under(plain, &prepared, settings);
    picture.check_same_bits(&expected, "plain loop");
}

#[test]
fn what_is_never_clean_gets_all_samples() {
    let prepared = prepared();
    let few = |noise| RenderSettings {
        samples_per_pixel: 20,
        // Noise is known even where no layer shows it.
        aovs: vec!["sample_count".into()],
        ..settings(noise)
    };
    let all = Picture::render(&prepared, few(None));
    let picture = Picture::render(&prepared, few(Some(1e-6)));
    picture.check_same_bits(&all, "no pixel stops");
    assert_eq!(picture.stats.pixels_stopped, 0);
}
