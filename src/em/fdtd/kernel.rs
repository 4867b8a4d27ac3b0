//! One row of one component, a vector of [`VECTOR`] nodes at a time. Written so that the compiler makes full vectors of
//! it at each level: fixed-size chunks, no branch on data, no contraction of products and sums (the bits must not
//! depend on the level).

use super::coefficients::Row;
use super::layout::VECTOR;

type Lanes = [f32; VECTOR];

/// Which of the two differences of a curl is stretched by an absorbing layer, and which have far nodes.
pub(super) const NEITHER: usize = 0;
pub(super) const FIRST: usize = 1;
pub(super) const SECOND: usize = 2;
pub(super) const BOTH: usize = 3;

/// A row of a difference: (near1 − near0) rate, and where it is wide + (far1 − far0) far_rate.
#[derive(Clone, Copy)]
pub(super) struct Difference<'a> {
    pub near: [&'a [f32]; 2],
    pub rate: f32,
    /// Looked at only where the difference is wide.
    pub far: [&'a [f32]; 2],
    pub far_rate: f32,
}

/// A row of one component of a curl, a − b.
#[derive(Clone, Copy)]
pub(super) struct Curl<'a> {
    pub a: Difference<'a>,
    pub b: Difference<'a>,
}

/// ψ of the stretched difference, with b and c; empty if none is.
pub(super) struct Psi<'a> {
    pub row: &'a mut [f32],
    pub bc: [f32; 2],
}

impl Psi<'_> {
    /// No ψ.
    #[inline(always)]
    pub fn none() -> Self {
        Self {
            row: &mut [],
            bc: [0.0; 2],
        }
    }
}

#[inline(always)]
fn vectors(row: &[f32], count: usize) -> &[Lanes] {
    &row.as_chunks::<VECTOR>().0[..count]
}

#[inline(always)]
fn vectors_mut(row: &mut [f32]) -> &mut [Lanes] {
    row.as_chunks_mut::<VECTOR>().0
}

/// [`Curl`] and ψ by vectors. Vectors are read whole before one is written, and there are no closures: otherwise the
/// compiler, which cannot know that rows do not overlap, or does not inline, falls back to single numbers.
struct Vectors<'a, const WIDE: usize> {
    near: [&'a [Lanes]; 4],
    rates: [f32; 2],
    far: [&'a [Lanes]; 4],
    far_rates: [f32; 2],
    psi: &'a mut [Lanes],
    bc: [f32; 2],
}

impl<'a, const WIDE: usize> Vectors<'a, WIDE> {
    #[inline(always)]
    fn new(Curl { a, b }: Curl<'a>, psi: Psi<'a>, count: usize) -> Self {
        let none: &[Lanes] = &[];
        let mut far = [none; 4];
        if WIDE & FIRST != 0 {
            far[0] = vectors(a.far[0], count);
            far[1] = vectors(a.far[1], count);
        }
        if WIDE & SECOND != 0 {
            far[2] = vectors(b.far[0], count);
            far[3] = vectors(b.far[1], count);
        }
        Self {
            near: [
                vectors(a.near[0], count),
                vectors(a.near[1], count),
                vectors(b.near[0], count),
                vectors(b.near[1], count),
            ],
            rates: [a.rate, b.rate],
            far,
            far_rates: [a.far_rate, b.far_rate],
            psi: vectors_mut(psi.row),
            bc: psi.bc,
        }
    }

    #[inline(always)]
    fn curl<const STRETCHED: usize>(&mut self, v: usize) -> Lanes {
        let [a1, a0, b1, b0] = self.near;
        let (a1, a0, b1, b0) = (a1[v], a0[v], b1[v], b0[v]);
        let [ra, rb] = self.rates;
        let (mut da, mut db) = ([0.0; VECTOR], [0.0; VECTOR]);
        for l in 0..VECTOR {
            (da[l], db[l]) = (a1[l] - a0[l], b1[l] - b0[l]);
        }
        let (mut a, mut b) = ([0.0; VECTOR], [0.0; VECTOR]);
        for l in 0..VECTOR {
            (a[l], b[l]) = (da[l] * ra, db[l] * rb);
        }
        if WIDE & FIRST != 0 {
            let (f1, f0) = (self.far[0][v], self.far[1][v]);
            for l in 0..VECTOR {
                a[l] += (f1[l] - f0[l]) * self.far_rates[0];
            }
        }
        if WIDE & SECOND != 0 {
            let (f1, f0) = (self.far[2][v], self.far[3][v]);
            for l in 0..VECTOR {
                b[l] += (f1[l] - f0[l]) * self.far_rates[1];
            }
        }
        if STRETCHED != NEITHER {
            let [keep, gain] = self.bc;
            let mut psi = self.psi[v];
            for l in 0..VECTOR {
                let d = if STRETCHED == FIRST { da[l] } else { db[l] };
                psi[l] = keep * psi[l] + gain * d;
                if STRETCHED == FIRST {
                    a[l] += psi[l];
                } else {
                    b[l] += psi[l];
                }
            }
            self.psi[v] = psi;
        }
        let mut out = [0.0; VECTOR];
        for l in 0..VECTOR {
            out[l] = a[l] - b[l];
        }
        out
    }
}

/// H ← H − dt curl E.
#[inline(always)]
pub(super) fn h_row<const STRETCHED: usize, const WIDE: usize>(
    h: &mut [f32],
    curl: Curl<'_>,
    psi: Psi<'_>,
) {
    let h = vectors_mut(h);
    let mut curl = Vectors::<WIDE>::new(curl, psi, h.len());
    for (v, place) in h.iter_mut().enumerate() {
        let c = curl.curl::<STRETCHED>(v);
        let mut h = *place;
        for l in 0..VECTOR {
            h[l] -= c[l];
        }
        *place = h;
    }
}

/// E ← ca E + cb dt curl H.
#[inline(always)]
pub(super) fn e_row<const STRETCHED: usize, const WIDE: usize>(
    e: &mut [f32],
    row: &Row,
    curl: Curl<'_>,
    psi: Psi<'_>,
) {
    let e = vectors_mut(e);
    let n = e.len();
    let (ca, cb) = (vectors(&row.ca, n), vectors(&row.cb, n));
    let mut curl = Vectors::<WIDE>::new(curl, psi, n);
    for (v, place) in e.iter_mut().enumerate() {
        let c = curl.curl::<STRETCHED>(v);
        let (mut e, ca, cb) = (*place, ca[v], cb[v]);
        for l in 0..VECTOR {
            e[l] = ca[l] * e[l] + cb[l] * c[l];
        }
        *place = e;
    }
}

/// Adds g q − h P of a pole to `drive`.
#[inline(always)]
pub(super) fn pole_drive(drive: &mut [f32], pole: &[Vec<f32>; 5], q: &[f32], p: &[f32]) {
    let drive = vectors_mut(drive);
    let n = drive.len();
    let (g, h) = (vectors(&pole[3], n), vectors(&pole[4], n));
    let (q, p) = (vectors(q, n), vectors(p, n));
    for (v, place) in drive.iter_mut().enumerate() {
        let (mut drive, g, h, q, p) = (*place, g[v], h[v], q[v], p[v]);
        for l in 0..VECTOR {
            drive[l] += g[l] * q[l] - h[l] * p[l];
        }
        *place = drive;
    }
}

/// As [`e_row`], less the poles' `drive`, which becomes E + E before.
#[inline(always)]
pub(super) fn e_row_driven<const STRETCHED: usize, const WIDE: usize>(
    e: &mut [f32],
    row: &Row,
    curl: Curl<'_>,
    psi: Psi<'_>,
    drive: &mut [f32],
) {
    let e = vectors_mut(e);
    let n = e.len();
    let (ca, cb) = (vectors(&row.ca, n), vectors(&row.cb, n));
    let mut curl = Vectors::<WIDE>::new(curl, psi, n);
    for (v, (e_place, sum_place)) in e.iter_mut().zip(vectors_mut(drive)).enumerate() {
        let c = curl.curl::<STRETCHED>(v);
        let (mut e, mut sum, ca, cb) = (*e_place, *sum_place, ca[v], cb[v]);
        for l in 0..VECTOR {
            let before = e[l];
            e[l] = (ca[l] * before + cb[l] * c[l]) - sum[l];
            sum[l] = e[l] + before;
        }
        *e_place = e;
        *sum_place = sum;
    }
}

/// Steps q and P of a pole; `sum` is E + E before.
#[inline(always)]
pub(super) fn pole_row(q: &mut [f32], p: &mut [f32], pole: &[Vec<f32>; 5], sum: &[f32]) {
    let (q, p) = (vectors_mut(q), vectors_mut(p));
    let n = q.len();
    let (alpha, beta) = (vectors(&pole[0], n), vectors(&pole[1], n));
    let (xi, sum) = (vectors(&pole[2], n), vectors(sum, n));
    for (v, (q_place, p_place)) in q.iter_mut().zip(p).enumerate() {
        let (mut q, mut p, sum) = (*q_place, *p_place, sum[v]);
        let (alpha, beta, xi) = (alpha[v], beta[v], xi[v]);
        for l in 0..VECTOR {
            let before = q[l];
            q[l] = (alpha[l] * before - beta[l] * p[l]) + xi[l] * sum[l];
            p[l] += 0.5 * (before + q[l]);
        }
        *q_place = q;
        *p_place = p;
    }
}
