//! What silicon takes of any light that falls on it, as quadratic forms: for one direction under many lens shifts.
//!
//! Of amplitudes a of the waves that fall on the silicon, photodiode i absorbs a† A_i a. With mode amplitudes c = C a,
//! modes e^(iγz) and their fields F,
//! ```text
//!   A_i = Im ε C† (Z ∘ Σ F† O_i F) C   Z_mm' = ∫ e^(i(γ_m' − γ_m*) z) dz   O_i: overlaps of the orders on photodiode i
//! ```
//! (∘: entry by entry; Σ over E_x, E_y, E_z). Light of class r on photodiode (c, d) is that on photodiode (0, 0) times
//! e^(2πi (r_x c/m + r_y d/n)), so only the first is integrated, block by block, unless isolation makes them unlike.

use super::basis::Order;
use super::block::Block;
use super::detector::Detector;
use super::linear::{C, Matrix, flux, scale_rows};
use super::silicon::{InSilicon, Silicon};

/// Powers in silicon as forms of what falls on it.
pub(super) struct Forms {
    /// Absorbed in each photodiode.
    absorbed: Vec<Matrix>,
    /// E†h at the top, and at the end of the counted depth.
    entering: Matrix,
    leaving: Matrix,
    /// Whether what lies between the photodiodes absorbs, too.
    lossy_between: bool,
}

/// The modes of one class as seen from above.
struct Seen<'a> {
    block: &'a Block,
    /// Mode amplitudes of each function shared with the field above.
    c: Matrix,
    /// E_x, E_y, E_z of each mode.
    fields: [Matrix; 3],
    /// e^(iγ depth).
    phases: Vec<C>,
}

impl Forms {
    /// Of silicon under `n` functions of the field above, no mirror used, `k0_depth` of it counted.
    pub fn new(silicon: &Silicon, n: usize, k0_depth: f64) -> Self {
        let [columns, rows] = silicon.grid.parts.map(|m| m as usize);
        let detector = Detector::new(&silicon.grid, &silicon.whole);
        let seen: Vec<Seen> = silicon.blocks.iter().map(|b| b.seen(k0_depth)).collect();
        let zero = Matrix::zeros(n, n);
        let mut forms = Self {
            absorbed: vec![zero.clone(); columns * rows],
            entering: zero.clone(),
            leaving: zero,
            lossy_between: silicon.lossy_between(),
        };
        for (r, left) in seen.iter().enumerate() {
            for (form, c) in [
                (&mut forms.entering, left.c.clone()),
                (&mut forms.leaving, scale_rows(left.c.clone(), &left.phases)),
            ] {
                let modes = &left.block.modes;
                let part = (&modes.w * &c).adjoint().to_owned() * (&modes.v * &c);
                place(form, &part, left.block, left.block, C::ONE);
            }
            for (q, right) in seen.iter().enumerate().skip(r) {
                let of = |photodiode: [usize; 2]| {
                    let part = absorbed_by(&detector, photodiode, [left, right], k0_depth)
                        * faer::Scale(C::from(silicon.grid.inside.im));
                    let back = part.adjoint().to_owned();
                    (part, back)
                };
                let first = silicon.grid.is_even().then(|| of([0, 0]));
                for (i, form) in forms.absorbed.iter_mut().enumerate() {
                    let at = [(i % columns, columns), (i / columns, rows)];
                    let Some((part, back)) = &first else {
                        let (part, back) = of([at[0].0, at[1].0]);
                        place(form, &part, left.block, right.block, C::ONE);
                        if q != r {
                            place(form, &back, right.block, left.block, C::ONE);
                        }
                        continue;
                    };
                    let turns = [0, 1].map(|axis| {
                        let apart =
                            right.block.class.residue[axis] - left.block.class.residue[axis];
                        f64::from(apart) * at[axis].0 as f64 / at[axis].1 as f64
                    });
                    let turn = C::cis(2.0 * std::f64::consts::PI * (turns[0] + turns[1]));
                    place(form, part, left.block, right.block, turn);
                    if q != r {
                        place(form, back, right.block, left.block, turn.conj());
                    }
                }
            }
        }
        forms
    }

    /// The same of amplitudes b, a = L b.
    pub fn seen_through(self, l: &Matrix) -> Self {
        let adjoint = l.adjoint().to_owned();
        let through = |form: &Matrix| &adjoint * (form * l);
        Self {
            absorbed: self.absorbed.iter().map(through).collect(),
            entering: through(&self.entering),
            leaving: through(&self.leaving),
            lossy_between: self.lossy_between,
        }
    }

    /// What becomes of amplitudes, a column each.
    pub fn powers(&self, a: &Matrix) -> Vec<InSilicon> {
        let values = |form: &Matrix| -> Vec<f64> {
            let image = form * a;
            let one = |j| flux(a.as_ref(), image.as_ref(), j);
            (0..a.ncols()).map(one).collect()
        };
        let absorbed: Vec<Vec<f64>> = self.absorbed.iter().map(values).collect();
        let both = values(&self.entering)
            .into_iter()
            .zip(values(&self.leaving));
        both.enumerate()
            .map(|(j, (entering, leaving))| {
                let absorbed = absorbed.iter().map(|p| p[j]).collect();
                InSilicon::new(entering, leaving, absorbed, self.lossy_between)
            })
            .collect()
    }
}

impl Block {
    fn seen(&self, k0_depth: f64) -> Seen<'_> {
        Seen {
            c: self.amplitudes(&self.of_each_shared()),
            fields: self.components(&self.modes.w, &self.modes.v),
            phases: self.modes.phases(k0_depth),
            block: self,
        }
    }
}

/// Adds a block to a form, times `by`.
fn place(form: &mut Matrix, part: &Matrix, rows: &Block, columns: &Block, by: C) {
    for (j, (column, _)) in columns.shared.iter().enumerate() {
        for (i, (row, _)) in rows.shared.iter().enumerate() {
            form[(*row, *column)] += part[(i, j)] * by;
        }
    }
}

/// C† (Z ∘ Σ F† O F) C between two classes, on a photodiode.
fn absorbed_by(
    detector: &Detector,
    photodiode: [usize; 2],
    [left, right]: [&Seen; 2],
    k0_depth: f64,
) -> Matrix {
    let (a, b) = (&left.block.modes, &right.block.modes);
    let mut sum = Matrix::zeros(a.gamma.len(), b.gamma.len());
    for component in 0..3 {
        let (rows, columns) = (left.block.orders(component), right.block.orders(component));
        let along = [0, 1].map(|axis| detector.overlap(component, axis, photodiode[axis]));
        let one = |axis: usize, m: &Order, n: &Order| {
            let (overlap, first) = &along[axis];
            overlap[((m.n[axis] - first) as usize, (n.n[axis] - first) as usize)]
        };
        let overlap = Matrix::from_fn(rows.len(), columns.len(), |i, j| {
            one(0, &rows[i], &columns[j]) * one(1, &rows[i], &columns[j])
        });
        let fields = left.fields[component].adjoint().to_owned();
        sum += fields * (overlap * &right.fields[component]);
    }
    let weighed = Matrix::from_fn(sum.nrows(), sum.ncols(), |i, j| {
        let beat = C::I * (b.gamma[j] - a.gamma[i].conj());
        let way = if (beat * k0_depth).norm() < 1e-6 {
            C::from(k0_depth) * (beat * (0.5 * k0_depth) + 1.0)
        } else {
            (right.phases[j] * left.phases[i].conj() - 1.0) / beat
        };
        sum[(i, j)] * way
    });
    left.c.adjoint().to_owned() * (weighed * &right.c)
}
