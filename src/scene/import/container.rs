//! The envelopes of glTF's bytes: GLB chunks (specification, chapter 4) and buffers.

use super::folder::Folder;
use super::imported::Broken;
use super::json::{Buffer, Document};

/// The JSON chunk and the binary one of a GLB (specification, chapter 4).
pub(super) fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let word = |at: usize| -> Option<usize> {
        let four = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes(four.try_into().ok()?) as usize)
    };
    let cut = || "ends within a chunk".to_string();
    let version = word(4).ok_or_else(cut)?;
    if version != 2 {
        return Err(format!("version is {version}; allowed: 2"));
    }
    let (mut json, mut binary, mut at) = (None, None, 12);
    while at < bytes.len() {
        let length = word(at).ok_or_else(cut)?;
        let kind = bytes.get(at + 4..at + 8).ok_or_else(cut)?;
        let end = (at + 8).checked_add(length).ok_or_else(cut)?;
        let data = bytes.get(at + 8..end).ok_or_else(cut)?;
        match kind {
            b"JSON" => json = json.or(Some(data)),
            b"BIN\0" => binary = binary.or(Some(data)),
            _ => {} // chunks of other kinds are to be passed over
        }
        at = end;
    }
    Ok((json.ok_or("has no JSON chunk")?, binary))
}

/// The bytes of the document's buffers: of files, `data:` URIs, or the binary chunk.
pub(super) fn buffers(
    document: &Document,
    binary: Option<&[u8]>,
    folder: &Folder,
) -> Result<Vec<Vec<u8>>, Broken> {
    let of = |(index, buffer): (usize, &Buffer)| {
        let at = |what: String| (format!("buffers[{index}]"), what);
        let bytes = match (&buffer.uri, binary) {
            (Some(uri), _) => folder.read(uri).map_err(at)?,
            (None, Some(binary)) if index == 0 => binary.to_vec(),
            (None, _) => return Err(at("has no uri and no binary chunk".into())),
        };
        if (bytes.len() as u64) < buffer.byte_length {
            let (has, says) = (bytes.len(), buffer.byte_length);
            return Err(at(format!("has {has} bytes, byteLength says {says}")));
        }
        Ok(bytes)
    };
    document.buffers.iter().enumerate().map(of).collect()
}
