//! Where the microlenses of a window stand, by the rule that its camera follows.

use glam::DVec2;
use rayon::prelude::*;

use crate::field::FieldGrid;
use crate::frames::uv_from_camera_direction;
use crate::lens::{OpticalSystem, chief_rays};
use crate::response::{ChiefRayShifts, Response};
use crate::sensor::{MicrolensShifts, Sensor, ShiftRule};

/// See the module.
pub(super) struct Microlenses {
    pub shifts: MicrolensShifts,
    /// The part of the window whose chief rays lie beyond those that the response's shifts were found for.
    pub beyond: f64,
}

impl Microlenses {
    /// Behind a lens, `reference`, whose chief rays the rule may follow.
    pub fn new(
        rule: ShiftRule,
        reference: &OpticalSystem,
        sensor: &Sensor,
        response: &Response,
    ) -> Self {
        let size = (
            FieldGrid::nodes_for(sensor.width()),
            FieldGrid::nodes_for(sensor.height()),
        );
        let mut beyond = 0.0;
        let shifts = match rule {
            ShiftRule::Centred => MicrolensShifts::Centred,
            ShiftRule::Linear { um_per_mm } => MicrolensShifts::Linear { um_per_mm },
            ShiftRule::ChiefRay => {
                let chief_uv = chief_field(reference, sensor, size);
                match response.chief_ray_shifts() {
                    None => MicrolensShifts::ChiefRay {
                        chief_uv,
                        frame: response.frame(),
                    },
                    Some(map) => {
                        let (shift_um, clamped) =
                            shifts_of_chief_rays(map, &chief_uv, sensor, size);
                        beyond = clamped;
                        MicrolensShifts::Found { shift_um }
                    }
                }
            }
        };
        Self { shifts, beyond }
    }
}

/// The shifts found for the chief rays of a field, and the part of its nodes that lie beyond those.
fn shifts_of_chief_rays(
    map: &ChiefRayShifts,
    chief_uv: &FieldGrid,
    sensor: &Sensor,
    size: (usize, usize),
) -> (FieldGrid, f64) {
    let chief = chief_uv.data().chunks_exact(2);
    let found: Vec<_> = chief.map(|uv| map.at(uv[0], uv[1])).collect();
    let clamped = found.iter().filter(|f| f.clamped).count();
    let data = found.iter().flat_map(|f| f.shift_um).collect();
    let field = FieldGrid::new(sensor.window_mm(), size, 2, data)
        .unwrap_or_else(|| unreachable!("two values a node"));
    (field, clamped as f64 / found.len() as f64)
}

/// Direction cosines of the chief ray where it arrives, over the window. Where none passes, the value of the axis.
fn chief_field(system: &OpticalSystem, sensor: &Sensor, (nx, ny): (usize, usize)) -> FieldGrid {
    let window = sensor.window_mm();
    let row = |row: usize| {
        let places = (0..nx).map(|k| FieldGrid::node_mm(window, (nx, ny), (k, row)));
        let rays = chief_rays(system, places).into_iter();
        rays.flat_map(|ray| {
            let uv = ray.map_or(DVec2::ZERO, |ray| uv_from_camera_direction(-ray.direction));
            [uv.x, uv.y]
        })
    };
    let data = (0..ny).into_par_iter().flat_map_iter(row).collect();
    FieldGrid::new(window, (nx, ny), 2, data).unwrap_or_else(|| unreachable!("two values a node"))
}
