//! Tables for other programs: comma-separated, one header line, shortest exact numbers.

use std::fmt::Write as _;

use super::data::{DriveRow, STAGE_NAMES, StepRow};

/// Header of `force-travel.csv`; other programs rely on it.
pub const FORCE_TRAVEL_HEADER: &str =
    "step,time_s,travel_m,force_N,force_x_N,force_y_N,force_z_N,contacts,pivots,certificate";

/// `force-travel.csv`: one line per step, nothing that depends on the machine's speed.
///
/// `force_N`: at the hand along the approach direction, positive when it resists; the components
/// are the force on the handle in the part's frame.
pub fn force_travel(rows: &[StepRow]) -> String {
    let mut text = String::with_capacity(64 + rows.len() * 160);
    text.push_str(FORCE_TRAVEL_HEADER);
    text.push('\n');
    for row in rows {
        let force = row.force_on_handle;
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{},{},{},{}",
            row.step,
            number(row.time_s),
            number(row.travel_m),
            number(row.force_n),
            number(force.x),
            number(force.y),
            number(force.z),
            row.contacts,
            row.pivots,
            number(row.certificate),
        );
    }
    text
}

/// Header of `curve.csv`; other programs rely on it.
pub const CURVE_HEADER: &str =
    "phase,travel_m,force_N,sideways_m,turn_rad,contacts,converged,sticking,dissipated_J,stored_J";

/// `curve.csv`: one line per place of the driven body, in the order in which they were gone to.
///
/// `force_N`: along the direction, positive when the part resists the way in.
pub fn curve(rows: &[DriveRow]) -> String {
    let mut text = String::with_capacity(64 + rows.len() * 80);
    text.push_str(CURVE_HEADER);
    text.push('\n');
    for row in rows {
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{},{},{},{}",
            row.phase.name(),
            number(row.travel_m),
            number(row.force_n),
            number(row.sideways_m),
            number(row.turn_rad),
            row.contacts,
            row.is_converged,
            row.sticking,
            number(row.dissipated_j),
            number(row.stored_j),
        );
    }
    text
}

/// `timing.csv`: wall-clock time of every stage of every step, µs. `multiply_us` is empty in the
/// steps that did not compute the whole surface.
pub fn timing(rows: &[StepRow]) -> String {
    let mut text = String::with_capacity(64 + rows.len() * 64);
    text.push_str("step");
    for name in STAGE_NAMES {
        let _ = write!(text, ",{name}_us");
    }
    text.push_str(",total_us,multiply_us\n");
    for row in rows {
        let _ = write!(text, "{}", row.step);
        for ns in row.stage_ns {
            let _ = write!(text, ",{}", number(microseconds(ns)));
        }
        let _ = write!(text, ",{},", number(microseconds(row.total_ns)));
        if let Some(ns) = row.multiply_ns {
            text.push_str(&number(microseconds(ns)));
        }
        text.push('\n');
    }
    text
}

/// Shortest text that reads back as the same number; exponents where they are shorter to read.
pub fn number(value: f64) -> String {
    // Negative zero is a zero that a reader would wonder about.
    let value = if value == 0.0 { 0.0 } else { value };
    let size = value.abs();
    if value.is_finite() && size != 0.0 && !(1e-4..1e16).contains(&size) {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}

fn microseconds(ns: u64) -> f64 {
    ns as f64 / 1e3
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panic")]
mod tests {
    use super::super::sample;
    use super::*;

    #[test]
    fn numbers_read_back_exactly() {
        for value in [
            0.0,
            1.0,
            -0.1,
            1.0 / 3.0,
            1e-12,
            6.02e23,
            f64::MIN_POSITIVE,
            123_456.789,
        ] {
            assert_eq!(number(value).parse::<f64>().unwrap(), value);
        }
        assert_eq!(number(-0.0), "0");
        assert_eq!(number(1e-5), "1e-5");
        assert_eq!(number(0.001), "0.001");
        assert_eq!(number(f64::NAN), "NaN");
    }

    #[test]
    fn force_travel_has_the_agreed_header_and_exact_values() {
        let rows = sample::rows();
        let text = force_travel(&rows);
        let mut lines = text.lines();
        assert_eq!(
            lines.next().unwrap(),
            "step,time_s,travel_m,force_N,force_x_N,force_y_N,force_z_N,contacts,pivots,certificate"
        );
        for (line, row) in lines.by_ref().zip(&rows) {
            let cells: Vec<f64> = line.split(',').map(|c| c.parse().unwrap()).collect();
            assert_eq!(cells.len(), 10);
            assert_eq!(cells[2], row.travel_m);
            assert_eq!(cells[3], row.force_n);
            assert_eq!(cells[9], row.certificate);
        }
        assert_eq!(text.lines().count(), rows.len() + 1);
    }

    #[test]
    fn force_travel_does_not_depend_on_the_clock() {
        let mut rows = sample::rows();
        let before = force_travel(&rows);
        for row in &mut rows {
            row.total_ns += 12_345;
            row.stage_ns[0] += 12_345;
            row.multiply_ns = Some(1);
        }
        assert_eq!(force_travel(&rows), before);
    }

    #[test]
    fn timing_has_a_column_per_stage() {
        let mut rows = sample::rows();
        rows.truncate(1);
        rows[0].stage_ns = [1_500, 2_000, 3, 4, 5];
        rows[0].total_ns = 3_512;
        rows[0].multiply_ns = None;
        assert_eq!(
            timing(&rows),
            "step,proximity_us,planes_us,delassus_us,lcp_us,update_us,total_us,multiply_us\n\
             0,1.5,2,0.003,0.004,0.005,3.512,\n"
        );
    }
}
