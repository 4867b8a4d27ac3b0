//! Lens files that no lens can have: each is refused by one sentence that names the file, the field and the value.

use proptest::prelude::*;
use quadpixel::lens::Field;
use quadpixel::lens::{Lens, Prescription, builtin_names};
use serde_json::{Value, json};

const GOOD: &str = include_str!("../../src/lens/library/wide_US20120327520A1_emb3.json");

/// The message for the good file with the value at a JSON pointer changed, or taken out where it is `None`.
fn message(pointer: &str, value: Option<Value>) -> String {
    let mut file: Value = serde_json::from_str(GOOD).unwrap();
    match value {
        Some(value) => *file.pointer_mut(pointer).unwrap() = value,
        None => {
            let (parent, key) = pointer.rsplit_once('/').unwrap();
            file.pointer_mut(parent)
                .unwrap()
                .as_object_mut()
                .unwrap()
                .remove(key)
                .unwrap();
        }
    }
    refused(&file.to_string())
}

fn refused(text: &str) -> String {
    let error = Prescription::from_json(text, "bad.json")
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("bad.json: ") && !error.contains('\n'),
        "{error}"
    );
    error
}

#[test]
fn missing_fields_are_named() {
    for field in [
        "radius_mm",
        "thickness_mm",
        "nd",
        "conic",
        "coefficients",
        "semi_aperture_mm",
        "is_stop",
    ] {
        let error = message(&format!("/surfaces/3/{field}"), None);
        assert!(
            error.contains("surfaces[3]") && error.contains(field),
            "{error}"
        );
    }
    for field in ["name", "source", "wavelengths", "surfaces"] {
        assert!(message(&format!("/{field}"), None).contains(field));
    }
}

#[test]
fn impossible_values_are_named_with_what_is_allowed() {
    let cases = [
        (
            "/surfaces/1/radius_mm",
            json!(0.0),
            "surfaces[1].radius_mm is 0",
        ),
        ("/surfaces/1/radius_mm", json!("x"), "surfaces[1].radius_mm"),
        ("/surfaces/1/nd", json!(-1.5), "surfaces[1].nd is -1.5"),
        ("/surfaces/1/nd", json!(0.9), "surfaces[1].nd is 0.9"),
        ("/surfaces/1/nd", json!(1e300), "surfaces[1].nd is 1"),
        ("/surfaces/1/vd", json!(0.0), "surfaces[1].vd is 0"),
        ("/surfaces/2/vd", json!(50.0), "surfaces[2].vd is 50"),
        (
            "/surfaces/2/semi_aperture_mm",
            json!(0.0),
            "surfaces[2].semi_aperture_mm is 0",
        ),
        (
            "/surfaces/2/semi_aperture_mm",
            json!(-1.0),
            "surfaces[2].semi_aperture_mm is -1",
        ),
        (
            "/surfaces/8/semi_aperture_mm",
            json!(9.0),
            "surfaces[8].semi_aperture_mm is 9",
        ),
        (
            "/surfaces/0/semi_aperture_mm",
            json!(null),
            "surfaces[0].semi_aperture_mm",
        ),
        ("/surfaces/0/is_stop", json!(false), "0 surfaces"),
        ("/surfaces/4/is_stop", json!(true), "2 surfaces"),
        (
            "/surfaces/1/thickness_mm",
            json!(-0.6),
            "surfaces[1].thickness_mm is -0.6",
        ),
        (
            "/surfaces/1/thickness_mm",
            json!(0.05),
            "surfaces[1].thickness_mm is 0.05",
        ),
        (
            "/surfaces/4/thickness_mm",
            json!(-0.1),
            "surfaces[4].thickness_mm is -0.1",
        ),
        (
            "/surfaces/12/thickness_mm",
            json!(-0.1),
            "surfaces[12].thickness_mm is -0.1",
        ),
        ("/surfaces/12/nd", json!(1.5), "surfaces[12].nd is 1.5"),
        (
            "/surfaces/1/coefficients",
            json!({"5": 0.1}),
            "coefficients[\"5\"] is 0.1",
        ),
        (
            "/surfaces/1/coefficients",
            json!({"22": 0.1}),
            "coefficients[\"22\"] is 0.1",
        ),
        (
            "/surfaces/1/coefficients",
            json!({"x": 0.1}),
            "coefficients[\"x\"] is 0.1",
        ),
        ("/surfaces", json!([]), "surfaces is []"),
        ("/surfaces", json!(7), "surfaces"),
    ];
    for (pointer, value, expected) in cases {
        let error = message(pointer, Some(value));
        assert!(error.contains(expected), "{pointer}: {error}");
    }
}

#[test]
fn not_a_number_and_broken_json_are_refused_where_they_stand() {
    for word in ["NaN", "Infinity", "1e999", "--1"] {
        let bad = GOOD.replacen("1.53212", word, 1);
        assert_ne!(bad, GOOD);
        assert!(
            refused(&bad).contains("surfaces[1].radius_mm"),
            "{}",
            refused(&bad)
        );
    }
    for text in [
        "",
        "[]",
        "{",
        "null",
        &GOOD[..GOOD.len() / 2],
        &format!("{GOOD}x"),
    ] {
        refused(text);
    }
}

#[test]
fn unknown_fields_lenses_and_files_are_named() {
    let misspelt = GOOD.replacen("\"conic\"", "\"connic\"", 1);
    assert!(refused(&misspelt).contains("connic"));
    let error = Prescription::named("wide_nothing").unwrap_err().to_string();
    assert!(
        error.contains("wide_nothing") && error.contains(builtin_names()[0]),
        "{error}"
    );
    let error = Prescription::named("/nowhere/lens.zmx")
        .unwrap_err()
        .to_string();
    assert!(error.contains("/nowhere/lens.zmx"), "{error}");
    assert!(
        Prescription::named("lens.txt")
            .unwrap_err()
            .to_string()
            .contains(".json, .zmx or .seq")
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Whatever number stands in whatever field: an error or a lens, and then rays or no rays, but never a panic.
    #[test]
    fn any_number_in_any_field_is_refused_or_traced(
        surface in 0usize..13,
        field in prop::sample::select(vec!["radius_mm", "thickness_mm", "nd", "vd", "conic", "semi_aperture_mm"]),
        value in prop_oneof![-10.0..10.0f64, any::<f64>()],
    ) {
        let mut file: Value = serde_json::from_str(GOOD).unwrap();
        file["surfaces"][surface][field] = json!(value);
        let made = Prescription::from_json(&file.to_string(), "bad.json").and_then(|p| Lens::new(&p));
        if let Ok(lens) = made {
            let spot = lens.spot(Field::up(20.0), 550.0).unwrap();
            prop_assert!(spot.points_mm.iter().all(|p| p.is_finite()));
        }
    }
}

#[test]
fn sellmeier_coefficients_in_a_file_take_the_place_of_nd_and_vd() {
    let mut file: Value = serde_json::from_str(GOOD).unwrap();
    let surface = &mut file["surfaces"][11];
    surface["sellmeier"] = json!({
        "b": [1.03961212, 0.231792344, 1.01046945], "c_um2": [0.00600069867, 0.0200179144, 103.560653]
    });
    assert!(refused(&file.to_string()).contains("surfaces[11].nd is 1.517"));
    let surface = file["surfaces"][11].as_object_mut().unwrap();
    surface.remove("nd");
    surface.remove("vd");
    let p = Prescription::from_json(&file.to_string(), "bk7.json").unwrap();
    let (nd, vd) = p.surfaces[11].glass.unwrap().nd_vd();
    assert!((nd - 1.5168).abs() < 1e-5 && (vd - 64.17).abs() < 0.01);
}

#[test]
fn folds_that_stand_in_glass_or_behind_the_lens_are_refused() {
    for (after, distance, expected) in [
        (json!(1), json!(0.1), "fold.after_surface is 1"),
        (json!(99), json!(0.1), "fold.after_surface is 99"),
        (json!(2), json!(-1.0), "fold.distance_mm is -1"),
    ] {
        let mut file: Value = serde_json::from_str(GOOD).unwrap();
        file["fold"] = json!({"after_surface": after, "distance_mm": distance});
        let error = refused(&file.to_string());
        assert!(error.contains(expected), "{error}");
    }
}
