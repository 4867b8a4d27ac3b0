//! Matching by the rays of a camera's own pixel, against views of the same rays, summed point by point.

use quadpixel::image::Image;
use quadpixel_algorithms::dense::{OppositeViews, dense_disparity_of};
use quadpixel_datasets::BlurRays;

use crate::blurred::{SIDE, errors, opposite, texture};

/// Of a pupil with linear shares, with spherical aberration and coma; top and bottom are in focus where left and right
/// have a disparity, and each ray is displaced to both sides.
fn aberrated() -> BlurRays {
    let points = (0..160).map(|i| {
        let (r, a) = (((i as f64 + 0.5) / 160.0).sqrt(), 2.399_963 * i as f64);
        [r * a.cos(), r * a.sin()]
    });
    let mut rays = BlurRays::default();
    for [u, v] in points {
        let within = u * u + v * v;
        rays.x_px.push([1.5 * within * u + 0.3 * within, -2.0 * u]);
        rays.y_px.push([(1.5 * within + 0.5) * v, -2.0 * v]);
        rays.displaced_px.push(vec![[0.4, 0.0], [-0.4, 0.0]]);
        let shares = |at: f64| [0.5 * (1.0 + at), 0.5 * (1.0 - at)];
        let ([left, right], [top, bottom]) = (shares(u), shares(v));
        rays.left.push(left);
        rays.right.push(right);
        rays.top.push(top);
        rays.bottom.push(bottom);
    }
    rays
}

/// The view of a plane at t in which the rays have these weights, and its centroid along x and y.
fn view(rays: &BlurRays, weights: &[f64], t: f64) -> (Image, [f64; 2]) {
    let all: f64 = weights.iter().sum();
    let at = |[a, b]: [f64; 2]| a + b * t;
    let seen: Vec<[f64; 3]> = (0..weights.len())
        .flat_map(|k| {
            let (x, y) = (at(rays.x_px[k]), at(rays.y_px[k]));
            let draws = rays.displaced_px[k].iter();
            draws.map(move |[dx, dy]| [x + dx, y + dy, 0.5 * weights[k] / all])
        })
        .collect();
    let value = |i: usize| {
        let (x, y) = ((i % SIDE) as f64, (i / SIDE) as f64);
        let terms = seen.iter().map(|[dx, dy, w]| w * texture(x + dx, y + dy));
        terms.sum::<f64>() as f32
    };
    let image = Image::from_vec(SIDE, SIDE, 1, (0..SIDE * SIDE).map(value).collect()).unwrap();
    let centroid = [0, 1].map(|axis| -seen.iter().map(|s| s[2] * s[axis]).sum::<f64>());
    (image, centroid)
}

fn middle_error(views: OppositeViews<'_>, truth: f64) -> f64 {
    let found = errors(&dense_disparity_of(views).unwrap(), |_| truth);
    found[found.len() / 2]
}

/// Largest error of a plane, px.
fn allowed(truth: f64) -> f64 {
    0.01 + 0.01 * truth.abs()
}

#[test]
fn an_aberrated_lens_is_matched_by_its_own_rays() {
    let rays = aberrated();
    let (mut with, mut without) = (0.0, 0.0);
    for t in [-1.4, -0.7, 0.1, 0.6, 1.5] {
        let (left, l) = view(&rays, &rays.left, t);
        let (right, r) = view(&rays, &rays.right, t);
        let truth = l[0] - r[0];
        let pair = [left, right];
        let error = |blur| {
            let views = OppositeViews {
                left_right: opposite(&pair),
                blur,
                ..OppositeViews::default()
            };
            middle_error(views, truth)
        };
        let (own, family) = (error(Some(&rays)), error(None));
        assert!(own < allowed(truth), "{truth}: {own}");
        (with, without) = (with + own, without + family);
    }
    assert!(without > 4.0 * with, "{without}, {with}");
}

#[test]
fn top_and_bottom_are_matched_where_left_and_right_put_them() {
    let rays = aberrated();
    let pair = |halves: [&[f64]; 2], axis: usize, t: f64| {
        let [(a, at_a), (b, at_b)] = halves.map(|half| view(&rays, half, t));
        ([a, b], at_a[axis] - at_b[axis])
    };
    // In focus left and right have no disparity; top and bottom have some there.
    let disparity = |t: f64| pair([&rays.left, &rays.right], 0, t).1;
    let focus = -disparity(0.0) / (disparity(1.0) - disparity(0.0));
    let beside = pair([&rays.top, &rays.bottom], 1, focus).1;
    assert!(beside.abs() > 0.1, "{beside}");
    let astigmatism = vec![beside as f32; SIDE * SIDE];
    let astigmatism = Image::from_vec(SIDE, SIDE, 1, astigmatism).unwrap();
    for t in [-0.7, 1.2] {
        let (across, truth) = pair([&rays.left, &rays.right], 0, t);
        let (down, of_down) = pair([&rays.top, &rays.bottom], 1, t);
        let both = OppositeViews {
            left_right: opposite(&across),
            top_bottom: opposite(&down),
            astigmatism_px: Some(&astigmatism),
            blur: Some(&rays),
            ..OppositeViews::default()
        };
        let error = middle_error(both, truth);
        assert!(error < allowed(truth), "{truth}: {error}");
        let alone = OppositeViews {
            top_bottom: opposite(&down),
            blur: Some(&rays),
            ..OppositeViews::default()
        };
        let error = middle_error(alone, of_down);
        assert!(error < allowed(of_down), "{of_down}: {error}");
    }
}

#[test]
fn rays_of_no_camera_leave_the_family() {
    let (left, _) = view(&aberrated(), &aberrated().left, 0.7);
    let (right, _) = view(&aberrated(), &aberrated().right, 0.7);
    let pair = [left, right];
    let map = |blur: Option<BlurRays>| {
        let views = OppositeViews {
            left_right: opposite(&pair),
            blur: blur.as_ref(),
            ..OppositeViews::default()
        };
        dense_disparity_of(views)
    };
    let family = map(None).unwrap();
    let faults: [fn(&mut BlurRays); 5] = [
        |r| r.left.clear(),
        |r| r.x_px.iter_mut().for_each(|x| x[1] = 0.0),
        |r| r.x_px.iter_mut().for_each(|x| x[0] *= 1e300),
        |r| r.y_px.iter_mut().for_each(|y| y[1] *= 1e9),
        |r| r.right = r.left.clone(),
    ];
    for fault in faults {
        let mut rays = aberrated();
        fault(&mut rays);
        assert_eq!(map(Some(rays)).unwrap(), family);
    }
}
