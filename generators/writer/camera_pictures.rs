//! Camera-like pictures of the sum and of the views.

use std::path::Path;

use quadpixel::image::{Image, ImageError, raster};
use quadpixel_datasets::CameraPictures;

/// A picture of tiles in the making: 8-bit codes, all of them in memory, as tiles are stored beside and below each
/// other.
pub(super) struct CameraCodes {
    /// Columns and rows of tiles.
    grid: [usize; 2],
    /// Columns and rows of a tile.
    tile: [usize; 2],
    /// Rows of each tile that there are.
    rows: usize,
    codes: Vec<u8>,
}

impl CameraCodes {
    pub fn new(grid: [usize; 2], tile: [usize; 2]) -> Self {
        Self {
            grid,
            tile,
            rows: 0,
            codes: vec![0; 3 * grid[0] * grid[1] * tile[0] * tile[1]],
        }
    }

    /// Goes on with some rows of each tile, in stored order, multiplied by `gain` first.
    pub fn add(&mut self, how: &CameraPictures, tiles: &[Image], gain: f64) {
        let across = self.grid[0] * self.tile[0];
        for (number, tile) in tiles.iter().enumerate() {
            let (column, row) = (number % self.grid[0], number / self.grid[0]);
            let top = row * self.tile[1] + self.rows;
            for y in 0..tile.height() {
                let first = (top + y) * across + column * self.tile[0];
                let out = &mut self.codes[3 * first..][..3 * self.tile[0]];
                for (x, out) in out.chunks_exact_mut(3).enumerate() {
                    let pixel = tile.pixel(x, y);
                    let linear = std::array::from_fn(|c| gain * f64::from(pixel[c]));
                    out.copy_from_slice(&how.development.codes(linear));
                }
            }
        }
        self.rows += tiles.first().map_or(0, Image::height);
    }

    /// The bytes of the picture.
    ///
    /// # Errors
    /// What the encoder refuses.
    pub fn encode(&self, path: &Path, how: &CameraPictures) -> Result<Vec<u8>, ImageError> {
        let [width, height] = [0, 1].map(|k| self.grid[k] * self.tile[k]);
        match how.jpeg_quality {
            Some(quality) => raster::encode_jpeg(path, &self.codes, width, height, quality),
            None => raster::encode_png8(path, &self.codes, width, height, 3),
        }
    }
}
