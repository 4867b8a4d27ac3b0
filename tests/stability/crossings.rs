//! Which crossing of an asphere counts, against a scan along the ray.

use glam::DVec3;
use quadpixel::lens::{
    Aperture, OpticalSurface, PacketTracer, Travel, trace_backward, trace_forward,
};
use quadpixel::rays::{Ray, RayBatch};
use quadpixel::simd::SimdLevel;

use crate::lcg::Lcg;
use crate::scan::{FINE_PLACES, PLACES, first, height, sense};
use crate::support::{asphere, conic, system};
use crate::surfaces::library_surfaces;

/// A direction of the half space that light travels into.
fn direction(random: &mut Lcg, travel: Travel) -> DVec3 {
    let (z, turn) = (random.uniform(), random.between(0.0, std::f64::consts::TAU));
    let across = (1.0 - z * z).sqrt();
    DVec3::new(
        across * turn.cos(),
        across * turn.sin(),
        z * sense(travel) + 1e-9,
    )
    .normalize()
}

fn aspheres() -> impl Iterator<Item = (String, OpticalSurface)> {
    library_surfaces()
        .into_iter()
        .filter(|(_, s)| s.aspheric_terms > 0)
}

/// The point of the surface at radius `part` of the rim, turned by `turn`.
fn point(s: &OpticalSurface, part: f64, turn: f64) -> DVec3 {
    let r = part * s.aperture.semi_mm;
    let flat = DVec3::new(r * turn.cos(), r * turn.sin(), 0.0);
    flat.with_z(-height(s, flat))
}

/// Holds `intersect` to the scan; whether the ray crosses.
fn agrees(name: &str, s: &OpticalSurface, ray: Ray, travel: Travel) -> bool {
    let met = s.intersect(ray, travel);
    let inside = met.filter(|p| p.truncate().length() <= s.aperture.semi_mm);
    let same = |scanned: Option<DVec3>| match (inside, scanned) {
        (Some(p), Some(q)) => {
            // The places differ by what rounding leaves of the height, 1e-14 mm here, over the rise along the ray.
            let rise = s.normal(p.truncate()).unwrap().dot(ray.direction);
            (p - q).length() * rise.abs() < 1e-12
        }
        (a, b) => a.is_none() && b.is_none(),
    };
    let fine = || first(s, ray, travel, FINE_PLACES);
    assert!(
        same(first(s, ray, travel, PLACES)) || same(fine()),
        "{name}: {ray:?} {travel:?}: {met:?}, but by the scan {:?}",
        fine()
    );
    inside.is_some()
}

const BOTH: [Travel; 2] = [Travel::Forward, Travel::Backward];

/// Rays from any direction through any point of every asphere: none is lost, each is met where it crosses first.
#[test]
fn no_ray_that_meets_an_asphere_of_the_library_is_missed() {
    let mut random = Lcg(1);
    let mut rays = 0;
    for (name, s) in aspheres() {
        for travel in BOTH {
            for _ in 0..150 {
                let at = point(&s, random.uniform().sqrt(), random.between(0.0, 7.0));
                let direction = direction(&mut random, travel);
                if s.normal(at.truncate()).unwrap().dot(direction) * sense(travel) < 1e-6 {
                    continue;
                }
                let origin_mm = at - 3.0 * direction;
                let ray = Ray {
                    origin_mm,
                    direction,
                };
                assert!(agrees(&name, &s, ray, travel), "{name}: {ray:?} is missed");
                rays += 1;
            }
        }
    }
    assert!(rays > 15_000, "{rays}");
}

/// Rays between any two points in and about every asphere: met or not, the scan says the same.
#[test]
fn rays_said_to_miss_the_aperture_do() {
    let mut random = Lcg(2);
    let (mut met, mut missed) = (0, 0);
    for (name, s) in aspheres() {
        let semi = s.aperture.semi_mm;
        let deep = point(&s, 1.0, 0.0).z.abs() + 0.2 * semi;
        for travel in BOTH {
            for _ in 0..100 {
                let mut place = |reach: f64| {
                    DVec3::new(
                        random.between(-reach, reach),
                        random.between(-reach, reach),
                        random.between(-deep, deep),
                    )
                };
                let (a, b) = (place(semi), place(1.3 * semi));
                let direction = (b - a).normalize();
                let direction = direction * direction.z.signum() * sense(travel);
                let ray = Ray {
                    origin_mm: a,
                    direction,
                };
                if agrees(&name, &s, ray, travel) {
                    met += 1;
                } else {
                    missed += 1;
                }
            }
        }
    }
    assert!(met > 5000 && missed > 1000, "{met} {missed}");
}

/// What used to be lost, one by one: 48° and more off the axis, 75° off the normal, and beyond 0.99 of the rim, at
/// every asphere; the place to 1e-12 mm over the cosine of incidence.
#[test]
fn rays_far_off_the_axis_far_off_the_normal_and_at_the_rim_are_met() {
    let mut met = [0; 3];
    for (name, s) in aspheres() {
        for travel in BOTH {
            for turn in [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0] {
                let heading = |polar: f64| {
                    let flat = DVec3::new(polar.sin(), 0.0, 0.0);
                    flat.with_z(polar.cos() * sense(travel))
                };
                let mut hold = |case: usize, part: f64, direction: DVec3| {
                    let at = point(&s, part, turn);
                    let facing = s.normal(at.truncate()).unwrap().dot(direction);
                    if facing * sense(travel) > 0.01 {
                        let origin_mm = at - 2.0 * direction;
                        let ray = Ray {
                            origin_mm,
                            direction,
                        };
                        assert!(agrees(&name, &s, ray, travel), "{name}: {ray:?} is missed");
                        met[case] += 1;
                    }
                };
                for part in [0.3, 0.6, 0.9] {
                    for polar in [48_f64, 55.0, 65.0, 80.0] {
                        hold(0, part, heading(polar.to_radians()));
                    }
                    let normal = s.normal(point(&s, part, turn).truncate()).unwrap();
                    let (sine, cosine) = 75_f64.to_radians().sin_cos();
                    for along in [
                        normal.any_orthonormal_vector(),
                        normal.cross(DVec3::X).normalize(),
                    ] {
                        hold(1, part, along * sine + normal * (cosine * sense(travel)));
                    }
                }
                for part in [0.991, 0.999, 0.999_999] {
                    for polar in [1_f64, 20.0, 40.0, -20.0, -40.0] {
                        hold(2, part, heading(polar.to_radians()));
                    }
                }
            }
        }
    }
    assert!(met.iter().all(|n| *n > 2000), "{met:?}");
}

/// Made-up aspheres far stronger than any lens has: a ray is met within the aperture if and only if it crosses there,
/// and beyond 45° off the axis at its first crossing. Both tracers, packets of every kind to the last bit.
#[test]
fn wild_aspheres_lose_no_ray_and_both_tracers_agree() {
    let mut random = Lcg(3);
    let (mut crossed, mut missed) = (0, 0);
    for _ in 0..60 {
        let base = conic(
            0.0,
            random.between(-0.4, 0.4),
            random.between(-5.0, 1.0),
            (1.0, 1.0),
        );
        let terms: [f64; 5] = std::array::from_fn(|_| random.between(-0.6, 0.6));
        let mut s = asphere(base, &terms);
        s.aperture = Aperture { semi_mm: 1.1 };
        let one = system(vec![s.clone()], 0.0);
        let tracer = PacketTracer::new(&one);
        for travel in BOTH {
            let rays: Vec<Ray> = (0..100)
                .map(|_| {
                    let at = point(&s, 1.2 * random.uniform(), random.between(0.0, 7.0));
                    let direction = direction(&mut random, travel);
                    let origin_mm = at - direction + DVec3::Z * random.between(-0.3, 0.3);
                    Ray {
                        origin_mm,
                        direction,
                    }
                })
                .collect();
            let packet = |level| {
                let mut batch = RayBatch::default();
                for ray in &rays {
                    batch.push(ray.origin_mm, ray.direction);
                }
                match travel {
                    Travel::Forward => tracer.trace_forward(&mut batch, level),
                    Travel::Backward => tracer.trace_backward(&mut batch, level),
                }
                batch
            };
            let fast = packet(SimdLevel::detect());
            for level in SimdLevel::ALL {
                assert_eq!(packet(level), fast, "{level:?}");
            }
            for (i, ray) in rays.iter().enumerate() {
                let beyond_45 = ray.direction.z.powi(2) < 0.5;
                if beyond_45 {
                    agrees("made up", &s, *ray, travel);
                }
                let plain = match travel {
                    Travel::Forward => trace_forward(&one, *ray),
                    Travel::Backward => trace_backward(&one, *ray),
                };
                match (plain, fast.get(i)) {
                    // On the way to the sensor a grazing ray's place is stretched by 1/D_z.
                    (Ok(a), Ok(b)) => {
                        let reach = 1.0 + a.origin_mm.length();
                        assert!(
                            (a.origin_mm - b.origin_mm).length() < 1e-9 * reach,
                            "{ray:?}"
                        );
                    }
                    (a, b) => assert!(a.is_err() && b.is_err(), "{ray:?}: {a:?} {b:?}"),
                }
                let scanned = first(&s, *ray, travel, PLACES).is_some()
                    || (plain.is_ok() && first(&s, *ray, travel, FINE_PLACES).is_some());
                assert_eq!(plain.is_ok(), scanned, "{ray:?}");
                crossed += usize::from(scanned);
                missed += usize::from(!scanned);
            }
        }
    }
    assert!(crossed > 4000 && missed > 500, "{crossed} {missed}");
}
