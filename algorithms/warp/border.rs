//! What stands outside of the image.

/// Rule for samples outside of the image; the letters show a row `abcd` and what is taken to its left and right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Border {
    /// `aaa|abcd|ddd`
    Replicate,
    /// `cba|abcd|dcb`
    Reflect,
    /// `dcb|abcd|cba`
    Reflect101,
    /// `bcd|abcd|abc`
    Wrap,
    /// `vvv|abcd|vvv` with the value v in all channels.
    Constant(f32),
}

impl Border {
    /// The sample in 0..`length` that stands at index `i`; `None` for the constant. `length` ≥ 1.
    pub fn index(self, i: i64, length: usize) -> Option<usize> {
        let n = length as i64;
        if (0..n).contains(&i) {
            return Some(i as usize);
        }
        let inside = match self {
            Self::Constant(_) => return None,
            Self::Replicate => i.clamp(0, n - 1),
            Self::Wrap => i.rem_euclid(n),
            Self::Reflect => {
                let folded = i.rem_euclid(2 * n);
                folded.min(2 * n - 1 - folded)
            }
            Self::Reflect101 => {
                let period = (2 * n - 2).max(1); // one sample: it stands everywhere
                let folded = i.rem_euclid(period);
                folded.min(period - folded).min(n - 1)
            }
        };
        Some(inside as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn around(border: Border, length: usize) -> String {
        let letters: Vec<char> = "abcd".chars().collect();
        (-3..length as i64 + 3)
            .map(|i| border.index(i, length).map_or('v', |k| letters[k]))
            .collect()
    }

    #[test]
    fn borders_stand_as_their_pictures_say() {
        assert_eq!(around(Border::Replicate, 4), "aaaabcdddd");
        assert_eq!(around(Border::Reflect, 4), "cbaabcddcb");
        assert_eq!(around(Border::Reflect101, 4), "dcbabcdcba");
        assert_eq!(around(Border::Wrap, 4), "bcdabcdabc");
        assert_eq!(around(Border::Constant(1.0), 4), "vvvabcdvvv");
    }

    #[test]
    fn images_of_one_and_two_samples_repeat_without_end() {
        for border in [
            Border::Replicate,
            Border::Reflect,
            Border::Reflect101,
            Border::Wrap,
        ] {
            assert_eq!(around(border, 1), "aaaaaaa");
        }
        assert_eq!(around(Border::Reflect, 2), "bbaabbaa");
        assert_eq!(around(Border::Reflect101, 2), "babababa");
        assert_eq!(around(Border::Wrap, 2), "babababa");
    }
}
