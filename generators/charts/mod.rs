//! Flat charts, randomised from one seed.
