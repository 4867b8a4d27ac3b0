//! Arrays of `.npy` bytes. The length that a header states is held against the bytes that are there before any memory
//! is asked for it; that of the numbers is by the reader itself.

use std::io;

use ndarray::{ArrayView, Dimension};
use ndarray_npy::{ViewElement, ViewNpyError, ViewNpyExt};

/// Longest header, bytes: a number's type, an order and a shape need a hundred.
const MOST_HEADER: usize = 4096;

/// The array of the bytes of a `.npy` file.
///
/// # Errors
/// They are none, or hold numbers of another type or other axes.
pub fn view<T: ViewElement, D: Dimension>(
    bytes: &[u8],
) -> Result<ArrayView<'_, T, D>, ViewNpyError> {
    check_header(bytes)?;
    ArrayView::view_npy(bytes)
}

/// By NumPy's format (`numpy.lib.format`): magic string, version, and in two bytes, from version 2 on in four, the
/// length of the header that follows.
fn check_header(bytes: &[u8]) -> Result<(), ViewNpyError> {
    let (stated, begin) = match bytes {
        [_, _, _, _, _, _, 0 | 1, _, a, b, ..] => (u32::from_le_bytes([*a, *b, 0, 0]), 10),
        [_, _, _, _, _, _, _, _, a, b, c, d, ..] => (u32::from_le_bytes([*a, *b, *c, *d]), 12),
        _ => (0, 0),
    };
    let most = (bytes.len() - begin).min(MOST_HEADER);
    if stated as usize <= most {
        return Ok(());
    }
    let what = format!("its header states {stated} bytes; allowed: {most} here");
    Err(ViewNpyError::Io(io::Error::new(
        io::ErrorKind::InvalidData,
        what,
    )))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use ndarray::Ix1;

    use super::*;

    /// A file's bytes: magic string, version, length, header, numbers.
    fn bytes(version: u8, stated: &[u8], header: &str, numbers: &[f32]) -> Vec<u8> {
        let mut all = b"\x93NUMPY".to_vec();
        all.extend([version, 0]);
        all.extend(stated);
        all.extend(header.bytes());
        all.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
        all
    }

    #[test]
    fn a_header_longer_than_the_file_asks_for_no_memory() {
        let text = "{'descr': '<f4', 'fortran_order': False, 'shape': (2,), }";
        // Padded as the format says, so that the numbers begin at a multiple of 64.
        let headers = [118, 116].map(|length| format!("{text:0$}\n", length - 1));
        let [short, long] = headers.each_ref();
        let length = |header: &str| u32::try_from(header.len()).unwrap().to_le_bytes();
        let numbers = [1.5, -2.0];
        for whole in [
            bytes(1, &length(short)[..2], short, &numbers),
            bytes(3, &length(long), long, &numbers),
        ] {
            assert_eq!(view::<f32, Ix1>(&whole).unwrap().to_vec(), numbers);
            for end in 0..whole.len() {
                assert!(view::<f32, Ix1>(&whole[..end]).is_err(), "{end} bytes");
            }
        }
        for (version, stated) in [(1, &[0xff; 2][..]), (2, &[0xff; 4]), (3, &[0xff; 4])] {
            let error = view::<f32, Ix1>(&bytes(version, stated, short, &numbers)).unwrap_err();
            assert!(error.to_string().contains("its header states"), "{error}");
        }
        // Nested deeper than a reader's stack may be.
        let nested = "(".repeat(100_000);
        let error = view::<f32, Ix1>(&bytes(3, &length(&nested), &nested, &[])).unwrap_err();
        assert!(error.to_string().contains("100000 bytes"), "{error}");
    }
}
