//! Pictures of a lens as SVG: its section with fans of rays, and its spot diagrams.

mod layout;
mod spots;

pub use layout::layout_svg;
pub use spots::spots_svg;
