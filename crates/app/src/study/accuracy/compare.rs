//! Errors of a setting against the reference.

use serde::{Deserialize, Serialize};

use super::course::Places;
use super::measure::Measured;
use super::peak::{Peak, snap};
use crate::scene::{Handle, Scene};

/// How far a setting is from the reference. `None`: not comparable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// ‖w - w_ref‖ / ‖w_ref‖ over the path, torques divided by the part's extent.
    pub wrench_l2: f64,
    /// As `wrench_l2`, against the exact solution on the same mesh at the same order: what solver and
    /// p-method add to the error of the mesh.
    pub solver_l2: f64,
    /// Largest difference of the wrench over the largest of the reference.
    pub wrench_max: f64,
    /// (peak - peak_ref) / peak_ref of the force along the approach, at the snap, or at the largest force where
    /// neither snaps; `None` if only one of them snaps, or if the setting goes past places.
    pub peak: Option<f64>,
    /// m, travel at the peak, minus that of the reference.
    pub peak_travel: Option<f64>,
    /// ‖u - u_ref‖ / ‖u_ref‖ of the drawn displacement where the part can touch.
    pub displacement: Option<f64>,
    /// sqrt(2 |Π - Π_ref|) / sqrt(2 Π_ref) at the peak of the reference's energy, which is the energy norm of the
    /// difference where the energy is least at the solution. With friction it is not, and there is none.
    pub energy: Option<f64>,
    /// (A - A_ref) / A_ref of the work put in, ∫ F dx, where the reference's is largest: what it takes to push the body over,
    /// which friction spends in part. With friction only; without, that work is the energy.
    pub work: Option<f64>,
}

/// What a setting is compared with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// How it was made.
    pub made: String,
    /// Its own error of the wrench, as [`Errors::wrench_l2`]; `None`: not known.
    pub bar: Option<f64>,
    /// How the bar was found.
    pub bar_made: String,
    /// On the tool by place, as [`Measured::wrench`], at all places of the course.
    pub wrench: Vec<[f64; 6]>,
    /// J, as [`Measured::potential`].
    pub potential: Vec<f64>,
    /// m, as [`Measured::displacement`].
    pub displacement: Vec<f64>,
}

impl Reference {
    /// Of a run, with nothing said of it yet.
    pub(super) fn of(measured: Measured) -> Self {
        Self {
            made: String::new(),
            bar: None,
            bar_made: String::new(),
            wrench: measured.wrench,
            potential: measured.potential,
            displacement: measured.displacement,
        }
    }
}

/// Direction of the approach and what makes numbers comparable.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scales {
    /// Unit vector of the held body's approach, in the frame of the wrenches.
    pub(super) direction: [f64; 3],
    /// m, divides torques.
    pub(super) lever: f64,
    /// m, of the whole path.
    pub(super) travel: f64,
    /// Whether work is compared, in place of energy.
    pub(super) has_friction: bool,
}

impl Scales {
    /// `lever`: extent of the part, m.
    pub(super) fn of(scene: &Scene, lever: f64) -> Self {
        Self {
            direction: match scene.handle {
                Handle::Tool => scene.drive.direction,
                Handle::Part => -scene.drive.direction,
            }
            .to_array(),
            lever,
            travel: scene.drive.travel,
            has_friction: scene.effects.simulated_friction().is_some(),
        }
    }

    fn size(&self, wrench: &[f64; 6]) -> f64 {
        let scaled = wrench
            .iter()
            .enumerate()
            .map(|(i, x)| if i < 3 { *x } else { x / self.lever });
        scaled.map(|x| x * x).sum::<f64>().sqrt()
    }

    /// N, along the approach, positive when it resists.
    pub(super) fn resistance(&self, wrench: &[f64; 6]) -> f64 {
        -(0..3).map(|c| wrench[c] * self.direction[c]).sum::<f64>()
    }

    /// The snap, or the largest resistance where there is none.
    pub(super) fn peak(&self, wrenches: &[[f64; 6]]) -> Peak {
        snap(wrenches.iter().map(|w| self.resistance(w)))
    }

    /// m, the travel at a step of the path.
    pub(super) fn travel_at(&self, step: usize, n_steps: usize) -> f64 {
        self.travel * step as f64 / n_steps.saturating_sub(1).max(1) as f64
    }

    /// J, work of the held body up to each of some places, by trapezoids. `travels`: m.
    fn work(&self, wrenches: &[[f64; 6]], travels: &[f64]) -> Vec<f64> {
        let mut sum = 0.0;
        let steps = wrenches.windows(2).zip(travels.windows(2));
        let of_steps = steps.map(|(w, x)| {
            sum += 0.5 * (self.resistance(&w[0]) + self.resistance(&w[1])) * (x[1] - x[0]);
            sum
        });
        [0.0].into_iter().chain(of_steps).collect()
    }

    /// N, largest resistance.
    pub(super) fn largest(&self, wrenches: &[[f64; 6]]) -> f64 {
        let all = wrenches.iter().map(|w| self.resistance(w));
        all.fold(0.0, f64::max)
    }
}

/// Relative distance of two paths of wrenches, root of the mean square.
pub(super) fn distance(a: &[[f64; 6]], b: &[[f64; 6]], scales: &Scales) -> f64 {
    let difference: Vec<[f64; 6]> = differences(a, b);
    let sum = |path: &[[f64; 6]]| path.iter().map(|w| scales.size(w).powi(2)).sum::<f64>();
    ratio(sum(&difference), sum(b)).sqrt()
}

fn differences(a: &[[f64; 6]], b: &[[f64; 6]]) -> Vec<[f64; 6]> {
    a.iter()
        .zip(b)
        .map(|(a, b)| std::array::from_fn(|i| a[i] - b[i]))
        .collect()
}

/// a / b; nothing over nothing is nothing.
fn ratio(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a / b }
}

/// Numbers of a path at some of its places.
pub(super) fn at<T: Copy>(places: &[usize], path: &[T]) -> Vec<T> {
    places.iter().map(|k| path[*k]).collect()
}

/// Compares along the whole path, at the places that all settings come to. The peak, which may be anywhere, is compared of
/// those that come to every place.
/// `exact`: the wrenches of the exact solution on the same mesh, at all places of the course.
pub(super) fn errors(
    measured: &Measured,
    places: &Places,
    exact: &[[f64; 6]],
    reference: &Reference,
    scales: &Scales,
) -> Errors {
    let Places { gone, common } = places;
    let n_places = reference.wrench.len();
    let there = places.common_of_gone();
    let wrench = at(&there, &measured.wrench);
    let (exact, wrench_ref) = (at(common, exact), at(common, &reference.wrench));
    let largest = |path: &[[f64; 6]]| path.iter().map(|w| scales.size(w)).fold(0.0, f64::max);
    let difference = differences(&wrench, &wrench_ref);
    let (peak, peak_ref) = (
        scales.peak(&measured.wrench),
        scales.peak(&reference.wrench),
    );
    let are_alike = peak.is_snap == peak_ref.is_snap && gone.len() == n_places;
    let travel_at = |place: usize| scales.travel_at(place, n_places);
    let travel = |peak: Peak| travel_at(peak.at);
    let same_samples = !reference.displacement.is_empty()
        && measured.displacement.len() == reference.displacement.len();
    let (energy, work) = if scales.has_friction {
        let travels: Vec<f64> = common.iter().map(|k| travel_at(*k)).collect();
        let of = |wrenches: &[[f64; 6]]| scales.work(wrenches, &travels);
        let (own, reference) = at_top(&of(&wrench), &of(&wrench_ref));
        (None, Some(ratio(own - reference, reference)))
    } else {
        let of_reference = at(common, &reference.potential);
        let (own, reference) = at_top(&at(&there, &measured.potential), &of_reference);
        let energy = ratio(2.0 * (own - reference).abs(), 2.0 * reference).sqrt();
        (Some(energy), None)
    };
    Errors {
        wrench_l2: distance(&wrench, &wrench_ref, scales),
        solver_l2: distance(&wrench, &exact, scales),
        wrench_max: ratio(largest(&difference), largest(&wrench_ref)),
        peak: are_alike.then(|| ratio(peak.force - peak_ref.force, peak_ref.force)),
        peak_travel: are_alike.then(|| travel(peak) - travel(peak_ref)),
        displacement: same_samples.then(|| {
            let squared = |pairs: &mut dyn Iterator<Item = f64>| pairs.map(|x| x * x).sum::<f64>();
            let (u, v) = (&measured.displacement, &reference.displacement);
            let apart = squared(&mut u.iter().zip(v).map(|(a, b)| a - b));
            ratio(apart, squared(&mut v.iter().copied())).sqrt()
        }),
        energy,
        work,
    }
}

/// Of two lists of numbers along the way, the ones where the second is largest.
fn at_top(own: &[f64], reference: &[f64]) -> (f64, f64) {
    let pairs = own.iter().copied().zip(reference.iter().copied());
    pairs.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default()
}

/// Positions of the settings that no other beats in both time and error, by ascending time.
pub(super) fn pareto_front(time_and_error: &[(f64, f64)]) -> Vec<usize> {
    let mut by_time: Vec<usize> = (0..time_and_error.len()).collect();
    by_time.sort_by(|a, b| {
        let (a, b) = (time_and_error[*a], time_and_error[*b]);
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let mut best = f64::INFINITY;
    by_time
        .into_iter()
        .filter(|k| {
            let is_better = time_and_error[*k].1 < best;
            best = best.min(time_and_error[*k].1);
            is_better
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCALES: Scales = Scales {
        direction: [0.0, -1.0, 0.0],
        lever: 0.1,
        travel: 0.01,
        has_friction: false,
    };

    fn all() -> Places {
        Places {
            gone: vec![0, 1, 2, 3, 4],
            common: vec![0, 1, 2, 3, 4],
        }
    }

    fn path(scale: f64) -> Vec<[f64; 6]> {
        [0.0, 1.0, 4.0, 2.0, -3.0]
            .map(|f| [0.0, scale * f, 0.0, 0.0, 0.0, 0.0])
            .to_vec()
    }

    pub(crate) fn measured(scale: f64) -> Measured {
        Measured {
            nodes: 10,
            elements: 2,
            order: 2,
            bytes: 1000.0,
            prepare_s: 0.5,
            n_timed: 100,
            step: None,
            shape: None,
            stages: vec![None; crate::engine::N_STAGES],
            repeats: None,
            free_nodes: 0,
            contacts: 3,
            not_converged: 0,
            certificate: 1e-15,
            penetration: 1e-6,
            wrench: path(scale),
            potential: vec![0.0, 1.0, scale * 4.0, 2.0, 1.0],
            displacement: vec![scale, 2.0 * scale, 0.0],
        }
    }

    fn reference() -> Reference {
        Reference::of(measured(1.0))
    }

    #[test]
    fn a_tenth_more_force_is_a_tenth_of_error_everywhere() {
        let errors = errors(&measured(1.1), &all(), &path(1.1), &reference(), &SCALES);
        for error in [
            errors.wrench_l2,
            errors.wrench_max,
            errors.peak.unwrap(),
            errors.displacement.unwrap(),
        ] {
            assert!((error - 0.1).abs() < 1e-12, "{errors:?}");
        }
        assert_eq!((errors.peak_travel, errors.solver_l2), (Some(0.0), 0.0));
        // Energy a tenth larger: the root of it.
        assert!((errors.energy.unwrap() - 0.1f64.sqrt()).abs() < 1e-12);
        let peak = SCALES.peak(&path(1.0));
        assert_eq!((peak.force, peak.is_snap), (4.0, true));
        assert_eq!(SCALES.travel_at(peak.at, 5), 0.005);
    }

    /// 60 J of the path of forces 0, 1, 4, 2 at 0, 10, 20 and 30 m; what comes after gives 5 back.
    #[test]
    fn with_friction_the_work_put_in_is_compared_where_it_is_largest() {
        let scales = Scales {
            travel: 40.0,
            has_friction: true,
            ..SCALES
        };
        let found = errors(&measured(1.1), &all(), &path(1.0), &reference(), &scales);
        assert_eq!(found.energy, None);
        assert!((found.work.unwrap() - 0.1).abs() < 1e-12, "{found:?}");
        let travels = [0.0, 10.0, 20.0, 30.0, 40.0];
        let work = scales.work(&path(1.0), &travels);
        assert_eq!(work, [0.0, 5.0, 30.0, 60.0, 55.0]);
    }

    /// A way in larger increments comes to each second place: all settings are compared there, so that what happens between
    /// shows in none of them. A peak may be between.
    #[test]
    fn other_increments_are_compared_at_the_places_that_all_come_to() {
        let common = vec![0, 2, 4];
        let mut coarse = measured(1.0);
        coarse.wrench = at(&common, &path(1.0));
        coarse.potential = at(&common, &coarse.potential);
        let mut fine = measured(1.0);
        fine.wrench[3][1] += 0.1;
        for (setting, gone) in [(coarse, common.clone()), (fine, all().gone)] {
            let places = Places {
                gone,
                common: common.clone(),
            };
            let is_fine = places.gone.len() == 5;
            let errors = errors(&setting, &places, &path(1.0), &reference(), &SCALES);
            assert_eq!((errors.wrench_l2, errors.solver_l2), (0.0, 0.0));
            let peak = is_fine.then_some(0.0);
            assert_eq!((errors.peak, errors.peak_travel), (peak, peak));
            assert_eq!(errors.energy, Some(0.0));
        }
    }

    #[test]
    fn a_snap_is_not_compared_with_a_largest_force() {
        let mut other = measured(1.0);
        other.wrench[3..].fill([0.0, 5.0, 0.0, 0.0, 0.0, 0.0]);
        let errors = errors(&other, &all(), &path(1.0), &reference(), &SCALES);
        assert_eq!((errors.peak, errors.peak_travel), (None, None));
    }

    #[test]
    fn a_torque_counts_by_its_lever() {
        let mut turned = measured(1.0);
        turned.wrench[2][5] = 0.05;
        let errors = errors(&turned, &all(), &path(1.0), &reference(), &SCALES);
        assert!((errors.wrench_max - 0.5 / 4.0).abs() < 1e-12, "{errors:?}");
    }

    #[test]
    fn samples_that_are_not_there_are_not_compared() {
        let mut other = measured(1.0);
        other.displacement.clear();
        assert_eq!(
            errors(&other, &all(), &path(1.0), &reference(), &SCALES).displacement,
            None
        );
    }

    #[test]
    fn the_front_is_what_no_other_beats() {
        let points = [(1.0, 0.5), (2.0, 0.2), (3.0, 0.3), (2.0, 0.6), (4.0, 0.1)];
        assert_eq!(pareto_front(&points), [0, 1, 4]);
        assert!(pareto_front(&[]).is_empty());
    }
}
