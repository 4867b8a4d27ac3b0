//! Bytes with a few damages of the kind that a reader of text or binary numbers may stumble over.

use quadpixel::sampling::hash;

/// Texts in the place of a number.
const ODD: [&str; 10] = [
    "-1",
    "0",
    "99999999999",
    "1e308",
    "null",
    "NaN",
    "[]",
    "65535",
    "\"\"",
    "4294967296",
];

/// The bytes with one to three damages: bytes changed, cut out, doubled, odd numbers put in. The same for the same key.
pub fn damaged(valid: &[u8], key: u64) -> Vec<u8> {
    let mut bytes = valid.to_vec();
    for k in 0..=hash(key, &[0]) % 3 {
        let dice =
            |what: u64, below: usize| (hash(key, &[1, k, what]) % below.max(1) as u64) as usize;
        let at = dice(0, bytes.len());
        let length = 1 + dice(1, 12).min(bytes.len().saturating_sub(at + 1));
        match dice(2, 7) {
            0 => bytes[at] = dice(3, 256) as u8,
            1 => bytes[at] ^= 1 << dice(3, 8),
            2 => drop(bytes.drain(at..(at + length).min(bytes.len()))),
            3 => {
                let part = bytes[at..(at + length).min(bytes.len())].to_vec();
                bytes.splice(at..at, part);
            }
            4 => {
                let odd = ODD[dice(3, ODD.len())].bytes();
                // In the place of a number, where one follows.
                let digit = |b: &u8| b.is_ascii_digit();
                let from = bytes[at..].iter().position(digit).map_or(at, |p| at + p);
                let to = from + bytes[from..].iter().take_while(|b| digit(b)).count();
                bytes.splice(from..to, odd);
            }
            // A length or count of 2 or 4 bytes that is far too large.
            5 => bytes[at..]
                .iter_mut()
                .take(2 + 2 * dice(3, 2))
                .for_each(|b| *b = 0xFF),
            _ => bytes.truncate(at.max(1)),
        }
        if bytes.is_empty() {
            bytes.push(0);
        }
    }
    bytes
}
