//! The scene: what a ray from the lens meets, and the radiance that comes back along it.
//!
//! Camera frame, mm (see [`crate::frames`]): the scene is at z < 0. It is of one of three kinds: flat emitting cards in
//! front of a uniform environment, each card's radiance its texture, the same in all directions (a Lambertian chart
//! under even light); a [`world`] of meshes, materials and lights; or the shining [`Patches`] of a picture with depth.

mod cards;
mod hits;
mod mip;
mod plane;

pub mod coverage;
pub mod import;
pub mod texture;
pub mod world;

pub(crate) use cards::Ways;
pub use hits::{CardHits, Hits, NO_SURFACE, WorldHits};
pub use plane::TexturedPlane;

use std::ops::Range;
use std::sync::Arc;

use self::cards::Cards;
use self::world::{Patches, PathKey, PathSettings, World};
use crate::rays::RaySlices;

/// What the camera looks at.
#[derive(Clone, Debug)]
pub struct Scene {
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Cards(Cards),
    World(Arc<World>, PathSettings),
    Patches(Arc<Patches>, Shine),
}

/// What patches shine with.
#[derive(Clone, Debug)]
struct Shine {
    /// In the middle of each patch.
    samples: Vec<[f32; 3]>,
    elsewhere: [f32; 3],
}

impl Default for Scene {
    fn default() -> Self {
        Self::new(Vec::new(), [0.0; 3])
    }
}

impl Scene {
    /// Cards (at most 65,534) and the radiance of all that lies behind and beside them.
    pub fn new(planes: Vec<TexturedPlane>, environment: [f32; 3]) -> Self {
        Self {
            kind: Kind::Cards(Cards::new(planes, environment)),
        }
    }

    /// A world of meshes, and how its paths are followed.
    pub fn from_world(world: Arc<World>, settings: PathSettings) -> Self {
        Self {
            kind: Kind::World(world, settings),
        }
    }

    /// Patches, the radiance in the middle of each (0 where it is left out), and that of all that lies behind and
    /// beside them.
    pub fn from_patches(
        patches: Arc<Patches>,
        mut samples: Vec<[f32; 3]>,
        elsewhere: [f32; 3],
    ) -> Self {
        samples.resize(patches.count(), [0.0; 3]);
        Self {
            kind: Kind::Patches(patches, Shine { samples, elsewhere }),
        }
    }

    /// The cards; none if it is of another kind.
    pub fn planes(&self) -> &[TexturedPlane] {
        match &self.kind {
            Kind::Cards(cards) => cards.planes(),
            Kind::World(..) | Kind::Patches(..) => &[],
        }
    }

    /// The same environment behind other cards.
    pub(crate) fn with_planes(&self, planes: Vec<TexturedPlane>) -> Self {
        let environment = match &self.kind {
            Kind::Cards(cards) => cards.environment(),
            Kind::World(..) | Kind::Patches(..) => [0.0; 3],
        };
        Self::new(planes, environment)
    }

    /// The world and its settings, if it is one.
    pub fn world(&self) -> Option<(&Arc<World>, &PathSettings)> {
        match &self.kind {
            Kind::Cards(_) | Kind::Patches(..) => None,
            Kind::World(world, settings) => Some((world, settings)),
        }
    }

    /// First hits of all rays. Touching cards: the first in the list wins.
    pub fn intersect(&self, rays: RaySlices<'_>, hits: &mut Hits) {
        let n = rays.origin_mm[0].len();
        match &self.kind {
            Kind::Cards(cards) => {
                hits.reset_for_cards(n);
                cards.intersect(rays, hits);
            }
            Kind::Patches(patches, _) => {
                hits.reset_for_patches(n);
                let Hits {
                    distance_mm,
                    surface,
                    patches: met,
                    ..
                } = hits;
                patches.intersect(rays, (distance_mm, surface), met);
            }
            Kind::World(world, _) => {
                hits.reset_for_world(n);
                let Hits {
                    distance_mm,
                    surface,
                    world: met,
                    ..
                } = hits;
                world.first_elements(rays.alive(), &mut met.workspace, |i, element, ray| {
                    let hit = world.hit_of(element, ray);
                    met.elements[i] = Some(element);
                    distance_mm[i] = hit.distance_mm;
                    surface[i] = hit.object_id;
                    met.normal[i] = hit.normal;
                });
            }
        }
    }

    /// What [`Self::radiance`] asks for: [`Self::intersect`] without distances and normals in a world, where they take
    /// a time of their own.
    pub(crate) fn find_surfaces(&self, rays: RaySlices<'_>, hits: &mut Hits) {
        let Kind::World(world, _) = &self.kind else {
            return self.intersect(rays, hits);
        };
        hits.reset_for_world(rays.origin_mm[0].len());
        let (surface, met) = (&mut hits.surface, &mut hits.world);
        world.first_elements(rays.alive(), &mut met.workspace, |i, element, _| {
            met.elements[i] = Some(element);
            surface[i] = world.object_of(element);
        });
    }

    /// First hits with cards of pairs of rays that lie beside these. `reach`: the most by which s or t differs on a
    /// card for any of them; `ways` fills in how some of the rays (second) lie beside the crossings with a card
    /// (first). Of other scenes none.
    pub(crate) fn intersect_pairs(
        &self,
        rays: RaySlices<'_>,
        reach: impl Fn(usize) -> f64,
        ways: impl Fn(usize, Range<usize>, &mut [Ways; 2]),
        pairs: [&mut Hits; 2],
    ) {
        let n = rays.origin_mm[0].len();
        let pairs = pairs.map(|hits| {
            hits.reset_for_cards(n);
            hits
        });
        if let Kind::Cards(cards) = &self.kind {
            cards.intersect_pairs(rays, reach, ways, pairs);
        }
    }

    /// Radiance of colour channels along rays whose first hits are known, into those of `out` (each of the rays'
    /// number). A world follows one path per ray for all the channels together, with the random numbers that `key` has
    /// for the ray.
    pub fn radiance(
        &self,
        rays: RaySlices<'_>,
        hits: &mut Hits,
        channels: Range<usize>,
        key: impl Fn(usize) -> PathKey,
        out: &mut [Vec<f32>; 3],
    ) {
        match &self.kind {
            Kind::Cards(cards) => {
                for channel in channels {
                    cards.radiance(hits, channel, &mut out[channel]);
                }
            }
            Kind::Patches(patches, shine) => {
                for channel in channels {
                    let samples = (shine.samples.as_slice(), channel);
                    let elsewhere = shine.elsewhere[channel];
                    patches.radiance(&hits.patches, samples, elsewhere, &mut out[channel]);
                }
            }
            Kind::World(world, settings) => {
                let WorldHits {
                    elements,
                    workspace,
                    ..
                } = &mut hits.world;
                let met = rays.alive().map(|ray| (ray, elements[ray.0]));
                let served = channels.clone();
                let paths = (settings, key);
                world.radiances_of_hits(met, paths, workspace, |i, l| {
                    served.clone().for_each(|c| out[c][i] = l[c]);
                });
            }
        }
    }
}
