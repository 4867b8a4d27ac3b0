//! What the rays of a batch meet first: what every scene tells, and what cards or a world remember for their shading.

use glam::DVec3;

use super::world::{Element, PatchHits, PathWorkspace};

/// Surface number of a ray that meets nothing but the environment.
pub const NO_SURFACE: u16 = u16::MAX;

/// First hits of a batch of rays, one entry per ray.
#[derive(Clone, Debug, Default)]
pub struct Hits {
    /// Distance along the ray from its origin, mm; +∞ where nothing is met.
    pub distance_mm: Vec<f64>,
    /// Index of the card, or object of the world's instance; [`NO_SURFACE`] for none.
    pub surface: Vec<u16>,
    /// What cards tell beside; empty in a world.
    pub cards: CardHits,
    /// What a world tells beside; empty among cards.
    pub world: WorldHits,
    /// What patches tell beside.
    pub patches: PatchHits,
}

/// Where cards are met, one entry per ray.
#[derive(Clone, Debug, Default)]
pub struct CardHits {
    /// Texture coordinate to the right, in [0, 1].
    pub s: Vec<f32>,
    /// Texture coordinate down, in [0, 1].
    pub t: Vec<f32>,
}

/// How the surfaces of a world are met, one entry per ray.
#[derive(Clone, Debug, Default)]
pub struct WorldHits {
    /// Unit normal (smooth, without normal maps) on the side of the ray; 0 where nothing is met.
    pub normal: Vec<DVec3>,
    /// The triangles.
    pub(super) elements: Vec<Option<Element>>,
    pub(super) workspace: PathWorkspace,
}

fn fill<T: Clone>(list: &mut Vec<T>, n: usize, value: T) {
    list.clear();
    list.resize(n, value);
}

impl Hits {
    /// Space for the hits of `n` rays among cards, none of which has happened.
    pub(super) fn reset_for_cards(&mut self, n: usize) {
        self.reset(n);
        fill(&mut self.cards.s, n, 0.0);
        fill(&mut self.cards.t, n, 0.0);
        self.world.normal.clear();
        self.world.elements.clear();
    }

    /// Space for the hits of `n` rays among patches, none of which has happened.
    pub(super) fn reset_for_patches(&mut self, n: usize) {
        self.reset_for_cards(n);
    }

    /// Space for the hits of `n` rays in a world, none of which has happened.
    pub(super) fn reset_for_world(&mut self, n: usize) {
        self.reset(n);
        fill(&mut self.world.normal, n, DVec3::ZERO);
        fill(&mut self.world.elements, n, None);
        self.cards.s.clear();
        self.cards.t.clear();
    }

    fn reset(&mut self, n: usize) {
        fill(&mut self.distance_mm, n, f64::INFINITY);
        fill(&mut self.surface, n, NO_SURFACE);
    }
}
