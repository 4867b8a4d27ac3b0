//! The choices of the three measures, and named sets of them.

use std::str::FromStr;

use super::error::SharpnessError;

/// What Wee's image is divided by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Energy {
    /// E = Σf².
    SumOfSquares,
    /// E = √Σf².
    Root,
}

/// What Wee's measure adds up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Eigenvalues {
    /// λ.
    Plain,
    /// λ².
    Squared,
}

/// What is taken for the mean in Wee's measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mean {
    /// One mean of the whole image.
    Image,
    /// That of each column.
    Column,
}

/// The N of Wee's N − 1 where a picture is not square; of square ones it is the side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Samples {
    /// Its columns: S is a mean over columns.
    Columns,
    /// Its rows.
    Rows,
}

/// Derivative of the gradient measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GradientKernel {
    /// (1 2 1)ᵀ × (−1 0 1), not divided by 8, and its transpose, where all nine samples are in the image.
    Sobel,
    /// (I(x+1) − I(x−1))/2 inside, the one-sided difference at the edge.
    Central,
}

/// Every choice of the three measures.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SharpnessSettings {
    /// Factor from the image's values to those of Wee's f.
    pub wee_scale: f64,
    /// Norm of Wee's image.
    pub wee_energy: Energy,
    /// Mean of Wee's image.
    pub wee_mean: Mean,
    /// By what the covariance is divided.
    pub wee_samples: Samples,
    /// Eigenvalues added, from the largest down; `None`: all.
    pub wee_k: Option<usize>,
    /// Whether they are squared.
    pub wee_eigenvalues: Eigenvalues,
    /// Factor from the image's values to those of the gradient.
    pub gradient_scale: f64,
    /// Kernel of the gradient.
    pub gradient_kernel: GradientKernel,
}

impl SharpnessSettings {
    /// The reading of Wee's abstract: norm by the energy's root, k = 6, plain eigenvalues; Sobel on 0..1.
    pub fn wee_abstract() -> Self {
        Self {
            wee_scale: 255.0,
            wee_energy: Energy::Root,
            wee_mean: Mean::Image,
            wee_samples: Samples::Columns,
            wee_k: Some(6),
            wee_eigenvalues: Eigenvalues::Plain,
            gradient_scale: 1.0,
            gradient_kernel: GradientKernel::Sobel,
        }
    }

    /// The one that gives the size (1e-12) of the quad-pixel paper's Table 2: f/Σf² on 0..255, k = 6, plain
    /// eigenvalues; Sobel on 0..1.
    pub fn table_2() -> Self {
        Self {
            wee_energy: Energy::SumOfSquares,
            ..Self::wee_abstract()
        }
    }

    /// Names of the presets, the default first.
    pub const PRESETS: [&str; 2] = ["wee-abstract", "table-2"];
}

impl FromStr for SharpnessSettings {
    type Err = SharpnessError;
    fn from_str(name: &str) -> Result<Self, SharpnessError> {
        match name {
            "wee-abstract" => Ok(Self::wee_abstract()),
            "table-2" => Ok(Self::table_2()),
            _ => Err(SharpnessError::Preset(name.to_string())),
        }
    }
}
