//! What every chart holds, and the closed forms of each.

use super::*;
use rustfft::{FftPlanner, num_complex::Complex64};
use std::io::Write;

fn default(kind: &str) -> ChartSpec {
    serde_json::from_str(&format!("{{\"kind\":\"{kind}\"}}")).unwrap()
}

fn drawn() -> impl Iterator<Item = &'static str> {
    ChartSpec::KINDS.into_iter().filter(|&kind| kind != "image")
}

fn bits(t: &Texture) -> Vec<[u32; 3]> {
    let n = t.width();
    (0..n * n)
        .map(|i| t.texel(i % n, i / n).map(f32::to_bits))
        .collect()
}

#[test]
fn same_seed_gives_the_same_bits_on_any_number_of_threads() {
    let pool = |threads| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
    };
    for kind in drawn() {
        for seed in [3, 4] {
            let spec = random_spec(kind, seed).unwrap();
            let one = pool(1).install(|| bits(&spec.generate(seed, 150).unwrap()));
            let many = pool(5).install(|| bits(&spec.generate(seed, 150).unwrap()));
            assert!(one == many, "{kind}");
            assert!(
                one.iter()
                    .flatten()
                    .all(|&v| (0.0..=1.0).contains(&f32::from_bits(v))),
                "{kind}"
            );
        }
    }
}

#[test]
fn different_seeds_give_different_charts() {
    for kind in drawn() {
        let chart = |seed| {
            bits(
                &random_spec(kind, seed)
                    .unwrap()
                    .generate(seed, 100)
                    .unwrap(),
            )
        };
        assert!(chart(1) != chart(2), "{kind}");
    }
    for kind in ["alphabet", "noise", "dead-leaves"] {
        let chart = |seed| bits(&default(kind).generate(seed, 100).unwrap());
        assert!(chart(1) != chart(2), "{kind} of one specification");
    }
}

#[test]
fn specifications_survive_the_file_and_unknown_fields_do_not() {
    for kind in drawn() {
        let spec = random_spec(kind, 9).unwrap();
        let text = serde_json::to_string(&spec).unwrap();
        assert!(text.contains(&format!("\"kind\":\"{kind}\"")));
        assert_eq!(serde_json::from_str::<ChartSpec>(&text).unwrap(), spec);
        let extra = format!("{{\"kind\":\"{kind}\",\"bogus\":1}}");
        assert!(serde_json::from_str::<ChartSpec>(&extra).is_err(), "{kind}");
        let toml: ChartSpec = toml::from_str(&format!("kind = \"{kind}\"")).unwrap();
        assert_eq!(toml, default(kind));
    }
    assert!(serde_json::from_str::<ChartSpec>("{\"kind\":\"image\"}").is_err());
}

#[test]
fn bad_parameters_are_refused_by_name() {
    for kind in drawn() {
        for size in [0, Texture::MAX_SIDE_PX + 1] {
            let err = default(kind).generate(0, size).unwrap_err();
            assert!(
                err.to_string().contains(&format!("size {size} px")),
                "{err}"
            );
        }
        assert!(default(kind).generate(0, 1).is_ok(), "{kind} of one texel");
    }
    let refused = |text: &str, part: &str| {
        let spec: ChartSpec = toml::from_str(text).unwrap();
        let err = spec.generate(0, 16).unwrap_err().to_string();
        assert!(err.contains(part), "{text}: {err}");
    };
    refused("kind = 'constant'\ncolor = [0.1, nan, 0.2]", "color = NaN");
    refused(
        "kind = 'noise'\nexponent = nan",
        "exponent = NaN is not within 0..=4",
    );
    refused("kind = 'noise'\ncutoff_texels = 1.0", "cutoff_texels");
    refused("kind = 'slanted-edge'\nangle_deg = inf", "angle_deg");
    refused("kind = 'checkerboard'\nsquares = 0.0", "squares = 0");
    refused("kind = 'siemens-star'\nspokes = 1", "spokes = 1");
    refused("kind = 'siemens-star'\ndark = 0.9", "less than light");
    refused(
        "kind = 'dead-leaves'\nlargest_radius = 0.001",
        "largest_radius",
    );
    refused("kind = 'alphabet'\ntiles = 0", "tiles = 0");
    refused("kind = 'resolution'\nhighest_lw_ph = nan", "highest_lw_ph");
    let err = random_spec("lena", 0).unwrap_err().to_string();
    assert!(
        err.starts_with("unknown chart `lena`; known: resolution, alphabet"),
        "{err}"
    );
    assert!(matches!(
        random_spec("image", 0),
        Err(ChartError::NeedsFile)
    ));
}

#[test]
fn checkerboard_is_exact_when_squares_fit_the_raster() {
    let board = Checkerboard {
        squares: 4.0,
        ..Checkerboard::default()
    };
    let t = board.draw(128).unwrap();
    for (x, y) in [(0, 0), (31, 31), (32, 32), (127, 127), (65, 1)] {
        assert_eq!(t.texel(x, y)[0], 0.8, "{x} {y}");
    }
    for (x, y) in [(32, 0), (31, 32), (127, 0)] {
        assert_eq!(t.texel(x, y)[0], 0.05, "{x} {y}");
    }
    assert!((t.mean()[0] - 0.425).abs() < 1e-6);
    // Squares of half a texel cannot be shown: grey.
    let fine = Checkerboard {
        squares: 256.0,
        ..Checkerboard::default()
    };
    assert!(
        bits(&fine.draw(128).unwrap())
            .iter()
            .all(|v| (f32::from_bits(v[0]) - 0.425).abs() < 1e-6)
    );
}

#[test]
fn slanted_edge_has_its_angle_and_crosses_the_middle() {
    for angle_deg in [5.0f64, -3.0, 12.0] {
        let n = 256;
        let t = SlantedEdge {
            angle_deg,
            dark: 0.0,
            light: 1.0,
        }
        .draw(n)
        .unwrap();
        // The dark length of each row is the edge's place; a line fit over the rows.
        let (mut sum, mut moment, mut weight) = (0.0, 0.0, 0.0);
        for y in 0..n {
            let edge: f64 = (0..n).map(|x| 1.0 - f64::from(t.texel(x, y)[0])).sum();
            let v = y as f64 + 0.5 - 0.5 * n as f64;
            sum += edge;
            moment += v * edge;
            weight += v * v;
        }
        assert!((sum / n as f64 - 0.5 * n as f64).abs() < 1e-3);
        let slope = moment / weight;
        assert!(
            (slope + angle_deg.to_radians().tan()).abs() < 1e-5,
            "{angle_deg}: {slope}"
        );
    }
}

#[test]
fn siemens_star_has_its_spokes_and_a_grey_heart() {
    let spokes = 36;
    let n = 512;
    let t = SiemensStar {
        spokes,
        dark: 0.0,
        light: 1.0,
        ..SiemensStar::default()
    }
    .draw(n)
    .unwrap();
    let m = 1440;
    let mut ring: Vec<Complex64> = (0..m)
        .map(|k| {
            let a = std::f32::consts::TAU * k as f32 / m as f32;
            let v = t.sample_channel(0.5 + 0.3 * a.cos(), 0.5 + 0.3 * a.sin(), 0);
            Complex64::new(v.into(), 0.0)
        })
        .collect();
    FftPlanner::new().plan_fft_forward(m).process(&mut ring);
    let strongest = (1..m / 2)
        .max_by(|&a, &b| ring[a].norm().total_cmp(&ring[b].norm()))
        .unwrap();
    assert_eq!(strongest, spokes as usize);
    // A square wave's fundamental is 1/π a side of the spectrum; bilinear look-up and texels of 1/27 period take 1 %.
    assert!((ring[strongest].norm() / m as f64 * std::f64::consts::PI - 1.0).abs() < 0.02);
    // Nyquist lies at r = spokes / π = 11.5 texels.
    assert!((t.texel(256 + 7, 256)[0] - 0.5).abs() < 1e-6);
}

#[test]
fn noise_has_its_mean_variance_and_spectral_slope() {
    let n = 256;
    for (exponent, cutoff_texels) in [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (0.0, 4.0)] {
        let noise = Noise {
            exponent,
            cutoff_texels,
            mean: 0.5,
            contrast: 0.05,
            color: true,
        };
        let t = noise.draw(11, n).unwrap();
        for c in 0..3 {
            let values: Vec<f64> = (0..n * n)
                .map(|i| t.texel(i % n, i / n)[c].into())
                .collect();
            let mean = values.iter().sum::<f64>() / (n * n) as f64;
            let std =
                (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n * n) as f64).sqrt();
            // Five standard errors of 65536 independent values; less for the normalised fields.
            assert!((mean - 0.5).abs() < 5.0 * 0.05 / n as f64, "mean {mean}");
            assert!(
                (std / 0.05 - 1.0).abs() < 5.0 / (2f64.sqrt() * n as f64),
                "std {std}"
            );
            let low = band_power(&values, n, 8.0, 16.0);
            let high = band_power(&values, n, 32.0, 64.0);
            if cutoff_texels == 0.0 {
                // The bands are scaled copies, two octaves apart: a power law's ratio is 4^β. 600 modes at least: 4 % standard error.
                let slope = (low / high).ln() / 4f64.ln();
                assert!((slope - exponent).abs() < 0.15, "β {exponent}: {slope}");
            } else {
                assert!(band_power(&values, n, 66.0, 120.0) < 1e-8 * high);
            }
        }
    }
}

/// Mean power of the 2D frequencies low ≤ |k| < high (cycles a side).
fn band_power(values: &[f64], n: usize, low: f64, high: f64) -> f64 {
    let fft = FftPlanner::new().plan_fft_forward(n);
    let mut field: Vec<Complex64> = values.iter().map(|&v| Complex64::new(v, 0.0)).collect();
    fft.process(&mut field);
    let mut turned: Vec<Complex64> = (0..n * n).map(|i| field[(i % n) * n + i / n]).collect();
    fft.process(&mut turned);
    let signed = |i: usize| {
        if i > n / 2 {
            i as f64 - n as f64
        } else {
            i as f64
        }
    };
    let (sum, count) = (0..n * n)
        .filter(|i| (low..high).contains(&signed(i % n).hypot(signed(i / n))))
        .fold((0.0, 0.0), |(sum, count), i| {
            (sum + turned[i].norm_sqr(), count + 1.0)
        });
    sum / count
}

#[test]
fn dead_leaves_radii_follow_the_inverse_cube() {
    let spec = DeadLeaves::default();
    let leaves = spec.leaves(5);
    let (a, b) = (spec.least_radius, spec.largest_radius);
    for r in [0.003, 0.004, 0.008, 0.02] {
        let below = leaves
            .iter()
            .filter(|leaf| f64::from(leaf.radius) < r)
            .count() as f64;
        let want = (a.powi(-2) - f64::powi(r, -2)) / (a.powi(-2) - b.powi(-2));
        let n = leaves.len() as f64;
        // Five standard errors of a binomial share.
        assert!(
            (below / n - want).abs() < 5.0 * (want * (1.0 - want) / n).sqrt(),
            "{r}"
        );
    }
}

#[test]
fn alphabet_has_ink_in_every_tile() {
    let spec = Alphabet {
        tiles: 3,
        ..Alphabet::default()
    };
    let t = spec.draw(2, 300).unwrap();
    for tile in 0..9 {
        let tones: Vec<f32> = (0..100 * 100)
            .map(|i| t.texel((tile % 3) * 100 + i % 100, (tile / 3) * 100 + i / 100)[1])
            .collect();
        let low = tones.iter().copied().fold(1.0, f32::min);
        let high = tones.iter().copied().fold(0.0, f32::max);
        assert!(high - low > 0.2, "tile {tile}: {low}..{high}");
        // Regular text inks 10 to 30 % of its lines.
        let middle = 0.5 * (low + high);
        let dark = tones.iter().filter(|&&v| v < middle).count() as f64 / 1e4;
        assert!(
            (0.05..0.4).contains(&dark.min(1.0 - dark)),
            "tile {tile}: {dark}"
        );
    }
}

#[test]
fn image_files_are_read_as_srgb_at_8_and_16_bit() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("grey.png");
    let chart = |path: &std::path::Path| {
        ChartSpec::Image(ImageFile {
            path: path.to_path_buf(),
        })
    };
    image::RgbImage::from_pixel(40, 30, image::Rgb([128, 0, 255]))
        .save(&path)
        .unwrap();
    let t = chart(&path).generate(0, 8).unwrap();
    // sRGB 128 is 0.21586 in linear light (IEC 61966-2-1).
    for (got, want) in t.texel(3, 4).into_iter().zip([0.215_860_5, 0.0, 1.0]) {
        assert!((got - want).abs() < 1e-5);
    }
    image::ImageBuffer::from_pixel(30, 40, image::Rgba([0x8080u16, 0, 0xffff, 0x8000]))
        .save(&path)
        .unwrap();
    let t = chart(&path).generate(0, 30).unwrap();
    for (got, want) in t.texel(3, 4).into_iter().zip([0.207_93, 0.1, 0.6]) {
        assert!((got - want).abs() < 1e-4);
    }
    // The left half dark, the right half light: kept by the crop, and enlarged without overshoot.
    image::GrayImage::from_fn(40, 20, |x, _| image::Luma([if x < 20 { 0 } else { 255 }]))
        .save(&path)
        .unwrap();
    let t = chart(&path).generate(0, 64).unwrap();
    assert_eq!((t.texel(2, 9), t.texel(61, 9)), ([0.0; 3], [1.0; 3]));
}

#[test]
fn unreadable_images_name_the_file_and_the_reason() {
    let dir = tempfile::tempdir().unwrap();
    let reason = |name: &str| {
        let path = dir.path().join(name);
        let err = ChartSpec::Image(ImageFile { path })
            .generate(0, 8)
            .unwrap_err()
            .to_string();
        assert!(err.contains(name), "{err}");
        err
    };
    assert!(reason("absent.png").contains("cannot be read"));
    std::fs::write(dir.path().join("text.png"), "hello").unwrap();
    assert!(reason("text.png").contains("not a readable"));
    std::fs::File::create(dir.path().join("none.jpg"))
        .unwrap()
        .write_all(&[])
        .unwrap();
    assert!(reason("none.jpg").contains("not a readable"));
    image::GrayImage::new(16385, 1)
        .save(dir.path().join("wide.png"))
        .unwrap();
    assert!(reason("wide.png").contains("16385×1, too large"));
}

#[test]
fn previews_are_written_in_srgb_and_failures_leave_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("wall.png");
    let wall = Constant {
        color: [0.215_860_5, 0.0, 1.0],
    }
    .draw(4)
    .unwrap();
    preview::write_png(&wall, &path).unwrap();
    assert_eq!(
        image::open(&path).unwrap().to_rgb8().get_pixel(1, 2).0,
        [128, 0, 255]
    );
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
    let err = preview::write_png(&wall, &dir.path().join("no/such/wall.png")).unwrap_err();
    assert!(
        err.to_string().contains("wall.png: cannot be written"),
        "{err}"
    );
}
