//! Low-discrepancy samples keyed by (seed, pixel, sample).
