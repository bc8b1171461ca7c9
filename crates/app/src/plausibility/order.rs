//! Elements that are too stiff: linear ones, and all of them in a material that hardly changes its volume. The
//! program can raise the order itself, so it says what that gives.

use fem::Order;

use super::units::short;
use super::warning;
use crate::prepare::budget::{Forecast, duration};
use crate::prepare::{PrepareOptions, PreparedPart, load, prepare};
use crate::progress::{Progress, Ui};
use crate::report::Warning;
use crate::scene::Scene;
use crate::{Error, drive, setup};

/// Poisson's ratio from which elements may lock.
const NEARLY_INCOMPRESSIBLE: f64 = 0.45;
/// Share of the peak by which two orders may differ before it is told.
const TOLERANCE: f64 = 0.05;
/// The same for what is extrapolated from three orders, which is known to a factor only.
const TOLERANCE_LEFT: f64 = 0.15;
/// s: what preparing the part at another order may take by its forecast.
const AFFORDABLE_S: f64 = 10.0;
/// The same where only the mesh may be coarse: coarse ones are cheap.
const COARSE_S: f64 = 0.5;
/// Share of the peak by which quadratic elements may differ from cubic ones: more is a mesh too coarse to bend.
const TOLERANCE_COARSE: f64 = 0.1;
/// The highest order there is.
const HIGHEST: u8 = 3;

/// What another order gives.
#[derive(Clone, Debug, PartialEq)]
enum Peak {
    /// N.
    Of(f64),
    /// Why there is none.
    Unknown(String),
}

impl Peak {
    fn newtons(&self) -> Option<f64> {
        match self {
            Self::Of(peak) if *peak > 0.0 => Some(*peak),
            _ => None,
        }
    }
}

/// Compares the run with the same at other orders where its elements may be too stiff.
///
/// # Errors
/// Ctrl-C.
pub(super) fn checked(
    scene: &Scene,
    prepared: &PreparedPart,
    peak: f64,
    options: &PrepareOptions,
) -> Result<Option<Warning>, Error> {
    // What bends is what is solved on.
    let order = prepared.loaded.solved_mesh().order;
    let nu = scene.part.material.poisson_ratio;
    let may_lock = nu > NEARLY_INCOMPRESSIBLE;
    if order >= Order::Cubic && !may_lock {
        return Ok(None);
    }
    let affordable = if order == Order::Linear || may_lock {
        AFFORDABLE_S
    } else {
        COARSE_S
    };
    let at = |order: u8| -> Result<Peak, Error> {
        if peak <= 0.0 {
            return Ok(Peak::Unknown("nothing resisted".to_owned()));
        }
        match peak_at(scene, order, affordable, options) {
            Err(e) if e.is_interrupt() => Err(e),
            Err(e) => Ok(Peak::Unknown(e.to_string())),
            Ok(peak) => Ok(peak),
        }
    };
    Ok(match order {
        Order::Linear => {
            let second = at(2)?;
            let third = may_lock.then(|| at(HIGHEST)).transpose()?;
            Some(of_linear(nu, peak, &second, third.as_ref()))
        }
        Order::Quadratic if may_lock => of_quadratic(nu, peak, &at(HIGHEST)?),
        Order::Quadratic => of_coarse(peak, &at(HIGHEST)?),
        Order::Quartic | Order::Quintic => None,
        Order::Cubic => of_cubic(nu, peak, &at(2)?, &at(1)?),
    })
}

/// The peak of the same scene on the same mesh at another order.
/// `affordable`: s that preparing may take.
fn peak_at(
    scene: &Scene,
    order: u8,
    affordable: f64,
    options: &PrepareOptions,
) -> Result<Peak, Error> {
    // The part is what is compared.
    let mut scene = scene.with_friction(false);
    scene.part.order = Some(order);
    scene.part.interior_order = None;
    scene.accuracy.budget_us = None;
    scene.drive.retract = false;
    let spec = setup::part_spec(&scene)?;
    let seconds = Forecast::of(&load(&spec)?).seconds;
    if seconds > affordable {
        let why = format!("preparing it would take about {}", duration(seconds));
        return Ok(Peak::Unknown(why));
    }
    let mut unseen = std::io::sink();
    let quiet = Ui::new(&mut unseen, false);
    let progress: Progress = quiet.progress();
    let (tool, _) = setup::tool(&scene)?;
    let prepared = prepare(&spec, options, &quiet)?;
    let (_, driven) = drive::of_scene(&scene, &prepared, tool, &progress)?;
    let track = super::track::Track::of_drive(&scene, &driven.recording);
    Ok(Peak::Of(track.peak_force))
}

/// Quadratic elements in an ordinary material, where they are few: nothing is told of what is not computed.
fn of_coarse(peak: f64, third: &Peak) -> Option<Warning> {
    let third = third.newtons()?;
    let ratio = peak / third;
    if (ratio - 1.0).abs() <= TOLERANCE_COARSE {
        return None;
    }
    Some(warning(
        "coarse",
        ratio - 1.0,
        format!(
            "the mesh is coarse for what it bends: the peak is {} N, the same mesh gives {} N at order 3, {:.0} % apart; \
             write order = 3 under [accuracy], or make the mesh finer",
            short(peak),
            short(third),
            100.0 * (ratio - 1.0).abs(),
        ),
    ))
}

fn nearly_incompressible(nu: f64) -> String {
    format!("poisson_ratio {nu} is nearly incompressible")
}

/// Linear elements are always told of.
fn of_linear(nu: f64, own: f64, second: &Peak, third: Option<&Peak>) -> Warning {
    let locks = third.map(|_| format!(", and {}", nearly_incompressible(nu)));
    let what = format!(
        "the elements are linear, which are too stiff in bending{}",
        locks.unwrap_or_default()
    );
    let best = third.and_then(Peak::newtons).map(|peak| (HIGHEST, peak));
    let best = best.or(second.newtons().map(|peak| (2, peak)));
    let Some((order, better)) = best else {
        let why = match second {
            Peak::Unknown(why) => why.clone(),
            Peak::Of(_) => "there nothing resists".to_owned(),
        };
        return Warning {
            id: "linear-elements",
            text: format!(
                "{what}: peaks several times too high are usual on coarse meshes; what order 2 gives was not computed \
                 ({why}); write order = 2 under [accuracy]"
            ),
            number: None,
        };
    };
    let between = match (order, second.newtons()) {
        (HIGHEST, Some(second)) => format!("{} N at order 2 and ", short(second)),
        _ => String::new(),
    };
    let verdict = if (own / better - 1.0).abs() > TOLERANCE {
        format!("{} times as much; write", short(own / better))
    } else {
        format!(
            "{:.0} % apart, so they are fine enough here; for curves better still write",
            100.0 * (own / better - 1.0).abs()
        )
    };
    warning(
        "linear-elements",
        own / better,
        format!(
            "{what}: the peak is {} N, the same mesh gives {between}{} N at order {order}, {verdict} order = {order} \
             under [accuracy]",
            short(own),
            short(better),
        ),
    )
}

fn of_quadratic(nu: f64, own: f64, third: &Peak) -> Option<Warning> {
    let what = nearly_incompressible(nu);
    let Some(better) = third.newtons() else {
        let Peak::Unknown(why) = third else {
            return None;
        };
        return Some(Warning {
            id: "locking",
            text: format!(
                "{what}, and quadratic elements on a coarse mesh may be too stiff then; what order 3 gives was not \
                 computed ({why}); try order = 3 under [accuracy], or a finer mesh"
            ),
            number: None,
        });
    };
    let ratio = own / better;
    ((ratio - 1.0).abs() > TOLERANCE).then(|| {
        warning(
            "locking",
            ratio,
            format!(
                "{what}, and quadratic elements are too stiff then: the peak is {} N, the same mesh gives {} N at order \
                 3, {:.0} % apart; write order = 3 under [accuracy], or make the mesh finer",
                short(own),
                short(better),
                100.0 * (ratio - 1.0).abs(),
            ),
        )
    })
}

/// There is no higher order: what is left is extrapolated from the two below, as a geometric series.
fn of_cubic(nu: f64, own: f64, second: &Peak, first: &Peak) -> Option<Warning> {
    let (second, first) = (second.newtons()?, first.newtons()?);
    let (last, before) = ((second - own).abs(), (first - second).abs());
    let left = if before > last {
        last * last / (before - last)
    } else {
        last
    };
    (left > TOLERANCE_LEFT * own).then(|| {
        warning(
            "locking",
            left / own,
            format!(
                "{}, and even cubic elements may be too stiff on this mesh: the peak is {} N at order 1, {} N at order 2, \
                 {} N at order 3, so about {:.0} % may be left; make the mesh finer",
                nearly_incompressible(nu),
                short(first),
                short(second),
                short(own),
                100.0 * left / own,
            ),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_elements_are_always_told_of_with_what_is_known() {
        let bad = of_linear(0.35, 38.8, &Peak::Of(8.44), None);
        assert!((bad.number.unwrap() - 4.6).abs() < 0.01);
        assert!(
            bad.text.contains("8.44 N at order 2, 4.60 times as much"),
            "{}",
            bad.text
        );
        let good = of_linear(0.35, 8.6, &Peak::Of(8.44), None);
        assert!(
            good.text
                .contains("2 % apart, so they are fine enough here"),
            "{}",
            good.text
        );
        let unknown = of_linear(0.35, 8.6, &Peak::Unknown("too long".into()), None);
        assert!(unknown.number.is_none() && unknown.text.contains("(too long)"));
        let locked = of_linear(0.499, 130.0, &Peak::Of(16.2), Some(&Peak::Of(8.4)));
        assert!(
            locked
                .text
                .contains("16.2 N at order 2 and 8.40 N at order 3"),
            "{}",
            locked.text
        );
    }

    #[test]
    fn quadratic_elements_are_told_of_where_a_higher_order_gives_less() {
        assert_eq!(of_quadratic(0.46, 8.8, &Peak::Of(8.44)), None);
        let locked = of_quadratic(0.49, 10.3, &Peak::Of(8.4)).unwrap();
        assert!(locked.text.contains("23 % apart"), "{}", locked.text);
        assert!(of_quadratic(0.49, 10.3, &Peak::Unknown("x".into())).is_some());
    }

    #[test]
    fn cubic_elements_are_judged_by_the_two_orders_below() {
        // The clip at nu 0.499 on its mesh: what is left is 9 % at most.
        assert_eq!(
            of_cubic(0.499, 8.43, &Peak::Of(16.2), &Peak::Of(102.0)),
            None
        );
        assert!(of_cubic(0.499, 8.43, &Peak::Of(16.2), &Peak::Of(40.0)).is_some());
        assert_eq!(
            of_cubic(0.499, 8.43, &Peak::Unknown("x".into()), &Peak::Of(40.0)),
            None
        );
    }
}
