//! Which plane-wave orders carry a field, halved by each mirror that leaves pixel and wave as they are.
//!
//! An order is e^(i (k_x x + k_y y)), k = k∥ + G, in units of k0. Where an axis has a mirror, +k and −k are taken
//! together: even functions (e^(ikx) + e^(−ikx))/√2 (1 for k = 0) and odd ones (e^(ikx) − e^(−ikx))/√2, both normed to
//! a mean square of 1. If E_x is of parity (s_x, s_y), then E_y is of the other parity in both axes, and E_z of the
//! other parity in x (each derivative turns one): the fields of one [`Sector`]. H_y goes with E_x, −H_x with E_y.
//!
//! A lattice of period p/m couples only orders whose numbers differ by a multiple of m: the fields fall into classes
//! ([`Class`]), each a problem of its own.

use std::collections::HashMap;

use super::linear::C;

/// Symmetry of a function along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Parity {
    /// No mirror: +k and −k are two functions.
    None,
    Even,
    Odd,
}

impl Parity {
    pub fn other(self) -> Self {
        match self {
            Self::None => Self::None,
            Self::Even => Self::Odd,
            Self::Odd => Self::Even,
        }
    }

    /// Whether order `n` has a function of its own.
    pub fn has(self, n: i32) -> bool {
        match self {
            Self::None => true,
            Self::Even => n >= 0,
            Self::Odd => n > 0,
        }
    }

    /// ⟨n| f |n'⟩ = Σ weight · f_G over these (G, weight), f_G the Fourier coefficients of f, even in G where there is
    /// a mirror.
    pub fn couplings(self, n: i32, other: i32) -> [(i32, f64); 2] {
        let norm = |n: i32| if n == 0 { 0.5f64.sqrt() } else { 1.0 };
        match self {
            Self::None => [(n - other, 1.0), (0, 0.0)],
            Self::Even => {
                let w = norm(n) * norm(other);
                [(n - other, w), (n + other, w)]
            }
            Self::Odd => [(n - other, 1.0), (n + other, -1.0)],
        }
    }

    /// Value of function `n`, of wavenumber `k`, at `x`.
    pub fn value(self, n: i32, k: f64, x: f64) -> C {
        let wave = C::from_polar(1.0, k * x);
        match (self, n) {
            (Self::None, _) => wave,
            (Self::Even, 0) => C::ONE,
            (Self::Even, _) => C::new(2f64.sqrt() * wave.re, 0.0),
            (Self::Odd, _) => C::new(0.0, 2f64.sqrt() * wave.im),
        }
    }
}

/// Parity of E_x along x and y.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sector {
    pub x: Parity,
    pub y: Parity,
}

/// k∥ and the reciprocal step, in units of k0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lattice {
    pub bloch: [f64; 2],
    pub step: f64,
}

impl Lattice {
    pub fn k(&self, axis: usize, n: i32) -> f64 {
        self.bloch[axis] + self.step * f64::from(n)
    }

    /// The orders of an axis with |k| ≤ `cutoff`, first and last.
    pub fn range(&self, axis: usize, cutoff: f64) -> [i32; 2] {
        [
            ((-cutoff - self.bloch[axis]) / self.step).ceil() as i32,
            ((cutoff - self.bloch[axis]) / self.step).floor() as i32,
        ]
    }
}

/// Orders congruent to `residue` modulo `parts`, or to −`residue` where there is a mirror.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Class {
    pub parts: [i32; 2],
    pub residue: [i32; 2],
}

impl Class {
    /// The one class of a lattice of the pixel's own period.
    pub const WHOLE: Self = Self {
        parts: [1, 1],
        residue: [0, 0],
    };

    /// All classes of a lattice of period p/m, p/n.
    pub fn all(parts: [i32; 2], sector: Sector) -> Vec<Self> {
        // With a mirror, residues r and m − r are one class.
        let residues = |m: i32, parity| {
            if parity == Parity::None {
                0..m
            } else {
                0..m / 2 + 1
            }
        };
        let pairs = |rx| residues(parts[1], sector.y).map(move |ry| [rx, ry]);
        residues(parts[0], sector.x)
            .flat_map(pairs)
            .map(|residue| Self { parts, residue })
            .collect()
    }

    fn has(&self, axis: usize, n: i32, parity: Parity) -> bool {
        let (m, r) = (self.parts[axis], self.residue[axis]);
        let residue = n.rem_euclid(m);
        residue == r || (parity != Parity::None && residue == (m - r) % m)
    }
}

/// One order (or pair of them).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Order {
    pub n: [i32; 2],
    pub k: [f64; 2],
}

/// The functions of E_x, E_y and E_z of a sector and class, |k| ≤ `cutoff`. Tangential fields are vectors of `x`, then
/// `y`.
#[derive(Clone, Debug)]
pub(super) struct Basis {
    pub lattice: Lattice,
    pub sector: Sector,
    pub cutoff: f64,
    pub x: Vec<Order>,
    pub y: Vec<Order>,
    pub z: Vec<Order>,
}

impl Basis {
    pub fn new(lattice: Lattice, sector: Sector, cutoff: f64, class: Class) -> Self {
        let list = |px: Parity, py: Parity| {
            let [x0, x1] = lattice.range(0, cutoff);
            let [y0, y1] = lattice.range(1, cutoff);
            let mut out = Vec::new();
            for nx in x0..=x1 {
                for ny in y0..=y1 {
                    let k = [lattice.k(0, nx), lattice.k(1, ny)];
                    if k[0].hypot(k[1]) <= cutoff
                        && px.has(nx)
                        && py.has(ny)
                        && class.has(0, nx, px)
                        && class.has(1, ny, py)
                    {
                        out.push(Order { n: [nx, ny], k });
                    }
                }
            }
            out
        };
        let Sector { x, y } = sector;
        Self {
            lattice,
            sector,
            cutoff,
            x: list(x, y),
            y: list(x.other(), y.other()),
            z: list(x.other(), y),
        }
    }

    /// Length of a tangential field.
    pub fn len(&self) -> usize {
        self.x.len() + self.y.len()
    }

    /// The numbers of all functions of one axis, of all classes.
    pub fn axis(&self, axis: usize, parity: Parity) -> Vec<i32> {
        let [first, last] = self.lattice.range(axis, self.cutoff);
        (first..=last).filter(|n| parity.has(*n)).collect()
    }

    /// Parities of E_x, E_y, E_z along x and y.
    pub fn parities(&self) -> [[Parity; 2]; 3] {
        let Sector { x, y } = self.sector;
        [[x, y], [x.other(), y.other()], [x.other(), y]]
    }

    /// Where each entry of a tangential field of `self` stands in one of `larger`.
    pub fn places_in(&self, larger: &Self) -> Vec<Option<usize>> {
        let (x, y) = (places(&larger.x), places(&larger.y));
        let of_x = self.x.iter().map(|o| x.get(&o.n).copied());
        let of_y = self
            .y
            .iter()
            .map(|o| y.get(&o.n).map(|i| i + larger.x.len()));
        of_x.chain(of_y).collect()
    }
}

/// Index by order numbers.
pub(super) fn places(orders: &[Order]) -> HashMap<[i32; 2], usize> {
    orders.iter().enumerate().map(|(i, o)| (o.n, i)).collect()
}
