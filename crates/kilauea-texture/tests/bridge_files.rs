//! Reads a tile file that the USD bridge wrote; the bridge's tests write the same bytes.

use kilauea_math::Vec2;
use kilauea_scene::{TextureFile, TextureSource};
use kilauea_texture::{TextureStore, Wrap};

/// Texel (x, y), rows from the top, is red x, green 100 y, blue 200 in sRGB, alpha x + y.
#[test]
fn reads_what_the_bridge_writes() {
    let source = TextureSource {
        path: "grid.png".into(),
        files: vec![TextureFile {
            udim: 0,
            tiles: concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/grid.tiles").into(),
        }],
    };
    let (store, errors) = TextureStore::open(&[source], 1 << 20);
    assert!(errors.is_empty(), "{errors:?}");
    assert_eq!(store.resolution(0), Some([70, 2]));
    assert_eq!(store.n_levels(0), Some(7));
    for (x, y) in [(0, 0), (69, 0), (0, 1), (63, 1), (64, 1), (69, 1)] {
        let st = Vec2::new((x as f32 + 0.5) / 70.0, 1.0 - (y as f32 + 0.5) * 0.5);
        let texel = store.sample(0, st, 0.0, [Wrap::Clamp; 2]).unwrap();
        let alpha = (x + y) as f32 / 255.0;
        let expected = [linear(x), linear(100 * y), linear(200), alpha];
        for (t, e) in texel.iter().zip(expected) {
            assert!((t - e).abs() < 1e-5, "({x}, {y}): {texel:?}");
        }
    }
    // The mean of green, 0 and 100, is that of the light, code 71.
    let coarsest = store.read_level(0, 6).unwrap();
    assert!((coarsest.texels[0][1] - linear(71)).abs() < 1e-6);
}

/// IEC 61966-2-1.
fn linear(code: u32) -> f32 {
    let encoded = code as f32 / 255.0;
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}
