//! Spot diagrams, one panel per field, all at one scale, with the Airy disk.

use glam::DVec2;

use quadpixel::lens::Field;
use quadpixel::lens::{Lens, LensError};
use quadpixel::lens::{SPOT_LINES_NM, Spot, rms_radius};
use quadpixel::units::D_LINE_NM;
use quadpixel_generators::plot::{Svg, round_length};

const PANEL_PX: f64 = 220.0;
const GAP_PX: f64 = 16.0;
const HEAD_PX: f64 = 56.0;
const FOOT_PX: f64 = 76.0;
const UM_PER_MM: f64 = 1e3;
const COLOURS: [&str; 3] = ["#1f6fd0", "#2a9d3a", "#d1332b"];
const LINE_NAMES: [&str; 3] = ["F", "d", "C"];

/// Draws the spots of the field angles (degrees, above the axis) at the F, d and C lines; only d for a lens without
/// dispersion.
///
/// # Errors
/// [`LensError::Value`] for a field outside 0 to 90 degrees.
pub fn spots_svg(lens: &Lens, fields_deg: &[f64]) -> Result<String, LensError> {
    let lines = if lens.prescription().is_dispersive() {
        0..3
    } else {
        1..2
    };
    let panels = fields_deg
        .iter()
        .map(|&angle| {
            let spots = lines
                .clone()
                .map(|l| lens.spot(Field::up(angle), SPOT_LINES_NM[l]));
            Ok((angle, spots.collect::<Result<Vec<_>, _>>()?))
        })
        .collect::<Result<Vec<(f64, Vec<Spot>)>, LensError>>()?;
    // The Airy disk's radius, 1.22 λ N.
    let f_number = lens.paraxial(D_LINE_NM)?.f_number;
    let airy_um = 1.22 * D_LINE_NM * 1e-3 * f_number;
    let widest = panels
        .iter()
        .flat_map(|(_, spots)| centred_um(spots))
        .flatten()
        .map(|p| p.abs().max_element())
        .fold(1.3 * airy_um, f64::max);
    let scale = 0.5 * PANEL_PX / (1.08 * widest);

    let count = panels.len().max(1) as f64;
    let width = count * (PANEL_PX + GAP_PX) + GAP_PX;
    let mut svg = Svg::new(DVec2::new(width, HEAD_PX + PANEL_PX + FOOT_PX));
    svg.text(
        DVec2::new(GAP_PX, 22.0),
        "start",
        15.0,
        lens.prescription().title(),
    );
    let legend = format!("F/{f_number:.2}; circle: Airy disk, radius {airy_um:.2} µm");
    svg.text(DVec2::new(GAP_PX, 42.0), "start", 12.0, &legend);
    let mut x = width - GAP_PX - 100.0;
    for l in lines.clone() {
        svg.circle(
            DVec2::new(x, 38.0),
            3.5,
            &format!("fill=\"{}\"", COLOURS[l]),
        );
        svg.text(DVec2::new(x + 8.0, 42.0), "start", 12.0, LINE_NAMES[l]);
        x += 36.0;
    }
    for (k, (angle, spots)) in panels.iter().enumerate() {
        let corner = DVec2::new(GAP_PX + k as f64 * (PANEL_PX + GAP_PX), HEAD_PX);
        panel(&mut svg, corner, scale, airy_um);
        let middle = corner + 0.5 * PANEL_PX;
        for (points, line) in centred_um(spots).iter().zip(lines.clone()) {
            let style = format!("fill=\"{}\" fill-opacity=\"0.75\"", COLOURS[line]);
            for p in points {
                svg.circle(middle + DVec2::new(p.x, -p.y) * scale, 1.4, &style);
            }
        }
        let below = corner + DVec2::new(0.5 * PANEL_PX, PANEL_PX + 18.0);
        svg.text(below, "middle", 13.0, &format!("{angle:.2}°"));
        let note = describe(spots);
        svg.text(below + DVec2::new(0.0, 17.0), "middle", 12.0, &note);
    }
    let bar = round_length(0.5 * PANEL_PX / scale);
    let y = HEAD_PX + PANEL_PX + FOOT_PX - 16.0;
    let ends = [DVec2::new(GAP_PX, y), DVec2::new(GAP_PX + bar * scale, y)];
    svg.polyline(&ends, "stroke=\"black\" stroke-width=\"2\"");
    let label = ends[1] + DVec2::new(8.0, 4.0);
    svg.text(label, "start", 12.0, &format!("{bar} µm"));
    Ok(svg.finish())
}

fn panel(svg: &mut Svg, corner: DVec2, scale: f64, airy_um: f64) {
    let frame = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
        .map(|(x, y)| corner + PANEL_PX * DVec2::new(x, y));
    svg.polygon(&frame, "fill=\"none\" stroke=\"#999\"");
    let middle = corner + 0.5 * PANEL_PX;
    for arm in [DVec2::X, DVec2::Y] {
        let ends = [middle - 0.5 * PANEL_PX * arm, middle + 0.5 * PANEL_PX * arm];
        svg.polyline(&ends, "stroke=\"#ddd\"");
    }
    let style = "fill=\"none\" stroke=\"black\" stroke-width=\"1\"";
    svg.circle(middle, airy_um * scale, style);
}

/// The spots' points in µm from the centroid of all.
fn centred_um(spots: &[Spot]) -> Vec<Vec<DVec2>> {
    let all: Vec<DVec2> = spots.iter().flat_map(|s| s.points_mm.clone()).collect();
    let centroid = all.iter().sum::<DVec2>() / all.len().max(1) as f64;
    spots
        .iter()
        .map(|s| {
            s.points_mm
                .iter()
                .map(|&p| (p - centroid) * UM_PER_MM)
                .collect()
        })
        .collect()
}

fn describe(spots: &[Spot]) -> String {
    let all: Vec<DVec2> = spots.iter().flat_map(|s| s.points_mm.clone()).collect();
    let sent: usize = spots.iter().map(|s| s.sent).sum();
    match rms_radius(&all) {
        Some(rms) => {
            let share = 100.0 * all.len() as f64 / sent as f64;
            format!("RMS {:.2} µm, {share:.0} % of rays", rms * UM_PER_MM)
        }
        None => "no ray passes".into(),
    }
}
