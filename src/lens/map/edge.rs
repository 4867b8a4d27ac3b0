//! The edge of the pupil: how far out rays pass each surface that limits the bundle.
//!
//! A direction from the middle of the pupil's disk is told by where it leaves a square: one of four sides, and the
//! place along it. No angle, no root. Along each direction the largest of |p|, |q| that passes is kept.

use glam::DVec2;

/// Directions around the square.
pub(super) const DIRECTIONS: usize = 256;
/// Part of them in which rays are traced; the others are cubic between.
const TRACED: usize = DIRECTIONS / 4;
/// Directions per side.
const SIDE: usize = DIRECTIONS / 4;
/// How far out from the middle it is looked for: a little more than the disk.
pub(super) const OUTERMOST: f64 = 1.03;
/// Bisections: to 2e-5 of the disk's radius.
const BISECTIONS: usize = 15;

/// Half the way around a guess in which the edge is looked for first.
const NEAR: f64 = 0.01;
/// Bisections of that.
const NEAR_BISECTIONS: usize = 9;

/// Rays that an outline takes, and one whose guess is good.
pub(super) const RAYS: usize = TRACED * (BISECTIONS + 1);
pub(super) const RAYS_NEAR: usize = TRACED * (NEAR_BISECTIONS + 2);

/// The point at direction `t` (0 to [`DIRECTIONS`]) of the square of half side 1.
pub(super) fn on_square(t: f64) -> DVec2 {
    let side = (t / SIDE as f64).floor();
    let along = 2.0 * (t / SIDE as f64 - side) - 1.0;
    match side as usize % 4 {
        0 => DVec2::new(1.0, along),
        1 => DVec2::new(-along, 1.0),
        2 => DVec2::new(-1.0, -along),
        _ => DVec2::new(along, -1.0),
    }
}

/// How far out rays pass along all directions; see [`reach`].
pub(super) fn outline(pass: impl FnMut(&[DVec2]) -> Vec<bool>) -> Vec<f64> {
    let step = DIRECTIONS / TRACED;
    let directions: Vec<DVec2> = (0..TRACED).map(|k| on_square((k * step) as f64)).collect();
    // Radii: the square's corners are no bends of theirs.
    let radii: Vec<f64> = (reach(&directions, pass).iter().zip(&directions))
        .map(|(r, d)| r * d.length())
        .collect();
    (0..DIRECTIONS)
        .map(|k| {
            let (node, t) = (k / step, (k % step) as f64 / step as f64);
            let radius = |back: usize| radii[(node + TRACED + back - 1) % TRACED];
            let (a, b, c, d) = (radius(0), radius(1), radius(2), radius(3));
            let cubic = -t * (t - 1.0) * (t - 2.0) / 6.0 * a
                + (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0 * b
                - (t + 1.0) * t * (t - 2.0) / 2.0 * c
                + (t + 1.0) * t * (t - 1.0) / 6.0 * d;
            cubic / on_square(k as f64).length()
        })
        .collect()
}

/// How far out, in units of the square's points, rays pass along each of the `directions`. `pass` tells which of many
/// points (p, q) do.
pub(super) fn reach(directions: &[DVec2], mut pass: impl FnMut(&[DVec2]) -> Vec<bool>) -> Vec<f64> {
    let mut bracket: Vec<(f64, f64)> = (directions.iter())
        .map(|d| (0.0, OUTERMOST / d.length()))
        .collect();
    let mut points = Vec::new();
    for bisection in 0..=BISECTIONS {
        points.clear();
        // At first the far end: where it passes, nothing limits.
        let at = |b: &(f64, f64)| {
            if bisection == 0 {
                b.1
            } else {
                0.5 * (b.0 + b.1)
            }
        };
        points.extend(directions.iter().zip(&bracket).map(|(d, b)| *d * at(b)));
        for (bracket, passes) in bracket.iter_mut().zip(pass(&points)) {
            let middle = at(bracket);
            if passes {
                bracket.0 = middle;
            } else {
                bracket.1 = middle;
            }
        }
    }
    bracket.iter().map(|b| 0.5 * (b.0 + b.1)).collect()
}

/// The same for directions with a guess each: few rays where it is good.
pub(super) fn reach_near(
    guesses: impl Iterator<Item = (DVec2, f64)>,
    mut pass: impl FnMut(&[DVec2]) -> Vec<bool>,
) -> Vec<f64> {
    let guesses: Vec<(DVec2, f64)> = guesses.collect();
    let mut passes_at = |off: f64| {
        let points: Vec<DVec2> = guesses
            .iter()
            .map(|(d, r)| *d * (r + off).max(0.0))
            .collect();
        pass(&points)
    };
    let (below, above) = (passes_at(-NEAR), passes_at(NEAR));
    let is_near: Vec<bool> = below.iter().zip(above).map(|(b, a)| *b && !a).collect();
    let mut bracket: Vec<(f64, f64)> = guesses.iter().map(|(_, r)| (r - NEAR, r + NEAR)).collect();
    for _ in 0..NEAR_BISECTIONS {
        let middles: Vec<f64> = bracket.iter().map(|(a, b)| 0.5 * (a + b)).collect();
        let points: Vec<DVec2> = guesses
            .iter()
            .zip(&middles)
            .map(|((d, _), m)| *d * *m)
            .collect();
        for ((bracket, middle), passes) in bracket.iter_mut().zip(middles).zip(pass(&points)) {
            if passes {
                bracket.0 = middle;
            } else {
                bracket.1 = middle;
            }
        }
    }
    let mut found: Vec<f64> = bracket.iter().map(|(a, b)| 0.5 * (a + b)).collect();
    let far: Vec<usize> = (0..guesses.len()).filter(|k| !is_near[*k]).collect();
    let directions: Vec<DVec2> = far.iter().map(|k| guesses[*k].0).collect();
    if !far.is_empty() {
        for (k, reach) in far.into_iter().zip(reach(&directions, pass)) {
            found[k] = reach;
        }
    }
    found
}

/// Direction of a point, 0 to [`DIRECTIONS`], and its distance in units of the square's: the f32 form that every ray
/// takes.
#[inline(always)]
pub(super) fn direction(p: f32, q: f32) -> (f32, f32) {
    let (ap, aq) = (p.abs(), q.abs());
    let wide = ap >= aq;
    let (far, other, sign) = if wide { (ap, q, p) } else { (aq, -p, q) };
    let far_safe = if far > 1e-20 { far } else { 1e-20 };
    // Along the side, counter-clockwise: (1, a) → a = q/p; (−a, 1) → −p/q; (−1, −a) → q/p; (a, −1) → −p/q.
    let along = if sign < 0.0 { -other } else { other } / far_safe;
    let side = if wide {
        if sign < 0.0 { 2.0 } else { 0.0 }
    } else if sign < 0.0 {
        3.0
    } else {
        1.0
    };
    (SIDE as f32 * (side + 0.5 * (along + 1.0)), far)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_run_around_the_square() {
        for k in 0..4 * DIRECTIONS {
            let t = k as f64 / 4.0 + 0.1;
            let p = on_square(t) * 0.3;
            let (direction, far) = direction(p.x as f32, p.y as f32);
            assert!((f64::from(direction) - t).abs() < 1e-4, "{t} {direction}");
            assert!((far - 0.3).abs() < 1e-6);
        }
    }

    #[test]
    fn the_reach_of_a_circle_is_found() {
        let directions: Vec<DVec2> = (0..DIRECTIONS).map(|k| on_square(k as f64)).collect();
        let found = reach(&directions, |points| {
            points.iter().map(|p| p.length() < 0.8).collect()
        });
        for (d, r) in directions.iter().zip(found) {
            assert!((r * d.length() - 0.8).abs() < 3e-5);
        }
        // By guesses, good ones and bad.
        let guesses = (directions.iter().enumerate()).map(|(k, d)| {
            (
                *d,
                0.8 / d.length() + [0.003, -0.009, 0.2, -0.5, -1.0][k % 5],
            )
        });
        let found = reach_near(guesses, |points| {
            points.iter().map(|p| p.length() < 0.8).collect()
        });
        for (d, r) in directions.iter().zip(found) {
            assert!((r * d.length() - 0.8).abs() < 3e-5);
        }
    }
}
