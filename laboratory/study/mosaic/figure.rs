//! The mosaic study as a figure: P of both halves of the own colour, their ratio, and what other colours get.

use glam::DVec2;
use quadpixel::em::mosaic::{FilterColour, MICROLENSES};
use quadpixel::response::REJECTION_THRESHOLD;

use super::super::figures::sheet;
use super::report::NAMES;
use super::survey::{Band, Point, Survey, place};
use quadpixel_generators::plot::{Line, Panel};

/// On paper, by colour.
const COLOURS: [&str; 3] = ["#d1332b", "#2a9d3a", "#1f6fd0"];
const GREY: &str = "#666";

/// A column a wavelength.
pub(super) fn svg(title: &str, survey: &Survey) -> String {
    let rows = [halves, ratios, unlike].map(|row| survey.bands.iter().map(row).collect());
    sheet(title, &rows)
}

fn line(
    name: &str,
    colour: &'static str,
    dashed: bool,
    band: &Band,
    of: &dyn Fn(&Point) -> f64,
) -> Line {
    let points = band.points.iter().map(|p| DVec2::new(p.theta_deg, of(p)));
    Line {
        name: name.to_owned(),
        colour,
        dashed,
        marks: false,
        points: points.filter(|p| p.is_finite()).collect(),
    }
}

fn panel(band: &Band, title: &str, y_name: &'static str, most: f64, lines: Vec<Line>) -> Panel {
    Panel {
        title: format!("{} nm: {title}", band.wavelength_nm),
        x_name: "θ, deg (φ = 0)",
        y_name,
        x: (0.0, band.points.last().map_or(1.0, |p| p.theta_deg)),
        y: (0.0, most),
        ticks: (10.0, if most > 0.5 { 0.2 } else { 0.05 }),
        decades: false,
        level: None,
        lines,
    }
}

/// The first microlens of the band's colour, and its colour on paper.
fn shown(band: &Band) -> (usize, &'static str) {
    let colour = band.colour_place();
    (band.own().next().unwrap_or(0), COLOURS[colour])
}

fn halves(band: &Band) -> Panel {
    let ((i, colour), c) = (shown(band), band.colour_place());
    let lines = vec![
        line("P_A under the mosaic", colour, false, band, &|p| {
            p.mosaic[i].right
        }),
        line("P_B", colour, true, band, &|p| p.mosaic[i].left),
        line("P_A, own colour around", GREY, false, band, &|p| {
            p.alone[c].right
        }),
        line("P_B", GREY, true, band, &|p| p.alone[c].left),
    ];
    let highest = lines.iter().flat_map(|l| &l.points).map(|p| p.y);
    let most = 0.1 * (18.0 * highest.fold(0.05, f64::max)).ceil();
    panel(band, NAMES[i], "P", most, lines)
}

fn ratios(band: &Band) -> Panel {
    let ((_, colour), c) = (shown(band), band.colour_place());
    let mut lines: Vec<Line> = band
        .own()
        .enumerate()
        .map(|(nth, i)| {
            line(NAMES[i], colour, nth > 0, band, &|p| {
                p.mosaic[i].left / p.mosaic[i].right
            })
        })
        .collect();
    let alone = |p: &Point| p.alone[c].left / p.alone[c].right;
    lines.push(line("own colour around", GREY, false, band, &alone));
    Panel {
        level: Some(REJECTION_THRESHOLD),
        ..panel(band, "P_B / P_A", "ratio", 1.0, lines)
    }
}

fn unlike(band: &Band) -> Panel {
    let others = FilterColour::ALL.into_iter().filter(|c| *c != band.colour);
    let mut lines = Vec::new();
    for colour in others {
        let c = place(colour);
        let own = (0..MICROLENSES).filter(|i| FilterColour::OF_MICROLENSES[*i] == colour);
        let own: Vec<usize> = own.collect();
        let mean =
            |p: &Point| own.iter().map(|i| p.mosaic[*i].total).sum::<f64>() / own.len() as f64;
        lines.push(line(
            &format!("{}, mosaic", colour.name()),
            COLOURS[c],
            false,
            band,
            &mean,
        ));
        lines.push(line(
            &format!("{}, own colour around", colour.name()),
            COLOURS[c],
            true,
            band,
            &|p| p.alone[c].total,
        ));
    }
    let highest = lines.iter().flat_map(|l| &l.points).map(|p| p.y);
    let most = 0.05 * (30.0 * highest.fold(0.05, f64::max)).ceil();
    panel(band, "P of other colours", "P", most, lines)
}
