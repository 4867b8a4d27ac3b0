//! Focus by real rays: sharp where it is set, blurred elsewhere by the paraxial circle of confusion.

use quadpixel::lens::Field;
use quadpixel::lens::rms_radius;
use quadpixel::lens::{FocusBy, Lens, Prescription, builtin_names};
use quadpixel::units::D_LINE_NM;

fn lens(name: &str) -> Lens {
    Lens::new(&Prescription::builtin(name).unwrap()).unwrap()
}

/// RMS spot on the axis, µm.
fn rms_um(lens: &Lens) -> f64 {
    let spot = lens.spot(Field::up(0.0), D_LINE_NM).unwrap();
    rms_radius(&spot.points_mm).unwrap() * 1e3
}

#[test]
fn focusing_takes_away_the_blur_that_the_paraxial_defocus_leaves() {
    // Unfocused, the image of an object at distance s lies about f²/s behind the sensor: RMS blur f²/s / (2 N √2). What
    // stays once focused is the lens's own spot, which changes a little with distance.
    for name in builtin_names() {
        let far = lens(name);
        let p = far.paraxial(D_LINE_NM).unwrap();
        let distance = 200.0 * p.efl_mm;
        let blur_um = 1e3 * p.efl_mm / 200.0 / (2.0 * p.f_number * 2f64.sqrt());
        for by in [FocusBy::Sensor, FocusBy::Lens] {
            let near = far.focused_at(distance, by, D_LINE_NM).unwrap();
            let change = (rms_um(&near) - rms_um(&far)).abs();
            assert!(change < 0.03 * blur_um, "{name}: {change} of {blur_um} µm");
        }
    }
}

#[test]
fn sensor_out_of_focus_sees_the_disk_that_the_pupil_throws_on_it() {
    // Radius of the disk: defocus × exit pupil's radius / its distance; RMS of a uniform disk: radius / √2. The object
    // stays at infinity, the sensor moves to where 500 mm would be in focus.
    let far = lens("tele_US10571665B2_220b");
    let near = far.focused_at(500.0, FocusBy::Sensor, D_LINE_NM).unwrap();
    let p = far.paraxial(D_LINE_NM).unwrap();
    let defocus_mm = near.sensor_z_mm() - far.sensor_z_mm();
    let radius_um =
        1e3 * defocus_mm * p.exit_pupil_semi_mm / (far.sensor_z_mm() - p.exit_pupil_z_mm);

    let mut system = far.at(D_LINE_NM).unwrap();
    system.sensor_z_mm = near.sensor_z_mm();
    let aim = quadpixel::lens::Aim::new(&system, &p, Field::up(0.0), f64::INFINITY).unwrap();
    let points: Vec<_> = quadpixel::lens::pupil_grid()
        .into_iter()
        .map(|unit| quadpixel::lens::trace_forward(&system, aim.ray_at(unit).unwrap()).unwrap())
        .map(|ray| ray.origin_mm.truncate())
        .collect();
    let found = rms_radius(&points).unwrap() * 1e3;
    let expected = radius_um / 2f64.sqrt();
    assert!(
        (found / expected - 1.0).abs() < 0.02,
        "{found} against {expected} µm"
    );
}
