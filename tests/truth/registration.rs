use glam::DVec2;
use quadpixel::render::RenderSettings;
use quadpixel::render::truth::{DisparityField, SightRays, WhiteField, channel_shifts};

use super::shots::{boxes, shoot};
use super::{CASES, centroid, depths_mm, spot};

const SIDE: usize = 40;

#[test]
fn the_target_by_the_centroid_stands_where_the_sum_stands_and_the_shift_map_tells_that_of_the_chief_ray()
 {
    for case in &CASES {
        let lens = case.focused();
        let response = boxes(2, 2, case.pitch_um, 2.5 * case.pitch_um);
        for field in 0..3 {
            let camera = case.camera(&lens, &response, field, SIDE);
            let fields = DisparityField::of_channels(&camera).unwrap();
            let white = WhiteField::new(&camera);
            let settings = RenderSettings {
                rays_per_pixel: 1024,
                seed: 5,
            };
            for depth_mm in depths_mm(&camera, 4.0) {
                let scene = spot(&camera, depth_mm, 12.0);
                let sum = shoot(&camera, &scene, settings.rays_per_pixel, settings.seed)
                    .image
                    .sum();
                let place = |k: usize| centroid(&sum, k);
                let by_centroid = SightRays::centroids(&fields);
                let target = by_centroid.target(&camera, &scene, &white, &settings);
                for channel in 0..3 {
                    let apart = centroid(&target, channel).distance(place(channel));
                    assert!(
                        apart <= 0.02,
                        "{} {field} {depth_mm:.0}: {apart}",
                        case.lens
                    );
                }
                // By chief rays it stands elsewhere, and the maps say where.
                let chief = SightRays::chief_rays(&camera);
                let target = chief.target(&camera, &scene, &white, &settings);
                let depth = quadpixel::image::Image::from_vec(
                    SIDE,
                    SIDE,
                    1,
                    vec![depth_mm as f32; SIDE * SIDE],
                );
                let depth = depth.unwrap();
                let green = &fields[1.min(fields.len() - 1)];
                let shift = chief.chief_to_sum_px(&camera, green, &depth);
                let at = |image: &quadpixel::image::Image, p: DVec2, k: usize| {
                    let values = image.pixel(p.x.round() as usize, p.y.round() as usize);
                    DVec2::new(f64::from(values[k]), f64::from(values[k + 1]))
                };
                let seen = centroid(&target, 1);
                let told = seen + at(&shift, seen, 0);
                let apart = told.distance(place(1));
                assert!(
                    apart <= 0.02,
                    "{} {field} {depth_mm:.0}: {apart}",
                    case.lens
                );
                // Lateral colour of the sums.
                let Some(colours) = channel_shifts(&camera, &fields, &depth) else {
                    continue;
                };
                for (channel, k) in [(0, 0), (2, 2)] {
                    let lateral = at(colours.last().unwrap(), place(1), k);
                    let measured = place(channel) - place(1);
                    let apart = measured.distance(lateral);
                    assert!(apart <= 0.02, "{} {field}: lateral {apart}", case.lens);
                }
            }
        }
    }
}
