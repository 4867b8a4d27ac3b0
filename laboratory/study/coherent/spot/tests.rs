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

/// ∫ over a pixel of 2 µm, the origin in its middle, by Simpson's rule.
fn over_pixel(of: impl Fn(f64, f64) -> f64) -> f64 {
    let steps = 40;
    let place = |k: usize| 2.0 * k as f64 / steps as f64 - 1.0;
    let weight = |k: usize| match k {
        0 => 1.0,
        _ if k == steps => 1.0,
        _ if k % 2 == 1 => 4.0,
        _ => 2.0,
    };
    let row = |y: usize| {
        let at = |x: usize| weight(x) * of(place(x), place(y));
        weight(y) * (0..=steps).map(at).sum::<f64>()
    };
    (0..=steps).map(row).sum::<f64>() * (2.0 / (3.0 * steps as f64)).powi(2)
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

/// The waves of a lens of F/2, each of which the pixel takes alike.
fn alike(pixels: usize) -> Cone {
    let step = 0.55 / (2.0 * pixels as f64);
    let product = |_, a, b| Complex64::from(if a == b { 0.4 } else { 0.0 });
    cone(pixels, 0.25 / step + 0.5, product)
}

/// Without phases between them, waves make the square of the pixel that the diffraction of the lens blurs: of a point
/// source, the light between the pixel's borders.
#[test]
fn the_model_is_the_light_of_the_diffraction_pattern_on_the_pixel() {
    let cone = alike(6);
    let a = amplitudes(&cone, 2.0, 0.0);
    let line = Spot::new(&cone, 2.0, 0.0).incoherent[0].line(0.0);
    let light = |x: f64, y: f64| {
        let turn = 2.0 * PI / cone.period_um();
        let waves = cone.waves.iter().zip(&a);
        let e: Complex64 = waves
            .map(|([j, l], a)| a * Complex64::cis(turn * (f64::from(*j) * x + f64::from(*l) * y)))
            .sum();
        e.norm_sqr() / cone.period_um().powi(2)
    };
    for x0 in [0.0, 0.7, 1.9] {
        let on_pixel = over_pixel(|x, y| light(x - x0, y));
        let found = line.share(x0 / 2.0) / 0.4;
        assert!((found - on_pixel).abs() < 1e-5, "{x0}: {found} {on_pixel}");
    }
    // Out of focus each direction lands elsewhere: with P alike the halves still agree.
    let blurred = Spot::new(&cone, 2.0, 5.0);
    assert!(disparity_px(&blurred.incoherent).abs() < 1e-9);
}

/// That pattern is Airy's, but for the light that it has beyond the period: 2/(π² r/λF) of it beyond r.
#[test]
fn the_model_is_the_light_of_the_airy_pattern_but_for_that_beyond_the_period() {
    for pixels in [8, 12, 24] {
        let line = Spot::new(&alike(pixels), 2.0, 0.0).incoherent[0].line(0.0);
        let airy = |x: f64, y: f64| {
            let z = PI * x.hypot(y) / (0.55 * 2.0);
            let e = if z == 0.0 { 1.0 } else { 2.0 * j1(z) / z };
            e * e * PI / (2.0f64 * 0.55 * 2.0).powi(2)
        };
        let beyond = 2.0 / (PI * PI * pixels as f64 / 1.1);
        for x0 in [0.0, 0.7, 1.0, 1.9] {
            let on_pixel = over_pixel(|x, y| airy(x - x0, y));
            let found = line.share(x0 / 2.0) / 0.4;
            assert!(
                (found - on_pixel).abs() < 1.5 * beyond,
                "{pixels} {x0}: {found} {on_pixel}"
            );
        }
    }
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
