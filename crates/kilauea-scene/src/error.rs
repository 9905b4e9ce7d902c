/// Why a scene cannot be rendered; each names the prim.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// An array of the wrong length.
    #[error("{path}: {attribute} has {found} values, expected {expected}")]
    Count {
        /// Prim path.
        path: String,
        /// Attribute.
        attribute: String,
        /// Length found.
        found: usize,
        /// Length expected.
        expected: usize,
    },
    /// An index outside its array.
    #[error("{path}: {attribute}[{at}] is {value}, outside 0..{limit}")]
    Index {
        /// Prim path.
        path: String,
        /// Attribute.
        attribute: String,
        /// Where the index stands.
        at: usize,
        /// The index.
        value: i64,
        /// One past the highest index allowed.
        limit: usize,
    },
    /// A value that makes no sense.
    #[error("{path}: {attribute} is invalid: {reason}")]
    Value {
        /// Prim path.
        path: String,
        /// Attribute.
        attribute: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Instances that contain themselves.
    #[error("{path}: prototype contains itself")]
    Cycle {
        /// Prim path.
        path: String,
    },
}
