/// Why bytes are no scene.
#[derive(Debug, thiserror::Error)]
pub enum SceneBytesError {
    /// They promise more than there is.
    #[error("the scene ends after {available} bytes where {wanted} more should come")]
    Cut {
        /// Bytes that are left.
        available: usize,
        /// Bytes that should be.
        wanted: u64,
    },
    /// More than a scene.
    #[error("{0} bytes follow on the scene")]
    Rest(usize),
    /// A number that stands for nothing.
    #[error("{what} is {value}, which there is not")]
    Value {
        /// What it should tell.
        what: &'static str,
        /// The number.
        value: u8,
    },
    /// A chunk of a scene that does not have it.
    #[error("the scene has no chunk {number} in prototype {prototype}")]
    Chunk {
        /// The prototype.
        prototype: u32,
        /// The chunk in it.
        number: u32,
    },
    /// A name that is no text.
    #[error(transparent)]
    Text(#[from] std::string::FromUtf8Error),
    /// Records of another version.
    #[error("records of the scene: {0}")]
    Records(#[from] rmp_serde::decode::Error),
}
