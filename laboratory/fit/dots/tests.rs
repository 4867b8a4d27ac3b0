use super::*;

const SIZE: [usize; 2] = [420, 300];
const RADIUS: f64 = 11.0;

/// Light of a dot's left or right view at a place beside its middle: a disk, brighter on one side, with soft edges.
fn light(x: f64, y: f64, right: bool) -> f64 {
    let edge = 1.0 / (1.0 + ((x.hypot(y) - RADIUS) / 0.8).exp());
    let lean = if right { 0.06 } else { -0.06 };
    edge * (1.0 + lean * x).max(0.0)
}

/// Both views of dots 48 px apart, darker towards the corners, on a ground that is not black, 14-bit codes.
fn pictures(apart_px: f64, gain: f64) -> [Image; 2] {
    [false, true].map(|right| {
        let mut image = Image::zeros(SIZE[0], SIZE[1], 1);
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                let (px, py) = (x as f64 - 13.3, y as f64 - 9.8);
                let beside = |c: f64| c - (c / apart_px).round() * apart_px;
                let far = (x as f64 - 210.0).hypot(y as f64 - 150.0) / 260.0;
                let value =
                    0.02 + gain * (1.0 - 0.5 * far * far) * light(beside(px), beside(py), right);
                image.pixel_mut(x, y)[0] = ((value * 16383.0).round() / 16383.0).min(1.0) as f32;
            }
        }
        image
    })
}

#[test]
fn kernels_of_dots_are_those_that_were_drawn_and_keep_the_shift_of_the_views() {
    let [left, right] = pictures(48.0, 0.5);
    let found = kernels([&left, &right], [3, 2], 130.0).unwrap();
    assert!(found.fields.iter().all(|field| field.dots >= 4));
    let half = (found.side / 2) as f64;
    for field in &found.fields {
        for (right, view) in [false, true].into_iter().zip(&field.views) {
            // The sum of both leans to neither side, so its centroid is the dot's middle.
            let drawn: Vec<f64> = (0..found.side * found.side)
                .map(|at| {
                    let (x, y) = (at % found.side, at / found.side);
                    light(x as f64 - half, y as f64 - half, right)
                })
                .collect();
            let all: f64 = drawn.iter().sum();
            let square = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>();
            let error = square(&mut view.iter().zip(&drawn).map(|(v, d)| v - d / all));
            let size = square(&mut drawn.iter().map(|d| d / all));
            assert!((error / size).sqrt() < 0.03, "{}", (error / size).sqrt());
        }
    }
    // A dot's place tells the field's: on the lattice.
    let [x, _] = found.fields[0].place_px;
    assert!((-200.0..-60.0).contains(&x), "{x}");
}

#[test]
fn pictures_that_give_no_kernels_are_told_what_would_do() {
    let told = |pictures: &[Image; 2], grid: [usize; 2], field_px: f64| {
        kernels([&pictures[0], &pictures[1]], grid, field_px).unwrap_err()
    };
    let saturated = told(&pictures(48.0, 1.2), [3, 2], 130.0);
    assert!(saturated.contains("saturated"), "{saturated}");
    let crowded = told(&pictures(26.0, 0.5), [3, 2], 130.0);
    assert!(crowded.contains("apart"), "{crowded}");
    // A grid that is half out of the picture.
    let mut half = pictures(48.0, 0.5);
    for image in &mut half {
        for y in 0..SIZE[1] {
            for x in 210..SIZE[0] {
                image.pixel_mut(x, y)[0] = 0.02;
            }
        }
    }
    let half = told(&half, [3, 2], 130.0);
    assert!(
        half.contains("column 3") && half.contains("no whole dot"),
        "{half}"
    );
    // More fields than dots: refused before there is a kernel for each.
    let fields = told(&pictures(48.0, 0.5), [1000, 1000], 1.0);
    assert!(fields.contains("1000 x 1000 fields"), "{fields}");
    let dark = [Image::zeros(64, 64, 1), Image::zeros(64, 64, 1)];
    let dark = told(&dark, [2, 2], 30.0);
    assert!(dark.contains("0 dots"), "{dark}");
}
