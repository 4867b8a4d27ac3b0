//! What is used inside, in one place.
//!
//! | quantity | unit inside | float |
//! |---|---|---|
//! | lens and scene geometry | mm | f64: phone-lens spots are 1e-3 mm, paths are 1e3 mm |
//! | pixel geometry (pitch, stack, microlens shift) | µm | f64 |
//! | wavelength | nm | f64 |
//! | angles | rad inside, deg at the boundary | f64 |
//! | direction cosines, P_abs | 1 | f64 in tables' construction, f32 in tables and images |
//! | depth, ray distance in files | m | f32 |
//! | disparity, circle of confusion | px (1 px = 1 microlens) | f32 |
//!
//! Names at a boundary carry the unit: `_mm`, `_um`, `_nm`, `_deg`, `_m`, `_px`.

/// Millimetres in a micrometre.
pub const MM_PER_UM: f64 = 1e-3;
/// Millimetres in a nanometre.
pub const MM_PER_NM: f64 = 1e-6;
/// A length in µm of one in nm.
#[inline]
pub fn um_from_nm(nm: f64) -> f64 {
    nm * 1e-3
}
/// Metres in a millimetre.
pub const M_PER_MM: f64 = 1e-3;
/// The helium d line in nm, at which lens files state their indices.
pub const D_LINE_NM: f64 = 587.5618;
/// The hydrogen F line in nm.
pub const F_LINE_NM: f64 = 486.1327;
/// The hydrogen C line in nm.
pub const C_LINE_NM: f64 = 656.2725;
