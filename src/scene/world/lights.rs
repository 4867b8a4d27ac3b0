//! Drawing a light to connect a place to, and the densities of what was drawn.
//!
//! Kinds that are present (surfaces that shine, suns, points, a panorama) get equal chances; within a kind the chance is proportional to power. An
//! even environment is not drawn: scattering finds it as well.

use glam::{DVec3, Vec3};

use super::World;
use super::description::{Light, Material, WorldDescription};
use super::environment::Sky;
use super::geometry::Stage;
use super::surface::{Footprint, Surface};
use super::trace::Element;

/// The lights of a world.
#[derive(Clone, Debug)]
pub(super) struct Lights {
    /// Shining triangles and the running sums of their power.
    triangles: Vec<Element>,
    triangle_sums: Vec<f64>,
    /// Mean radiance of each material, which weighs its triangles.
    brightness: Vec<f64>,
    suns: Vec<Sun>,
    sun_sums: Vec<f64>,
    points: Vec<Point>,
    point_sums: Vec<f64>,
    kinds: Vec<LightKind>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum LightKind {
    Triangles,
    Suns,
    Points,
    Panorama,
}

#[derive(Clone, Debug)]
struct Sun {
    /// Towards the sun.
    direction: Vec3,
    irradiance: Vec3,
    /// 1 − cos of half the angle; 0 for parallel light.
    rise: f32,
}

#[derive(Clone, Debug)]
struct Point {
    position: DVec3,
    /// Radiance × mm².
    intensity: Vec3,
    /// Axis, and cosines of the inner and the outer cone; a bare point has none.
    cone: Option<(Vec3, f32, f32)>,
}

/// A way to a light.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightSample {
    pub direction: Vec3,
    /// To just before the light, mm.
    pub distance: f32,
    /// Radiance / density.
    pub weight: Vec3,
    /// Per solid angle, the light's choice included; `None` for a light that scattering cannot find.
    pub density: Option<f32>,
}

/// Rays end this share before a light's surface.
const SHORTENED: f32 = 1.0 - 2e-5;
const MM2_PER_M2: f32 = 1e6;

fn running(weights: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sum = 0.0;
    weights
        .map(|w| {
            sum += w;
            sum
        })
        .collect()
}

/// The entry that `u` in 0..1 falls on, its chance, and `u` stretched over it.
fn draw(sums: &[f64], u: f64) -> Option<(usize, f64, f64)> {
    let total = *sums.last()?;
    let target = u * total;
    let i = sums.partition_point(|s| *s <= target).min(sums.len() - 1);
    let start = if i == 0 { 0.0 } else { sums[i - 1] };
    let width = sums[i] - start;
    (width > 0.0).then(|| (i, width / total, ((target - start) / width).clamp(0.0, 1.0)))
}

impl Lights {
    pub fn new(world: &WorldDescription, stage: &Stage, sky: &Sky) -> Self {
        let brightness: Vec<f64> = world
            .materials
            .iter()
            .map(|m| mean_brightness(m, world))
            .collect();
        let mut triangles = Vec::new();
        let mut powers = Vec::new();
        for (slot, placed) in stage.placed.iter().enumerate() {
            let geometry = &stage.geometries[placed.geometry];
            for (packet, lanes) in geometry.packets.iter().enumerate() {
                for lane in 0..lanes.len() {
                    let part = geometry.parts[lanes.parts[lane] as usize];
                    let bright = brightness[part.material as usize];
                    if bright > 0.0 {
                        let [p, q, r] = lanes
                            .corners(lane)
                            .map(|p| placed.camera_from_mesh.transform_point3(p.as_dvec3()));
                        triangles.push(Element {
                            placed: slot as u32,
                            packet: packet as u32,
                            lane: lane as u8,
                        });
                        powers.push(bright * 0.5 * (q - p).cross(r - p).length());
                    }
                }
            }
        }
        let (mut suns, mut points) = (Vec::new(), Vec::new());
        for light in &world.lights {
            match *light {
                Light::Sun {
                    direction,
                    irradiance,
                    half_angle_deg,
                } => suns.push(Sun {
                    direction: -direction.normalize().as_vec3(),
                    irradiance: Vec3::from(irradiance),
                    // 1 − cos x = 2 sin²(x/2), exact for small angles.
                    rise: (2.0 * (0.5 * half_angle_deg.to_radians()).sin().powi(2)) as f32,
                }),
                Light::Point {
                    position_mm,
                    intensity_m2,
                } => points.push(Point {
                    position: position_mm,
                    intensity: Vec3::from(intensity_m2) * MM2_PER_M2,
                    cone: None,
                }),
                Light::Spot {
                    position_mm,
                    direction,
                    intensity_m2,
                    inner_deg,
                    outer_deg,
                } => points.push(Point {
                    position: position_mm,
                    intensity: Vec3::from(intensity_m2) * MM2_PER_M2,
                    cone: Some((
                        direction.normalize().as_vec3(),
                        inner_deg.to_radians().cos() as f32,
                        outer_deg.to_radians().cos() as f32,
                    )),
                }),
            }
        }
        let power = |c: Vec3| f64::from(c.element_sum());
        let sun_sums = running(suns.iter().map(|s: &Sun| power(s.irradiance)));
        let point_sums = running(points.iter().map(|p: &Point| power(p.intensity)));
        let triangle_sums = running(powers.into_iter());
        let mut kinds = Vec::new();
        let mut add = |kind, present: bool| {
            if present {
                kinds.push(kind);
            }
        };
        let shines = |sums: &[f64]| sums.last().is_some_and(|s| *s > 0.0);
        add(LightKind::Triangles, shines(&triangle_sums));
        add(LightKind::Suns, shines(&sun_sums));
        add(LightKind::Points, shines(&point_sums));
        add(LightKind::Panorama, matches!(sky, Sky::Map(_)));
        Self {
            triangles,
            triangle_sums,
            brightness,
            suns,
            sun_sums,
            points,
            point_sums,
            kinds,
        }
    }

    fn kind_chance(&self) -> f32 {
        1.0 / self.kinds.len() as f32
    }

    /// Radiance of the suns' discs in a direction, and the density of drawing it as a light.
    pub fn sun_disc(&self, direction: Vec3) -> (Vec3, f32) {
        let total = self.sun_sums.last().copied().unwrap_or(0.0) as f32;
        let mut radiance = Vec3::ZERO;
        let mut density = 0.0;
        for sun in self.suns.iter().filter(|s| s.is_disc()) {
            // |a − b|² = 2 (1 − cos), exact for small angles.
            if 0.5 * (direction - sun.direction).length_squared() <= sun.rise {
                radiance += sun.radiance();
                density +=
                    sun.irradiance.element_sum() / total / sun.solid_angle() * self.kind_chance();
            }
        }
        (radiance, density)
    }

    /// The density, per solid angle from a place `distance` mm away, of drawing this place on a shining triangle.
    pub fn triangle_density(&self, surface: &Surface, direction: Vec3, distance: f32) -> f32 {
        let Some(total) = self.triangle_sums.last().filter(|t| **t > 0.0) else {
            return 0.0;
        };
        let cos = surface.normal.dot(direction).abs().max(1e-6);
        let per_area = (self.brightness[surface.material] / total) as f32;
        self.kind_chance() * per_area * distance * distance / cos
    }
}

impl Sun {
    fn is_disc(&self) -> bool {
        self.rise > 0.0
    }
    fn solid_angle(&self) -> f32 {
        std::f32::consts::TAU * self.rise
    }
    /// E = L π sin²: for a disc of even radiance seen square on.
    fn radiance(&self) -> Vec3 {
        let sin2 = self.rise * (2.0 - self.rise);
        self.irradiance / (std::f32::consts::PI * sin2)
    }
}

/// Mean of R, G and B of a material's emission.
fn mean_brightness(material: &Material, world: &WorldDescription) -> f64 {
    let mean = material
        .emission_texture
        .map_or([1.0; 4], |t| world.textures[t.texture].mean());
    let channels = material.emission.iter().zip(mean);
    channels.map(|(e, t)| f64::from(e * t)).sum()
}

impl World {
    /// The density of drawing an environment direction as a light.
    pub(super) fn sky_density(&self, direction: Vec3) -> f32 {
        match &self.sky {
            Sky::Even(_) => 0.0,
            Sky::Map(panorama) => panorama.density(direction) * self.lights.kind_chance(),
        }
    }

    /// A light for the place `from`; `None` if there is none, or none of it arrives.
    pub(super) fn sample_light(
        &self,
        from: DVec3,
        choice: f32,
        pair: [f32; 2],
    ) -> Option<LightSample> {
        let lights = &self.lights;
        let scaled = f64::from(choice) * lights.kinds.len() as f64;
        let kind = lights
            .kinds
            .get((scaled as usize).min(lights.kinds.len().checked_sub(1)?))?;
        let rest = scaled.fract();
        let kind_chance = lights.kind_chance();
        match kind {
            LightKind::Triangles => {
                let (index, ..) = draw(&lights.triangle_sums, rest)?;
                let surface = self.surface_sample(lights.triangles[index], pair);
                let way = surface.position - from;
                let distance = way.length();
                let direction = (way / distance).as_vec3();
                let is_front = surface.normal.dot(direction) < 0.0;
                let radiance = self.emission(&surface, is_front, &Footprint::POINT);
                let density = lights.triangle_density(&surface, direction, distance as f32);
                (radiance != Vec3::ZERO && density > 0.0 && direction.is_finite()).then(|| {
                    LightSample {
                        direction,
                        distance: distance as f32 * SHORTENED,
                        weight: radiance / density,
                        density: Some(density),
                    }
                })
            }
            LightKind::Suns => {
                let (index, chance, _) = draw(&lights.sun_sums, rest)?;
                let sun = &lights.suns[index];
                let chance = chance as f32 * kind_chance;
                if !sun.is_disc() {
                    return Some(LightSample {
                        direction: sun.direction,
                        distance: f32::INFINITY,
                        weight: sun.irradiance / chance,
                        density: None,
                    });
                }
                // Evenly over the cone.
                let (sin_phi, cos_phi) = (std::f32::consts::TAU * pair[0]).sin_cos();
                let rise = pair[1] * sun.rise;
                let sin = (rise * (2.0 - rise)).max(0.0).sqrt();
                let (x, y) = sun.direction.any_orthonormal_pair();
                let direction =
                    x * (sin * cos_phi) + y * (sin * sin_phi) + sun.direction * (1.0 - rise);
                let (radiance, density) = lights.sun_disc(direction);
                (density > 0.0).then(|| LightSample {
                    direction,
                    distance: f32::INFINITY,
                    weight: radiance / density,
                    density: Some(density),
                })
            }
            LightKind::Points => {
                let (index, chance, _) = draw(&lights.point_sums, rest)?;
                let point = &lights.points[index];
                let way = point.position - from;
                let distance = way.length() as f32;
                let direction = (way / way.length()).as_vec3();
                let share = point.cone.map_or(1.0, |(axis, inner, outer)| {
                    // glTF's falloff: the square of a ramp in the cosine.
                    let ramp = (-direction.dot(axis) - outer) / (inner - outer).max(1e-6);
                    ramp.clamp(0.0, 1.0).powi(2)
                });
                (share > 0.0 && distance > 0.0).then(|| LightSample {
                    direction,
                    distance: distance * SHORTENED,
                    weight: point.intensity
                        * (share / (distance * distance * chance as f32 * kind_chance)),
                    density: None,
                })
            }
            LightKind::Panorama => {
                let Sky::Map(panorama) = &self.sky else {
                    return None;
                };
                let (direction, density) = panorama.sample(pair);
                let density = density * kind_chance;
                (density > 0.0).then(|| LightSample {
                    direction,
                    distance: f32::INFINITY,
                    weight: self.sky.radiance(direction) / density,
                    density: Some(density),
                })
            }
        }
    }
}
