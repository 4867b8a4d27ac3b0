//! Some rows of a sample, ready to be stored.

use quadpixel::image::Image;
use quadpixel::image::views::{split_views, sum_of};

use super::error::WriteError;
use super::files::SampleFiles;
use super::mosaic;
use super::sound::input;
use super::truth::{self, Truth};
use crate::preview;

/// The views of a mosaic, and their sum.
pub(super) struct Views {
    pub views: Vec<Image>,
    pub sum: Image,
}

/// Some rows of a sample.
pub(super) struct Rows<'a> {
    pub sample: &'a SampleFiles<'a>,
    pub truth: Truth,
    pub views: Vec<Image>,
    pub sum: Image,
    /// Of the noisy capture.
    pub noisy: Option<Views>,
    /// Row of the sample that they begin with.
    first: usize,
}

impl<'a> Rows<'a> {
    /// `name`: of the sample, for messages.
    pub fn new(sample: &'a SampleFiles<'a>, name: &str, first: usize) -> Result<Self, WriteError> {
        let subpixels = sample.description.sensor.subpixels;
        let views_of = |mosaic: &Image| {
            let views = split_views(mosaic, subpixels);
            let sum = sum_of(&views).ok_or_else(|| input(name, "the pixel has no sub-pixel"))?;
            Ok::<_, WriteError>(Views { views, sum })
        };
        let Views { views, sum } = views_of(sample.raw)?;
        Ok(Self {
            truth: truth::masked(sample),
            noisy: (sample.noisy.map(|noisy| views_of(noisy.linear))).transpose()?,
            sample,
            views,
            sum,
            first,
        })
    }

    /// The values that a sensor of one colour per microlens reads of a mosaic.
    pub fn picked(&self, all: &Image) -> Option<Image> {
        mosaic::picked(self.sample.description, all, self.first)
    }

    /// What a contact sheet shows of them.
    pub fn shown_by(&self, panels: &mut preview::Panels) {
        let left_right_px = self.truth.left_right_px.as_ref();
        panels.add(preview::Rows {
            views: &self.views,
            sum: &self.sum,
            target: self.sample.target,
            depth_m: &self.truth.depth_m,
            left_right_px: left_right_px.map(|[traced, _]| traced),
            coc_px: &self.truth.coc_px,
            occlusion: self.sample.occlusion,
        });
    }
}
