//! Renders a chart of bars through a phone lens onto quad pixels and writes the left and the right view.
//!
//! `cargo run --release --example render_a_chart [FOLDER]`
//!
//! Expect `left.png` and `right.png`, 192 × 128 pixels, within seconds: the chart stands nearer than the focus, so its
//! bars are blurred and lie farther to the right in the left view.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use quadpixel::image::Image;
use quadpixel::image::raster::{Levels, write_png16};
use quadpixel::image::views::{Side, sum_of};
use quadpixel::lens::{FocusBy, Lens, Prescription};
use quadpixel::render::{Camera, RenderSettings, render};
use quadpixel::response::{GeometricResponse, Response};
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Scene, TexturedPlane};
use quadpixel::sensor::{Sensor, ShiftRule, Subpixels};
use quadpixel::spectrum::ChannelWavelengths;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    let subpixels = Subpixels::new(2, 2)?;
    let lens = Lens::new(&Prescription::builtin("wide_US20120327520A1_emb3")?)?.focused_at(
        1000.0,
        FocusBy::Sensor,
        550.0,
    )?;
    let pixel = Response::Geometric(GeometricResponse::new(subpixels, 2.8, 7.0)?);
    let sensor = Sensor::new(2.8, subpixels, (192, 128), DVec2::ZERO)?;
    let colours = ChannelWavelengths::default();
    let camera = Camera::new(&lens, sensor, ShiftRule::ChiefRay, &pixel, colours)?;

    let bars = Texture::from_fn(256, 256, |x, _| [if x / 8 % 2 == 0 { 0.9 } else { 0.1 }])?;
    let centre_mm = DVec3::new(0.0, 0.0, -400.0);
    let size_mm = (120.0, 120.0);
    let card = TexturedPlane::new(centre_mm, size_mm, (0.0, 0.0, 0.0), Arc::new(bars), None)?;
    let scene = Scene::new(vec![card], [0.0; 3]);
    let settings = RenderSettings {
        rays_per_pixel: 64,
        seed: 1,
    };
    let shot = render(&camera, &scene, &settings);

    let views: Vec<Image> = (0..subpixels.count()).map(|s| shot.image.view(s)).collect();
    let brightest = shot.image.sum().data().iter().fold(0f32, |a, &b| a.max(b));
    for (side, name) in [(Side::Left, "left.png"), (Side::Right, "right.png")] {
        let members = side.members(subpixels);
        let view = sum_of(members.into_iter().map(|s| &views[s]))
            .ok_or("a quad pixel has a left and a right half")?;
        write_png16(
            &folder.join(name),
            &view,
            Levels::full_range(0.5 * brightest),
        )?;
        println!("{}", folder.join(name).display());
    }
    println!(
        "{} rays, {} of them lost in the lens",
        shot.stats.rays,
        shot.stats.lost.total()
    );
    Ok(())
}
