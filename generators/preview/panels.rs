//! The pictures of a contact sheet, reduced while their rows come.

use quadpixel::image::Image;
use quadpixel::image::views::{Side, sum_of};
use quadpixel::sensor::Subpixels;

use super::TILE;
use super::thumbnail::Thumbnail;

/// Some rows of what a sheet shows.
#[derive(Clone, Copy, Debug)]
pub struct Rows<'a> {
    /// One view per sub-pixel in stored order.
    pub views: &'a [Image],
    /// Their sum.
    pub sum: &'a Image,
    /// The all-in-focus image.
    pub target: &'a Image,
    /// Depth, m.
    pub depth_m: &'a Image,
    /// x_L − x_R, px; `None` for a pixel of one column.
    pub left_right_px: Option<&'a Image>,
    /// Circle of confusion, px.
    pub coc_px: &'a Image,
    /// Occluded fraction of the pupil.
    pub occlusion: &'a Image,
}

/// The pictures of a sheet.
#[derive(Clone, Debug)]
pub struct Panels {
    subpixels: Subpixels,
    pub(super) sum: Thumbnail,
    pub(super) views: Vec<Thumbnail>,
    pub(super) target: Thumbnail,
    /// Of red, green and blue the left, the right, and the right half; `None` for a pixel of one column.
    pub(super) left_and_right: Option<Thumbnail>,
    pub(super) depth_m: Thumbnail,
    pub(super) left_right_px: Option<Thumbnail>,
    pub(super) coc_px: Thumbnail,
    pub(super) occlusion: Thumbnail,
}

impl Panels {
    /// Of a sample of `size` pixels, columns and rows, of `colours` channels.
    pub fn new(subpixels: Subpixels, size: (usize, usize), colours: usize) -> Self {
        let tile = |channels| Thumbnail::new(size, channels, TILE);
        let side = TILE / subpixels.m().max(subpixels.n());
        let view = Thumbnail::new(size, colours, side - 1);
        let halves = !Side::Left.members(subpixels).is_empty();
        Self {
            sum: tile(colours),
            views: vec![view; subpixels.count()],
            target: tile(colours),
            left_and_right: halves.then(|| tile(3)),
            depth_m: tile(1),
            left_right_px: halves.then(|| tile(1)),
            coc_px: tile(1),
            occlusion: tile(1),
            subpixels,
        }
    }

    /// Goes on with some rows.
    pub fn add(&mut self, rows: Rows<'_>) {
        self.sum.add(rows.sum);
        (self.views.iter_mut().zip(rows.views)).for_each(|(own, view)| own.add(view));
        self.target.add(rows.target);
        if let Some(own) = &mut self.left_and_right {
            own.add(&left_and_right(rows.views, self.subpixels));
        }
        self.depth_m.add(rows.depth_m);
        if let (Some(own), Some(map)) = (&mut self.left_right_px, rows.left_right_px) {
            own.add(map);
        }
        self.coc_px.add(rows.coc_px);
        self.occlusion.add(rows.occlusion);
    }
}

/// Mean over the colours of the left half as red, of the right half as green and blue.
fn left_and_right(views: &[Image], subpixels: Subpixels) -> Image {
    let half = |side: Side| {
        let members = side.members(subpixels);
        sum_of(members.iter().filter_map(|&i| views.get(i)))
    };
    let (Some(left), Some(right)) = (half(Side::Left), half(Side::Right)) else {
        return Image::zeros(0, 0, 3);
    };
    let channels = left.channels();
    let luma = |pixel: &[f32]| pixel.iter().sum::<f32>() / channels as f32;
    let mut both = Image::zeros(left.width(), left.height(), 3);
    let [left, right] = [&left, &right].map(|half| half.data().chunks_exact(channels));
    let (pixels, _) = both.data_mut().as_chunks_mut::<3>();
    for (both, (left, right)) in pixels.iter_mut().zip(left.zip(right)) {
        let (l, r) = (luma(left), luma(right));
        *both = [l, r, r];
    }
    both
}
