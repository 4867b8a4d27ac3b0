//! What a recipe may leave out: a chart's parameters, and fields of its readout.

use std::fmt;

use quadpixel::sensor::Subpixels;
use quadpixel::sensor::readout::ReadoutSettings;
use serde::de::value::{MapAccessDeserializer, MapDeserializer};
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use crate::charts::{ChartSpec, ImageFile, is_image};

/// Full well of a µm² of a sub-pixel, e⁻: that of datasets.
const FULL_WELL_E_UM2: f64 = 5000.0;

/// A chart as a table, or by the name of its kind (all its parameters at their defaults) or the path of an image, as in
/// the list of a dataset's charts.
pub(super) fn chart<'de, D: Deserializer<'de>>(deserializer: D) -> Result<ChartSpec, D::Error> {
    struct Chart;
    impl<'de> Visitor<'de> for Chart {
        type Value = ChartSpec;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            let kinds = ChartSpec::KINDS.join(", ");
            write!(
                f,
                "a table with its kind, one of {kinds}, or the path of an image"
            )
        }

        fn visit_str<E: Error>(self, name: &str) -> Result<ChartSpec, E> {
            if is_image(name) {
                return Ok(ChartSpec::Image(ImageFile { path: name.into() }));
            }
            let table = [("kind", name)].into_iter();
            ChartSpec::deserialize(MapDeserializer::new(table))
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<ChartSpec, A::Error> {
            ChartSpec::deserialize(MapAccessDeserializer::new(map))
        }
    }
    deserializer.deserialize_any(Chart)
}

/// A readout as written. What is absent has the value that a dataset's readout has, or the middle of its range.
#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Readout {
    photons_um2: f64,
    exposure_s: f64,
    dark_current_e_s: f64,
    full_well_e: Option<f64>,
    prnu: f64,
    read_noise_e: f64,
    gain_dn_per_e: Option<f64>,
    black_level: u16,
    bits: u32,
    subpixel_gains: Vec<f64>,
    sensor_seed: u64,
    shot_seed: u64,
}

impl Default for Readout {
    fn default() -> Self {
        Self {
            photons_um2: 500.0,
            exposure_s: 0.02,
            dark_current_e_s: 5.0,
            full_well_e: None,
            prnu: 0.01,
            read_noise_e: 2.0,
            gain_dn_per_e: None,
            black_level: 64,
            bits: 12,
            subpixel_gains: Vec::new(),
            sensor_seed: 1,
            shot_seed: 1,
        }
    }
}

/// A readout in which [`complete`] fills in a full well that is absent (NaN) and gains that are (none).
pub(super) fn readout<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<ReadoutSettings>, D::Error> {
    let written = Option::<Readout>::deserialize(deserializer)?;
    Ok(written.map(|r| ReadoutSettings {
        photons_um2: r.photons_um2,
        exposure_s: r.exposure_s,
        dark_current_e_s: r.dark_current_e_s,
        full_well_e: r.full_well_e.unwrap_or(f64::NAN),
        prnu: r.prnu,
        read_noise_e: r.read_noise_e,
        gain_dn_per_e: r.gain_dn_per_e,
        black_level: r.black_level,
        bits: r.bits,
        subpixel_gains: r.subpixel_gains,
        sensor_seed: r.sensor_seed,
        shot_seed: r.shot_seed,
    }))
}

/// Fills in what [`readout`] left open, for the sub-pixels of a sensor.
pub(super) fn complete(readout: &mut ReadoutSettings, pitch_um: f64, subpixels: Subpixels) {
    let count = subpixels.count();
    if readout.full_well_e.is_nan() {
        readout.full_well_e = pitch_um * pitch_um / count as f64 * FULL_WELL_E_UM2;
    }
    if readout.subpixel_gains.is_empty() {
        readout.subpixel_gains = vec![1.0; count];
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::config::ReadoutConfig;
    use crate::recipe::{Recipe, parse_recipe};

    fn recipe(chart: &str, readout: &str) -> Result<Recipe, String> {
        let text = format!(
            "planes = [{{ chart = {chart}, distance_mm = 500 }}]
             lens = {{ name = \"wide_US20120327520A1_emb3\" }}
             sensor = {{ pitch_um = 2.8, subpixels = \"2x2\", width = 8, height = 8 }}
             response = {{ model = \"geometric\" }}
             render = {{ rays_per_pixel = 1, seed = 1 }}
             {readout}"
        );
        parse_recipe(&text, "r.toml").map_err(|e| e.to_string())
    }

    #[test]
    fn a_chart_may_be_its_kind_alone_or_an_image() {
        for chart in ["\"constant\"", "{ kind = \"constant\" }"] {
            let wall = recipe(chart, "").unwrap();
            assert_eq!(
                wall.planes[0].chart,
                ChartSpec::Constant(Default::default())
            );
        }
        let image = recipe("\"a/b.png\"", "").unwrap();
        let path = "a/b.png".into();
        assert_eq!(image.planes[0].chart, ChartSpec::Image(ImageFile { path }));
        for wrong in ["\"wall\"", "{ kind = \"wall\" }"] {
            let error = recipe(wrong, "").unwrap_err();
            assert!(
                error.contains("`wall`") && error.contains("constant"),
                "{error}"
            );
        }
        let error = recipe("3", "").unwrap_err();
        assert!(
            error.contains("r.toml") && error.contains("siemens-star"),
            "{error}"
        );
    }

    #[test]
    fn an_empty_readout_is_within_that_of_datasets() {
        let found = recipe("\"constant\"", "readout = {}")
            .unwrap()
            .readout
            .unwrap();
        let dataset = ReadoutConfig::default();
        for (value, draw) in [
            (found.photons_um2, dataset.photons_um2),
            (found.exposure_s, dataset.exposure_s),
            (found.dark_current_e_s, dataset.dark_current_e_s),
            (found.full_well_e / (1.4 * 1.4), dataset.full_well_e_um2),
            (found.prnu, dataset.prnu),
            (found.read_noise_e, dataset.read_noise_e),
        ] {
            let (least, most) = draw.bounds();
            assert!(
                (least - 1e-9..=most + 1e-9).contains(&value),
                "{value}: {least} to {most}"
            );
        }
        assert_eq!(
            (found.black_level, found.bits),
            (dataset.black_level, dataset.bits)
        );
        assert_eq!(found.subpixel_gains, [1.0; 4]);
        assert_eq!(found.gain_dn_per_e, None);
        let given = recipe(
            "\"constant\"",
            "readout = { full_well_e = 7, subpixel_gains = [1, 2, 1, 1] }",
        );
        let given = given.unwrap().readout.unwrap();
        assert_eq!((given.full_well_e, given.subpixel_gains[1]), (7.0, 2.0));
        assert!(
            recipe("\"constant\"", "readout = { wells = 1 }")
                .unwrap_err()
                .contains("wells")
        );
    }
}
