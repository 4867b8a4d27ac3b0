//! The lights of a world, by kind, and the chances with which they are drawn.
//!
//! Kinds that are present (surfaces that shine, suns, points, a panorama) get equal chances. Shining triangles and
//! points are drawn by what they may give the place ([`LightTree`]), suns by their power. An even environment is not
//! drawn: scattering finds it as well.

use glam::{DVec3, Vec3A as Vec3};

use super::description::{Alpha, Light, Material, WorldDescription};
use super::environment::Sky;
use super::facet::Facet;
use super::geometry::{Element, Stage};
use super::light_bounds::LightBounds;
use super::light_node::Receiver;
use super::light_tree::LightTree;

/// The lights of a world.
#[derive(Clone, Debug)]
pub(super) struct Lights {
    /// Shining triangles, in the order of their elements.
    pub(super) triangles: Vec<Shining>,
    pub(super) triangle_tree: LightTree,
    pub(super) suns: Vec<Sun>,
    pub(super) sun_sums: Vec<f64>,
    pub(super) points: Vec<Point>,
    pub(super) point_tree: LightTree,
    pub(super) kinds: Vec<LightKind>,
    /// The chance of each kind that is present.
    pub(super) kind_chance: f32,
}

/// A triangle that shines.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shining {
    pub element: Element,
    pub facet: Facet,
    /// Unit normal of the front.
    pub normal: Vec3,
    /// Of the front, and of the back; `None` where it is not the same all over.
    pub radiance: Option<[Vec3; 2]>,
    /// mm².
    pub area: f32,
    /// Mean radiance × area.
    pub power: f64,
}

/// What a light is drawn from first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum LightKind {
    Triangles,
    Suns,
    Points,
    Panorama,
}

/// Parallel light, or a disc at infinity.
#[derive(Clone, Debug)]
pub(super) struct Sun {
    /// Towards the sun.
    pub direction: Vec3,
    pub irradiance: Vec3,
    /// 1 − cos of half the angle; 0 for parallel light.
    pub rise: f32,
}

/// A point, or a spot.
#[derive(Clone, Debug)]
pub(super) struct Point {
    pub position: DVec3,
    /// Radiance × mm².
    pub intensity: Vec3,
    /// Axis, and cosines of the inner and the outer cone; a bare point has none.
    pub cone: Option<(Vec3, f32, f32)>,
}

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

impl Lights {
    pub fn new(world: &WorldDescription, stage: &Stage, sky: &Sky) -> Self {
        let (triangles, bounds) = shining_triangles(stage, world);
        let triangle_tree = LightTree::new(&bounds);
        let (suns, points) = suns_and_points(&world.lights);
        let power = |c: Vec3| f64::from(c.element_sum());
        let sun_sums = running(suns.iter().map(|s| power(s.irradiance)));
        let shining = points.iter().filter(|p| power(p.intensity) > 0.0);
        let points: Vec<Point> = shining.cloned().collect();
        let bounds = |p: &Point| LightBounds::point(p.position.as_vec3(), power(p.intensity));
        let point_tree = LightTree::new(&points.iter().map(bounds).collect::<Vec<_>>());
        let mut kinds = Vec::new();
        let mut add = |kind, present: bool| {
            if present {
                kinds.push(kind);
            }
        };
        let shines = |sums: &[f64]| sums.last().is_some_and(|s| *s > 0.0);
        add(LightKind::Triangles, !triangle_tree.is_empty());
        add(LightKind::Suns, shines(&sun_sums));
        add(LightKind::Points, !point_tree.is_empty());
        add(LightKind::Panorama, matches!(sky, Sky::Map(_)));
        Self {
            triangles,
            triangle_tree,
            suns,
            sun_sums,
            points,
            point_tree,
            kind_chance: 1.0 / kinds.len() as f32,
            kinds,
        }
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
                    sun.irradiance.element_sum() / total / sun.solid_angle() * self.kind_chance;
            }
        }
        (radiance, density)
    }

    /// The density, per solid angle from the receiver `distance` mm away, of drawing a place on a shining triangle,
    /// whose normal makes an angle of this cosine with the way there; 0 of one that does not shine.
    #[inline(always)]
    pub fn triangle_density(
        &self,
        element: Element,
        receiver: &Receiver,
        cos: f32,
        distance: f32,
    ) -> f32 {
        match (self.triangles).binary_search_by_key(&element, |t| t.element) {
            Ok(index) => {
                let chance = self.triangle_tree.chance(index, receiver);
                self.density_of(index, chance, cos, distance)
            }
            Err(_) => 0.0,
        }
    }

    /// The same of a triangle by its index, whose chance in the tree is known.
    #[inline(always)]
    pub fn density_of(&self, index: usize, chance: f32, cos: f32, distance: f32) -> f32 {
        let cos = cos.abs().max(1e-6);
        self.kind_chance * chance / self.triangles[index].area * distance * distance / cos
    }
}

impl Sun {
    pub fn is_disc(&self) -> bool {
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

/// The triangles that shine, and what is known of each.
fn shining_triangles(stage: &Stage, world: &WorldDescription) -> (Vec<Shining>, Vec<LightBounds>) {
    let brightness: Vec<f64> = (world.materials.iter())
        .map(|m| mean_brightness(m, world))
        .collect();
    let mut triangles = Vec::new();
    let mut bounds = Vec::new();
    for (slot, placed) in stage.placed.iter().enumerate() {
        let geometry = &stage.geometries[placed.geometry];
        for (packet, lanes) in geometry.packets.iter().enumerate() {
            for lane in 0..lanes.len() {
                let material = geometry.parts[lanes.parts[lane] as usize].material as usize;
                let [p, mut q, mut r] = lanes
                    .corners(lane)
                    .map(|p| placed.camera_from_mesh.transform_point3(p.as_dvec3()));
                if placed.mirrored {
                    (q, r) = (r, q);
                }
                let area = 0.5 * (q - p).cross(r - p).length();
                let power = brightness[material] * area;
                if power > 0.0 {
                    let element = Element {
                        placed: slot as u32,
                        packet: packet as u32,
                        lane: lane as u8,
                    };
                    let facet = stage.facet(element);
                    triangles.push(Shining {
                        element,
                        facet,
                        normal: facet.normal(placed.mirrored),
                        radiance: even_radiance(&world.materials[material]),
                        area: area as f32,
                        power,
                    });
                    let corners = [p, q, r].map(|p| p.as_vec3());
                    let two_sided = world.materials[material].two_sided;
                    bounds.push(LightBounds::triangle(corners, two_sided, power));
                }
            }
        }
    }
    (triangles, bounds)
}

/// Radiance of the front and of the back, where no picture changes it.
fn even_radiance(material: &Material) -> Option<[Vec3; 2]> {
    let is_even = material.emission_texture.is_none() && material.alpha == Alpha::Opaque;
    let front = Vec3::from(material.emission);
    let back = if material.two_sided {
        front
    } else {
        Vec3::ZERO
    };
    is_even.then_some([front, back])
}

/// Lights in the camera frame.
fn suns_and_points(lights: &[Light]) -> (Vec<Sun>, Vec<Point>) {
    let (mut suns, mut points) = (Vec::new(), Vec::new());
    for light in lights {
        match *light {
            Light::Sun {
                direction,
                irradiance,
                half_angle_deg,
            } => suns.push(Sun {
                direction: -direction.normalize().as_vec3a(),
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
                    direction.normalize().as_vec3a(),
                    inner_deg.to_radians().cos() as f32,
                    outer_deg.to_radians().cos() as f32,
                )),
            }),
        }
    }
    (suns, points)
}

/// Mean of R, G and B of a material's emission.
fn mean_brightness(material: &Material, world: &WorldDescription) -> f64 {
    let mean = material
        .emission_texture
        .map_or([1.0; 4], |t| world.textures[t.texture].mean());
    let channels = material.emission.iter().zip(mean);
    channels.map(|(e, t)| f64::from(e * t)).sum()
}
