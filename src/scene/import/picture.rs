//! Pictures of materials: PNG, JPEG, TGA, BMP or TIFF to 8-bit RGBA, size checked before they are decoded.

use std::io::Cursor;

use image::ImageReader;

use crate::image::raster::decoded;
use crate::scene::texture::Texture;

/// What is made of a pixel: RGBA twice, and the coarser levels of the texture.
const BYTES_PER_PIXEL: u64 = 14;

/// An 8-bit picture, row-major from the top.
#[derive(Clone, Debug)]
pub(super) struct Picture {
    pub size: (usize, usize),
    pub texels: Vec<[u8; 4]>,
}

/// Decodes a picture; `name` (its extension) helps where the bytes do not say what they are (TGA). `Err` says why not.
pub(super) fn decode(bytes: &[u8], name: &str) -> Result<Picture, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|e| e.to_string())?;
    if reader.format().is_none()
        && let Ok(format) = image::ImageFormat::from_path(name)
    {
        reader.set_format(format);
    }
    let (picture, _) = decoded(reader, BYTES_PER_PIXEL)?;
    let size = (picture.width() as usize, picture.height() as usize);
    if size.0 == 0 || size.1 == 0 {
        return Err("is an empty picture".into());
    }
    if size.0.max(size.1) > Texture::MAX_SIDE_PX {
        let (width, height) = size;
        let most = Texture::MAX_SIDE_PX;
        return Err(format!(
            "is {width} × {height} px; allowed: at most {most} a side"
        ));
    }
    let picture = picture.into_rgba8();
    Ok(Picture {
        size,
        texels: picture.pixels().map(|p| p.0).collect(),
    })
}

impl Picture {
    /// Puts the brightness of `mask` (nearest texel) into alpha.
    pub fn masked_by(mut self, mask: &Picture) -> Self {
        let (width, height) = self.size;
        for (i, texel) in self.texels.iter_mut().enumerate() {
            let x = (i % width) * mask.size.0 / width;
            let y = (i / width) * mask.size.1 / height;
            let [r, g, b, _] = mask.texels[y * mask.size.0 + x];
            texel[3] = ((u32::from(r) + u32::from(g) + u32::from(b)) / 3) as u8;
        }
        self
    }
}
