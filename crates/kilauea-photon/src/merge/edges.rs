/// The product over edges so far, away from where the path began: densities of coming back over those
/// of having gone, with the cosines that do not cancel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EdgeProduct(pub(super) f32);

impl EdgeProduct {
    /// The far end of the edge is met at the (absolute) cosine `cos_in`.
    pub(super) fn arrived(self, cos_in: f32) -> Self {
        Self(self.0 / cos_in)
    }

    /// The path leaves on the next edge, at the (absolute) cosine `cos_out`, with the density
    /// `forward_pdf`; `reverse_pdf` is that of the last edge from the other side.
    pub(super) fn scattered(self, forward_pdf: f32, reverse_pdf: f32, cos_out: f32) -> Self {
        Self(self.0 * reverse_pdf * cos_out / forward_pdf)
    }
}
