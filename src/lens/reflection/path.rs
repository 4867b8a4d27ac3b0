//! The ways of light that is not reflected, and of light that is reflected twice.

use glam::DVec3;

use super::Reflections;
use crate::lens::surface::Travel;
use crate::lens::system::{OpticalSystem, SurfaceKind};
use crate::rays::Ray;

/// A ray may meet the next glass so far before the last, mm: rounding at rims that touch.
const BACK_STEP_MM: f64 = 1e-6;

/// Where a path is reflected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GhostPair {
    /// The surface of the second reflection, the one nearer to the scene.
    pub front: usize,
    /// That of the first one; the number of surfaces stands for the sensor.
    pub back: usize,
}

/// Light that has come to the sensor plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflected {
    /// On the sensor plane, in the light's direction.
    pub ray: Ray,
    /// Part of the radiance that is left, W.
    pub share: f64,
}

/// A ray on its way.
#[derive(Clone)]
struct Walk<'a> {
    system: &'a OpticalSystem,
    reflections: &'a Reflections,
    ray: Ray,
    share: f64,
    /// Camera-frame point on the last glass, mm.
    last_mm: Option<DVec3>,
}

impl Reflections {
    /// All pairs of surfaces that reflect.
    pub fn pairs(&self, system: &OpticalSystem) -> Vec<GhostPair> {
        let count = system.surfaces.len();
        let reflects = |i: usize| match system.surfaces.get(i) {
            Some(surface) => self.at_vertex(i, surface) > 0.0,
            None => self.sensor > 0.0,
        };
        let reflecting: Vec<usize> = (0..=count).filter(|i| reflects(*i)).collect();
        let behind = |&front: &usize| {
            let later = reflecting.iter().filter(move |back| **back > front);
            later.map(move |&back| GhostPair { front, back })
        };
        reflecting.iter().flat_map(behind).collect()
    }

    /// Part of the radiance that a ray along the axis keeps on its way through the lens.
    pub fn transmission_on_axis(&self, system: &OpticalSystem) -> f64 {
        let surfaces = system.surfaces.iter().enumerate();
        surfaces
            .map(|(i, surface)| 1.0 - self.at_vertex(i, surface))
            .product()
    }

    /// R_b R_f of light along the axis.
    pub fn pair_on_axis(&self, system: &OpticalSystem, pair: GhostPair) -> f64 {
        let at = |i: usize| match system.surfaces.get(i) {
            Some(surface) => self.at_vertex(i, surface),
            None => self.sensor,
        };
        at(pair.front) * at(pair.back)
    }

    /// Light that no surface reflects; `None` where it does not come to the sensor plane. Clipped by every aperture.
    pub fn trace_direct(&self, system: &OpticalSystem, ray: Ray) -> Option<Reflected> {
        let mut walk = Walk::new(self, system, ray);
        walk.forward(0..system.surfaces.len())?;
        walk.to_sensor()
    }

    /// Light of a ray from the scene that the surfaces of a pair reflect; `None` where it does not come to the sensor
    /// plane. Clipped by every aperture, each time that it comes by.
    pub fn trace_pair(
        &self,
        system: &OpticalSystem,
        pair: GhostPair,
        ray: Ray,
    ) -> Option<Reflected> {
        let mut walk = Walk::new(self, system, ray);
        walk.forward(0..pair.back)?;
        walk.turn_back(pair.back)?;
        for i in (pair.front + 1..pair.back).rev() {
            walk.meet(i, Travel::Backward, false)?;
        }
        walk.turn_forth(pair.front)
    }

    /// [`Self::trace_pair`] of those pairs whose number is `wanted`: what their ways have in common is traced once.
    pub fn trace_pairs(
        &self,
        system: &OpticalSystem,
        pairs: &GhostPairs,
        ray: Ray,
        wanted: impl Fn(usize) -> bool,
    ) -> Vec<Option<Reflected>> {
        let mut landed = vec![None; pairs.pairs.len()];
        let mut forth = Walk::new(self, system, ray);
        let mut passed = 0;
        for (back, fronts) in &pairs.by_back {
            let fronts = fronts.iter().filter(|(_, number)| wanted(*number));
            let mut fronts = fronts.peekable();
            if fronts.peek().is_none() {
                continue;
            }
            if forth.forward(passed..*back).is_none() {
                break;
            }
            passed = *back;
            let mut walk = forth.clone();
            let mut way = walk.turn_back(*back);
            let mut next = *back;
            for (front, number) in fronts {
                for i in (front + 1..next).rev() {
                    way = way.and_then(|()| walk.meet(i, Travel::Backward, false));
                }
                // What comes to a surface may go through it as well.
                landed[*number] = way.and_then(|()| walk.clone().turn_forth(*front));
                next = front + 1;
            }
        }
        landed
    }
}

/// All pairs of surfaces that reflect.
#[derive(Clone, Debug)]
pub struct GhostPairs {
    pairs: Vec<GhostPair>,
    /// By the surface of the first reflection, from the scene's side: the fronts, those next to it first, and the
    /// numbers of the pairs.
    by_back: Vec<(usize, Vec<(usize, usize)>)>,
}

impl GhostPairs {
    /// Of a lens.
    pub fn new(reflections: &Reflections, system: &OpticalSystem) -> Self {
        let pairs = reflections.pairs(system);
        let mut backs: Vec<usize> = pairs.iter().map(|pair| pair.back).collect();
        backs.sort_unstable();
        backs.dedup();
        let fronts = |back: &usize| {
            let of_back = (pairs.iter().enumerate()).filter(|(_, pair)| pair.back == *back);
            let mut fronts: Vec<_> = of_back.map(|(number, pair)| (pair.front, number)).collect();
            fronts.sort_unstable_by(|a, b| b.cmp(a));
            (*back, fronts)
        };
        Self {
            by_back: backs.iter().map(fronts).collect(),
            pairs,
        }
    }
}

impl std::ops::Deref for GhostPairs {
    type Target = [GhostPair];

    /// In the order of their numbers.
    fn deref(&self) -> &[GhostPair] {
        &self.pairs
    }
}

impl<'a> Walk<'a> {
    fn new(reflections: &'a Reflections, system: &'a OpticalSystem, ray: Ray) -> Self {
        Self {
            system,
            reflections,
            ray,
            share: 1.0,
            last_mm: None,
        }
    }

    fn forward(&mut self, mut surfaces: std::ops::Range<usize>) -> Option<()> {
        surfaces.try_for_each(|i| self.meet(i, Travel::Forward, false))
    }

    /// Is reflected a first time: at a surface, or at the sensor.
    fn turn_back(&mut self, back: usize) -> Option<()> {
        if back < self.system.surfaces.len() {
            return self.meet(back, Travel::Forward, true);
        }
        let there = self.to_sensor()?;
        self.share = self.reflections.sensor * there.share;
        self.last_mm = Some(there.ray.origin_mm);
        let d = there.ray.direction;
        self.ray = Ray {
            direction: DVec3::new(d.x, d.y, -d.z),
            ..there.ray
        };
        Some(())
    }

    /// Is reflected a second time, and goes on to the sensor.
    fn turn_forth(mut self, front: usize) -> Option<Reflected> {
        self.meet(front, Travel::Backward, true)?;
        self.forward(front + 1..self.system.surfaces.len())?;
        self.to_sensor()
    }

    /// Goes through surface `i`, or is reflected there.
    fn meet(&mut self, i: usize, travel: Travel, reflected: bool) -> Option<()> {
        let surface = &self.system.surfaces[i];
        let local = surface.pose.local_ray(self.ray);
        let point = surface.intersect(local, travel)?;
        let semi = surface.aperture.semi_mm;
        if point.x * point.x + point.y * point.y > semi * semi {
            return None;
        }
        let mut direction = local.direction;
        if surface.kind == SurfaceKind::Refract {
            let at_mm = surface.pose.camera_point_mm(point);
            let back = |last: DVec3| (at_mm - last).dot(self.ray.direction) < -BACK_STEP_MM;
            if self.last_mm.is_some_and(back) {
                return None;
            }
            self.last_mm = Some(at_mm);
            let indices = match travel {
                Travel::Forward => (surface.index_before, surface.index_after),
                Travel::Backward => (surface.index_after, surface.index_before),
            };
            let normal = surface.normal(point.truncate())?;
            let cos = direction.dot(normal);
            let part = self.reflections.at(i, surface, cos.abs(), indices);
            if reflected {
                direction -= 2.0 * cos * normal;
                self.share *= part;
            } else {
                let eta = indices.0 / indices.1;
                let behind = 1.0 - eta * eta * (1.0 - cos * cos);
                if behind <= 0.0 {
                    return None;
                }
                direction = eta * direction + (travel.sign() * behind.sqrt() - eta * cos) * normal;
                self.share *= 1.0 - part;
            }
        }
        self.ray = surface.pose.camera_ray(Ray {
            origin_mm: point,
            direction,
        });
        (self.share > 0.0).then_some(())
    }

    /// On the sensor plane.
    fn to_sensor(&self) -> Option<Reflected> {
        let Ray {
            origin_mm,
            direction,
        } = self.ray;
        let t = (self.system.sensor_z_mm - origin_mm.z) / direction.z;
        let arrives = direction.z > 0.0 && t.is_finite() && t >= -BACK_STEP_MM;
        arrives.then(|| Reflected {
            ray: Ray {
                origin_mm: origin_mm + t * direction,
                direction,
            },
            share: self.share,
        })
    }
}
