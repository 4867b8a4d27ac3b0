//! Sub-pixel matching against exact truth, the Cramér-Rao bound and the pictures that go wrong.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

mod score;
mod texture;

use quadpixel::image::Image;
use quadpixel_algorithms::disparity::{
    Axes, DisparityMap, MatchError, MatchSettings, Verdict, match_images,
};
use quadpixel_algorithms::field::{Loss, SmoothField};
use quadpixel_algorithms::plane_error::PlaneError;
use score::{Case, score};
use texture::{Texture, picture};

const BLUR_PX: f64 = 0.85;

fn case(shift: [f64; 2]) -> Case {
    Case {
        size: 151,
        seed: 11,
        shift,
        noise: 0.0,
        gain: 1.0,
        offset: 0.0,
        settings: MatchSettings {
            stride_px: 8,
            ..MatchSettings::default()
        },
    }
}

/// A pair with `shift`, B changed by `change`.
fn pair(width: usize, height: usize, shift: [f64; 2], change: impl Fn(f64) -> f64) -> [Image; 2] {
    let texture = Texture::white(width, height, 3);
    let a = texture.render(BLUR_PX, [0.0, 0.0], None);
    let b: Vec<f64> = (texture.render(BLUR_PX, shift, None).into_iter())
        .map(change)
        .collect();
    [a, b].map(|values| picture(width, &values, 1.0, 0.0, 0.0, 0))
}

/// Largest error of the valid matches, px.
fn worst(map: &DisparityMap, shift: [f64; 2]) -> f64 {
    map.observations()
        .iter()
        .map(|o| (o.shift_px[0] - shift[0]).hypot(o.shift_px[1] - shift[1]))
        .fold(0.0, f64::max)
}

/// Where `map` is not as the picture's rim says it must be: a node is valid if the window at its true shift lies in B
/// with the taps of its interpolation (3 pixels before, 4 after), and outside otherwise.
fn strange_nodes(
    map: &DisparityMap,
    size: [usize; 2],
    window_px: usize,
    shift: [f64; 2],
) -> Vec<String> {
    let half = (window_px / 2) as f64;
    map.nodes()
        .filter_map(|(at, found)| {
            let inside = (0..2).all(|i| {
                let centre = at[i] + shift[i].floor();
                centre - half - 3.0 >= 0.0 && centre + half + 4.0 <= size[i] as f64 - 1.0
            });
            let due = if inside {
                Verdict::Valid
            } else {
                Verdict::Outside
            };
            (found.verdict != due).then(|| format!("{at:?}: {:?}, not {due:?}", found.verdict))
        })
        .collect()
}

fn share_valid(map: &DisparityMap) -> f64 {
    map.count(Verdict::Valid) as f64 / map.grid.len() as f64
}

#[test]
fn errors_stay_near_the_cramer_rao_bound_at_all_noises_windows_and_gains() {
    let shifts = [
        [0.25, -0.4],
        [1.37, 0.61],
        [-2.4, 2.4],
        [0.5, 0.5],
        [-0.83, -1.91],
    ];
    for window_px in [15, 21, 31] {
        for (noise, gain, offset) in [
            (0.0, 0.8, 0.05),
            (0.005, 1.0, 0.0),
            (0.01, 0.8, 0.05),
            (0.02, 1.0, 0.0),
            (0.02, 0.8, 0.05),
        ] {
            let [mut error, mut bound, mut claimed] = [0.0; 3];
            for (i, shift) in shifts.into_iter().enumerate() {
                let mut case = Case {
                    size: 201,
                    seed: 20 + i as u64,
                    noise,
                    gain,
                    offset,
                    ..case(shift)
                };
                case.settings.window_px = window_px;
                let [a, b] = score::pair(&case);
                let map = match_images(&a, &b, &case.settings).unwrap();
                let strange = strange_nodes(&map, [case.size; 2], window_px, shift);
                assert_eq!(strange, [""; 0], "window {window_px} noise {noise}");
                let result = score::judge(&case, &map);
                error += result.rms_px * result.rms_px / 5.0;
                bound += result.bound_px * result.bound_px / 5.0;
                claimed += result.claimed_px * result.claimed_px / 5.0;
            }
            let [error, bound, claimed] = [error, bound, claimed].map(f64::sqrt);
            assert!(
                error <= 1.1 * bound + 0.002,
                "window {window_px}, noise {noise}, gain {gain}: {error} px, bound {bound} px"
            );
            // The claim holds the kernel's misfit beside the noise, so it may only be too cautious.
            assert!(
                claimed > 0.95 * error && claimed < 1.35 * bound + 0.004,
                "window {window_px}, noise {noise}: claims {claimed} px, makes {error} px"
            );
        }
    }
}

#[test]
fn a_large_shift_is_found_from_coarse_to_fine() {
    for shift in [[-21.3, 14.6], [6.4, -5.2], [30.2, 0.3]] {
        let mut case = Case {
            size: 301,
            noise: 0.01,
            ..case(shift)
        };
        case.settings.search_px = 32;
        let result = score(&case);
        assert!(
            result.rms_px < 1.1 * result.bound_px + 0.002,
            "{shift:?}: {} px",
            result.rms_px
        );
        // Windows whose match lies outside of B cannot be valid.
        let inside = (1.0 - shift[0].abs() / 301.0) * (1.0 - shift[1].abs() / 301.0);
        assert!(result.valid > 0.8 * inside, "{shift:?}: {}", result.valid);
    }
}

#[test]
fn one_dimensional_search_moves_along_its_axis_only() {
    for (axes, shift) in [
        (Axes::Horizontal, [1.37, 0.0]),
        (Axes::Vertical, [0.0, -2.2]),
    ] {
        let [a, b] = pair(101, 101, shift, |v| v);
        let settings = MatchSettings {
            axes,
            ..MatchSettings::default()
        };
        let map = match_images(&a, &b, &settings).unwrap();
        assert_eq!(strange_nodes(&map, [101, 101], 21, shift), [""; 0]);
        assert!(worst(&map, shift) < 0.01, "{}", worst(&map, shift));
        let fixed = usize::from(axes == Axes::Horizontal);
        assert!(map.observations().iter().all(|o| o.shift_px[fixed] == 0.0));
    }
}

#[test]
fn constant_pictures_are_textureless_everywhere() {
    let flat = |v: f32| Image::from_vec(60, 50, 1, vec![v; 3000]).unwrap();
    let [textured, _] = pair(61, 51, [0.0, 0.0], |v| v);
    let flat_61 = Image::from_vec(61, 51, 1, vec![0.1; 61 * 51]).unwrap();
    for (a, b) in [
        (flat(0.3), flat(0.3)),
        (flat(0.0), flat(1.0)),
        (flat(1e30), flat(1e-30)),
    ] {
        let map = match_images(&a, &b, &MatchSettings::default()).unwrap();
        assert_eq!(map.count(Verdict::Textureless), map.grid.len());
        assert!(map.observations().is_empty());
    }
    let map = match_images(&textured, &flat_61, &MatchSettings::default()).unwrap();
    assert_eq!(map.count(Verdict::Valid), 0);
}

#[test]
fn a_straight_edge_says_that_it_cannot_measure_along_itself() {
    let edge: Vec<f32> = (0..61 * 61)
        .map(|i| (1.0 + (-(i as f32 % 61.0) + 30.2).exp()).recip())
        .collect();
    let edge = Image::from_vec(61, 61, 1, edge).unwrap();
    let map = match_images(&edge, &edge, &MatchSettings::default()).unwrap();
    assert_eq!(map.count(Verdict::Valid), 0);
    let along = MatchSettings {
        axes: Axes::Horizontal,
        ..MatchSettings::default()
    };
    let map = match_images(&edge, &edge, &along).unwrap();
    // Ten pixels off, the edge's tail is exponential: moving it equals a gain, so nothing can be measured there either.
    for ([x, _], found) in map.nodes().filter(|([x, _], _)| (x - 30.0).abs() < 9.0) {
        assert_eq!(found.verdict, Verdict::Valid, "column {x}");
    }
    assert!(worst(&map, [0.0, 0.0]) < 1e-3);
}

#[test]
fn periodic_texture_is_ambiguous() {
    let wave = |i: usize| {
        ((i % 90) as f32 * std::f32::consts::TAU / 3.0).cos()
            + ((i / 90) as f32 * std::f32::consts::TAU / 3.7).sin()
    };
    let waves = Image::from_vec(90, 80, 1, (0..7200).map(wave).collect()).unwrap();
    let map = match_images(&waves, &waves, &MatchSettings::default()).unwrap();
    assert_eq!(map.count(Verdict::Ambiguous), map.grid.len());
}

#[test]
fn shifts_beyond_the_search_are_invalid() {
    for (search_px, shift) in [(4, [9.0, 0.3]), (4, [0.2, -4.6]), (12, [40.0, -31.0])] {
        let [a, b] = pair(151, 151, shift, |v| v);
        let settings = MatchSettings {
            search_px,
            ..MatchSettings::default()
        };
        let map = match_images(&a, &b, &settings).unwrap();
        assert_eq!(map.count(Verdict::Valid), 0, "{shift:?}");
    }
}

#[test]
fn saturated_patches_are_left_out_and_spoil_nothing_beside_them() {
    let [mut a, mut b] = pair(151, 121, [2.0, -1.0], |v| v);
    for y in 40..90 {
        for x in 50..110 {
            a.pixel_mut(x, y)[0] = 1.0;
            b.pixel_mut(x + 2, y - 1)[0] = 1.0;
        }
    }
    let map = match_images(&a, &b, &MatchSettings::default()).unwrap();
    for ([x, y], found) in map.nodes() {
        let inside = (60.0..100.0).contains(&x) && (50.0..80.0).contains(&y);
        assert!(!inside || found.verdict == Verdict::Textureless);
    }
    assert!(share_valid(&map) > 0.5);
    assert!(
        worst(&map, [2.0, -1.0]) < 0.1,
        "{}",
        worst(&map, [2.0, -1.0])
    );
}

#[test]
fn unequal_blur_costs_no_more_than_is_documented() {
    // A's point spread is a Gaussian of σ = 0.85 px, full width at half maximum 2.0 px. The limits are the documented
    // errors and a tenth more, for the texture at hand.
    let texture = Texture::white(151, 151, 3);
    let a = texture.render(BLUR_PX, [0.0, 0.0], None);
    let shift = [0.4, -0.7];
    let width_of_sigma = (8.0 * 2f64.ln()).sqrt();
    for (meaning, blur_px, documented_px) in [
        (
            "full width wider by 1 px",
            BLUR_PX + 1.0 / width_of_sigma,
            0.04,
        ),
        ("blurred further by 1 px", BLUR_PX.hypot(1.0), 0.04),
        ("σ wider by 1 px", BLUR_PX + 1.0, 0.07),
    ] {
        let b = texture.render(blur_px, shift, None);
        let [a, b] = [&a, &b].map(|values| picture(151, values, 1.0, 0.0, 0.0, 0));
        let map = match_images(&a, &b, &MatchSettings::default()).unwrap();
        let all = map.observations();
        assert!(
            share_valid(&map) > 0.5,
            "{meaning}: {} valid",
            share_valid(&map)
        );
        let sum: f64 = (all.iter())
            .map(|o| (o.shift_px[0] - shift[0]).powi(2) + (o.shift_px[1] - shift[1]).powi(2))
            .sum();
        let rms = (sum / (2 * all.len()) as f64).sqrt();
        println!("{meaning}: {rms:.4} px");
        assert!(rms < 1.1 * documented_px, "{meaning}: {rms}");
    }
}

#[test]
fn scale_and_offset_of_the_pictures_change_nothing() {
    let shift = [1.3, -0.6];
    let [a, b] = pair(101, 83, shift, |v| v);
    let plain = match_images(&a, &b, &MatchSettings::default()).unwrap();
    assert_eq!(strange_nodes(&plain, [101, 83], 21, shift), [""; 0]);
    for scale in [1e-6f32, 1e6] {
        let scaled = |image: &Image, by: f32| {
            let data = image.data().iter().map(|v| v * by).collect();
            Image::from_vec(image.width(), image.height(), 1, data).unwrap()
        };
        for (sa, sb) in [(scale, scale), (scale, 1.0)] {
            let map =
                match_images(&scaled(&a, sa), &scaled(&b, sb), &MatchSettings::default()).unwrap();
            assert_eq!(map.count(Verdict::Valid), plain.count(Verdict::Valid));
            for (p, q) in plain.observations().iter().zip(map.observations()) {
                assert!((p.shift_px[0] - q.shift_px[0]).abs() < 1e-4);
                assert!((p.shift_px[1] - q.shift_px[1]).abs() < 1e-4);
            }
        }
    }
}

#[test]
fn odd_and_smallest_sizes_work_and_smaller_ones_are_refused() {
    let settings = MatchSettings {
        window_px: 15,
        stride_px: 1,
        ..MatchSettings::default()
    };
    for (width, height) in [(23, 23), (57, 23), (25, 91)] {
        let [a, b] = pair(width, height, [0.0, 0.0], |v| v);
        let map = match_images(&a, &b, &settings).unwrap();
        assert_eq!(map.grid.len(), (width - 22) * (height - 22));
    }
    for (width, height) in [(1, 1), (22, 50), (50, 22), (0, 0)] {
        let empty = Image::zeros(width, height, 1);
        let error = match_images(&empty, &empty, &settings).unwrap_err();
        assert!(matches!(error, MatchError::TooSmall { .. }), "{error}");
    }
}

#[test]
fn nan_and_infinity_are_refused_with_the_pixel_named() {
    let [a, mut b] = pair(61, 51, [0.0, 0.0], |v| v);
    for bad in [f32::NAN, f32::INFINITY] {
        b.pixel_mut(17, 30)[0] = bad;
        let text = match_images(&a, &b, &MatchSettings::default())
            .unwrap_err()
            .to_string();
        assert!(text.contains("x 17") && text.contains("y 30"), "{text}");
    }
    let colour = Image::zeros(61, 51, 3);
    assert_eq!(
        match_images(&colour, &colour, &MatchSettings::default()),
        Err(MatchError::Plane(PlaneError::Channels(3)))
    );
    let other = Image::zeros(60, 51, 1);
    assert!(matches!(
        match_images(&a, &other, &MatchSettings::default()),
        Err(MatchError::Size { .. })
    ));
    for window_px in [4, 3, 33] {
        let settings = MatchSettings {
            window_px,
            ..MatchSettings::default()
        };
        assert!(matches!(
            match_images(&a, &a, &settings),
            Err(MatchError::Setting { .. })
        ));
    }
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let [a, b] = pair(151, 201, [1.2, 0.4], |v| v);
    let settings = MatchSettings {
        search_px: 9,
        ..MatchSettings::default()
    };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let map = pool.install(|| match_images(&a, &b, &settings)).unwrap();
        // NaN is not equal to itself; its text is.
        format!("{map:?}")
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn a_smooth_field_of_shifts_is_recovered_from_noisy_matches() {
    let mut case = case([0.7, -1.1]);
    (case.noise, case.settings.stride_px) = (0.01, 4);
    let [a, b] = score::pair(&case);
    let map = match_images(&a, &b, &case.settings).unwrap();
    let fit = SmoothField::fit(&map.observations(), 2, Loss::Tukey).unwrap();
    for at in [[20.0, 20.0], [75.0, 75.0], [130.0, 60.0]] {
        let found = fit.field.at(at);
        let off = (found[0] - 0.7).hypot(found[1] + 1.1);
        assert!(
            off < 0.008,
            "{off} px at {at:?}, less than one match's 0.012 px"
        );
    }
    assert!((0.6..1.3).contains(&fit.scale), "{}", fit.scale);
}
