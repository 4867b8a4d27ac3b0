//! CODE V files: a doublet in both ways of writing a surface, its sizes, and what is refused.

use crate::lens::{Lens, Prescription};
use crate::units::D_LINE_NM;

/// A plano-convex singlet of N-BK7, f = R/(n − 1), behind a dummy plane, stop at the first surface.
const SINGLET: &str = "RDM;LEN \"VERSION: 11.5\"  ! a comment\nTITLE 'a singlet; of glass'\nEPD 10\nDIM M\n\
    WL 656.27 587.56 486.13\nREF 2\nYAN 0.0 5.0\nSO 0.0 1e13\nS 0.0 5.0\nS 50.0 3.0 &\n NBK7_SCHOTT\n STO\n CCY 0\n\
    K -0.5 ; B 1e-9\nS 0 90\n CIR 6.5\nS 0 4\nSI 0 0\nGO\n";

fn read(text: &str) -> Prescription {
    Prescription::from_seq(text.as_bytes(), "singlet.seq").unwrap()
}

fn refused(text: &str) -> String {
    let error = Prescription::from_seq(text.as_bytes(), "singlet.seq");
    error.unwrap_err().to_string()
}

#[test]
fn singlet_has_the_lensmakers_focal_length_its_pupil_and_its_sizes() {
    let p = read(SINGLET);
    assert_eq!(p.name, "a singlet; of glass");
    assert_eq!(p.wavelengths_nm, [656.27, 587.56, 486.13]);
    assert_eq!(p.surfaces.len(), 2);
    assert_eq!(p.surfaces[1].thickness_mm, 94.0);
    assert_eq!(
        (p.surfaces[0].conic, p.surfaces[0].aspheric[2]),
        (-0.5, 1e-9)
    );
    assert!(p.surfaces[0].is_stop);
    // The stop is the first surface, so it has the pupil's size; the other has its own.
    assert!((p.surfaces[0].semi_aperture_mm - 5.0).abs() < 1e-12);
    assert_eq!(p.surfaces[1].semi_aperture_mm, 6.5);
    let paraxial = Lens::new(&p).unwrap().paraxial(D_LINE_NM).unwrap();
    assert!((paraxial.efl_mm - 50.0 / 0.5168).abs() < 2e-3);
    assert!((2.0 * paraxial.entrance_pupil_semi_mm - 10.0).abs() < 1e-9);
}

#[test]
fn curvatures_inches_f_numbers_and_numbers_of_glasses_say_the_same() {
    let inches = "LEN NEW\nDIM I\nFNO 9.675\nYAN 5\nSO 0 1e13\nS 0.508 0.118110236220472 516800.641700\n STO\n\
        S 0 3.70078740157480\nSI 0 0\n";
    let p = read(inches);
    assert!((p.surfaces[0].curvature - 0.02).abs() < 1e-12);
    let paraxial = Lens::new(&p).unwrap().paraxial(D_LINE_NM).unwrap();
    assert!(
        (paraxial.efl_mm - 50.0 / 0.5168).abs() < 2e-3,
        "{}",
        paraxial.efl_mm
    );
    assert!((paraxial.f_number - 9.675).abs() < 1e-6);
    // Without CIR: 3 mm / n behind the stop, a chief ray of 5 degrees stands 0.173 mm high, the marginal ray 4.9 mm.
    let semi = p.surfaces[1].semi_aperture_mm;
    let chief = 3.0 * 5f64.to_radians().tan() / 1.5168;
    let marginal = 5.0 * (1.0 - 3.0 * 0.02 * 0.5168 / 1.5168);
    assert!(
        (semi / (1.05 * (chief + marginal)) - 1.0).abs() < 2e-3,
        "{semi}"
    );
}

#[test]
fn a_library_lens_written_as_seq_is_the_same_lens() {
    let ours = Prescription::builtin("lib_double_gauss_100mm_glass").unwrap();
    let mut text = String::from("RDM\nLEN NEW\nWL 587.56\nYAN 14\nSO 0 1e13\n");
    for s in &ours.surfaces {
        let radius = if s.curvature == 0.0 {
            0.0
        } else {
            1.0 / s.curvature
        };
        let glass = s.glass.map_or(String::new(), |g| {
            let (nd, vd) = g.nd_vd();
            format!("{:06.0}.{:06.0}", (nd - 1.0) * 1e6, vd * 1e4)
        });
        text.push_str(&format!(
            "S {radius} {} {glass}\n CIR {}\n",
            s.thickness_mm, s.semi_aperture_mm
        ));
        if s.is_stop {
            text.push_str(" STO\n");
        }
    }
    text.push_str("SI 0 0\nGO\n");
    let theirs = read(&text);
    let of = |p: &Prescription| Lens::new(p).unwrap().paraxial(D_LINE_NM).unwrap();
    let (a, b) = (of(&ours), of(&theirs));
    assert_eq!(ours.surfaces.len(), theirs.surfaces.len());
    // Six digits of each index.
    assert!((a.efl_mm / b.efl_mm - 1.0).abs() < 1e-4);
    assert!((a.f_number / b.f_number - 1.0).abs() < 1e-4);
}

#[test]
fn what_would_change_the_rays_is_refused_by_surface_and_command() {
    for (old, new, said) in [
        (" CCY 0", " YDE 1.0", "S2 YDE: decentred surfaces"),
        (" CCY 0", " REX 3", "S2 REX: apertures that are not circles"),
        (" CCY 0", " SPS ODD", "S2 SPS: special surfaces"),
        ("NBK7_SCHOTT", "REFL", "mirrors"),
        ("NBK7_SCHOTT", "XYZ9_HOYA", "unknown glass `XYZ9_HOYA`"),
        ("NBK7_SCHOTT", "999999.000001", "nd = 1.999999"),
        ("EPD 10", "NA 0.1", "NA: must be EPD or FNO"),
        ("DIM M", "DIM FEET", "FEET: must be M, C or I"),
        ("S 50.0 3.0", "S far 3.0", "far: must be a finite number"),
        (" STO\n", "", "no surface of the lens is the stop"),
        ("EPD 10", "EPD 0", "nothing tells the size of the stop"),
    ] {
        let text = SINGLET.replace(old, new);
        assert_ne!(text, SINGLET, "{old}");
        let error = refused(&text);
        assert!(
            error.contains("singlet.seq") && error.contains(said),
            "{error}"
        );
    }
    assert!(refused("").contains("0 surfaces"));
    for beside in ["SO 0.0 1e13", "SI 0 0"] {
        let text = SINGLET.replace(" STO\n", "");
        let text = text.replace(beside, &format!("{beside}\n STO"));
        assert!(refused(&text).contains("no surface of the lens is the stop"));
    }
    // A tilt of nothing is none.
    let _ = read(&SINGLET.replace(" CCY 0", " ADE 0.0"));
}
