//! Tables as files: CSV for programs, Markdown for people.

use std::fmt::Write;

use super::row::Table;

/// Every row of a table. Text is quoted.
pub fn csv(table: &Table) -> String {
    let mut text = String::from("knob,curve,setting,seconds,seconds_unit,error,error_unit\n");
    for curve in &table.curves {
        for r in &curve.rows {
            // Writing to a String cannot fail, here and below.
            let _ = writeln!(
                text,
                "{},\"{}\",\"{}\",{:e},\"{}\",{:e},\"{}\"",
                table.knob,
                curve.name,
                r.setting,
                r.seconds,
                table.seconds_unit,
                r.error,
                table.error_unit
            );
        }
    }
    text
}

/// Every table, with its work, its reference and what it shows.
pub fn markdown(tables: &[Table]) -> String {
    let mut text = String::new();
    for table in tables {
        let _ = writeln!(
            text,
            "## {}\nWork: {}.\n\nReference: {}.\n",
            table.knob, table.work, table.reference
        );
        let _ = writeln!(
            text,
            "| | setting | {} | {} |\n|---|---|---|---|",
            table.seconds_unit, table.error_unit
        );
        for curve in &table.curves {
            for r in &curve.rows {
                let _ = writeln!(
                    text,
                    "| {} | {} | {} | {} |",
                    curve.name,
                    r.setting,
                    short(r.seconds),
                    short(r.error)
                );
            }
        }
        text.push('\n');
        for note in &table.notes {
            let _ = writeln!(text, "- {note}");
        }
        text.push('\n');
    }
    text
}

/// Three digits that count.
pub fn short(x: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    let decades = x.abs().log10().floor();
    if !(-4.0..6.0).contains(&decades) {
        return format!("{x:.1e}");
    }
    let digits = (2.0 - decades).max(0.0) as usize;
    format!("{x:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::short;

    #[test]
    fn numbers_keep_three_digits_that_count() {
        let shown = [0.0, 12345.6, 123.4, 1.234, 0.001234, 1.2e-7].map(short);
        assert_eq!(shown, ["0", "12346", "123", "1.23", "0.00123", "1.2e-7"]);
    }
}
