//! Scenes that call for ghosts and veiling glare, and scenes that do not.

use std::sync::Arc;

use glam::DVec3;
use quadpixel::effects::{Choice, Decision, Effect, Shot, Tolerance, plan};
use quadpixel::lens::{Coating, Lens, NamedCoating, Prescription, ReflectionSettings, Reflections};
use quadpixel::render::{Camera, RenderSettings};
use quadpixel::scene::Scene;
use quadpixel::scene::world::{
    Environment, Material, PathSettings, TriangleMesh, World, WorldDescription,
};

use super::scenes::{Make, card};
use super::shots::{PHONE, boxes};
use super::{RAYS, planned};

fn phone() -> Camera {
    let lens = Lens::new(&Prescription::builtin(PHONE).unwrap()).unwrap();
    let reflections = Reflections::new(&lens, &ReflectionSettings::default()).unwrap();
    let camera = Make::phone(boxes(2, 2, 1.6, 4.0)).camera();
    camera.with_reflections(reflections)
}

/// A window as datasets have it, of a chart whose ghosts, the mean of long looks, are four times the tolerance.
#[test]
fn a_short_look_leaves_out_no_ghosts_that_are_above_the_tolerance() {
    let lens = Lens::new(&Prescription::builtin(PHONE).unwrap()).unwrap();
    let bare = Coating::Named(NamedCoating::BareGlass);
    for coating in [bare, ReflectionSettings::default().coating] {
        let settings = ReflectionSettings {
            coating,
            ..ReflectionSettings::default()
        };
        let reflections = Reflections::new(&lens, &settings).unwrap();
        let make = Make {
            side: 256,
            ..Make::phone(boxes(2, 2, 1.6, 4.0))
        };
        let camera = make.camera().with_reflections(reflections);
        let scene = card(&camera, 1.0, 0.8);
        let shot = Shot { camera, scene };
        let decided = |seed: u64, signal_percent: f64| {
            let tolerance = Tolerance {
                signal_percent,
                ..Tolerance::default()
            };
            let settings = RenderSettings { seed, ..RAYS };
            let depths = [shot.camera.focus_distance_mm(); 2];
            let plan = plan(shot.clone(), depths, &settings, &Choice::Auto, &tolerance);
            let of_ghosts = |d: &&Decision| d.effect == Effect::LensReflections;
            *plan.decisions.iter().find(of_ghosts).unwrap()
        };
        // Nothing is below a tolerance of 0: so these looks are long.
        let long = (1..=4).map(|seed| decided(seed, 0.0).estimate.unwrap().signal_percent.unwrap());
        let mean = long.sum::<f64>() / 4.0;
        let left_out = |seed: &u64| decided(*seed, mean / 4.0).verdict.is_left_out();
        let seeds: Vec<u64> = (1..=12).filter(left_out).collect();
        println!("{coating:?}: {mean:.3} %");
        assert!(seeds.is_empty(), "{coating:?}: {mean:.3} %, {seeds:?}");
        // Far above them the short look decides.
        assert!(
            decided(1, 100.0 * mean).verdict.is_left_out(),
            "{coating:?}"
        );
    }
}

/// A grey wall, and before it a lamp of a radiance.
fn wall_and_lamp(radiance: f32) -> Scene {
    let mut world = WorldDescription {
        materials: vec![
            Material::emitter([0.5; 3]),
            Material::emitter([radiance; 3]),
        ],
        environment: Environment::Even([0.5; 3]),
        ..WorldDescription::default()
    };
    let square = |middle: DVec3, side: f64, material| {
        let corner = middle + DVec3::new(-0.5 * side, 0.5 * side, 0.0);
        TriangleMesh::rectangle(corner, DVec3::X * side, DVec3::NEG_Y * side, material)
    };
    world.add(square(DVec3::new(0.0, 0.0, -1000.0), 2000.0, 0), 1);
    world.add(square(DVec3::new(0.0, 150.0, -600.0), 12.0, 1), 2);
    Scene::from_world(
        Arc::new(World::new(world).unwrap()),
        PathSettings::default(),
    )
}

#[test]
fn ghosts_are_simulated_where_a_lamp_is_bright() {
    let mut wrong = Vec::new();
    for (name, scene, seen) in [
        ("a card", card(&phone(), 1.0, 0.8), false),
        ("a wall with a dim lamp", wall_and_lamp(1.0), false),
        ("a wall with a bright lamp", wall_and_lamp(1e6), true),
    ] {
        let camera = phone();
        let shot = Shot { camera, scene };
        let auto = planned(&shot, &Choice::Auto);
        let of_ghosts = |d: &&quadpixel::effects::Decision| d.effect == Effect::LensReflections;
        let decision = auto.decisions.iter().find(of_ghosts).unwrap();
        println!("{name}: {decision}");
        let estimate = decision.estimate.unwrap().signal_percent.unwrap();
        let tolerance = Tolerance::default().signal_percent;
        if decision.verdict.is_left_out() == seen
            || auto.shot.camera.reflections().is_some() != seen
        {
            wrong.push(format!("{name}: {decision}"));
        }
        assert!(
            estimate > 0.0 && (estimate > tolerance) == seen,
            "{name}: {decision}"
        );
        // The others are decided on as without ghosts.
        let direct = shot.without(Effect::LensReflections).unwrap();
        let same = planned(&direct, &Choice::Auto).decisions;
        for (a, b) in auto.decisions.iter().zip(&same) {
            assert!(
                a == b || a.effect == Effect::LensReflections,
                "{name}: {a} {b}"
            );
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
