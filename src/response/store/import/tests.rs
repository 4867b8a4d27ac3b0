#![allow(clippy::unwrap_used)] // because tests fail by panicking

use super::*;
use crate::sensor::Subpixels;

/// The shares of a smooth made-up quad pixel.
fn lobes(u: f64, v: f64) -> Vec<f64> {
    let side = |c: f64| 1.0 / (1.0 + (-8.0 * c).exp());
    let s = Subpixels::QUAD;
    let share = |i: usize| {
        let (x, y) = s.centre(i);
        side(u * x.signum()) * side(v * y.signum()) * 0.8 * (1.0 - 0.3 * (u * u + v * v))
    };
    (0..4).map(share).collect()
}

fn pixel() -> PixelStack {
    PixelStack::builtin("2.8um").unwrap()
}

fn lines(directions: &[(f64, f64)]) -> String {
    let mut text = String::from("# exported\nsubpixel;Theta_deg;phi_deg;P;R\n");
    for &(theta, phi) in directions {
        let [u, v] = direction_cosines(theta, phi);
        for (i, p) in lobes(u, v).into_iter().enumerate() {
            let name = Subpixels::QUAD.name(i);
            text.push_str(&format!("{name};{theta};{phi};{p};0.1\n"));
        }
    }
    text
}

fn import(text: &str, symmetric: bool) -> Result<AngularResponse, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("power.csv");
    std::fs::write(&path, text).unwrap();
    let settings = ImportSettings {
        wavelength_nm: 550.0,
        symmetric,
    };
    AngularResponse::read_csv(&path, &pixel(), &settings).map_err(|e| e.to_string())
}

fn grid(theta_step: f64, phis: impl Fn() -> Vec<f64>) -> Vec<(f64, f64)> {
    let thetas = (0..)
        .map(|i| f64::from(i) * theta_step)
        .take_while(|t| *t <= 60.0);
    thetas
        .flat_map(|t| phis().into_iter().map(move |p| (t, p)))
        .collect()
}

#[test]
fn lines_that_repeat_or_contradict_each_other_and_decimal_commas_are_refused() {
    let phis = || (0..36).map(|k| 10.0 * f64::from(k)).collect();
    let sound = lines(&grid(15.0, phis));
    import(&sound, false).unwrap();
    let last = sound.lines().last().unwrap();
    let text = import(&format!("{sound}{last}\n"), false).unwrap_err();
    assert!(text.contains("again"), "{text}");
    // 360° is 0°: another line, which has to say the same.
    let first = sound.lines().find(|l| l.contains(";30;0;")).unwrap();
    let cells: Vec<&str> = first.split(';').collect();
    let turned = |p: &str| format!("{sound}{};30;360;{p};0.1\n", cells[0]);
    import(&turned(cells[3]), false).unwrap();
    let text = import(&turned("0.99"), false).unwrap_err();
    assert!(text.contains("on line"), "{text}");
    let commas = "theta_deg,phi_deg,subpixel,P\n0,0,A,0,25\n";
    let text = import(commas, false).unwrap_err();
    assert!(text.contains("decimal comma"), "{text}");
    let text = import(
        &sound
            .replace(";0.1\n", ";0,1\n")
            .replacen(cells[3], "0,25", 1),
        false,
    );
    assert!(text.unwrap_err().contains("0,25"));
}

/// The largest difference to the made-up pixel over a cone of 45°.
fn worst(table: &AngularResponse) -> f64 {
    let lookup = table.interpolator(550.0);
    let mut worst = 0.0f64;
    for i in 0..500 {
        let (r, a) = (0.7 * (f64::from(i) / 500.0).sqrt(), 2.399963 * f64::from(i));
        let (u, v) = (r * a.cos(), r * a.sin());
        let mut p = [0.0; 4];
        lookup.weights(u as f32, v as f32, &mut p);
        for (p, q) in p.iter().zip(lobes(u, v)) {
            worst = worst.max((f64::from(*p) - q).abs());
        }
    }
    worst
}

#[test]
fn a_polar_grid_becomes_the_response_that_it_samples() {
    // 5° × 15° steps are 0.09 × 0.19 at most in (u, v); lobes 0.25 wide: a quadratic is off by a cubic's 2 % of them.
    let phis = || (0..=24).map(|i| f64::from(i) * 15.0).collect();
    let table = import(&lines(&grid(5.0, phis)), false).unwrap();
    let worst = worst(&table);
    println!("{worst}");
    assert!(worst < 0.02);
    assert_eq!(table.meta().pitch_um, 2.8);
    assert_eq!(table.axes().wavelengths_nm, [550.0]);
}

#[test]
fn scattered_directions_and_finer_ones_converge() {
    let spiral = |n: i32| -> Vec<(f64, f64)> {
        let place = |i: i32| (f64::from(i) / f64::from(n)).sqrt();
        (0..n)
            .map(|i| {
                (
                    (0.87 * place(i)).asin().to_degrees(),
                    137.507764 * f64::from(i) % 360.0,
                )
            })
            .collect()
    };
    let coarse = worst(&import(&lines(&spiral(400)), false).unwrap());
    let fine = worst(&import(&lines(&spiral(1600)), false).unwrap());
    println!("{coarse} {fine}");
    // A quadratic fit is of third order in the spacing, which halves; the table's own bilinear lookup adds a little.
    assert!(coarse < 0.02 && fine < 0.3 * coarse);
}

#[test]
fn one_octant_is_enough_of_a_symmetric_pixel() {
    let octant = || (0..=3).map(|i| f64::from(i) * 15.0).collect();
    let text = lines(&grid(5.0, octant));
    assert!(worst(&import(&text, true).unwrap()) < 0.02);
    let refused = import(&text, false).err().unwrap();
    assert!(refused.contains("no direction near"), "{refused}");
}

#[test]
fn a_wrong_line_is_named_with_its_column() {
    let phis = || (0..12).map(|i| f64::from(i) * 30.0).collect();
    let good = lines(&grid(10.0, phis));
    let with = |old: &str, new: &str| {
        assert!(good.contains(old), "{old}");
        import(&good.replacen(old, new, 1), false).err().unwrap()
    };
    // Line 1 is the comment, 2 the names; sub-pixels come in the order B, A, D, C.
    let said = with("A;0;0;", "A;zero;0;");
    assert!(
        said.contains("power.csv") && said.contains("line 4, column 2 (theta_deg) is `zero`"),
        "{said}"
    );
    let said = with("D;0;0;0.2", "D;0;0;-0.2");
    assert!(said.contains("line 5, column 4 (P) is `-0.2"), "{said}");
    let said = with("D;0;0;", "E;0;0;");
    assert!(
        said.contains("line 5, column 1 (subpixel) is `E`; allowed: B, A, D, C"),
        "{said}"
    );
    let said = with("C;10;30;", "C;10;31;");
    assert!(said.contains("no value for sub-pixel"), "{said}");
    let said = with("phi_deg", "azimuth");
    assert!(said.contains("line 2: no column phi_deg"), "{said}");
    let said = with("A;10;0;0.3", "A;10;0;0.9");
    assert!(said.contains("P sums to"), "{said}");
    assert!(
        import("", false)
            .err()
            .unwrap()
            .contains("names of the columns")
    );
    let on_a_line = lines(&grid(5.0, || vec![0.0, 180.0]));
    assert!(
        import(&on_a_line, false)
            .err()
            .unwrap()
            .contains("no direction near")
    );
}
