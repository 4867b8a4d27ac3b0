//! The opposite views of a capture, matched at every pixel.

use quadpixel::image::{Image, channel};
use quadpixel_datasets::{
    BlurRays, CameraDescription, DisparityCurve, DisparityCurves, RatioField,
};

use super::filters::by_rows;
use super::{
    BlurRatio, DenseError, DenseMap, Network, OppositePair, OppositeViews, dense_disparity_of,
    learned_disparity_of,
};
use crate::capture::Capture;
use crate::sai::Side;

/// A capture's halves in its reference channel, and what its description says of them.
#[derive(Clone, Debug)]
pub struct Halves {
    left_right: Option<Pair>,
    top_bottom: Option<Pair>,
    astigmatism_px: Option<Image>,
    blur: Option<BlurRays>,
    matching_error_px: Option<f64>,
    picture: Option<Image>,
}

#[derive(Clone, Debug)]
struct Pair {
    views: [Image; 2],
    ratio: Option<BlurRatio>,
}

impl Halves {
    /// Of a capture.
    pub fn new(capture: &Capture) -> Self {
        let c = capture.reference_channel();
        let half = |side| capture.views.sum(side).map(|sum| channel(&sum, c));
        let camera = capture.camera.as_ref();
        let pair = |sides: [Side; 2], field: fn(&CameraDescription) -> &Option<RatioField>| {
            let views = [half(sides[0])?, half(sides[1])?];
            let size_px = [views[0].width(), views[0].height()];
            let ratio = camera.and_then(|c| Some(over_picture(field(c).as_ref()?, size_px)));
            Some(Pair { views, ratio })
        };
        let left_right = pair([Side::Left, Side::Right], |c| &c.disparity_ratio.left_right);
        let top_bottom = pair([Side::Top, Side::Bottom], |c| &c.disparity_ratio.top_bottom);
        let name = &capture.channels[c];
        Self {
            astigmatism_px: (left_right.as_ref())
                .zip(camera)
                .and_then(|(pair, camera)| astigmatism_px(camera, name, &pair.views[0])),
            left_right,
            top_bottom,
            blur: camera.and_then(|c| c.blur.clone()),
            matching_error_px: None,
            picture: (capture.channels.len() > 1)
                .then(|| capture.views.sum(Side::All))
                .flatten(),
        }
    }

    /// With a ratio of disparity to blur that is known otherwise; blurs are then those of the family.
    pub fn with_ratio(mut self, ratio: &BlurRatio) -> Self {
        let pairs = [&mut self.left_right, &mut self.top_bottom];
        (pairs.into_iter().flatten()).for_each(|pair| pair.ratio = Some(ratio.clone()));
        self.blur = None;
        self
    }

    /// With an error of matching that is known, as of [`OppositeViews`].
    pub fn with_matching_error(mut self, error_px: f64) -> Self {
        self.matching_error_px = Some(error_px);
        self
    }

    /// Whether the description has the rays of the camera's own pixel.
    pub fn has_rays(&self) -> bool {
        self.blur.is_some()
    }

    /// Whether there are neither left nor right: the disparity is that of top and bottom.
    pub fn is_vertical(&self) -> bool {
        self.left_right.is_none()
    }

    /// Ratio of disparity to blur by the camera's description.
    pub fn ratio(&self) -> Option<&BlurRatio> {
        let first = self.left_right.as_ref().or(self.top_bottom.as_ref());
        first.and_then(|pair| pair.ratio.as_ref())
    }

    /// Their disparity, by one pair or both.
    ///
    /// # Errors
    /// As of [`dense_disparity_of`].
    pub fn disparity(&self) -> Result<DenseMap, DenseError> {
        dense_disparity_of(self.views())
    }

    /// Their disparity as a network tells it.
    ///
    /// # Errors
    /// As of [`learned_disparity_of`].
    pub fn learned_disparity(&self, network: &Network) -> Result<DenseMap, DenseError> {
        learned_disparity_of(self.views(), network)
    }

    fn views(&self) -> OppositeViews<'_> {
        OppositeViews {
            left_right: self.left_right.as_ref().map(Pair::opposite),
            top_bottom: self.top_bottom.as_ref().map(Pair::opposite),
            astigmatism_px: self.astigmatism_px.as_ref(),
            blur: self.blur.as_ref(),
            matching_error_px: self.matching_error_px,
            picture: self.picture.as_ref(),
        }
    }
}

impl Pair {
    fn opposite(&self) -> OppositePair<'_> {
        OppositePair {
            views: self.views.each_ref(),
            ratio: self.ratio.as_ref(),
        }
    }
}

/// κ at each pixel of views of this size.
fn over_picture(field: &RatioField, size_px: [usize; 2]) -> BlurRatio {
    let size = size_px.map(|n| n as u32);
    BlurRatio::of_field(size_px, field.mean, |x, y| {
        field.at([x as f64, y as f64], size)
    })
}

/// y_T − y_B at the depth at which x_L − x_R is 0, to first order in 1/(Z + p) about the focus; 0 where no light
/// passes. `None` without sound curves.
fn astigmatism_px(camera: &CameraDescription, channel: &str, view: &Image) -> Option<Image> {
    let p = camera.intrinsics.pinhole_behind_vertex_m;
    let per_m = camera.focus.distance_m.map_or(0.0, |z| 1.0 / (z + p));
    let size_px = [camera.width_px, camera.height_px];
    let curves = [&camera.disparity.left_right, &camera.disparity.top_bottom];
    let [across, down] = curves.map(|c| DisparityCurves::of_channel(c, channel));
    let (across, down) = (across?, down?);
    let fits = size_px.map(|n| n as usize) == [view.width(), view.height()];
    let sound = across.is_sound() && down.is_sound() && per_m.is_finite();
    let in_focus = |curve: &DisparityCurve, at: [f64; 2]| {
        let [c0, c1, c2] = curve.at(at, size_px)?;
        let slope = c1 + 2.0 * per_m * c2;
        (slope != 0.0).then_some((c0 + per_m * (c1 + per_m * c2), slope))
    };
    (fits && sound).then(|| {
        by_rows(view.width(), view.height(), |y, to| {
            for (x, to) in to.iter_mut().enumerate() {
                let at = [x as f64, y as f64];
                let both = in_focus(across, at).zip(in_focus(down, at));
                *to = both.map_or(0.0, |((h, h_slope), (v, v_slope))| {
                    (v - v_slope / h_slope * h) as f32
                });
            }
        })
    })
}
