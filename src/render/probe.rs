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
    let run = |work: &mut Workspace, places: &[(usize, usize)]| {
        let aims: Vec<Option<PixelAim>> = (places.iter())
            .map(|&(column, row)| PixelAim::new(camera, settings.seed, column, row))
            .collect();
        let lit: Vec<&PixelAim> = aims.iter().flatten().collect();
        let mut tasks: Vec<PixelTask<'_>> = lit.into_iter().map(PixelTask::image_only).collect();
        let mut found = vec![0.0; count * tasks.len()];
        estimator.run(&mut tasks, work, &mut found);
        let mut found = found.chunks_exact(count);
        let dark = vec![0.0; count];
        let values = (aims.iter()).flat_map(|aim| match aim {
            Some(_) => found.next().unwrap_or(&dark),
            None => &dark,
        });
        values.copied().collect::<Vec<f64>>()
    };
    let values: Vec<Vec<f64>> = places
        .par_chunks(estimator.run_length())
        .map_init(Workspace::default, |work, places| run(work, places))
        .collect();
    values.concat()
}
