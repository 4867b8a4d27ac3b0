//! Where what passes ends along each of many directions, by fewer questions than bisecting each.
//!
//! Places along a direction are numbered from 0, which passes, to `end`, which does not. Neighbouring directions end
//! near each other: a few are bisected, and each one halfway between two that are known is asked first where its
//! neighbours say (the cubic through four of them), then in doubling steps until the answer changes, then bisected
//! between. Where what passes is one piece along a direction, that finds what bisecting it finds.

/// Directions that are bisected, about.
const BISECTED: usize = 10;

/// Whether places along directions pass, in the order of the questions.
type Passes<'a> = dyn FnMut(&[(usize, u32)]) -> Vec<bool> + 'a;

/// The last place that passes along each direction, in order around. `known` holds those that need not be asked;
/// `passes` answers questions of direction and place. All the questions of a round come at once.
pub(crate) fn last_that_pass(
    known: Vec<Option<u32>>,
    end: u32,
    passes: &mut Passes<'_>,
) -> Vec<u32> {
    let count = known.len();
    let mut last: Vec<u32> = known.iter().map(|k| k.unwrap_or(0)).collect();
    let mut stride = 1;
    while count > 2 * stride * BISECTED {
        stride *= 2;
    }
    let asked = |i: &usize| known[*i].is_none();
    let first = (0..count).step_by(stride).filter(asked);
    settle(
        first.map(|i| Search::bisecting(i, end)).collect(),
        &mut last,
        passes,
    );
    while stride > 1 {
        let half = stride / 2;
        // Beyond the last stands the first.
        let at =
            |i: usize, steps: usize| f64::from(last[if i + steps < count { i + steps } else { 0 }]);
        let before = |i: usize, steps: usize| {
            f64::from(
                last[i
                    .checked_sub(steps)
                    .unwrap_or((count - 1) / stride * stride)],
            )
        };
        let next = (half..count).step_by(stride).filter(asked);
        let searches = next.map(|i| {
            let near = before(i, half) + at(i, half);
            let far = before(i, half + stride) + at(i, half + stride);
            Search::near(i, (9.0 * near - far) / 16.0, end)
        });
        settle(searches.collect(), &mut last, passes);
        stride = half;
    }
    last
}

/// Asks until every search is settled.
fn settle(mut open: Vec<Search>, last: &mut [u32], passes: &mut Passes<'_>) {
    loop {
        open.retain(|search| {
            last[search.direction] = search.low;
            search.high - search.low > 1
        });
        if open.is_empty() {
            return;
        }
        let questions: Vec<(usize, u32)> = open.iter().map(|s| (s.direction, s.next())).collect();
        for (search, passed) in open.iter_mut().zip(passes(&questions)) {
            search.take(passed);
        }
    }
}

/// A direction that is asked.
struct Search {
    direction: usize,
    /// Passes.
    low: u32,
    /// Does not.
    high: u32,
    /// Where to ask, while the way from `low` to `high` is not yet the one to bisect, and how far to go from there.
    guess: Option<(u32, u32)>,
    /// The first answer.
    passed: Option<bool>,
}

impl Search {
    fn bisecting(direction: usize, end: u32) -> Self {
        Self {
            direction,
            low: 0,
            high: end,
            guess: None,
            passed: None,
        }
    }

    fn near(direction: usize, place: f64, end: u32) -> Self {
        let place = (place + 0.5) as u32;
        Self {
            guess: Some((place.clamp(1, end.max(2) - 1), 1)),
            ..Self::bisecting(direction, end)
        }
    }

    fn next(&self) -> u32 {
        match self.guess {
            Some((place, _)) => place,
            None => self.low + (self.high - self.low) / 2,
        }
    }

    fn take(&mut self, passed: bool) {
        let asked = self.next();
        match passed {
            true => self.low = asked,
            false => self.high = asked,
        }
        let goes_on = *self.passed.get_or_insert(passed) == passed;
        self.guess = self.guess.filter(|_| goes_on).and_then(|(place, step)| {
            let next = match passed {
                true => place + step,
                false => place.saturating_sub(step),
            };
            (self.low < next && next < self.high).then_some((next, 2 * step))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The answers for an edge, and how many questions they took.
    fn found(edge: &[f64], known: Vec<Option<u32>>, end: u32) -> (Vec<u32>, usize) {
        let mut asked = 0;
        let last = last_that_pass(known, end, &mut |questions| {
            asked += questions.len();
            let passes = |&(i, place): &(usize, u32)| f64::from(place) <= edge[i];
            questions.iter().map(passes).collect()
        });
        (last, asked)
    }

    /// A cat's eye, of two circles.
    fn cats_eye(count: usize, end: f64) -> Vec<f64> {
        let edge = |i: usize| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / count as f64).sin_cos();
            let circle = |x: f64| x * cos + (0.16 - (x * sin).powi(2)).sqrt();
            end * circle(-0.1).min(circle(0.15))
        };
        (0..count).map(edge).collect()
    }

    #[test]
    fn edges_are_those_of_bisections_by_half_the_questions() {
        for (count, bits) in [(160, 11), (128, 10), (42, 10), (32, 10), (7, 4), (1, 3)] {
            let end = 1 << bits;
            let edge = cats_eye(count, f64::from(end));
            let (last, asked) = found(&edge, vec![None; count], end);
            let floor: Vec<u32> = edge.iter().map(|e| *e as u32).collect();
            assert_eq!(last, floor, "{count}");
            if count > 100 {
                assert!(asked * 2 < count * bits, "{asked} of {}", count * bits);
            }
        }
    }

    #[test]
    fn edges_without_any_order_are_found_too() {
        let end = 512;
        let edge: Vec<f64> = (0..100).map(|i| f64::from((i * 197) % end)).collect();
        let (last, _) = found(&edge, vec![None; 100], end);
        assert_eq!(last, edge.iter().map(|e| *e as u32).collect::<Vec<_>>());
    }

    #[test]
    fn what_is_known_is_not_asked() {
        let known = |i: usize| i.is_multiple_of(3).then_some(64);
        let edge = vec![20.0; 50];
        let (last, _) = found(&edge, (0..50).map(known).collect(), 64);
        for (i, last) in last.iter().enumerate() {
            assert_eq!(*last, known(i).unwrap_or(20));
        }
        let (last, asked) = found(&edge, vec![Some(5); 50], 64);
        assert_eq!((last, asked), (vec![5; 50], 0));
    }
}
