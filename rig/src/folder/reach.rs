//! The circle of currents that samples cover.

/// The radius, in A, of the largest circle about zero current whose part with i_d ≤ 0 lies within the convex hull of the samples and their mirror images at
/// −i_q, or at most `gap_a` outside; and the direction in which it is limited. Samples that end before i_d = 0 are treated as if they were shifted there.
pub fn reach_a(currents: impl Iterator<Item = (f64, f64)> + Clone, gap_a: f64) -> (f64, (f64, f64)) {
    let before = currents.clone().map(|(id, _)| -id).fold(f64::INFINITY, f64::min).max(0.0);
    let both = currents.flat_map(|(id, iq)| [(id + before, iq), (id + before, -iq)]);
    let points: Vec<(f64, f64)> = both.collect();
    let hull = hull(points);
    let edges = hull.iter().zip(hull.iter().cycle().skip(1));
    let end = |(a, b): (&(f64, f64), &(f64, f64))| {
        // The outward direction of an edge, counter-clockwise.
        let (d, q) = (b.1 - a.1, a.0 - b.0);
        let length = d.hypot(q);
        let (d, q) = (d / length, q / length);
        let (farthest, way) = if d <= 0.0 { (1.0, (d, q.abs())) } else { (q.abs(), (0.0, 1.0)) };
        // An edge along q has the whole half circle before it.
        let radius = if farthest < 1e-9 { f64::INFINITY } else { (d * a.0 + q * a.1 + gap_a) / farthest };
        (radius.max(0.0), way)
    };
    edges.map(end).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, (-1.0, 0.0)))
}

/// The current, in A, with i_d ≤ 0 and i_q ≥ 0 within a circle, which has no sample or mirror image of one within `gap_a`: among those the one farthest from
/// all.
pub fn hole_a(
    currents: impl Iterator<Item = (f64, f64)> + Clone,
    circle_a: f64,
    gap_a: f64,
) -> Option<(f64, f64)> {
    const STEPS: u32 = 20;
    let share = |k: u32| circle_a * f64::from(k) / f64::from(STEPS);
    let all = (0..=STEPS).flat_map(|d| (0..=STEPS).map(move |q| (-share(d), share(q))));
    let from_all = |(d, q): (f64, f64)| {
        currents.clone().map(|(id, iq)| (id - d).hypot(iq.abs() - q)).fold(f64::INFINITY, f64::min)
    };
    let within = all.filter(|(d, q)| d.hypot(*q) <= circle_a).map(|at| (from_all(at), at));
    within.filter(|(far, _)| *far > gap_a).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, at)| at)
}

/// The convex hull, counter-clockwise, by Andrew's monotone chain.
fn hull(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    points.dedup();
    let chain = |points: &mut dyn Iterator<Item = (f64, f64)>| {
        let mut chain: Vec<(f64, f64)> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..] {
                if (b.0 - a.0) * (point.1 - a.1) > (b.1 - a.1) * (point.0 - a.0) {
                    break;
                }
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut below = chain(&mut points.iter().copied());
    below.extend(chain(&mut points.iter().rev().copied()));
    below
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_circle_ends_where_the_samples_do() {
        let square = [(-10.0, 0.0), (-10.0, 8.0), (0.0, 8.0), (0.0, 0.0), (-3.0, 4.0)];
        let before_none = [(-12.0, 0.0), (-12.0, 8.0), (-2.0, 8.0), (-2.0, 0.0)];
        let without_corner = [(-10.0, 0.0), (0.0, 10.0), (0.0, 0.0)];
        let along_d = [(-10.0, 0.0), (0.0, 0.0)];
        let half = 0.5_f64.sqrt();
        for (samples, radius, way) in [
            (&square[..], 8.0, (0.0, 1.0)),
            (&before_none[..], 8.0, (0.0, 1.0)),
            (&without_corner[..], 10.0 * half, (-half, half)),
            (&along_d[..], 0.0, (0.0, 1.0)),
        ] {
            for gap_a in [0.0, 0.5] {
                let (found, direction) = reach_a(samples.iter().copied(), gap_a);
                assert!((found - radius - gap_a).abs() < 1e-9, "{samples:?}: {found}");
                assert!((direction.0 - way.0).abs() + (direction.1 - way.1).abs() < 1e-9, "{direction:?}");
            }
        }
    }

    #[test]
    fn a_hole_is_where_no_sample_is_near() {
        let all = (0..=10).flat_map(|d| (0..=10).map(move |q| (-f64::from(d), -f64::from(q))));
        assert_eq!(hole_a(all.clone(), 10.0, 1.0), None);
        let hollow = all.filter(|(d, q)| (d + 6.0).hypot(q + 5.0) > 2.5);
        assert_eq!(hole_a(hollow.clone(), 10.0, 2.0), Some((-6.0, 5.0)));
        assert_eq!(hole_a(hollow, 10.0, 3.0), None);
    }
}
