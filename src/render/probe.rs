//! A few pixels of a render: what one looks at to learn what the whole would show.

use rayon::prelude::*;

use super::estimator::{Estimator, Kept, PixelAim, Workspace};
use super::stats::Tally;
use super::{Camera, Execution, RenderSettings};
use crate::sampling::SobolSet;
use crate::scene::Scene;

/// Values of the pixels at `places` (column, row), as [`super::render`] would give them: `[place][channel][sub-pixel]`, 0 where the lens lets no light
/// through.
pub fn probe(
    camera: &Camera,
    scene: &Scene,
    settings: &RenderSettings,
    execution: &Execution,
    places: &[(usize, usize)],
) -> Vec<f64> {
    let estimator = Estimator {
        camera,
        scene: Some(scene),
        settings,
        execution,
        sobol: SobolSet::new(settings.rays_per_pixel),
        spread: camera.ray_spread(settings.rays_per_pixel),
    };
    let count = 3 * camera.sensor().subpixels().count();
    let of_place = |work: &mut Workspace, &(column, row): &(usize, usize)| {
        let mut values = vec![0.0; count];
        if let Some(aim) = PixelAim::new(camera, settings.seed, column, row) {
            let mut tally = Tally::default();
            estimator.pixel(&aim, None, Kept::No, work, &mut tally, &mut values);
        }
        values
    };
    let values: Vec<Vec<f64>> = places
        .par_iter()
        .map_init(Workspace::default, of_place)
        .collect();
    values.concat()
}
