use kilauea_scene::Visibility;

/// What a ray from a light does at a surface that is hidden from some kinds of rays.
///
/// On camera paths, two rays find such a surface where light from a light arrives: the scattered ray
/// that reaches it, and the ray toward the light that it holds back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meeting {
    /// Light arrives and ends here.
    Arrives,
    /// Light ends, and nothing sees it scattered.
    Blocked,
    /// Light arrives, and goes on as well.
    Divides,
}

impl Meeting {
    /// Whether the camera sees nothing of a surface that `met_by` those rays.
    pub(super) fn is_hidden_from_camera(met_by: Visibility) -> bool {
        met_by & Visibility::CAMERA == Visibility::NONE
    }

    /// At a surface that `met_by` those rays.
    pub(super) fn of(met_by: Visibility) -> Self {
        let has = |kind: Visibility| met_by & kind != Visibility::NONE;
        match (has(Visibility::INDIRECT), has(Visibility::SHADOW)) {
            (true, true) => Self::Arrives,
            (false, _) => Self::Blocked,
            (true, false) => Self::Divides,
        }
    }
}
