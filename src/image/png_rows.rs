//! PNG files that are written some rows at a time.
//!
//! Fast deflate: 81 against 5 Mpx/s of the default level, and 16-bit noise hardly compresses at any level. The bytes do
//! not depend on how many rows come at once.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use ::png::{
    BitDepth, ColorType, Compression, Encoder, EncodingError, Filter, StreamWriter, Writer,
};

use super::ImageError;
use crate::file::FileError;

/// Size of a PNG file, and what its numbers are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PngShape {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// 1: gray, 3: RGB.
    pub channels: usize,
    /// 8 or 16.
    pub bits: usize,
}

impl PngShape {
    fn row_bytes(&self) -> usize {
        self.width * self.channels * self.bits / 8
    }

    /// The beginning of a file.
    fn header<W: Write>(&self, path: &Path, write: W) -> Result<Writer<W>, ImageError> {
        let refused = |what: &str| ImageError::Shape {
            path: path.to_path_buf(),
            what: what.to_string(),
        };
        let colour = match self.channels {
            1 => ColorType::Grayscale,
            3 => ColorType::Rgb,
            _ => return Err(refused("a PNG has 1 or 3 channels")),
        };
        let depth = match self.bits {
            8 => BitDepth::Eight,
            16 => BitDepth::Sixteen,
            _ => return Err(refused("a PNG has 8 or 16 bits")),
        };
        let size = |n: usize| u32::try_from(n).ok().filter(|n| *n > 0);
        let (Some(width), Some(height)) = (size(self.width), size(self.height)) else {
            return Err(refused("a PNG has at least one pixel"));
        };
        let mut encoder = Encoder::new(write, width, height);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        encoder.set_compression(Compression::Fast);
        encoder.set_filter(Filter::Adaptive);
        encoder.write_header().map_err(|cause| error(path, cause))
    }

    fn wrong(&self, path: &Path, bytes: usize) -> ImageError {
        let Self {
            width,
            height,
            channels,
            bits,
        } = self;
        ImageError::Shape {
            path: path.to_path_buf(),
            what: format!(
                "{bytes} bytes are not {width} × {height} pixels of {channels} × {bits} bits, or rows of them"
            ),
        }
    }
}

/// The bytes of a whole file, of codes as the file has them (big-endian); the same as of [`PngRows`].
pub(super) fn encode(path: &Path, shape: PngShape, codes: &[u8]) -> Result<Vec<u8>, ImageError> {
    if codes.len() != shape.row_bytes() * shape.height {
        return Err(shape.wrong(path, codes.len()));
    }
    let mut bytes = Vec::new();
    let mut file = shape.header(path, &mut bytes)?;
    let mut stream = file.stream_writer().map_err(|cause| error(path, cause))?;
    let written = stream.write_all(codes);
    written.map_err(|cause| FileError::new(path, "write", cause))?;
    stream.finish().map_err(|cause| error(path, cause))?;
    file.finish().map_err(|cause| error(path, cause))?;
    Ok(bytes)
}

/// 16-bit codes as a file has them.
pub(super) fn big_endian(codes: &[u16]) -> Vec<u8> {
    let mut bytes = vec![0; 2 * codes.len()];
    let (pairs, _) = bytes.as_chunks_mut::<2>();
    (pairs.iter_mut().zip(codes)).for_each(|(pair, code)| *pair = code.to_be_bytes());
    bytes
}

/// What was written fails here for good: the encoder writes its last bytes where it is dropped, and tells nobody how
/// that went.
struct Watched<W: Write> {
    write: BufWriter<W>,
    /// The first failure.
    failed: Arc<Mutex<Option<io::Error>>>,
}

impl<W: Write> Watched<W> {
    fn noted<T>(&self, done: io::Result<T>) -> io::Result<T> {
        done.map_err(|cause| {
            let told = io::Error::new(cause.kind(), cause.to_string());
            let mut failed = self.failed.lock().unwrap_or_else(PoisonError::into_inner);
            failed.get_or_insert(cause);
            told
        })
    }
}

impl<W: Write> Write for Watched<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let done = self.write.write(bytes);
        self.noted(done)
    }

    fn flush(&mut self) -> io::Result<()> {
        let done = self.write.flush();
        self.noted(done)
    }
}

impl<W: Write> Drop for Watched<W> {
    fn drop(&mut self) {
        let _ = self.flush();
    }
}

/// A PNG file in the making.
pub struct PngRows<W: Write + 'static> {
    path: PathBuf,
    shape: PngShape,
    /// Bytes that were taken.
    taken: usize,
    stream: StreamWriter<'static, Watched<W>>,
    failed: Arc<Mutex<Option<io::Error>>>,
}

impl<W: Write + 'static> PngRows<W> {
    /// Begins a file, which `write` gets in large pieces; `path` is for messages only.
    ///
    /// # Errors
    /// [`ImageError::Shape`] for other than 1 or 3 channels, no pixel or too many; what `write` says.
    pub fn new(path: &Path, write: W, shape: PngShape) -> Result<Self, ImageError> {
        let failed = Arc::default();
        let watched = Watched {
            write: BufWriter::new(write),
            failed: Arc::clone(&failed),
        };
        let stream = shape.header(path, watched)?.into_stream_writer();
        Ok(Self {
            failed,
            path: path.to_path_buf(),
            shape,
            taken: 0,
            stream: stream.map_err(|cause| error(path, cause))?,
        })
    }

    /// Goes on with the codes of some rows.
    ///
    /// # Errors
    /// [`ImageError::Shape`] for what are no whole rows, or too many; what `write` says.
    pub fn codes16(&mut self, codes: &[u16]) -> Result<(), ImageError> {
        self.bytes(&big_endian(codes), 16)
    }

    /// As [`Self::codes16`], of 8 bits.
    ///
    /// # Errors
    /// As there.
    pub fn codes8(&mut self, codes: &[u8]) -> Result<(), ImageError> {
        self.bytes(codes, 8)
    }

    fn bytes(&mut self, bytes: &[u8], bits: usize) -> Result<(), ImageError> {
        let whole_rows = bytes.len().is_multiple_of(self.shape.row_bytes());
        let all = self.shape.row_bytes() * self.shape.height;
        if bits != self.shape.bits || !whole_rows || self.taken + bytes.len() > all {
            return Err(self.shape.wrong(&self.path, bytes.len()));
        }
        self.taken += bytes.len();
        let written = self.stream.write_all(bytes);
        written.map_err(|cause| FileError::new(&self.path, "write", cause).into())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// [`ImageError::Shape`] if rows are missing; what `write` says.
    pub fn finish(self) -> Result<(), ImageError> {
        if self.taken != self.shape.row_bytes() * self.shape.height {
            return Err(self.shape.wrong(&self.path, self.taken));
        }
        let finished = self.stream.finish();
        finished.map_err(|cause| error(&self.path, cause))?;
        let failed = self.failed.lock();
        match failed.unwrap_or_else(PoisonError::into_inner).take() {
            Some(cause) => Err(FileError::new(&self.path, "write", cause).into()),
            None => Ok(()),
        }
    }
}

fn error(path: &Path, cause: EncodingError) -> ImageError {
    match cause {
        EncodingError::IoError(cause) => FileError::new(path, "write", cause).into(),
        cause => ImageError::Encode {
            path: path.to_path_buf(),
            cause: cause.to_string(),
        },
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    const SHAPE: PngShape = PngShape {
        width: 37,
        height: 40,
        channels: 3,
        bits: 16,
    };

    #[derive(Clone, Default)]
    struct Shared(Arc<Mutex<Vec<u8>>>);

    impl Write for Shared {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    fn written(codes: &[u16], rows_at_once: usize) -> Vec<u8> {
        let bytes = Shared::default();
        let mut png = PngRows::new(Path::new("a.png"), bytes.clone(), SHAPE).unwrap();
        for rows in codes.chunks(37 * 3 * rows_at_once) {
            png.codes16(rows).unwrap();
        }
        png.finish().unwrap();
        let bytes = bytes.0.lock().unwrap();
        bytes.clone()
    }

    #[test]
    fn the_codes_come_back_and_the_bytes_do_not_know_how_many_rows_came_at_once() {
        let codes: Vec<u16> = (0..37 * 3 * 40u32).map(|i| (i * i * 7) as u16).collect();
        let whole = encode(Path::new("a.png"), SHAPE, &big_endian(&codes)).unwrap();
        assert_eq!(whole, written(&codes, 40));
        assert_eq!(whole, written(&codes, 1));
        assert_eq!(whole, written(&codes, 13));
        let read = ::image::load_from_memory(&whole).unwrap();
        assert_eq!(read.into_rgb16().into_raw(), codes);
    }

    /// A disk that is full after so many bytes.
    struct Full(usize);

    impl Write for Full {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            match bytes.len().min(self.0) {
                0 => Err(io::ErrorKind::StorageFull.into()),
                some => {
                    self.0 -= some;
                    Ok(some)
                }
            }
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_disk_that_is_full_at_any_byte_is_told() {
        let codes: Vec<u16> = (0..37 * 3 * 40u32).map(|i| (i * i * 7) as u16).collect();
        let whole = encode(Path::new("a.png"), SHAPE, &big_endian(&codes)).unwrap();
        let write = |bytes: usize| {
            let mut png = PngRows::new(Path::new("a.png"), Full(bytes), SHAPE)?;
            codes.chunks(37 * 3).try_for_each(|row| png.codes16(row))?;
            png.finish()
        };
        assert!(write(whole.len()).is_ok());
        for bytes in (0..whole.len())
            .rev()
            .step_by(7)
            .chain(whole.len() - 20..whole.len())
        {
            assert!(matches!(write(bytes), Err(ImageError::File(_))), "{bytes}");
        }
    }

    #[test]
    fn what_are_no_rows_is_refused_and_so_is_a_file_without_its_last() {
        let mut png = PngRows::new(Path::new("a.png"), Vec::new(), SHAPE).unwrap();
        assert!(png.codes16(&[0; 37]).is_err());
        assert!(png.codes8(&[0; 37 * 3 * 2]).is_err());
        png.codes16(&[0; 37 * 3 * 39]).unwrap();
        assert!(png.codes16(&[0; 37 * 3 * 2]).is_err());
        assert!(matches!(png.finish(), Err(ImageError::Shape { .. })));
        for (width, channels, bits) in [(0, 3, 16), (4, 2, 16), (4, 3, 12)] {
            let shape = PngShape {
                width,
                channels,
                bits,
                height: 4,
            };
            assert!(PngRows::new(Path::new("a.png"), Vec::new(), shape).is_err());
        }
    }
}
