use glam::DVec2;
use quadpixel::render::RenderSettings;
use quadpixel::render::truth::{DisparityField, SightRays, WhiteField, channel_shifts};

use super::shots::{self, boxes, shoot};
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

/// Lines of sight are bilinear between nodes 16 px apart, and err there by more than the shift does: the chief ray's
/// err alike. A window moved by half a cell has a node where the first has none.
#[test]
fn the_shift_from_the_chief_ray_does_not_know_where_the_nodes_are() {
    const SIDE: usize = 256;
    for case in &CASES[..2] {
        let lens = case.focused();
        let response = boxes(2, 2, case.pitch_um, 2.5 * case.pitch_um);
        let first = case.camera(&lens, &response, 1, SIDE);
        let moved = first.sensor().position_mm(135.5, 135.5);
        let moved = shots::camera(&lens, &response, (SIDE, SIDE), moved);
        for depth_mm in depths_mm(&first, 4.0) {
            let depth = vec![depth_mm as f32; SIDE * SIDE];
            let depth = quadpixel::image::Image::from_vec(SIDE, SIDE, 1, depth).unwrap();
            let [between, at_node] = [(&first, 136), (&moved, 128)].map(|(camera, at)| {
                let field = DisparityField::new(camera, 1).unwrap();
                let chief = SightRays::chief_rays(camera);
                let shifts = chief.chief_to_sum_px(camera, &field, &depth);
                let place = camera.sensor().position_mm(at as f64, at as f64);
                let step = DVec2::X * camera.sensor().pitch_mm();
                let seen = |xy_mm: DVec2| {
                    let line = field.sight_line(xy_mm);
                    line.q0 * depth_mm + line.q1_mm
                };
                let shift = DVec2::from([0, 1].map(|k| f64::from(shifts.pixel(at, at)[k])));
                (shift, seen(place), seen(place + step).distance(seen(place)))
            });
            let apart = between.0.distance(at_node.0);
            let of_lines = between.1.distance(at_node.1) / at_node.2;
            println!(
                "{} {depth_mm:.0} mm: {apart:.5} px, lines {of_lines:.5}",
                case.lens
            );
            assert!(apart < 6e-4, "{} {depth_mm:.0}: {apart}", case.lens);
            assert!(apart < 0.5 * of_lines, "{apart} {of_lines}");
        }
    }
}
