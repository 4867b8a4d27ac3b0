//! Which lenses stand in for the paper's ML-1 and ML-2, and how they were chosen.
//!
//! The paper prints the sharpness De of its raw pictures at the centre and at 10°/45°. What comes nearest to both
//! stands in: of the library's wide lenses for ML-1, of defects within the ranges of the paper's Table 1 for ML-2. Both
//! by rays, as the paper's pictures are. Nearest: least root of the sum of squares of ln(De / the paper's De).

use std::error::Error;

use quadpixel::sampling::uniform;
use serde_json::Value;

use crate::captures::{ALPHABET, LIGHT, POSITIONS, Recipe, render, views};
use crate::tools::Tools;

const ML1: &str = "wide_US8345358B2_table12";
const ML2: &str = "tele_US10571665B2_220b";
/// Parts of Table 1's defects, in the order of [`with_defects`]: what [`choose`] found.
const ML2_PARTS: [f64; DEFECTS] = [
    0.156, -0.454, 0.854, -0.509, -0.139, 1.0, -0.087, -1.0, -0.636, -0.690, 0.021,
];
/// De at the centre and at 10°/45° of the paper's raw pictures: ML-1 classic, ML-2 diffractive.
const ML1_PAPER: [f64; 2] = [0.2378, 0.0703];
const ML2_PAPER: [f64; 2] = [0.2059, 0.0361];
const WIDE: [&str; 7] = [
    "wide_US20120327520A1_emb3",
    "wide_US20120327520A1_emb5",
    "wide_US11940605B2_emb1",
    "wide_US11940605B2_emb9",
    "wide_US8345358B2_table12",
    "wide_US9261676B2_table9",
    "wide_deeplens_cellphone80deg",
];
/// Defects of Table 1 that are not zero.
const DEFECTS: usize = 11;
/// Draws over the whole ranges, then steps about the best so far.
const DRAWS: usize = 64;
const STEPS: usize = 96;
const SEED: u64 = 1;

/// Lines of `[lens]` of ML-1 or else of ML-2.
pub fn lens(is_ml1: bool) -> String {
    if is_ml1 {
        focused(ML1)
    } else {
        with_defects(&ML2_PARTS)
    }
}

fn focused(name: &str) -> String {
    format!("name = \"{name}\"\nfocus_mm = 750")
}

/// ML-2 with these parts of Table 1's defects, to a thousandth.
fn with_defects(parts: &[f64; DEFECTS]) -> String {
    let [dz1, dx2, dy2, tip, tilt, dx3, dy3, tip3, tilt3, dx4, dy4] = parts;
    format!(
        "{}\nmisalignments = [{{ element = 1, dz_um = {:.4} }}, {{ element = 2, dx_um = {:.4}, dy_um = {:.4} }},
  {{ element = \"mirror\", tip_deg = {:.4}, tilt_deg = {:.4} }},
  {{ element = 3, dx_um = {:.4}, dy_um = {:.4}, tip_deg = {:.4}, tilt_deg = {:.4} }},
  {{ element = 4, dx_um = {:.4}, dy_um = {:.4} }}]",
        focused(ML2),
        1.5 * dz1,
        6.0 * dx2,
        6.0 * dy2,
        0.625 * tip,
        0.25 * tilt,
        9.0 * dx3,
        5.0 * dy3,
        0.2 * tip3,
        0.2 * tilt3,
        4.0 * dx4,
        2.5 * dy4
    )
}

/// Surveys the library, searches the defects and prints both as tables.
pub fn choose(tools: &Tools) -> Result<(), Box<dyn Error>> {
    println!("| ML-1 by | De, centre | De, 10°/45° | distance |\n|---|---|---|---|");
    println!("| the paper | {} | {} | |", ML1_PAPER[0], ML1_PAPER[1]);
    for name in WIDE {
        let de = sharpness(tools, name, &focused(name), true)?;
        let d = distance(de, ML1_PAPER);
        println!("| {name} | {:.4} | {:.4} | {d:.3} |", de[0], de[1]);
    }
    println!("\n| ML-2 by | De, centre | De, 10°/45° | distance |\n|---|---|---|---|");
    println!("| the paper | {} | {} | |", ML2_PAPER[0], ML2_PAPER[1]);
    for (name, part) in [("no defects", 0.0), ("Table 1 as it is", 1.0)] {
        let file = format!("ml2-part-{part}");
        let de = sharpness(tools, &file, &with_defects(&[part; DEFECTS]), false)?;
        let d = distance(de, ML2_PAPER);
        println!("| {name} | {:.4} | {:.4} | {d:.3} |", de[0], de[1]);
    }
    let mut best = ([0.0; DEFECTS], f64::INFINITY);
    let mut width = 1.0;
    for step in 0..DRAWS + STEPS {
        let about = step >= DRAWS;
        let drawn = |k: usize| 2.0 * uniform(SEED, &[step as u64, k as u64]) - 1.0;
        let parts = std::array::from_fn(|k| match about {
            false => drawn(k),
            true => (best.0[k] + width * drawn(k)).clamp(-1.0, 1.0),
        });
        let de = sharpness(
            tools,
            &format!("ml2-draw-{step}"),
            &with_defects(&parts),
            false,
        )?;
        let d = distance(de, ML2_PAPER);
        if d < best.1 {
            best = (parts, d);
            println!("| draw {step} | {:.4} | {:.4} | {d:.3} |", de[0], de[1]);
            width = (1.5 * width).min(1.0);
        } else if about {
            width = (0.93 * width).max(0.05);
        }
    }
    println!("\nParts of Table 1's defects: {:.4?}", best.0);
    Ok(())
}

/// De of the green channel of the raw sum at the two positions, by rays.
fn sharpness(
    tools: &Tools,
    name: &str,
    lens: &str,
    classic: bool,
) -> Result<[f64; 2], Box<dyn Error>> {
    let mut de = [0.0; 2];
    for (de, (_, place, window)) in de.iter_mut().zip(POSITIONS) {
        let recipe = Recipe {
            lens,
            pixel: "1.6um",
            pitch_um: 1.6,
            classic,
            side: if tools.quick { 64 } else { 150 },
            window,
            chart: ALPHABET,
            texture_px: 1024,
            rays: if tools.quick { 16 } else { 96 },
            effects: LIGHT[0].2,
        };
        let name = format!("chosen-{name}-{place}");
        render(tools, &name, &recipe)?;
        views(tools, &name)?;
        let sum = format!("{name}-views/sum_all.exr");
        let measured = tools.json(
            &format!("{name}-sharpness"),
            "qpalgo",
            &["sharpness", &sum, "--preset", "table-2"],
        )?;
        let of = |image: &Value| (image["channel"] == 1).then(|| image["de"].as_f64())?;
        let images = measured["images"].as_array().into_iter().flatten();
        *de = images.filter_map(of).next().ok_or("no De of green")?;
    }
    Ok(de)
}

fn distance(de: [f64; 2], paper: [f64; 2]) -> f64 {
    (de[0] / paper[0]).ln().hypot((de[1] / paper[1]).ln())
}
