//! Light through the lens and the layers below it, from above: h = s − U E, where U is the admittance of what stands
//! above, looked at from below, and s what the incident wave makes of it. In air U = Y and s = 2 Y E of the incident
//! wave.
//!
//! It is the mirror image of `layers.rs`, with the source that comes down: a layer of waves f (down) and g (up) at its
//! top has ρ = (Y + U)⁻¹ (Y − U), f = ρ g + q, q = (Y + U)⁻¹ s; at its bottom, with ρ' = X ρ X, U' = Y (1 − ρ') (1 +
//! ρ')⁻¹ and s' = (U' + Y) X q.

use super::basis::Basis;
use super::layers::{self, Climbed};
use super::linear::{C, Matrix, scale_rows, solve};
use super::uniform::Uniform;

/// What stands above, as seen from below.
pub(super) struct Lighting {
    /// U.
    pub admittance: Matrix,
    /// s, a column a wave.
    pub source: Matrix,
}

impl Lighting {
    /// Air, with incident waves of these E.
    pub fn air(basis: &Basis, incident: &Matrix) -> Self {
        let air = Uniform::new(basis, C::ONE);
        Self {
            admittance: air.matrix(),
            source: air.times(incident) * faer::Scale(C::from(2.0)),
        }
    }
}

/// What a layer makes of what is above it.
pub(super) struct Sunk {
    pub below: Lighting,
    /// E at the top of E at the bottom ...
    pub passage: Matrix,
    /// ... and what the source adds to it.
    pub driven: Matrix,
}

/// Through a uniform layer.
pub(super) fn sink(basis: &Basis, epsilon: C, k0_d: f64, above: &Lighting) -> Sunk {
    let medium = Uniform::new(basis, epsilon);
    let Lighting { admittance, source } = above;
    // A layer does not know up from down.
    let Climbed {
        above: admittance_below,
        passage,
    } = layers::uniform(basis, epsilon, k0_d, admittance);
    let at_top = solve(&(&medium.matrix() + admittance), source);
    let at_bottom = scale_rows(at_top.clone(), &medium.phases(k0_d));
    let source = &admittance_below * &at_bottom + medium.times(&at_bottom);
    let driven = at_top - &passage * at_bottom;
    Sunk {
        below: Lighting {
            admittance: admittance_below,
            source,
        },
        passage,
        driven,
    }
}
