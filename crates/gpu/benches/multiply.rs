//! Bytes over time of the displacement multiply against the memory bandwidth of the machine.
//!
//! Measures: `multiply_into` with columns that change from call to call, so that each is read from memory and not from
//! the cache where the matrix is larger than that; beside it the time in which one core reads as many bytes
//! (eight sums over a vector of the matrix' size). Medians.
//! `cargo bench -p snapin-gpu --bench multiply` runs it on one core (a minute) and prints the table; with
//! `SNAPIN_WRITE_DOCS=1` it writes it into `docs/performance.md`.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and ends where it cannot go on"
)]

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use gpu::{Layout, Scalar, on_cpu};

const CALLS: usize = 41;

fn median_seconds(mut call: impl FnMut(usize)) -> f64 {
    call(0);
    let mut times: Vec<f64> = (0..CALLS)
        .map(|k| {
            let begun = Instant::now();
            call(k);
            begun.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[CALLS / 2]
}

/// GB/s of reading a vector of `bytes` with one core.
fn read_bandwidth(bytes: usize) -> f64 {
    let numbers = vec![1.0_f64; bytes / 8];
    let seconds = median_seconds(|_| {
        let mut sums = [0.0; 8];
        for eight in numbers.chunks_exact(8) {
            for (sum, x) in sums.iter_mut().zip(eight) {
                *sum += x;
            }
        }
        black_box(sums);
    });
    1e-9 * bytes as f64 / seconds
}

fn main() {
    let mut text = String::from(
        "One core. *read*: bandwidth of summing a vector as large as the matrix.\n\n\
         | rows | candidates | matrix | numbers | contacts | µs | GB/s | read, GB/s | share |\n\
         | --: | --: | --: | :-- | --: | --: | --: | --: | --: |\n",
    );
    for (n_rows, n_candidates) in [(300, 150), (1000, 500), (3000, 1500), (6000, 1500)] {
        let layout = Layout::new(n_rows, n_candidates).unwrap();
        let blocks: Vec<f64> = (0..layout.n_scalars())
            .map(|k| 1e-6 + 1e-9 * ((k * 7919) % 1013) as f64)
            .collect();
        for (name, scalar) in [("f32", Scalar::F32), ("f64", Scalar::F64)] {
            let mut multiply = on_cpu(layout, &[&blocks], scalar).unwrap();
            let size = multiply.bytes() as usize;
            let read = read_bandwidth(size);
            let mut u = vec![0.0; layout.displacement_len()];
            for contacts in [5, 15, 62, 250, 500] {
                if contacts > n_candidates {
                    continue;
                }
                let forces = vec![1.0; 3 * contacts];
                let seconds = median_seconds(|call| {
                    // Other columns in every call: the last ones are used again after the whole matrix.
                    let columns: Vec<u32> = (0..contacts)
                        .map(|k| ((call * contacts + k) % n_candidates) as u32)
                        .collect();
                    multiply.multiply_into(&columns, &forces, &mut u).unwrap();
                    black_box(&u);
                });
                let bytes = size / n_candidates * contacts;
                let reached = 1e-9 * bytes as f64 / seconds;
                text += &format!(
                    "| {n_rows} | {n_candidates} | {:.0} MB | {name} | {contacts} | {:.1} | {reached:.1} | {read:.1} | {:.0} % |\n",
                    1e-6 * size as f64,
                    1e6 * seconds,
                    100.0 * reached / read,
                );
            }
        }
    }
    println!("{text}");
    if std::env::var_os("SNAPIN_WRITE_DOCS").is_some() {
        let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/performance.md");
        let old = std::fs::read_to_string(&page).unwrap();
        let (begin, end) = ("<!-- multiply: begin -->\n", "<!-- multiply: end -->");
        let (before, rest) = old.split_once(begin).unwrap();
        let (_, after) = rest.split_once(end).unwrap();
        std::fs::write(page, format!("{before}{begin}{text}{end}{after}")).unwrap();
    }
}
