//! The mosaic study as a figure: P of both halves of the own colour, their ratio, and what other colours get.

use glam::DVec2;
use quadpixel::em::mosaic::{FilterColour, MICROLENSES};
use quadpixel::response::REJECTION_THRESHOLD;

use super::report::NAMES;
use super::survey::{Band, Point, Survey, place};
use quadpixel_generators::plot::{Axis, Chart, Guide, Series, sheet};

/// On paper, by colour.
const COLOURS: [&str; 3] = ["#d1332b", "#2a9d3a", "#1f6fd0"];
const GREY: &str = "#666";

/// A column per wavelength.
pub(super) fn svg(title: &str, survey: &Survey) -> String {
    let rows = [halves, ratios, unlike].map(|row| survey.bands.iter().map(row).collect());
    sheet(title, &rows)
}

fn line(name: &str, colour: &'static str, band: &Band, value: impl Fn(&Point) -> f64) -> Series {
    let points = band.points.iter();
    let points = points.map(|p| DVec2::new(p.theta_deg, value(p)));
    Series::line(name, colour, points.filter(|p| p.is_finite()).collect())
}

fn chart(band: &Band, title: &str, y_name: &str, top: f64, series: Vec<Series>) -> Chart {
    let last = band.points.last().map_or(1.0, |p| p.theta_deg);
    let step = if top > 0.5 { 0.2 } else { 0.05 };
    Chart::new(
        format!("{} nm: {title}", band.wavelength_nm),
        Axis::linear("θ, deg (φ = 0)", (0.0, last), 10.0),
        Axis::linear(y_name, (0.0, top), step),
        series,
    )
}

/// The first microlens of the band's colour, and its colour on paper.
fn shown(band: &Band) -> (usize, &'static str) {
    let colour = band.colour_place();
    (band.own().next().unwrap_or(0), COLOURS[colour])
}

fn halves(band: &Band) -> Chart {
    let ((i, colour), c) = (shown(band), band.colour_place());
    let series = vec![
        line("P_A under the mosaic", colour, band, |p| p.mosaic[i].right),
        line("P_B", colour, band, |p| p.mosaic[i].left).dashed(),
        line("P_A, own colour around", GREY, band, |p| p.alone[c].right),
        line("P_B", GREY, band, |p| p.alone[c].left).dashed(),
    ];
    let highest = series.iter().map(Series::highest).fold(0.05, f64::max);
    let top = 0.1 * (18.0 * highest).ceil();
    chart(band, NAMES[i], "P", top, series)
}

fn ratios(band: &Band) -> Chart {
    let ((_, colour), c) = (shown(band), band.colour_place());
    let ratio = |i: usize| {
        line(NAMES[i], colour, band, |p| {
            p.mosaic[i].left / p.mosaic[i].right
        })
    };
    let mut series: Vec<Series> = band
        .own()
        .enumerate()
        .map(|(nth, i)| if nth > 0 { ratio(i).dashed() } else { ratio(i) })
        .collect();
    let alone = |p: &Point| p.alone[c].left / p.alone[c].right;
    series.push(line("own colour around", GREY, band, alone));
    Chart {
        guides: vec![Guide::Y(REJECTION_THRESHOLD)],
        ..chart(band, "P_B / P_A", "ratio", 1.0, series)
    }
}

fn unlike(band: &Band) -> Chart {
    let others = FilterColour::ALL.into_iter().filter(|c| *c != band.colour);
    let mut series = Vec::new();
    for colour in others {
        let c = place(colour);
        let same = (0..MICROLENSES).filter(|i| FilterColour::OF_MICROLENSES[*i] == colour);
        let same: Vec<usize> = same.collect();
        let mean =
            |p: &Point| same.iter().map(|i| p.mosaic[*i].total).sum::<f64>() / same.len() as f64;
        let mosaic = format!("{}, mosaic", colour.name());
        series.push(line(&mosaic, COLOURS[c], band, mean));
        let alone = format!("{}, own colour around", colour.name());
        series.push(line(&alone, COLOURS[c], band, |p| p.alone[c].total).dashed());
    }
    let highest = series.iter().map(Series::highest).fold(0.05, f64::max);
    let top = 0.05 * (30.0 * highest).ceil();
    chart(band, "P of other colours", "P", top, series)
}
