use kilauea_testing::asymmetry;

use crate::surfaces::all;

/// Largest share of a surface's light that would go elsewhere if it went the other way: up to a
/// roughness of 0.35, and above.
///
/// What is left to a second facet (metal), the reflectance of glass and the share of a coat are
/// functions of `wo` alone, which keeps their energy exact and costs reciprocity. What is without
/// them is reciprocal up to the compensation of a dielectric, which is next to nothing.
const BOUNDS: [(&str, [f64; 2]); 10] = [
    ("white lambert", [1e-5, 1e-5]),
    ("gray lambert", [1e-5, 1e-5]),
    ("plastic", [2e-4, 6e-4]),
    ("metal", [0.016, 0.28]),
    ("half glass", [0.05, 0.075]),
    ("glass", [0.55, 0.85]),
    ("coated plastic", [0.06, 0.065]),
    ("coated metal", [0.035, 0.35]),
    ("tinted", [0.04, 0.055]),
    ("coated and tinted", [0.025, 0.08]),
];

#[test]
fn surfaces_are_as_reciprocal_as_they_claim() {
    for surface in all() {
        let bounds = BOUNDS.iter().find(|(kind, _)| *kind == surface.kind);
        let (_, [smoother, rougher]) = *bounds.expect("each kind has its bound");
        let bound = if surface.roughness > 0.35 {
            rougher
        } else {
            smoother
        };
        let found = asymmetry(&surface.bsdf);
        assert!(found <= bound, "{}: {found}, bound {bound}", surface.name());
    }
}
