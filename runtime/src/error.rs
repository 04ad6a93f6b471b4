//! The error type of this crate.

/// Shorthand for results of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// What can go wrong while playing an asset.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or its contents.
    #[error(transparent)]
    Formats(#[from] diaphane_formats::Error),
    /// No GPU adapter that can draw measured pictures.
    #[error("no usable GPU adapter: {0}; use the CPU backend")]
    NoAdapter(String),
    /// A change of the material that makes no sense.
    #[error("{0}")]
    Edit(String),
    /// A host program asked for something that makes no sense.
    #[error("{0}")]
    Host(String),
    /// The GPU went away: it was unplugged or reset, or its driver gave up. All that was made on it is gone.
    #[error("the GPU was lost ({0}); if that happens again use the CPU backend")]
    Lost(String),
    /// The GPU has no memory for something.
    #[error(
        "the GPU has no memory for {0}; draw a smaller picture, close other programs or use the CPU backend"
    )]
    GpuMemory(String),
    /// The ray-marching rivals were asked for what they cannot draw.
    #[error("{0}")]
    Rival(String),
    /// The GPU failed while drawing.
    #[error("the GPU failed: {0}")]
    Gpu(String),
}
