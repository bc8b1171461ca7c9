//! The parts of the computation; the edge itself is held against independent values in `tests/stability.rs`.

use super::*;

/// Real roots and conjugate pairs (re, im).
type Roots = (&'static [f64], &'static [(f64, f64)]);

/// Roots given as real numbers and conjugate pairs (re, im), multiplied out.
fn polynomial(real: &[f64], pairs: &[(f64, f64)]) -> Vec<f64> {
    let mut p = vec![1.0];
    let mut times = |factor: &[f64]| {
        let mut product = vec![0.0; p.len() + factor.len() - 1];
        for (i, a) in p.iter().enumerate() {
            for (j, b) in factor.iter().enumerate() {
                product[i + j] += a * b;
            }
        }
        p = product;
    };
    for root in real {
        times(&[-root, 1.0]);
    }
    for (re, im) in pairs {
        times(&[re * re + im * im, -2.0 * re, 1.0]);
    }
    p
}

#[test]
fn roots_are_told_inside_from_outside_the_unit_circle() {
    let inside: [Roots; 4] = [
        (&[0.5], &[]),
        (&[0.999, -0.999, 0.0], &[]),
        (&[0.3], &[(0.7, 0.7), (-0.9, 0.4)]),
        (&[], &[(0.0, 0.9999), (0.99, 0.01), (-0.5, 0.5)]),
    ];
    for (real, pairs) in inside {
        assert!(all_inside_unit_circle(&mut polynomial(real, pairs)));
    }
    let outside: [Roots; 4] = [
        (&[1.0001], &[]),
        (&[0.999, -1.001, 0.0], &[]),
        (&[0.3], &[(0.71, 0.71), (-0.9, 0.4)]),
        (&[1.5, 0.5], &[(0.0, 0.9999)]),
    ];
    for (real, pairs) in outside {
        assert!(!all_inside_unit_circle(&mut polynomial(real, pairs)));
    }
    assert!(!all_inside_unit_circle(&mut [f64::NAN, 1.0]));
}

#[test]
fn held_force_has_its_closed_form_and_its_limit_without_damping() {
    let (m, t) = (0.25, 1e-3);
    let free = held_force(m, 0.0, t);
    assert_eq!((free.kept, free.coasted), (1.0, t));
    assert!((free.way - 0.5 * t * t / m).abs() < 1e-20);
    // On both sides of where the series is left: x = 0.01.
    for b in [2.4999, 2.5001, 30.0] {
        let held = held_force(m, b, t);
        let a = (-b * t / m).exp();
        assert!((held.speed / ((1.0 - a) / b) - 1.0).abs() < 1e-12);
        let way = (t - (1.0 - a) * m / b) / b;
        assert!((held.way / way - 1.0).abs() < 1e-10);
    }
}

#[test]
fn input_without_sense_gives_no_stiffness() {
    let plant = Plant {
        mass: 1.0,
        damping: 2.0,
        delay_periods: 0,
    };
    assert!(critical_stiffness(&plant, 0.0, 1e-3) > 3000.0);
    for bad in [
        Plant { mass: 0.0, ..plant },
        Plant {
            mass: f64::NAN,
            ..plant
        },
        Plant {
            damping: -1.0,
            ..plant
        },
        Plant {
            delay_periods: 101,
            ..plant
        },
    ] {
        assert_eq!(critical_stiffness(&bad, 0.0, 1e-3), 0.0);
    }
    assert_eq!(critical_stiffness(&plant, f64::NAN, 1e-3), 0.0);
    assert_eq!(critical_stiffness(&plant, 0.0, 0.0), 0.0);
    // Without any damping a sampled spring always gains energy.
    let frictionless = Plant {
        damping: 0.0,
        ..plant
    };
    assert_eq!(critical_stiffness(&frictionless, 0.0, 1e-3), 0.0);
    // A damper so large that it throws the mass back.
    assert_eq!(critical_stiffness(&plant, 1e5, 1e-3), 0.0);
}
