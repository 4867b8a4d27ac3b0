//! What the network that comes with the program knows.

use std::io::{Cursor, Write};

use quadpixel::image::Image;
use quadpixel_algorithms::dense::{
    BlurRatio, DenseMap, Network, OppositePair, OppositeViews, dense_disparity_of,
    learned_disparity_of,
};

use crate::blurred::{errors, knows_nothing, of_ratio, opposite, pair, parted, without_texture};

fn told(left_right: Option<&[Image; 2]>, top_bottom: Option<&[Image; 2]>) -> DenseMap {
    let views = OppositeViews {
        left_right: left_right.and_then(opposite),
        top_bottom: top_bottom.and_then(opposite),
        ..OppositeViews::default()
    };
    learned_disparity_of(views, &Network::shipped().unwrap()).unwrap()
}

fn median_error(map: &DenseMap, truth: f64) -> f64 {
    let found = errors(map, |_| truth);
    found[found.len() / 2]
}

#[test]
fn a_blurred_plane_has_its_disparity() {
    for truth in [-3.0, -1.5, -0.5, 0.0, 0.8, 2.0] {
        let map = told(Some(&pair(|_| truth)), None);
        let error = median_error(&map, truth);
        assert!(error < 0.05 + 0.1 * f64::abs(truth), "{truth}: {error}");
        let sigma = map.sigma_px.data();
        assert!(sigma.iter().all(|s| s.is_finite() && *s > 0.0));
    }
}

#[test]
fn top_and_bottom_tell_it_alone_and_beside_left_and_right() {
    let truth = -1.2;
    let (across, down) = (pair(|_| truth), parted(|_| truth, true, 0.0));
    for map in [told(None, Some(&down)), told(Some(&across), Some(&down))] {
        let error = median_error(&map, truth);
        assert!(error < 0.17, "{error}");
    }
}

#[test]
fn a_depth_step_is_where_it_is() {
    let truth = |x: f64| if x < 64.0 { -1.0 } else { 1.0 };
    let map = told(Some(&pair(truth)), None);
    let found = errors(&map, truth);
    let mean = found.iter().sum::<f64>() / found.len() as f64;
    assert!(mean < 0.25, "{mean}");
}

#[test]
fn a_ratio_far_from_a_phones_is_heeded_though_the_network_is_not_told() {
    let (blur_px, ratio) = (10.0, 0.08);
    let truth = blur_px * ratio;
    let views = of_ratio(blur_px, |_| ratio);
    let error_of = |ratio: Option<&BlurRatio>| {
        let left_right = OppositePair {
            views: views.each_ref(),
            ratio,
        };
        let views = OppositeViews {
            left_right: Some(left_right),
            ..OppositeViews::default()
        };
        let map = learned_disparity_of(views, &Network::shipped().unwrap()).unwrap();
        median_error(&map, truth)
    };
    let (told, assumed) = (error_of(Some(&BlurRatio::Whole(ratio))), error_of(None));
    assert!(told < 0.05 && told < 0.5 * assumed, "{told}, {assumed}");
}

#[test]
fn no_texture_is_no_knowledge() {
    for views in without_texture() {
        assert!(knows_nothing(&told(Some(&views), None)));
    }
}

#[test]
fn the_bytes_are_the_same_whatever_the_threads() {
    let views = pair(|x| 0.02 * (x - 64.0));
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| told(Some(&views), None))
    };
    let (one, three) = (with(1), with(3));
    assert_eq!(one.disparity_px.data(), three.disparity_px.data());
    assert_eq!(one.sigma_px.data(), three.sigma_px.data());
}

/// A field of a protocol buffer that holds bytes.
fn held(number: u8, bytes: &[u8]) -> Vec<u8> {
    let length = u8::try_from(bytes.len());
    let mut field = vec![number << 3 | 2];
    match length {
        Ok(short @ ..128) => field.push(short),
        _ => field.extend([0x80 | (bytes.len() % 128) as u8, (bytes.len() / 128) as u8]),
    }
    field.extend(bytes);
    field
}

/// An ONNX graph (onnx.proto) that takes views and what matching found of them, and answers with the latter and `more`.
fn passes_on(more: f32) -> Network {
    let value = |name: &str| {
        let floats = held(2, &held(1, &[0x08, 1]));
        [held(1, name.as_bytes()), floats].concat()
    };
    let node = [
        held(1, b"matched"),
        held(1, b"more"),
        held(2, b"outcome"),
        held(4, b"Add"),
    ];
    let number = [
        vec![0x08, 1, 0x10, 1],
        held(8, b"more"),
        held(9, &more.to_le_bytes()),
    ];
    let graph = [
        held(1, &node.concat()),
        held(2, b"passes_on"),
        held(5, &number.concat()),
        held(11, &value("views")),
        held(11, &value("matched")),
        held(12, &value("outcome")),
    ];
    let model = [
        vec![0x08, 8],
        held(8, &[0x10, 17]),
        held(7, &graph.concat()),
    ]
    .concat();
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default();
    archive.start_file("network.onnx", options).unwrap();
    archive.write_all(&model).unwrap();
    Network::from_archive(&archive.finish().unwrap().into_inner()).unwrap()
}

#[test]
fn a_network_that_is_told_what_matching_found_answers_for_both() {
    let truth = |x: f64| -1.0 + x / 200.0;
    let (across, down) = (pair(truth), parted(truth, true, 0.0));
    // Of the second pair, what was matched is told turned.
    let views = || OppositeViews {
        left_right: opposite(&across),
        top_bottom: opposite(&down),
        ..OppositeViews::default()
    };
    let matched = dense_disparity_of(views()).unwrap();
    let mean_over_matched = |more: f32| {
        let map = learned_disparity_of(views(), &passes_on(more)).unwrap();
        let (found, matched) = (map.disparity_px.data(), matched.disparity_px.data());
        let off = found.iter().zip(matched).map(|(a, b)| f64::from(a - b));
        off.sum::<f64>() / found.len() as f64
    };
    assert!(mean_over_matched(0.0).abs() < 0.02);
    // Told at the wrong places, the plane would be off by 0.2 px in the mean.
    let map = learned_disparity_of(views(), &passes_on(0.0)).unwrap();
    let both = map
        .disparity_px
        .data()
        .iter()
        .zip(matched.disparity_px.data());
    let sizes: f32 = both.map(|(a, b)| (a - b).abs()).sum();
    let mean = sizes / matched.disparity_px.data().len() as f32;
    assert!(mean < 0.02, "{mean}");
    // At full resolution a quarter of a pixel, at half of it half a pixel.
    let more = mean_over_matched(0.25);
    assert!((0.25..=0.5).contains(&more), "{more}");
}
