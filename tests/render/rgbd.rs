//! Pictures with depth, scattered, against the renderer's own picture of the same cards.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use quadpixel::image::Image;
use quadpixel::render::truth::{DisparityField, SightRays, WhiteField, channel_shifts};
use quadpixel::render::{Camera, RenderSettings, SubPixelImage, render};
use quadpixel::rgbd::{Conversion, Converted, DepthPicture, RgbdError};
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Scene, TexturedPlane};

use crate::{geometric, shots};

const SIDE: usize = 72;
const FOCUS_MM: f64 = 600.0;

fn camera(side: usize) -> Camera {
    let lens = shots::focused(shots::PHONE, FOCUS_MM);
    let camera = shots::camera(&lens, &geometric(2, 2, 3.5), (side, side), DVec2::ZERO);
    camera.without_dispersion().unwrap()
}

fn convert(camera: &Camera, picture: &DepthPicture, tile: usize) -> Converted {
    let fields = DisparityField::of_channels(camera).unwrap();
    let sight = SightRays::centroids(&fields);
    let conversion = Conversion::new(camera, &sight, &fields, picture);
    conversion.tile(tile).run().unwrap()
}

fn trace(camera: &Camera, picture: &DepthPicture, rays_per_pixel: usize) -> Converted {
    let fields = DisparityField::of_channels(camera).unwrap();
    let sight = SightRays::centroids(&fields);
    let settings = RenderSettings {
        rays_per_pixel,
        seed: 5,
    };
    let conversion = Conversion::new(camera, &sight, &fields, picture);
    conversion.trace(&settings, &()).unwrap()
}

/// A texture of waves of 5 to 20 px, from 0.2 to 0.8; of another phase for another `kind`.
fn waves(x: f64, y: f64, kind: f64) -> [f32; 3] {
    [0.0, 1.0, 2.0].map(|c: f64| {
        let a = (0.9 * x + 0.35 * y + 1.3 * c + kind).sin();
        let b = (0.31 * x - 0.62 * y + 0.7 * c + 2.0 * kind).sin();
        (0.5 + 0.15 * a + 0.15 * b) as f32
    })
}

fn picture(side: usize, pixel: impl Fn(usize, usize) -> ([f32; 3], f32)) -> DepthPicture {
    let pixels: Vec<_> = (0..side * side)
        .map(|i| pixel(i % side, i / side))
        .collect();
    let light = pixels.iter().flat_map(|p| p.0).collect();
    let depth = pixels.iter().map(|p| p.1).collect();
    let light = Image::from_vec(side, side, 3, light).unwrap();
    DepthPicture::new(light, Image::from_vec(side, side, 1, depth).unwrap()).unwrap()
}

/// A card at `depth_mm` that covers the columns from `first` on, more than the window, with the waves of the window's
/// pixels.
fn card(camera: &Camera, depth_mm: f64, columns: std::ops::Range<i32>, kind: f64) -> TexturedPlane {
    let fields = DisparityField::of_channels(camera).unwrap();
    let at = |column: f64, row: f64| {
        let line = fields[0].sight_line(camera.sensor().position_mm(column, row));
        line.q0 * depth_mm + line.q1_mm
    };
    // Linear in the window, and so beyond.
    let last = (SIDE - 1) as f64;
    let (origin, along, down) = (
        at(0.0, 0.0),
        (at(last, 0.0) - at(0.0, 0.0)) / last,
        (at(0.0, last) - at(0.0, 0.0)) / last,
    );
    let rows = -32..SIDE as i32 + 32;
    let (width, height) = (columns.len(), rows.len());
    let texture = Texture::from_fn(width, height, |x, y| {
        waves(
            f64::from(columns.start) + x as f64,
            f64::from(rows.start) + y as f64,
            kind,
        )
    });
    let middle = |r: &std::ops::Range<i32>| 0.5 * f64::from(r.start + r.end - 1);
    let centre = origin + along * middle(&columns) + down * middle(&rows);
    let size = (along.length() * width as f64, down.length() * height as f64);
    let place = DVec3::new(centre.x, centre.y, -depth_mm);
    TexturedPlane::new(
        place,
        size,
        (0.0, 0.0, 0.0),
        Arc::new(texture.unwrap()),
        None,
    )
    .unwrap()
}

fn rendered(camera: &Camera, cards: Vec<TexturedPlane>) -> SubPixelImage {
    let settings = RenderSettings {
        rays_per_pixel: 4096,
        seed: 3,
    };
    render(camera, &Scene::new(cards, [0.0; 3]), &settings).image
}

/// Root mean square of the difference over the white of a sub-pixel, where `counts` says so.
fn rms(a: &Image, b: &Image, white: f32, counts: impl Fn(usize, usize) -> bool) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for y in 0..a.height() {
        for x in (0..a.width()).filter(|&x| counts(x, y)) {
            let pairs = a.pixel(x, y).iter().zip(b.pixel(x, y));
            sum += pairs
                .map(|(a, b)| f64::from((a - b) / white).powi(2))
                .sum::<f64>();
            count += a.channels();
        }
    }
    (sum / count as f64).sqrt()
}

fn decibels(rms: f64) -> f64 {
    -20.0 * rms.log10()
}

#[test]
fn a_flat_picture_is_what_the_renderer_makes_of_the_card() {
    let camera = camera(SIDE);
    for depth_mm in [600.0, 260.0, 3000.0] {
        let picture = picture(SIDE, |x, y| {
            (waves(x as f64, y as f64, 0.0), depth_mm as f32)
        });
        let image = rendered(
            &camera,
            vec![card(&camera, depth_mm, -32..SIDE as i32 + 32, 0.0)],
        );
        let white = WhiteField::new(&camera).middle_sr()[1] as f32 / 4.0;
        let levels = [
            ("psf", convert(&camera, &picture, 64)),
            ("rays", trace(&camera, &picture, 1024)),
        ];
        for (level, done) in levels {
            let known = |x: usize, y: usize| done.made_up.pixel(x, y)[0] < 1e-3;
            for s in 0..4 {
                let (a, b) = (done.image.view(s), image.view(s));
                let db = decibels(rms(&a, &b, white, known));
                println!("{level}, {depth_mm} mm, view {s}: {db:.1} dB");
                assert!(db > 45.0, "{level} {depth_mm} {s}: {db}");
            }
        }
    }
}

#[test]
fn a_nearer_card_hides_what_the_renderer_says_that_it_hides() {
    let camera = camera(SIDE);
    let (near_mm, far_mm, edge) = (400.0, 1500.0, SIDE / 2);
    let picture = picture(SIDE, |x, y| {
        let (depth, kind) = if x < edge {
            (near_mm, 0.0)
        } else {
            (far_mm, 1.0)
        };
        (waves(x as f64, y as f64, kind), depth as f32)
    });
    let near = card(&camera, near_mm, -32..edge as i32, 0.0);
    let far = card(&camera, far_mm, -32..SIDE as i32 + 32, 1.0);
    let image = rendered(&camera, vec![near, far]);
    let scattered = convert(&camera, &picture, 64);
    let traced = trace(&camera, &picture, 2048);
    for (level, done) in [("psf", &scattered), ("rays", &traced)] {
        against_cards(level, &camera, done, &image);
        // Half of the pupil sees the other surface at the edge, none far from it.
        let occlusion = |x: usize| done.occlusion.pixel(x, SIDE / 2)[0];
        let at_edge = occlusion(edge);
        assert!(at_edge > 0.2 && at_edge < 0.8, "{level}: {at_edge}");
        assert!(occlusion(16) < 1e-3 && occlusion(SIDE - 16) < 1e-3);
    }
    // Both see one scene, what is made up included; the same truths come with it.
    let white = WhiteField::new(&camera).middle_sr()[1] as f32 / 4.0;
    for s in 0..4 {
        let (a, b) = (scattered.image.view(s), traced.image.view(s));
        let db = decibels(rms(&a, &b, white, |_, _| true));
        println!("view {s}: psf against rays {db:.1} dB");
        assert!(db > 36.0, "{s}: {db}");
    }
    let apart = rms(&scattered.target, &traced.target, 4.0 * white, |_, _| true);
    assert!(apart < 1e-5, "target: {apart}");
    let apart = rms(&scattered.made_up, &traced.made_up, 1.0, |_, _| true);
    assert!(apart < 0.02, "made up: {apart}");
}

/// Two cards with their edge in the middle, against the renderer's.
fn against_cards(level: &str, camera: &Camera, done: &Converted, image: &SubPixelImage) {
    let white = WhiteField::new(camera).middle_sr()[1] as f32 / 4.0;
    let made_up = &done.made_up;
    for s in 0..4 {
        let (a, b) = (done.image.view(s), image.view(s));
        let inner = |y: usize| (16..SIDE - 16).contains(&y);
        let away = |x: usize, y: usize| inner(y) && made_up.pixel(x, y)[0] < 1e-3;
        let at_edge = |x: usize, y: usize| inner(y) && x.abs_diff(SIDE / 2) < 8;
        let known = |x: usize, y: usize| at_edge(x, y) && made_up.pixel(x, y)[0] < 0.05;
        let [away, known, edge] = [
            decibels(rms(&a, &b, white, away)),
            decibels(rms(&a, &b, white, known)),
            decibels(rms(&a, &b, white, at_edge)),
        ];
        println!(
            "{level}, view {s}: away {away:.1} dB, at the edge {edge:.1} dB, where it is known {known:.1} dB"
        );
        assert!(away > 50.0, "{level} {s}: {away} dB away");
        assert!(
            known > 42.0 && edge > 25.0,
            "{level} {s}: {known} {edge} dB"
        );
    }
}

#[test]
fn both_ways_show_one_sky_behind_a_card() {
    let camera = camera(SIDE);
    let picture = picture(SIDE, |x, y| {
        let is_card = (24..48).contains(&x) && (24..48).contains(&y);
        let depth = if is_card { 300.0 } else { f32::INFINITY };
        (
            waves(x as f64, y as f64, f64::from(u8::from(is_card))),
            depth,
        )
    });
    let (scattered, traced) = (
        convert(&camera, &picture, 64),
        trace(&camera, &picture, 256),
    );
    let white = WhiteField::new(&camera).middle_sr()[1] as f32 / 4.0;
    for s in 0..4 {
        let (a, b) = (scattered.image.view(s), traced.image.view(s));
        let db = decibels(rms(&a, &b, white, |_, _| true));
        println!("sky, view {s}: psf against rays {db:.1} dB");
        assert!(db > 36.0, "{s}: {db}");
    }
}

#[test]
fn white_stays_white_on_a_slant_and_no_tile_or_thread_changes_a_bit() {
    let side = 80;
    let camera = camera(side);
    let slant = |x: usize| 1.0 / (1.0 / 300.0 - x as f32 * (1.0 / 300.0 - 1.0 / 900.0) / 79.0);
    let white = picture(side, |x, _| ([1.0; 3], slant(x)));
    let done = convert(&camera, &white, 64);
    let expected = WhiteField::new(&camera).of_subpixels_sr(camera.sensor());
    for (s, expected) in expected.iter().enumerate() {
        let off = rms(
            &done.image.view(s),
            expected,
            expected.pixel(40, 40)[1],
            |_, _| true,
        );
        assert!(off < 2e-4, "{s}: {off}");
    }
    // A slant alone is one surface, of which nothing is made up.
    assert!(done.occlusion.pixel(40, 40)[0] < 1e-3);
    assert!(
        done.made_up.pixel(40, 40)[0] < 5e-3,
        "{}",
        done.made_up.pixel(40, 40)[0]
    );
    let coloured = picture(side, |x, y| (waves(x as f64, y as f64, 0.5), slant(x)));
    // With diffraction kernels have halos, which are spread by blocks.
    for camera in [camera.clone(), camera.with_lens_diffraction()] {
        let first = convert(&camera, &coloured, 64);
        for (tile, threads) in [(23, 1), (200, 3)] {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            let again = pool.install(|| convert(&camera, &coloured, tile));
            assert!(first.image == again.image && first.target == again.target);
            assert!(first.occlusion == again.occlusion && first.made_up == again.made_up);
        }
    }
}

/// Some rows of an image.
fn cut(image: &Image, rows: std::ops::Range<usize>) -> Image {
    let row = image.width() * image.channels();
    let data = image.data()[rows.start * row..rows.end * row].to_vec();
    Image::from_vec(image.width(), rows.len(), image.channels(), data).unwrap()
}

#[test]
fn rows_alone_are_the_rows_of_the_whole_picture_and_of_its_truths() {
    let side = 70;
    let lens = shots::focused(shots::PHONE, FOCUS_MM);
    let aside = DVec2::new(0.4, -0.3);
    let camera = shots::camera(&lens, &geometric(2, 2, 3.5), (side, side), aside);
    let camera = camera.with_lens_diffraction();
    // A card before a slanted wall with a hole: made-up places, edges, slants.
    let picture = picture(side, |x, y| {
        let depth = match (x, y) {
            (20..45, 25..50) => 350.0,
            (50..55, 10..14) => f32::NAN,
            _ => 800.0 + 4.0 * y as f32,
        };
        (waves(x as f64, y as f64, f64::from(depth == 350.0)), depth)
    });
    let fields = DisparityField::of_channels(&camera).unwrap();
    let sight = SightRays::centroids(&fields);
    let chief = SightRays::chief_rays(&camera);
    let white = WhiteField::from_fields(&camera, &fields);
    let conversion = Conversion::new(&camera, &sight, &fields, &picture);
    let (whole, spread) = (conversion.run().unwrap(), conversion.spread().unwrap());
    let truths = |camera: &Camera, depth_mm: Image| {
        let seen = sight.geometry_at(camera, depth_mm);
        let field = &fields[1];
        let maps = field.maps(camera, &seen.depth_mm);
        let mut all = [maps.traced, maps.paraxial].concat();
        all.push(chief.chief_to_sum_px(camera, field, &seen.depth_mm));
        all.extend(channel_shifts(camera, &fields, &seen.depth_mm).unwrap());
        all.extend(white.of_subpixels_sr(camera.sensor()));
        all.push(seen.distance_mm);
        all
    };
    let bits = |image: &Image| image.data().iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    let whole_truths = truths(&camera, picture.depth_mm().clone());
    for rows in [0..17, 17..18, 18..70] {
        let part = spread.rows(rows.clone());
        let mosaic = cut(&whole.image.mosaic, 2 * rows.start..2 * rows.end);
        assert!(part.image.mosaic == mosaic, "{rows:?}");
        for (a, b) in [
            (&part.target, &whole.target),
            (&part.occlusion, &whole.occlusion),
            (&part.made_up, &whole.made_up),
        ] {
            assert!(*a == cut(b, rows.clone()), "{rows:?}");
        }
        let own = truths(
            &camera.rows(rows.clone()),
            cut(picture.depth_mm(), rows.clone()),
        );
        for (a, b) in own.iter().zip(&whole_truths) {
            assert_eq!(bits(a), bits(&cut(b, rows.clone())), "{rows:?}");
        }
    }
}

#[test]
fn what_cannot_be_converted_is_refused() {
    let camera = camera(40);
    let fields = DisparityField::of_channels(&camera).unwrap();
    let sight = SightRays::centroids(&fields);
    let run = |picture: &DepthPicture| Conversion::new(&camera, &sight, &fields, picture).run();
    let near = picture(40, |_, _| ([0.5; 3], 20.0));
    assert!(matches!(run(&near), Err(RgbdError::Blur { .. })));
    let small = picture(30, |_, _| ([0.5; 3], 500.0));
    assert!(matches!(run(&small), Err(RgbdError::Window { .. })));
    let image =
        |value: f32, channels| Image::from_vec(2, 1, channels, vec![value; 2 * channels]).unwrap();
    let refused =
        |light: f32, depth: f32| DepthPicture::new(image(light, 3), image(depth, 1)).unwrap_err();
    assert!(matches!(refused(f32::NAN, 1.0), RgbdError::Light { .. }));
    assert!(matches!(refused(1.0, 0.0), RgbdError::Depth { .. }));
    assert!(matches!(refused(1.0, f32::NAN), RgbdError::NoDepth));
}
