use kilauea_bsdf::SeenBsdf;

/// By which lobes of a vertex light is still looked for, where some of it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Rest {
    /// Nothing is known.
    All,
    /// All but the diffuse ones. What they find counts `weight` times, as others like it are left.
    Others { weight: f32 },
    /// All that is there is known, or left.
    Nothing,
}

impl Rest {
    /// The lobes, for which there is room in `others`, and the weight.
    #[inline(always)]
    pub(crate) fn lobes<'b>(
        self,
        bsdf: &'b SeenBsdf,
        others: &'b mut Option<SeenBsdf>,
    ) -> Option<(&'b SeenBsdf, f32)> {
        match self {
            Self::All => Some((bsdf, 1.0)),
            Self::Others { weight } => {
                *others = bsdf.without_diffuse();
                others.as_ref().map(|lobes| (lobes, weight))
            }
            Self::Nothing => None,
        }
    }
}
