//! The envelopes of glTF's bytes: GLB chunks (specification, chapter 4) and buffers.

use std::collections::HashMap;
use std::sync::Arc;

use super::folder::{Folder, Source};
use super::imported::Broken;
use super::json::{Buffer, Document};
use crate::memory;

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

/// The bytes of the document's buffers: of files, `data:` URIs, or the binary chunk. Lengths are held to what the
/// document says, and their sum to the memory budget, before the first is read; buffers of one file share its bytes.
pub(super) fn buffers(
    document: &Document,
    binary: Option<&[u8]>,
    folder: &Folder,
) -> Result<Vec<Arc<Vec<u8>>>, Broken> {
    let place = |index: usize| format!("buffers[{index}]");
    // In the order of their first buffers; no source: the binary chunk.
    let mut sources: Vec<(usize, Option<Source<'_>>)> = Vec::new();
    let mut known = HashMap::new();
    let mut numbers = Vec::with_capacity(document.buffers.len());
    let mut total = 0_u64;
    for (index, buffer) in document.buffers.iter().enumerate() {
        let at = |what: String| (place(index), what);
        let (source, length) = located(index, buffer, binary, folder).map_err(at)?;
        if length < buffer.byte_length {
            let says = buffer.byte_length;
            return Err(at(format!("has {length} bytes, byteLength says {says}")));
        }
        let number = *known.entry(source.clone()).or_insert_with(|| {
            total = total.saturating_add(length);
            sources.push((index, source));
            sources.len() - 1
        });
        numbers.push(number);
    }
    memory::check("all buffers of a glTF file", total)
        .map_err(|e| ("buffers".to_string(), e.to_string()))?;
    let read = sources.iter().map(|(index, source)| {
        let bytes = match (source, binary) {
            (Some(source), _) => source.read().map_err(|what| (place(*index), what))?,
            (None, binary) => binary.unwrap_or_default().to_vec(),
        };
        Ok(Arc::new(bytes))
    });
    let read = read.collect::<Result<Vec<_>, Broken>>()?;
    Ok(numbers.into_iter().map(|n| Arc::clone(&read[n])).collect())
}

/// Where a buffer's bytes are (`None`: in the binary chunk), and how many there are at least.
fn located<'a>(
    index: usize,
    buffer: &'a Buffer,
    binary: Option<&[u8]>,
    folder: &Folder,
) -> Result<(Option<Source<'a>>, u64), String> {
    match (&buffer.uri, binary) {
        (Some(uri), _) => {
            let source = folder.source(uri)?;
            let length = source.length()?;
            Ok((Some(source), length))
        }
        (None, Some(binary)) if index == 0 => Ok((None, binary.len() as u64)),
        (None, _) => Err("has no uri and no binary chunk".into()),
    }
}
