//! What every pixel model's response must hold to, whatever is behind it.

use quadpixel::em::PixelStack;
use quadpixel::response::{
    AngularResponse, GeometricResponse, Provenance, Response, ResponseAxes, ResponseLookup,
    ResponseMeta,
};
use quadpixel::sensor::MovingFrame;
use quadpixel::sensor::Subpixels;

use crate::random::Lcg;

/// Rounding of f32 sums of up to 16 terms.
const ROUNDING: f32 = 1e-5;

/// Holds a centred pixel's response to the seam's contract. `aim` × (sub-pixel's centre / pitch) is the (u, v) aimed at
/// the sub-pixel; `symmetry` is what mirror images may differ by.
pub fn conforms(response: &Response, wavelength_nm: f64, aim: f64, symmetry: f32) {
    let lookup = response.at(wavelength_nm);
    stays_a_share_of_the_light_everywhere(&lookup);
    has_the_symmetries_of_the_pixel(&lookup, symmetry);
    sub_pixel_aimed_at_gets_the_most(&lookup, aim);
    single_and_batch_agree(&lookup);
    if let Response::Table(table) = response {
        comes_back_from_its_file_bit_for_bit(table);
    }
}

/// Random directions in the unit disc.
fn directions(count: usize) -> Vec<(f32, f32)> {
    let mut random = Lcg(1);
    let mut next = || random.between(-1.0, 1.0) as f32;
    let mut found = Vec::new();
    while found.len() < count {
        let (u, v) = (next(), next());
        if u * u + v * v < 0.99 {
            found.push((u, v));
        }
    }
    found
}

fn read(lookup: &ResponseLookup, u: f32, v: f32) -> Vec<f32> {
    let mut out = vec![0.0; lookup.subpixels().count()];
    lookup.weights(u, v, &mut out);
    out
}

fn stays_a_share_of_the_light_everywhere(lookup: &ResponseLookup) {
    for (u, v) in directions(20_000) {
        let p = read(lookup, u, v);
        assert!(
            p.iter().all(|&p| (0.0..=1.0 + ROUNDING).contains(&p)),
            "{p:?} at {u}, {v}"
        );
        assert!(p.iter().sum::<f32>() <= 1.0 + ROUNDING, "{p:?} at {u}, {v}");
    }
}

fn has_the_symmetries_of_the_pixel(lookup: &ResponseLookup, tolerance: f32) {
    let s = lookup.subpixels();
    let (m, n) = (s.m(), s.n());
    for (u, v) in directions(2_000) {
        let p = read(lookup, u, v);
        let mirror_x = read(lookup, -u, v);
        let mirror_y = read(lookup, u, -v);
        let transposed = read(lookup, v, u);
        for (i, &own) in p.iter().enumerate() {
            let (c, r) = s.column_row(i);
            let close = |a: f32, what| {
                assert!(
                    (a - own).abs() <= tolerance,
                    "{what} at {u}, {v}: {a} and {own}"
                );
            };
            close(mirror_x[s.index(m - 1 - c, r)], "mirror in x");
            close(mirror_y[s.index(c, n - 1 - r)], "mirror in y");
            if m == n {
                close(transposed[s.index(r, c)], "transposed");
            }
        }
    }
}

fn sub_pixel_aimed_at_gets_the_most(lookup: &ResponseLookup, aim: f64) {
    let s = lookup.subpixels();
    for i in 0..s.count() {
        let (x, y) = s.centre(i);
        let p = read(lookup, (x * aim) as f32, (y * aim) as f32);
        let most = p.iter().cloned().fold(f32::MIN, f32::max);
        assert_eq!(p[i], most, "{s}: aimed at {} and got {p:?}", s.name(i));
    }
}

fn single_and_batch_agree(lookup: &ResponseLookup) {
    let rays = directions(101);
    let (u, v): (Vec<f32>, Vec<f32>) = rays.iter().copied().unzip();
    let mut out = vec![0.0; rays.len() * lookup.subpixels().count()];
    lookup.weights_batch(&u, &v, &mut out);
    for ((u, v), batch) in rays.iter().zip(out.chunks(lookup.subpixels().count())) {
        assert_eq!(read(lookup, *u, *v), batch);
    }
}

fn comes_back_from_its_file_bit_for_bit(table: &AngularResponse) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("response.npz");
    table.write_npz(&path).unwrap();
    let back = AngularResponse::read_npz(&path).unwrap();
    assert_eq!(&back, table);
    assert_eq!(
        std::fs::read_dir(folder.path()).unwrap().count(),
        1,
        "something left aside"
    );
}

#[test]
fn geometric_pixels_conform() {
    for s in Subpixels::SIMULATED {
        let g = GeometricResponse::matched_to_f_number(s, 3.5, 1.8).unwrap();
        conforms(&Response::Geometric(g), 550.0, 0.55, 0.0);
    }
}

/// A smooth made-up table: sub-pixels share a lobe by how near they are aimed at.
pub fn table(subpixels: Subpixels, wavelengths_nm: Vec<f64>) -> AngularResponse {
    let axis: Vec<f64> = (-20..=20).map(|i| f64::from(i) * 0.04).collect();
    let mut p = Vec::new();
    for w in &wavelengths_nm {
        for &v in &axis {
            for &u in &axis {
                let share = |i: usize| {
                    let (x, y) = subpixels.centre(i);
                    (-((u - x).powi(2) + (v - y).powi(2)) * 8.0 * 550.0 / w).exp()
                };
                let sum: f64 = (0..subpixels.count()).map(share).sum();
                p.extend((0..subpixels.count()).map(|i| (0.9 * share(i) / sum) as f32));
            }
        }
    }
    let meta = ResponseMeta {
        model: "made-up".into(),
        settings: Provenance::Imported {
            file: "made up".into(),
            symmetric: false,
        },
        pixel: PixelStack::builtin("1.6um").unwrap(),
        pitch_um: 3.5,
        subpixels,
        frame: MovingFrame {
            index: 1.5,
            height_um: 3.0,
        },
        key: String::new(),
        shift_grid: None,
        chief_ray_shifts: None,
        corrections: Vec::new(),
        charge: Default::default(),
    };
    let axes = ResponseAxes {
        wavelengths_nm,
        shifts_um: vec![[0.0, 0.0]],
        u: axis.clone(),
        v: axis,
    };
    AngularResponse::new(axes, meta, p).unwrap()
}

#[test]
fn tables_conform_for_every_partition() {
    for s in Subpixels::SIMULATED {
        conforms(
            &Response::Table(table(s, vec![450.0, 550.0])),
            500.0,
            1.0,
            1e-6,
        );
    }
}

#[test]
fn wavelength_between_two_tables_is_their_linear_mean() {
    let t = table(Subpixels::QUAD, vec![450.0, 650.0]);
    let mut at = [[0.0f32; 4]; 4];
    for (w, out) in [450.0, 500.0, 650.0, 900.0].into_iter().zip(&mut at) {
        t.interpolator(w).weights(0.123, -0.21, out);
    }
    let [low, between, high, beyond] = at;
    for ((l, b), h) in low.iter().zip(&between).zip(&high) {
        assert!((b - (0.75 * l + 0.25 * h)).abs() < 1e-6);
    }
    assert_eq!(high, beyond);
}

#[test]
fn numpy_reads_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("response.npz");
    let t = table(Subpixels::DUAL_X, vec![450.0, 550.0]);
    t.write_npz(&path).unwrap();
    let script = "import sys, json, numpy as np; f = np.load(sys.argv[1]); m = json.loads(bytes(f['meta'])); \
                  print(f['P'].shape, f['P'].dtype, m['subpixels'], f['shift_um'].shape, repr(float(f['P'][1, 0, 3, 5, 1])))";
    // scripts/test sets it to an interpreter that has NumPy; without it the format is held by our own reader (above).
    let Some(python) = std::env::var_os("QUADPIXEL_PYTHON") else {
        eprintln!("QUADPIXEL_PYTHON is not set: not run");
        return;
    };
    let output = std::process::Command::new(python)
        .args(["-c", script])
        .arg(&path)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let value = f64::from(t.node(1, 0, 3, 5)[1]);
    let wanted = format!("(2, 1, 41, 41, 2) float32 2x1 (1, 2) {value:?}");
    assert_eq!(said.trim(), wanted, "{output:?}");
}

#[test]
fn broken_tables_and_files_are_refused_with_the_reason() {
    let t = table(Subpixels::QUAD, vec![550.0]);
    let with = |change: &dyn Fn(&mut ResponseAxes, &mut Vec<f32>)| {
        let (mut axes, mut p) = (t.axes().clone(), t.table().to_vec());
        change(&mut axes, &mut p);
        AngularResponse::new(axes, t.meta().clone(), p)
            .unwrap_err()
            .to_string()
    };
    assert!(with(&|_, p| p[7] = f32::NAN).contains("P is NaN; allowed: 0 to 1"));
    assert!(with(&|_, p| p[7] = -0.1).contains("P is -0.1"));
    assert!(with(&|_, p| p[..4].fill(0.3)).contains("P summed over sub-pixels is 1.2"));
    assert!(with(&|_, p| p.truncate(8)).contains("length"));
    assert!(with(&|a, _| a.u[3] += 1e-3).contains("at place 3"));
    assert!(with(&|a, _| a.shifts_um[0] = [0.1, 0.0]).contains("shift_um"));
    assert!(with(&|a, _| a.wavelengths_nm[0] = f64::NAN).contains("wavelength_nm"));

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("torn.npz");
    t.write_npz(&path).unwrap();
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    let error = AngularResponse::read_npz(&path).unwrap_err().to_string();
    assert!(error.contains("torn.npz"), "{error}");
    let mut flipped = whole.clone();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 0xff;
    std::fs::write(&path, &flipped).unwrap();
    assert!(
        AngularResponse::read_npz(&path).is_err(),
        "a flipped byte passed the checksum"
    );
}
