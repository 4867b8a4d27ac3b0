//! The F/4 views that the camera would take of a plane whose picture is known, by the renderer or by a plain kernel.

use std::error::Error;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use quadpixel::field::FieldGrid;
use quadpixel::image::Image;
use quadpixel::lens::{chief_ray, trace_backward};
use quadpixel::render::truth::{ReceptiveField, WhiteField};
use quadpixel::render::{Camera, RenderSettings, render};
use quadpixel::scene::Scene;
use quadpixel::scene::TexturedPlane;
use quadpixel::scene::texture::Texture;
use quadpixel::simd::SimdLevel;
use quadpixel_algorithms::warp::{Border, Lobes, Map, warp};
use rayon::prelude::*;

use crate::data::Views;
use crate::measure::GREEN;

/// Texels a picture's pixel: so that the texture's own interpolation does not blur.
const OVERSAMPLING: usize = 2;
/// Rays of the sums over the pupil for the views' shading, and nodes of its grid.
const SHADING_RAYS: usize = 256;
const SHADING_NODES: (usize, usize) = (13, 9);
const RAYS_PER_PIXEL: usize = 128;

/// The renderer's views of a plane `distance_mm` from the sensor that shows `picture`, as taken by `sharp`, a camera
/// that sees it sharp. Their shading is taken out by that of a white wall, as the converter does.
pub fn rendered(
    camera: &Camera,
    sharp: &Camera,
    picture: &Image,
    distance_mm: f64,
) -> Result<Views, Box<dyn Error>> {
    let depth_mm = distance_mm - camera.sensor_z_mm();
    let plane = plane_of(sharp, picture, depth_mm)?;
    let scene = Scene::new(vec![plane], [0.0; 3]);
    let settings = RenderSettings {
        rays_per_pixel: RAYS_PER_PIXEL,
        seed: 1,
    };
    let shot = render(camera, &scene, &settings);
    let white = WhiteField::new(camera);
    let shares = shares(camera);
    let mut views = [shot.image.view(0), shot.image.view(1)];
    for (side, view) in views.iter_mut().enumerate() {
        for y in 0..view.height() {
            for x in 0..view.width() {
                let at = camera.sensor().position_mm(x as f64, y as f64);
                let mut share = [0.0; 2];
                shares.sample(at, &mut share);
                let sum = white.sum_sr(at);
                for (v, sum) in view.pixel_mut(x, y).iter_mut().zip(sum) {
                    *v /= (sum * share[side]) as f32;
                }
            }
        }
    }
    let [left, right] = views;
    Ok(Views { left, right })
}

/// Part of the light that each view gets from a white wall, over the sensor.
fn shares(camera: &Camera) -> FieldGrid {
    let window = camera.sensor().window_mm();
    let (nx, ny) = SHADING_NODES;
    let mut data = Vec::with_capacity(2 * nx * ny);
    for k in 0..nx * ny {
        let at = FieldGrid::node_mm(window, SHADING_NODES, (k % nx, k / nx));
        let mut sums = [0.0; 2];
        if let Some(field) = ReceptiveField::new(camera, GREEN, at, SHADING_RAYS) {
            for k in 0..field.offsets_px(1e3).len() {
                let w = field.weights(k);
                sums[0] += w[0];
                sums[1] += w[1];
            }
        }
        let all = sums[0] + sums[1];
        data.extend(sums.map(|s| if all > 0.0 { s / all } else { 0.5 }));
    }
    FieldGrid::new(window, SHADING_NODES, 2, data)
        .unwrap_or_else(|| unreachable!("two values a node"))
}

/// The plane that `camera` sees as `picture` by its chief rays.
fn plane_of(
    camera: &Camera,
    picture: &Image,
    depth_mm: f64,
) -> Result<TexturedPlane, Box<dyn Error>> {
    let heights = heights_on_plane(camera, depth_mm)?;
    let window = camera.sensor().window_mm();
    // Half the plane: what the sensor's corner sees, and a margin for blur.
    let corner = camera.sensor().farthest_corner_mm();
    let magnified = interpolated(&heights, 0, corner) / corner;
    let half = 1.04 * magnified * DVec2::new(window.half_width, window.half_height);
    let (width, height) = (
        OVERSAMPLING * picture.width(),
        OVERSAMPLING * picture.height(),
    );
    let pitch = camera.sensor().pitch_mm();
    let middle = 0.5 * DVec2::new(picture.width() as f64 - 1.0, picture.height() as f64 - 1.0);
    let map = Map::from_fn(width, height, |x, y| {
        // From the middle of the plane, right and down as seen; the picture is upright and not mirrored.
        let part = |i: usize, n: usize| (2 * i + 1) as f64 / n as f64 - 1.0;
        let at = DVec2::new(part(x, width), part(y, height)) * half;
        let radius = at.length();
        let px = middle + at / radius * interpolated(&heights, 1, radius) / pitch;
        (px.x, px.y)
    })?;
    let texels = warp(
        picture,
        &map,
        Lobes::Three,
        Border::Replicate,
        SimdLevel::detect(),
    )
    .image;
    let texture = Texture::from_fn(width, height, |x, y| {
        let p = texels.pixel(x, y);
        [p[0].max(0.0), p[1].max(0.0), p[2].max(0.0)]
    })?;
    TexturedPlane::new(
        DVec3::new(0.0, 0.0, -depth_mm),
        (2.0 * half.x, 2.0 * half.y),
        (0.0, 0.0, 0.0),
        Arc::new(texture),
        None,
    )
    .map_err(Into::into)
}

/// (height on the sensor, height on the plane) of chief rays, mm, out to beyond the sensor's corner.
fn heights_on_plane(camera: &Camera, depth_mm: f64) -> Result<Vec<[f64; 2]>, Box<dyn Error>> {
    const STEPS: usize = 48;
    let system = camera.system(GREEN);
    let most = 1.08 * camera.sensor().farthest_corner_mm();
    let at = |i: usize| {
        let r = most * i as f64 / STEPS as f64;
        let ray = chief_ray(system, r, 0.0).ok()?;
        let ray = trace_backward(system, ray).ok()?;
        let way = (-depth_mm - ray.origin_mm.z) / ray.direction.z;
        Some([r, (ray.origin_mm + way * ray.direction).truncate().length()])
    };
    (0..=STEPS)
        .map(at)
        .collect::<Option<Vec<_>>>()
        .ok_or("the chief rays do not fill the sensor".into())
}

/// Column 1 − `from` at a value of column `from`, linear between the rows.
fn interpolated(rows: &[[f64; 2]], from: usize, value: f64) -> f64 {
    let k = rows
        .partition_point(|r| r[from] < value)
        .clamp(1, rows.len() - 1);
    let (a, b) = (rows[k - 1], rows[k]);
    let t = (value - a[from]) / (b[from] - a[from]);
    a[1 - from] + t * (b[1 - from] - a[1 - from])
}

/// The views by half disks of the right circle of confusion, everywhere the same: `diameter_px` negative in front of
/// the focus.
pub fn half_disks(picture: &Image, diameter_px: f64) -> Views {
    let side = |sign: f64| convolved(picture, &half_disk(diameter_px, sign));
    // Of a point nearer than the focus the left view shows the right half of the blur.
    let right_half = -diameter_px.signum();
    Views {
        left: side(right_half),
        right: side(-right_half),
    }
}

/// Weights of the shifts (x, y) of a point in a view: the half of a disk with x · `sign` > 0, area-sampled.
fn half_disk(diameter_px: f64, sign: f64) -> Vec<(i64, i64, f32)> {
    const FINE: i64 = 16;
    let radius = 0.5 * diameter_px.abs();
    let reach = radius.ceil() as i64 + 1;
    let mut kernel = Vec::new();
    for y in -reach..=reach {
        for x in -reach..=reach {
            let places = (0..FINE * FINE).filter(|k| {
                let part = |i: i64| (i as f64 + 0.5) / FINE as f64 - 0.5;
                let (px, py) = (x as f64 + part(k % FINE), y as f64 + part(k / FINE));
                px * sign > 0.0 && px * px + py * py < radius * radius
            });
            let count = places.count();
            if count > 0 {
                kernel.push((x, y, count as f32));
            }
        }
    }
    let all: f32 = kernel.iter().map(|k| k.2).sum();
    kernel.iter_mut().for_each(|k| k.2 /= all);
    kernel
}

/// A picture whose points are each spread by `kernel`; beyond the border the border's value.
fn convolved(picture: &Image, kernel: &[(i64, i64, f32)]) -> Image {
    let (width, height) = (picture.width(), picture.height());
    let mut out = Image::zeros(width, height, 3);
    let rows = out.data_mut().par_chunks_mut(3 * width).enumerate();
    rows.for_each(|(y, row)| {
        for (x, pixel) in row.chunks_exact_mut(3).enumerate() {
            for &(dx, dy, w) in kernel {
                let at =
                    |p: usize, d: i64, n: usize| (p as i64 - d).clamp(0, n as i64 - 1) as usize;
                let from = picture.pixel(at(x, dx, width), at(y, dy, height));
                for (to, v) in pixel.iter_mut().zip(from) {
                    *to += w * v;
                }
            }
        }
    });
    out
}
