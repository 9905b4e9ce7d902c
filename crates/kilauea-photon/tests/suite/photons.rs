//! Photons to test with.

use std::num::NonZeroUsize;

use kilauea_math::{Spectrum, Vec2, Vec3, warp};
use kilauea_photon::{Photon, PhotonClass};
use kilauea_testing::uniforms;

/// A photon of one watt at `p`.
pub(crate) fn photon(path_idx: u32, p: Vec3, n: Vec3) -> Photon {
    Photon {
        p,
        power: Spectrum::ONE,
        wi: n,
        n,
        light_idx: 0,
        class: PhotonClass::Global,
        path_idx,
        depth: 0,
    }
}

/// Photons anywhere in the unit cube with normals of any direction, a tenth of them at the place of
/// another.
pub(crate) fn in_cube(n_photons: u32) -> Vec<Photon> {
    let photon_of_path = |i: u32| {
        let [x, y, z] = uniforms(1, if i % 10 == 9 { i - 1 } else { i });
        let n = warp::uniform_sphere(Vec2::from_array(uniforms(2, i)));
        let [r, g, b] = uniforms(3, i);
        Photon {
            power: Spectrum::new(r, g, b),
            light_idx: i % 3,
            class: if i.is_multiple_of(4) {
                PhotonClass::Caustic { d_eye: r }
            } else {
                PhotonClass::Global
            },
            ..photon(i, Vec3::new(x, y, z), n)
        }
    };
    (0..n_photons).map(photon_of_path).collect()
}

/// Photons of one watt evenly on the unit square in z = 0, facing up.
pub(crate) fn on_square(seed: u32, n_photons: u32) -> Vec<Photon> {
    let photon_of_path = |i: u32| {
        let [x, y] = uniforms(seed, i);
        photon(i, Vec3::new(x, y, 0.0), Vec3::Z)
    };
    (0..n_photons).map(photon_of_path).collect()
}

pub(crate) fn count(n: usize) -> NonZeroUsize {
    NonZeroUsize::new(n).expect("not zero")
}
