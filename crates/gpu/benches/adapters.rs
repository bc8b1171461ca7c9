//! The multiply on each graphics adapter against its memory bandwidth and against the processor.
//!
//! Measures, by size of the compliance and number of contacts: a product on the device itself (repeated in one
//! submission) in bytes of compliance over time, beside a kernel that copies a buffer as large as the compliance; the
//! round trip from the call to the numbers; the same product on one core of the processor; and from which size on the
//! adapter is faster. Medians. Where the columns of a product fit the adapter's cache, repeating it reads them there.
//!
//! `benches/gpu.sh` runs it and prints the tables; with `SNAPIN_WRITE_DOCS=1` it writes them into
//! `docs/performance.md`. It takes some minutes on a software adapter.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and ends where it cannot go on"
)]

use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

use gpu::{
    Adapter, Adapters, ComplianceMultiply, Error, Gpu, GpuSettings, Layout, Scalar, Storage,
    copy_bandwidth, on_cpu,
};

/// Rows and candidates; 1 MB to 1.6 GB in 32 bits. A software adapter gets those of at most 170 MB, which is beyond
/// what it binds at once.
const SIZES: [(usize, usize); 6] = [
    (200, 140),
    (1000, 500),
    (3000, 1500),
    (6000, 1500),
    (20_000, 1000),
    (30_000, 1500),
];
const MOST_BYTES_OF_SOFTWARE: usize = 170_000_000;

const CONTACTS: [usize; 5] = [5, 15, 62, 250, 500];
const CONTACTS_OF_SOFTWARE: [usize; 3] = [5, 62, 500];

/// Products that are timed one by one; fewer where one takes long.
const CALLS: usize = 31;
const MOST_SECONDS: f64 = 1.0;

fn median_seconds(mut call: impl FnMut(usize) -> Result<(), Error>) -> Result<f64, Error> {
    let all = Instant::now();
    call(0)?;
    let mut times = Vec::new();
    for k in 0..CALLS {
        let begun = Instant::now();
        call(k)?;
        times.push(begun.elapsed().as_secs_f64());
        if all.elapsed().as_secs_f64() > MOST_SECONDS && times.len() >= 3 {
            break;
        }
    }
    times.sort_by(f64::total_cmp);
    Ok(times[times.len() / 2])
}

/// Other columns in each call: the last ones come again after the whole matrix.
fn columns_of(call: usize, contacts: usize, n_candidates: usize) -> Vec<u32> {
    (0..contacts)
        .map(|k| ((call * contacts + k) % n_candidates) as u32)
        .collect()
}

/// One line of the table, s and bytes.
struct Line {
    bytes: f64,
    contacts: usize,
    storage: Storage,
    on_device: f64,
    read: f64,
    copy: f64,
    round_trip: f64,
    processor: f64,
}

fn contacts_of(adapter: &Adapter) -> &'static [usize] {
    if adapter.is_software() {
        &CONTACTS_OF_SOFTWARE
    } else {
        &CONTACTS
    }
}

fn measure(adapter: &Adapter, lines: &mut Vec<Line>) -> Result<(), Error> {
    for (n_rows, n_candidates) in SIZES {
        let layout = Layout::new(n_rows, n_candidates)?;
        if adapter.is_software() && 4 * layout.n_scalars() > MOST_BYTES_OF_SOFTWARE {
            continue;
        }
        let blocks: Vec<f64> = (0..layout.n_scalars())
            .map(|k| 1e-6 + 1e-9 * ((k * 7919) % 1013) as f64)
            .collect();
        let mut processor = on_cpu(layout, &[&blocks], Scalar::F32)?;
        let mut u = vec![0.0; layout.displacement_len()];
        for storage in [Storage::F32, Storage::F16] {
            let settings = GpuSettings {
                storage,
                ..GpuSettings::default()
            };
            let mut gpu = Gpu::new(adapter, layout, &[&blocks], settings)?;
            let bytes = gpu.bytes() as f64;
            let copy = copy_bandwidth(adapter, bytes as u64)?;
            for contacts in contacts_of(adapter).iter().copied() {
                if contacts > n_candidates {
                    continue;
                }
                let forces = vec![1.0; 3 * contacts];
                let columns = |call| columns_of(call, contacts, n_candidates);
                // As many in one submission as make submitting a small part, and no more than a second.
                let once = median_seconds(|k| gpu.repeat_on_device(1, &columns(k), &forces))?;
                let times = (0.1 / once).clamp(1.0, 100.0) as u32;
                let repeated =
                    median_seconds(|k| gpu.repeat_on_device(times, &columns(k), &forces))?;
                lines.push(Line {
                    bytes,
                    contacts,
                    storage,
                    on_device: repeated / f64::from(times),
                    read: bytes / n_candidates as f64 * contacts as f64,
                    copy,
                    round_trip: median_seconds(|k| {
                        gpu.multiply_into(&columns(k), &forces, &mut u)
                    })?,
                    processor: median_seconds(|k| {
                        processor.multiply_into(&columns(k), &forces, &mut u)
                    })?,
                });
            }
        }
    }
    Ok(())
}

/// From which size on the round trip is faster than the processor, for each number of contacts.
fn break_even(lines: &[Line], contacts: &[usize]) -> String {
    let mut text = String::new();
    for contacts in contacts.iter().copied() {
        let mut of_count: Vec<&Line> = lines
            .iter()
            .filter(|line| line.contacts == contacts && line.storage == Storage::F32)
            .collect();
        of_count.sort_by(|a, b| a.bytes.total_cmp(&b.bytes));
        let slower = of_count
            .iter()
            .rposition(|line| line.round_trip > line.processor);
        let from = match slower.map_or(of_count.first(), |last| of_count.get(last + 1)) {
            Some(line) => format!("from {:.0} MB on", 1e-6 * line.bytes),
            None => "at no measured size".to_owned(),
        };
        let _ = writeln!(text, "- {contacts} contacts: {from}");
    }
    text
}

fn table(adapter: &Adapter) -> String {
    let kind = if adapter.is_software() {
        ", a software adapter: the processor itself, so these figures say nothing of a GPU"
    } else {
        ""
    };
    let mib = |bytes: u64| bytes >> 20;
    let mut text = format!(
        "**{}**{kind}. Binding limit {} MiB, buffer limit {} MiB.\n\n",
        adapter.key(),
        mib(adapter.binding_limit()),
        mib(adapter.buffer_limit()),
    );
    let mut lines = Vec::new();
    let measured = measure(adapter, &mut lines);
    text += "| matrix | numbers | contacts | on the device, µs | GB/s | copy, GB/s | share | round trip, µs | processor, µs |\n\
             | --: | :-- | --: | --: | --: | --: | --: | --: | --: |\n";
    for line in &lines {
        let reached = 1e-9 * line.read / line.on_device;
        let _ = writeln!(
            text,
            "| {:.1} MB | {} | {} | {:.1} | {reached:.1} | {:.1} | {:.0} % | {:.1} | {:.1} |",
            1e-6 * line.bytes,
            match line.storage {
                Storage::F32 => "f32",
                Storage::F16 => "f16",
            },
            line.contacts,
            1e6 * line.on_device,
            1e-9 * line.copy,
            1e11 * reached / line.copy,
            1e6 * line.round_trip,
            1e6 * line.processor,
        );
    }
    if let Err(error) = measured {
        let _ = writeln!(text, "\nEnded early: {error}.");
    }
    let even = break_even(&lines, contacts_of(adapter));
    let _ = write!(
        text,
        "\nThe round trip is faster than one core (f32):\n\n{even}\n"
    );
    text
}

fn main() {
    let adapters = Adapters::find();
    let mut text = format!("Processor: {}.\n\n", processor_name());
    for adapter in &adapters.list {
        text += &table(adapter);
    }
    if adapters.list.is_empty() {
        let _ = writeln!(text, "No adapter: {adapters}.");
    }
    println!("{text}");
    if std::env::var_os("SNAPIN_WRITE_DOCS").is_some() {
        let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/performance.md");
        let old = std::fs::read_to_string(&page).unwrap();
        let (begin, end) = ("<!-- adapters: begin -->\n", "<!-- adapters: end -->");
        let (before, rest) = old.split_once(begin).unwrap();
        let (_, after) = rest.split_once(end).unwrap();
        std::fs::write(page, format!("{before}{begin}{text}{end}{after}")).unwrap();
    }
}

fn processor_name() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let name = name.map_or("unknown", |(_, name)| name.trim());
    format!("{name}, {threads} threads")
}
