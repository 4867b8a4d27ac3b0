//! Typed numbers from glTF accessors: strides, normalised integers, sparse replacements, every bound checked.

use std::cell::Cell;
use std::sync::Arc;

use super::json::{Accessor, BufferView, Document};
use crate::memory;

/// Elements that an accessor may invent without bytes of its own (all zero, then sparse).
const MAX_INVENTED: u64 = 1 << 22;
/// Most numbers that are read for one scene: about 20 s.
const MAX_NUMBERS: u64 = 1 << 31;

/// The document with its buffers' bytes.
pub(super) struct Buffers<'a> {
    pub document: &'a Document,
    pub bytes: Vec<Arc<Vec<u8>>>,
    /// Numbers that were read so far: a file may name the same ones again and again.
    pub numbers: Cell<u64>,
}

/// Component types of the specification, table 3.6.2.2.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32) -> Result<Self, String> {
        Ok(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => {
                return Err(format!(
                    "componentType is {code}; allowed: 5120 to 5123, 5125, 5126"
                ));
            }
        })
    }

    fn size(self) -> u64 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number in little-endian bytes; integers are normalised by the specification's equations (3.11) where asked.
    fn number(self, b: &[u8], normalized: bool) -> f64 {
        let unit = |value: f64, most: f64| {
            if normalized {
                (value / most).max(-1.0)
            } else {
                value
            }
        };
        match (self, b) {
            (Self::I8, &[a, ..]) => unit(f64::from(a as i8), 127.0),
            (Self::U8, &[a, ..]) => unit(f64::from(a), 255.0),
            (Self::I16, &[a, b, ..]) => unit(f64::from(i16::from_le_bytes([a, b])), 32767.0),
            (Self::U16, &[a, b, ..]) => unit(f64::from(u16::from_le_bytes([a, b])), 65535.0),
            (Self::U32, &[a, b, c, d, ..]) => f64::from(u32::from_le_bytes([a, b, c, d])),
            (Self::F32, &[a, b, c, d, ..]) => f64::from(f32::from_le_bytes([a, b, c, d])),
            _ => f64::NAN,
        }
    }
}

impl Buffers<'_> {
    /// The bytes of a buffer view.
    pub fn view(&self, index: usize) -> Result<(&[u8], &BufferView), String> {
        let views = &self.document.buffer_views;
        let view = views.get(index).ok_or_else(|| {
            format!(
                "bufferView {index} does not exist; there are {}",
                views.len()
            )
        })?;
        let buffer = self.bytes.get(view.buffer).ok_or_else(|| {
            format!(
                "buffer {} does not exist; there are {}",
                view.buffer,
                self.bytes.len()
            )
        })?;
        let part = range(buffer, view.byte_offset, view.byte_length).ok_or_else(|| {
            format!(
                "bufferView {index} takes bytes {} to +{} of a buffer of {}",
                view.byte_offset,
                view.byte_length,
                buffer.len()
            )
        })?;
        Ok((part, view))
    }

    /// Colours with alpha, from RGB or RGBA.
    pub fn colours(&self, index: usize) -> Result<Vec<[f64; 4]>, String> {
        let shape = self.document.accessors.get(index).map(|a| a.shape.as_str());
        if shape == Some("VEC4") {
            return self.read::<4>(index);
        }
        let opaque = |[r, g, b]: [f64; 3]| [r, g, b, 1.0];
        Ok(self.read::<3>(index)?.into_iter().map(opaque).collect())
    }

    /// The elements of an accessor of N components each (SCALAR 1, VEC2 2, VEC3 3, VEC4 4, MAT4 16: of 4-byte
    /// components, whose columns have no gaps).
    pub fn read<const N: usize>(&self, index: usize) -> Result<Vec<[f64; N]>, String> {
        let accessors = &self.document.accessors;
        let accessor = accessors.get(index).ok_or_else(|| {
            format!(
                "accessor {index} does not exist; there are {}",
                accessors.len()
            )
        })?;
        self.elements(accessor)
            .map_err(|e| format!("accessor {index}: {e}"))
    }

    fn elements<const N: usize>(&self, accessor: &Accessor) -> Result<Vec<[f64; N]>, String> {
        let shape = match N {
            1 => "SCALAR",
            2 => "VEC2",
            3 => "VEC3",
            4 => "VEC4",
            _ => "MAT4",
        };
        if accessor.shape != shape {
            return Err(format!("type is {}; allowed here: {shape}", accessor.shape));
        }
        let component = Component::of(accessor.component_type)?;
        // As numbers of 8 bytes they may take eight times what the file has of them.
        let numbers = accessor.count.saturating_mul(N as u64);
        memory::check("numbers of a glTF file", numbers.saturating_mul(8))
            .map_err(|e| e.to_string())?;
        self.numbers.set(self.numbers.get().saturating_add(numbers));
        if self.numbers.get() > MAX_NUMBERS {
            return Err(format!(
                "the scene asks for more than {MAX_NUMBERS} numbers, counted as often as they are named"
            ));
        }
        let mut values = match accessor.buffer_view {
            Some(view) => self.packed(
                view,
                accessor.byte_offset,
                accessor.count,
                component,
                accessor.normalized,
            )?,
            None if accessor.count <= MAX_INVENTED => vec![[0.0; N]; accessor.count as usize],
            None => {
                return Err(format!(
                    "count is {} without a bufferView; allowed: up to {MAX_INVENTED}",
                    accessor.count
                ));
            }
        };
        if let Some(sparse) = &accessor.sparse {
            let places: Vec<[f64; 1]> = self.packed(
                sparse.indices.buffer_view,
                sparse.indices.byte_offset,
                sparse.count,
                Component::of(sparse.indices.component_type)?,
                false,
            )?;
            let new: Vec<[f64; N]> = self.packed(
                sparse.values.buffer_view,
                sparse.values.byte_offset,
                sparse.count,
                component,
                accessor.normalized,
            )?;
            for ([place], new) in places.into_iter().zip(new) {
                let count = values.len();
                // A float-typed or negative place is no index either: the cast saturates, and `get_mut` says no.
                let slot = values.get_mut(place as usize).filter(|_| place >= 0.0);
                *slot.ok_or_else(|| {
                    format!("sparse index {place} is out of range; allowed: below {count}")
                })? = new;
            }
        }
        Ok(values)
    }

    fn packed<const N: usize>(
        &self,
        view: usize,
        offset: u64,
        count: u64,
        component: Component,
        normalized: bool,
    ) -> Result<Vec<[f64; N]>, String> {
        let (bytes, view) = self.view(view)?;
        let size = component.size() * N as u64;
        let stride = view.byte_stride.unwrap_or(size);
        if stride < size {
            return Err(format!("byteStride is {stride}; allowed: at least {size}"));
        }
        if count == 0 {
            return Ok(Vec::new());
        }
        let length = (count - 1)
            .checked_mul(stride)
            .and_then(|l| l.checked_add(size));
        let part = length
            .and_then(|l| range(bytes, offset, l))
            .ok_or_else(|| {
                format!(
                    "{count} elements of {size} bytes, {stride} apart, from byte {offset} do not fit the bufferView's {}",
                    bytes.len()
                )
            })?;
        let width = component.size() as usize;
        let element = |chunk: &[u8]| {
            std::array::from_fn(|k| {
                component.number(chunk.get(k * width..).unwrap_or_default(), normalized)
            })
        };
        Ok(part.chunks(stride as usize).map(element).collect())
    }
}

fn range(bytes: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let end = usize::try_from(offset.checked_add(length)?).ok()?;
    bytes.get(usize::try_from(offset).ok()?..end)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    fn document(json: &str) -> Document {
        serde_json::from_str(json).unwrap()
    }

    #[test]
    fn strides_normalised_integers_and_sparse_places_are_read_as_specified() {
        let document = document(
            r#"{"bufferViews": [{"buffer": 0, "byteOffset": 1, "byteLength": 7, "byteStride": 4},
                                {"buffer": 0, "byteLength": 1}, {"buffer": 0, "byteOffset": 1, "byteLength": 2}],
                "accessors": [{"bufferView": 0, "componentType": 5121, "normalized": true, "count": 2, "type": "VEC2"},
                              {"componentType": 5121, "count": 3, "type": "VEC2", "sparse": {"count": 1,
                               "indices": {"bufferView": 1, "componentType": 5121}, "values": {"bufferView": 2}}}]}"#,
        );
        let buffers = Buffers {
            document: &document,
            numbers: Cell::default(),
            bytes: vec![Arc::new(vec![2, 255, 0, 9, 9, 51, 102, 0, 0])],
        };
        assert_eq!(buffers.read::<2>(0).unwrap(), [[1.0, 0.0], [0.2, 0.4]]);
        assert_eq!(
            buffers.read::<2>(1).unwrap(),
            [[0.0; 2], [0.0; 2], [255.0, 0.0]]
        );
    }

    #[test]
    fn what_does_not_fit_its_buffer_is_an_error() {
        let views = r#""bufferViews": [{"buffer": 0, "byteLength": 8}, {"buffer": 0, "byteOffset": 5, "byteLength": 4},
                       {"buffer": 3, "byteLength": 1}, {"buffer": 0, "byteOffset": 18446744073709551615, "byteLength": 2}]"#;
        for accessor in [
            r#"{"bufferView": 0, "componentType": 5126, "count": 3, "type": "SCALAR"}"#,
            r#"{"bufferView": 0, "componentType": 5126, "count": 9223372036854775807, "type": "SCALAR"}"#,
            r#"{"bufferView": 0, "byteOffset": 7, "componentType": 5126, "count": 1, "type": "SCALAR"}"#,
            r#"{"bufferView": 0, "componentType": 5126, "count": 1, "type": "MAT4"}"#,
            r#"{"bufferView": 0, "componentType": 1, "count": 1, "type": "SCALAR"}"#,
            r#"{"bufferView": 1, "componentType": 5126, "count": 1, "type": "SCALAR"}"#,
            r#"{"bufferView": 2, "componentType": 5126, "count": 1, "type": "SCALAR"}"#,
            r#"{"bufferView": 3, "componentType": 5126, "count": 1, "type": "SCALAR"}"#,
            r#"{"bufferView": 9, "componentType": 5126, "count": 1, "type": "SCALAR"}"#,
            r#"{"componentType": 5126, "count": 4000000000, "type": "SCALAR"}"#,
            r#"{"componentType": 5126, "count": 1, "type": "SCALAR", "sparse": {"count": 1,
                "indices": {"bufferView": 0, "componentType": 5121}, "values": {"bufferView": 0}}}"#,
        ] {
            let document = document(&format!("{{{views}, \"accessors\": [{accessor}]}}"));
            let buffers = Buffers {
                document: &document,
                numbers: Cell::default(),
                bytes: vec![Arc::new(vec![7; 8])],
            };
            assert!(buffers.read::<1>(0).is_err(), "{accessor}");
        }
    }
}
