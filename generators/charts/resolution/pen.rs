//! How the parts of the resolution chart are inked.

use super::parts::{Block, Wedge};
use crate::charts::paint::{Band, edge_coverage, square_wave, strip};
use std::f32::consts::{FRAC_PI_2, PI};

/// A band, and how shares of the side become texels and shares of ink reflectances.
pub(super) struct Pen<'b, 'a> {
    pub(super) band: &'b mut Band<'a, 1>,
    pub(super) size: f32,
    pub(super) dark: f32,
}

impl Pen<'_, '_> {
    /// Inks the box [x0, y0, x1, y1] (shares of the side) by the coverage at a place in texels.
    fn ink(&mut self, bounds: [f32; 4], coverage: impl Fn(f32, f32) -> f32) {
        let bounds = bounds.map(|v| v * self.size);
        self.band.fill(bounds, [self.dark], coverage);
    }

    /// A line around the chart and three arrows a side whose tips touch the edge.
    pub(super) fn frame(&mut self) {
        for (centre, half) in [
            ([0.5, 0.03], [0.4715, 0.0015]),
            ([0.5, 0.97], [0.4715, 0.0015]),
            ([0.03, 0.5], [0.0015, 0.4715]),
            ([0.97, 0.5], [0.0015, 0.4715]),
        ] {
            let (centre, half) = (centre.map(|v| v * self.size), half.map(|v| v * self.size));
            self.band.rectangle(centre, half, 0.0, [self.dark]);
        }
        for side in 0u8..4 {
            let (sin, cos) = (FRAC_PI_2 * f32::from(side)).sin_cos();
            for shift in [-0.25f32, 0.0, 0.25] {
                let tip = [0.5 + 0.5 * cos - shift * sin, 0.5 + 0.5 * sin + shift * cos];
                self.arrow(tip, [cos, sin]);
            }
        }
    }

    /// A triangle with its tip at `tip`, pointing along `to`, as high as the frame is wide.
    fn arrow(&mut self, tip: [f32; 2], to: [f32; 2]) {
        const HEIGHT: f32 = 0.028;
        // Sides at 30° to the axis.
        let (sin, cos) = (PI / 6.0).sin_cos();
        let size = self.size;
        let [x, y] = tip;
        self.ink([x - 0.03, y - 0.03, x + 0.03, y + 0.03], |px, py| {
            let (dx, dy) = (px - x * size, py - y * size);
            let back = -(dx * to[0] + dy * to[1]);
            let across = dy * to[0] - dx * to[1];
            let flank = |across: f32, n: [f32; 2]| edge_coverage(back * sin - across * cos, n);
            let n = [sin * to[0] - cos * to[1], sin * to[1] + cos * to[0]];
            let m = [sin * to[0] + cos * to[1], sin * to[1] - cos * to[0]];
            (flank(across, n) + flank(-across, m) - 1.0).max(0.0)
                * edge_coverage(HEIGHT * size - back, to)
        });
    }

    pub(super) fn wedge(&mut self, wedge: &Wedge, highest_lw_ph: f32) {
        let (sin, cos) = wedge.angle.sin_cos();
        let [x, y] = [0.5, 0.5];
        let size = self.size;
        let half_width = 0.5 * Wedge::CYCLES / Wedge::frequency(0.0, highest_lw_ph);
        let ends = [wedge.start, wedge.end];
        let reach_x = ends.map(|r| x + r * cos);
        let reach_y = ends.map(|r| y + r * sin);
        let margin = half_width + 2.0 / size;
        let bounds = [
            reach_x[0].min(reach_x[1]) - margin,
            reach_y[0].min(reach_y[1]) - margin,
            reach_x[0].max(reach_x[1]) + margin,
            reach_y[0].max(reach_y[1]) + margin,
        ];
        let (middle, half_length) = (
            0.5 * (wedge.start + wedge.end),
            0.5 * (wedge.start - wedge.end).abs(),
        );
        self.ink(bounds, |px, py| {
            let (dx, dy) = (px / size - x, py / size - y);
            let (r, across) = (dx * cos + dy * sin, dy * cos - dx * sin);
            let along = ((r - wedge.start) / (wedge.end - wedge.start)).clamp(0.0, 1.0);
            let frequency = Wedge::frequency(along, highest_lw_ph);
            let (n, m) = ([-sin, cos], [cos, sin]);
            let inside = strip(across * size, 0.5 * Wedge::CYCLES / frequency * size, n)
                * strip((r - middle) * size, half_length * size, m);
            if inside <= 0.0 {
                return 0.0;
            }
            // Dark in the middle and at both rims: an odd number of half waves across.
            inside * square_wave(across * frequency, frequency / size, n)
        });
    }

    /// Rings whose frequency grows in proportion to the radius, to `highest_lw_ph` at the rim: phase = f r / 2.
    pub(super) fn zone_plate(&mut self, centre: [f32; 2], radius: f32, highest_lw_ph: f32) {
        let [x, y] = centre;
        let size = self.size;
        let rim = 0.5 * highest_lw_ph;
        let reach = radius + 1.0 / size;
        self.ink([x - reach, y - reach, x + reach, y + reach], |px, py| {
            let (dx, dy) = (px / size - x, py / size - y);
            let r = dx.hypot(dy).max(1e-7);
            let n = [dx / r, dy / r];
            let frequency = rim * r / radius;
            edge_coverage((radius - r) * size, n)
                * square_wave(0.5 * frequency * r, frequency / size, n)
        });
    }

    pub(super) fn square(&mut self, centre: [f32; 2], side: f32, angle: f32) {
        let half = [0.5 * side * self.size; 2];
        self.band
            .rectangle(centre.map(|v| v * self.size), half, angle, [self.dark]);
    }

    pub(super) fn block(&mut self, block: &Block) {
        let [x, y] = block.centre;
        let (size, half) = (self.size, block.half);
        let (sin, cos) = block.angle.sin_cos();
        let frequency = 0.5 * block.lw_ph;
        let reach = half + 1.0 / size;
        self.ink([x - reach, y - reach, x + reach, y + reach], |px, py| {
            let (dx, dy) = (px / size - x, py / size - y);
            let inside = strip(dx * size, half * size, [1.0, 0.0])
                * strip(dy * size, half * size, [0.0, 1.0]);
            inside.max(0.0)
                * square_wave(
                    (dx * cos + dy * sin) * frequency,
                    frequency / size,
                    [cos, sin],
                )
        });
    }
}
