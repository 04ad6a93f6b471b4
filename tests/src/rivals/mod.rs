//! Other ways to draw the same object, measured beside the player on the same rays, threads and reference.
//!
//! | module | what it is | stored | what a frame pays for |
//! |---|---|---|---|
//! | [`thesis`] | the published recipe without anything added to it | 25 harmonics of ψ in f32 a sample | kernels on a ray |
//! | [`march`] with [`shadows`] | brute force: steps along the ray, exact shadow rays | nothing | steps × lights × shadow rays |
//! | [`march`] with [`grid`] | the same steps, light from a regular grid of harmonics | as many bytes as the samples | steps × (8 nodes + lights) |
//!
//! All of them take camera rays and inside pieces from the player's own pass, and attenuate along the view ray as the
//! player does. They run on the CPU.
//!
//! ```text
//! asset, mesh, medium ─> object ─┬─ shadows ──┐
//!                                ├─ depths ─ fit ─ grid ─┴─> march ─┐
//!                                └─ depths ─ fit ─ thesis ──────────┴─> rays ─> picture
//! ```

pub mod depths;
pub mod fit;
pub mod grid;
mod lattice;
pub mod march;
pub mod object;
pub mod rays;
pub mod shadows;
pub mod thesis;
mod tiles;
mod track;
