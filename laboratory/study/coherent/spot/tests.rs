//! Spots of made-up products.

use super::super::cone::places;
use super::*;

/// A cone of a pixel with these products of two waves, without fields.
fn cone(pixels: usize, reach: f64, of: impl Fn(usize, [i32; 2], [i32; 2]) -> Complex64) -> Cone {
    let side = reach as i32 + 1;
    let waves: Vec<[i32; 2]> = (-side..=side)
        .flat_map(|j| (-side..=side).map(move |l| [j, l]))
        .filter(|[j, l]| f64::from(*j).hypot(f64::from(*l)) < reach)
        .collect();
    let n = waves.len();
    let product = |half: usize| {
        let of = |k: usize| of(half, waves[k / n], waves[k % n]);
        (0..n * n).map(of).collect()
    };
    Cone {
        pitch_um: 2.0,
        wavelength_um: 0.55,
        pixels,
        products: [0, 1].map(product),
        places: places(&waves),
        waves,
    }
}

/// Waves that fall on a half by a prism: products of any Hermitian form will do.
fn prism(half: usize, a: [i32; 2], b: [i32; 2]) -> Complex64 {
    let sign = if half == 0 { -1.0 } else { 1.0 };
    let [x, y] = [0, 1].map(|axis| f64::from(a[axis] - b[axis]));
    let p = 0.3 + sign * 0.01 * f64::from(a[0] + b[0]) + 0.003 * f64::from(a[1] + b[1]);
    let size = p * (-0.1 * (x * x + 2.0 * y * y)).exp();
    Complex64::from_polar(size, 0.07 * sign * x + 0.2 * y)
}

/// The mean over all places of what all pixels' halves absorb is the mean of P over the cone: Parseval.
#[test]
fn the_mean_over_the_places_is_the_incoherent_mean() {
    let cone = cone(4, 4.8, prism);
    for (f_number, depth_um) in [(1.7, 0.0), (1.7, 3.0), (2.8, -1.0), (8.0, 0.5)] {
        let spot = Spot::new(&cone, f_number, depth_um);
        let a = amplitudes(&cone, f_number, depth_um);
        assert!((a.iter().map(|a| a.norm_sqr()).sum::<f64>() - 1.0).abs() < 1e-12);
        for half in [0, 1] {
            let n = cone.waves.len();
            let of_wave = |k: usize| a[k].norm_sqr() * cone.products[half][k * n + k].re;
            let of_cone: f64 = (0..n).map(of_wave).sum();
            for transfer in [&spot.coherent[half], &spot.incoherent[half]] {
                // Places in one pixel, and the pixels to which the light of each goes: all places of a period.
                let places = 8;
                let all = || (0..places * cone.pixels).map(|k| k as f64 / places as f64);
                let of_line = |y| {
                    let line = transfer.line(y);
                    all().map(|x| line.share(x)).sum::<f64>()
                };
                let sum: f64 = all().map(of_line).sum::<f64>() / (places * places) as f64;
                assert!((sum - of_cone).abs() < 1e-12, "{sum} {of_cone}");
                assert!((transfer.mean() - of_cone).abs() < 1e-12);
            }
        }
    }
}

/// J₁ by Bessel's integral.
fn j1(z: f64) -> f64 {
    let steps = 64;
    let at = |k: usize| {
        let t = PI * (k as f64 + 0.5) / f64::from(steps);
        (t - z * t.sin()).cos()
    };
    (0..steps as usize).map(at).sum::<f64>() / f64::from(steps)
}

/// Without phases between them, waves make the square of the pixel that the diffraction of the lens blurs: of a point
/// source, the light of its Airy pattern between the pixel's borders.
#[test]
fn the_model_is_the_light_of_the_airy_pattern_on_the_pixel() {
    // 24 pixels of 2 µm from spot to spot: 44 times λF of F/2.
    let f_number = 2.0;
    let step = 0.55 / 48.0;
    let cone = cone(24, 0.5 / f_number / step + 0.5, |_, a, b| {
        Complex64::from(if a == b { 0.4 } else { 0.0 })
    });
    let spot = Spot::new(&cone, f_number, 0.0);
    let line = spot.incoherent[0].line(0.0);
    let airy = |x: f64, y: f64| {
        let z = PI * x.hypot(y) / (0.55 * f_number);
        let e = if z == 0.0 { 1.0 } else { 2.0 * j1(z) / z };
        e * e * PI / (2.0 * 0.55 * f_number).powi(2)
    };
    for x0 in [0.0, 0.7, 1.0, 1.9] {
        let steps = 60;
        let at = |k: usize| 2.0 * ((k as f64 + 0.5) / f64::from(steps) - 0.5);
        let row = |y: usize| {
            let on_row = (0..steps as usize).map(|x| airy(at(x) - x0, at(y)));
            on_row.sum::<f64>()
        };
        let on_pixel = (0..steps as usize).map(row).sum::<f64>() * (2.0 / f64::from(steps)).powi(2);
        let found = line.share(x0 / 2.0) / 0.4;
        assert!((found - on_pixel).abs() < 0.01, "{x0}: {found} {on_pixel}");
    }
    // Out of focus each direction lands elsewhere: with P alike the halves still agree.
    let blurred = Spot::new(&cone, f_number, 5.0);
    assert!(disparity_px(&blurred.incoherent).abs() < 1e-9);
}

/// Products of a mirror-symmetric pixel: spots to the left give the left half what spots to the right give the right.
#[test]
fn the_halves_are_each_others_mirror_image() {
    let cone = cone(4, 4.8, |half, a, b| {
        let (a, b) = match half {
            0 => (a, b),
            _ => ([-a[0], a[1]], [-b[0], b[1]]),
        };
        prism(0, a, b)
    });
    let spot = Spot::new(&cone, 1.7, 1.0);
    for [left, right] in [&spot.coherent, &spot.incoherent] {
        let (left, right) = (left.line(0.2), right.line(0.2));
        for x in [-0.4, 0.0, 0.3] {
            assert!((left.share(x) - right.share(-x)).abs() < 1e-12);
        }
    }
}
