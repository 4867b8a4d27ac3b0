//! FDTD tables that come with the program, so that nobody has to compute for hours before the first image.
//!
//! Each is what `qpgen response --model fdtd` made of a built-in pixel; its settings stand in its meta data, the
//! command, the cost and the error in `tables/README.md`.

use std::io::Cursor;
use std::path::Path;

use crate::em::{Level, PixelStack};
use crate::response::{AngularResponse, ResponseError};

/// Name and contents of the `.npz` files.
const FILES: [(&str, &[u8]); 2] = [
    ("fdtd_1.6um.npz", include_bytes!("../tables/fdtd_1.6um.npz")),
    ("fdtd_2.8um.npz", include_bytes!("../tables/fdtd_2.8um.npz")),
];

impl AngularResponse {
    /// The shipped table of exactly this pixel by a model, if there is one.
    ///
    /// # Errors
    /// A file of the program that is no table.
    pub fn shipped(level: Level, stack: &PixelStack) -> Result<Option<Self>, ResponseError> {
        for (name, bytes) in FILES {
            let (table, _) = Self::from_npz(Cursor::new(bytes), Path::new(name))?;
            let meta = table.meta();
            if meta.pixel == *stack && meta.model.starts_with(level.name()) {
                return Ok(Some(table));
            }
        }
        Ok(None)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn shipped_tables_are_of_built_in_pixels_by_fdtd() {
        for (name, bytes) in FILES {
            let (table, _) =
                AngularResponse::from_npz(Cursor::new(bytes), Path::new(name)).unwrap();
            assert!(table.meta().model.starts_with("fdtd-"), "{name}");
            let stack = PixelStack::builtin(&table.meta().pixel.name).unwrap();
            assert_eq!(
                AngularResponse::shipped(Level::Fdtd, &stack).unwrap(),
                Some(table)
            );
        }
        let mut other = PixelStack::builtin("1.6um").unwrap();
        other.trench_um = 0.0123;
        assert_eq!(AngularResponse::shipped(Level::Fdtd, &other).unwrap(), None);
    }
}
