//! Wavelengths of the colour channels.
