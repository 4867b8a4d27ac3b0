use super::*;

const SIDE: usize = 128;

/// Waves of 4 to 20 px in many directions seen through a spot of weighted points: exact, without sampling a
/// convolution.
fn seen(points: &[(f64, [f64; 2])], shift: impl Fn([f64; 2]) -> [f64; 2]) -> Image {
    let total: f64 = points.iter().map(|p| p.0).sum();
    let waves: Vec<([f64; 2], f64)> = (0..120)
        .map(|k| {
            let k = f64::from(k);
            let (angle, period) = (2.399_963 * k, 4.0 + 16.0 * (0.618_034 * k).fract());
            let f = std::f64::consts::TAU / period;
            ([f * angle.cos(), f * angle.sin()], 1.7 * k * k)
        })
        .collect();
    // Modulus and phase of the spot at each wave.
    let spot: Vec<(f64, f64)> = (waves.iter())
        .map(|([u, v], _)| {
            let sum = points.iter().fold((0.0, 0.0), |(re, im), (w, [x, y])| {
                let phase = -(u * x + v * y);
                (re + w * phase.cos(), im + w * phase.sin())
            });
            (sum.0.hypot(sum.1) / total, sum.1.atan2(sum.0))
        })
        .collect();
    let values = (0..SIDE * SIDE)
        .map(|i| {
            let at = [(i % SIDE) as f64, (i / SIDE) as f64];
            let d = shift(at);
            let wave = |(([u, v], phase), (modulus, turn)): (&([f64; 2], f64), &(f64, f64))| {
                modulus * (u * (at[0] - d[0]) + v * (at[1] - d[1]) + phase + turn).cos()
            };
            let sum: f64 = waves.iter().zip(&spot).map(wave).sum();
            (0.5 + sum / 100.0) as f32
        })
        .collect();
    Image::from_vec(SIDE, SIDE, 1, values).unwrap()
}

fn centroid(points: &[(f64, [f64; 2])]) -> [f64; 2] {
    let total: f64 = points.iter().map(|p| p.0).sum();
    [0, 1].map(|axis| points.iter().map(|(w, p)| w * p[axis]).sum::<f64>() / total)
}

/// A comet: a bright head and a faint tail, skewed as coma is.
fn comet(length: f64) -> Vec<(f64, [f64; 2])> {
    (0..40)
        .map(|k| {
            let t = f64::from(k) / 39.0;
            let across = (2.1 * f64::from(k)).sin() * 0.2 * t * length;
            (
                (-3.0 * t).exp(),
                [t * length - 0.1 * across, 0.4 * t * length + across],
            )
        })
        .collect()
}

fn zero() -> SmoothField {
    SmoothField::from_parts([0.0; 2], [1.0; 2], [vec![0.0], vec![0.0]]).unwrap()
}

fn rms(field: &SmoothField, wanted: impl Fn([f64; 2]) -> [f64; 2]) -> f64 {
    let squares: f64 = (0..SIDE * SIDE)
        .map(|i| [(i % SIDE) as f64, (i / SIDE) as f64])
        .map(|at| (field.at(at), wanted(at)))
        .map(|(a, b)| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2))
        .sum();
    (squares / (SIDE * SIDE) as f64).sqrt()
}

#[test]
fn a_skewed_spot_is_placed_by_its_centroid_where_matching_follows_its_head() {
    let points = comet(4.0);
    let [cx, cy] = centroid(&points);
    let (a, b) = (
        seen(&[(1.0, [0.0; 2])], |_| [0.0; 2]),
        seen(&points, |_| [0.0; 2]),
    );
    let settings = crate::disparity::MatchSettings {
        window_px: 31,
        ..Default::default()
    };
    let found = crate::disparity::match_images(&a, &b, &settings).unwrap();
    let loss = crate::field::Loss::Tukey;
    let matched = SmoothField::fit(&found.observations(), 2, loss)
        .unwrap()
        .field;
    let reference = Reference::for_views(&a, 2, &[(&b, &matched)]).unwrap();
    let fitted = reference.fit(&b, &matched).unwrap();
    let [by_match, by_centroid] = [&matched, &fitted.field].map(|f| rms(f, |_| [cx, cy]));
    // The goal of the calibration is 0.03 px; the comet's head is several times that away from the centroid.
    assert!(by_match > 0.1, "{by_match}");
    assert!(by_centroid < 0.03, "{by_centroid}");
}

#[test]
fn a_smooth_field_and_a_gain_come_back_from_a_poor_start() {
    let shift = |[x, y]: [f64; 2]| {
        let [u, v] = [x, y].map(|p| 2.0 * p / (SIDE - 1) as f64 - 1.0);
        [0.6 + 0.3 * u - 0.1 * v * v, -0.4 + 0.2 * v + 0.1 * u * v]
    };
    let point = [(1.0, [0.0; 2])];
    let (a, mut b) = (seen(&point, |_| [0.0; 2]), seen(&point, shift));
    for (i, v) in b.data_mut().iter_mut().enumerate() {
        *v *= 0.25 + 0.05 * (i % SIDE) as f32 / SIDE as f32;
    }
    let reference = Reference::for_views(&a, 2, &[(&b, &zero())]).unwrap();
    let fitted = reference.fit(&b, &zero()).unwrap();
    // The view's own shift is looked up at the view's pixel: d(x) differs from that by d·∇d, at most 0.3 px · 0.6/64.
    let error = rms(&fitted.field, shift);
    assert!(error < 0.01, "{error}");
    assert!(fitted.rms_px < 0.01, "{}", fitted.rms_px);
}

#[test]
fn a_flat_or_tiny_picture_has_no_field() {
    let flat = Image::zeros(64, 64, 1);
    let fit = Reference::for_views(&flat, 2, &[(&flat, &zero())]);
    assert!(matches!(fit, Err(FieldError::Singular(2))));
    let tiny = seen(&[(1.0, [0.0; 2])], |_| [0.0; 2]);
    let tiny = Image::from_vec(16, 16, 1, tiny.data()[..256].to_vec()).unwrap();
    let fit = Reference::for_views(&tiny, 2, &[(&tiny, &zero())]);
    assert!(matches!(fit, Err(FieldError::TooFew { .. })));
}
