//! A few pixels of a render: what one looks at to learn what the whole would show.

use rayon::prelude::*;

use super::estimator::{Estimator, PixelTask};
use super::pixel_aim::PixelAim;
use super::workspace::Workspace;
use super::{Camera, Execution, RenderSettings};
use crate::scene::Scene;

/// Values of the pixels at `places` (column, row), as [`super::render`] would give them: `[place][channel][sub-pixel]`,
/// 0 where the lens lets no light through.
pub fn probe(
    camera: &Camera,
    scene: &Scene,
    settings: &RenderSettings,
    execution: &Execution,
    places: &[(usize, usize)],
) -> Vec<f64> {
    let estimator = Estimator::new(camera, Some(scene), settings, *execution);
    let count = 3 * camera.sensor().subpixels().count();
    let pixel = |work: &mut Workspace, &(column, row): &(usize, usize)| {
        let mut values = vec![0.0; count];
        if let Some(aim) = PixelAim::new(camera, settings.seed, column, row) {
            estimator.run(&mut [PixelTask::image_only(&aim)], work, &mut values);
        }
        values
    };
    let values: Vec<Vec<f64>> = places
        .par_iter()
        .map_init(Workspace::default, pixel)
        .collect();
    values.concat()
}
