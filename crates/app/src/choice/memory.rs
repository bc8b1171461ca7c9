//! What was measured before: a small file for each part and adapter, in the folder of prepared parts.

use std::path::{Path, PathBuf};
use std::{fs, io};

use gpu::{Compared, Layout, Scalar, Storage};
use serde::{Deserialize, Serialize};

/// Of the file and of how is measured. Another number: what was measured before is forgotten.
const FORMAT: u32 = 1;

/// Bytes of a file that is read: ten times one of ours.
const MOST_BYTES: u64 = 1 << 14;

/// All that the times depend on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Key {
    format: u32,
    adapter: String,
    processor: String,
    rows: usize,
    candidates: usize,
    processor_bits: u32,
    gpu_bits: u32,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Kept {
    key: Key,
    n_contacts: usize,
    processor_s: f64,
    gpu_s: f64,
    difference: f64,
}

/// A file and what must be in it.
#[derive(Debug)]
pub(super) struct Memory {
    file: PathBuf,
    key: Key,
}

impl Memory {
    /// `adapter` and `processor`: by name. `numbers`: kept by the processor and by the adapter.
    pub(super) fn new(
        folder: &Path,
        adapter: String,
        processor: String,
        layout: Layout,
        numbers: (Scalar, Storage),
    ) -> Self {
        let key = Key {
            format: FORMAT,
            adapter,
            processor,
            rows: layout.n_rows(),
            candidates: layout.n_candidates(),
            processor_bits: match numbers.0 {
                Scalar::F64 => 64,
                Scalar::F32 => 32,
            },
            gpu_bits: 8 * numbers.1.bytes() as u32,
        };
        let hash = blake3::hash(format!("{key:?}").as_bytes()).to_hex();
        let file = folder.join(format!("multiply-{}.json", &hash[..16]));
        Self { file, key }
    }

    /// What was measured; nothing if there is no such file, or it is not one of ours.
    pub(super) fn recall(&self) -> Option<Compared> {
        let length = fs::metadata(&self.file).ok()?.len();
        if length > MOST_BYTES {
            return None;
        }
        let kept: Kept = serde_json::from_slice(&fs::read(&self.file).ok()?).ok()?;
        let is_time = |s: f64| s.is_finite() && s > 0.0;
        let is_ours = kept.key == self.key && is_time(kept.processor_s) && is_time(kept.gpu_s);
        is_ours.then_some(Compared {
            n_contacts: kept.n_contacts,
            processor_s: kept.processor_s,
            gpu_s: kept.gpu_s,
            difference: kept.difference,
        })
    }

    /// Writes it beside its place and renames it. Where that cannot be, it is measured again next time.
    pub(super) fn keep(&self, compared: &Compared) {
        let kept = Kept {
            key: self.key.clone(),
            n_contacts: compared.n_contacts,
            processor_s: compared.processor_s,
            gpu_s: compared.gpu_s,
            difference: compared.difference,
        };
        let _ = serde_json::to_vec_pretty(&kept)
            .map_err(io::Error::from)
            .and_then(|text| {
                if let Some(folder) = self.file.parent() {
                    fs::create_dir_all(folder)?;
                }
                crate::leftovers::write_beside(&self.file, &text)
            });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn memory(folder: &Path, adapter: &str, rows: usize, storage: Storage) -> Memory {
        Memory::new(
            folder,
            adapter.to_owned(),
            "a processor".to_owned(),
            Layout::new(rows, 3).unwrap(),
            (Scalar::F64, storage),
        )
    }

    const COMPARED: Compared = Compared {
        n_contacts: 16,
        processor_s: 3e-5,
        gpu_s: 7e-4,
        difference: 1e-7,
    };

    #[test]
    fn what_was_kept_is_recalled_and_only_for_what_it_was_measured_on() {
        let folder = tempfile::tempdir().unwrap();
        let of = |adapter, rows, storage| memory(folder.path(), adapter, rows, storage);
        let here = of("an adapter", 10, Storage::F32);
        assert_eq!(here.recall(), None);
        here.keep(&COMPARED);
        assert_eq!(here.recall(), Some(COMPARED));
        for other in [
            of("another adapter", 10, Storage::F32),
            of("an adapter", 11, Storage::F32),
            of("an adapter", 10, Storage::F16),
        ] {
            assert_eq!(other.recall(), None);
            // Nor is it taken from a file with another's name.
            fs::copy(&here.file, &other.file).unwrap();
            assert_eq!(other.recall(), None);
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 4);
    }

    #[test]
    fn a_damaged_or_foreign_file_is_nothing_and_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let here = memory(folder.path(), "an adapter", 10, Storage::F32);
        here.keep(&COMPARED);
        let good = fs::read_to_string(&here.file).unwrap();
        let foreign = [
            String::new(),
            "{}".to_owned(),
            "null".to_owned(),
            good[..good.len() / 2].to_owned(),
            good.replace("\"format\": 1", "\"format\": 0"),
            good.replace("\"gpu_s\": 0.0007", "\"gpu_s\": -1"),
            good.replace("\"gpu_s\": 0.0007", "\"gpu_s\": 1e999"),
            good.replace("\"gpu_s\": 0.0007", "\"gpu_s\": null"),
            good.replace("\"n_contacts\": 16", "\"n_contacts\": -16"),
            format!("{good}{good}"),
            " ".repeat(MOST_BYTES as usize + 1),
        ];
        for text in foreign {
            assert_ne!(text, good);
            fs::write(&here.file, &text).unwrap();
            assert_eq!(here.recall(), None, "{text:.200}");
            here.keep(&COMPARED);
            assert_eq!(here.recall(), Some(COMPARED));
        }
        fs::write(&here.file, [0xff, 0xfe, 0]).unwrap();
        assert_eq!(here.recall(), None);
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_no_error() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "in the way").unwrap();
        let here = memory(&file, "an adapter", 10, Storage::F32);
        here.keep(&COMPARED);
        assert_eq!(here.recall(), None);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
