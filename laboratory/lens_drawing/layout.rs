//! The section of a lens through its axis (y up, z to the right), with fans of rays.

use glam::DVec2;
use quadpixel::lens::{Lens, LensError, Section};
use quadpixel::units::D_LINE_NM;
use quadpixel_generators::plot::{Svg, round_length};

const WIDTH_PX: f64 = 960.0;
const LARGEST_HEIGHT_PX: f64 = 640.0;
const MARGIN_PX: f64 = 48.0;
/// Length of the strokes that mark the stop, as part of the drawing's height.
const STOP_STROKE: f64 = 0.06;
const COLOURS: [&str; 5] = ["#1f6fd0", "#2a9d3a", "#d1332b", "#b07c0a", "#7a3fb0"];
const AXIS: &str = "stroke=\"#aaa\" stroke-dasharray=\"8 3 2 3\" stroke-width=\"0.7\"";
const GLASS: &str = "fill=\"#cfe3f2\" fill-opacity=\"0.75\" stroke=\"#34556e\" stroke-width=\"1\"";
const STOP: &str = "stroke=\"black\" stroke-width=\"2.5\"";
const SENSOR: &str = "stroke=\"black\" stroke-width=\"3\"";
const MIRROR: &str = "stroke=\"#888\" stroke-width=\"1.5\" stroke-dasharray=\"4 3\"";

/// From millimetres of the section to pixels.
struct Scale {
    low: DVec2,
    high: DVec2,
    px_per_mm: f64,
}

impl Scale {
    /// The scale at which all that is drawn fits.
    fn new(section: &Section) -> Scale {
        let rays = section.fans.iter().flatten().flatten();
        let drawn = rays.chain(section.profiles.iter().flatten());
        let drawn = drawn.chain(&section.sensor).copied();
        let (low, high) = drawn.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
        let extent = high - low;
        let px_per_mm = ((WIDTH_PX - 2.0 * MARGIN_PX) / extent.x)
            .min((LARGEST_HEIGHT_PX - 3.0 * MARGIN_PX) / extent.y);
        Scale {
            low,
            high,
            px_per_mm,
        }
    }

    fn height_px(&self) -> f64 {
        (self.high.y - self.low.y) * self.px_per_mm + 3.0 * MARGIN_PX
    }

    fn px(&self, points: &[DVec2]) -> Vec<DVec2> {
        let left = 0.5 * (WIDTH_PX - (self.high.x - self.low.x) * self.px_per_mm);
        let place = |p: &DVec2| {
            let right_and_down = DVec2::new(p.x - self.low.x, self.high.y - p.y);
            DVec2::new(left, 1.5 * MARGIN_PX) + right_and_down * self.px_per_mm
        };
        points.iter().map(place).collect()
    }
}

/// Draws the lens as it stands, with a fan of d-line rays for each field angle (degrees, above the axis).
///
/// # Errors
/// [`LensError::Value`] for a field outside 0 to 90 degrees.
pub fn layout_svg(lens: &Lens, fields_deg: &[f64]) -> Result<String, LensError> {
    let section = lens.section(fields_deg)?;
    let scale = Scale::new(&section);
    let mut svg = Svg::new(DVec2::new(WIDTH_PX, scale.height_px()));
    let axis = [scale.low.x, scale.high.x].map(|z| DVec2::new(z, 0.0));
    svg.polyline(&scale.px(&axis), AXIS);
    for outline in &section.glasses {
        svg.polygon(&scale.px(outline), GLASS);
    }
    for (rays, colour) in section.fans.iter().zip(COLOURS.iter().cycle()) {
        let style = format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"0.7\"");
        for ray in rays {
            svg.polyline(&scale.px(ray), &style);
        }
    }
    let stroke_mm = STOP_STROKE * (scale.high.y - scale.low.y);
    for (edge, outward) in section.stop {
        svg.polyline(&scale.px(&[edge, edge + stroke_mm * outward]), STOP);
    }
    svg.polyline(&scale.px(&section.sensor), SENSOR);
    if let Some(mirror) = section.mirror {
        svg.polyline(&scale.px(&mirror), MIRROR);
    }
    title(&mut svg, lens)?;
    legend(&mut svg, fields_deg, &scale);
    Ok(svg.finish())
}

fn title(svg: &mut Svg, lens: &Lens) -> Result<(), LensError> {
    let p = lens.paraxial(D_LINE_NM)?;
    let folded = if lens.prescription().fold.is_some() {
        "; unfolded at the dashed mirror"
    } else {
        ""
    };
    let title = lens.prescription().title();
    svg.text(DVec2::new(MARGIN_PX, 22.0), "start", 15.0, title);
    let line = format!(
        "EFL {:.3} mm, F/{:.2}; d line{folded}",
        p.efl_mm, p.f_number
    );
    svg.text(DVec2::new(MARGIN_PX, 41.0), "start", 12.0, &line);
    Ok(())
}

/// The fields by colour, and a bar of a round length.
fn legend(svg: &mut Svg, fields_deg: &[f64], scale: &Scale) {
    let mut at = DVec2::new(MARGIN_PX, scale.height_px() - 20.0);
    let up = DVec2::new(0.0, 4.0);
    for (angle, colour) in fields_deg.iter().zip(COLOURS.iter().cycle()) {
        let style = format!("stroke=\"{colour}\" stroke-width=\"2\"");
        svg.polyline(&[at - up, at + DVec2::new(18.0, 0.0) - up], &style);
        let label = at + DVec2::new(23.0, 0.0);
        svg.text(label, "start", 12.0, &format!("{angle:.1}°"));
        at.x += 85.0;
    }
    let bar_mm = round_length(150.0 / scale.px_per_mm);
    let end = DVec2::new(WIDTH_PX - MARGIN_PX, at.y);
    let start = end - DVec2::new(bar_mm * scale.px_per_mm, 0.0);
    let style = "stroke=\"black\" stroke-width=\"2\"";
    svg.polyline(&[start - up, end - up], style);
    let label = start - DVec2::new(6.0, 0.0);
    svg.text(label, "end", 12.0, &format!("{bar_mm} mm"));
}
