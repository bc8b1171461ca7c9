//! Bytes over time of the displacement multiply on the processor against the memory bandwidth of the machine.
//!
//! Measures: `multiply_into` with columns that change from call to call, so that each is read from memory and not from
//! the cache where the matrix is larger than that; on one thread and on all; and `multiply_batch_into`. Beside it the
//! bandwidth of one core on as many bytes: the larger of reading (sums over two halves of a vector) and copying
//! (bytes read and written). Medians.
//! `cargo bench -p snapin-gpu --bench multiply` runs it (a minute) and prints the tables; with `SNAPIN_WRITE_DOCS=1` it
//! writes them into `docs/performance.md`.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and ends where it cannot go on"
)]

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use gpu::{ComplianceMultiply, Layout, Scalar, on_cpu, on_cpu_with_threads};

/// Calls of which the median is taken; two more come before them.
const CALLS: usize = 31;

fn median_seconds(mut call: impl FnMut(usize)) -> f64 {
    call(CALLS);
    call(CALLS + 1);
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

/// Sum of a vector, as fast as one core reads it.
struct Sum<'a>(&'a [f64]);

impl pulp::WithSimd for Sum<'_> {
    type Output = f64;

    // Two streams of 8 sums: of 1, 2, 4 streams of 8 to 64 the fastest on AMD Zen 5, with asking ahead or without.
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> f64 {
        let (left, right) = self.0.split_at(self.0.len() / 2);
        let mut sums = [0.0; 16];
        for (left, right) in left.chunks_exact(8).zip(right.chunks_exact(8)) {
            for k in 0..8 {
                sums[k] += left[k];
                sums[k + 8] += right[k];
            }
        }
        sums.iter().sum()
    }
}

/// GB/s of reading a vector of `bytes`, and of copying half of it to another half, with one core.
fn bandwidth(bytes: usize) -> (f64, f64) {
    let arch = pulp::Arch::new();
    let mut numbers = vec![1.0_f64; bytes / 8];
    let read = median_seconds(|_| {
        black_box(arch.dispatch(Sum(black_box(&numbers))));
    });
    let (from, to) = numbers.split_at_mut(bytes / 16);
    let copy = median_seconds(|_| {
        to[..from.len()].copy_from_slice(from);
        black_box(&to);
    });
    (1e-9 * bytes as f64 / read, 1e-9 * bytes as f64 / copy)
}

/// Columns of the `call`-th call: others every time, so that they come again only after the whole matrix.
fn columns_of(call: usize, contacts: usize, n_candidates: usize) -> Vec<u32> {
    (0..contacts)
        .map(|k| ((call * contacts + k) % n_candidates) as u32)
        .collect()
}

fn seconds(multiply: &mut dyn ComplianceMultiply, contacts: usize) -> f64 {
    let forces = vec![1.0; 3 * contacts];
    let mut u = vec![0.0; multiply.layout().displacement_len()];
    median_seconds(|call| {
        let columns = columns_of(call, contacts, multiply.layout().n_candidates());
        multiply.multiply_into(&columns, &forces, &mut u).unwrap();
        black_box(&u);
    })
}

fn batch_seconds(multiply: &mut dyn ComplianceMultiply, contacts: usize, n_sets: usize) -> f64 {
    let forces = vec![1.0; 3 * contacts * n_sets];
    let mut u = vec![0.0; multiply.layout().displacement_len() * n_sets];
    median_seconds(|call| {
        let columns = columns_of(call, contacts, multiply.layout().n_candidates());
        multiply
            .multiply_batch_into(n_sets, &columns, &forces, &mut u)
            .unwrap();
        black_box(&u);
    })
}

fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info
        .lines()
        .find_map(|line| line.strip_prefix("model name"));
    name.map_or("unknown", |name| name.trim_matches([' ', '\t', ':']))
        .to_owned()
}

fn main() {
    let n_threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut text = format!(
        "Measured on {}, {n_threads} threads. *bandwidth*: what one core reads (or copies, read and written, where that \
         is more) of a vector as large as the matrix. *share*: of it, with one thread.\n\n\
         | rows | candidates | matrix | numbers | contacts | µs | GB/s | bandwidth, GB/s | **share** | {n_threads} threads, GB/s |\n\
         | --: | --: | --: | :-- | --: | --: | --: | --: | --: | --: |\n",
        processor()
    );
    let mut batches = String::from(
        "\nSeveral sets of forces at the same 62 candidates, one thread: µs for all sets, and how many times as fast as \
         single calls.\n\n\
         | matrix | numbers | 1 set | 4 sets | 16 sets |\n\
         | --: | :-- | --: | --: | --: |\n",
    );
    for (n_rows, n_candidates) in [
        (200, 140),
        (300, 270),
        (1000, 500),
        (3000, 1500),
        (6000, 1500),
    ] {
        let layout = Layout::new(n_rows, n_candidates).unwrap();
        let blocks: Vec<f64> = (0..layout.n_scalars())
            .map(|k| 1e-6 + 1e-9 * ((k * 7919) % 1013) as f64)
            .collect();
        for (name, scalar) in [("f32", Scalar::F32), ("f64", Scalar::F64)] {
            let mut one = on_cpu(layout, &[&blocks], scalar).unwrap();
            let mut all = on_cpu_with_threads(layout, &[&blocks], scalar, n_threads).unwrap();
            let size = one.bytes() as usize;
            let (read, copy) = bandwidth(size);
            let most = read.max(copy);
            let matrix = format!("{:.0} MB", 1e-6 * size as f64);
            for contacts in [5, 15, 62, 250, 500] {
                if contacts > n_candidates {
                    continue;
                }
                let gigabytes = 1e-9 * (size / n_candidates * contacts) as f64;
                let time = seconds(&mut *one, contacts);
                let reached = gigabytes / time;
                text += &format!(
                    "| {n_rows} | {n_candidates} | {matrix} | {name} | {contacts} | {:.1} | {reached:.1} | {most:.1} | **{:.0} %** | {:.1} |\n",
                    1e6 * time,
                    100.0 * reached / most,
                    gigabytes / seconds(&mut *all, contacts),
                );
            }
            let single = seconds(&mut *one, 62);
            batches += &format!("| {matrix} | {name} |");
            for n_sets in [1, 4, 16] {
                let time = batch_seconds(&mut *one, 62, n_sets);
                batches += &format!(
                    " {:.0} (x {:.1}) |",
                    1e6 * time,
                    single * n_sets as f64 / time
                );
            }
            batches += "\n";
        }
    }
    text += &batches;
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
