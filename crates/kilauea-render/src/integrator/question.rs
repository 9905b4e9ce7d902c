//! What a path asks of whoever holds the geometry, and what it gets back.

use kilauea_accel::{Hit, Ray, Visibility};
use kilauea_math::Vec3;
use kilauea_photon::SurfaceQuery;
use kilauea_spot::{Wire, WireError};
use kilauea_texture::TileId;

use super::merge::ArrivingPhoton;
use crate::geometry::Carried;
use crate::sampler::Sampler;
use crate::set::Parcel;
use crate::wire::{put_list, put_vec, take_list, take_vec};

/// Most are about a ray, whose `key` decides at surfaces that let some rays pass; 0 where there are
/// none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Question {
    /// What does it hit first?
    Closest { ray: Ray, key: u32 },
    /// Does it hit anything? Boundaries of media below a priority do not count.
    Occluded {
        ray: Ray,
        key: u32,
        least_priority: i8,
    },
    /// The tile of a texture is to be brought to where it is looked up.
    Tile(TileId),
    /// Which photons lie on a surface around a place?
    Photons(PhotonQuestion),
}

/// Asks for the photons that a look-up finds, as far as each member of a set has them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PhotonQuestion {
    /// Number of the pass whose photons they are.
    pub(crate) pass: u32,
    /// Where.
    pub(crate) at: SurfaceQuery,
    /// Those that a member has told of already, where it finds more than one reply has room for: the
    /// first ones, as it always finds them in the same order.
    pub(crate) n_told: u32,
}

/// The answer to a [`Question`] of the same kind.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Answer {
    Closest(Option<Hit>),
    /// The closest hit is on a primitive that lies elsewhere.
    Met(Met),
    Occluded(bool),
    /// Its texels, where those who answer have a memory of their own.
    Tile(Option<Box<[u8]>>),
    /// In any order; none where some member has them no more.
    Photons(Option<Vec<ArrivingPhoton>>),
}

/// A hit on a primitive that lies elsewhere, and what is needed of that.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Met {
    pub(crate) hit: Hit,
    pub(crate) parcel: Parcel,
}

impl Question {
    /// Asks what a ray hits first that reaches the vertex after `depth` events.
    #[inline]
    pub(crate) fn closest<const CUTOUTS: bool>(
        ray: &Ray,
        sampler: &Sampler<'_>,
        depth: u32,
    ) -> Self {
        Self::Closest {
            ray: *ray,
            key: if CUTOUTS { sampler.key(2 * depth) } else { 0 },
        }
    }

    /// Asks whether anything is between the vertex after `depth` events, in a medium of
    /// `least_priority`, and a light.
    #[inline]
    pub(crate) fn occluded<const CUTOUTS: bool>(
        ray: &Ray,
        least_priority: i8,
        sampler: &Sampler<'_>,
        depth: u32,
    ) -> Self {
        Self::Occluded {
            ray: *ray,
            key: if CUTOUTS {
                sampler.key(2 * depth + 1)
            } else {
                0
            },
            least_priority,
        }
    }
}

impl Answer {
    /// What was hit first, and what was carried here of it if it lies elsewhere.
    ///
    /// # Panics
    /// If another question was answered.
    #[inline]
    pub(crate) fn hit(self) -> (Option<Hit>, Option<Box<Carried>>) {
        match self {
            Self::Closest(hit) => (hit, None),
            Self::Met(met) => (Some(met.hit), Some(met.parcel.open())),
            other => panic!("asked for a hit, told of {other:?}"),
        }
    }

    /// Whether anything was hit.
    ///
    /// # Panics
    /// If another question was answered.
    #[inline]
    pub(crate) fn is_occluded(&self) -> bool {
        match self {
            Self::Occluded(is_occluded) => *is_occluded,
            other => panic!("asked for an occlusion, told of {other:?}"),
        }
    }

    /// The texels of a tile, where they are not in memory yet.
    ///
    /// # Panics
    /// If another question was answered.
    pub(super) fn texels(self) -> Option<Box<[u8]>> {
        match self {
            Self::Tile(texels) => texels,
            other => panic!("asked for a tile, told of {other:?}"),
        }
    }

    /// Photons; none where some are gone.
    ///
    /// # Panics
    /// If another question was answered.
    pub(super) fn photons(self) -> Option<Vec<ArrivingPhoton>> {
        match self {
            Self::Photons(photons) => photons,
            other => panic!("asked for photons, told of {other:?}"),
        }
    }
}

const CLOSEST: u8 = 0;
const OCCLUDED: u8 = 1;
const MET: u8 = 2;
const TILE: u8 = 3;
const PHOTONS: u8 = 4;

impl Wire for Question {
    fn encode(&self, bytes: &mut Vec<u8>) {
        let (kind, ray, key) = match self {
            Self::Closest { ray, key } => (CLOSEST, ray, key),
            Self::Occluded { ray, key, .. } => (OCCLUDED, ray, key),
            Self::Tile(tile) => {
                TILE.encode(bytes);
                tile.0.encode(bytes);
                return;
            }
            Self::Photons(PhotonQuestion { pass, at, n_told }) => {
                PHOTONS.encode(bytes);
                pass.encode(bytes);
                put_vec(at.p, bytes);
                put_vec(at.n, bytes);
                n_told.encode(bytes);
                return;
            }
        };
        kind.encode(bytes);
        ray.origin.to_array().encode(bytes);
        ray.dir.to_array().encode(bytes);
        [ray.t_min, ray.t_max, ray.time].encode(bytes);
        ray.visibility.0.encode(bytes);
        key.encode(bytes);
        if let Self::Occluded { least_priority, .. } = self {
            least_priority.cast_unsigned().encode(bytes);
        }
    }

    fn decode(bytes: &mut &[u8]) -> Result<Self, WireError> {
        let kind = u8::decode(bytes)?;
        match kind {
            CLOSEST | OCCLUDED => {}
            TILE => return Ok(Self::Tile(TileId(u32::decode(bytes)?))),
            PHOTONS => {
                let pass = u32::decode(bytes)?;
                let (p, n) = (take_vec(bytes)?, take_vec(bytes)?);
                let at = SurfaceQuery { p, n };
                let n_told = u32::decode(bytes)?;
                return Ok(Self::Photons(PhotonQuestion { pass, at, n_told }));
            }
            other => return Err(WireError::Variant(other)),
        }
        let origin = Vec3::from_array(Wire::decode(bytes)?);
        let dir = Vec3::from_array(Wire::decode(bytes)?);
        let [t_min, t_max, time] = Wire::decode(bytes)?;
        let ray = Ray {
            t_min,
            t_max,
            time,
            visibility: Visibility(u8::decode(bytes)?),
            ..Ray::new(origin, dir)
        };
        let key = u32::decode(bytes)?;
        Ok(if kind == CLOSEST {
            Self::Closest { ray, key }
        } else {
            Self::Occluded {
                ray,
                key,
                least_priority: u8::decode(bytes)?.cast_signed(),
            }
        })
    }
}

impl Wire for Answer {
    fn encode(&self, bytes: &mut Vec<u8>) {
        match self {
            Self::Closest(hit) => {
                CLOSEST.encode(bytes);
                hit.is_some().encode(bytes);
                if let Some(hit) = hit {
                    encode_hit(hit, bytes);
                }
            }
            Self::Met(met) => {
                MET.encode(bytes);
                encode_hit(&met.hit, bytes);
                met.parcel.encode(bytes);
            }
            Self::Occluded(is_occluded) => {
                OCCLUDED.encode(bytes);
                is_occluded.encode(bytes);
            }
            Self::Tile(texels) => {
                TILE.encode(bytes);
                texels.encode(bytes);
            }
            Self::Photons(photons) => {
                PHOTONS.encode(bytes);
                photons.is_some().encode(bytes);
                let put = |photon: &ArrivingPhoton, bytes: &mut Vec<u8>| {
                    photon.to_words().encode(bytes);
                };
                put_list(photons.as_deref().unwrap_or_default(), put, bytes);
            }
        }
    }

    fn decode(bytes: &mut &[u8]) -> Result<Self, WireError> {
        match u8::decode(bytes)? {
            CLOSEST if bool::decode(bytes)? => Ok(Self::Closest(Some(decode_hit(bytes)?))),
            CLOSEST => Ok(Self::Closest(None)),
            MET => Ok(Self::Met(Met {
                hit: decode_hit(bytes)?,
                parcel: Parcel::Open(Box::new(Carried::decode(bytes)?)),
            })),
            OCCLUDED => Ok(Self::Occluded(bool::decode(bytes)?)),
            TILE => Ok(Self::Tile(Wire::decode(bytes)?)),
            PHOTONS => {
                let is_there = bool::decode(bytes)?;
                let take = |bytes: &mut &[u8]| Ok(ArrivingPhoton::of_words(Wire::decode(bytes)?));
                let photons = take_list(take, bytes)?;
                Ok(Self::Photons(is_there.then_some(photons)))
            }
            other => Err(WireError::Variant(other)),
        }
    }
}

fn encode_hit(hit: &Hit, bytes: &mut Vec<u8>) {
    [hit.t, hit.u, hit.v].encode(bytes);
    hit.primitive.encode(bytes);
    hit.instance.encode(bytes);
}

fn decode_hit(bytes: &mut &[u8]) -> Result<Hit, WireError> {
    let [t, u, v] = Wire::decode(bytes)?;
    let (primitive, instance) = (u32::decode(bytes)?, u32::decode(bytes)?);
    Ok(Hit {
        t,
        u,
        v,
        primitive,
        instance,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check<T: Wire + PartialEq + std::fmt::Debug>(value: &T) {
        let mut bytes = Vec::new();
        value.encode(&mut bytes);
        let mut rest = bytes.as_slice();
        assert_eq!(T::decode(&mut rest).as_ref(), Ok(value));
        assert!(rest.is_empty());
        for end in 0..bytes.len() {
            assert_eq!(T::decode(&mut &bytes[..end]), Err(WireError::Short));
        }
        bytes[0] = 9;
        assert_eq!(T::decode(&mut bytes.as_slice()), Err(WireError::Variant(9)));
    }

    #[test]
    fn questions_and_answers_survive_as_bytes() {
        let ray = Ray {
            t_max: f32::INFINITY,
            time: 0.25,
            visibility: Visibility::SHADOW,
            ..Ray::new(Vec3::new(1.0, -0.0, 3.0), Vec3::new(0.0, 1e-40, -2.0))
        };
        check(&Question::Closest { ray, key: 7 });
        check(&Question::Occluded {
            ray,
            key: u32::MAX,
            least_priority: -100,
        });
        check(&Answer::Closest(None));
        check(&Answer::Closest(Some(Hit {
            t: 1.5,
            u: 0.25,
            v: 0.5,
            primitive: 3,
            instance: 4,
        })));
        check(&Answer::Occluded(true));
        check(&Question::Tile(TileId(1 << 20)));
        check(&Answer::Tile(None));
        check(&Answer::Tile(Some([3, 0, 7].into())));
        let at = SurfaceQuery {
            p: Vec3::new(1.0, -0.0, 3.0),
            n: Vec3::Y,
        };
        check(&Question::Photons(PhotonQuestion {
            pass: 7,
            at,
            n_told: 9,
        }));
        let photon =
            |i: u32| ArrivingPhoton::of_words([i as f32, 1e-40, 2.0, 3.0, -0.0, 5.0, 6.0, 7.0]);
        check(&Answer::Photons(None));
        check(&Answer::Photons(Some((0..3).map(photon).collect())));
    }
}
