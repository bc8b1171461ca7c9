//! The walls that a device can render (Z-width): stiffness over virtual damping.

use std::error::Error;

use device::stability::{ZPoint, ZWidth};
use plotters::prelude::*;

use super::plot::{
    BLUE, FINE, Format, GREEN, GREY, GRID, INK, Key, ORANGE, PURPLE, VERMILLION, draw, empty,
    short, stroke, words,
};

/// The region of stable walls, with the bounds that are used to estimate it. `recommended`: largest stiffness that is
/// recommended for the device, N/m.
///
/// # Errors
/// What the plot library says.
pub fn z_width(
    name: &str,
    width: &ZWidth,
    recommended: Option<f64>,
) -> Result<String, Box<dyn Error>> {
    let mut keys = vec![
        Key::new(&format!("{name}: stable below"), BLUE, 3),
        Key::new("estimate (b + B)/(T/2 + delay)", ORANGE, 2),
    ];
    let has_passive = width.points.iter().any(|p| p.passive.is_some());
    if has_passive {
        keys.push(Key::new("passive below 2(b - B)/T", GREEN, 2));
    }
    if width.friction_bound.is_some() {
        keys.push(Key::new("encoder's steps buzz above", PURPLE, 2));
    }
    if recommended.is_some() {
        keys.push(Key::new("largest recommended", VERMILLION, 2));
    }
    let most_damping = width.points.iter().map(|p| p.virtual_damping);
    let x1 = 1.02 * most_damping.fold(0.0, f64::max);
    let highest = |p: &ZPoint| p.critical.max(p.rule_of_thumb.min(1.5 * p.critical));
    let lines = width.friction_bound.into_iter();
    let lines = lines.chain(recommended);
    let top = width.points.iter().map(highest).fold(0.0, f64::max);
    // A line far above the region would press it flat.
    let y1 = 1.1 * lines.filter(|y| *y < 3.0 * top).fold(top, f64::max);
    draw(Format::Wide, &keys, |root| {
        if !(x1 > 0.0 && y1 > 0.0) {
            return empty(root);
        }
        let mut chart = ChartBuilder::on(root)
            .margin(12 * FINE)
            .margin_right(32 * FINE)
            .x_label_area_size(50 * FINE)
            .y_label_area_size(90 * FINE)
            .build_cartesian_2d(0.0..x1, 0.0..y1)?;
        chart
            .configure_mesh()
            .x_desc("damping of the wall, N s/m")
            .y_desc("stiffness of the wall, N/m")
            .label_style(words(17, INK))
            .axis_desc_style(words(18, INK))
            .axis_style(GREY.stroke_width(FINE as u32))
            .bold_line_style(GRID.stroke_width(FINE as u32))
            .light_line_style(TRANSPARENT)
            .set_all_tick_mark_size(5 * FINE)
            .x_label_formatter(&|x| short(*x))
            .y_label_formatter(&|y| short(*y))
            .draw()?;
        let of = |value: &dyn Fn(&ZPoint) -> Option<f64>| -> Vec<(f64, f64)> {
            let points = width.points.iter();
            points
                .filter_map(|p| value(p).map(|y| (p.virtual_damping, y)))
                .take_while(|(_, y)| *y <= y1)
                .collect()
        };
        let critical = of(&|p| Some(p.critical));
        let last = critical.last().map_or(0.0, |p| p.0);
        let below = critical.iter().copied().chain([(last, 0.0), (0.0, 0.0)]);
        chart.draw_series([Polygon::new(below.collect::<Vec<_>>(), BLUE.mix(0.12))])?;
        chart.draw_series(LineSeries::new(critical, stroke(BLUE, 3)))?;
        chart.draw_series(LineSeries::new(
            of(&|p| Some(p.rule_of_thumb)),
            stroke(ORANGE, 2),
        ))?;
        chart.draw_series(LineSeries::new(of(&|p| p.passive), stroke(GREEN, 2)))?;
        let across = [(width.friction_bound, PURPLE), (recommended, VERMILLION)];
        for (y, colour) in across {
            if let Some(y) = y.filter(|y| *y <= y1) {
                chart.draw_series(LineSeries::new([(0.0, y), (x1, y)], stroke(colour, 2)))?;
            }
        }
        Ok(())
    })
}
