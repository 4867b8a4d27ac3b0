//! Arrays of `.npz` files. A stated shape is held against the bytes that are there before any memory is asked for it.

use std::io::{Read, Seek, SeekFrom};

use ndarray::{Array, Dimension};
use ndarray_npy::ViewElement;
use zip::ZipArchive;

use crate::hash::ContentHash;
use crate::npy;

/// The array that holds the hash of all others, as hexadecimal digits.
pub(crate) const HASH: &str = "blake3";

/// The record that ends a zip file, without its comment, and the longest comment, bytes.
const END: [u64; 2] = [22, 65_535];

/// Whether the record that ends a zip file is where it has to be.
fn has_end(contents: &mut (impl Read + Seek)) -> std::io::Result<bool> {
    let length = contents.seek(SeekFrom::End(0))?;
    let tail = length.min(END[0] + END[1]);
    contents.seek(SeekFrom::Start(length - tail))?;
    let mut bytes = Vec::new();
    contents.by_ref().take(tail).read_to_end(&mut bytes)?;
    contents.rewind()?;
    Ok(bytes.windows(4).any(|four| four == b"PK\x05\x06"))
}

/// An open file.
pub(crate) struct Npz<R>(ZipArchive<R>);

impl<R: Read + Seek> Npz<R> {
    /// Reads the list of what is in it.
    ///
    /// # Errors
    /// What makes it no zip file.
    pub fn open(mut contents: R) -> Result<Self, String> {
        // Looked for through the whole file otherwise, which may be endless.
        if !has_end(&mut contents).map_err(|e| e.to_string())? {
            return Err("it is no .npz file: the list of its arrays is not at its end".to_owned());
        }
        ZipArchive::new(contents)
            .map(Self)
            .map_err(|e| e.to_string())
    }

    /// Whether there is an array of this name.
    pub fn has(&mut self, name: &str) -> bool {
        self.0.index_for_name(&format!("{name}.npy")).is_some()
    }

    /// Holds the content to the hash that is in the file.
    ///
    /// # Errors
    /// There is none, or another.
    pub fn check_hash(&mut self, hash: &ContentHash) -> Result<(), String> {
        let stated: Array<u8, ndarray::Ix1> = self.array(HASH)?;
        match stated.as_slice() == Some(hash.hex().as_bytes()) {
            true => Ok(()),
            false => {
                Err("its content differs from its hash: the file was damaged or changed".into())
            }
        }
    }

    /// An array by its name.
    ///
    /// # Errors
    /// The name, and what is wrong: it is not there, or of another type, number of axes or length.
    pub fn array<T: ViewElement + Clone, D: Dimension>(
        &mut self,
        name: &str,
    ) -> Result<Array<T, D>, String> {
        let wrong = |why: String| format!("{name}: {why}");
        let mut bytes = Vec::new();
        let mut entry = self
            .0
            .by_name(&format!("{name}.npy"))
            .map_err(|e| wrong(e.to_string()))?;
        entry
            .read_to_end(&mut bytes)
            .map_err(|e| wrong(e.to_string()))?;
        let view = npy::view::<T, D>(&bytes).map_err(|e| wrong(e.to_string()))?;
        Ok(view.to_owned())
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    #[test]
    fn what_has_no_end_of_a_zip_file_is_refused() {
        for bytes in [vec![], vec![0; 10], vec![b'P'; 200_000]] {
            let error = Npz::open(Cursor::new(bytes)).err().unwrap_or_default();
            assert!(error.contains("no .npz file"), "{error}");
        }
    }
}
