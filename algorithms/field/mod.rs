//! Smooth fields fitted to scattered shifts.
