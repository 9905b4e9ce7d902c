//! Photons in twelve bytes, and twelve more for where they are, which their tree holds.

mod lights;
mod octahedral;
mod shared_exponent;

pub(crate) use lights::LightTable;
pub(crate) use octahedral::{Direction16, Direction32};
pub(crate) use shared_exponent::PowerScale;

use crate::Photon;
use crate::photon::PhotonClass;

/// Everything of a photon but its position and, if it is caustic, its density.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PackedPhoton {
    pub(crate) power: u32,
    pub(crate) wi: Direction32,
    pub(crate) n: Direction16,
    /// Number in the table of lights, and the class in the highest bit.
    tag: u16,
}

const CAUSTIC: u16 = 1 << 15;

impl PackedPhoton {
    pub(crate) fn new(photon: &Photon, scale: &PowerScale, lights: &LightTable) -> Self {
        let class = match photon.class {
            PhotonClass::Caustic { .. } => CAUSTIC,
            PhotonClass::Global => 0,
        };
        Self {
            power: scale.encode(photon.power, photon.hash()),
            wi: Direction32::encode(photon.wi),
            n: Direction16::encode(photon.n),
            tag: lights.number_of(photon.light_idx) | class,
        }
    }

    #[inline]
    pub(crate) fn is_caustic(self) -> bool {
        self.tag & CAUSTIC != 0
    }

    /// Number in the table of lights.
    #[inline]
    pub(crate) fn light_number(self) -> u16 {
        self.tag & !CAUSTIC
    }
}
