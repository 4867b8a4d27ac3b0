//! Sub-aperture images: the views of a sub-pixel mosaic, and their sums.
