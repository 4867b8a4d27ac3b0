//! The grid of dots to be printed and photographed out of focus, as SVG in mm.

use std::fmt::Write;

use quadpixel::range::{OutOfRange, within};

/// Length of the bar that tells whether it was printed at its size, mm.
const BAR_MM: f64 = 100.0;
/// Around the dots, and below them for the numbers, mm.
const MARGIN_MM: f64 = 10.0;

/// A grid of white dots on black.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DotTarget {
    /// Width and height of the sheet, mm.
    pub sheet_mm: [f64; 2],
    /// Distance of dots along both sides, mm.
    pub pitch_mm: f64,
    /// Diameter of a dot, mm.
    pub dot_mm: f64,
}

impl DotTarget {
    /// The sheet as SVG with its numbers.
    ///
    /// # Errors
    /// A sheet too small or too large, dots that touch or do not fit.
    pub fn svg(&self) -> Result<String, OutOfRange> {
        let Self {
            sheet_mm: [width, height],
            pitch_mm,
            dot_mm,
        } = *self;
        within("target", "sheet width", width, 120.0..=5000.0)?;
        within("target", "sheet height", height, 80.0..=5000.0)?;
        within(
            "target",
            "pitch_mm",
            pitch_mm,
            2.0..=0.25 * width.min(height),
        )?;
        within("target", "dot_mm", dot_mm, 0.05..=0.5 * pitch_mm)?;
        let count =
            |length: f64| ((length - 2.0 * MARGIN_MM - dot_mm) / pitch_mm).floor() as usize + 1;
        let (columns, rows) = (count(width), count(height - MARGIN_MM));
        let first = |length: f64, count: usize| 0.5 * (length - (count - 1) as f64 * pitch_mm);
        let (x0, y0) = (first(width, columns), first(height - MARGIN_MM, rows));
        let mut svg = String::new();
        // Writing to a string does not fail.
        let _ = writeln!(
            svg,
            r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}">
<rect width="{width}" height="{height}" fill="#000"/>
<g fill="#fff">"##
        );
        for row in 0..rows {
            for column in 0..columns {
                let (x, y) = (x0 + column as f64 * pitch_mm, y0 + row as f64 * pitch_mm);
                let _ = writeln!(
                    svg,
                    r#"<circle cx="{x:.3}" cy="{y:.3}" r="{:.3}"/>"#,
                    0.5 * dot_mm
                );
            }
        }
        let (bar_y, text_y) = (height - 0.7 * MARGIN_MM, height - 0.55 * MARGIN_MM);
        let _ = writeln!(
            svg,
            r##"</g>
<g fill="#555" font-family="sans-serif" font-size="3">
<rect x="{MARGIN_MM}" y="{bar_y:.3}" width="{BAR_MM}" height="0.6"/>
<text x="{:.3}" y="{text_y:.3}">the bar is {BAR_MM} mm: print at 100 %; {columns} x {rows} dots of {dot_mm} mm, {pitch_mm} mm apart</text>
</g>
</svg>"##,
            MARGIN_MM + BAR_MM + 4.0
        );
        Ok(svg)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn all_dots_lie_on_the_sheet_and_its_numbers_are_named() {
        let target = DotTarget {
            sheet_mm: [420.0, 297.0],
            pitch_mm: 20.0,
            dot_mm: 2.0,
        };
        let svg = target.svg().unwrap();
        let number = |line: &str, name: &str| -> f64 {
            let at = line.split(&format!("{name}=\"")).nth(1).unwrap();
            at.split('"').next().unwrap().parse().unwrap()
        };
        let dots: Vec<&str> = svg.lines().filter(|l| l.starts_with("<circle")).collect();
        assert_eq!(dots.len(), 20 * 14);
        for dot in &dots {
            assert!((10.0..=410.0).contains(&number(dot, "cx")));
            assert!((10.0..=280.0).contains(&number(dot, "cy")));
        }
        assert!(svg.contains("20 x 14 dots of 2 mm, 20 mm apart"));
        let crowded = DotTarget {
            dot_mm: 12.0,
            ..target
        };
        assert!(crowded.svg().unwrap_err().to_string().contains("dot_mm"));
    }
}
