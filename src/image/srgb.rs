//! The sRGB transfer function (IEC 61966-2-1): c = 12.92 v below v = 0.0031308, else 1.055 v^(1/2.4) − 0.055.

/// sRGB value (0 to 1) of a linear one; clipped to 0..=1, NaN gives 0.
pub fn from_linear(linear: f32) -> f32 {
    let v = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
    if v <= 0.003_130_8 {
        12.92 * v
    } else {
        1.055 * v.powf(1.0 / 2.4) - 0.055
    }
}

/// Linear value of an sRGB one (0 to 1).
pub fn to_linear(srgb: f32) -> f32 {
    if srgb <= 0.040_45 {
        srgb / 12.92
    } else {
        ((srgb + 0.055) / 1.055).powf(2.4)
    }
}

/// The 8-bit sRGB code of a linear value.
pub fn code_from_linear(linear: f32) -> u8 {
    (from_linear(linear) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn middle_gray_is_code_118_and_the_two_directions_undo_each_other() {
        // 18 % reflectance is sRGB 117.6 by the standard's formula.
        assert_eq!(code_from_linear(0.18), 118);
        for code in 0..=255u8 {
            assert_eq!(code_from_linear(to_linear(f32::from(code) / 255.0)), code);
        }
        assert_eq!(code_from_linear(f32::NAN), 0);
        assert_eq!(code_from_linear(f32::INFINITY), 255);
    }
}
