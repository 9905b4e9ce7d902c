//! What paths of light leave, as bytes: for those who need it and did not follow them.

use kilauea_math::Spectrum;
use kilauea_photon::{Photon, PhotonClass};
use kilauea_spot::{Wire, WireError};

use super::PhotonCounts;
use super::tracer::LeftPhotons;
use crate::caustics::Splat;
use crate::light::UsefulRay;
use crate::wire::{put_list, put_record, put_vec, take_list, take_record, take_vec};

const GLOBAL: u8 = 0;
const CAUSTIC: u8 = 1;

impl Wire for LeftPhotons {
    fn encode(&self, bytes: &mut Vec<u8>) {
        put_list(&self.photons, put_photon, bytes);
        self.brightest.encode(bytes);
        put_list(&self.useful_rays, put_useful_ray, bytes);
        put_list(&self.arrivals, put_record, bytes);
        put_list(&self.splats, put_splat, bytes);
        self.sent_out.encode(bytes);
        let PhotonCounts {
            emitted,
            stored_caustic,
            stored_global,
            rays,
            invalid_rays,
            in_too_many_media,
        } = self.counts;
        let counts = [
            emitted,
            stored_caustic,
            stored_global,
            rays,
            invalid_rays,
            in_too_many_media,
        ];
        for count in counts {
            count.encode(bytes);
        }
    }

    fn decode(bytes: &mut &[u8]) -> Result<Self, WireError> {
        Ok(Self {
            photons: take_list(take_photon, bytes)?,
            brightest: f32::decode(bytes)?,
            useful_rays: take_list(take_useful_ray, bytes)?,
            arrivals: take_list(take_record, bytes)?,
            splats: take_list(take_splat, bytes)?,
            sent_out: f64::decode(bytes)?,
            counts: PhotonCounts {
                emitted: u64::decode(bytes)?,
                stored_caustic: u64::decode(bytes)?,
                stored_global: u64::decode(bytes)?,
                rays: u64::decode(bytes)?,
                invalid_rays: u64::decode(bytes)?,
                in_too_many_media: u64::decode(bytes)?,
            },
        })
    }
}

fn put_photon(photon: &Photon, bytes: &mut Vec<u8>) {
    put_vec(photon.p, bytes);
    photon.power.to_array().encode(bytes);
    put_vec(photon.wi, bytes);
    put_vec(photon.n, bytes);
    photon.light_idx.encode(bytes);
    match photon.class {
        PhotonClass::Global => GLOBAL.encode(bytes),
        PhotonClass::Caustic { d_eye } => {
            CAUSTIC.encode(bytes);
            d_eye.encode(bytes);
        }
    }
    photon.path_idx.encode(bytes);
    photon.depth.encode(bytes);
}

fn take_photon(bytes: &mut &[u8]) -> Result<Photon, WireError> {
    Ok(Photon {
        p: take_vec(bytes)?,
        power: Spectrum::from(<[f32; 3]>::decode(bytes)?),
        wi: take_vec(bytes)?,
        n: take_vec(bytes)?,
        light_idx: u32::decode(bytes)?,
        class: match u8::decode(bytes)? {
            GLOBAL => PhotonClass::Global,
            CAUSTIC => PhotonClass::Caustic {
                d_eye: f32::decode(bytes)?,
            },
            other => return Err(WireError::Variant(other)),
        },
        path_idx: u32::decode(bytes)?,
        depth: u16::decode(bytes)?,
    })
}

fn put_useful_ray(ray: &UsefulRay, bytes: &mut Vec<u8>) {
    ray.light.encode(bytes);
    put_vec(ray.dir, bytes);
    put_vec(ray.p_met, bytes);
    [ray.luminance, ray.density].encode(bytes);
}

fn take_useful_ray(bytes: &mut &[u8]) -> Result<UsefulRay, WireError> {
    Ok(UsefulRay {
        light: u32::decode(bytes)?,
        dir: take_vec(bytes)?,
        p_met: take_vec(bytes)?,
        luminance: f32::decode(bytes)?,
        density: f32::decode(bytes)?,
    })
}

fn put_splat(splat: &Splat, bytes: &mut Vec<u8>) {
    splat.pixel[0].encode(bytes);
    splat.pixel[1].encode(bytes);
    splat.path_idx.encode(bytes);
    splat.diffuse.to_array().encode(bytes);
    splat.specular.to_array().encode(bytes);
    splat.left.encode(bytes);
}

fn take_splat(bytes: &mut &[u8]) -> Result<Splat, WireError> {
    Ok(Splat {
        pixel: [i32::decode(bytes)?, i32::decode(bytes)?],
        path_idx: u32::decode(bytes)?,
        diffuse: Spectrum::from(<[f32; 3]>::decode(bytes)?),
        specular: Spectrum::from(<[f32; 3]>::decode(bytes)?),
        left: f32::decode(bytes)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use kilauea_gather::{Arrival, GatherRecord};
    use kilauea_math::Vec3;

    fn left() -> LeftPhotons {
        let photon = |path_idx, class| Photon {
            p: Vec3::new(1.0, -0.0, 3.0),
            power: Spectrum::from([0.5, 1e-30, 2.0]),
            wi: Vec3::Z,
            n: Vec3::Y,
            light_idx: 7,
            class,
            path_idx,
            depth: 300,
        };
        let caustic = PhotonClass::Caustic { d_eye: 0.25 };
        LeftPhotons {
            photons: vec![photon(1, PhotonClass::Global), photon(2, caustic)],
            brightest: 2.5,
            useful_rays: vec![UsefulRay {
                light: 3,
                dir: Vec3::X,
                p_met: Vec3::NEG_Z,
                luminance: 4.0,
                density: 0.125,
            }],
            arrivals: vec![GatherRecord {
                p: Vec3::X,
                n: Vec3::Y,
                arrival: Arrival {
                    wi: Vec3::Z,
                    irradiance: 5.0,
                    pdf: 0.5,
                },
                pixel: [-1, 2],
                brought: 6.0,
            }],
            splats: vec![Splat {
                pixel: [-3, 4],
                path_idx: 8,
                diffuse: Spectrum::from([0.25, 3.0, 1e-20]),
                specular: Spectrum::ONE,
                left: 0.75,
            }],
            sent_out: 0.1,
            counts: PhotonCounts {
                emitted: 1,
                stored_caustic: 2,
                stored_global: 3,
                rays: 4,
                invalid_rays: 5,
                in_too_many_media: 6,
            },
        }
    }

    #[test]
    fn what_paths_left_survives_and_what_is_cut_is_refused() {
        let mut bytes = Vec::new();
        left().encode(&mut bytes);
        let mut rest = &bytes[..];
        let read = LeftPhotons::decode(&mut rest).expect("it is whole");
        assert!(rest.is_empty());
        let LeftPhotons {
            photons,
            brightest,
            useful_rays,
            arrivals,
            splats,
            sent_out,
            counts,
        } = left();
        assert_eq!((read.photons, read.arrivals), (photons, arrivals));
        assert_eq!(read.splats, splats);
        assert_eq!(read.brightest, brightest);
        assert_eq!((read.sent_out, read.counts), (sent_out, counts));
        assert_eq!(
            format!("{:?}", read.useful_rays),
            format!("{useful_rays:?}")
        );
        for end in 0..bytes.len() {
            let cut = LeftPhotons::decode(&mut &bytes[..end]);
            assert_eq!(cut.err(), Some(WireError::Short), "{end}");
        }
    }
}
