//! What the network that comes with the program knows.

use quadpixel::image::Image;
use quadpixel_algorithms::dense::{DenseMap, Network, OppositeViews, learned_disparity_of};

use crate::blurred::{errors, knows_nothing, opposite, pair, parted, without_texture};

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
