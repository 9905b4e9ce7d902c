use kilauea_photon::{LightSubpath, PhotonClass};

/// Over what kinds of surfaces light has come.
#[derive(Clone, Copy)]
pub(super) enum History {
    /// Over none: L.
    Straight(LightSubpath),
    /// Over specular ones alone: L S⁺.
    Specular(LightSubpath),
    /// Over any others.
    Scattered,
}

impl History {
    /// Arrives at a surface at an absolute cosine to its normal.
    pub(super) fn arrived(self, cos_in: f32) -> Self {
        match self {
            Self::Straight(subpath) => Self::Straight(subpath.arrived(cos_in)),
            Self::Specular(subpath) => Self::Specular(subpath.arrived(cos_in)),
            Self::Scattered => Self::Scattered,
        }
    }

    /// Goes on along a specular lobe, with densities over solid angle forward and back.
    pub(super) fn reflected(self, forward_pdf: f32, reverse_pdf: f32, cos_out: f32) -> Self {
        match self {
            Self::Straight(subpath) | Self::Specular(subpath) => {
                Self::Specular(subpath.scattered(forward_pdf, reverse_pdf, cos_out))
            }
            Self::Scattered => Self::Scattered,
        }
    }

    /// Whether specular surfaces alone were met before this one.
    pub(super) fn is_caustic(self) -> bool {
        matches!(self, Self::Specular(_))
    }

    /// Whether no surface was met before this one.
    pub(super) fn is_straight(self) -> bool {
        matches!(self, Self::Straight(_))
    }

    /// The class of a photon that is kept here.
    pub(super) fn class(self) -> PhotonClass {
        match self {
            Self::Specular(subpath) => PhotonClass::Caustic {
                d_eye: subpath.d_eye(),
            },
            Self::Straight(_) | Self::Scattered => PhotonClass::Global,
        }
    }
}
