//! Arrays of `.npz` files. A stated shape is held against the bytes that are there before any memory is asked for it.

use std::io::{Read, Seek};

use ndarray::{Array, ArrayView, Dimension};
use ndarray_npy::{ViewElement, ViewNpyExt};
use zip::ZipArchive;

use crate::hash::ContentHash;

/// The array that holds the hash of all others, as hexadecimal digits.
pub(crate) const HASH: &str = "blake3";

/// An open file.
pub(crate) struct Npz<R>(ZipArchive<R>);

impl<R: Read + Seek> Npz<R> {
    /// Reads the list of what is in it.
    ///
    /// # Errors
    /// What makes it no zip file.
    pub fn open(contents: R) -> Result<Self, String> {
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
        let view = ArrayView::<T, D>::view_npy(&bytes).map_err(|e| wrong(e.to_string()))?;
        Ok(view.to_owned())
    }
}
