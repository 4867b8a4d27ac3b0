//! Misaligned lenses: rigid motions, the law of reflection, and what Table 1's defects cost.

use glam::{DMat3, DVec3};
use quadpixel::lens::Field;
use quadpixel::lens::rms_radius;
use quadpixel::lens::{
    Clipping, ElementRef, Lens, Misalignment, OpticalSystem, Prescription, Travel, table1_defects,
    trace_visiting,
};
use quadpixel::rays::Ray;
use quadpixel::units::D_LINE_NM;

const TELE: &str = "tele_US10571665B2_220b";

fn lens(name: &str) -> Lens {
    Lens::new(&Prescription::builtin(name).unwrap()).unwrap()
}

fn through(system: &OpticalSystem, ray: Ray) -> Ray {
    trace_visiting(system, ray, Travel::Forward, Clipping::Off, |_, _| {}).unwrap()
}

fn rays() -> Vec<Ray> {
    let starts = [(0.0, 0.0), (1.1, -0.4), (-0.7, 1.3)];
    let slopes = [(0.0, 0.0), (0.08, -0.03), (-0.02, 0.1)];
    let ray = |(x, y): (f64, f64), (u, v): (f64, f64)| Ray {
        origin_mm: DVec3::new(x, y, -1.0),
        direction: DVec3::new(u, v, 1.0).normalize(),
    };
    starts
        .iter()
        .flat_map(|&s| slopes.iter().map(move |&d| ray(s, d)))
        .collect()
}

fn moved(ray: Ray, turn: DMat3, pivot: DVec3, shift: DVec3) -> Ray {
    Ray {
        origin_mm: pivot + turn * (ray.origin_mm - pivot) + shift,
        direction: turn * ray.direction,
    }
}

fn assert_same_line(a: Ray, b: Ray) {
    let apart = (a.origin_mm - b.origin_mm).cross(a.direction).length();
    assert!(apart < 1e-11, "{apart} mm apart");
    assert!((a.direction - b.direction).length() < 1e-12);
}

#[test]
fn a_lens_moved_as_a_whole_is_the_aligned_one_for_rays_moved_with_it() {
    let aligned = lens(TELE);
    let (tip, tilt) = (0.7_f64, -0.4_f64);
    let turn = DMat3::from_rotation_y(tilt.to_radians()) * DMat3::from_rotation_x(tip.to_radians());
    let pivot = DVec3::new(0.0, 0.0, 5.0);
    let shift = DVec3::new(0.03, -0.02, 0.05);
    let z = aligned.prescription().vertices_z_mm();
    let elements = aligned.prescription().elements();
    let misalignments: Vec<Misalignment> = (1..=elements.len())
        .map(|k| {
            let vertex = DVec3::new(0.0, 0.0, z[elements[k - 1].0]);
            let d_um = 1e3 * (pivot + turn * (vertex - pivot) + shift - vertex);
            Misalignment {
                element: ElementRef::Element(k),
                dx_um: d_um.x,
                dy_um: d_um.y,
                dz_um: d_um.z,
                tip_deg: tip,
                tilt_deg: tilt,
            }
        })
        .collect();
    let turned = aligned
        .perturbed(&misalignments)
        .unwrap()
        .at(D_LINE_NM)
        .unwrap();
    let aligned = aligned.at(D_LINE_NM).unwrap();
    for ray in rays() {
        let found = through(&turned, moved(ray, turn, pivot, shift));
        assert_same_line(found, moved(through(&aligned, ray), turn, pivot, shift));
    }
}

#[test]
fn misaligned_mirror_does_what_two_reflections_do() {
    // The folded world: front half, reflection at the real mirror, and the rear half seen in the nominal mirror.
    let aligned = lens(TELE);
    let fold = aligned.prescription().fold.unwrap();
    let vertex = DVec3::new(0.0, 0.0, aligned.prescription().fold_z_mm().unwrap());
    let split = fold.after_surface.unwrap() + 1;
    let (tip, tilt) = (0.625_f64, 0.25_f64);
    let mirror = Misalignment {
        tip_deg: tip,
        tilt_deg: tilt,
        ..Misalignment::none(ElementRef::Mirror)
    };
    let nominal = DVec3::new(0.0, 1.0, -1.0).normalize();
    let in_plane = DVec3::new(0.0, 1.0, 1.0).normalize();
    let real = DMat3::from_axis_angle(in_plane, tilt.to_radians())
        * (DMat3::from_rotation_x(tip.to_radians()) * nominal);
    let reflect = |ray: Ray, n: DVec3| Ray {
        origin_mm: ray.origin_mm - 2.0 * (ray.origin_mm - vertex).dot(n) * n,
        direction: ray.direction - 2.0 * ray.direction.dot(n) * n,
    };
    let system = aligned.at(D_LINE_NM).unwrap();
    let part = |range: std::ops::Range<usize>| OpticalSystem {
        surfaces: system.surfaces[range].to_vec(),
        stop: 0,
        ..system.clone()
    };
    let (front, rear) = (part(0..split), part(split..system.surfaces.len()));
    let perturbed = aligned.perturbed(&[mirror]).unwrap().at(D_LINE_NM).unwrap();
    for ray in rays() {
        let folded = through(&rear, reflect(reflect(through(&front, ray), real), nominal));
        // The sensor holds the camera frame: the same ray, seen from it.
        let seen = reflect(reflect(ray, real), nominal);
        assert_same_line(through(&perturbed, seen), folded);
    }
}

#[test]
fn spot_of_an_aligned_lens_is_round_and_table_1_makes_it_grow() {
    let aligned = lens(TELE);
    let defective = aligned.perturbed(&table1_defects()).unwrap();
    for angle_deg in [0.0, 5.0, 10.0] {
        let rms = |lens: &Lens, azimuth_deg| {
            let field = Field {
                angle_deg,
                azimuth_deg,
            };
            rms_radius(&lens.spot(field, D_LINE_NM).unwrap().points_mm).unwrap() * 1e3
        };
        for azimuth_deg in [90.0, 45.0, 0.0, 180.0] {
            let sharp = rms(&aligned, azimuth_deg);
            assert!((sharp - rms(&aligned, 90.0)).abs() < 1e-6);
            let spread = rms(&defective, azimuth_deg);
            assert!(spread > 2.0 * sharp, "{angle_deg}: {sharp} to {spread} µm");
        }
    }
}

#[test]
fn misalignments_no_lens_can_have_are_refused() {
    let at = |element| Misalignment::none(ElementRef::Element(element));
    let tele = lens(TELE);
    let bad = [
        vec![at(0)],
        vec![at(6)],
        vec![at(1), at(1)],
        vec![Misalignment {
            dx_um: f64::NAN,
            ..at(1)
        }],
        vec![Misalignment {
            tip_deg: 45.0,
            ..at(1)
        }],
        vec![Misalignment {
            dz_um: 1.0,
            ..Misalignment::none(ElementRef::Mirror)
        }],
    ];
    for misalignments in bad {
        assert!(tele.perturbed(&misalignments).is_err(), "{misalignments:?}");
    }
    let straight = lens("wide_US20120327520A1_emb3");
    let error = straight
        .perturbed(&table1_defects())
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("mirror") && error.contains("no fold"),
        "{error}"
    );
}

#[test]
fn misalignment_in_a_file_names_its_element_and_leaves_out_zeros() {
    let read = |text: &str| serde_json::from_str::<Misalignment>(text);
    let third = read(r#"{"element": 3, "dx_um": 9.0, "tilt_deg": 0.2}"#).unwrap();
    assert_eq!(third.element, ElementRef::Element(3));
    assert_eq!((third.dx_um, third.dy_um, third.tilt_deg), (9.0, 0.0, 0.2));
    for m in table1_defects() {
        assert_eq!(read(&serde_json::to_string(&m).unwrap()).unwrap(), m);
    }
    assert!(
        read(r#"{"element": "prism"}"#)
            .unwrap_err()
            .to_string()
            .contains("prism")
    );
    assert!(read(r#"{"element": 1, "dx_mm": 1.0}"#).is_err());
}
