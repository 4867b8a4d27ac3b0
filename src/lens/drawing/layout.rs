//! The section of a lens through its axis (y up, z to the right), with fans of rays.

use glam::{DVec2, DVec3};

use crate::lens::aim::{Aim, Field};
use crate::lens::error::LensError;
use crate::lens::placed::Lens;
use crate::lens::surface::Travel;
use crate::lens::system::{OpticalSystem, SurfaceKind};
use crate::lens::trace::{Clipping, trace_visiting};
use crate::svg::{Svg, round_length};
use crate::units::D_LINE_NM;

const WIDTH_PX: f64 = 960.0;
const LARGEST_HEIGHT_PX: f64 = 640.0;
const MARGIN_PX: f64 = 48.0;
/// Rays of a fan, and the part of the stop's radius that they reach.
const FAN: usize = 7;
const FAN_REACH: f64 = 0.98;
/// Length of the rays drawn in front of the lens, as part of its length.
const LEAD: f64 = 0.15;
const PROFILE_POINTS: usize = 33;
const COLOURS: [&str; 5] = ["#1f6fd0", "#2a9d3a", "#d1332b", "#b07c0a", "#7a3fb0"];

/// Draws the lens as it stands, with a fan of d-line rays for each field angle (degrees, above the axis).
///
/// # Errors
/// [`LensError::Value`] for a field outside 0 to 90 degrees.
pub fn layout_svg(lens: &Lens, fields_deg: &[f64]) -> Result<String, LensError> {
    let system = lens.at(D_LINE_NM)?;
    let fans = fields_deg
        .iter()
        .map(|&angle| fan(lens, &system, angle))
        .collect::<Result<Vec<_>, _>>()?;
    let sensor = sensor_line(&system, &fans);
    let profiles: Vec<Vec<DVec2>> = (0..system.surfaces.len())
        .map(|i| profile(&system, i))
        .collect();

    let drawn = || {
        let rays = fans.iter().flatten().flatten();
        rays.chain(profiles.iter().flatten()).chain(&sensor)
    };
    let low = drawn().copied().fold(DVec2::INFINITY, DVec2::min);
    let high = drawn().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
    let extent = high - low;
    let scale = ((WIDTH_PX - 2.0 * MARGIN_PX) / extent.x)
        .min((LARGEST_HEIGHT_PX - 3.0 * MARGIN_PX) / extent.y);
    let height = extent.y * scale + 3.0 * MARGIN_PX;
    let left = 0.5 * (WIDTH_PX - extent.x * scale);
    let place = |p: &DVec2| {
        DVec2::new(
            left + (p.x - low.x) * scale,
            1.5 * MARGIN_PX + (high.y - p.y) * scale,
        )
    };
    let placed = |points: &[DVec2]| points.iter().map(place).collect::<Vec<_>>();

    let mut svg = Svg::new(DVec2::new(WIDTH_PX, height));
    let axis = [DVec2::new(low.x, 0.0), DVec2::new(high.x, 0.0)];
    svg.polyline(
        &placed(&axis),
        "stroke=\"#aaa\" stroke-dasharray=\"8 3 2 3\" stroke-width=\"0.7\"",
    );
    for (i, surface) in lens.prescription().surfaces.iter().enumerate() {
        if surface.glass.is_some() {
            let mut outline = profiles[i].clone();
            outline.extend(profiles[i + 1].iter().rev());
            svg.polygon(
                &placed(&outline),
                "fill=\"#cfe3f2\" fill-opacity=\"0.75\" stroke=\"#34556e\" stroke-width=\"1\"",
            );
        }
    }
    for (k, rays) in fans.iter().enumerate() {
        let style = format!(
            "fill=\"none\" stroke=\"{}\" stroke-width=\"0.7\"",
            COLOURS[k % COLOURS.len()]
        );
        for ray in rays {
            svg.polyline(&placed(ray), &style);
        }
    }
    for tick in stop_ticks(&system, extent.y) {
        svg.polyline(&placed(&tick), "stroke=\"black\" stroke-width=\"2.5\"");
    }
    svg.polyline(&placed(&sensor), "stroke=\"black\" stroke-width=\"3\"");
    if let Some(z) = lens.prescription().fold_z_mm() {
        let half = 0.5 * system.surfaces[system.stop].aperture.semi_mm;
        let mirror = [DVec2::new(z - half, -half), DVec2::new(z + half, half)];
        svg.polyline(
            &placed(&mirror),
            "stroke=\"#888\" stroke-width=\"1.5\" stroke-dasharray=\"4 3\"",
        );
    }
    caption(&mut svg, lens, fields_deg, scale, height)?;
    Ok(svg.finish())
}

fn caption(
    svg: &mut Svg,
    lens: &Lens,
    fields_deg: &[f64],
    scale: f64,
    height: f64,
) -> Result<(), LensError> {
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
    let mut x = MARGIN_PX;
    let y = height - 20.0;
    for (k, angle) in fields_deg.iter().enumerate() {
        let style = format!(
            "stroke=\"{}\" stroke-width=\"2\"",
            COLOURS[k % COLOURS.len()]
        );
        svg.polyline(
            &[DVec2::new(x, y - 4.0), DVec2::new(x + 18.0, y - 4.0)],
            &style,
        );
        svg.text(
            DVec2::new(x + 23.0, y),
            "start",
            12.0,
            &format!("{angle:.1}°"),
        );
        x += 85.0;
    }
    let bar = round_length(150.0 / scale);
    let end = WIDTH_PX - MARGIN_PX;
    let ends = [
        DVec2::new(end - bar * scale, y - 4.0),
        DVec2::new(end, y - 4.0),
    ];
    svg.polyline(&ends, "stroke=\"black\" stroke-width=\"2\"");
    let label = DVec2::new(end - bar * scale - 6.0, y);
    svg.text(label, "end", 12.0, &format!("{bar} mm"));
    Ok(())
}

/// The section's point of a camera-frame point.
fn section(p: DVec3) -> DVec2 {
    DVec2::new(p.z, p.y)
}

/// The paths of one field's rays, from a little in front of the lens to the sensor; those that are lost are left out.
fn fan(lens: &Lens, system: &OpticalSystem, angle_deg: f64) -> Result<Vec<Vec<DVec2>>, LensError> {
    let field = Field::up(angle_deg);
    lens.check_field(field)?;
    let paraxial = lens.paraxial(D_LINE_NM)?;
    let Some(aim) = Aim::new(system, &paraxial, field, lens.focus_distance_mm()) else {
        return Ok(Vec::new());
    };
    let lead_mm = LEAD * system.sensor_z_mm;
    let path = |k: usize| {
        let unit = FAN_REACH * (2.0 * k as f64 / (FAN - 1) as f64 - 1.0);
        let ray = aim.ray_at(DVec2::new(0.0, unit))?;
        let mut points = Vec::new();
        let visit = |surface: usize, local: DVec3| {
            // A stop behind the glass that follows it would send the line there and back.
            if system.surfaces[surface].kind == SurfaceKind::Stop {
                return;
            }
            let point = system.surfaces[surface].pose.camera_point_mm(local);
            if points.is_empty() {
                points.push(section(point - lead_mm * ray.direction));
            }
            points.push(section(point));
        };
        let end = trace_visiting(system, ray, Travel::Forward, Clipping::All, visit).ok()?;
        points.push(section(end.origin_mm));
        Some(points)
    };
    Ok((0..FAN).filter_map(path).collect())
}

/// A surface's profile from −semi-aperture to +semi-aperture; empty for an open dummy.
fn profile(system: &OpticalSystem, i: usize) -> Vec<DVec2> {
    let surface = &system.surfaces[i];
    let semi = surface.aperture.semi_mm;
    if i == system.stop || !semi.is_finite() {
        return Vec::new();
    }
    (0..PROFILE_POINTS)
        .filter_map(|k| {
            let y = semi * (2.0 * k as f64 / (PROFILE_POINTS - 1) as f64 - 1.0);
            let local = DVec3::new(0.0, y, surface.sag_mm(y * y)?);
            Some(section(surface.pose.camera_point_mm(local)))
        })
        .collect()
}

/// Two strokes that end at the stop's edge.
fn stop_ticks(system: &OpticalSystem, extent_y: f64) -> [[DVec2; 2]; 2] {
    let stop = &system.surfaces[system.stop];
    let semi = stop.aperture.semi_mm;
    let outer = semi + 0.06 * extent_y;
    [1.0, -1.0].map(|side| {
        [semi, outer].map(|y| {
            let sag = stop.sag_mm(semi * semi).unwrap_or(0.0);
            section(stop.pose.camera_point_mm(DVec3::new(0.0, side * y, sag)))
        })
    })
}

/// The sensor, as far as the rays drawn reach either way.
fn sensor_line(system: &OpticalSystem, fans: &[Vec<Vec<DVec2>>]) -> [DVec2; 2] {
    let ends = fans.iter().flatten().filter_map(|ray| ray.last());
    let half = ends.map(|p| p.y.abs()).fold(0.0, f64::max);
    let half = if half > 0.0 { 1.05 * half } else { 1.0 };
    [-half, half].map(|y| DVec2::new(system.sensor_z_mm, y))
}
