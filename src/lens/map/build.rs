//! How a map is made: its degrees and nodes are the least whose error, measured with rays that took no part in the fit,
//! meets the bound.

use glam::DVec2;

use super::held_out::{RAYS_PER_CELL, RayErrors};
use super::lens_map::LensMap;
use super::maker::{Choice, Maker};
use super::node::{Design, Designs, Fitter};
use super::task::{MapFailure, MapTask};

/// Degrees that are tried, of a ray's place and slopes and of their change within a pixel.
const DEGREES: [usize; 11] = [4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24];
const CHANGE_DEGREES: [usize; 4] = [1, 2, 4, 6];
/// How far from a place its map holds, pitches, that are tried: the farther, the more rays that diffraction displaces
/// it takes, and the more pixels share a place; the last is little beyond the pixel's own edge.
const REACHES: [f64; 5] = [8.0, 4.0, 2.0, 1.0, 0.55];
/// Numbers of nodes along the longer side that are tried.
const NODES: [usize; 7] = [4, 6, 9, 13, 19, 28, 41];
/// Least spacing of nodes, pitches: where they are closer, tracing all rays takes no longer.
const LEAST_SPACING: f64 = 48.0;
/// Places a side at which degrees are tried.
const PLACES: usize = 3;
/// Parts of the bound that may be taken by the polynomials of all places, and by those together with the change within
/// a pixel: the rest is for the way between the nodes.
const SHARES: [f64; 2] = [0.8, 0.9];
/// Part of the window that may stay unmapped before more nodes are tried, and at all.
const UNMAPPED: [f64; 2] = [0.05, 0.5];

impl LensMap {
    /// Makes the smallest map that meets the bound. `like` is that of another wavelength of the same lens and window:
    /// its numbers are tried first.
    ///
    /// # Errors
    /// Why there is none.
    pub fn new(task: &MapTask<'_>, like: Option<&LensMap>) -> Result<Self, MapFailure> {
        if let Some(like) = like {
            let maker = Maker::new(*task, Some(like))?;
            let mut fitter = maker.fitter(Some(like));
            let choice = Choice {
                slope: Design::of(like.degree),
                place: Design::of(like.place_degree),
                change: Design::of(like.change_degree),
                reach_mm: like.reach_mm,
            };
            fitter.step_mm = choice.reach_mm;
            let map = maker.checked(&fitter, like.nodes, &choice);
            if let Some(map) = map.filter(|map| map.is_as_good_as(like)) {
                return Ok(map);
            }
        }
        let maker = Maker::new(*task, None)?;
        let mut fitter = maker.fitter(None);
        let choice = maker.choice(&mut fitter)?;
        let node_rays = fitter.work_rays(choice.designs());
        let mut work_rays = 0.0;
        let mut best: Option<Self> = None;
        for size in maker.sizes() {
            work_rays += (size.0 * size.1) as f64 * (node_rays + RAYS_PER_CELL);
            if !task.pays(work_rays) {
                break;
            }
            let Some(map) = maker.checked(&fitter, size, &choice) else {
                continue;
            };
            let share = map.report.unmapped_share;
            let before = best
                .as_ref()
                .map_or(f64::INFINITY, |b| b.report.unmapped_share);
            if share < before {
                best = Some(map);
            }
            // More nodes help where these do.
            if share <= UNMAPPED[0] || (before < 1.0 && share > 0.7 * before) {
                break;
            }
        }
        let found = best.filter(|map| map.report.unmapped_share <= UNMAPPED[1]);
        found.ok_or(MapFailure::Nodes)
    }

    /// The weighted sum of maps of the same lens and window at other wavelengths, measured at this one; `None` where
    /// they were not made alike, or where it maps less of the window than they do.
    pub fn between(task: &MapTask<'_>, maps: &[(&LensMap, f64)]) -> Option<Self> {
        let (first, _) = *maps.first()?;
        let maker = Maker::new(*task, Some(first)).ok()?;
        let map = maker.measured(maker.blended(maps)?)?;
        map.is_as_good_as(first).then_some(map)
    }

    fn is_as_good_as(&self, like: &Self) -> bool {
        self.report.unmapped_share <= like.report.unmapped_share + UNMAPPED[0]
    }
}

impl Maker<'_> {
    /// The least degrees that do at places all over the window, each with a node of its own; or at most of them.
    fn choice(&self, fitter: &mut Fitter<'_>) -> Result<Choice, MapFailure> {
        let places = self.task.places_mm(PLACES);
        let limiting = std::mem::take(&mut fitter.limiting);
        let lowest = Design::of(CHANGE_DEGREES[0]);
        let mut best: Option<(usize, Choice)> = None;
        let mut work_rays = 0.0;
        for degree in DEGREES {
            let main = Design::of(degree);
            let designs = Designs {
                slope: main,
                place: main,
                change: lowest,
            };
            work_rays += places.len() as f64 * fitter.work_rays(designs);
            if !self.task.pays(work_rays) {
                break;
            }
            let least = best.as_ref().map_or(places.len() / 2, |(count, _)| *count);
            let found = self.errors_alone(fitter, &places, designs, false);
            let meets = |e: &RayErrors| e.meet(&self.task.bound, 1.0);
            let good: Vec<DVec2> = (places.iter().zip(&found))
                .filter_map(|(place, e)| e.filter(meets).map(|_| *place))
                .collect();
            let sum = RayErrors::sum(found.into_iter().flatten().filter(meets));
            if good.len() <= least || !sum.meet(&self.task.bound, SHARES[0]) {
                continue;
            }
            if let Some((change, reach_mm)) = self.change(fitter, &good, main) {
                let choice = Choice {
                    place: self.place(fitter, &good, (main, change)),
                    slope: main,
                    change,
                    reach_mm,
                };
                best = Some((good.len(), choice));
                if good.len() == places.len() {
                    break;
                }
            }
        }
        fitter.limiting = limiting;
        let (_, choice) = best.ok_or(MapFailure::Degree)?;
        fitter.step_mm = choice.reach_mm;
        Ok(choice)
    }

    /// The least degree of the change within a pixel, and how far from a place it holds, mm.
    fn change(
        &self,
        fitter: &mut Fitter<'_>,
        places: &[DVec2],
        main: &Design,
    ) -> Option<(&'static Design, f64)> {
        for reach in REACHES {
            fitter.step_mm = reach * self.task.pitch_mm;
            for change in CHANGE_DEGREES.map(Design::of) {
                let designs = Designs {
                    slope: main,
                    place: main,
                    change,
                };
                if self.all_meet(fitter, places, designs)? {
                    return Some((change, fitter.step_mm));
                }
            }
        }
        None
    }

    /// The least degree of a ray's place, from half that of its slopes on, that leaves enough of the bound: errors of
    /// slopes grow with the distance, those of places do not.
    fn place(
        &self,
        fitter: &Fitter<'_>,
        places: &[DVec2],
        (slope, change): (&'static Design, &Design),
    ) -> &'static Design {
        let lower = DEGREES
            .iter()
            .filter(|d| 2 * **d >= slope.degree && **d < slope.degree);
        let does = |&place: &&Design| {
            let designs = Designs {
                slope,
                place,
                change,
            };
            self.all_meet(fitter, places, designs) == Some(true)
        };
        let found = lower.map(|d| Design::of(*d)).find(does);
        found.unwrap_or(slope)
    }

    /// Whether the errors of places with a node of their own, and around them, leave enough of the bound; `None` where
    /// too little passes.
    fn all_meet(
        &self,
        fitter: &Fitter<'_>,
        places: &[DVec2],
        designs: Designs<'_>,
    ) -> Option<bool> {
        let errors = self.errors_alone(fitter, places, designs, true);
        let all: Option<Vec<RayErrors>> = errors.into_iter().collect();
        Some(RayErrors::sum(all?.into_iter()).meet(&self.task.bound, SHARES[1]))
    }

    /// Numbers of nodes along both sides, the fewest first.
    fn sizes(&self) -> Vec<(usize, usize)> {
        let w = self.task.window;
        let long = w.half_width.max(w.half_height);
        let most = 2.0 * long / (LEAST_SPACING * self.task.pitch_mm) + 1.0;
        let sizes = NODES
            .iter()
            .filter(|nodes| **nodes <= NODES[1] || **nodes as f64 <= most);
        sizes
            .map(|&nodes| {
                let along = |half: f64| (half / long * (nodes - 1) as f64).ceil() as usize + 1;
                (along(w.half_width).max(4), along(w.half_height).max(4))
            })
            .collect()
    }
}
