//! What is asked of a bank of kernels.

use quadpixel::render::Camera;
use quadpixel::render::kernels::{BankPlan, Footprint, KernelBank};
use serde_json::{Value, json};

use super::{BankError, trace};
use crate::field_error::FieldError;
use crate::recipe::Recipe;

/// Depths where none are named: from twice the inverse of the focus to 0, in steps of a quarter of it.
const EVEN_DEPTHS: u32 = 9;
/// In the place of a focus at infinity, for these, mm.
const NO_FOCUS_MM: f64 = 1000.0;

/// Depths, fields and rays of a bank.
#[derive(Clone, Debug, PartialEq)]
pub struct BankRequest {
    /// m from the first lens vertex, +∞ allowed; empty: nine, even in inverse depth, from half the focus to infinity.
    pub depths_m: Vec<f64>,
    /// Field nodes along the window's width and height.
    pub nodes: (usize, usize),
    /// Rays per node and channel.
    pub rays: usize,
    /// What shines.
    pub footprint: Footprint,
}

impl BankRequest {
    /// Traces it behind a camera, which is that of the recipe: the kernels, their depths in m, and what else a reader
    /// needs to know, as JSON.
    ///
    /// # Errors
    /// Depths that are none; as of [`trace`].
    pub fn trace(
        &self,
        recipe: &Recipe,
        camera: &Camera,
    ) -> Result<(KernelBank, Vec<f64>, Value), BankError> {
        let plan = self.plan(recipe)?;
        let kernels = trace(camera, &plan)?;
        let inverse = plan.inverse_depths_per_mm.iter();
        let depths_m = inverse.map(|t| 1e-3 / t).collect();
        let about = self.about(recipe, camera, &kernels);
        Ok((kernels, depths_m, about))
    }

    /// How it is traced.
    ///
    /// # Errors
    /// Depths that are none.
    pub fn plan(&self, recipe: &Recipe) -> Result<BankPlan, BankError> {
        if let Some(depth) = (self.depths_m.iter()).find(|d| d.is_nan() || **d <= 0.0) {
            return Err(FieldError::new("depths_m", depth, "depths above 0, inf").into());
        }
        let focus_per_mm = 1.0 / recipe.lens.focus_mm.unwrap_or(NO_FOCUS_MM);
        let even = (0..EVEN_DEPTHS).map(|k| focus_per_mm * (2.0 - f64::from(k) / 4.0));
        let inverse = match self.depths_m.is_empty() {
            true => even.collect(),
            false => self.depths_m.iter().map(|m| 1e-3 / m).collect(),
        };
        Ok(BankPlan {
            nodes: self.nodes,
            inverse_depths_per_mm: inverse,
            rays: self.rays,
            footprint: self.footprint,
            cut_share: 0.0,
        })
    }

    fn about(&self, recipe: &Recipe, camera: &Camera, kernels: &KernelBank) -> Value {
        let channels: &[&str] = match kernels.channels() {
            3 => &["R", "G", "B"],
            _ => &["RGB"],
        };
        json!({
            "lens": recipe.lens, "sensor": recipe.sensor, "response": recipe.response, "spectrum": recipe.spectrum,
            "channels": channels, "subpixels": kernels.subpixels().names(), "rays": self.rays,
            "source": format!("{:?}", self.footprint).to_lowercase(), "pitch_um": camera.sensor().pitch_um(),
            "lens_diffraction": true,
            "units": {
                "kernel": "part of the light, per pixel", "energy_sr": "sr", "centroid_px": "px, x right, y down",
                "depth_m": "m from the first lens vertex", "field_mm": "mm on the sensor"
            },
        })
    }
}
