//! Sub-pixel block matching: how far each part of one view is shifted against another.
