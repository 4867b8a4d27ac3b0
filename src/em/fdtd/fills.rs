//! What a node's voxel is filled with, and the permittivity that it takes from its parts.

use rustfft::num_complex::Complex64;

use super::mesh::Mesh;
use crate::em::PixelStack;

type C = Complex64;
/// ε at each wavelength of the run.
pub(super) type Spectrum = Vec<C>;

/// What parts a slab into places of unlike matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pattern {
    /// Trenches between sub-pixels.
    Trenches,
    /// What collects no charge between photodiodes: trenches, and isolation about them.
    Isolation,
    /// Metal walls between microlenses.
    Walls,
    /// Microlenses of the first column, or row, of a mosaic.
    Microlenses,
}

/// ε of a voxel filled to `fill` with `a` and else with `b`, whose interface has the part `along` of its squared normal
/// along the field.
pub(super) fn smooth(a: C, b: C, fill: f64, along: f64) -> C {
    if a == b || fill <= 0.0 {
        return b;
    }
    if fill >= 1.0 {
        return a;
    }
    blend(&[(a, fill), (b, 1.0 - fill)], along)
}

/// ε of a voxel of several media and their parts of it.
fn blend(media: &[(C, f64)], along: f64) -> C {
    if media.iter().any(|(e, _)| e.re < 1.0) {
        // Means over a metal of Re ε < 0 can vanish: the largest part takes the node.
        let larger = |a: (C, f64), b: &(C, f64)| if b.1 >= a.1 { *b } else { a };
        return media.iter().fold((C::ONE, 0.0), larger).0;
    }
    let mean = |value: &dyn Fn(C) -> C| media.iter().map(|(e, part)| value(*e) * part).sum::<C>();
    let parallel = mean(&|e| e);
    let across = mean(&|e| e.inv());
    (across * along + parallel.inv() * (1.0 - along)).inv()
}

/// How much of the voxel of a node each pattern takes, along each lateral axis.
pub(super) struct Fills {
    nx: usize,
    /// By pattern, component, lateral axis.
    parts: [[[Vec<f64>; 2]; 3]; 4],
}

impl Fills {
    pub fn new(stack: &PixelStack, mesh: &Mesh) -> Self {
        let p = stack.pitch_um;
        let count = [stack.subpixels.m(), stack.subpixels.n()];
        let wall = stack.metal.as_ref().map_or(0.0, |m| m.width_um);
        let part = |pattern: Pattern, component: usize, axis: usize| -> Vec<f64> {
            let n = if axis == 0 {
                mesh.grid.nx()
            } else {
                mesh.grid.ny()
            };
            let d = mesh.lateral_um()[axis];
            // Bands centred at (q / lines − 1/2) p, over the pitch or, of a mosaic, from −p to 3/2 p.
            let (lines, [split, border]) = match pattern {
                Pattern::Trenches => (count[axis], [stack.trench_um; 2]),
                Pattern::Isolation => (count[axis], stack.uncollected_um()),
                Pattern::Walls => (1, [wall; 2]),
                Pattern::Microlenses => (2, [p; 2]),
            };
            let beyond = lines * (mesh.microlenses - 1);
            let all = (0..=lines + 2 * beyond).map(|q| q as f64 - beyond as f64);
            let bands: Vec<f64> = match pattern {
                // About 0 and 2 p.
                Pattern::Microlenses => vec![1.0, 5.0],
                _ => all.collect(),
            };
            (0..=n)
                .map(|i| {
                    let x = mesh.across_um(axis, i, component == axis);
                    let (a, b) = (x - 0.5 * d, x + 0.5 * d);
                    let covered: f64 = bands
                        .iter()
                        .map(|q| {
                            let c = (q / lines as f64 - 0.5) * p;
                            let width = if q % lines as f64 == 0.0 {
                                border
                            } else {
                                split
                            };
                            (b.min(c + 0.5 * width) - a.max(c - 0.5 * width)).max(0.0)
                        })
                        .sum();
                    let fill = covered / d;
                    // Round-off at a face on the grid is not a mixture.
                    if fill < 1e-9 {
                        0.0
                    } else if fill > 1.0 - 1e-9 {
                        1.0
                    } else {
                        fill
                    }
                })
                .collect()
        };
        let by = |pattern| [0, 1, 2].map(|c| [0, 1].map(|a| part(pattern, c, a)));
        Self {
            nx: mesh.grid.nx(),
            parts: [
                Pattern::Trenches,
                Pattern::Isolation,
                Pattern::Walls,
                Pattern::Microlenses,
            ]
            .map(by),
        }
    }

    /// Fill, and the squared part of the normal along the component.
    pub fn at(&self, pattern: Pattern, component: usize, at: usize) -> (f64, f64) {
        let [fx, fy] = self.pair(pattern, component, at);
        let fill = 1.0 - (1.0 - fx) * (1.0 - fy);
        let slope = |f: f64, other: f64| if f > 0.0 && f < 1.0 { 1.0 - other } else { 0.0 };
        let (gx, gy) = (slope(fx, fy).powi(2), slope(fy, fx).powi(2));
        let along = match component {
            0 => gx,
            1 => gy,
            _ => 0.0,
        };
        (
            fill,
            if gx + gy > 0.0 {
                along / (gx + gy)
            } else {
                0.0
            },
        )
    }

    fn pair(&self, pattern: Pattern, component: usize, at: usize) -> [f64; 2] {
        let (i, j) = (at % (self.nx + 1), at / (self.nx + 1));
        let parts = &self.parts[pattern as usize][component];
        [parts[0][i], parts[1][j]]
    }

    /// ε of a node between the filters of a mosaic.
    pub fn mixed(&self, filters: &[Spectrum; 4], component: usize, at: usize) -> Spectrum {
        let [fx, fy] = self.pair(Pattern::Microlenses, component, at);
        let parts = [
            fx * fy,
            (1.0 - fx) * fy,
            fx * (1.0 - fy),
            (1.0 - fx) * (1.0 - fy),
        ];
        let cut = [fx, fy].map(|f| f > 0.0 && f < 1.0);
        // At a corner of microlenses both normals count alike.
        let along = match (component, cut) {
            (0, [true, false]) | (1, [false, true]) => 1.0,
            (0 | 1, [true, true]) => 0.5,
            _ => 0.0,
        };
        let at_wavelength = |w: usize| {
            let media = filters.iter().zip(parts).map(|(e, part)| (e[w], part));
            let media: Vec<(C, f64)> = media.filter(|(_, part)| *part > 0.0).collect();
            match media[..] {
                [(only, _)] => only,
                _ if media.iter().all(|(e, _)| *e == media[0].0) => media[0].0,
                _ => blend(&media, along),
            }
        };
        (0..filters[0].len()).map(at_wavelength).collect()
    }

    /// A number that is equal for nodes of equal ε in a slab of this pattern.
    pub fn class(&self, pattern: Option<Pattern>, component: usize, at: usize) -> usize {
        let Some(pattern) = pattern else {
            return 0;
        };
        let [fx, fy] = self.pair(pattern, component, at);
        // Fills repeat exactly along the lattice; hash their bits.
        let mix = fx.to_bits().wrapping_mul(0x9E37_79B9_7F4A_7C15)
            ^ fy.to_bits()
                .rotate_left(32)
                .wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
        mix as usize
    }
}
