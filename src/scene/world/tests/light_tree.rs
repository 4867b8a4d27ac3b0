//! Chances of many lights: they add up, and none is 0 of a light that lights. Rays that meet a light are told so.

use glam::{DVec3, Vec3, Vec3A};

use super::super::light_bounds::LightBounds;
use super::super::light_node::Receiver;
use super::super::light_tree::LightTree;
use super::super::triangles::WalkRay;
use crate::sampling::uniform;

/// Lights as small triangles: 300 of them, half in a cluster.
fn lights() -> Vec<LightBounds> {
    let u = |k: usize, d: u64| uniform(5, &[k as u64, d]) as f32;
    (0..300)
        .map(|k| {
            let size = if k % 2 == 0 { 3.0 } else { 1000.0 };
            let at = |d| size * (Vec3::new(u(k, d), u(k, d + 1), u(k, d + 2)) - 0.5);
            let corners = [0, 3, 6].map(|d| at(20) + 0.05 * at(d));
            LightBounds::triangle(corners, k % 7 == 0, f64::from(0.1 + u(k, 11)))
        })
        .collect()
}

fn receivers() -> impl Iterator<Item = Receiver> {
    (0..40u64).map(|k| {
        let u = |d| uniform(6, &[k, d]) as f32 - 0.5;
        Receiver {
            place: 1200.0 * Vec3A::new(u(0), u(1), u(2)),
            normal: Vec3A::new(u(3), u(4), u(5)).normalize(),
        }
    })
}

#[test]
fn chances_add_up_and_are_those_with_which_lights_are_drawn() {
    let lights = lights();
    let tree = LightTree::new(&lights);
    for receiver in receivers() {
        let chances: Vec<f32> = (0..lights.len())
            .map(|i| tree.chance(i, &receiver))
            .collect();
        let draws = 20_000;
        let mut found = vec![0.0; lights.len()];
        let mut without = 0.0;
        for i in 0..draws {
            let u = (i as f32 + 0.5) / draws as f32;
            let Some((light, chance)) = tree.draw(&receiver, u) else {
                without += 1.0 / draws as f32;
                continue;
            };
            assert!((chance / chances[light] - 1.0).abs() < 1e-4);
            found[light] += 1.0 / draws as f32;
        }
        // A node may lead to lights of which, on a closer look, nothing arrives.
        let sum: f32 = chances.iter().sum();
        assert!((sum + without - 1.0).abs() < 1e-3, "{sum}, {without}");
        for (chance, found) in chances.iter().zip(found) {
            // A light's u are two intervals.
            assert!((chance - found).abs() < 2.5e-4, "{chance} {found}");
        }
    }
}

/// An importance of 0 is right: every corner of such a light is behind the receiver, or the receiver behind the light.
#[test]
fn only_lights_of_which_nothing_arrives_have_no_importance() {
    let u = |k: u64, d: u64| uniform(5, &[k, d]) as f32;
    let corners: Vec<[Vec3; 3]> = (0..200u64)
        .map(|k| {
            let at = |d| Vec3::new(u(k, d), u(k, d + 1), u(k, d + 2)) - 0.5;
            [0, 3, 6].map(|d| 500.0 * at(20) + 100.0 * at(d))
        })
        .collect();
    let lights: Vec<LightBounds> = corners
        .iter()
        .map(|c| LightBounds::triangle(*c, false, 1.0))
        .collect();
    let tree = LightTree::new(&lights);
    let mut without = 0;
    for receiver in receivers() {
        for (i, c) in corners.iter().enumerate() {
            let front = (c[1] - c[0]).cross(c[2] - c[0]).normalize();
            let is_lit = front.dot(Vec3::from(receiver.place) - c[0]) > 1e-3
                && c.iter()
                    .any(|p| receiver.normal.dot(Vec3A::from(*p) - receiver.place) > 1e-3);
            let chance = tree.chance_by_importance(i, &receiver);
            assert!(chance > 0.0 || !is_lit, "light {i}");
            without += usize::from(chance == 0.0);
        }
    }
    // A third of all pairs or more are left out indeed: half of the lights turn away, half lie behind.
    assert!(without > 200 * 40 / 3, "{without}");
}

#[test]
fn a_tree_of_no_light_of_one_and_of_many_at_one_place() {
    let receiver = Receiver {
        place: Vec3A::ZERO,
        normal: Vec3A::Z,
    };
    assert!(LightTree::new(&[]).draw(&receiver, 0.5).is_none());
    let one = LightBounds::point(Vec3::Z, 1.0);
    assert_eq!(LightTree::new(&[one]).draw(&receiver, 0.5), Some((0, 1.0)));
    let tree = LightTree::new(&[one; 1000]);
    let (light, chance) = tree.draw(&receiver, 0.7).unwrap();
    assert!((chance - 1e-3).abs() < 1e-6);
    assert!((tree.chance(light, &receiver) - chance).abs() < 1e-9);
    // Where the place is the light's own it gives nothing, and is drawn by power alone.
    let inside = LightTree::new(&[LightBounds::point(Vec3::ZERO, 1.0); 2]);
    assert!(inside.draw(&receiver, 0.7).is_none());
    assert!(inside.draw(&receiver, 0.05).is_some());
}

/// Rays to corners, edges and insides of lights, along axes, from near and from far; of rays anywhere half or more are
/// told to meet nothing.
#[test]
fn rays_that_meet_a_light_are_told_so() {
    let u = |k: u64, d: u64| uniform(8, &[k, d]);
    let corners: Vec<[DVec3; 3]> = (0..60u64)
        .map(|k| {
            let at = |d| DVec3::new(u(k, d), u(k, d + 1), u(k, d + 2)) - 0.5;
            let flat = DVec3::new(1.0, 1.0, if k % 3 == 0 { 0.0 } else { 1.0 });
            [0, 3, 6].map(|d| (500.0 * at(20) + 20.0 * flat * at(d)).as_vec3().as_dvec3())
        })
        .collect();
    let lights = corners
        .iter()
        .map(|c| LightBounds::triangle(c.map(|p| p.as_vec3()), false, 1.0));
    let tree = LightTree::new(&lights.collect::<Vec<_>>());
    let is_met = |origin: DVec3, direction: DVec3| {
        tree.may_be_met(&WalkRay::new(origin.as_vec3(), direction.as_vec3()))
    };
    let mut without = 0;
    let count = if cfg!(miri) { 100 } else { 20_000 };
    for k in 0..count {
        let direction = match k % 4 {
            0 => [DVec3::X, DVec3::NEG_Y, DVec3::Z][k as usize / 4 % 3],
            _ => (DVec3::new(u(k, 50), u(k, 51), u(k, 52)) - 0.5).normalize(),
        };
        let [p, q, r] = corners[k as usize % corners.len()];
        let (s, t) = [
            (0.0, 0.0),
            (u(k, 53), 0.0),
            (0.5 * u(k, 53), 0.5 * u(k, 54)),
        ][k as usize / 7 % 3];
        let place = p + s * (q - p) + t * (r - p);
        let distance = 10f64.powf(6.0 * u(k, 55) - 2.0);
        assert!(is_met(place - distance * direction, direction), "ray {k}");
        without += usize::from(!is_met(3.0 * place, direction));
    }
    assert!(without * 2 > count as usize, "{without}");
    let ahead = WalkRay::new(Vec3::new(0.0, 0.0, 9e3), Vec3::Z);
    assert!(!tree.may_be_met(&ahead) && !LightTree::new(&[]).may_be_met(&ahead));
    // Of what overflows nothing is known.
    assert!(is_met(DVec3::splat(-3e38), DVec3::ONE.normalize()));
}
