//! Pairs of rays on cards beside one ray and one card at a time.

use std::sync::Arc;

use glam::DVec3;

use super::*;
use crate::rays::RayBatch;
use crate::scene::coverage::Coverage;
use crate::scene::texture::Texture;

/// No multiple of a block.
const RAYS: usize = 3 * BLOCK + 37;

/// Between −1 and 1.
fn random(number: usize, dimension: usize) -> f64 {
    let x = (12.9898 * number as f64 + 78.233 * dimension as f64).sin() * 43758.5453;
    2.0 * (x - x.floor()) - 1.0
}

/// A tilted card with a hole before a smaller one and a large one.
fn cards() -> Cards {
    let card = |z: f64, size: f64, tilt: f64, coverage| {
        let texture =
            Texture::from_fn(9, 7, |x, y| [x as f32 - z as f32, y as f32, (x * y) as f32]);
        let at = DVec3::new(0.1 * size, 0.0, z);
        let turned = (tilt, -0.5 * tilt, tilt);
        TexturedPlane::new(
            at,
            (size, size),
            turned,
            Arc::new(texture.unwrap()),
            coverage,
        )
    };
    let hole = Coverage::new(3, vec![1, 1, 1, 1, 0, 1, 1, 1, 1]).unwrap();
    let planes = [
        card(-100.0, 40.0, 20.0, Some(Arc::new(hole))),
        card(-130.0, 30.0, 0.0, None),
        card(-200.0, 110.0, -10.0, None),
    ];
    Cards::new(planes.map(Result::unwrap).to_vec(), [0.1, 0.2, 0.3])
}

/// Rays over all of them and beside them; one is lost and has no place.
fn rays() -> RayBatch {
    let mut batch = RayBatch::with_capacity(RAYS);
    for i in 0..RAYS {
        let to = DVec3::new(70.0 * random(i, 0), 70.0 * random(i, 1), -200.0);
        let from = DVec3::new(2.0 * random(i, 2), 2.0 * random(i, 3), 0.0);
        batch.push(from, (to - from).normalize());
    }
    batch.ox[5] = f64::NAN;
    batch
}

/// One ray and one card at a time.
fn plainly(
    cards: &Cards,
    batch: &RayBatch,
    to_card: impl Fn(usize, usize) -> [f32; 2],
) -> Vec<u16> {
    let first = |i: usize| {
        let ray = batch.ray(i);
        let met = |number: &usize| {
            let (plane, to_card) = (&cards.planes[*number], to_card(*number, i));
            plane.crossing(&ray).is_some_and(|at| {
                let [s, t] = [at.x + f64::from(to_card[0]), at.y + f64::from(to_card[1])];
                let on = |x: f64| (0.0..=1.0).contains(&x);
                on(s) && on(t) && plane.is_solid_at(s as f32, t as f32)
            })
        };
        // They stand one behind the other.
        let number = (0..cards.planes.len()).find(met);
        number.map_or(NO_SURFACE, |number| number as u16)
    };
    (0..batch.len()).map(first).collect()
}

fn hits() -> Hits {
    let mut hits = Hits::default();
    hits.reset_for_cards(RAYS);
    hits
}

/// Of a ray on a card: s and t to where the card must be, and to the place.
fn way(card: usize, ray: usize) -> [[f32; 2]; 2] {
    let random = |dimension| 0.2 * random(ray, 10 * card + dimension) as f32;
    [[random(4), random(5)], [random(6), random(7)]]
}

fn pairs(cards: &Cards, batch: &RayBatch, reach: f64) -> [Hits; 2] {
    let [mut plain, mut beside] = [hits(), hits()];
    let ways = |card: usize, rays: Range<usize>, [_, ways]: &mut [Ways; 2]| {
        for (i, ray) in rays.enumerate() {
            let [to_card, to_place] = way(card, ray);
            for k in 0..2 {
                (ways.to_card[k][i], ways.to_place[k][i]) = (to_card[k], to_place[k]);
            }
        }
    };
    let rays = RaySlices::from_batch(batch);
    cards.intersect_pairs(rays, |_| reach, ways, [&mut plain, &mut beside]);
    [plain, beside]
}

#[test]
fn pairs_meet_what_each_ray_meets_alone() {
    let (cards, batch) = (cards(), rays());
    let mut alone = hits();
    cards.intersect(RaySlices::from_batch(&batch), &mut alone);
    assert_eq!(alone.surface, plainly(&cards, &batch, |_, _| [0.0; 2]));
    for surface in [0, 1, 2, NO_SURFACE] {
        assert!(alone.surface.iter().filter(|met| **met == surface).count() > 10);
    }
    let [plain, beside] = pairs(&cards, &batch, 0.2);
    assert_eq!(plain.surface, alone.surface);
    assert_eq!(plain.distance_mm, alone.distance_mm);
    assert_eq!(plain.cards.s, alone.cards.s);
    assert_eq!(
        beside.surface,
        plainly(&cards, &batch, |card, ray| way(card, ray)[0])
    );
    assert_ne!(beside.surface, alone.surface);
    for ray in 0..RAYS {
        if let Some(plane) = cards.planes.get(beside.surface[ray] as usize) {
            let at = plane.crossing(&batch.ray(ray)).unwrap();
            let [_, to] = way(beside.surface[ray] as usize, ray);
            assert!((f64::from(beside.cards.s[ray]) - at.x - f64::from(to[0])).abs() < 1e-6);
            assert!((f64::from(beside.cards.t[ray]) - at.y - f64::from(to[1])).abs() < 1e-6);
        }
    }
}

#[test]
fn radiance_is_that_of_each_hit_alone() {
    let (cards, batch) = (cards(), rays());
    for hits in pairs(&cards, &batch, 0.2) {
        for channel in 0..3 {
            let mut out = vec![f32::NAN; RAYS];
            cards.radiance(&hits, channel, &mut out);
            for (ray, out) in out.iter().enumerate() {
                let (s, t) = (hits.cards.s[ray], hits.cards.t[ray]);
                let expected = match cards.planes.get(hits.surface[ray] as usize) {
                    Some(plane) => plane.texture().sample_channel(s, t, channel),
                    None => cards.environment[channel],
                };
                assert_eq!(*out, expected);
            }
        }
    }
}
