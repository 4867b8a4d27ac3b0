//! Zemax files: a singlet in every encoding, and what is refused.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::lens::{Lens, Prescription};
use crate::units::D_LINE_NM;

/// A plano-convex singlet of N-BK7, f = R/(n − 1), behind a dummy plane.
const SINGLET: &str = "MODE SEQ\nNAME singlet\nUNIT MM X W X CM MR CPMM\nWAVM 1 0.5875618 1\nFTYP 0 0 1 1 0 0 0\n\
    SURF 0\n TYPE STANDARD\n CURV 0.0\n DISZ INFINITY\n\
    SURF 1\n TYPE STANDARD\n COMM a dummy\n CURV 0.0\n DISZ 5\n DIAM 3\n\
    SURF 2\n STOP\n TYPE EVENASPH\n CURV 0.02\n CONI -0.5\n PARM 2 1e-6\n DISZ 3\n GLAS N-BK7 0 0 1.5 40\n DIAM 5\n\
    SURF 3\n TYPE STANDARD\n CURV 0.0\n DISZ 90\n DIAM 5\n\
    SURF 4\n TYPE STANDARD\n CURV 0.0\n DISZ 4\n DIAM 5\n\
    SURF 5\n TYPE STANDARD\n CURV 0.0\n DISZ 0\n";

fn utf16(text: &str, join: fn(u16) -> [u8; 2]) -> Vec<u8> {
    "\u{feff}"
        .encode_utf16()
        .chain(text.encode_utf16())
        .flat_map(join)
        .collect()
}

#[test]
fn singlet_in_every_encoding_has_the_lensmakers_focal_length() {
    let encodings = [
        SINGLET.as_bytes().to_vec(),
        [&[0xEF, 0xBB, 0xBF], SINGLET.as_bytes()].concat(),
        utf16(SINGLET, u16::to_le_bytes),
        utf16(SINGLET, u16::to_be_bytes),
        utf16(SINGLET, u16::to_le_bytes)[2..].to_vec(),
    ];
    for bytes in encodings {
        let p = Prescription::from_zmx(&bytes, "singlet.zmx").unwrap();
        assert_eq!(p.surfaces.len(), 2);
        assert_eq!(p.surfaces[1].thickness_mm, 94.0);
        assert_eq!(
            (p.surfaces[0].conic, p.surfaces[0].aspheric[1]),
            (-0.5, 1e-6)
        );
        let efl = Lens::new(&p).unwrap().paraxial(D_LINE_NM).unwrap().efl_mm;
        assert!((efl - 50.0 / 0.5168).abs() < 2e-3, "{efl}");
    }
}

#[test]
fn entrance_pupil_or_f_number_at_the_head_sets_the_stop() {
    let f_number = |head: &str| {
        let text = SINGLET.replace("UNIT MM", &format!("{head}\nUNIT MM"));
        let p = Prescription::from_zmx(text.as_bytes(), "singlet.zmx").unwrap();
        let paraxial = Lens::new(&p).unwrap().paraxial(D_LINE_NM).unwrap();
        (paraxial.f_number, 2.0 * paraxial.entrance_pupil_semi_mm)
    };
    assert!((f_number("ENPD 7.5").1 - 7.5).abs() < 1e-12);
    assert!((f_number("FNUM 16 0").0 - 16.0).abs() < 1e-12);
    assert!((f_number("FLOA").1 - 10.0).abs() < 1e-12);
}

#[test]
fn a_lines_own_index_beats_the_name_it_does_not_agree_with() {
    let nd = |glas: &str| {
        let text = SINGLET.replace("N-BK7 0 0 1.5 40", glas);
        let p = Prescription::from_zmx(text.as_bytes(), "singlet.zmx").unwrap();
        p.surfaces[0].glass.unwrap().nd_vd().0
    };
    assert!((nd("N-LAK10 0 0 1.734 51.5") - 1.734).abs() < 1e-12);
    assert!((nd("___BLANK 1 0 1.6 30") - 1.6).abs() < 1e-12);
    assert!((nd("SF6 0 0 1.80518 25.4") - 1.80518).abs() < 1e-5);
}

#[test]
fn what_is_not_supported_is_refused_by_name() {
    let cases = [
        ("MODE SEQ", "MODE NSC", "MODE"),
        ("UNIT MM", "UNIT IN", "UNIT"),
        ("TYPE EVENASPH", "TYPE COORDBRK", "SURF 2 TYPE: COORDBRK"),
        (
            "N-BK7 0 0 1.5 40",
            "UNOBTAINIUM 0 0 1.5 40",
            "`UNOBTAINIUM`",
        ),
        ("N-BK7 0 0 1.5 40", "MIRROR 0 0 1.5 40", "MIRROR"),
        ("N-BK7 0 0 1.5 40", "X 1 0 0.7 40", "nd = 0.7"),
        ("CURV 0.02", "CURV NaN", "SURF 2 CURV: NaN"),
        ("DISZ 90", "DISZ INFINITY", "SURF 3 DISZ"),
        ("DIAM 5\nSURF 3", "DIAM 0\nSURF 3", "SURF 2 DIAM"),
        (" STOP\n", "", "is_stop"),
        (
            "CURV 0.0\n DISZ INFINITY",
            "STOP\n CURV 0.0\n DISZ INFINITY",
            "SURF 0 STOP",
        ),
    ];
    for (from, to, expected) in cases {
        let text = SINGLET.replacen(from, to, 1);
        assert_ne!(text, SINGLET, "{from}");
        let error = Prescription::from_zmx(text.as_bytes(), "bad.zmx").unwrap_err();
        let message = error.to_string();
        assert!(
            message.starts_with("bad.zmx: ") && message.contains(expected),
            "{message}"
        );
    }
    for garbage in [
        &b""[..],
        b"\xff\xfe",
        b"\xff\xfe\x41",
        b"SURF 0",
        &[0u8; 64],
    ] {
        assert!(Prescription::from_zmx(garbage, "bad.zmx").is_err());
    }
}
