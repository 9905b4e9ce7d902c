/// Radii that shrink from pass to pass so that the mean of all passes converges (Knaus and Zwicker
/// 2011, "Progressive Photon Mapping: A Probabilistic Approach", eq. 15), at the rate that is best
/// for long runs (Kaplanyan and Dachsbacher 2013, "Adaptive Progressive Photon Mapping").
///
/// r²ᵢ₊₁ = r²ᵢ (i + α) / (i + 1) with α = 2/3; passes count from one. The variance of pass i grows
/// as i^(1/3), its bias falls as i^(-1/3); the squared error of the mean of n passes falls as
/// n^(-2/3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProgressiveRadius {
    /// In f64, for thousands of products.
    radius_sq: f64,
    pass: u32,
}

/// The share of new photons that a pass keeps.
const ALPHA: f64 = 2.0 / 3.0;

impl ProgressiveRadius {
    /// Radii of which that of the first pass is `initial_radius`.
    pub fn new(initial_radius: f32) -> Self {
        Self {
            radius_sq: f64::from(initial_radius).powi(2),
            pass: 1,
        }
    }

    /// The radius of this pass.
    pub fn radius(&self) -> f32 {
        self.radius_sq.sqrt() as f32
    }

    /// The number of this pass, from one.
    pub fn pass(&self) -> u32 {
        self.pass
    }

    /// Goes to the next pass.
    pub fn advance(&mut self) {
        let i = f64::from(self.pass);
        self.radius_sq *= (i + ALPHA) / (i + 1.0);
        self.pass += 1;
    }
}
