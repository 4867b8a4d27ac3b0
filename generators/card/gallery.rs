//! `index.html`: the contact sheets of a dataset on one page that opens from disk, with no script and no network.

use maud::{DOCTYPE, Markup, PreEscaped, html};
use quadpixel_datasets::{Range, SampleEntry, SampleMeta, Split, paths};

use crate::preview::number;

const STYLE: &str = "\
:root{color-scheme:dark}\
body{margin:0;padding:2rem clamp(1rem,4vw,4rem);background:#161618;color:#ddd;font:16px/1.5 system-ui,sans-serif}\
h1{font-size:1.6rem;margin:0}p.lead{color:#999;margin:.3rem 0 2rem}\
main{display:grid;gap:1.5rem;grid-template-columns:repeat(auto-fill,minmax(min(100%,34rem),1fr))}\
article{background:#202022;border:1px solid #333;border-radius:10px;overflow:hidden}\
img{display:block;width:100%;height:auto}\
.text{padding:.8rem 1rem 1rem}h2{font-size:1.05rem;margin:0 0 .5rem;display:flex;gap:.6rem;align-items:center}\
.split{font-size:.75rem;font-weight:600;padding:.05rem .5rem;border-radius:1rem;background:#2f4a3a;color:#bfe5cd}\
.val{background:#4a432f;color:#e8dcb4}.test{background:#4a2f3c;color:#eabfd2}\
dl{display:grid;grid-template-columns:auto 1fr;gap:.1rem .9rem;margin:0;font-size:.9rem}\
dt{color:#999}dd{margin:0}.files{margin:.7rem 0 0;font-size:.85rem}a{color:#8ab4f8}";

/// What the page may load: its own pictures and style, and nothing of anybody else, whatever a name in it says.
const POLICY: &str = "default-src 'none'; img-src 'self' file:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'";

/// The page. `shown` are the samples that it shows, by their places in `entries`.
pub fn page(entries: &[SampleEntry], shown: &[(usize, SampleMeta)]) -> String {
    let count = |split: Split| entries.iter().filter(|entry| entry.split == split).count();
    let [train, val, test] = Split::ALL.map(count);
    let total = entries.len();
    let some = match shown.len() {
        all if all == total => String::new(),
        some => format!("; {some} of them, evenly spread, are shown"),
    };
    let html = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width,initial-scale=1";
                title { "quadpixel dataset" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { "quadpixel dataset" }
                p.lead {
                    (total) " samples: " (train) " train, " (val) " val, " (test) " test" (some) ". "
                    a href=(paths::DATASET) { (paths::DATASET) } ", " a href=(paths::CARD) { "data card" }
                }
                main {
                    @for (place, meta) in shown { (card(&entries[*place], meta)) }
                }
            }
        }
    };
    // A line per sample, for who compares two of them.
    html.into_string().replace("</article>", "</article>\n") + "\n"
}

fn card(entry: &SampleEntry, meta: &SampleMeta) -> Markup {
    let folder = format!("{}/{}", paths::SAMPLES, entry.id);
    let (sheet, id, split) = (paths::PREVIEW, &entry.id, entry.split.name());
    let size = meta.files.iter().find(|file| file.name == sheet);
    let (width, height) = size.map_or((0, 0), |file| (file.width, file.height));
    let names = meta.files.iter().map(|file| file.name.as_str());
    let names = names.filter(|name| *name != sheet);
    let picture = format!("{folder}/{sheet}");
    html! {
        article {
            a href=(picture) {
                img src=(picture) width=(width) height=(height) loading="lazy" alt={ "contact sheet of sample " (id) };
            }
            div.text {
                h2 { (id) " " span class={ "split " (split) } { (split) } }
                dl {
                    @for (term, text) in facts(meta) { dt { (term) } dd { (text) } }
                }
                p.files {
                    @for name in names.chain([paths::CAMERA, paths::META]) {
                        a href={ (folder) "/" (name) } { (name) } " "
                    }
                }
            }
        }
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
mod tests {
    use super::*;

    #[test]
    fn names_from_a_configuration_cannot_write_markup() {
        let text = "<img src=\"x\">&";
        let shown = html! { a title=(text) { (text) } }.into_string();
        let safe = "&lt;img src=&quot;x&quot;&gt;&amp;";
        assert_eq!(shown, format!("<a title=\"{safe}\">{safe}</a>"));
        assert!(page(&[], &[]).contains("Content-Security-Policy"));
    }
}
