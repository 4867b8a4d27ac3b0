//! The contact sheet of a bank: depths go down, field nodes along the window's diagonal to the right. Of each kernel
//! the sum of the sub-pixels, and the left half (red) over the right half (cyan), which is where they differ. Light is
//! shown through the sRGB curve, each pair scaled by its own brightest pixel.

use quadpixel::image::colour::Rgb;
use quadpixel::image::views::Side;
use quadpixel::image::{Image, srgb};

use super::Bank;
use crate::preview::Sheet;

const TILE: usize = 96;
const GAP: usize = 6;
const HEADER: usize = 30;
const LABELS: usize = 110;
const BACKGROUND: Rgb = [32, 32, 34];
const TEXT: Rgb = [225, 225, 225];

/// Draws it.
pub(super) fn contact_sheet(bank: &Bank<'_>) -> Sheet {
    let kernels = bank.kernels;
    let (nx, ny) = kernels.size();
    let steps = nx.max(ny);
    let node = |k: usize| {
        let at = |n: usize| (k * (n - 1) + (steps - 1) / 2) / (steps - 1).max(1);
        at(ny) * nx + at(nx)
    };
    let width = LABELS + steps * (2 * TILE + 2 * GAP);
    let mut sheet = Sheet::new(
        width,
        HEADER + kernels.depths().len() * (TILE + GAP),
        BACKGROUND,
    );
    let side = kernels.support().map_or(0, |s| s.width.max(s.height));
    let caption = format!("sum, L red R cyan; {side} px kernels; fields along the diagonal");
    sheet.text(GAP, 8, 2, &caption, TEXT);
    for (depth, metres) in bank.depths_m.iter().enumerate() {
        let y = HEADER + depth * (TILE + GAP);
        sheet.text(GAP, y + TILE / 2, 2, &format!("{metres:.3} m"), TEXT);
        for k in 0..steps {
            let x = LABELS + k * (2 * TILE + 2 * GAP);
            let [sum, halves] = pictures(bank, depth, node(k));
            for (i, picture) in [sum, halves].iter().enumerate() {
                sheet.picture((x + i * (TILE + 2), y, TILE), picture, |p| {
                    [0, 1, 2].map(|c| srgb::code_from_linear(p[c].clamp(0.0, 1.0)))
                });
            }
        }
    }
    sheet
}

/// The sum, and the halves, of the reference channel, brightest 1.
fn pictures(bank: &Bank<'_>, depth: usize, node: usize) -> [Image; 2] {
    let kernels = bank.kernels;
    let subpixels = kernels.subpixels();
    let depth_kernels = &kernels.depths()[depth];
    let support = depth_kernels.support();
    let channel = (kernels.channels() - 1).min(1);
    let energy: Vec<f32> = (0..subpixels.count())
        .map(|s| kernels.figures(depth, node, channel, s).white_sr as f32)
        .collect();
    let [left, right, all] =
        [Side::Left, Side::Right, Side::All].map(|side| side.members(subpixels));
    let mut sum = Image::zeros(support.width, support.height, 3);
    let mut halves = sum.clone();
    let pixels = depth_kernels.of_node(node).chunks_exact(kernels.lanes());
    for (i, pixel) in pixels.enumerate() {
        let light = |members: &[usize]| -> f32 {
            let parts = members
                .iter()
                .map(|&s| pixel[channel * subpixels.count() + s] * energy[s]);
            parts.sum()
        };
        let (x, y) = (i % support.width, i / support.width);
        sum.pixel_mut(x, y).fill(light(&all));
        let (l, r) = (light(&left), light(&right));
        halves.pixel_mut(x, y).copy_from_slice(&[l, r, r]);
    }
    [sum, halves].map(|mut image| {
        let brightest = image
            .data()
            .iter()
            .fold(f32::MIN_POSITIVE, |m, v| m.max(*v));
        image.data_mut().iter_mut().for_each(|v| *v /= brightest);
        image
    })
}
