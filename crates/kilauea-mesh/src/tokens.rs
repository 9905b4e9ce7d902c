use std::str::FromStr;

/// A word that is none of those a UsdGeom attribute may have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{token:?} is no {attribute}")]
pub struct UnknownToken {
    /// The attribute, as UsdGeom names it.
    pub attribute: &'static str,
    /// The word found.
    pub token: String,
}

/// Declares an enum of USD tokens with its `FromStr`.
macro_rules! tokens {
    ($(#[$doc:meta])* $name:ident, $attribute:literal:
     $($(#[$variant_doc:meta])* $variant:ident = $token:literal),+ $(,)?) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum $name {
            $($(#[$variant_doc])* $variant,)+
        }

        impl FromStr for $name {
            type Err = UnknownToken;

            fn from_str(token: &str) -> Result<Self, UnknownToken> {
                match token {
                    $($token => Ok(Self::$variant),)+
                    _ => Err(UnknownToken { attribute: $attribute, token: token.to_owned() }),
                }
            }
        }
    };
}

tokens! {
    /// What a value of a primvar belongs to (UsdGeomPrimvar `interpolation`).
    PrimvarInterpolation, "interpolation":
    /// The whole prim.
    Constant = "constant",
    /// A face.
    Uniform = "uniform",
    /// A point, linear in between even on subdivision surfaces.
    Varying = "varying",
    /// A point, by the subdivision basis.
    Vertex = "vertex",
    /// A corner of a face.
    FaceVarying = "faceVarying",
}

tokens! {
    /// UsdGeomMesh `subdivisionScheme` besides `none`.
    Scheme, "subdivisionScheme":
    /// Catmull and Clark 1978; any faces.
    CatmullClark = "catmullClark",
    /// Loop 1987; triangles only.
    Loop = "loop",
    /// Catmull-Clark's splits without its smoothing.
    Bilinear = "bilinear",
}

tokens! {
    /// UsdGeomMesh `interpolateBoundary`.
    BoundaryInterpolation, "interpolateBoundary":
    /// Faces at the boundary only support others and are not drawn.
    None = "none",
    /// Boundary edges are creases.
    EdgeOnly = "edgeOnly",
    /// Boundary edges are creases, boundary vertices of one face are corners.
    EdgeAndCorner = "edgeAndCorner",
}

tokens! {
    /// UsdGeomMesh `faceVaryingLinearInterpolation`: where face-varying data is not smoothed.
    FaceVaryingRule, "faceVaryingLinearInterpolation":
    /// Nowhere but at disconnected regions.
    None = "none",
    /// At corners of one face.
    CornersOnly = "cornersOnly",
    /// Also where three or more regions meet, or one of two is sharp.
    CornersPlus1 = "cornersPlus1",
    /// Also at darts and opposite corners (concave corners).
    CornersPlus2 = "cornersPlus2",
    /// Along all boundaries and seams.
    Boundaries = "boundaries",
    /// Everywhere.
    All = "all",
}

tokens! {
    /// UsdGeomMesh `triangleSubdivisionRule`: weights at triangles in Catmull-Clark.
    TriangleRule, "triangleSubdivisionRule":
    /// The scheme's own.
    CatmullClark = "catmullClark",
    /// Weights that bump less.
    Smooth = "smooth",
}

tokens! {
    /// UsdGeomBasisCurves `type`.
    CurveType, "type":
    /// Straight lines between the points.
    Linear = "linear",
    /// Cubic polynomials by the `basis`.
    Cubic = "cubic",
}

tokens! {
    /// UsdGeomBasisCurves `basis`: what the points of cubic curves mean.
    CubicBasis, "basis":
    /// Every third point is on the curve, the others pull at it.
    Bezier = "bezier",
    /// Uniform cubic B-spline; points are near the curve.
    Bspline = "bspline",
    /// Through all points but the outermost.
    CatmullRom = "catmullRom",
}

tokens! {
    /// UsdGeomBasisCurves `wrap`: what happens at the ends.
    CurveWrap, "wrap":
    /// Only where the basis has all of its points.
    Nonperiodic = "nonperiodic",
    /// The last point is followed by the first.
    Periodic = "periodic",
    /// From the first point to the last, by points beyond them that the basis needs.
    Pinned = "pinned",
}

tokens! {
    /// Shapes given by a formula.
    ImplicitKind, "implicit shape":
    /// UsdGeomSphere.
    Sphere = "Sphere",
    /// UsdGeomCube.
    Cube = "Cube",
    /// UsdGeomCylinder and UsdGeomCylinder_1.
    Cylinder = "Cylinder",
    /// UsdGeomCone.
    Cone = "Cone",
    /// UsdGeomCapsule and UsdGeomCapsule_1.
    Capsule = "Capsule",
    /// UsdGeomPlane.
    Plane = "Plane",
}

tokens! {
    /// The spine of an implicit shape, or the normal of a plane.
    Axis, "axis":
    /// Along x.
    X = "X",
    /// Along y.
    Y = "Y",
    /// Along z.
    Z = "Z",
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_parse_as_usd_spells_them() {
        assert_eq!("faceVarying".parse(), Ok(PrimvarInterpolation::FaceVarying));
        assert_eq!("cornersPlus2".parse(), Ok(FaceVaryingRule::CornersPlus2));
        assert_eq!("Z".parse(), Ok(Axis::Z));
        let error = "Edge".parse::<BoundaryInterpolation>().unwrap_err();
        assert_eq!(error.to_string(), "\"Edge\" is no interpolateBoundary");
    }
}
