//! sRGB code values and linear light.
//!
//! With c the code value and L the linear value, both in [0, 1] (IEC 61966-2-1):
//!
//! ```text
//! L = c / 12.92                      c ≤ 0.04045
//! L = ((c + 0.055) / 1.055)^2.4      else
//! ```

/// Linear value of an sRGB code value in [0, 1] (not clamped).
#[inline]
pub fn linear_from_srgb(code: f32) -> f32 {
    if code <= 0.04045 {
        code / 12.92
    } else {
        ((code + 0.055) / 1.055).powf(2.4)
    }
}

/// sRGB code value of a linear value in [0, 1] (not clamped).
#[inline]
pub fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// 8-bit sRGB code of a linear value, clamped to [0, 1] and rounded to nearest.
#[inline]
pub fn srgb8_from_linear(linear: f32) -> u8 {
    (srgb_from_linear(linear.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_mid_grey_is_the_standards_value() {
        // IEC 61966-2-1: code 0.5 is 0.21404 in linear light.
        assert!((linear_from_srgb(0.5) - 0.214_041_1).abs() < 1e-6);
    }

    #[test]
    fn all_8_bit_codes_survive_the_round_trip() {
        for code in 0..=255u8 {
            assert_eq!(
                srgb8_from_linear(linear_from_srgb(f32::from(code) / 255.0)),
                code
            );
        }
    }
}
