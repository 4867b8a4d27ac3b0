//! Thin structures: wires and tubes, fences, springs, leaves and plants.

use std::f64::consts::TAU;

use glam::{DAffine3, DMat3, DVec3};

use super::shape::{Shape, sphere};
use crate::charts::keyed::Key;

/// A tube of radius `radius` along a smooth path t ∈ [0, 1], closed by round caps where `capped`.
pub(super) fn tube(
    path: impl Fn(f64) -> DVec3,
    radius: f64,
    (along, around): (usize, usize),
    capped: bool,
) -> Shape {
    // Frames carried along the path without twist (double reflection would be finer; these paths are gentle).
    let direction = |t: f64| {
        let (a, b) = ((t - 1e-4).max(0.0), (t + 1e-4).min(1.0));
        (path(b) - path(a)).normalize_or(DVec3::Y)
    };
    let mut side = direction(0.0).any_orthonormal_vector();
    let frames: Vec<(DVec3, DVec3, DVec3)> = (0..=along)
        .map(|k| {
            let t = k as f64 / along as f64;
            let d = direction(t);
            side = (side - d * side.dot(d)).normalize_or(d.any_orthonormal_vector());
            (path(t), side, d.cross(side))
        })
        .collect();
    let shape = Shape::patch(around, along, |u, v| {
        let x = v * along as f64;
        let k = (x as usize).min(along - 1);
        let f = x - k as f64;
        let (a, b) = (&frames[k], &frames[k + 1]);
        let centre = a.0.lerp(b.0, f);
        let (sin, cos) = (TAU * u).sin_cos();
        centre + radius * (cos * a.1.lerp(b.1, f) + sin * a.2.lerp(b.2, f))
    });
    if !capped {
        return shape;
    }
    let ball = sphere(radius, (around / 2).max(4));
    shape
        .with(&ball.clone().at(path(0.0)))
        .with(&ball.at(path(1.0)))
}

/// A straight wire between two points.
pub(super) fn wire(from: DVec3, to: DVec3, radius: f64) -> Shape {
    tube(|t| from.lerp(to, t), radius, (1, 10), true)
}

/// A coil spring about y: `turns` turns of radius `major`, `height` high.
pub(super) fn spring(major: f64, height: f64, turns: f64, radius: f64) -> Shape {
    let path = |t: f64| {
        let (sin, cos) = (TAU * turns * t).sin_cos();
        DVec3::new(major * cos, height * (t - 0.5), major * sin)
    };
    tube(path, radius, ((24.0 * turns) as usize, 10), true)
}

/// A trefoil knot of about the radius `size`.
pub(super) fn knot(size: f64, radius: f64) -> Shape {
    let path = |t: f64| {
        let a = TAU * t;
        let p = DVec3::new(
            a.sin() + 2.0 * (2.0 * a).sin(),
            a.cos() - 2.0 * (2.0 * a).cos(),
            -(3.0 * a).sin(),
        );
        p * (size / 3.0)
    };
    tube(path, radius, (160, 14), false)
}

/// An upright grating in the plane z = 0: `bars` wires, with two rails across.
pub(super) fn fence(width: f64, height: f64, bars: usize, radius: f64) -> Shape {
    let x = |k: usize| width * (k as f64 / (bars - 1).max(1) as f64 - 0.5);
    let bar = |k: usize| {
        let foot = DVec3::new(x(k), -0.5 * height, 0.0);
        wire(foot, foot + height * DVec3::Y, radius)
    };
    let rail = |y: f64| {
        let left = DVec3::new(x(0), y * height, 0.0);
        wire(left, left + width * DVec3::X, radius)
    };
    let bars = (0..bars).fold(Shape::default(), |s, k| s.with(&bar(k)));
    bars.with(&rail(-0.35)).with(&rail(0.35))
}

/// A blade of grass or a long leaf: rises from the origin along y and bends towards +z; a single sheet.
pub(super) fn leaf(length: f64, width: f64, bend: f64) -> Shape {
    Shape::patch(4, 12, |u, v| {
        let angle = bend * v;
        // An arc of constant curvature.
        let (y, z) = if bend.abs() < 1e-6 {
            (v, 0.0)
        } else {
            (angle.sin() / bend, (1.0 - angle.cos()) / bend)
        };
        let half = 0.5
            * width
            * (std::f64::consts::PI * v.clamp(0.0, 1.0).powf(0.7))
                .sin()
                .max(0.0);
        let fold = 0.3 * half * (2.0 * (u - 0.5)).powi(2);
        DVec3::new((2.0 * u - 1.0) * half, y * length, z * length - fold)
    })
}

/// A tuft of `count` leaves around y.
pub(super) fn plant(key: Key, height: f64, count: u64) -> Shape {
    (0..count).fold(Shape::default(), |plant, k| {
        let key = key.with(k);
        let one = leaf(
            height * key.range(0, 0.6, 1.1),
            height * key.range(1, 0.05, 0.14),
            key.range(2, 0.3, 1.6),
        );
        let turn = DMat3::from_rotation_y(TAU * key.uniform(3))
            * DMat3::from_rotation_x(key.range(4, 0.0, 0.4));
        plant.with(&one.moved(DAffine3::from_mat3(turn)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn a_closed_tube_has_the_volume_of_its_section_times_its_length() {
        // Pappus: a tube along a closed planar circle; the polygon of 64 corners lacks 0.16 % of the circle's area,
        // that of 96 along 0.07 % of its length.
        let ring = |t: f64| {
            let (sin, cos) = (TAU * t).sin_cos();
            DVec3::new(5.0 * cos, 0.0, 5.0 * sin)
        };
        let shape = tube(ring, 1.0, (96, 64), false);
        let ratio = shape.volume() / (PI * TAU * 5.0);
        assert!((ratio - 1.0).abs() < 0.005, "{ratio}");
    }

    #[test]
    fn a_leaf_keeps_its_length_when_it_bends() {
        for bend in [0.0, 0.7, 1.5] {
            let shape = leaf(10.0, 0.0, bend);
            let column = |k: usize| shape.positions[5 * k + 2];
            let length: f64 = (0..12).map(|k| column(k).distance(column(k + 1))).sum();
            assert!((length - 10.0).abs() < 0.02, "{bend}: {length}");
        }
    }
}
