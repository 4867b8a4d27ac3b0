//! The paper's images: Fig. 10, Fig. 15 and Table 2.
//!
//! Each by rays alone, as in the paper, and with diffraction at the lens's aperture. "ML-1" and "ML-2" are stand-ins
//! ([`crate::stand_ins`]); the paper's own tables are not public to us.

use serde_json::Value;
use std::error::Error;

use crate::stand_ins;
use crate::tools::Tools;

/// Setups of Table 2: name for people, name for files.
pub const SETUPS: [(&str, &str); 3] = [
    ("ML-1 classic", "ml1-classic"),
    ("ML-1 diffractive", "ml1-diffractive"),
    ("ML-2 diffractive, Table 1 defects", "ml2-diffractive"),
];
/// Positions of Table 2, likewise, with the window.
pub const POSITIONS: [(&str, &str, &str); 2] = [
    ("centre", "centre", r#"{ at = "centre" }"#),
    (
        "10°/45°",
        "corner",
        r#"{ at = "chief-ray-angle", theta_deg = 10, phi_deg = 45 }"#,
    ),
];

/// Light at the lens: name for people, for files, the effects that are simulated.
pub const LIGHT: [(&str, &str, &str); 2] = [
    (
        "rays",
        "rays",
        "pixel-diffraction,cra-variation,dispersion,aberrations,vignetting",
    ),
    (
        "waves",
        "waves",
        "pixel-diffraction,lens-diffraction,cra-variation,dispersion,aberrations,vignetting",
    ),
];

pub const ALPHABET: &str = "chart = { kind = \"alphabet\" }\nchart_seed = 1";
const NOISE: &str = "chart = { kind = \"noise\", exponent = 1.0, contrast = 0.2, cutoff_texels = 40 }\nchart_seed = 7";

/// One capture of a flat chart at 750 mm.
pub struct Recipe<'a> {
    /// Lines of `[lens]`.
    pub lens: &'a str,
    pub pixel: &'a str,
    pub pitch_um: f64,
    pub classic: bool,
    pub side: usize,
    pub window: &'a str,
    pub chart: &'a str,
    pub texture_px: usize,
    pub rays: usize,
    /// Effects that are simulated.
    pub effects: &'a str,
}

impl Recipe<'_> {
    fn toml(&self) -> String {
        let response = if self.classic {
            // The box of eq. 2 for the lens's own F-number.
            "model = \"geometric\"".to_owned()
        } else {
            format!("model = \"wave\"\npixel = \"{}\"", self.pixel)
        };
        format!(
            "environment = [0, 0, 0]\n[lens]\n{}\n[sensor]\npitch_um = {}\nsubpixels = \"2x2\"\nwidth = {side}\nheight = {side}\nwindow = {}\n\
             microlens_shift = {{ rule = \"chief-ray\" }}\n[response]\n{response}\n[[planes]]\n{}\ntexture_px = {}\ndistance_mm = 750\n\
             [render]\nrays_per_pixel = {}\nseed = 3\n",
            self.lens,
            self.pitch_um,
            self.window,
            self.chart,
            self.texture_px,
            self.rays,
            side = self.side
        )
    }
}

/// What `qpalgo table` measured.
pub struct Captures {
    pub table: Value,
}

/// Renders, corrects, measures.
pub fn all(tools: &Tools) -> Result<Captures, Box<dyn Error>> {
    charts(tools)?;
    let (side, rays) = if tools.quick { (64, 32) } else { (150, 512) };
    let mut list = String::new();
    for (light, of_light, effects) in LIGHT {
        for (setup, file) in SETUPS {
            for (position, place, window) in POSITIONS {
                let name = |chart: &str| format!("{file}-{of_light}-{place}-{chart}");
                for (chart, text) in [("noise", NOISE), ("alphabet", ALPHABET)] {
                    let recipe = Recipe {
                        lens: &stand_ins::lens(file.starts_with("ml1")),
                        pixel: "1.6um",
                        pitch_um: 1.6,
                        classic: file.ends_with("classic"),
                        side,
                        window,
                        chart: text,
                        texture_px: 1024,
                        rays,
                        effects,
                    };
                    render(tools, &name(chart), &recipe)?;
                }
                let (noise, text) = (name("noise"), name("alphabet"));
                list += &format!(
                    "[[row]]\nsetup = \"{setup}, {light}\"\nposition = \"{position}\"\ncalibration = \"{noise}\"\ncapture = \"{text}\"\n"
                );
                correct(tools, &noise, &text)?;
            }
        }
    }
    tools.write("table2.toml", &list)?;
    let table = ["table", "table2.toml", "-o", "table2"];
    Ok(Captures {
        table: tools.json("table2", "qpalgo", &table)?,
    })
}

/// Fig. 10: the charts on a sensor of 1.75 µm sub-pixels.
fn charts(tools: &Tools) -> Result<(), Box<dyn Error>> {
    for (_, light, effects) in LIGHT {
        for (name, chart) in [
            (
                "fig10-resolution",
                "chart = { kind = \"resolution\" }\nchart_seed = 1",
            ),
            ("fig10-alphabet", ALPHABET),
        ] {
            let recipe = Recipe {
                lens: &stand_ins::lens(true),
                pixel: "3.5um",
                pitch_um: 3.5,
                classic: false,
                side: if tools.quick { 96 } else { 480 },
                window: r#"{ at = "centre" }"#,
                chart,
                texture_px: 2048,
                rays: if tools.quick { 16 } else { 128 },
                effects,
            };
            let name = format!("{name}-{light}");
            render(tools, &name, &recipe)?;
            views(tools, &name)?;
        }
    }
    Ok(())
}

/// Renders a recipe into the folder `name`.
pub fn render(tools: &Tools, name: &str, recipe: &Recipe) -> Result<(), Box<dyn Error>> {
    let file = format!("{name}.toml");
    tools.write(&file, &recipe.toml())?;
    let arguments = [
        "render",
        &file,
        "--out",
        name,
        "--effects",
        recipe.effects,
        "-q",
    ];
    tools.step(name, "qpgen", &arguments)?;
    Ok(())
}

/// Views and their sums of a capture, as pictures.
pub fn views(tools: &Tools, name: &str) -> Result<(), Box<dyn Error>> {
    let out = format!("{name}-views");
    tools.step(&out, "qpalgo", &["sai", name, "-o", &out])?;
    Ok(())
}

/// Raw and corrected sums for the eye, as the paper corrects: by block matching.
fn correct(tools: &Tools, noise: &str, text: &str) -> Result<(), Box<dyn Error>> {
    views(tools, text)?;
    let camera = format!("{noise}-camera");
    let file = format!("{camera}.json");
    let calibrate = [
        "correct-aberrations",
        "--calibration",
        noise,
        "--align",
        "texture",
        "-o",
        &file,
    ];
    tools.step(&camera, "qpalgo", &calibrate)?;
    let out = format!("{text}-corrected");
    let apply = ["correct-aberrations", "--apply", &file, text, "-o", &out];
    tools.step(&out, "qpalgo", &apply)?;
    Ok(())
}
