//! What lookups and the pyramid must hold.
use super::*;

/// A raster without structure, from a fixed integer hash.
fn rough(width: usize, height: usize) -> Texture {
    Texture::from_fn(width, height, |x, y| {
        [0u32, 1, 2].map(|c| {
            let product = |a: u32, b: u32| a.wrapping_mul(b);
            let (x, y) = (product(x as u32, 73_856_093), product(y as u32, 19_349_663));
            let h = x ^ y ^ product(c, 83_492_791);
            (h.wrapping_mul(2_654_435_761) >> 8) as f32 / 16_777_216.0
        })
    })
    .unwrap()
}

#[test]
fn bilinear_reproduces_a_linear_ramp() {
    let (w, h) = (37, 21);
    let t = Texture::from_fn(w, h, |x, y| [2.0 + 0.5 * x as f32 - 0.0625 * y as f32]).unwrap();
    for k in 0..500 {
        // Points between the outermost centres.
        let x = 36.0 * ((k * 7919) % 500) as f32 / 500.0;
        let y = 20.0 * ((k * 104_729) % 500) as f32 / 500.0;
        let got = t.sample_channel((x + 0.5) / w as f32, (y + 0.5) / h as f32, 0);
        // f32 keeps the position to about 37 × 2⁻²³ texels.
        assert!(
            (got - (2.0 + 0.5 * x - 0.0625 * y)).abs() < 2e-5,
            "at {x}, {y}"
        );
    }
}

#[test]
fn texel_centres_give_texels_and_beyond_the_border_repeats() {
    let t = rough(16, 8); // powers of two: centres are exact in f32
    for y in 0..8 {
        for x in 0..16 {
            let (s, v) = ((x as f32 + 0.5) / 16.0, (y as f32 + 0.5) / 8.0);
            assert_eq!(t.sample_bilinear(s, v), t.texel(x, y));
        }
    }
    assert_eq!(t.sample_bilinear(-3.0, 0.0), t.texel(0, 0));
    assert_eq!(t.sample_bilinear(1.0, 1.0), t.texel(15, 7));
    assert_eq!(
        t.sample_bilinear(f32::INFINITY, f32::NEG_INFINITY),
        t.texel(15, 0)
    );
    assert_eq!(t.sample_bilinear(f32::NAN, 0.0), t.texel(0, 0));
}

#[test]
fn batches_equal_single_lookups() {
    let t = rough(33, 65);
    let s: Vec<f32> = (0..1000)
        .map(|k| (k * 37 % 1000) as f32 / 900.0 - 0.05)
        .collect();
    let v: Vec<f32> = (0..1000)
        .map(|k| (k * 91 % 1000) as f32 / 900.0 - 0.05)
        .collect();
    let mut out = [vec![0.0; 1000], vec![0.0; 1000], vec![0.0; 1000]];
    let [r, g, b] = &mut out;
    t.sample_batch(&s, &v, r, g, b);
    let mut one = vec![0.0; 1000];
    for (c, plane) in out.iter().enumerate() {
        t.sample_channel_batch(&s, &v, c, &mut one);
        assert_eq!(&one, plane);
        for k in 0..1000 {
            assert_eq!(plane[k], t.sample_bilinear(s[k], v[k])[c]);
            assert_eq!(plane[k], t.sample_channel(s[k], v[k], c));
        }
    }
}

#[test]
fn pyramid_preserves_the_mean_of_odd_sizes() {
    for (w, h) in [(1, 1), (64, 64), (37, 21), (5, 1), (129, 3)] {
        let t = rough(w, h);
        let mean = t.mean();
        for level in t.levels() {
            for (got, want) in level.mean().into_iter().zip(mean) {
                assert!((got - want).abs() < 1e-6, "{w}×{h}");
            }
        }
        for (got, want) in t.sample_footprint(0.3, 0.8, 1e9).into_iter().zip(mean) {
            assert!((f64::from(got) - want).abs() < 1e-6, "{w}×{h}");
        }
    }
}

#[test]
fn footprint_of_a_constant_is_the_constant_and_of_one_texel_bilinear() {
    let t = Texture::from_fn(100, 60, |_, _| [0.25, 0.5, 0.75]).unwrap();
    for footprint in [0.0, 1.0, 1.7, 5.0, 64.0, f32::INFINITY] {
        let got = t.sample_footprint(0.37, 0.91, footprint);
        for (got, want) in got.iter().zip([0.25, 0.5, 0.75]) {
            assert!((got - want).abs() < 1e-6);
        }
    }
    let t = rough(50, 50);
    assert_eq!(
        t.sample_footprint(0.2, 0.7, 1.0),
        t.sample_bilinear(0.2, 0.7)
    );
}

#[test]
fn bad_rasters_are_refused() {
    assert!(matches!(
        Texture::from_fn(0, 4, |_, _| [0.0]),
        Err(TextureError::Size { .. })
    ));
    assert!(Texture::from_fn(4, Texture::MAX_SIDE_PX + 1, |_, _| [0.0]).is_err());
    assert!(Texture::from_fn(4, 4, |_, _| [0.0, 0.0]).is_err());
    assert!(Texture::from_planes(2, 2, &[vec![0.0; 3]]).is_err());
    assert!(Texture::from_planes(2, 2, &[]).is_err());
    for bad in [f32::NAN, f32::INFINITY, -1e-6] {
        let err =
            Texture::from_fn(4, 4, |x, y| [if (x, y) == (2, 1) { bad } else { 0.5 }]).unwrap_err();
        assert!(err.to_string().contains("column 2, row 1"), "{err}");
    }
}
