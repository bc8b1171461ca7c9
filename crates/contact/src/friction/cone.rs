//! The friction cone K = { λ : |λ_t| ≤ μ λ_n } and the nearest point of it.

/// Length of the tangential part. Exact to round-off between 1e-150 and 1e150, much faster than `hypot`.
pub(super) fn tangential(v: &[f64; 3]) -> f64 {
    (v[1] * v[1] + v[2] * v[2]).sqrt()
}

/// The point of the cone nearest to `v`.
pub(super) fn project(v: &[f64; 3], friction_coefficient: f64) -> [f64; 3] {
    let mu = friction_coefficient;
    let t = tangential(v);
    if t <= mu * v[0] {
        return *v;
    }
    // Behind the polar cone all is nearest to the tip.
    if mu * t <= -v[0] {
        return [0.0; 3];
    }
    let normal = (v[0] + mu * t) / (1.0 + mu * mu);
    if t <= 0.0 {
        return [normal.max(0.0), 0.0, 0.0];
    }
    let scale = mu * normal / t;
    [normal, scale * v[1], scale * v[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projection_is_the_nearest_of_many_points_of_the_cone() {
        let points = [
            [1.0, 0.2, 0.1],
            [0.5, 2.0, -1.0],
            [-0.3, 0.4, 0.2],
            [-1.0, 0.1, 0.0],
            [0.0, 0.0, 0.0],
            [-2.0, 0.0, 0.0],
        ];
        for mu in [0.0, 0.3, 1.0, 4.0] {
            for point in &points {
                let nearest = project(point, mu);
                assert!(tangential(&nearest) <= mu * nearest[0] * (1.0 + 1e-15) + 1e-300);
                let distance =
                    |p: &[f64; 3]| -> f64 { (0..3).map(|k| (p[k] - point[k]).powi(2)).sum() };
                for step in 0..2000 {
                    let (angle, radius) = (0.1 * f64::from(step), 1e-3 * f64::from(step));
                    for share in [0.0, 0.5, 1.0] {
                        let t = share * mu * radius;
                        let other = [radius, t * angle.cos(), t * angle.sin()];
                        assert!(distance(&nearest) <= distance(&other) + 1e-12);
                    }
                }
            }
        }
    }
}
