//! Running Fourier transform of E on some planes of the grid: Ê = Σ E(t) e^(iωt) Δt, sampled every few steps.
//!
//! Only E is kept: H follows from the grid's own law of induction, −iΩ Ĥ = −curl Ê, exactly as the stepper has it.

use rustfft::num_complex::Complex64;

use super::{Component, Part, Simulation};

type C = Complex64;
const COMPONENTS: [Component; 3] = [Component::Ex, Component::Ey, Component::Ez];

/// Phasors of one member at one frequency on the planes `first ..= last` (Ex, Ey), and Ez on the layers above them but
/// the last.
pub(super) struct Phasors {
    first: usize,
    last: usize,
    size: [usize; 2],
    /// By component: re, im.
    data: [[Vec<f32>; 2]; 3],
}

impl Phasors {
    /// Zero, for a grid of `size` cells.
    pub fn new(size: [usize; 2], first: usize, last: usize) -> Self {
        let zeros = || vec![0.0; Self::places(size, first, last)];
        Self {
            first,
            last,
            size,
            data: [0, 1, 2].map(|_| [zeros(), zeros()]),
        }
    }

    fn places([nx, ny]: [usize; 2], first: usize, last: usize) -> usize {
        (nx + 1) * (ny + 1) * (last - first + 1)
    }

    /// Bytes of such phasors.
    pub fn bytes(size: [usize; 2], first: usize, last: usize) -> usize {
        Self::places(size, first, last) * 6 * size_of::<f32>()
    }

    /// Adds the fields of now, times `turn` = e^(iωt) Δt.
    pub fn add(&mut self, sim: &Simulation, member: usize, turn: C) {
        let (c, s) = (turn.re as f32, turn.im as f32);
        let [nx, ny] = self.size;
        for k in self.first..=self.last {
            for (component, data) in COMPONENTS.iter().zip(&mut self.data) {
                for j in 0..=ny {
                    let at = ((k - self.first) * (ny + 1) + j) * (nx + 1);
                    let [re, im] = data;
                    let (re, im) = (&mut re[at..=at + nx], &mut im[at..=at + nx]);
                    if let Some(row) = sim.row(member, Part::Re, *component, j, k) {
                        for ((re, im), e) in re.iter_mut().zip(im.iter_mut()).zip(row) {
                            *re += c * e;
                            *im += s * e;
                        }
                    }
                    if let Some(row) = sim.row(member, Part::Im, *component, j, k) {
                        for ((re, im), e) in re.iter_mut().zip(im.iter_mut()).zip(row) {
                            *re -= s * e;
                            *im += c * e;
                        }
                    }
                }
            }
        }
    }

    /// Component (0, 1, 2: Ex, Ey, Ez) of the node (i, j, k), `i` to nx and `j` to ny.
    #[inline]
    pub fn e(&self, component: usize, i: usize, j: usize, k: usize) -> C {
        let [nx, ny] = self.size;
        let at = ((k - self.first) * (ny + 1) + j) * (nx + 1) + i;
        let [re, im] = &self.data[component];
        C::new(f64::from(re[at]), f64::from(im[at]))
    }
}
