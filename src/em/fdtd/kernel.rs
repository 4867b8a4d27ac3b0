//! One row of one component, a vector of [`VECTOR`] nodes at a time. Written so that the compiler makes full vectors of it at each level:
//! fixed-size chunks, no branch on data, no contraction of products and sums (the bits must not depend on the level).

use super::coefficients::Row;
use super::layout::VECTOR;

type Lanes = [f32; VECTOR];

/// Which of the two differences of a curl is stretched by an absorbing layer.
pub(super) const NEITHER: usize = 0;
pub(super) const FIRST: usize = 1;
pub(super) const SECOND: usize = 2;

/// (upper, lower) values of the two differences and their rates: a curl is (a1 − a0) ra − (b1 − b0) rb.
#[derive(Clone, Copy)]
pub(super) struct Curl<'a> {
    pub a: [&'a [f32]; 2],
    pub b: [&'a [f32]; 2],
    pub rates: [f32; 2],
}

/// ψ of the stretched difference, with b and c; empty if none is.
pub(super) struct Psi<'a> {
    pub row: &'a mut [f32],
    pub bc: [f32; 2],
}

#[inline(always)]
fn vectors(row: &[f32], count: usize) -> &[Lanes] {
    &row.as_chunks::<VECTOR>().0[..count]
}

/// The curl of one vector of nodes.
#[inline(always)]
fn curl_of<const STRETCHED: usize>(
    [a1, a0, b1, b0]: [&Lanes; 4],
    [ra, rb]: [f32; 2],
    psi: &mut Lanes,
    [b, c]: [f32; 2],
) -> Lanes {
    std::array::from_fn(|l| {
        let (da, db) = (a1[l] - a0[l], b1[l] - b0[l]);
        let (mut ta, mut tb) = (da * ra, db * rb);
        if STRETCHED == FIRST {
            psi[l] = b * psi[l] + c * da;
            ta += psi[l];
        }
        if STRETCHED == SECOND {
            psi[l] = b * psi[l] + c * db;
            tb += psi[l];
        }
        ta - tb
    })
}

/// Calls `node_vector(place, curl)` along a row of `count` vectors.
#[inline(always)]
fn along_row<const STRETCHED: usize>(
    count: usize,
    curl: Curl<'_>,
    psi: Psi<'_>,
    mut node_vector: impl FnMut(usize, Lanes),
) {
    let [a1, a0] = curl.a.map(|row| vectors(row, count));
    let [b1, b0] = curl.b.map(|row| vectors(row, count));
    let mut none = [0.0; VECTOR];
    let stretched = psi.row.as_chunks_mut::<VECTOR>().0;
    for v in 0..count {
        let psi_v = if STRETCHED == NEITHER {
            &mut none
        } else {
            &mut stretched[v]
        };
        let nodes = [&a1[v], &a0[v], &b1[v], &b0[v]];
        node_vector(v, curl_of::<STRETCHED>(nodes, curl.rates, psi_v, psi.bc));
    }
}

/// H ← H − dt curl E.
#[inline(always)]
pub(super) fn h_row<const STRETCHED: usize>(h: &mut [f32], curl: Curl<'_>, psi: Psi<'_>) {
    let h = h.as_chunks_mut::<VECTOR>().0;
    along_row::<STRETCHED>(h.len(), curl, psi, |v, c| {
        for l in 0..VECTOR {
            h[v][l] -= c[l];
        }
    });
}

/// E ← ca E + cb dt curl H.
#[inline(always)]
pub(super) fn e_row<const STRETCHED: usize>(
    e: &mut [f32],
    row: &Row,
    curl: Curl<'_>,
    psi: Psi<'_>,
) {
    let e = e.as_chunks_mut::<VECTOR>().0;
    let (ca, cb) = (vectors(&row.ca, e.len()), vectors(&row.cb, e.len()));
    along_row::<STRETCHED>(e.len(), curl, psi, |v, c| {
        for l in 0..VECTOR {
            e[v][l] = ca[v][l] * e[v][l] + cb[v][l] * c[l];
        }
    });
}

/// Adds g q − h P of a pole to `drive`.
#[inline(always)]
pub(super) fn pole_drive(drive: &mut [f32], pole: &[Vec<f32>; 5], q: &[f32], p: &[f32]) {
    let drive = drive.as_chunks_mut::<VECTOR>().0;
    let n = drive.len();
    let (g, h) = (vectors(&pole[3], n), vectors(&pole[4], n));
    let (q, p) = (vectors(q, n), vectors(p, n));
    for v in 0..n {
        for l in 0..VECTOR {
            drive[v][l] += g[v][l] * q[v][l] - h[v][l] * p[v][l];
        }
    }
}

/// As [`e_row`], less the poles' `drive`, which becomes E + E before.
#[inline(always)]
pub(super) fn e_row_driven<const STRETCHED: usize>(
    e: &mut [f32],
    row: &Row,
    curl: Curl<'_>,
    psi: Psi<'_>,
    drive: &mut [f32],
) {
    let e = e.as_chunks_mut::<VECTOR>().0;
    let drive = &mut drive.as_chunks_mut::<VECTOR>().0[..e.len()];
    let (ca, cb) = (vectors(&row.ca, e.len()), vectors(&row.cb, e.len()));
    along_row::<STRETCHED>(e.len(), curl, psi, |v, c| {
        for l in 0..VECTOR {
            let before = e[v][l];
            e[v][l] = (ca[v][l] * before + cb[v][l] * c[l]) - drive[v][l];
            drive[v][l] = e[v][l] + before;
        }
    });
}

/// Steps q and P of a pole; `sum` is E + E before.
#[inline(always)]
pub(super) fn pole_row(q: &mut [f32], p: &mut [f32], pole: &[Vec<f32>; 5], sum: &[f32]) {
    let q = q.as_chunks_mut::<VECTOR>().0;
    let n = q.len();
    let p = &mut p.as_chunks_mut::<VECTOR>().0[..n];
    let [alpha, beta, xi] = [&pole[0], &pole[1], &pole[2]].map(|row| vectors(row, n));
    let sum = vectors(sum, n);
    for v in 0..n {
        for l in 0..VECTOR {
            let before = q[v][l];
            q[v][l] = (alpha[v][l] * before - beta[v][l] * p[v][l]) + xi[v][l] * sum[v][l];
            p[v][l] += 0.5 * (before + q[v][l]);
        }
    }
}
