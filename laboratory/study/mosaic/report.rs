//! The mosaic study in numbers.

use std::fmt::Write;

use quadpixel::em::mosaic::{FilterColour, MICROLENSES};
use quadpixel::response::RejectionRanges;
use serde::Serialize;

use super::super::curve::TOTAL_WITHIN_DEG;
use super::survey::{Band, Halves, Point, Survey, place};

/// From this angle on what the weak half gets comes mostly from the neighbour (the paper, section 2.1.3: "P_B increases
/// again after 20°"), deg.
const BEYOND_DEG: f64 = 20.0;
/// Microlenses of the supercell by name: the greens by the colour beside them along x.
pub(super) const NAMES: [&str; MICROLENSES] =
    ["red", "green beside red", "green beside blue", "blue"];

/// One microlens at a wavelength of its own colour: under the mosaic, and in the period of its colour alone.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Summary {
    microlens: &'static str,
    wavelength_nm: f64,
    mosaic: Side,
    one_colour: Side,
    /// Angles beyond 20° at which the weak half gets no less in the period of one colour, and all of these angles.
    worst_case_at: usize,
    beyond_angles: usize,
    /// Mean within 30° of P of the microlenses of other colours, all sub-pixels, of this light: under the mosaic ...
    unlike_mosaic: f64,
    /// ... and through their own filters where all neighbours wear them too.
    unlike_alone: f64,
}

/// One of the two periods.
#[derive(Clone, Debug, Serialize)]
struct Side {
    r_a_deg: Option<f64>,
    r_b_deg: f64,
    acceptance_deg: Option<f64>,
    open: bool,
    /// Mean of P of all sub-pixels within 30°.
    total: f64,
    /// Mean of P of the weak half from 20° on.
    weak: Option<f64>,
    /// The same in parts of the strong half's.
    weak_to_strong: Option<f64>,
}

impl Side {
    fn new(band: &Band, of: &dyn Fn(&Point) -> Halves) -> Self {
        let (theta, ratio): (Vec<f64>, Vec<f64>) = band
            .points
            .iter()
            .map(|p| (p.theta_deg, of(p).left / of(p).right))
            .unzip();
        let ranges = RejectionRanges::from_curve(&theta, &ratio);
        let weak = mean(band, beyond, &|p| of(p).left);
        let strong = mean(band, beyond, &|p| of(p).right);
        Self {
            r_a_deg: ranges.r_a_deg,
            r_b_deg: ranges.r_b_deg,
            acceptance_deg: ranges.acceptance_deg,
            open: ranges.open,
            total: mean(band, within, &|p| of(p).total).unwrap_or(0.0),
            weak,
            weak_to_strong: weak.zip(strong).map(|(weak, strong)| weak / strong),
        }
    }
}

fn beyond(p: &Point) -> bool {
    p.theta_deg >= BEYOND_DEG - 1e-9
}

fn within(p: &Point) -> bool {
    p.theta_deg <= TOTAL_WITHIN_DEG + 1e-9
}

/// Mean over the points that count; `None` if none does.
fn mean(band: &Band, counts: fn(&Point) -> bool, of: &dyn Fn(&Point) -> f64) -> Option<f64> {
    let all = band.points.iter().filter(|p| counts(p));
    let (n, sum) = all.fold((0, 0.0), |(n, sum), p| (n + 1, sum + of(p)));
    (n > 0).then(|| sum / f64::from(n))
}

/// Every microlens at the wavelength of its colour.
pub(super) fn summary(survey: &Survey) -> Vec<Summary> {
    let of_band = |band| Band::own(band).map(move |i| one(band, i));
    survey.bands.iter().flat_map(of_band).collect()
}

fn one(band: &Band, microlens: usize) -> Summary {
    let colour = band.colour_place();
    let others: Vec<usize> = (0..MICROLENSES)
        .filter(|i| FilterColour::OF_MICROLENSES[*i] != band.colour)
        .collect();
    let over = |of: &dyn Fn(&Point, usize) -> f64| {
        let all = |p: &Point| others.iter().map(|i| of(p, *i)).sum::<f64>() / others.len() as f64;
        mean(band, within, &all).unwrap_or(0.0)
    };
    let far: Vec<&Point> = band.points.iter().filter(|p| beyond(p)).collect();
    let worst = far
        .iter()
        .filter(|p| p.alone[colour].left >= p.mosaic[microlens].left);
    Summary {
        microlens: NAMES[microlens],
        wavelength_nm: band.wavelength_nm,
        mosaic: Side::new(band, &|p| p.mosaic[microlens]),
        one_colour: Side::new(band, &|p| p.alone[colour]),
        worst_case_at: worst.count(),
        beyond_angles: far.len(),
        unlike_mosaic: over(&|p, i| p.mosaic[i].total),
        unlike_alone: over(&|p, i| p.alone[place(FilterColour::OF_MICROLENSES[i])].total),
    }
}

/// For a person.
pub(super) fn table(all: &[Summary]) -> String {
    let mut text = format!(
        "{:<18} {:>5} {:<10} {:>6} {:>7} {:>6} {:>7} {:>7} {:>12}   (total: mean within {TOTAL_WITHIN_DEG} deg; weak: mean from {BEYOND_DEG} deg on; \
         unlike: light of this colour in microlenses of others, mean within {TOTAL_WITHIN_DEG} deg)\n",
        "microlens", "nm", "neighbours", "R_a", "R_b", "total", "weak", "w/strong", "unlike"
    );
    let number = |x: Option<f64>| x.map_or("-".into(), |x| format!("{x:.4}"));
    for s in all {
        for (name, side, unlike) in [
            ("mosaic", &s.mosaic, s.unlike_mosaic),
            ("own colour", &s.one_colour, s.unlike_alone),
        ] {
            let more = if side.open { ">" } else { "" };
            // Writing to a String cannot fail, here and below.
            let _ = writeln!(
                text,
                "{:<18} {:>5} {name:<10} {:>6} {:>7} {:>6.3} {:>7} {:>8} {unlike:>12.4}",
                s.microlens,
                s.wavelength_nm,
                side.r_a_deg.map_or("never".into(), |x| format!("{x:.1}")),
                format!("{more}{:.1}", side.r_b_deg),
                side.total,
                number(side.weak),
                number(side.weak_to_strong),
            );
        }
    }
    for s in all {
        let _ = writeln!(
            text,
            "{}: the weak half gets no less with its own colour around at {} of {} angles from {BEYOND_DEG} deg on",
            s.microlens, s.worst_case_at, s.beyond_angles
        );
    }
    text
}

/// [`Summary`] as CSV; an empty cell is a value that does not exist.
pub(super) fn summary_csv(all: &[Summary]) -> String {
    let mut text = String::from(
        "microlens,wavelength_nm,neighbours,r_a_deg,r_b_deg,open,acceptance_deg,total,weak,weak_to_strong,unlike,worst_case_at,beyond_angles\n",
    );
    let cell = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.5}"));
    for s in all {
        for (name, side, unlike) in [
            ("mosaic", &s.mosaic, s.unlike_mosaic),
            ("own colour", &s.one_colour, s.unlike_alone),
        ] {
            let _ = writeln!(
                text,
                "{},{},{name},{},{:.3},{},{},{:.5},{},{},{unlike:.5},{},{}",
                s.microlens,
                s.wavelength_nm,
                cell(side.r_a_deg),
                side.r_b_deg,
                side.open,
                cell(side.acceptance_deg),
                side.total,
                cell(side.weak),
                cell(side.weak_to_strong),
                s.worst_case_at,
                s.beyond_angles,
            );
        }
    }
    text
}

/// Every microlens of both periods at every wavelength and angle.
pub(super) fn csv(survey: &Survey) -> String {
    let mut text =
        String::from("wavelength_nm,theta_deg,neighbours,microlens,p_left,p_right,p_total\n");
    for band in &survey.bands {
        for p in &band.points {
            let mosaic = p
                .mosaic
                .iter()
                .zip(NAMES)
                .map(|(h, name)| ("mosaic", name, h));
            let alone = p.alone.iter().zip(FilterColour::ALL);
            let alone = alone.map(|(h, colour)| ("own colour", colour.name(), h));
            for (neighbours, name, h) in mosaic.chain(alone) {
                let _ = writeln!(
                    text,
                    "{},{},{neighbours},{name},{:.5},{:.5},{:.5}",
                    band.wavelength_nm,
                    (p.theta_deg * 1e6).round() / 1e6,
                    h.left,
                    h.right,
                    h.total
                );
            }
        }
    }
    text
}
