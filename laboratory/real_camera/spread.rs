//! Charge that wanders before a photodiode collects it.
//!
//! Between photodiodes parted by implants only, charge made at x is collected as if at x + s, s Gaussian of deviation σ
//! (lateral diffusion in front-illuminated silicon: E. G. Stevens, IEEE Trans. Electron Devices 39, 2621 (1992)). Below
//! the microlens nothing of the pixel but the photodiodes has a place along x, so that this is the mean over pixels
//! whose lens is moved by s:
//!
//! ```text
//! P_i'(u, v) = ∫ P_i(u, v; s) N(s; σ) ds     P_i(u, v; s): the response under a lens moved by s, by the moving frame
//! ```

use quadpixel::response::{AngularResponse, ResponseError, ResponseMeta};

/// Places of s, from −3 σ to 3 σ.
const PLACES: usize = 25;

/// The table of a pixel parted along x whose charge wanders by `sigma_um`.
pub fn spread(table: &AngularResponse, sigma_um: f64) -> Result<AngularResponse, ResponseError> {
    let places: Vec<(f64, f64)> = (0..PLACES)
        .map(|k| 6.0 * k as f64 / (PLACES - 1) as f64 - 3.0)
        .map(|z| (z * sigma_um, (-0.5 * z * z).exp()))
        .collect();
    let all: f64 = places.iter().map(|p| p.1).sum();
    let (axes, frame, count) = (table.axes(), table.frame(), table.subpixels().count());
    let mut values = Vec::with_capacity(table.table().len());
    for &nm in &axes.wavelengths_nm {
        let lookup = table.interpolator(nm);
        for &v in &axes.v {
            for &u in &axes.u {
                let mut sums = vec![0.0; count];
                for &(shift_um, weight) in &places {
                    let (u, v) = frame.centred_uv(u as f32, v as f32, [shift_um, 0.0]);
                    let mut p = vec![0.0f32; count];
                    lookup.weights(u, v, &mut p);
                    for (sum, p) in sums.iter_mut().zip(p) {
                        *sum += weight / all * f64::from(p);
                    }
                }
                values.extend(sums.into_iter().map(|p| p as f32));
            }
        }
    }
    let meta = ResponseMeta {
        key: format!("{} / charge spread {sigma_um} um", table.meta().key),
        ..table.meta().clone()
    };
    AngularResponse::new(axes.clone(), meta, values)
}
