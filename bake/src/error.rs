//! The error type of this crate.

/// Shorthand for results of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// What can stop a bake.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or a value.
    #[error(transparent)]
    Formats(#[from] diaphane_formats::Error),
    /// A parameter is out of range.
    #[error("{0}")]
    Parameter(String),
    /// No sample found a place.
    #[error("no sample found a place inside the mesh: {0}")]
    NoRoom(String),
    /// The certificate stays above the error that was asked for.
    #[error("{0}")]
    TooInaccurate(String),
    /// The user asked to stop.
    #[error("cancelled; nothing was written")]
    Cancelled,
}
