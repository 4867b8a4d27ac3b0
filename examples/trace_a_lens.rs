//! Traces a fan of rays from a point in front of a lens to its sensor, and says where each arrives or why it is lost.
//!
//! `cargo run --release --example trace_a_lens [LENS.json|LENS.zmx]`
//!
//! Expect focal length and F-number, then a line per ray: for the built-in double Gauss, rays through the middle of the
//! pupil arrive within some 0.01 mm of each other, and those beside it are stopped by an aperture.

use std::path::Path;

use glam::DVec3;
use quadpixel::lens::{FocusBy, Lens, Prescription, trace_forward};
use quadpixel::rays::Ray;
use quadpixel::units::D_LINE_NM;

const DISTANCE_MM: f64 = 2000.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let prescription = match std::env::args().nth(1) {
        Some(file) => Prescription::from_file(Path::new(&file))?,
        None => Prescription::builtin("lib_dgauss_50mm")?,
    };
    let lens = Lens::new(&prescription)?.focused_at(DISTANCE_MM, FocusBy::Sensor, D_LINE_NM)?;
    let paraxial = lens.paraxial(D_LINE_NM)?;
    println!("f = {:.3} mm, f/{:.2}", paraxial.efl_mm, paraxial.f_number);

    // A point 50 mm above the axis, and rays from it through the entrance pupil's plane.
    let point_mm = DVec3::new(0.0, 50.0, -DISTANCE_MM);
    let system = lens.at(D_LINE_NM)?;
    for share in [-1.2, -0.9, -0.6, -0.3, 0.0, 0.3, 0.6, 0.9, 1.2] {
        let y_mm = share * paraxial.entrance_pupil_semi_mm;
        let target_mm = DVec3::new(0.0, y_mm, paraxial.entrance_pupil_z_mm);
        let ray = Ray {
            origin_mm: point_mm,
            direction: (target_mm - point_mm).normalize(),
        };
        match trace_forward(&system, ray) {
            Ok(end) => println!("{y_mm:8.3} mm in the pupil: y = {:.5} mm", end.origin_mm.y),
            Err(lost) => println!("{y_mm:8.3} mm in the pupil: {lost}"),
        }
    }
    Ok(())
}
