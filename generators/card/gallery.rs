//! `index.html`: the contact sheets of a dataset on one page that opens from disk, with no script and no network.

use minijinja::Environment;
use minijinja::value::Serde;
use quadpixel_datasets::{Range, SampleEntry, SampleMeta, Split, paths};

use serde::Serialize;

use crate::preview::number;

/// The page, whose names and texts the template library escapes: they come from files that anybody may have written. A
/// Content-Security-Policy in it lets it load its own pictures and nothing else.
const TEMPLATE: &str = include_str!("gallery.html");

#[derive(Serialize)]
struct Page<'a> {
    total: usize,
    train: usize,
    val: usize,
    test: usize,
    manifest: &'static str,
    card: &'static str,
    samples: Vec<Shown<'a>>,
}

/// A sample on the page.
#[derive(Serialize)]
struct Shown<'a> {
    folder: String,
    sheet: &'static str,
    id: &'a str,
    split: &'static str,
    width: u32,
    height: u32,
    facts: Vec<(&'static str, String)>,
    files: Vec<&'a str>,
}

/// The page. `shown` are the samples that it shows, by their places in `entries`.
///
/// # Errors
/// A page that cannot be made of its template.
pub fn page(
    entries: &[SampleEntry],
    shown: &[(usize, SampleMeta)],
) -> Result<String, minijinja::Error> {
    let count = |split: Split| entries.iter().filter(|entry| entry.split == split).count();
    let [train, val, test] = Split::ALL.map(count);
    let samples = shown
        .iter()
        .map(|(place, meta)| card(&entries[*place], meta));
    let page = Page {
        total: entries.len(),
        train,
        val,
        test,
        manifest: paths::DATASET,
        card: paths::CARD,
        samples: samples.collect(),
    };
    // By the ending of its name a template of HTML, which is escaped.
    Environment::new().render_named_str(paths::INDEX, TEMPLATE, Serde(page))
}

fn card<'a>(entry: &'a SampleEntry, meta: &'a SampleMeta) -> Shown<'a> {
    let sheet = paths::PREVIEW;
    let size = meta.files.iter().find(|file| file.name == sheet);
    let (width, height) = size.map_or((0, 0), |file| (file.width, file.height));
    let names = meta.files.iter().map(|file| file.name.as_str());
    let names = names.filter(|name| *name != sheet);
    Shown {
        folder: format!("{}/{}", paths::SAMPLES, entry.id),
        sheet,
        id: &entry.id,
        split: entry.split.name(),
        width,
        height,
        facts: facts(meta),
        files: names.chain([paths::CAMERA, paths::META]).collect(),
    }
}

fn facts(meta: &SampleMeta) -> Vec<(&'static str, String)> {
    let between = |range: Option<Range>, unit: &str| match range {
        Some(Range { min, max }) if min == max => format!("{} {unit}", number(min)),
        Some(Range { min, max }) => format!("{} to {} {unit}", number(min), number(max)),
        None => "none".to_string(),
    };
    let focus = match meta.focus.distance_m {
        Some(distance) => format!("{} m", number(distance)),
        None => "infinity".to_string(),
    };
    let sensor = &meta.sensor;
    let pixels = format!(
        "{} × {} of {} µm, {} × {} sub-pixels, {} response",
        sensor.width_px,
        sensor.height_px,
        number(sensor.pitch_um),
        sensor.subpixels.m(),
        sensor.subpixels.n(),
        meta.response.label()
    );
    let lens = format!(
        "{}, f = {} mm, F/{}",
        meta.lens.name,
        number(meta.lens.efl_mm),
        number(meta.lens.f_number)
    );
    vec![
        ("lens", lens),
        ("focus", focus),
        ("charts", meta.scene.charts.join(", ")),
        ("depth", between(meta.ranges.depth_m, "m")),
        ("disparity dx", between(meta.ranges.dx_px, "px")),
        ("blur", between(meta.ranges.coc_px, "px")),
        ("pixels", pixels),
    ]
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn names_from_a_dataset_cannot_write_markup() {
        let shown = Shown {
            folder: "samples/000000".into(),
            sheet: paths::PREVIEW,
            id: "\" onload=\"x",
            split: "train",
            width: 1,
            height: 1,
            facts: vec![("lens", "<script>alert('x')</script>&".into())],
            files: vec!["'><img src=x>"],
        };
        let page = Page {
            total: 2,
            train: 1,
            val: 1,
            test: 0,
            manifest: paths::DATASET,
            card: paths::CARD,
            samples: vec![shown],
        };
        let html = Environment::new()
            .render_named_str(paths::INDEX, TEMPLATE, Serde(page))
            .unwrap();
        assert!(
            html.contains("2 samples: 1 train, 1 val, 0 test; 1 of them, evenly spread"),
            "{html}"
        );
        for markup in ["<script>", "<img src=x", "onload=\"x"] {
            assert!(!html.contains(markup), "{markup}: {html}");
        }
        assert!(html.contains("&lt;script&gt;"), "{html}");
        assert!(html.contains("Content-Security-Policy"));
    }
}
