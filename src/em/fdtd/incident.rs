//! The plane wave that the current sheet sends out, as the grid has it: the closed form of what a run without a pixel
//! would measure.
//!
//! A sheet of surface current J in layers of equal thickness in air sends E = −J/(2Y) up and down, with the grid's
//! admittances Y_s = K_z cos(k_z dz/2)/Ω across the plane of incidence and Y_p = ε′ Ω cos(k_z dz/2)/K_z along it.

use rustfft::num_complex::Complex64;

use super::dispersion::Numerics;
use super::mesh::Mesh;
use super::powers::{Fields, Side};

type C = Complex64;

/// Tangential E and H of the emitted wave at the sheet, at the origin of the grid.
pub(super) struct Incident {
    /// Ex, Ey.
    e: [C; 2],
    /// What belongs to Ex (Hy) and to Ey (−Hx) in the wave that goes up.
    h: [C; 2],
    /// e^(i k_z (z − z_source)) on the outlet plane.
    to_outlet: C,
}

impl Incident {
    /// For a sheet of amplitude `current` times `spectrum`, the Fourier transform of the waveform.
    pub fn new(mesh: &Mesh, numerics: &Numerics, current: [f64; 2], spectrum: C) -> Self {
        let air = mesh.air();
        let epsilon = numerics.permittivity(C::ONE, air);
        let (along, half) = numerics.along_z(epsilon, air);
        let [kx, ky] = numerics.transverse(air.stencils);
        let k = kx.hypot(ky);
        // Unit vectors along the plane of incidence and across it.
        let p = if k > 0.0 {
            [kx / k, ky / k]
        } else {
            [1.0, 0.0]
        };
        let s = [-p[1], p[0]];
        let omega = numerics.leapfrog_omega();
        let admittance = [
            along * half.cos() / omega,
            epsilon * omega * half.cos() / along,
        ];
        let (mut e, mut h) = ([C::ZERO; 2], [C::ZERO; 2]);
        for (direction, y) in [s, p].iter().zip(admittance) {
            let j = current[0] * direction[0] + current[1] * direction[1];
            let amplitude = -j * spectrum / (2.0 * y);
            for a in 0..2 {
                e[a] += amplitude * direction[a];
                h[a] += y * amplitude * direction[a];
            }
        }
        let planes = (mesh.outlet - mesh.source) as f64;
        Self {
            e,
            h,
            to_outlet: (C::I * 2.0 * half * planes).exp(),
        }
    }

    /// Power that falls on the period (of the stepper's size).
    pub fn power(&self, mesh: &Mesh) -> f64 {
        let flux: f64 = self
            .e
            .iter()
            .zip(&self.h)
            .map(|(e, h)| (e * h.conj()).re)
            .sum();
        0.5 * flux * area_um2(mesh)
    }

    /// Flux above the source less what the source itself sends up, its interference with the reflected wave included:
    /// only the order of the incident wave interferes.
    pub fn reflected(&self, fields: &Fields, total: f64, current: [f64; 2]) -> f64 {
        let mesh = fields.mesh;
        let mirrored = mesh.mirrors[0] || mesh.mirrors[1];
        let area = area_um2(mesh);
        let mut out = total;
        for (a, own) in current.iter().enumerate() {
            // Between mirrors the other component is odd, and its mean over the period zero.
            if mirrored && *own == 0.0 {
                continue;
            }
            let (e, h) = self.order(fields, a);
            let (own_e, own_h) = (self.e[a] * self.to_outlet, self.h[a] * self.to_outlet);
            let with = (e * h.conj()).re;
            let without = ((e - own_e) * (h - own_h).conj()).re;
            out += 0.5 * area * (without - with);
        }
        out
    }

    /// Amplitude of E_a and its H in the order of the incident wave on the outlet plane.
    fn order(&self, fields: &Fields, a: usize) -> (C, C) {
        let mesh = fields.mesh;
        let g = &mesh.grid;
        let [kx, ky] = fields.numerics.bloch;
        let sign = if a == 0 { 1.0 } else { -1.0 };
        let (mut e, mut h, mut count) = (C::ZERO, C::ZERO, 0.0);
        // Ex at (i+½, j): a mirror's two end rows have half a place each; so for Ey in x.
        let last = |axis: usize, n: usize| {
            if axis != a && mesh.mirrors[axis] {
                n + 1
            } else {
                n
            }
        };
        for j in 0..last(1, g.ny()) {
            for i in 0..last(0, g.nx()) {
                let end = |axis: usize, i: usize, n: usize| {
                    if axis != a && mesh.mirrors[axis] && (i == 0 || i == n) {
                        0.5
                    } else {
                        1.0
                    }
                };
                let weight = end(0, i, g.nx()) * end(1, j, g.ny());
                let (hx, hy) = if a == 0 { (0.5, 0.0) } else { (0.0, 0.5) };
                let phase = kx * (i as f64 + hx) * mesh.lateral_um()[0]
                    + ky * (j as f64 + hy) * mesh.lateral_um()[1];
                let turn = C::from_polar(weight, -phase);
                e += turn * fields.phasors.e(a, i, j, mesh.outlet);
                h += turn * sign * fields.h_on_plane(a, [i, j, mesh.outlet], Side::Both);
                count += weight;
            }
        }
        (e / count, h / count)
    }
}

/// Of the whole period, as the stepper has it.
fn area_um2(mesh: &Mesh) -> f64 {
    let g = &mesh.grid;
    let times = mesh.mirrors.map(|m| if m { 2.0 } else { 1.0 });
    g.dx_um() * g.dy_um() * (g.nx() * g.ny()) as f64 * times[0] * times[1]
}
