//! The correlations that the whole-pixel search looks at, for those who want to see more than its verdict.

use quadpixel::image::Image;
use quadpixel::simd::SimdLevel;

use super::error::MatchError;
use super::geometry::Grid;
use super::prepared::Prepared;
use super::search::Task;
use super::settings::{DIRECT_SEARCH_PX, MatchSettings};
use super::tile;

/// ZNCC of every node at every whole-pixel shift.
#[derive(Clone, Debug, PartialEq)]
pub struct ZnccSurfaces {
    /// Where the nodes lie.
    pub grid: Grid,
    /// Largest shift right and down, px; 0 on a fixed axis.
    pub radius_px: [usize; 2],
    /// Node by node.
    values: Vec<f32>,
}

impl ZnccSurfaces {
    /// `ZNCC(d) = Σ ã(x) b̃(x+d) / √(Σã² Σb̃²)` of node `node`, row by row from d = −(`radius_px`); NaN where the
    /// window leaves B, 0 where a window shows nothing. Empty if there is no such node.
    pub fn at_node(&self, node: usize) -> &[f32] {
        let [x, y] = self.radius_px.map(|r| 2 * r + 1);
        self.values
            .get(node * x * y..(node + 1) * x * y)
            .unwrap_or(&[])
    }
}

/// The surfaces of single-channel `a` against `b`, as [`super::match_images`] makes and uses them; `settings.search_px`
/// at most [`DIRECT_SEARCH_PX`].
///
/// # Errors
/// As of [`super::match_images`], or a wider search.
pub fn zncc_surfaces(
    a: &Image,
    b: &Image,
    settings: &MatchSettings,
) -> Result<ZnccSurfaces, MatchError> {
    let pictures = Prepared::new(a, b, settings)?;
    if settings.search_px > DIRECT_SEARCH_PX {
        return Err(MatchError::Setting {
            name: "search",
            value: settings.search_px as f64,
            allowed: "1 to 4 px: farther shifts are searched from coarse to fine",
        });
    }
    let task = Task::new(&pictures, settings);
    let grid = pictures.grid;
    let pair = task.pair();
    let radius_px = pair.radius.map(|r| r as usize);
    let shifts = (2 * radius_px[0] + 1) * (2 * radius_px[1] + 1);
    let mut values = vec![f32::NAN; grid.len() * shifts];
    let a_tile = tile::columns(settings.window_px, settings.stride_px);
    for top in (0..grid.rows).step_by(tile::ROWS) {
        let rows = top..(top + tile::ROWS).min(grid.rows);
        for left in (0..grid.columns).step_by(a_tile) {
            let columns = left..(left + a_tile).min(grid.columns);
            let scores = pair.scores(rows.clone(), columns.clone(), SimdLevel::detect());
            for row in rows.clone() {
                for column in columns.clone() {
                    let node = row * grid.columns + column;
                    let surface = scores.surface(row - top, column - left);
                    for (shift, value) in surface.values() {
                        values[node * shifts + shift] = value;
                    }
                }
            }
        }
    }
    Ok(ZnccSurfaces {
        grid,
        radius_px,
        values,
    })
}
