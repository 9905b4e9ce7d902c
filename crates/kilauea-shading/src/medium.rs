use kilauea_math::Spectrum;

/// A homogeneous dielectric that fills the inside of a closed mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// Index of refraction.
    pub ior: f32,
    /// Where media overlap, only the one of the highest priority is there (Schmidt & Budge,
    /// *Simple nested dielectrics in ray traced images*, 2002).
    pub priority: i8,
    /// Absorption coefficient per unit of length, finite.
    pub absorption: Spectrum,
}

impl Medium {
    /// The absorption coefficient of what turns white light into `color` on the way through
    /// `depth`, as MaterialX's `transmission_color` and `transmission_depth` have it. A depth of
    /// zero or less stands for no absorption.
    pub fn absorption(color: Spectrum, depth: f32) -> Spectrum {
        if depth > 0.0 {
            let of_channel = |c: f32| {
                let transmittance = c.clamp(f32::MIN_POSITIVE, 1.0);
                (-transmittance.ln() / depth).min(f32::MAX)
            };
            let [r, g, b] = color.to_array().map(of_channel);
            Spectrum::new(r, g, b)
        } else {
            Spectrum::BLACK
        }
    }

    /// Fraction of light that passes a distance (Beer-Lambert). What absorbs lets nothing through
    /// an infinite one.
    #[inline]
    pub fn transmittance(&self, distance: f32) -> Spectrum {
        if self.absorption.is_black() {
            return Spectrum::ONE;
        }
        let of_channel = |sigma: f32| {
            // An infinite distance times nothing is not a number.
            if sigma > 0.0 {
                (-sigma * distance).exp()
            } else {
                1.0
            }
        };
        let [r, g, b] = self.absorption.to_array().map(of_channel);
        Spectrum::new(r, g, b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn medium(color: Spectrum, depth: f32) -> Medium {
        Medium {
            ior: 1.5,
            priority: 0,
            absorption: Medium::absorption(color, depth),
        }
    }

    #[test]
    fn white_light_has_the_color_after_the_depth() {
        let color = Spectrum::new(0.9, 0.25, 1.0);
        let amber = medium(color, 0.2);
        let [r, g, b] = amber.transmittance(0.2).to_array();
        assert!((r - 0.9).abs() < 1e-6 && (g - 0.25).abs() < 1e-6 && b == 1.0);
        let twice = amber.transmittance(0.4);
        assert!(
            (twice - color * color)
                .to_array()
                .iter()
                .all(|d| d.abs() < 1e-6)
        );
        assert_eq!(amber.transmittance(0.0), Spectrum::ONE);
    }

    #[test]
    fn extremes_stay_numbers() {
        let far = medium(Spectrum::new(0.5, 1.0, 0.0), 1.0).transmittance(f32::INFINITY);
        assert_eq!(far, Spectrum::new(0.0, 1.0, 0.0));
        for depth in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let clear = medium(Spectrum::splat(0.5), depth);
            assert_eq!(clear.transmittance(f32::INFINITY), Spectrum::ONE, "{depth}");
        }
        let ink = medium(Spectrum::BLACK, f32::MIN_POSITIVE);
        assert_eq!(ink.transmittance(0.0), Spectrum::ONE);
        assert_eq!(ink.transmittance(1e-3), Spectrum::BLACK);
    }
}
