use crate::tokens::ImplicitKind;

/// A point of a profile: distance from the spine, height along it, and the outward normal there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ProfilePoint {
    pub(crate) radius: f64,
    pub(crate) height: f64,
    /// (across, along) the spine, unit length.
    pub(crate) normal: [f64; 2],
}

/// The smooth parts of a shape's profile, from −axis to +axis. The ends of neighbouring parts
/// meet, but their normals differ there.
pub(crate) fn profile(
    kind: ImplicitKind,
    dimensions: [f64; 3],
    n_around: u32,
) -> Vec<Vec<ProfilePoint>> {
    let [bottom, top, height] = dimensions;
    let quarter = n_around / 4;
    let (low, high) = (-0.5 * height, 0.5 * height);
    let mut runs = match kind {
        ImplicitKind::Sphere => vec![arc(bottom, 0.0, -1.0, 1.0, 2 * quarter)],
        ImplicitKind::Cylinder => vec![
            cap(bottom, low, -1.0),
            slope([bottom, low], [top, high]),
            cap(top, high, 1.0),
        ],
        ImplicitKind::Cone => vec![cap(bottom, low, -1.0), slope([bottom, low], [0.0, high])],
        ImplicitKind::Capsule => vec![
            arc(bottom, low, -1.0, 0.0, quarter),
            slope([bottom, low], [top, high]),
            arc(top, high, 0.0, 1.0, quarter),
        ],
        ImplicitKind::Cube | ImplicitKind::Plane => Vec::new(),
    };
    // Caps of no radius, sides of no height.
    runs.retain(|run| {
        run.windows(2)
            .any(|w| w[0].radius != w[1].radius || w[0].height != w[1].height)
    });
    runs
}

/// A circle's arc around the spine, between two latitudes in quarter turns.
fn arc(radius: f64, center: f64, from: f64, to: f64, n: u32) -> Vec<ProfilePoint> {
    (0..=n)
        .map(|i| {
            let latitude = from + (to - from) * f64::from(i) / f64::from(n);
            let (sin, cos) = (latitude * std::f64::consts::FRAC_PI_2).sin_cos();
            // Poles lie exactly on the spine.
            let cos = if latitude.abs() == 1.0 { 0.0 } else { cos };
            ProfilePoint {
                radius: radius * cos,
                height: center + radius * sin,
                normal: [cos, sin],
            }
        })
        .collect()
}

/// A flat disc that looks up or down the spine.
fn cap(radius: f64, height: f64, sign: f64) -> Vec<ProfilePoint> {
    let rim = ProfilePoint {
        radius,
        height,
        normal: [0.0, sign],
    };
    let center = ProfilePoint { radius: 0.0, ..rim };
    if sign < 0.0 {
        vec![center, rim]
    } else {
        vec![rim, center]
    }
}

/// A straight side between (radius, height) pairs.
fn slope(from: [f64; 2], to: [f64; 2]) -> Vec<ProfilePoint> {
    let (dr, dh) = (to[0] - from[0], to[1] - from[1]);
    let length = dr.hypot(dh);
    [from, to]
        .map(|[radius, height]| ProfilePoint {
            radius,
            height,
            normal: [dh / length, -dr / length],
        })
        .to_vec()
}
