//! What every chart holds, and how files are read and written.

mod closed_forms;

use super::*;
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
