//! A bank as a picture of linear floats: a layer per sub-pixel, a tile per kernel. Depths go down, field nodes (row by
//! row) to the right; each kernel sums to 1, whatever diffraction takes beyond it.

use std::path::Path;

use quadpixel::image::exr::{Compression, Layer, Sample, write_layers};
use quadpixel::image::{Image, ImageError};
use quadpixel::render::kernels::KernelBank;

/// Writes it.
pub(super) fn write(path: &Path, bank: &KernelBank) -> Result<(), ImageError> {
    let names = bank.subpixels().names();
    let images: Vec<Image> = (0..names.len()).map(|s| tiled(bank, s)).collect();
    let layer = |(name, image)| Layer {
        name,
        channels: &["R", "G", "B"],
        image,
        sample: Sample::Float,
    };
    let names: Vec<String> = names.iter().map(ToString::to_string).collect();
    let layers: Vec<Layer<'_>> = names
        .iter()
        .map(String::as_str)
        .zip(&images)
        .map(layer)
        .collect();
    write_layers(path, &layers, Compression::Zip)
}

fn tiled(bank: &KernelBank, subpixel: usize) -> Image {
    let (nx, ny) = bank.size();
    let Some(support) = bank.support() else {
        return Image::zeros(1, 1, 3);
    };
    let (width, height) = (
        support.width * nx * ny,
        support.height * bank.depths().len(),
    );
    let mut image = Image::zeros(width, height, 3);
    for (d, depth) in bank.depths().iter().enumerate() {
        let own = depth.support();
        let (dx, dy) = (
            (own.left - support.left) as usize,
            (own.top - support.top) as usize,
        );
        for node in 0..nx * ny {
            for (i, pixel) in depth.of_node(node).chunks_exact(bank.lanes()).enumerate() {
                let x = node * support.width + i % own.width + dx;
                let y = d * support.height + i / own.width + dy;
                let lane =
                    |c: usize| c.min(bank.channels() - 1) * bank.subpixels().count() + subpixel;
                let colours = [0, 1, 2].map(|c| pixel[lane(c)]);
                image.pixel_mut(x, y).copy_from_slice(&colours);
            }
        }
    }
    image
}
