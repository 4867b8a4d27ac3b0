//! Which pixels of the picture reach a tile, in which layers.

use std::ops::Range;

use super::relief::Relief;
use crate::render::kernels::Support;

/// Side of the cells that have one kernel per layer, px: kernels change slowly over the field.
pub(super) const CELL: usize = 16;

/// A rectangle of the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tile {
    pub x: usize,
    pub y: usize,
    pub width: usize,
    pub height: usize,
}

/// A source in a layer.
#[derive(Clone, Copy)]
pub(super) struct Source {
    pub cell: (usize, usize),
    pub x: i32,
    pub y: i32,
    pub weight: f32,
    pub light: [f32; 3],
    pub slope: [f32; 2],
}

/// All of them.
pub(super) struct Sources<'a> {
    pub relief: &'a Relief,
    /// Everything in one layer, with neither slant nor background.
    pub is_flat: bool,
    /// Number of layers.
    pub layers: usize,
    /// How far the largest kernel reaches, px.
    pub reach: usize,
}

impl Sources<'_> {
    /// Those that reach a tile by their keys, cell by cell.
    pub fn of(&self, tile: Tile) -> Vec<Vec<Source>> {
        let relief = self.relief;
        let mut layers: Vec<Vec<Source>> = vec![Vec::new(); key_of(self.layers, true)];
        let first = |at: usize| at + relief.margin - self.reach;
        let columns = first(tile.x)..first(tile.x) + tile.width + 2 * self.reach;
        let rows = first(tile.y)..first(tile.y) + tile.height + 2 * self.reach;
        for cell_row in rows.start / CELL..=(rows.end - 1) / CELL {
            for cell_column in columns.start / CELL..=(columns.end - 1) / CELL {
                let cell = (cell_column, cell_row);
                for row in within(cell_row, &rows) {
                    for column in within(cell_column, &columns) {
                        let place = [(column, tile.x), (row, tile.y)];
                        let [x, y] =
                            place.map(|(at, tile)| at as i32 - (relief.margin + tile) as i32);
                        self.place(row * relief.width + column, (cell, x, y), &mut layers);
                    }
                }
            }
        }
        layers
    }

    /// Puts a source, and what goes on behind it, into their layers.
    fn place(
        &self,
        at: usize,
        (cell, x, y): ((usize, usize), i32, i32),
        layers: &mut [Vec<Source>],
    ) {
        let relief = self.relief;
        let mut put = |level: f32, is_made_up: bool, light: [f32; 3], slope: [f32; 2]| {
            let near = level.floor();
            let behind = level - near;
            for (layer, weight) in [(near as usize, 1.0 - behind), (near as usize + 1, behind)] {
                if weight > 0.0 {
                    layers[key_of(layer, is_made_up)].push(Source {
                        cell,
                        x,
                        y,
                        weight,
                        light,
                        slope,
                    });
                }
            }
        };
        if self.is_flat {
            return put(0.0, false, relief.light[at], [0.0; 2]);
        }
        put(
            relief.level[at],
            relief.made_up[at],
            relief.light[at],
            relief.slope[at],
        );
        if let Some(behind) = &relief.behind[at] {
            put(behind.level, true, behind.light, [0.0; 2]);
        }
    }
}

/// Columns and rows of the tile that sources of one support reach.
pub(super) fn reached(sources: &[Source], support: Support, tile: Tile) -> [Range<usize>; 2] {
    let start = [i32::MAX, i32::MIN, i32::MAX, i32::MIN];
    let [left, right, top, bottom] = sources.iter().fold(start, |[l, r, t, b], s| {
        [l.min(s.x), r.max(s.x), t.min(s.y), b.max(s.y)]
    });
    let range = |first: i32, last: i32, length: usize, size: usize| {
        let end = (last + length as i32).clamp(0, size as i32) as usize;
        (first.clamp(0, size as i32) as usize).min(end)..end
    };
    [
        range(
            left + support.left,
            right + support.left,
            support.width,
            tile.width,
        ),
        range(
            top + support.top,
            bottom + support.top,
            support.height,
            tile.height,
        ),
    ]
}

/// Order in which layers are laid: made-up sources of a layer come after those that are seen a layer farther, which
/// they may be in the way of otherwise.
fn key_of(layer: usize, is_made_up: bool) -> usize {
    match is_made_up {
        false => 2 * layer,
        true => 2 * layer + 3,
    }
}

/// Layer of a key, and whether its sources are made up.
pub(super) fn level_of(key: usize) -> (usize, bool) {
    match key % 2 {
        0 => (key / 2, false),
        _ => ((key - 3) / 2, true),
    }
}

/// The part of a cell that lies in a range.
fn within(cell: usize, range: &Range<usize>) -> Range<usize> {
    (cell * CELL).max(range.start)..((cell + 1) * CELL).min(range.end)
}
