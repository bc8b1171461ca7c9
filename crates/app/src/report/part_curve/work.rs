//! Integrals of force over travel, by the trapezoid rule.

use super::Point;

/// The whole integral, J.
pub(super) fn whole(points: &[Point]) -> f64 {
    points.windows(2).map(|w| step(w[0], w[1])).sum()
}

/// Largest value of the integral from the start, J, >= 0. It is reached where the force goes through zero, which
/// may be between two points.
pub(super) fn largest(points: &[Point]) -> f64 {
    let (mut sum, mut most) = (0.0f64, 0.0f64);
    for w in points.windows(2) {
        let [a, b] = [w[0], w[1]];
        if a.force > 0.0 && b.force < 0.0 {
            let way = a.force / (a.force - b.force) * (b.travel - a.travel);
            most = most.max(sum + 0.5 * a.force * way);
        }
        sum += step(a, b);
        most = most.max(sum);
    }
    most
}

fn step(a: Point, b: Point) -> f64 {
    0.5 * (a.force + b.force) * (b.travel - a.travel)
}
