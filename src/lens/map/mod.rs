//! A lens as a map: what tracing a ray surface by surface gives, as polynomials over the pupil of its place.
//!
//! For one place on the sensor and one wavelength, where and how steeply a ray leaves into the scene is an analytic
//! function of where on the pupil it is aimed: polynomials of total degree n converge to it quickly. With (p, q) the
//! pupil's coordinates, in which the bundle of every place fills about the unit disk, and δ from the place to the
//! ray's start:
//!
//! ```text
//! F(p, q; x + δ) = Σ c_ij(x) pⁱ qʲ + δ · Σ d_ij(x) pⁱ qʲ          F: place and slopes in the scene
//! ```
//!
//! The coefficients are fitted at nodes over the window; between them, polynomials through six nodes a side are taken.
//! The bundle's edge is kept as the outline that each limiting surface gives it, along many directions; the least of
//! them counts. Rays that come nearer to it than it is known there are traced exactly: so no light is lost at the edge.
//! The map reaches up to eight pixels, so pixels next to each other share a place. Rays that start farther off, which
//! diffraction displaces, are mapped as far as they err by no more than a hundredth of that way, and beyond it traced
//! exactly. A ray's place and slopes have degrees of their own: errors of slopes grow with the distance.
//!
//! Wavelengths between those of some maps take their weighted sum, measured as every other map is.
//!
//! Nothing supposes symmetry: misaligned lenses are mapped as others are. The degree, the nodes and the width of the
//! edge are chosen by the errors of held-out rays against a bound, and the errors reported ([`MapReport`]). Parts of a
//! window that do not meet it are traced exactly; a lens that does not over most of it has no map ([`MapFailure`]).
//!
//! Polynomials over a lens's pupil and field have long stood for it (Buchdahl, Optical Aberration Coefficients (1954);
//! Hullin et al., Polynomial Optics, EGSR 2012; Schrade et al., Sparse high-degree polynomials for wide-angle lenses,
//! EGSR 2016). Those mix the field into one polynomial; for aspheres as strong as a phone's that does not converge.
//!
//! **Bits.** The sums over terms are fused multiply-adds in f32, one per term; every other operation is written out. A
//! fused operation is rounded once, on every processor: where there is no instruction for it, it is slow. So every
//! [`SimdLevel`](crate::simd::SimdLevel) and every grouping of rays gives the same bits.

pub(super) mod basis;
mod build;
mod edge;
mod frame;
mod held_out;
mod horner;
mod kernel;
pub(super) mod least_squares;
mod lens_map;
mod maker;
mod node;
mod place;
mod task;
mod trace;

pub use lens_map::LensMap;
pub use place::PlaceBuffers;
pub use task::{MapBound, MapFailure, MapReport, MapTask};
