//! Lines of places cut at the edges of the unit square.

use glam::DVec2;

/// The parts of a line of places that lie within the unit square. Places that are no numbers part it.
pub(super) fn visible(places: &[DVec2]) -> Vec<Vec<DVec2>> {
    let mut parts: Vec<Vec<DVec2>> = Vec::new();
    for pair in places.windows(2) {
        let Some([from, to]) = clipped(pair[0], pair[1]) else {
            continue;
        };
        match parts.last_mut() {
            Some(part) if part.last() == Some(&from) => part.push(to),
            _ => parts.push(vec![from, to]),
        }
    }
    parts
}

/// The part of a segment inside the unit square (Liang and Barsky).
fn clipped(a: DVec2, b: DVec2) -> Option<[DVec2; 2]> {
    if !(a.is_finite() && b.is_finite()) {
        return None;
    }
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for (start, end) in [(a.x, b.x), (a.y, b.y)] {
        let way = end - start;
        if way == 0.0 {
            if !(0.0..=1.0).contains(&start) {
                return None;
            }
            continue;
        }
        let (enters, leaves) = (-start / way, (1.0 - start) / way);
        from = from.max(enters.min(leaves));
        to = to.min(enters.max(leaves));
    }
    // The ends themselves, to the bit: neighbouring segments meet there.
    let point = |t: f64| match t {
        0.0 => a,
        1.0 => b,
        _ => a + t * (b - a),
    };
    (from < to).then(|| [point(from), point(to)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_are_cut_at_the_charts_edges() {
        let cut = |a: (f64, f64), b: (f64, f64)| clipped(a.into(), b.into());
        let made = |a: (f64, f64), b: (f64, f64)| Some([a.into(), b.into()]);
        assert_eq!(
            cut((0.25, 0.25), (0.5, 0.75)),
            made((0.25, 0.25), (0.5, 0.75))
        );
        // Out by the side, through the top, and right across a corner.
        assert_eq!(
            cut((0.75, 0.5), (1.25, 1.0)),
            made((0.75, 0.5), (1.0, 0.75))
        );
        assert_eq!(
            cut((0.25, 0.5), (0.5, 1.5)),
            made((0.25, 0.5), (0.375, 1.0))
        );
        assert_eq!(cut((-1.0, 0.0), (1.0, 2.0)), None);
        assert_eq!(cut((1.25, 0.5), (1.5, 0.5)), None);
        assert_eq!(cut((0.25, 2.0), (0.75, 1.5)), None);
    }

    #[test]
    fn a_line_that_leaves_the_chart_comes_back_as_another_part() {
        let places = [
            (0.0, 0.5),
            (0.25, 1.5),
            (0.5, 0.5),
            (0.75, 0.5),
            (f64::NAN, 0.5),
        ];
        let parts = visible(&places.map(DVec2::from));
        let counts: Vec<usize> = parts.iter().map(Vec::len).collect();
        assert_eq!(counts, [2, 3]);
    }
}
