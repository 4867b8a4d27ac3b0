//! The paper's pixels, dual pixels of a phone and of a full-frame camera, and pixels from files.
//!
//! A built-in pixel is a file of `src/em/pixels/`, so each one is an example of the format; `2.8um-tungsten.toml`
//! explains every field. Unless the name says otherwise the paper's pixels have R = h = half the diagonal, the best of
//! its nine lenses.

use super::{Isolation, Layer, Material, Microlens, PixelStack, StackError};
use crate::sensor::Subpixels;

/// Name and file.
const FILES: [(&str, &str); 9] = [
    ("3.5um", include_str!("pixels/3.5um.toml")),
    ("3.5um-roc3.5", include_str!("pixels/3.5um-roc3.5.toml")),
    (
        "3.5um-thin-filter",
        include_str!("pixels/3.5um-thin-filter.toml"),
    ),
    ("2.8um", include_str!("pixels/2.8um.toml")),
    ("2.8um-tungsten", include_str!("pixels/2.8um-tungsten.toml")),
    ("1.6um", include_str!("pixels/1.6um.toml")),
    ("1.6um-bayer", include_str!("pixels/1.6um-bayer.toml")),
    ("1.4um-dual", include_str!("pixels/1.4um-dual.toml")),
    ("6um-dual", include_str!("pixels/6um-dual.toml")),
];

impl PixelStack {
    /// The paper's layers (resin `planarization`, `filter`, `oxide`) under a lens of the given pitch, radius and
    /// height, with a colour filter of `filter_um`.
    pub fn paper(pitch_um: f64, radius_um: f64, height_um: f64, filter_um: f64) -> Self {
        let resin = Material::Constant { n: 1.56, k: 0.0 };
        let oxide = Material::Table("SiO2_Malitson1965".into());
        let layer = |name: &str, thickness_um, material: &Material| Layer {
            name: name.into(),
            thickness_um,
            material: material.clone(),
        };
        Self {
            name: format!(
                "{pitch_um} um, RoC {radius_um:.4}, h {height_um:.4}, filter {filter_um}"
            ),
            pitch_um,
            subpixels: Subpixels::QUAD,
            filter: Some("filter".into()),
            silicon_um: 4.0,
            silicon: Material::Table("Si_Green2008".into()),
            trench_um: 0.1,
            isolation: Isolation::default(),
            trench: oxide.clone(),
            layers: vec![
                layer("planarization", 0.5, &resin),
                layer(
                    "filter",
                    filter_um,
                    &Material::Constant { n: 1.60, k: 0.005 },
                ),
                layer("oxide", 0.65, &oxide),
            ],
            lens: Microlens {
                radius_um,
                height_um,
                shift_um: [0.0, 0.0],
                material: resin,
            },
            metal: None,
            mosaic: None,
        }
    }

    /// Names that [`Self::builtin`] knows.
    pub fn builtin_names() -> [&'static str; 9] {
        FILES.map(|(name, _)| name)
    }

    /// A built-in pixel.
    ///
    /// # Errors
    /// A name that is none of [`Self::builtin_names`].
    pub fn builtin(name: &str) -> Result<Self, StackError> {
        match FILES.iter().find(|(known, _)| *known == name) {
            Some((_, text)) => Self::from_toml(text, name),
            None => Err(StackError::value(
                "name",
                name,
                "3.5um, 3.5um-roc3.5, 3.5um-thin-filter, 2.8um, 2.8um-tungsten, 1.6um, 1.6um-bayer, 1.4um-dual, 6um-dual, or a .toml file",
            )),
        }
    }

    /// The file of a built-in pixel, comments and all.
    pub fn builtin_toml(name: &str) -> Option<&'static str> {
        FILES.iter().find(|(known, _)| *known == name).map(|f| f.1)
    }

    /// A pixel from TOML; `file` names the text in errors.
    ///
    /// # Errors
    /// A text that is not understood, or a pixel out of range.
    pub fn from_toml(text: &str, file: &str) -> Result<Self, StackError> {
        let in_file = |why: String| StackError::File {
            file: file.to_owned(),
            why,
        };
        let stack: Self = toml::from_str(text).map_err(|e| in_file(e.to_string()))?;
        stack.check().map_err(|e| in_file(e.to_string()))?;
        Ok(stack)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::em::MetalWalls;

    #[test]
    fn built_in_files_are_the_papers_pixels_to_the_last_bit() {
        let best = |pitch: f64, filter| {
            let r = pitch * std::f64::consts::FRAC_1_SQRT_2;
            PixelStack::paper(pitch, r, r, filter)
        };
        let mut tungsten = best(2.8, 0.75);
        tungsten.metal = Some(MetalWalls {
            layer: "oxide".into(),
            width_um: 0.1,
            material: Material::Table("W_Rakic1998_LD".into()),
        });
        let meant = [
            ("3.5um", best(3.5, 1.0)),
            ("3.5um-roc3.5", PixelStack::paper(3.5, 3.5, 2.475, 1.0)),
            ("3.5um-thin-filter", best(3.5, 0.75)),
            ("2.8um", best(2.8, 0.75)),
            ("2.8um-tungsten", tungsten),
            ("1.6um", best(1.6, 0.75)),
        ];
        // All but the dual pixels, which are not the paper's, and the mosaic.
        assert_eq!(meant.len() + 3, PixelStack::builtin_names().len());
        for (name, meant) in meant {
            let meant = PixelStack {
                name: name.into(),
                ..meant
            };
            assert_eq!(PixelStack::builtin(name).unwrap(), meant);
        }
    }

    #[test]
    fn the_mosaic_is_the_small_pixel_under_other_filters() {
        let mut mosaic = PixelStack::builtin("1.6um-bayer").unwrap();
        let small = PixelStack::builtin("1.6um").unwrap();
        mosaic.mosaic = None;
        mosaic.name.clone_from(&small.name);
        mosaic.layers[1].material = small.layers[1].material.clone();
        assert_eq!(mosaic, small);
    }

    #[test]
    fn pixels_survive_toml() {
        for name in PixelStack::builtin_names() {
            let p = PixelStack::builtin(name).unwrap();
            let text = toml::to_string(&p).unwrap();
            assert_eq!(PixelStack::from_toml(&text, "p.toml").unwrap(), p);
        }
    }

    #[test]
    fn bad_pixels_are_refused_by_file_field_and_value() {
        type Change = fn(&mut PixelStack);
        let changes: [(Change, &str); 12] = [
            (|p| p.lens.radius_um = 2.0, "lens.radius_um is 2"),
            (|p| p.lens.radius_um = f64::NAN, "lens.radius_um is NaN"),
            (|p| p.lens.height_um = 2.4, "lens.height_um is 2.4"),
            (
                |p| p.layers[1].thickness_um = -0.1,
                "layers.filter.thickness_um is -0.1",
            ),
            (
                |p| p.layers[2].name = "filter".into(),
                "layers[2].name is `filter`",
            ),
            (|p| p.filter = Some("cfa".into()), "filter is `cfa`"),
            (
                |p| p.silicon = Material::Table("Si".into()),
                "silicon is Si",
            ),
            (
                |p| p.layers[0].material = Material::Constant { n: 1.5, k: -1.0 },
                "layers.planarization.material is n = 1.5, k = -1",
            ),
            (|p| p.trench_um = 1.6, "trench_um is 1.6"),
            (|p| p.silicon_um = 0.0, "silicon_um is 0"),
            (|p| p.pitch_um = 0.1, "pitch_um is 0.1"),
            (
                |p| {
                    p.metal = Some(MetalWalls {
                        layer: "glass".into(),
                        width_um: 0.1,
                        material: Material::Table("W_Rakic1998_LD".into()),
                    });
                },
                "metal.layer is `glass`",
            ),
        ];
        for (change, said) in changes {
            let mut p = PixelStack::builtin("3.5um").unwrap();
            change(&mut p);
            let text = toml::to_string(&p).unwrap();
            let e = PixelStack::from_toml(&text, "p.toml").unwrap_err();
            let e = e.to_string();
            assert!(e.contains("p.toml") && e.contains(said), "{e}");
        }
    }

    #[test]
    fn layers_may_be_of_no_thickness_or_absent() {
        let mut p = PixelStack::builtin("1.6um").unwrap();
        p.layers[0].thickness_um = 0.0;
        p.check().unwrap();
        p.layers.clear();
        p.filter = None;
        p.check().unwrap();
    }
}
