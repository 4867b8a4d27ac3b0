//! Pictures for surfaces, drawn from a seed: charts of [`crate::charts`], and wood, stone, cloth, tiles and stripes.
//!
//! Patterns are sums of value noise (a hashed lattice with smooth interpolation) that repeats with the picture, so that
//! it can be laid side by side.

use quadpixel::scene::texture::{Texture, TextureError};
use quadpixel::scene::world::{Encoding, TextureMap, Wrap};

use crate::charts::{ChartError, keyed::Key, random_spec};

/// Side of a picture, texels.
const SIDE: usize = 512;

/// Kinds of picture.
pub(super) const KINDS: [&str; 9] = [
    "dead-leaves",
    "alphabet",
    "noise",
    "resolution",
    "wood",
    "stone",
    "cloth",
    "tiles",
    "stripes",
];

/// A picture of a kind.
pub(super) fn picture(kind: &str, key: Key) -> Result<TextureMap, ChartError> {
    let seed = (key.uniform(0) * (1u64 << 53) as f64) as u64;
    let texture = match kind {
        "wood" => wood(key)?,
        "stone" => stone(key)?,
        "cloth" => cloth(key)?,
        "tiles" => tiles(key)?,
        "stripes" => stripes(key)?,
        chart => random_spec(chart, seed)?.generate(seed, SIDE)?,
    };
    // A chart drawn once has borders of its own; its mirror image fits on each side.
    let wrap = [Wrap::Mirror; 2];
    Ok(TextureMap::from_texture(&texture, wrap))
}

/// The outline of a lacy leaf as an alpha mask: holes of many sizes.
pub(super) fn lace(key: Key) -> Result<TextureMap, TextureError> {
    let n = SIDE / 2;
    let at = |i: usize| {
        let (x, y) = (i % n, i / n);
        let (u, v) = (x as f64 / n as f64, y as f64 / n as f64);
        let hole = noise(key, u, v, 8) + 0.5 * noise(key.with(1), u, v, 19) > 0.78;
        let green = (90.0 + 90.0 * noise(key.with(2), u, v, 6)) as u8;
        [green / 2, green, green / 4, if hole { 0 } else { 255 }]
    };
    let texels = (0..n * n).map(at).collect();
    TextureMap::from_rgba8((n, n), texels, Encoding::Srgb, [Wrap::Repeat; 2])
}

/// A reflectance that is not too dark nor too white, of any hue.
pub(super) fn colour(key: Key) -> [f32; 3] {
    let (hue, grey) = (6.0 * key.uniform(0), key.range(1, 0.08, 0.75));
    let saturation = key.uniform(2).sqrt();
    [5.0, 3.0, 1.0].map(|shift| {
        let k: f64 = (hue + shift) % 6.0;
        let full = 1.0 - k.min(4.0 - k).clamp(0.0, 1.0);
        (grey * (1.0 - saturation * (1.0 - full) * 0.9)) as f32
    })
}

fn mix(a: [f32; 3], b: [f32; 3], t: f64) -> [f32; 3] {
    let t = t.clamp(0.0, 1.0) as f32;
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t)
}

/// Value noise in 0..1 with `cells` lattice cells per side, periodic.
fn noise(key: Key, u: f64, v: f64, cells: u64) -> f64 {
    let (x, y) = (u * cells as f64, v * cells as f64);
    let (i, j) = (x.floor(), y.floor());
    let smooth = |f: f64| f * f * (3.0 - 2.0 * f);
    let (fx, fy) = (smooth(x - i), smooth(y - j));
    let at = |di: u64, dj: u64| {
        let (i, j) = (
            (i as i64).rem_euclid(cells as i64) as u64,
            (j as i64).rem_euclid(cells as i64) as u64,
        );
        key.with((i + di) % cells).uniform((j + dj) % cells)
    };
    let row = |dj: u64| at(0, dj) + fx * (at(1, dj) - at(0, dj));
    let (a, b) = (row(0), row(1));
    a + fy * (b - a)
}

/// Octaves of noise, mean ½.
fn clouds(key: Key, u: f64, v: f64, cells: u64) -> f64 {
    (0..5).fold(0.0, |sum, k| {
        let weight = 0.5f64.powi(k + 1) / (1.0 - 0.5f64.powi(5));
        sum + weight * noise(key.with(k as u64), u, v, cells << k)
    })
}

fn draw(f: impl Fn(f64, f64) -> [f32; 3] + Sync) -> Result<Texture, TextureError> {
    Texture::from_fn(SIDE, SIDE, |x, y| {
        f(
            (x as f64 + 0.5) / SIDE as f64,
            (y as f64 + 0.5) / SIDE as f64,
        )
    })
}

/// Growth rings cut lengthwise, with fibres.
fn wood(key: Key) -> Result<Texture, TextureError> {
    let tone = key.range(3, 0.4, 1.0) as f32;
    let (dark, light) = ([0.18, 0.075, 0.03], [0.55, 0.31, 0.14]);
    let rings = key.range(4, 6.0, 18.0).round();
    draw(|u, v| {
        let bent = v + 0.12 * clouds(key, u, v, 3);
        let ring = (std::f64::consts::TAU * rings * bent).sin() * 0.5 + 0.5;
        let fibre = noise(key.with(9), u * 0.06, v, 160);
        mix(
            dark,
            light,
            0.25 + 0.55 * ring.powi(2) + 0.35 * (fibre - 0.5),
        )
        .map(|c| c * tone)
    })
}

/// Speckled rock with veins.
fn stone(key: Key) -> Result<Texture, TextureError> {
    let (a, b) = (colour(key.with(1)), colour(key.with(2)));
    draw(|u, v| {
        let turbulence = clouds(key, u, v, 4);
        let vein = (std::f64::consts::TAU * (2.0 * u + 3.0 * turbulence))
            .sin()
            .abs();
        let grain = noise(key.with(7), u, v, 190);
        mix(a, b, vein.powf(0.4)).map(|c| c * (0.75 + 0.5 * grain as f32))
    })
    .and_then(clamped)
}

/// A plain weave of two yarns.
fn cloth(key: Key) -> Result<Texture, TextureError> {
    let (warp, weft) = (colour(key.with(1)), colour(key.with(2)));
    let yarns = 8.0 * key.range(3, 5.0, 12.0).round();
    draw(|u, v| {
        let (x, y) = (u * yarns, v * yarns);
        let over = (x.floor() + y.floor()) % 2.0 == 0.0;
        let across = if over { x.fract() } else { y.fract() };
        let shade = 0.45 + 0.55 * (std::f64::consts::PI * across).sin();
        let fuzz = 0.85 + 0.3 * noise(key.with(5), u, v, 230);
        let yarn = if over { warp } else { weft };
        yarn.map(|c| c * (shade * fuzz) as f32)
    })
    .and_then(clamped)
}

/// Square tiles with joints, each a little different.
fn tiles(key: Key) -> Result<Texture, TextureError> {
    let (a, b) = (colour(key.with(1)), colour(key.with(2)));
    let count = key.range(3, 4.0, 10.0).round();
    draw(|u, v| {
        let (x, y) = (u * count, v * count);
        let edge = |f: f64| f.fract().min(1.0 - f.fract());
        if edge(x).min(edge(y)) < 0.03 {
            return [0.3, 0.29, 0.27];
        }
        let tint = key.with(11).with(x as u64).uniform(y as u64);
        let even = (x.floor() + y.floor()) % 2.0 == 0.0;
        let base = if even { a } else { b };
        let marks = 0.8 + 0.3 * tint + 0.2 * (clouds(key.with(6), u, v, 16) - 0.5);
        base.map(|c| c * marks as f32)
    })
    .and_then(clamped)
}

/// Stripes of uneven width.
fn stripes(key: Key) -> Result<Texture, TextureError> {
    let count = key.range(3, 10.0, 40.0) as u64;
    draw(|u, v| {
        let x = u + 0.02 * (clouds(key, u, v, 6) - 0.5);
        let k = (x * count as f64).floor().max(0.0) as u64 % count;
        let grain = 0.8 + 0.4 * noise(key.with(4), u, v, 120);
        colour(key.with(20 + k)).map(|c| c * grain as f32)
    })
    .and_then(clamped)
}

/// Reflectances above 0.9 are cut to it: nothing real is whiter than that.
fn clamped(texture: Texture) -> Result<Texture, TextureError> {
    Texture::from_fn(texture.width(), texture.height(), |x, y| {
        texture.texel(x, y).map(|c| c.min(0.9))
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn every_picture_is_a_reflectance_with_detail() {
        for kind in KINDS {
            let map = picture(kind, Key::new(5, kind)).unwrap();
            let mean = map.mean();
            let values: Vec<f32> = (0..400)
                .map(|k| map.sample([(k % 20) as f32 / 20.0, (k / 20) as f32 / 20.0], 0.0)[1])
                .collect();
            assert!(values.iter().all(|v| (0.0..=1.0).contains(v)), "{kind}");
            let spread = values.iter().map(|v| (v - mean[1]).abs()).sum::<f32>() / 400.0;
            assert!(spread > 0.01, "{kind}: {spread}");
        }
    }

    #[test]
    fn colours_are_reflectances_of_real_paints() {
        for k in 0..500 {
            let c = colour(Key::new(k, "paint"));
            assert!(c.iter().all(|v| (0.0..=0.8).contains(v)), "{c:?}");
        }
    }
}
