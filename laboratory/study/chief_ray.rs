//! Lens shifts by chief-ray angle, and what they make of the response: the paper's Fig. 5 as polar plots of one
//! sub-pixel, θ outwards, φ around.

use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

use glam::DVec2;
use quadpixel::em::PixelModel;
use quadpixel::em::PixelStack;
use quadpixel::em::light::{PixelSolver, direction_cosines};
use quadpixel::response::ChiefRayShifts;
use rayon::prelude::*;
use serde_json::json;

use super::{StudyReport, write};
use crate::error::LaboratoryError;
use quadpixel_generators::observer::{Event, Observer};
use quadpixel_generators::plot::Svg;

/// Chief rays whose shift is found, deg (section 2.1.4).
const THETA_DEG: [f64; 3] = [10.0, 20.0, 30.0];
const AZIMUTHS: usize = 3;
/// Chief rays (θ, φ) whose response is drawn, deg: the rows of Fig. 5.
const DRAWN: [[(f64, f64); 4]; 2] = [
    [(0.0, 0.0), (10.0, 0.0), (20.0, 0.0), (30.0, 0.0)],
    [(20.0, 22.5), (20.0, 45.0), (30.0, 22.5), (30.0, 45.0)],
];
const WAVELENGTH_NM: f64 = 550.0;
/// Rings and sectors of a plot, deg.
const RINGS_DEG: [f64; 12] = [
    0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 50.0, 60.0, 70.0,
];
const SECTOR_DEG: f64 = 15.0;
/// Radius of a plot, and the square that it stands in, px.
const RADIUS: f64 = 110.0;
const SIDE: f64 = 270.0;

/// P of every sub-pixel for each drawn chief ray, in one direction.
struct Direction {
    theta_deg: f64,
    phi_deg: f64,
    shares: Vec<Vec<f64>>,
}

/// Studies the lens shifts by chief-ray angle (Fig. 5), for a cone that the sub-pixels share. Writes cra.csv,
/// cra-shifts.csv and cra.svg into the folder `out`.
///
/// # Errors
/// A pixel or a model that cannot be studied, or a disk that fails.
pub fn chief_ray(
    stack: &PixelStack,
    model: &PixelModel,
    cone_f_number: f64,
    out: &Path,
    observer: &dyn Observer,
) -> Result<StudyReport, LaboratoryError> {
    let pixel = model.solver_of_shifts(stack, WAVELENGTH_NM)?;
    let began = Instant::now();
    let progress = |done, total| observer.event(Event::Table { done, total });
    let map = ChiefRayShifts::for_pixel(
        pixel.as_ref(),
        cone_f_number,
        &THETA_DEG,
        AZIMUTHS,
        &progress,
    )?;
    let drawn = DRAWN.into_iter().flatten().map(|(theta, phi)| {
        let [u, v] = direction_cosines(theta, phi);
        ((theta, phi), map.at(u, v).shift_um)
    });
    let (chiefs, shifts): (Vec<(f64, f64)>, Vec<[f64; 2]>) = drawn.unzip();
    let all = directions(pixel.as_ref(), &shifts)?;
    observer.event(Event::End);
    let seconds = began.elapsed().as_secs_f64();

    let version = model.version();
    let table = shifts_csv(pixel.as_ref(), &map)?;
    let radius = 0.5 / cone_f_number;
    let files = [
        ("cra.csv", responses_csv(stack, &chiefs, &shifts, &all)),
        ("cra-shifts.csv", table.clone()),
        ("cra.svg", svg(stack, &chiefs, &all, (version, radius))),
    ];
    let files = write(out, &files)?;
    Ok(StudyReport {
        json: json!({
            "study": "cra", "pixel": stack.name, "model": version, "seconds": seconds, "files": files, "chief_ray_shifts": map
        }),
        table,
        summary: format!("{}, {version}, {seconds:.1} s", stack.name),
    })
}

fn directions(
    pixel: &dyn PixelSolver,
    shifts: &[[f64; 2]],
) -> Result<Vec<Direction>, quadpixel::em::light::SolverError> {
    let sectors = (360.0 / SECTOR_DEG) as usize;
    let around = |theta: f64| {
        let count = if theta == 0.0 { 1 } else { sectors };
        (0..count).map(move |i| (theta, SECTOR_DEG * i as f64))
    };
    let wanted: Vec<(f64, f64)> = RINGS_DEG.into_iter().flat_map(around).collect();
    let one = |(theta_deg, phi_deg): (f64, f64)| {
        let [u, v] = direction_cosines(theta_deg, phi_deg);
        let answers = pixel.under_shifts(u, v, shifts)?;
        Ok(Direction {
            theta_deg,
            phi_deg,
            shares: answers.into_iter().map(|a| a.mean.absorbed).collect(),
        })
    };
    wanted.into_par_iter().map(one).collect()
}

fn responses_csv(
    stack: &PixelStack,
    chiefs: &[(f64, f64)],
    shifts: &[[f64; 2]],
    all: &[Direction],
) -> String {
    let mut text = String::from(
        "chief_theta_deg,chief_phi_deg,shift_x_um,shift_y_um,theta_deg,phi_deg,subpixel,P\n",
    );
    for (k, ((theta, phi), [x, y])) in chiefs.iter().zip(shifts).enumerate() {
        for d in all {
            for (i, p) in d.shares[k].iter().enumerate() {
                let name = stack.subpixels.name(i);
                // Writing to a String cannot fail, here and below.
                let _ = writeln!(
                    text,
                    "{theta},{phi},{x:.4},{y:.4},{},{},{name},{p:.5}",
                    d.theta_deg, d.phi_deg
                );
            }
        }
    }
    text
}

/// The shifts found beside those of the first-order moving frame.
fn shifts_csv(pixel: &dyn PixelSolver, map: &ChiefRayShifts) -> Result<String, LaboratoryError> {
    let frame = pixel.frame()?;
    let mut text = String::from(
        "chief_theta_deg,chief_phi_deg,along_um,across_um,shift_x_um,shift_y_um,first_order_along_um\n",
    );
    for (i, theta) in map.theta_deg.iter().enumerate() {
        for (j, phi) in map.phi_deg.iter().enumerate() {
            let [along, across] = map.shift_um[i * map.phi_deg.len() + j];
            let [u, v] = direction_cosines(*theta, *phi);
            let [x, y] = map.at(u, v).shift_um;
            let [fx, fy] = frame.shift_for_chief_ray(u, v);
            let _ = writeln!(
                text,
                "{theta},{phi},{along:.4},{across:.4},{x:.4},{y:.4},{:.4}",
                -fx.hypot(fy)
            );
        }
    }
    Ok(text)
}

/// `radius`: of the cone, in (u, v).
fn svg(
    stack: &PixelStack,
    chiefs: &[(f64, f64)],
    all: &[Direction],
    (model, radius): (&str, f64),
) -> String {
    // The sub-pixel that the paper draws: right and low (A of a quad pixel).
    let s = stack.subpixels;
    let drawn = s.index(s.m() - 1, 0);
    let columns = DRAWN[0].len();
    let size = DVec2::new(columns as f64, DRAWN.len() as f64) * SIDE + DVec2::new(0.0, 30.0);
    let mut svg = Svg::new(size);
    let most = all
        .iter()
        .flat_map(|d| d.shares.iter().map(|p| p[drawn]))
        .fold(1e-9, f64::max);
    let title = format!(
        "P of sub-pixel {} of {}, model {model}; white 0, dark {most:.2}; θ to 70°, rings every 20°; circle: cone of the chief ray",
        s.name(drawn),
        stack.name
    );
    svg.text(DVec2::new(10.0, 20.0), "start", 13.0, &title);
    for (k, &chief) in chiefs.iter().enumerate() {
        let place = DVec2::new((k % columns) as f64 + 0.5, (k / columns) as f64 + 0.5);
        let centre = place * SIDE + DVec2::new(0.0, 38.0);
        let value = |d: &Direction| d.shares[k][drawn] / most;
        plot(&mut svg, centre, (chief, radius), value, all);
    }
    svg.finish()
}

fn at(centre: DVec2, theta_deg: f64, phi_deg: f64) -> DVec2 {
    let last = RINGS_DEG[RINGS_DEG.len() - 1];
    let (sin, cos) = phi_deg.to_radians().sin_cos();
    // y of the picture runs down.
    centre + RADIUS * theta_deg / last * DVec2::new(cos, -sin)
}

fn plot(
    svg: &mut Svg,
    centre: DVec2,
    ((chief_theta, chief_phi), radius): ((f64, f64), f64),
    value: impl Fn(&Direction) -> f64,
    all: &[Direction],
) {
    for d in all {
        let ring = RINGS_DEG
            .iter()
            .position(|t| *t == d.theta_deg)
            .unwrap_or(0);
        let half = |other: Option<&f64>| other.map_or(d.theta_deg, |t| 0.5 * (t + d.theta_deg));
        let outer = half(RINGS_DEG.get(ring + 1));
        let inner = half(ring.checked_sub(1).and_then(|r| RINGS_DEG.get(r)));
        let style = format!("fill=\"{}\"", shade(value(d)));
        if ring == 0 {
            svg.circle(centre, (at(centre, outer, 0.0) - centre).length(), &style);
            continue;
        }
        let (low, high) = (d.phi_deg - 0.5 * SECTOR_DEG, d.phi_deg + 0.5 * SECTOR_DEG);
        let corners = [
            at(centre, inner, low),
            at(centre, outer, low),
            at(centre, outer, d.phi_deg),
            at(centre, outer, high),
            at(centre, inner, high),
        ];
        svg.polygon(&corners, &style);
    }
    for theta in [20.0, 40.0, 60.0] {
        let radius = (at(centre, theta, 0.0) - centre).length();
        svg.circle(
            centre,
            radius,
            "fill=\"none\" stroke=\"#bbb\" stroke-width=\"0.5\"",
        );
    }
    let chief = direction_cosines(chief_theta, chief_phi);
    let rim: Vec<DVec2> = (0..=36)
        .map(|i| {
            let (sin, cos) = (10.0 * f64::from(i)).to_radians().sin_cos();
            let (u, v) = (chief[0] + radius * cos, chief[1] + radius * sin);
            at(
                centre,
                u.hypot(v).min(1.0).asin().to_degrees(),
                v.atan2(u).to_degrees(),
            )
        })
        .collect();
    svg.polyline(
        &rim,
        "fill=\"none\" stroke=\"#d1332b\" stroke-width=\"1.2\"",
    );
    let name = format!("chief ray θ {chief_theta}°, φ {chief_phi}°");
    svg.text(
        centre - DVec2::new(0.0, RADIUS + 7.0),
        "middle",
        12.0,
        &name,
    );
}

/// White to dark blue.
fn shade(value: f64) -> String {
    let x = value.clamp(0.0, 1.0);
    let mix = |full: f64| (255.0 + (full - 255.0) * x).round() as u8;
    format!("#{:02x}{:02x}{:02x}", mix(8.0), mix(32.0), mix(110.0))
}
