//! WebDataset: tar shards whose members `KEY.EXT` of one sample stand side by side, here with the dataset's own files
//! (`000003.views.exr`), and a `wids` index (version 1) a split. The bytes of a shard depend on its samples alone: no
//! time, no user.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use quadpixel::file;
use quadpixel_datasets::Split;
use serde_json::json;

use super::error::ExportError;
use super::source::Source;
use super::written::Exported;
use crate::observer::{Event, Observer};

pub(super) const CONVENTIONS: &str = "SET-NNNNNN.tar: members KEY.EXT, KEY the sample's name, EXT the file's name in the dataset (views.exr, depth.exr, \
meta.json ...), those of one sample side by side; SET.json: wids index, with the BLAKE3 hash of each shard. Units, signs and what each \
map is the truth of as in the dataset's SPEC.md and each meta.json.";

/// Bytes of a member's header, and what its content is filled up to.
const BLOCK: u64 = 512;

pub(super) fn write(
    source: &Source,
    root: &Path,
    shard_bytes: u64,
    observer: &dyn Observer,
) -> Result<Exported, ExportError> {
    let mut written = Exported::default();
    for split in Split::ALL {
        let mut shards = Vec::new();
        let mut open: Option<Shard> = None;
        for entry in source.entries().iter().filter(|e| e.split == split) {
            if observer.stop_asked() {
                return Err(ExportError::Stopped);
            }
            let files = source.sample(entry)?.all_files()?;
            let size: u64 = files
                .iter()
                .map(|(_, b)| BLOCK + padded(b.len() as u64))
                .sum();
            if let Some(full) = open.take_if(|s| s.bytes + size > shard_bytes) {
                shards.push(full.finish()?);
            }
            let shard = match &mut open {
                Some(shard) => shard,
                None => open.insert(Shard::create(root, split, shards.len())?),
            };
            for (name, bytes) in &files {
                shard.add(&format!("{}.{name}", entry.id), bytes)?;
            }
            shard.samples += 1;
            observer.event(Event::SampleDone);
        }
        if let Some(last) = open {
            shards.push(last.finish()?);
        }
        if shards.is_empty() {
            continue;
        }
        let bytes: u64 = shards.iter().filter_map(|s| s["filesize"].as_u64()).sum();
        let index = json!({
            "__kind__": "wids-shard-index-v1",
            "wids_version": 1,
            "name": split.name(),
            "shardlist": shards,
        });
        let path = root.join(format!("{}.json", split.name()));
        file::write_aside(&path, format!("{index:#}\n").as_bytes())?;
        written = written.plus(Exported {
            files: shards.len() as u64 + 1,
            bytes,
            samples: source.entries().iter().filter(|e| e.split == split).count(),
            clipped: 0,
        });
    }
    Ok(written)
}

fn padded(bytes: u64) -> u64 {
    bytes.div_ceil(BLOCK) * BLOCK
}

/// A shard being written.
struct Shard {
    name: String,
    tar: tar::Builder<Hashed<BufWriter<File>>>,
    bytes: u64,
    samples: u64,
}

impl Shard {
    fn create(root: &Path, split: Split, number: usize) -> Result<Self, ExportError> {
        let name = format!("{}-{number:06}.tar", split.name());
        let file = File::create_new(root.join(&name)).map_err(|e| ExportError::disk(&name, e))?;
        Ok(Self {
            name,
            tar: tar::Builder::new(Hashed {
                hash: blake3::Hasher::new(),
                length: 0,
                to: BufWriter::new(file),
            }),
            bytes: 0,
            samples: 0,
        })
    }

    fn add(&mut self, name: &str, content: &[u8]) -> Result<(), ExportError> {
        let mut header = tar::Header::new_ustar();
        header.set_mtime(0);
        header.set_uid(0);
        header.set_gid(0);
        header.set_size(content.len() as u64);
        header.set_mode(0o644);
        header.set_entry_type(tar::EntryType::Regular);
        let added = self.tar.append_data(&mut header, name, content);
        added.map_err(|e| ExportError::disk(&self.name, e))?;
        self.bytes += BLOCK + padded(content.len() as u64);
        Ok(())
    }

    /// The end of the file, and its line of the index.
    fn finish(self) -> Result<serde_json::Value, ExportError> {
        let finished = self.tar.into_inner().and_then(|mut out| {
            out.flush()?;
            Ok(out)
        });
        let out = finished.map_err(|e| ExportError::disk(&self.name, e))?;
        Ok(json!({
            "url": self.name,
            "nsamples": self.samples,
            "filesize": out.length,
            "blake3": out.hash.finalize().to_hex().as_str(),
        }))
    }
}

/// Hashes and counts what passes.
struct Hashed<W> {
    hash: blake3::Hasher,
    length: u64,
    to: W,
}

impl<W: Write> Write for Hashed<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.to.write(bytes)?;
        self.hash.update(&bytes[..count]);
        self.length += count as u64;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}
