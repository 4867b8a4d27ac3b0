//! A scene of either kind: flat cards, which need no light to be followed, or a world of meshes.

use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;

use super::cards::Cards;
use super::plane::TexturedPlane;
use super::world::{Element, PathKey, PathSettings, Room, World};
use crate::lens::RayBatch;

/// Surface number of a ray that meets nothing but the environment.
pub const NO_SURFACE: u16 = u16::MAX;

/// What the camera looks at.
#[derive(Clone, Debug)]
pub struct Scene {
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Cards(Cards),
    World(Arc<World>, PathSettings),
}

impl Default for Scene {
    fn default() -> Self {
        Self::new(Vec::new(), [0.0; 3])
    }
}

/// First hits of a batch of rays, one entry a ray.
#[derive(Clone, Debug, Default)]
pub struct Hits {
    /// Distance along the ray from its origin, mm; +∞ where nothing is met.
    pub distance_mm: Vec<f64>,
    /// Texture coordinate to the right, in [0, 1]; of cards only.
    pub s: Vec<f32>,
    /// Texture coordinate down, in [0, 1]; of cards only.
    pub t: Vec<f32>,
    /// Index of the card, or object of the world's instance; [`NO_SURFACE`] for none.
    pub surface: Vec<u16>,
    /// Unit normal (smooth, without normal maps) on the side of the ray; of worlds only, 0 where nothing is met.
    pub normal: Vec<DVec3>,
    /// Triangles met; of worlds only.
    elements: Vec<Option<Element>>,
    room: Room,
}

impl Hits {
    /// Room for `n` hits, none of which has happened.
    pub(super) fn reset(&mut self, n: usize) {
        fn fill<T: Clone>(list: &mut Vec<T>, n: usize, value: T) {
            list.clear();
            list.resize(n, value);
        }
        fill(&mut self.distance_mm, n, f64::INFINITY);
        fill(&mut self.s, n, 0.0);
        fill(&mut self.t, n, 0.0);
        fill(&mut self.surface, n, NO_SURFACE);
        self.normal.clear();
        self.elements.clear();
    }
}

/// Origins and unit directions of a batch of rays in the camera frame, as slices of equal length.
#[derive(Clone, Copy, Debug)]
pub struct RaySlices<'a> {
    /// Origin, mm.
    pub origin_mm: [&'a [f64]; 3],
    /// Unit direction, away from the camera.
    pub direction: [&'a [f64]; 3],
    /// 0 for a ray that is alive. What a lost one meets has no meaning.
    pub status: &'a [u8],
}

impl<'a> RaySlices<'a> {
    /// The rays of a batch as they stand.
    pub fn of_batch(batch: &'a RayBatch) -> Self {
        Self {
            origin_mm: [&batch.ox, &batch.oy, &batch.oz],
            direction: [&batch.dx, &batch.dy, &batch.dz],
            status: &batch.status,
        }
    }

    /// Number, origin and direction of each ray that is alive.
    fn alive(self) -> impl Iterator<Item = (usize, DVec3, DVec3)> + 'a {
        let [ox, oy, oz] = self.origin_mm;
        let [dx, dy, dz] = self.direction;
        let is_alive = move |i: &usize| self.status[*i] == 0;
        (0..ox.len()).filter(is_alive).map(move |i| {
            let origin = DVec3::new(ox[i], oy[i], oz[i]);
            (i, origin, DVec3::new(dx[i], dy[i], dz[i]))
        })
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
    pub fn of_world(world: Arc<World>, settings: PathSettings) -> Self {
        Self {
            kind: Kind::World(world, settings),
        }
    }

    /// The cards; none if it is a world.
    pub fn planes(&self) -> &[TexturedPlane] {
        match &self.kind {
            Kind::Cards(cards) => cards.planes(),
            Kind::World(..) => &[],
        }
    }

    /// The world and its settings, if it is one.
    pub fn world(&self) -> Option<(&Arc<World>, &PathSettings)> {
        match &self.kind {
            Kind::Cards(_) => None,
            Kind::World(world, settings) => Some((world, settings)),
        }
    }

    /// First hits of all rays. Touching cards: the first in the list wins.
    pub fn intersect(&self, rays: RaySlices<'_>, hits: &mut Hits) {
        hits.reset(rays.origin_mm[0].len());
        match &self.kind {
            Kind::Cards(cards) => cards.intersect(rays, hits),
            Kind::World(world, _) => {
                hits.elements.resize(hits.surface.len(), None);
                hits.normal.resize(hits.surface.len(), DVec3::ZERO);
                let Hits {
                    distance_mm,
                    surface,
                    normal,
                    elements,
                    room,
                    ..
                } = hits;
                world.meet(rays.alive(), room, |i, element, hit| {
                    elements[i] = Some(element);
                    distance_mm[i] = hit.distance_mm;
                    surface[i] = hit.object_id;
                    normal[i] = hit.normal;
                });
            }
        }
    }

    /// Radiance of colour channels along rays whose first hits are known, into those of `out` (each of the rays' number). A world
    /// follows one path a ray for all the channels together.
    pub fn radiance(
        &self,
        rays: RaySlices<'_>,
        hits: &mut Hits,
        channels: Range<usize>,
        key: &PathKey,
        out: &mut [Vec<f32>; 3],
    ) {
        match &self.kind {
            Kind::Cards(cards) => {
                for channel in channels {
                    cards.radiance(hits, channel, &mut out[channel]);
                }
            }
            Kind::World(world, settings) => {
                let Hits { elements, room, .. } = hits;
                let met = rays.alive().map(|ray| (ray, elements[ray.0]));
                let served = channels.clone();
                world.shade(met, channels, (settings, key), room, |i, l| {
                    served.clone().for_each(|c| out[c][i] = l[c]);
                });
            }
        }
    }
}
