//! The response as a file: an uncompressed `.npz` (NumPy: `np.load(path)`) with
//!
//! | array | type | shape |
//! |---|---|---|
//! | `P` | f32 | [wavelength, shift, v, u, sub-pixel] |
//! | `wavelength_nm` | f64 | [wavelength] |
//! | `shift_um` | f64 | [shift, 2] |
//! | `u`, `v` | f64 | direction cosines |
//! | `meta` | u8 | UTF-8 JSON of [`ResponseMeta`]: `json.loads(bytes(f["meta"]))` |
//! | `blake3` | u8 | hash of the others: 64 hexadecimal digits |
//!
//! A table of shifted lenses has `shift_grid` in its `meta` (pitch, and N shifts per pitch along x and y); its shifts
//! are the octant `0 ≤ j ≤ i ≤ N/2` of `(i, j) pitch / N`, the quadrant where m ≠ n. For another shift s take the
//! symmetry g of the square (axes swapped, then signs changed; only the signs where m ≠ n) with `g s` in the octant but
//! for whole pitches: `P_i(u, v; s) = P_gi(g (u, v); g s)`, where g acts on sub-pixels as on their places.
//! `chief_ray_shifts` there says which shift a chief ray needs.

use std::io::{BufReader, Cursor, Read, Seek};
use std::path::Path;

use ndarray::{Array1, Array2, ArrayView1, ArrayView2, IxDyn};
use ndarray_npy::NpzWriter;

use crate::file;
use crate::hash::ContentHash;
use crate::npz::{HASH, Npz};
use crate::response::{AngularResponse, ResponseAxes, ResponseError, ResponseMeta};

impl AngularResponse {
    /// Writes the table; the file appears under its name only when it is whole.
    ///
    /// # Errors
    /// A disk that fails.
    pub fn write_npz(&self, path: &Path) -> Result<(), ResponseError> {
        let bytes = self.to_npz(path)?;
        file::write_aside(path, &bytes).map_err(|e| io(path, e.cause))
    }

    /// The bytes of the file; `path` names it in errors.
    fn to_npz(&self, path: &Path) -> Result<Vec<u8>, ResponseError> {
        let format = |why: String| ResponseError::Format {
            path: path.to_owned(),
            why,
        };
        let a = self.axes();
        let (nw, ns) = (a.wavelengths_nm.len(), a.shifts_um.len());
        let shape = [nw, ns, a.v.len(), a.u.len(), self.subpixels().count()];
        let p = ndarray::ArrayView::from_shape(IxDyn(&shape), self.table())
            .map_err(|e| format(e.to_string()))?;
        let shifts = ArrayView2::from(&a.shifts_um[..]);
        let meta = serde_json::to_vec(self.meta()).map_err(|e| format(e.to_string()))?;
        let hash = content_hash(&meta, a, self.table());
        // In memory first: ndarray-npy hides the kind of an I/O error, and a table is a few MB at most.
        let mut npz = NpzWriter::new(Cursor::new(Vec::new()));
        let wrote = npz
            .add_array("P", &p)
            .and_then(|()| npz.add_array("wavelength_nm", &ArrayView1::from(&a.wavelengths_nm)))
            .and_then(|()| npz.add_array("shift_um", &shifts))
            .and_then(|()| npz.add_array("u", &ArrayView1::from(&a.u)))
            .and_then(|()| npz.add_array("v", &ArrayView1::from(&a.v)))
            .and_then(|()| npz.add_array("meta", &ArrayView1::from(&meta)))
            .and_then(|()| npz.add_array(HASH, &ArrayView1::from(hash.hex().as_bytes())))
            .and_then(|()| npz.finish());
        Ok(wrote.map_err(|e| format(e.to_string()))?.into_inner())
    }

    /// Reads a table and checks all of it: shapes, axes, ranges, sums.
    ///
    /// # Errors
    /// A file that cannot be read, or is no such table.
    pub fn read_npz(path: &Path) -> Result<Self, ResponseError> {
        let file = file::open(path).map_err(|e| io(path, e.cause))?;
        Self::from_npz(BufReader::new(file), path).map(|(table, _)| table)
    }

    /// [`Self::read_npz`] of a file that this program keeps: its content has to be that of its hash.
    pub(super) fn read_kept(path: &Path) -> Result<Self, ResponseError> {
        let file = file::open(path).map_err(|e| io(path, e.cause))?;
        match Self::from_npz(BufReader::new(file), path)? {
            (table, true) => Ok(table),
            (_, false) => Err(ResponseError::Format {
                path: path.to_owned(),
                why: "it has no hash of its content".into(),
            }),
        }
    }

    /// [`Self::read_npz`] of any contents, and whether they have a hash, to which they are held then; `path` names them
    /// in errors.
    pub(super) fn from_npz(
        contents: impl Read + Seek,
        path: &Path,
    ) -> Result<(Self, bool), ResponseError> {
        let format = |why: String| ResponseError::Format {
            path: path.to_owned(),
            why,
        };
        let mut npz = Npz::open(contents).map_err(format)?;
        let stated: Array1<u8> = npz.array("meta").map_err(format)?;
        let stated = stated.to_vec();
        let meta: ResponseMeta =
            serde_json::from_slice(&stated).map_err(|e| format(format!("meta: {e}")))?;
        let shifts: Array2<f64> = npz.array("shift_um").map_err(format)?;
        if shifts.ncols() != 2 {
            return Err(format(format!(
                "shift_um: {} columns instead of 2",
                shifts.ncols()
            )));
        }
        let wavelengths: Array1<f64> = npz.array("wavelength_nm").map_err(format)?;
        let u: Array1<f64> = npz.array("u").map_err(format)?;
        let v: Array1<f64> = npz.array("v").map_err(format)?;
        let axes = ResponseAxes {
            wavelengths_nm: wavelengths.to_vec(),
            shifts_um: shifts.rows().into_iter().map(|r| [r[0], r[1]]).collect(),
            u: u.to_vec(),
            v: v.to_vec(),
        };
        let p: ndarray::ArrayD<f32> = npz.array("P").map_err(format)?;
        let shape = [
            axes.wavelengths_nm.len(),
            axes.shifts_um.len(),
            axes.v.len(),
            axes.u.len(),
            meta.subpixels.count(),
        ];
        if p.shape() != shape {
            return Err(format(format!(
                "P: shape {:?}, but the axes and meta say {shape:?}",
                p.shape()
            )));
        }
        let p: Vec<f32> = p.iter().copied().collect();
        let has_hash = npz.has(HASH);
        if has_hash {
            (npz.check_hash(&content_hash(&stated, &axes, &p))).map_err(format)?;
        }
        let table = Self::new(axes, meta, p).map_err(|e| format(e.to_string()))?;
        Ok((table, has_hash))
    }
}

/// Of all that is in the file; `meta` holds the key of the table, so that a hash belongs to one table only.
fn content_hash(meta: &[u8], axes: &ResponseAxes, table: &[f32]) -> ContentHash {
    let ResponseAxes {
        wavelengths_nm,
        shifts_um,
        u,
        v,
    } = axes;
    ContentHash::new(meta)
        .array(wavelengths_nm, f64::to_le_bytes)
        .array(&shifts_um.concat(), f64::to_le_bytes)
        .array(u, f64::to_le_bytes)
        .array(v, f64::to_le_bytes)
        .array(table, f32::to_le_bytes)
}

fn io(path: &Path, source: std::io::Error) -> ResponseError {
    ResponseError::Io {
        path: path.to_owned(),
        source,
    }
}
