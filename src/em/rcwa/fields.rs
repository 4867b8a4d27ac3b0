//! Fields in the photodiodes of single plane waves, for coherent sums over many: of a point in focus, say.
//!
//! Each wave is E at the nodes by which absorption is integrated, times the square root of their weights and over that
//! of the light that falls on the period. With a_k the amplitudes of the waves of a sum, that of light polarized along
//! x or y before it was focused,
//! ```text
//!   P_i = Σ_kk' a_k* a_k' G_i(k, k'),     G_i(k, k') = Σ_(nodes of i) F_k* F_k',     G_i(k, k) = P_i(k)
//! ```
//! is what photodiode i of the pixel at the origin absorbs, per light on one period. F holds the Bloch phase: for the
//! pixel at R take a_k e^(i k·R).

use rustfft::num_complex::{Complex32, Complex64};

use super::basis::{Lattice, Parity, Sector};
use super::column::Column;
use super::linear::flux;
use super::model::{RcwaModel, Top, check_direction, sector_of};
use super::silicon::{Silicon, node_counts};
use super::{RcwaSettings, SolverError};
use crate::em::PixelStack;
use crate::range::OutOfRange;

/// Of E.
const COMPONENTS: usize = 3;

/// Fields in the photodiodes of one plane wave.
#[derive(Clone, Debug)]
pub struct PhotodiodeFields {
    /// Photodiode of each node of a plane, by columns of a row.
    photodiodes: Vec<usize>,
    /// Nodes in a row.
    columns: usize,
    /// Of light polarized along x, along y: component by component, depth by depth, node by node.
    values: [Vec<Complex32>; 2],
}

impl PhotodiodeFields {
    /// Numbers that one wave is kept as, of both polarizations.
    ///
    /// # Errors
    /// A wavelength out of the range of the pixel's materials.
    pub fn count(
        stack: &PixelStack,
        wavelength_nm: f64,
        settings: &RcwaSettings,
    ) -> Result<usize, SolverError> {
        let model = RcwaModel::new(stack, wavelength_nm, settings)?;
        let pixel = model.pixel();
        let [x, y, z] = node_counts(pixel);
        Ok(2 * COMPONENTS * x * y * z)
    }

    /// G_i(self, other) of each photodiode, of light polarized along x (0) or y (1).
    pub fn product(&self, other: &Self, polarization: usize) -> Vec<Complex64> {
        let last = self.photodiodes.iter().max().map_or(0, |i| i + 1);
        let mut sums = vec![Complex64::ZERO; last];
        let (a, b) = (&self.values[polarization], &other.values[polarization]);
        let plane = self.photodiodes.len();
        for (a, b) in a.chunks_exact(plane).zip(b.chunks_exact(plane)) {
            let mut here = vec![Complex32::ZERO; last];
            for ((a, b), i) in a.iter().zip(b).zip(&self.photodiodes) {
                here[*i] += a.conj() * b;
            }
            for (sum, here) in sums.iter_mut().zip(here) {
                *sum += Complex64::new(f64::from(here.re), f64::from(here.im));
            }
        }
        sums
    }

    /// Of the wave from the other side of x = 0, of a pixel with a mirror there.
    #[must_use]
    pub fn mirrored_x(&self) -> Self {
        let columns = self.columns;
        self.mirrored(0, |node| {
            let column = node % columns;
            node - column + (columns - 1 - column)
        })
    }

    /// Of the wave from the other side of y = 0, of a pixel with a mirror there.
    #[must_use]
    pub fn mirrored_y(&self) -> Self {
        let (columns, nodes) = (self.columns, self.photodiodes.len());
        self.mirrored(1, |node| {
            let column = node % columns;
            nodes - columns - (node - column) + column
        })
    }

    /// Of the wave from (v, u) in the place of (u, v), of a pixel that is alike along x and y: as many photodiodes, and
    /// its lens not shifted.
    #[must_use]
    pub fn transposed(&self) -> Self {
        let columns = self.columns;
        let other = [1, 0, 2];
        self.rearranged(
            |node| (node % columns) * columns + node / columns,
            |polarization, component| (other[polarization], other[component], 1.0),
        )
    }

    fn mirrored(&self, axis: usize, from: impl Fn(usize) -> usize) -> Self {
        self.rearranged(from, |polarization, component| {
            // E across the mirror turns, and so does the light that is polarized across it before it is focused.
            let turns = (component == axis) != (polarization == axis);
            (polarization, component, if turns { -1.0 } else { 1.0 })
        })
    }

    /// At each node, the field at the node `from` it, of the polarization, the component and with the sign of `source`.
    fn rearranged(
        &self,
        from: impl Fn(usize) -> usize,
        source: impl Fn(usize, usize) -> (usize, usize, f32),
    ) -> Self {
        let plane = self.photodiodes.len();
        let from: Vec<usize> = (0..plane).map(from).collect();
        let of = |polarization: usize| {
            let mut out = Vec::with_capacity(self.values[polarization].len());
            for component in 0..COMPONENTS {
                let (polarization, component, sign) = source(polarization, component);
                let values = &self.values[polarization];
                let length = values.len() / COMPONENTS;
                let of_component = &values[component * length..][..length];
                for values in of_component.chunks_exact(plane) {
                    out.extend(from.iter().map(|node| values[*node] * sign));
                }
            }
            out
        };
        Self {
            photodiodes: self.photodiodes.clone(),
            columns: self.columns,
            values: [of(0), of(1)],
        }
    }
}

impl RcwaModel {
    /// Fields of a plane wave of direction cosines (u, v), phase 0 at the origin on top of the lens.
    ///
    /// # Errors
    /// As of [`Self::solve`], or a mosaic.
    pub fn photodiode_fields(&self, u: f64, v: f64) -> Result<PhotodiodeFields, SolverError> {
        check_direction(u, v)?;
        let pixel = self.pixel();
        if pixel.stack.mosaic.is_some() {
            let allowed = "none for fields in the photodiodes";
            return Err(OutOfRange::new("rcwa", "mosaic", "of several colours", allowed).into());
        }
        let bloch = [u, v];
        let shift = pixel.stack.lens.shift_um;
        let mirrors = [0, 1].map(|axis| bloch[axis] == 0.0 && shift[axis] == 0.0);
        let [x, y] = focused(bloch);
        let values = if mirrors == [false, false] {
            let none = Sector {
                x: Parity::None,
                y: Parity::None,
            };
            self.fields(bloch, none, [x, y])?
        } else {
            let one = |wave| self.fields(bloch, sector_of(wave, mirrors), [wave]);
            let ([x], [y]) = (one(x)?, one(y)?);
            [x, y]
        };
        let (photodiodes, columns) = Silicon::photodiodes_of_nodes(pixel);
        Ok(PhotodiodeFields {
            photodiodes,
            columns,
            values,
        })
    }

    fn fields<const N: usize>(
        &self,
        bloch: [f64; 2],
        sector: Sector,
        waves: [[f64; 2]; N],
    ) -> Result<[Vec<Complex32>; N], SolverError> {
        let pixel = self.pixel();
        let step = pixel.step;
        let column = Column::new(pixel, Lattice { bloch, step }, sector)?;
        let top = Top::new(&column, &waves);
        let mut fields = column.fields(&top.e);
        for (j, fields) in fields.iter_mut().enumerate() {
            let whole = flux(top.incident.as_ref(), top.h_incident.as_ref(), j);
            let unit = (1.0 / whole).sqrt() as f32;
            fields.iter_mut().for_each(|e| *e *= unit);
        }
        let mut fields = fields.into_iter();
        Ok(std::array::from_fn(|_| fields.next().unwrap_or_default()))
    }
}

/// Tangential E of light that a lens without aberrations turns into (u, v), polarized along x and along y before.
fn focused([u, v]: [f64; 2]) -> [[f64; 2]; 2] {
    let sine = u.hypot(v);
    let [c, s] = match sine > 0.0 {
        true => [u / sine, v / sine],
        false => [1.0, 0.0],
    };
    let cosine = (1.0 - sine * sine).sqrt();
    let across = c * s * (cosine - 1.0);
    [
        [c * c * cosine + s * s, across],
        [across, s * s * cosine + c * c],
    ]
}
