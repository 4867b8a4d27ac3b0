//! Rims of stated semi-apertures that run into their neighbours: trimmed to where the surfaces meet, by closed form.

use quadpixel::lens::{FocusBy, Lens, Prescription};
use quadpixel::units::D_LINE_NM;
use serde_json::{Value, json};

const R_MM: f64 = 20.0;
const SEMI_MM: f64 = 10.0;

fn sag_mm(r_mm: f64) -> f64 {
    R_MM - (R_MM * R_MM - r_mm * r_mm).sqrt()
}

/// Thickness of a biconvex lens whose faces run past each other by `overlap_mm` at the stated rim.
fn thickness_mm(overlap_mm: f64) -> f64 {
    2.0 * sag_mm(SEMI_MM) - overlap_mm
}

/// Where the faces of such a lens meet: sag(r) = t/2.
fn meeting_mm(overlap_mm: f64) -> f64 {
    let depth = R_MM - 0.5 * thickness_mm(overlap_mm);
    (R_MM * R_MM - depth * depth).sqrt()
}

fn surface(radius_mm: Value, thickness_mm: f64, nd: Value, semi_mm: f64) -> Value {
    let vd = if nd.is_null() {
        json!(null)
    } else {
        json!(64.0)
    };
    json!({
        "radius_mm": radius_mm, "thickness_mm": thickness_mm, "nd": nd, "vd": vd, "conic": 0.0, "coefficients": {},
        "semi_aperture_mm": semi_mm, "is_stop": false, "element_label": ""
    })
}

/// A plane stop of 4 mm behind a biconvex lens.
fn biconvex(overlap_mm: f64) -> Value {
    let mut stop = surface(json!(null), 17.0, json!(null), 4.0);
    stop["is_stop"] = json!(true);
    json!({
        "name": "biconvex", "source": "closed form", "wavelengths": [587.56], "surfaces": [
            surface(json!(R_MM), thickness_mm(overlap_mm), json!(1.5), SEMI_MM),
            surface(json!(-R_MM), 1.0, json!(null), SEMI_MM),
            stop,
        ]
    })
}

fn read(file: &Value) -> Result<Prescription, String> {
    Prescription::from_json(&file.to_string(), "rims.json").map_err(|e| e.to_string())
}

#[test]
fn faces_that_pass_each_other_by_a_few_hundredths_are_trimmed_where_they_meet() {
    let p = read(&biconvex(0.034)).unwrap();
    for i in [0, 1] {
        let semi = p.surfaces[i].semi_aperture_mm;
        assert!((semi - meeting_mm(0.034)).abs() < 1e-5, "{semi}");
    }
    let [warning] = &p.warnings[..] else {
        panic!("{:?}", p.warnings)
    };
    for figure in [
        format!("{:.4} mm", meeting_mm(0.034)),
        "by 0.0340 mm at 10.0000 mm".into(),
        "10 of surfaces[0] and 10 of surfaces[1]".into(),
    ] {
        assert!(warning.contains(&figure), "{warning}");
    }
    // Focal length of a thick lens: 1/f = (n − 1) (2/R − (n − 1) t / (n R²)).
    let power = 0.5 * (2.0 / R_MM - 0.5 * thickness_mm(0.034) / (1.5 * R_MM * R_MM));
    let paraxial = Lens::new(&p).unwrap().paraxial(D_LINE_NM).unwrap();
    assert!((paraxial.efl_mm * power - 1.0).abs() < 1e-9);
    let focused = Lens::new(&p)
        .unwrap()
        .focused_at(1000.0, FocusBy::Sensor, D_LINE_NM);
    assert!(focused.is_ok());
}

#[test]
fn a_stop_keeps_its_diameter_and_its_neighbour_alone_is_trimmed() {
    let mut file = biconvex(0.034);
    file["surfaces"][1]["is_stop"] = json!(true);
    file["surfaces"][2]["is_stop"] = json!(false);
    let p = read(&file).unwrap();
    assert_eq!(p.surfaces[1].semi_aperture_mm, SEMI_MM);
    assert!((p.surfaces[0].semi_aperture_mm - meeting_mm(0.034)).abs() < 1e-5);
    assert!(p.warnings[0].contains("(10 of surfaces[0]) is trimmed"));
}

#[test]
fn a_rim_that_dips_into_the_image_plane_is_trimmed_to_it() {
    // The last face bends towards the sensor: it meets the plane where its sag is the distance to it.
    let mut file = biconvex(-1.0);
    file["surfaces"][1]["radius_mm"] = json!(R_MM);
    file["surfaces"][1]["thickness_mm"] = json!(-1.0);
    file["surfaces"][2]["thickness_mm"] = json!(1.0 + sag_mm(9.9));
    let p = read(&file).unwrap();
    assert!((p.surfaces[1].semi_aperture_mm - 9.9).abs() < 1e-5);
    assert!(p.warnings[0].contains("surfaces[1] and the image plane"));
}

#[test]
fn faces_that_pass_each_other_far_inside_are_refused_with_place_and_depth() {
    let error = read(&biconvex(3.0)).unwrap_err();
    assert!(
        error.contains("surfaces[0].thickness_mm") && error.contains("overlap by"),
        "{error}"
    );
}
