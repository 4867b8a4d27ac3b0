//! RMS errors of matchers on the same pairs, whose sub-pixel shifts are known exactly.
//!
//! All errors are taken at the nodes that our matching calls valid and, for the stereo matchers, that they do too.
//! OpenCV's dense flow and phase correlation get f32 on 0..255; its sparse flow and its stereo matchers take 8 bits
//! only, and get the whole range.

use opencv::Result;
use opencv::calib3d::{StereoBM, StereoSGBM, StereoSGBM_MODE_SGBM};
use opencv::core::{
    CV_32F, Mat, Point2f, Rect, TermCriteria, TermCriteria_COUNT, TermCriteria_EPS, Vector,
    no_array,
};
use opencv::prelude::*;
use opencv::{imgproc, video};

use quadpixel::image::Image;
use quadpixel_algorithms::disparity::{Axes, MatchSettings, Verdict, match_images};

use crate::convert::{to_mat, to_mat_u8};
use crate::{Change, pair};

/// Side of the window of our matching, Farneback and `StereoBM`, px.
pub const WINDOW_PX: usize = 21;
/// Block of `StereoSGBM`, px: with its smallest penalties (2 and 5) the best of 3, 5, 11 and 21 on these pairs; larger
/// penalties erred more at 5 and 21.
const SGBM_BLOCK_PX: i32 = 11;
/// Iterations a level of Farneback: the usual few, and many.
pub const FARNEBACK_ITERATIONS: [i32; 2] = [3, 10];
/// Side of the patches of phase correlation, px.
const PATCH_PX: i32 = 32;
/// Side of the pictures, px.
const SIDE: usize = 301;
/// Shifts along both axes, px.
const SHIFTS: [[f64; 2]; 4] = [[0.25, -0.4], [1.37, 0.61], [-2.4, 2.4], [-0.83, -1.91]];
/// Shifts along the rows, px.
const STEREO_SHIFTS: [f64; 4] = [0.3, -1.45, 2.4, -0.83];

/// RMS errors along both axes, px per axis.
#[derive(Clone, Copy, Debug)]
pub struct Planar {
    /// Our matching.
    pub ours: f64,
    /// `calcOpticalFlowFarneback` after each of [`FARNEBACK_ITERATIONS`].
    pub farneback: [f64; 2],
    /// `calcOpticalFlowPyrLK`, window 21, from zero shift.
    pub pyr_lk: f64,
    /// `phaseCorrelate` of 32 × 32 patches under a Hann window.
    pub phase_correlate: f64,
    /// Share of the nodes that our matching calls valid.
    pub valid: f64,
}

/// RMS errors along the rows, px.
#[derive(Clone, Copy, Debug)]
pub struct Stereo {
    /// Our matching, at the nodes valid for it and `StereoBM`.
    pub ours_at_bm: f64,
    /// `StereoBM`.
    pub bm: f64,
    /// Our matching, at the nodes valid for it and `StereoSGBM`.
    pub ours_at_sgbm: f64,
    /// `StereoSGBM`.
    pub sgbm: f64,
    /// Share of the nodes that our matching calls valid.
    pub valid: f64,
    /// Share of those that `StereoBM` calls valid.
    pub bm_valid: f64,
    /// Share of those that `StereoSGBM` calls valid.
    pub sgbm_valid: f64,
}

/// Pixel (x, y) and shift in px.
type Found = ([f64; 2], [f64; 2]);

/// Sum of squares and their number.
#[derive(Default)]
struct Errors(f64, usize);

impl Errors {
    fn add(&mut self, error_px: f64) {
        self.0 += error_px * error_px;
        self.1 += 1;
    }
    fn rms(&self) -> f64 {
        (self.0 / self.1 as f64).sqrt()
    }
}

/// Our valid matches, each with its pixel (x, y) and shift, and the number of all nodes.
fn matched(a: &Image, b: &Image, axes: Axes) -> (Vec<Found>, usize) {
    let settings = MatchSettings {
        window_px: WINDOW_PX,
        axes,
        ..MatchSettings::default()
    };
    let map = match_images(a, b, &settings).expect("a proper pair");
    let valid = map
        .nodes()
        .filter(|(_, found)| found.verdict == Verdict::Valid)
        .map(|(at, found)| (at, [found.dx_px, found.dy_px]))
        .collect();
    (valid, map.grid.len())
}

/// The image times 255.
pub fn scaled(image: &Image) -> Result<Mat> {
    let mut to = Mat::default();
    to_mat(image)?.convert_to(&mut to, CV_32F, 255.0, 0.0)?;
    Ok(to)
}

/// Both pictures as 8 bits, over the range of their values.
fn eight_bits(a: &Image, b: &Image) -> Result<[Mat; 2]> {
    let range = (a.data().iter().chain(b.data()))
        .fold([f32::MAX, f32::MIN], |[l, h], v| [l.min(*v), h.max(*v)]);
    Ok([to_mat_u8(a, range)?, to_mat_u8(b, range)?])
}

/// OpenCV's sparse flow from 8-bit `a` to `b` at `nodes`: until steps of 0.001 px, 3 levels.
fn pyr_lk(a: &Mat, b: &Mat, nodes: &[Found]) -> Result<Vec<Option<[f64; 2]>>> {
    let at: Vector<Point2f> = (nodes.iter())
        .map(|([x, y], _)| Point2f::new(*x as f32, *y as f32))
        .collect();
    let (mut to, mut status) = (Vector::<Point2f>::new(), Vector::<u8>::new());
    let window = (WINDOW_PX as i32, WINDOW_PX as i32).into();
    let until = TermCriteria::new(TermCriteria_COUNT + TermCriteria_EPS, 100, 1e-3)?;
    video::calc_optical_flow_pyr_lk(
        a,
        b,
        &at,
        &mut to,
        &mut status,
        &mut no_array(),
        window,
        2,
        until,
        0,
        1e-4,
    )?;
    let moved = |p: Point2f, q: Point2f| [f64::from(q.x - p.x), f64::from(q.y - p.y)];
    Ok((at.iter().zip(&to).zip(&status))
        .map(|((p, q), found)| (found != 0).then(|| moved(p, q)))
        .collect())
}

/// OpenCV's dense flow from `a` to `b`, window [`WINDOW_PX`].
pub fn farneback(a: &Mat, b: &Mat, iterations: i32) -> Result<Mat> {
    let mut flow = Mat::default();
    let window = WINDOW_PX as i32;
    video::calc_optical_flow_farneback(a, b, &mut flow, 0.5, 3, window, iterations, 5, 1.1, 0)?;
    Ok(flow)
}

/// Errors of the matchers that know both axes.
pub fn planar(change: Change) -> Result<Planar> {
    let [mut ours, mut phase, mut sparse] = [const { Errors(0.0, 0) }; 3];
    let mut flows = [const { Errors(0.0, 0) }; 2];
    let (mut valid, mut nodes) = (0, 0);
    for (seed, shift) in (100..).zip(SHIFTS) {
        let [a, b] = pair(SIDE, seed, shift, change);
        let (matches, all) = matched(&a, &b, Axes::Both);
        valid += matches.len();
        nodes += all;
        let [narrow_a, narrow_b] = eight_bits(&a, &b)?;
        for theirs in pyr_lk(&narrow_a, &narrow_b, &matches)?
            .into_iter()
            .flatten()
        {
            sparse.add(theirs[0] - shift[0]);
            sparse.add(theirs[1] - shift[1]);
        }
        let [a, b] = [scaled(&a)?, scaled(&b)?];
        let fields = [
            farneback(&a, &b, FARNEBACK_ITERATIONS[0])?,
            farneback(&a, &b, FARNEBACK_ITERATIONS[1])?,
        ];
        let mut window = Mat::default();
        imgproc::create_hanning_window(&mut window, (PATCH_PX, PATCH_PX).into(), CV_32F)?;
        for ([x, y], found) in matches {
            for (flow, field) in flows.iter_mut().zip(&fields) {
                let theirs = field.at_2d::<Point2f>(y as i32, x as i32)?;
                flow.add(f64::from(theirs.x) - shift[0]);
                flow.add(f64::from(theirs.y) - shift[1]);
            }
            let patch = Rect::new(
                (x as i32 - PATCH_PX / 2).clamp(0, SIDE as i32 - PATCH_PX),
                (y as i32 - PATCH_PX / 2).clamp(0, SIDE as i32 - PATCH_PX),
                PATCH_PX,
                PATCH_PX,
            );
            let [patch_a, patch_b] = [a.roi(patch)?.try_clone()?, b.roi(patch)?.try_clone()?];
            let moved = imgproc::phase_correlate(&patch_a, &patch_b, &window, &mut 0.0)?;
            ours.add(found[0] - shift[0]);
            ours.add(found[1] - shift[1]);
            phase.add(moved.x - shift[0]);
            phase.add(moved.y - shift[1]);
        }
    }
    Ok(Planar {
        ours: ours.rms(),
        farneback: flows.map(|flow| flow.rms()),
        pyr_lk: sparse.rms(),
        phase_correlate: phase.rms(),
        valid: valid as f64 / nodes as f64,
    })
}

/// Errors of the matchers along the rows.
pub fn stereo(change: Change) -> Result<Stereo> {
    let [mut ours_at_bm, mut bm, mut ours_at_sgbm, mut sgbm] = [const { Errors(0.0, 0) }; 4];
    let (mut valid, mut nodes) = (0, 0);
    for (seed, shift) in (200..).zip(STEREO_SHIFTS) {
        let [a, b] = pair(SIDE, seed, [shift, 0.0], change);
        let (matches, all) = matched(&a, &b, Axes::Horizontal);
        valid += matches.len();
        nodes += all;
        let [a, b] = eight_bits(&a, &b)?;
        let mut matcher = StereoBM::create(16, WINDOW_PX as i32)?;
        matcher.set_min_disparity(-8)?;
        let bm_found = sixteenths(&a, &b, |a, b, to| matcher.compute(a, b, to))?;
        let mut matcher = StereoSGBM::create(
            -8,
            16,
            SGBM_BLOCK_PX,
            2,
            5,
            1,
            63,
            10,
            0,
            0,
            StereoSGBM_MODE_SGBM,
        )?;
        let sgbm_found = sixteenths(&a, &b, |a, b, to| matcher.compute(a, b, to))?;
        for ([x, y], found) in matches {
            let i = y as usize * SIDE + x as usize;
            for (theirs, ours, errors) in [
                (bm_found[i], &mut ours_at_bm, &mut bm),
                (sgbm_found[i], &mut ours_at_sgbm, &mut sgbm),
            ] {
                if let Some(theirs) = theirs {
                    ours.add(found[0] - shift);
                    errors.add(theirs - shift);
                }
            }
        }
    }
    Ok(Stereo {
        bm_valid: bm.1 as f64 / valid as f64,
        sgbm_valid: sgbm.1 as f64 / valid as f64,
        ours_at_bm: ours_at_bm.rms(),
        bm: bm.rms(),
        ours_at_sgbm: ours_at_sgbm.rms(),
        sgbm: sgbm.rms(),
        valid: valid as f64 / nodes as f64,
    })
}

/// Shifts from OpenCV's 16-bit disparities, 1/16 px, which count to the left; `None` below the smallest, which means
/// none.
fn sixteenths(
    a: &Mat,
    b: &Mat,
    compute: impl FnOnce(&Mat, &Mat, &mut Mat) -> Result<()>,
) -> Result<Vec<Option<f64>>> {
    let mut found = Mat::default();
    compute(a, b, &mut found)?;
    let shifts = found
        .data_typed::<i16>()?
        .iter()
        .map(|d| (*d >= -8 * 16).then(|| -f64::from(*d) / 16.0))
        .collect();
    Ok(shifts)
}
