//! Pictures with depth, converted by each way: the error against rays through the same surfaces and against the world
//! that the picture is of, the disparity that matching finds, and the time.
//!
//! ```text
//! cargo bench --bench convert -- 256 192 2048        # columns, rows, rays per pixel
//! ```
//!
//! The world is of meshes; its picture and depth are exported as of every sample (the all-in-focus target, and the
//! depth of the rays of sight). See `world.rs`, and `peers.rs` for the methods of others.
#![allow(clippy::unwrap_used)] // because a bench on built-in data fails by panicking

mod matching;
mod peers;
mod regions;
mod world;

use std::time::Instant;

use glam::DVec2;
use quadpixel::image::Image;
use quadpixel::lens::{FocusBy, Lens, Prescription};
use quadpixel::render::truth::{DisparityField, SightRays, WhiteField};
use quadpixel::render::{Camera, RenderSettings, SubPixelImage, render};
use quadpixel::response::{GeometricResponse, Response};
use quadpixel::rgbd::{Conversion, DepthPicture};
use quadpixel::scene::Scene;
use quadpixel::sensor::{Sensor, ShiftRule, Subpixels};
use quadpixel::spectrum::ChannelWavelengths;
use regions::Regions;

const LENS: &str = "wide_US20120327520A1_emb3";
const FOCUS_MM: f64 = 600.0;

/// A camera and what its pixels see.
struct Shot {
    camera: Camera,
    fields: Vec<DisparityField>,
    sight: SightRays,
    white: WhiteField,
}

impl Shot {
    /// 2 × 2 ideal pixels of 2 µm behind a phone's lens.
    fn new(size: (usize, usize)) -> Self {
        let lens = Lens::new(&Prescription::builtin(LENS).unwrap()).unwrap();
        let lens = lens.focused_at(FOCUS_MM, FocusBy::Sensor, 550.0).unwrap();
        let pixel = GeometricResponse::new(Subpixels::new(2, 2).unwrap(), 2.0, 3.5).unwrap();
        let sensor = Sensor::new(2.0, pixel.subpixels(), size, DVec2::ZERO).unwrap();
        let bands = ChannelWavelengths::default();
        let response = Response::Geometric(pixel);
        let camera = Camera::new(&lens, sensor, ShiftRule::ChiefRay, &response, bands).unwrap();
        let camera = camera.without_dispersion().unwrap();
        let fields = DisparityField::of_channels(&camera).unwrap();
        Self {
            sight: SightRays::centroids(&fields),
            white: WhiteField::from_fields(&camera, &fields),
            camera,
            fields,
        }
    }

    /// What a sample of the scene is exported with: the target as radiance, and the depth.
    fn exported(&self, scene: &Scene) -> DepthPicture {
        let few = RenderSettings {
            rays_per_pixel: 16,
            seed: 1,
        };
        let mut light = (self.sight).target(&self.camera, scene, &self.white, &few);
        let sensor = self.camera.sensor();
        for y in 0..light.height() {
            for x in 0..light.width() {
                let white = self.white.sum_sr(sensor.position_mm(x as f64, y as f64));
                let pixel = light.pixel_mut(x, y).iter_mut().zip(white);
                pixel.for_each(|(p, w)| *p /= w as f32);
            }
        }
        let depth = self.sight.geometry(&self.camera, scene).depth_mm;
        DepthPicture::new(light, depth).unwrap()
    }
}

/// A way, what it made, and how long that took.
struct Made {
    name: &'static str,
    image: SubPixelImage,
    seconds: f64,
}

fn timed(name: &'static str, work: impl FnOnce() -> SubPixelImage) -> Made {
    let began = Instant::now();
    let image = work();
    Made {
        name,
        image,
        seconds: began.elapsed().as_secs_f64(),
    }
}

fn main() {
    let numbers: Vec<usize> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let [width, height, rays] = numbers[..].try_into().unwrap_or([256, 192, 512]);
    let shot = Shot::new((width, height));
    let settings = |seed| RenderSettings {
        rays_per_pixel: rays,
        seed,
    };
    let scene = world::scene(&shot.fields[0], shot.camera.sensor());
    let picture = shot.exported(&scene);
    let conversion = Conversion::new(&shot.camera, &shot.sight, &shot.fields, &picture);
    let began = Instant::now();
    let traced = conversion.trace(&settings(2), &()).unwrap();
    let rays_made = Made {
        name: "rays",
        seconds: began.elapsed().as_secs_f64(),
        image: traced.image.clone(),
    };
    let again = conversion.trace(&settings(5), &()).unwrap().image;
    let truth = timed("the world", || {
        render(&shot.camera, &scene, &settings(3)).image
    });
    let psf = timed("psf", || conversion.run().unwrap().image);
    let peers = peers::Peers::new(&shot.camera, &shot.sight, &shot.fields, &picture);
    let ways = [
        psf,
        timed("gather, kernel of each pixel", || peers.gather()),
        timed("layers, added", || peers.added_layers()),
        timed("layers of quarter disks, blended", || peers.disk_layers()),
    ];
    let regions = Regions::new(&shot.camera, &picture, &traced.made_up);
    println!("{width} × {height}, {rays} rays per pixel; {regions}");
    let white = shot.white.middle_sr()[1] as f32 / 4.0;
    println!("| way | against | away, dB | edges, known, dB | edges, all, dB | energy − 1 | s |");
    println!("|---|---|---|---|---|---|---|");
    let row = |way: &Made, other: &Made| {
        let [away, known, edge] = regions.rms(&way.image, &other.image, white);
        let energy = regions.energy(&way.image, &other.image) - 1.0;
        let [away, known, edge] = [away, known, edge].map(|rms: f64| -20.0 * rms.log10());
        println!(
            "| {} | {} | {away:.1} | {known:.1} | {edge:.1} | {energy:+.5} | {:.2} |",
            way.name, other.name, way.seconds
        );
    };
    let again = Made {
        name: "rays again, of another seed",
        image: again,
        seconds: rays_made.seconds,
    };
    row(&again, &rays_made);
    ways.iter().for_each(|way| row(way, &rays_made));
    row(&rays_made, &truth);
    ways.iter().for_each(|way| row(way, &truth));
    let all = ways.iter().chain([&rays_made, &truth]);
    let all: Vec<(&str, &SubPixelImage)> = all.map(|way| (way.name, &way.image)).collect();
    matching::report(&shot.fields[0], &shot.camera, &picture, &regions, &all);
}

/// Green light of the left or the right half of the pixels.
fn half(image: &SubPixelImage, is_right: bool) -> Image {
    let views = [0, 2].map(|s| image.view(s + usize::from(is_right)));
    let (width, height) = (views[0].width(), views[0].height());
    let pairs = views[0]
        .data()
        .chunks_exact(3)
        .zip(views[1].data().chunks_exact(3));
    let data = pairs.map(|(a, b)| a[1] + b[1]).collect();
    Image::from_vec(width, height, 1, data).unwrap()
}
