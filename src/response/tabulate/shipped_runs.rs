//! What the wave level answered for built-in pixels at the wavelengths of the colour channels, which comes with the
//! program: plane waves that nobody has to simulate again.
//!
//! `tables/wave_runs.npz` holds, for the i-th simulation,
//!
//! | array | type | shape |
//! |---|---|---|
//! | `meta` | u8 | UTF-8 JSON: pixel, wavelength and key of each simulation ([`About`]) |
//! | `absorbed_i` | f64 | [run, photodiode] |
//! | `rest_i` | f64 | [run, 5]: reflected, transmitted, elsewhere, residual, imbalance |
//!
//! The key is that of a table of the pixel at the wavelength, of the model's version among others: where any of them
//! changed, the pixel is simulated. The test below makes the file anew with `QUADPIXEL_WRITE_WAVE_RUNS=1`.

use std::io::Cursor;

use ndarray::{Array1, Array2};
use serde::{Deserialize, Serialize};

use crate::em::light::{Light, Powers};
use crate::npz::Npz;

const FILE: &[u8] = include_bytes!("../tables/wave_runs.npz");

/// Which simulation one is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct About {
    pixel: String,
    wavelength_nm: f64,
    key: String,
}

/// Whether the simulation of this key comes with the program.
pub(super) fn ships(key: &str) -> bool {
    let npz = Npz::open(Cursor::new(FILE)).map_err(|e| e.to_string());
    let all = npz.and_then(|mut npz| all_about(&mut npz));
    all.is_ok_and(|all| all.iter().any(|about| about.key == key))
}

/// The answers to all runs, in their order, of the simulation of this key, if they come with the program.
pub(super) fn shipped_runs(key: &str) -> Option<Vec<Light>> {
    let mut npz = Npz::open(Cursor::new(FILE)).ok()?;
    let place = all_about(&mut npz)
        .ok()?
        .iter()
        .position(|a| a.key == key)?;
    let absorbed: Array2<f64> = npz.array(&format!("absorbed_{place}")).ok()?;
    let rest: Array2<f64> = npz.array(&format!("rest_{place}")).ok()?;
    let light = |(absorbed, rest): (ndarray::ArrayView1<f64>, ndarray::ArrayView1<f64>)| Light {
        mean: Powers {
            absorbed: absorbed.to_vec(),
            reflected: rest[0],
            transmitted: rest[1],
            elsewhere: rest[2],
            ..Powers::default()
        },
        residual: rest[3],
        imbalance: rest[4],
        ..Light::default()
    };
    let whole = rest.ncols() == 5 && rest.nrows() == absorbed.nrows();
    whole.then(|| {
        absorbed
            .rows()
            .into_iter()
            .zip(rest.rows())
            .map(light)
            .collect()
    })
}

fn all_about(npz: &mut Npz<Cursor<&[u8]>>) -> Result<Vec<About>, String> {
    let meta: Array1<u8> = npz.array("meta")?;
    serde_json::from_slice(&meta.to_vec()).map_err(|e| e.to_string())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use ndarray_npy::NpzWriter;

    use super::super::TablePlan;
    use super::*;
    use crate::em::{Level, ModelChoice, PixelStack, Preset};
    use crate::response::TableSettings;
    use crate::spectrum::{Bands, ChannelWavelengths};

    /// The simulations that come with the program: those of the default dataset.
    fn plans() -> Vec<(About, TablePlan)> {
        let bands = ChannelWavelengths::from_bands(Bands::default()).unwrap();
        let mut nm = bands.all_response_nm();
        nm.push(bands.reference_nm());
        nm.sort_by(f64::total_cmp);
        nm.dedup();
        let mut all = Vec::new();
        for pixel in ["1.6um", "2.8um"] {
            let stack = PixelStack::builtin(pixel).unwrap();
            let choice = ModelChoice::new(Level::Wave, Preset::Standard);
            let usual = TableSettings::for_choice(&choice, &stack);
            for &wavelength_nm in &nm {
                let wavelengths_nm = vec![wavelength_nm];
                let settings = TableSettings {
                    wavelengths_nm,
                    ..usual.clone()
                };
                let plan = TablePlan::new(&stack, &settings).unwrap();
                let about = About {
                    pixel: pixel.to_owned(),
                    wavelength_nm,
                    key: plan.simulation_key().unwrap(),
                };
                all.push((about, plan));
            }
        }
        all
    }

    fn write(path: &str) {
        let mut npz = NpzWriter::new(Cursor::new(Vec::new()));
        let all = plans();
        let about: Vec<&About> = all.iter().map(|(about, _)| about).collect();
        let meta = serde_json::to_vec(&about).unwrap();
        npz.add_array("meta", &ndarray::ArrayView1::from(&meta))
            .unwrap();
        for (i, (_, plan)) in all.iter().enumerate() {
            let lights: Vec<Light> = plan.simulate_all().unwrap();
            let photodiodes = lights[0].mean.absorbed.len();
            let absorbed = lights.iter().flat_map(|l| l.mean.absorbed.iter().copied());
            let absorbed: Vec<f64> = absorbed.collect();
            let absorbed = Array2::from_shape_vec((lights.len(), photodiodes), absorbed).unwrap();
            let rest = |l: &Light| {
                let p = &l.mean;
                [
                    p.reflected,
                    p.transmitted,
                    p.elsewhere,
                    l.residual,
                    l.imbalance,
                ]
            };
            let rest: Vec<[f64; 5]> = lights.iter().map(rest).collect();
            npz.add_array(format!("absorbed_{i}"), &absorbed).unwrap();
            npz.add_array(format!("rest_{i}"), &ndarray::ArrayView2::from(&rest[..]))
                .unwrap();
        }
        std::fs::write(path, npz.finish().unwrap().into_inner()).unwrap();
    }

    #[test]
    fn shipped_runs_are_what_the_wave_level_answers() {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/src/response/tables/wave_runs.npz"
        );
        if std::env::var_os("QUADPIXEL_WRITE_WAVE_RUNS").is_some() {
            write(path);
        }
        for (about, plan) in plans() {
            let shipped = shipped_runs(&about.key);
            assert!(
                shipped.is_some(),
                "{about:?}: make them anew, see the module"
            );
            let shipped = shipped.unwrap();
            assert_eq!(shipped.len(), plan.count().unwrap(), "{about:?}");
            // The normal, a steep direction, and one between.
            for run in [0, shipped.len() / 2 + 7, shipped.len() - 1] {
                let made = plan.simulate_run(run).unwrap();
                let differ = |a: &Light, b: &Light| {
                    let pairs = a.mean.absorbed.iter().zip(&b.mean.absorbed);
                    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
                };
                assert!(differ(&made, &shipped[run]) < 1e-12, "{about:?}, run {run}");
                assert_eq!(made.mean.absorbed.len(), shipped[run].mean.absorbed.len());
            }
        }
    }

    #[test]
    fn another_pixel_is_not_among_them() {
        let mut stack = PixelStack::builtin("1.6um").unwrap();
        stack.trench_um = 0.0123;
        let choice = ModelChoice::new(Level::Wave, Preset::Standard);
        let settings = TableSettings::for_choice(&choice, &stack);
        let plan = TablePlan::new(&stack, &settings).unwrap();
        assert_eq!(shipped_runs(&plan.simulation_key().unwrap()), None);
    }
}
