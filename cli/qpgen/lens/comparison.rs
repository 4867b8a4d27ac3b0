//! Lenses against the figures in their own files, as Markdown.

use crate::{out, outln};
use quadpixel::lens::verification::{Comparison, Origin, compare};
use quadpixel::lens::{Prescription, builtin_names};
use serde_json::{Value, json};

use crate::exit::CommandError;
use crate::log::{Level, Log};

/// Compares the lenses (all built-in ones when none is named) and prints the table.
///
/// # Errors
/// [`CommandError::Input`] for lenses that cannot be read, when the others have been compared; [`CommandError::Failed`]
/// for one that differs from its own figures.
pub(super) fn run(names: &[String], json: bool, log: Log) -> Result<(), CommandError> {
    let names: Vec<String> = if names.is_empty() {
        builtin_names().into_iter().map(String::from).collect()
    } else {
        names.to_vec()
    };
    let (mut lenses, mut unread) = (Vec::new(), Vec::new());
    for name in names {
        let compared = Prescription::named(&name).and_then(|p| {
            super::warn(&p, log);
            compare(&p)
        });
        match compared {
            Ok(figures) => lenses.push((name, figures)),
            Err(error) => unread.push((name, error.to_string())),
        }
    }
    if json {
        let compared = lenses
            .iter()
            .map(|(name, figures)| lens_json(name, figures));
        let unread = unread
            .iter()
            .map(|(name, error)| json!({ "lens": name, "error": error }));
        let all: Vec<Value> = compared.chain(unread).collect();
        outln!("{}", json!({ "lenses": all }));
    } else {
        out!("{}", markdown(&lenses));
    }
    if let Some((_, first)) = unread.split_first() {
        // The last error is the command's own.
        let texts: Vec<&str> = unread.iter().map(|(_, error)| error.as_str()).collect();
        for text in &texts[..first.len()] {
            log.line(Level::Error, text, &[]);
        }
        return Err(CommandError::input(texts[first.len()]));
    }
    let unexplained: usize = lenses
        .iter()
        .map(|(name, figures)| count_unexplained(name, figures))
        .sum();
    if unexplained > 0 {
        let text = format!("{unexplained} figures differ from the lens file's own");
        return Err(CommandError::failed(text));
    }
    Ok(())
}

fn count_unexplained(name: &str, figures: &[Comparison]) -> usize {
    figures
        .iter()
        .filter(|c| !c.agrees() && c.why_it_differs(name).is_none())
        .count()
}

fn markdown(lenses: &[(String, Vec<Comparison>)]) -> String {
    let mut text = String::from(
        "| lens | EFL stated / verified / here, mm | F stated / verified / here | BFL verified / here, mm | figures | agree | \
         worst RMS spot, d and FdC |\n|---|---|---|---|---|---|---|\n",
    );
    for (name, figures) in lenses {
        let agree = figures.iter().filter(|c| c.agrees()).count();
        text += &format!(
            "| {name} | {} | {} | {} | {} | {agree} | {} |\n",
            triple(figures, "EFL, mm"),
            triple(figures, "F-number"),
            triple(figures, "BFL, mm"),
            figures.len(),
            worst_spot(figures),
        );
    }
    text += "\nFigures that differ:\n\n";
    for (name, figures) in lenses {
        for c in figures.iter().filter(|c| !c.agrees()) {
            let why = c.why_it_differs(name).unwrap_or("UNEXPLAINED");
            let field = c.field_deg.map_or(String::new(), |f| format!(" at {f}°"));
            let who = who(c.origin);
            text += &format!(
                "- {name}, {}{field}: {who} {}, here {}: {why}.\n",
                c.figure,
                number(c.given),
                number(c.found)
            );
        }
    }
    text += "\nOver the field (given by the independent tracer → found here):\n\n";
    text += "| lens | field ° | chief height, mm | chief ray ° | distortion % | rays of 241 | RMS d, µm | RMS FdC, µm |\n";
    text += "|---|---|---|---|---|---|---|---|\n";
    for (name, figures) in lenses {
        for row in rows_of_fields(figures) {
            let field = row[0].field_deg.unwrap_or(0.0);
            let cells: Vec<String> = row.iter().map(|c| pair(c)).collect();
            text += &format!("| {name} | {field} | {} |\n", cells.join(" | "));
        }
    }
    text
}

/// The figures over the field, one row per field angle.
fn rows_of_fields(figures: &[Comparison]) -> Vec<Vec<&Comparison>> {
    let mut rows: Vec<Vec<&Comparison>> = Vec::new();
    for c in figures.iter().filter(|c| c.field_deg.is_some()) {
        match rows
            .last_mut()
            .filter(|row| row[0].field_deg == c.field_deg)
        {
            Some(row) => row.push(c),
            None => rows.push(vec![c]),
        }
    }
    rows
}

/// stated / verified / found; what is not given is left out.
fn triple(figures: &[Comparison], figure: &str) -> String {
    let of = |origin| {
        figures
            .iter()
            .find(|c| c.origin == origin && c.figure == figure)
    };
    let (stated, verified) = (of(Origin::Stated), of(Origin::Verified));
    let found = verified.or(stated).and_then(|c| c.found);
    [
        stated.and_then(|c| c.given),
        verified.and_then(|c| c.given),
        found,
    ]
    .into_iter()
    .flatten()
    .map(|v| number(Some(v)))
    .collect::<Vec<_>>()
    .join(" / ")
}

/// The largest difference of an RMS spot, in µm and in parts of the spot.
fn worst_spot(figures: &[Comparison]) -> String {
    let differences = figures
        .iter()
        .filter(|c| c.figure.starts_with("RMS"))
        .filter_map(|c| {
            let (given, found) = (c.given?, c.found?);
            Some(((found - given).abs(), given))
        });
    match differences.max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((difference, given)) => {
            format!("{difference:.4} µm ({:.2} %)", 100.0 * difference / given)
        }
        None => String::new(),
    }
}

fn lens_json(name: &str, figures: &[Comparison]) -> Value {
    let all: Vec<Value> = figures
        .iter()
        .map(|c| {
            json!({
                "origin": who(c.origin), "figure": c.figure, "field_deg": c.field_deg, "given": c.given, "found": c.found,
                "tolerance": c.tolerance, "agrees": c.agrees(), "why_it_differs": c.why_it_differs(name),
            })
        })
        .collect();
    json!({ "lens": name, "unexplained": count_unexplained(name, figures), "figures": all })
}

fn who(origin: Origin) -> &'static str {
    match origin {
        Origin::Stated => "stated",
        Origin::Verified => "verified",
    }
}

fn pair(c: &Comparison) -> String {
    if c.given.is_none() && c.found.is_none() {
        return "–".into();
    }
    format!("{} → {}", number(c.given), number(c.found))
}

/// At most four decimals, no trailing zeros.
fn number(value: Option<f64>) -> String {
    value.map_or("–".into(), |v| {
        let rounded = (v * 1e4).round() / 1e4 + 0.0;
        format!("{rounded}")
    })
}
