use kilauea_math::{Spectrum, Vec3};
use kilauea_photon::{DensityRule, PhotonClass, PhotonMap, SurfaceQuery};

/// What merging needs of a caustic photon that lies on the surface of a vertex and in front of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ArrivingPhoton {
    pub(crate) power: Spectrum,
    pub(crate) wi: Vec3,
    pub(crate) d_eye: f32,
    /// Squared distance from the vertex.
    pub(super) d_sq: f32,
}

/// Words of one, as bytes.
pub(crate) const N_WORDS: usize = 8;

impl ArrivingPhoton {
    /// Calls `visit` for those of a map that are at most `radius` away.
    #[inline]
    pub(crate) fn for_each(
        map: &PhotonMap,
        query: &SurfaceQuery,
        radius: f32,
        mut visit: impl FnMut(&Self),
    ) {
        let rule = DensityRule::default();
        map.for_each_within(query.p, radius, |photon, d_sq| {
            let PhotonClass::Caustic { d_eye } = photon.class() else {
                return;
            };
            let wi = photon.wi();
            if wi.dot(query.n) > 0.0 && rule.accepts(query, photon, d_sq) {
                visit(&Self {
                    power: photon.power(),
                    wi,
                    d_eye,
                    d_sq,
                });
            }
        });
    }

    pub(crate) fn to_words(self) -> [f32; N_WORDS] {
        let [r, g, b] = self.power.to_array();
        let [x, y, z] = self.wi.to_array();
        [r, g, b, x, y, z, self.d_eye, self.d_sq]
    }

    pub(crate) fn of_words([r, g, b, x, y, z, d_eye, d_sq]: [f32; N_WORDS]) -> Self {
        Self {
            power: Spectrum::new(r, g, b),
            wi: Vec3::new(x, y, z),
            d_eye,
            d_sq,
        }
    }
}
