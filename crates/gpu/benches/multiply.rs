//! Bytes over time of the displacement multiply on the processor against the memory bandwidth of the machine.
//!
//! Measures: `multiply_into` with columns that change from call to call, so that each is read from memory and not from
//! the cache where the matrix is larger than that; on one thread and on all; and `multiply_batch_into`. Between the
//! calls one core reads as many bytes (sums over two halves), others in each call, of a vector as large as the matrix;
//! call by call, because other programs take their share of the memory too. The bandwidth is the larger of that and of
//! copying the whole vector (bytes read and written). Medians.
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
    let timed = |k| {
        let begun = Instant::now();
        call(k);
        begun.elapsed().as_secs_f64()
    };
    median((0..CALLS).map(timed).collect())
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

/// A vector as large as the matrix, of which as much is read as a product reads.
struct Beside {
    arch: pulp::Arch,
    numbers: Vec<f64>,
    copied: Vec<f64>,
}

impl Beside {
    fn new(bytes: usize) -> Self {
        Self {
            arch: pulp::Arch::new(),
            numbers: vec![1.0; bytes / 8],
            copied: vec![1.0; bytes / 8],
        }
    }

    /// Where the numbers of the `call`-th call are: others in each, until all have had their turn.
    fn range(&self, call: usize, bytes: usize) -> std::ops::Range<usize> {
        let n = bytes / 8;
        let turn = call % (self.numbers.len() / n);
        turn * n..(turn + 1) * n
    }

    /// Seconds of reading so many bytes.
    fn read(&self, call: usize, bytes: usize) -> f64 {
        let numbers = &self.numbers[self.range(call, bytes)];
        let begun = Instant::now();
        black_box(self.arch.dispatch(Sum(black_box(numbers))));
        begun.elapsed().as_secs_f64()
    }

    /// Bytes read and written in a second by copying all of it.
    fn copy(&mut self) -> f64 {
        let seconds = median_seconds(|_| {
            self.copied.copy_from_slice(black_box(&self.numbers));
            black_box(&self.copied);
        });
        2.0 * size_of_val(self.numbers.as_slice()) as f64 / seconds
    }
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
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

/// Seconds of a product, and of reading as many bytes.
fn seconds_beside(
    multiply: &mut dyn ComplianceMultiply,
    contacts: usize,
    bytes: usize,
    beside: &Beside,
) -> (f64, f64) {
    let forces = vec![1.0; 3 * contacts];
    let mut u = vec![0.0; multiply.layout().displacement_len()];
    let mut times = [const { Vec::new() }; 2];
    for call in 0..CALLS + 2 {
        let columns = columns_of(call, contacts, multiply.layout().n_candidates());
        let begun = Instant::now();
        multiply.multiply_into(&columns, &forces, &mut u).unwrap();
        black_box(&u);
        let product = begun.elapsed().as_secs_f64();
        let of_call = [product, beside.read(call, bytes)];
        if call >= 2 {
            for (times, time) in times.iter_mut().zip(of_call) {
                times.push(time);
            }
        }
    }
    let [product, read] = times.map(median);
    (product, read)
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
        "Measured on {}, {n_threads} threads. *bandwidth*: one core that reads as many bytes, others in \
         each call, of a vector as large as the matrix, or copies all of it (read and written), whichever is more. *share*: of it, with one thread.\n\n\
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
            let mut beside = Beside::new(size);
            let copy = 1e-9 * beside.copy();
            let matrix = format!("{:.0} MB", 1e-6 * size as f64);
            for contacts in [5, 15, 62, 250, 500] {
                if contacts > n_candidates {
                    continue;
                }
                let bytes = size / n_candidates * contacts;
                let gigabytes = 1e-9 * bytes as f64;
                let (time, read) = seconds_beside(&mut *one, contacts, bytes, &beside);
                let (reached, most) = (gigabytes / time, copy.max(gigabytes / read));
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
