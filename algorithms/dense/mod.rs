//! A complete disparity map of two views that see different halves of the pupil, with a standard deviation everywhere.
//!
//! Views of a pixel that sees the pupil in parts are not shifted copies of each other: a point out of focus is blurred
//! by two different kernels, mirror images. So each candidate disparity says both kernels, and the views are compared
//! after each is blurred by the kernel of the other:
//!
//! ```text
//! pair ─ evened, √ ─▶ pyramid ─ range: which disparities, at which resolution ─▶ cost: L ⊗ k_R against R ⊗ k_L
//!      ─ semi-global: eight paths ─▶ minima ─ smoother: bent at edges ─▶ surface, σ ─ joint bilateral ─▶ every pixel
//!      ─ smoother again, by σ ─▶ the map
//! ```
//!
//! Edges are those of the picture in any of its channels ([`OppositeViews::picture`]); costs are of one.
//!
//! The kernels are a family of one parameter, the ratio κ of disparity to blur ([`BlurRatio`]), which may change over
//! the picture. It does not scale the disparity: that is the distance of the kernels' centroids, in px. Without a
//! camera's description κ = ¼.
//! Where the pupil is parted in both directions, both pairs of views tell the same depth, and their costs add, once the
//! lens's astigmatism is out of the second ([`OppositeViews::astigmatism_px`]).
//!
//! The same bytes come out whatever the number of threads.

mod cost;
mod directions;
mod error;
mod filters;
mod guide;
mod kernels;
mod learned;
mod lines;
mod minimum;
mod network;
mod of_capture;
mod opposite;
mod prepare;
mod pupils;
mod range;
mod ratio;
mod ray_pupil;
mod refine;
mod semi_global;
mod sigma;
mod smoother;

use quadpixel::image::Image;

pub use error::DenseError;
pub use kernels::SHARP_RATIO;
pub use network::{Network, NetworkError};
pub use of_capture::Halves;
pub use opposite::{OppositePair, OppositeViews};
pub use ratio::BlurRatio;

use cost::Candidates;
use directions::{Direction, volume_of};
use filters::{enlarged_by_guide, transposed};
use minimum::{median, minima};
use refine::refined;
use sigma::{Evidence, Model, deviations};
use smoother::Stiffness;

/// Contrast across which a pixel takes little from a coarse one, parts of white.
const EDGE: f32 = 0.05;

/// Of the surface through the minima.
const STIFFNESS: Stiffness = Stiffness {
    weight: 100.0,
    contrast: 0.015,
};

/// What is known of the camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DenseSettings {
    /// As of [`OppositePair`].
    pub ratio: Option<BlurRatio>,
    /// As of [`OppositeViews`].
    pub matching_error_px: Option<f64>,
}

/// A number at every pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct DenseMap {
    /// x_L − x_R, px, at each pixel of the views' sum; y_T − y_B where there are neither left nor right.
    pub disparity_px: Image,
    /// Its standard deviation, px, as it was before the last smoothing, which it weighs.
    pub sigma_px: Image,
    /// Least and largest disparity that was looked for, px, where κ is the mean.
    pub range_px: [f64; 2],
    /// How often the resolution was halved for matching.
    pub halvings: usize,
}

/// The disparity of the left view against the right one (linear, black at 0, one channel each).
///
/// # Errors
/// As of [`dense_disparity_of`].
pub fn dense_disparity(
    left: &Image,
    right: &Image,
    settings: &DenseSettings,
) -> Result<DenseMap, DenseError> {
    let pair = OppositePair {
        views: [left, right],
        ratio: settings.ratio.as_ref(),
    };
    dense_disparity_of(OppositeViews {
        left_right: Some(pair),
        matching_error_px: settings.matching_error_px,
        ..OppositeViews::default()
    })
}

/// The disparity of opposite views, by one pair or by both.
///
/// # Errors
/// No pair; views of more than one channel, numbers that are not finite, unequal sizes, less than 16 pixels a side; a
/// ratio that no pupil has.
pub fn dense_disparity_of(views: OppositeViews<'_>) -> Result<DenseMap, DenseError> {
    estimated(views, |directions| {
        Ok(refined(matched(directions), &directions[0]))
    })
}

/// The disparity of opposite views as a network and matching by kernels ([`dense_disparity_of`]) tell it together, each
/// where it is surer. The network was trained on cameras of many ratios κ, and is told none.
///
/// # Errors
/// As of [`dense_disparity_of`]; a network that does not fit.
pub fn learned_disparity_of(
    views: OppositeViews<'_>,
    network: &Network,
) -> Result<DenseMap, DenseError> {
    estimated(views, |directions| learned::learned(directions, network))
}

fn estimated(
    views: OppositeViews<'_>,
    map_of: impl Fn(&[Direction]) -> Result<DenseMap, DenseError>,
) -> Result<DenseMap, DenseError> {
    let map_of = |directions: &[Direction]| match directions.iter().all(Direction::is_flat) {
        true => Ok(unknown(&directions[0])),
        false => map_of(directions),
    };
    views.check_picture()?;
    match (views.left_right, views.top_bottom) {
        (None, None) => Err(DenseError::NoPair),
        (Some(pair), None) => map_of(&[Direction::first(&pair, false, &views)?]),
        (Some(pair), Some(other)) => {
            let first = Direction::first(&pair, false, &views)?;
            let across = Direction::across(&other, &first, &views)?;
            map_of(&[first, across])
        }
        (None, Some(pair)) => {
            let map = map_of(&[Direction::first(&pair, true, &views)?])?;
            Ok(DenseMap {
                disparity_px: transposed(&map.disparity_px),
                sigma_px: transposed(&map.sigma_px),
                ..map
            })
        }
    }
}

/// What a picture without texture says: 0, and a σ as wide as all that is looked for.
fn unknown(direction: &Direction) -> DenseMap {
    let full = &direction.pyramid().guides[0];
    let range_px = range::widest(full);
    let mut sigma_px = Image::zeros(full.width(), full.height(), 1);
    (sigma_px.data_mut()).fill((range_px[1] - range_px[0]) as f32);
    DenseMap {
        disparity_px: Image::zeros(full.width(), full.height(), 1),
        sigma_px,
        range_px,
        halvings: 0,
    }
}

/// The map of one or two directions, as the first one sees it.
fn matched(directions: &[Direction]) -> DenseMap {
    let pyramid = directions[0].pyramid();
    let range_px = range::range(directions);
    let levels = range::levels(range_px, pyramid);
    let k = levels[0];
    let unit = f64::from(1u32 << k);
    let candidates = Candidates::new(range_px, unit / range::STEPS_PER_PX);
    let costs = volume_of(directions, &levels, candidates);
    let guide = &pyramid.guides[k];
    let found = minima(&semi_global::aggregated(&costs, guide, range::STEPS_PER_PX));
    let typical = median(&found.curvature);
    let weights: Vec<f64> = found.curvature.iter().map(|c| c / typical).collect();
    let numbers: Vec<f64> = found.disparity_px.iter().map(|d| d / unit).collect();
    let surface = smoother::surface(&numbers, &weights, &pyramid.edges(k, STIFFNESS));
    let sigma = deviations(&Evidence {
        size: [costs.width, costs.height],
        surface: &surface,
        numbers: &numbers,
        weights: &weights,
        // Eight paths meet at a pixel.
        curvature: typical / 8.0 * range::STEPS_PER_PX * range::STEPS_PER_PX,
        model: Model::of(&directions[0], unit),
        range: (range_px[1] - range_px[0]) / unit,
    });
    let mut disparity = Image::zeros(costs.width, costs.height, 1);
    (disparity.data_mut().iter_mut().zip(&surface)).for_each(|(to, v)| *to = (v * unit) as f32);
    let full = |coarse: &Image| enlarged_by_guide(coarse, guide, k, &pyramid.guides[0], EDGE);
    let mut sigma_px = full(&sigma);
    sigma_px
        .data_mut()
        .iter_mut()
        .for_each(|s| *s *= unit as f32);
    DenseMap {
        disparity_px: directions[0].scaled(full(&disparity)),
        sigma_px: directions[0].scaled(sigma_px),
        range_px,
        halvings: k,
    }
}
