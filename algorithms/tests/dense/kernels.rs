//! Matching by a family of kernels.

use quadpixel::image::Image;
use quadpixel::sampling::uniform;
use quadpixel_algorithms::dense::{
    BlurRatio, DenseError, DenseMap, DenseSettings, OppositePair, OppositeViews, dense_disparity,
    dense_disparity_of,
};
use quadpixel_algorithms::plane_error::PlaneError;

use crate::blurred::{
    SIDE, errors, knows_nothing, of_ratio, opposite, pair, parted, without_texture,
};

fn matched([left, right]: &[Image; 2]) -> DenseMap {
    dense_disparity(left, right, &DenseSettings::default()).unwrap()
}

#[test]
fn a_blurred_plane_has_its_centroids_disparity_and_no_more() {
    for truth in [-3.0, -1.5, -0.5, 0.0, 0.8, 2.0] {
        let map = matched(&pair(|_| truth));
        let found = errors(&map, |_| truth);
        // A matcher of shifted copies errs by 13 to 20 % of 1.6 to 3 px.
        let allowed = 0.02 + 0.05 * f64::abs(truth);
        assert!(
            found[found.len() / 2] < allowed,
            "{truth}: {}",
            found[found.len() / 2]
        );
        let sigma = map.sigma_px.data();
        assert!(sigma.iter().all(|s| s.is_finite() && *s > 0.0));
        let inside = (map.disparity_px.data().iter().zip(sigma))
            .filter(|(d, s)| (f64::from(**d) - truth).abs() < 2.0 * f64::from(**s));
        assert!(inside.count() * 10 > 9 * SIDE * SIDE, "{truth}");
    }
}

fn middle_error(views: OppositeViews<'_>, truth: f64) -> f64 {
    let found = errors(&dense_disparity_of(views).unwrap(), |_| truth);
    found[found.len() / 2]
}

#[test]
fn top_and_bottom_tell_what_left_and_right_do() {
    for truth in [-1.5, 0.8] {
        let bottom_top = parted(|_| truth, true, 0.0);
        let views = OppositeViews {
            top_bottom: opposite(&bottom_top),
            ..OppositeViews::default()
        };
        let error = middle_error(views, truth);
        assert!(error < 0.02 + 0.05 * f64::abs(truth), "{truth}: {error}");
    }
}

#[test]
fn both_pairs_agree_once_the_astigmatism_is_out_of_the_second() {
    let truth = 1.2;
    let (across, down) = (pair(|_| truth), parted(|_| truth, true, 0.5));
    let astigmatism = Image::from_vec(SIDE, SIDE, 1, vec![0.5; SIDE * SIDE]).unwrap();
    let error = |astigmatism_px| {
        let views = OppositeViews {
            left_right: opposite(&across),
            top_bottom: opposite(&down),
            astigmatism_px,
            ..OppositeViews::default()
        };
        middle_error(views, truth)
    };
    let (with, without) = (error(Some(&astigmatism)), error(None));
    assert!(with < 0.08, "{with}");
    assert!(without > 2.0 * with && without > 0.1, "{without}, {with}");
    let small = Image::zeros(SIDE, SIDE - 1, 1);
    let views = OppositeViews {
        left_right: opposite(&across),
        top_bottom: opposite(&down),
        astigmatism_px: Some(&small),
        ..OppositeViews::default()
    };
    assert!(matches!(
        dense_disparity_of(views),
        Err(DenseError::Size { .. })
    ));
    let mut holed = Image::zeros(SIDE, SIDE, 3);
    holed.data_mut()[5] = f32::NAN;
    for picture in [&small, &holed] {
        let views = OppositeViews {
            left_right: opposite(&across),
            picture: Some(picture),
            ..OppositeViews::default()
        };
        let refused = dense_disparity_of(views).unwrap_err();
        assert!(
            matches!(
                refused,
                DenseError::PictureSize { .. } | DenseError::Plane(_)
            ),
            "{refused}"
        );
    }
    let none = dense_disparity_of(OppositeViews::default());
    assert_eq!(none.unwrap_err(), DenseError::NoPair);
}

#[test]
fn a_ratio_that_changes_over_the_picture_is_matched_with_its_own_kernels() {
    const BLUR_PX: f64 = 8.0;
    let ratio = |x: f64| 0.22 - 0.15 * x / SIDE as f64;
    let views = of_ratio(BLUR_PX, ratio);
    let field = BlurRatio::of_field([SIDE, SIDE], ratio(0.5 * SIDE as f64), |x, _| {
        ratio(x as f64)
    });
    let mean = BlurRatio::Whole(field.mean());
    let error_of = |ratios: BlurRatio| {
        let settings = DenseSettings {
            ratio: Some(ratios),
            ..DenseSettings::default()
        };
        let map = dense_disparity(&views[0], &views[1], &settings).unwrap();
        let found = errors(&map, |x| BLUR_PX * ratio(x));
        found.iter().sum::<f64>() / found.len() as f64
    };
    let (own, one) = (error_of(field), error_of(mean));
    // Of 0.56 to 1.76 px.
    assert!(own < 0.04 && one > 2.0 * own, "{own}, {one}");
}

#[test]
fn top_and_bottom_have_their_ratio_at_each_pixel_too() {
    let turned = |image: &Image| {
        let at = |i: usize| image.pixel(i / SIDE, i % SIDE)[0];
        Image::from_vec(SIDE, SIDE, 1, (0..SIDE * SIDE).map(at).collect()).unwrap()
    };
    let ratio = |along: usize| 0.22 - 0.15 * along as f64 / SIDE as f64;
    let views = of_ratio(8.0, |x| ratio(x as usize));
    let across = BlurRatio::of_field([SIDE; 2], 0.15, |x, _| ratio(x));
    let down = BlurRatio::of_field([SIDE; 2], 0.15, |_, y| ratio(y));
    let left_right = OppositePair {
        views: views.each_ref(),
        ratio: Some(&across),
    };
    let upright = views.each_ref().map(turned);
    let top_bottom = OppositePair {
        views: upright.each_ref(),
        ratio: Some(&down),
    };
    let of = |left_right, top_bottom| {
        let views = OppositeViews {
            left_right,
            top_bottom,
            ..OppositeViews::default()
        };
        dense_disparity_of(views).unwrap().disparity_px
    };
    let (lying, standing) = (of(Some(left_right), None), of(None, Some(top_bottom)));
    assert_eq!(turned(&lying).data(), standing.data());
}

#[test]
fn a_depth_step_is_matched_at_every_pixel() {
    let truth = |x: f64| if x < 64.0 { -1.0 } else { 1.0 };
    let found = errors(&matched(&pair(truth)), truth);
    let mean = found.iter().sum::<f64>() / found.len() as f64;
    assert!(mean < 0.2, "{mean}");
    assert!(
        found[found.len() * 8 / 10] < 0.1,
        "{}",
        found[found.len() * 8 / 10]
    );
}

#[test]
fn no_texture_is_no_knowledge() {
    for views in without_texture() {
        assert!(knows_nothing(&matched(&views)));
    }
}

#[test]
fn a_texture_as_fine_as_noise_is_texture() {
    let view = |shift: u64| {
        let dot = |i: usize| uniform(1, &[(i % SIDE) as u64 + shift, (i / SIDE) as u64]) as f32;
        Image::from_vec(SIDE, SIDE, 1, (0..SIDE * SIDE).map(dot).collect()).unwrap()
    };
    let map = matched(&[view(0), view(2)]);
    assert!(!knows_nothing(&map));
    // Sharp copies are not what the kernels expect.
    let found = errors(&map, |_| 2.0);
    assert!(found[found.len() / 2] < 1.0, "{}", found[found.len() / 2]);
}

#[test]
fn the_bytes_are_the_same_whatever_the_threads() {
    let views = pair(|x| 0.02 * (x - 64.0));
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| matched(&views))
    };
    let bits = |image: &Image| {
        image
            .data()
            .iter()
            .map(|v| v.to_bits())
            .collect::<Vec<u32>>()
    };
    let (one, three) = (with(1), with(3));
    assert_eq!(bits(&one.disparity_px), bits(&three.disparity_px));
    assert_eq!(bits(&one.sigma_px), bits(&three.sigma_px));
}

/// σ of a flat, textured picture is that of planes of the camera where it is told, else that of any camera.
#[test]
fn what_planes_told_of_matching_is_the_least_sigma() {
    const RATIO: f64 = 0.2;
    let views = of_ratio(4.0, |_| RATIO);
    let sigma_of = |matching_error_px| {
        let settings = DenseSettings {
            ratio: Some(BlurRatio::Whole(RATIO)),
            matching_error_px,
        };
        let map = dense_disparity(&views[0], &views[1], &settings).unwrap();
        let mut sigma = map.sigma_px.data().to_vec();
        sigma.sort_by(f32::total_cmp);
        [sigma[0], sigma[sigma.len() / 2]]
    };
    let (assumed, told, none) = (
        sigma_of(None),
        sigma_of(Some(0.02)),
        sigma_of(Some(f64::NAN)),
    );
    println!("{assumed:?} {told:?} {none:?}");
    assert!(told[0] >= 0.0199 && told[1] < 0.8 * assumed[1]);
    assert!(none[0] > 0.0 && none[1] < told[1]);
}

#[test]
fn bad_pairs_are_named() {
    let image = Image::zeros(32, 32, 1);
    let refused = |left: &Image, right: &Image, ratio| {
        let settings = DenseSettings {
            ratio,
            ..DenseSettings::default()
        };
        dense_disparity(left, right, &settings).unwrap_err()
    };
    assert_eq!(
        refused(&image, &Image::zeros(32, 32, 3), None),
        DenseError::Plane(PlaneError::Channels(3))
    );
    let size = refused(&image, &Image::zeros(31, 32, 1), None).to_string();
    assert!(size.contains("one size"), "{size}");
    let small = Image::zeros(15, 40, 1);
    assert!(matches!(
        refused(&small, &small, None),
        DenseError::TooSmall { least: 16, .. }
    ));
    let whole = |ratio| Some(BlurRatio::Whole(ratio));
    assert_eq!(refused(&image, &image, whole(0.5)), DenseError::Ratio(0.5));
    assert!(matches!(
        refused(&image, &image, whole(f64::NAN)),
        DenseError::Ratio(_)
    ));
    let small = Some(BlurRatio::of_field([32, 31], 0.2, |_, _| 0.2));
    let error = refused(&image, &image, small).to_string();
    assert!(
        error.contains("ratio of disparity to blur has 32 × 31"),
        "{error}"
    );
    let mut bad = image.clone();
    bad.pixel_mut(3, 7)[0] = f32::NAN;
    assert!(matches!(
        refused(&bad, &image, None),
        DenseError::Plane(PlaneError::NotFinite { x: 3, y: 7, .. })
    ));
}
