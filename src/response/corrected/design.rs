//! Where exact runs say most: each as far as can be from those before and their mirror images.

use crate::em::PixelStack;
use crate::response::symmetry::symmetries;

/// Indices of `count` of the directions (fewer, if there are fewer), the first nearest to the normal, each next one the farthest, in
/// (u, v), from all before it and their images under the pixel's symmetries. Fewer are the beginning of more.
pub fn spread(directions: &[[f64; 2]], stack: &PixelStack, count: usize) -> Vec<usize> {
    let group = symmetries(stack);
    let radius = |i: &usize| directions[*i][0].hypot(directions[*i][1]);
    let nearest = (0..directions.len()).min_by(|a, b| radius(a).total_cmp(&radius(b)));
    let Some(mut next) = nearest else {
        return Vec::new();
    };
    let mut gap = vec![f64::INFINITY; directions.len()];
    let mut chosen = Vec::new();
    while chosen.len() < count.min(directions.len()) {
        chosen.push(next);
        for symmetry in &group {
            let [a, b] = symmetry.direction(directions[next]);
            for (gap, [u, v]) in gap.iter_mut().zip(directions) {
                *gap = gap.min((u - a).hypot(v - b));
            }
        }
        gap[next] = -1.0;
        // The first of equals.
        for (i, g) in gap.iter().enumerate() {
            if *g > gap[next] + 1e-12 {
                next = i;
            }
        }
    }
    chosen
}
