//! What preparing a part will take, told before it is begun.

use gpu::Scalar;

use crate::Error;
use crate::machine::Machine;

use super::demand::column_bytes;
use super::{ColumnChoice, LoadedPart};

/// Columns without which a part that fetches them is no use: what a tool may touch at a time.
const FEWEST_COLUMNS: usize = 256;

/// Of the memory that the factor leaves, what columns that are fetched may take.
const SHARE_OF_COLUMNS: f64 = 0.6;

/// Expected memory and time of preparing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Bytes of the whole compliance: 72 per pair of candidate and surface node for what is kept, as much for what is
    /// drawn from, and where the step reads 32 bits 36 per pair of candidates.
    pub compliance_bytes: f64,
    /// Bytes of stiffness and factor.
    pub factor_bytes: f64,
    /// Seconds on one core of a 2020s workstation; a forecast, not a promise.
    pub seconds: f64,
}

impl Forecast {
    /// Forecast for a loaded part.
    ///
    /// Fill of the factor of a solid mesh under a minimum-degree ordering grows like n^1.35 and
    /// its work like n^1.9 (n: free unknowns); the constants were fitted to tetrahedral parts of
    /// 2 000 to 70 000 unknowns prepared with this program; a column touches half the factor or less.
    pub fn of(loaded: &LoadedPart) -> Self {
        let n = 3.0 * loaded.solved_mesh().n_nodes() as f64;
        let columns = 3.0 * loaded.candidates.len() as f64;
        let factor_entries = 5.0 * n.powf(1.35);
        Self {
            compliance_bytes: loaded.candidates.len() as f64
                * (144.0 * loaded.rows.len() as f64
                    + match loaded.spec.contact_scalar {
                        Scalar::F64 => 0.0,
                        Scalar::F32 => 36.0 * loaded.candidates.len() as f64,
                    }),
            factor_bytes: 8.0 * factor_entries + 12.0 * 90.0 * n,
            seconds: 4e-9 * n.powf(1.9) + 6.5e-11 * columns * factor_entries + 4e-6 * n,
        }
    }

    /// The forecast in one line.
    pub fn line(&self, loaded: &LoadedPart) -> String {
        format!(
            "preparing {}: {} nodes{}, {} elements, {} nodes can touch, {} on the surface; expects {} of memory and about {}",
            loaded.spec.mesh_path.display(),
            loaded.mesh.n_nodes(),
            loaded
                .interior
                .as_ref()
                .map_or_else(String::new, |interior| format!(
                    " ({} at order {} inside)",
                    interior.mesh.n_nodes(),
                    interior.mesh.order
                )),
            loaded.mesh.n_elements(),
            loaded.candidates.len(),
            loaded.rows.len(),
            bytes(self.needed()),
            duration(self.seconds),
        )
    }

    /// Whether columns are fetched when the tool comes near, as the part asks or because all do not fit.
    pub(super) fn fetches_columns(&self, loaded: &LoadedPart) -> bool {
        let fits = || self.needed() <= Machine::read().available_memory as f64;
        match loaded.spec.columns {
            ColumnChoice::All => false,
            ColumnChoice::Near => true,
            // What interpolates nodes needs all.
            ColumnChoice::Auto => !fits(),
        }
    }

    /// How many columns may be fetched.
    ///
    /// # Errors
    /// If there is not even memory for the factor and some columns, with what to change.
    pub(super) fn columns_that_fit(&self, loaded: &LoadedPart) -> Result<usize, Error> {
        self.columns_within(loaded, Machine::read().available_memory as f64)
    }

    fn columns_within(&self, loaded: &LoadedPart, available: f64) -> Result<usize, Error> {
        let of_column = column_bytes(loaded.rows.len(), loaded.spec.contact_scalar);
        let for_columns = SHARE_OF_COLUMNS * (available - self.factor_bytes).max(0.0);
        let capacity = ((for_columns / of_column) as usize).min(loaded.candidates.len());
        if capacity >= FEWEST_COLUMNS.min(loaded.candidates.len()) {
            return Ok(capacity);
        }
        Err(Error::Input(format!(
            "{}: fetching columns needs about {} ({} factor, {FEWEST_COLUMNS} columns of {}) and {} are free; coarsen \
             the mesh or use elements of lower order",
            loaded.spec.mesh_path.display(),
            bytes(self.factor_bytes + FEWEST_COLUMNS as f64 * of_column / SHARE_OF_COLUMNS),
            bytes(self.factor_bytes),
            bytes(of_column),
            bytes(available),
        )))
    }

    /// The forecast of a part that fetches columns, in one line.
    pub(super) fn fetched_line(&self, loaded: &LoadedPart, capacity: usize) -> String {
        let of_column = column_bytes(loaded.rows.len(), loaded.spec.contact_scalar);
        format!(
            "preparing {}: {} nodes, {} elements, {} nodes can touch, {} on the surface; the whole compliance would be \
             {}; the factor takes about {}, columns are fetched when the tool comes near, {capacity} at most, {} each",
            loaded.spec.mesh_path.display(),
            loaded.mesh.n_nodes(),
            loaded.mesh.n_elements(),
            loaded.candidates.len(),
            loaded.rows.len(),
            bytes(self.compliance_bytes),
            bytes(self.factor_bytes),
            bytes(of_column),
        )
    }

    fn needed(&self) -> f64 {
        self.compliance_bytes + self.factor_bytes
    }

    /// # Errors
    /// If the part needs more memory than the machine has to give, with what to change.
    pub fn refuse_what_cannot_fit(&self, loaded: &LoadedPart) -> Result<(), Error> {
        self.refuse_beyond(loaded, Machine::read().available_memory as f64)
    }

    fn refuse_beyond(&self, loaded: &LoadedPart, available: f64) -> Result<(), Error> {
        let needed = self.needed();
        if needed <= available {
            return Ok(());
        }
        let mend = if self.compliance_bytes > self.factor_bytes {
            format!(
                "leave accuracy.columns = \"all\" and the p-method out, name a smaller region in part.contact ({} nodes \
                 can touch now) or coarsen the mesh",
                loaded.candidates.len()
            )
        } else {
            "coarsen the mesh or use elements of lower order".to_owned()
        };
        Err(Error::Input(format!(
            "{}: preparing needs about {} ({} compliance, {} factor) and {} are free; {mend}",
            loaded.spec.mesh_path.display(),
            bytes(needed),
            bytes(self.compliance_bytes),
            bytes(self.factor_bytes),
            bytes(available),
        )))
    }
}

/// Bytes in words.
pub fn bytes(n: f64) -> String {
    const UNITS: [&str; 5] = ["B", "kB", "MB", "GB", "TB"];
    let mut value = n;
    let mut unit = 0;
    while value >= 1000.0 && unit < UNITS.len() - 1 {
        value /= 1000.0;
        unit += 1;
    }
    if unit == 0 {
        format!("{value:.0} B")
    } else {
        format!("{value:.1} {}", UNITS[unit])
    }
}

/// Seconds in words.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => format!("{:.0} ms", (1000.0 * s).max(1.0)),
        s if s < 120.0 => format!("{s:.1} s"),
        s => format!("{:.0} min", s / 60.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prepare::{GroupRef, PartSpec, load};
    use fem::{Material, Quadrature};

    fn clip() -> LoadedPart {
        let group = |name: &str| GroupRef {
            name: name.to_owned(),
            place: "clip.toml:1".to_owned(),
        };
        load(&PartSpec {
            interior_order: None,
            mesh_path: std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("../../scenes/clip.msh"),
            length_scale: 1.0,
            order: Some(2),
            refinements: 0,
            columns: ColumnChoice::All,
            contact_scalar: Scalar::F64,
            material: Material::new(2.7e9, 0.35).unwrap(),
            fixed: vec![(group("fixed"), [true; 3])],
            contact: vec![group("contact")],
            quadrature: Quadrature::Converged,
        })
        .unwrap()
    }

    #[test]
    fn what_cannot_fit_is_refused_with_what_to_change() {
        let part = clip();
        let forecast = Forecast::of(&part);
        let pairs = (part.candidates.len() * part.rows.len()) as f64;
        assert_eq!(forecast.compliance_bytes, 144.0 * pairs);
        let needed = forecast.needed();
        assert!(forecast.refuse_beyond(&part, needed).is_ok());
        let refusal = forecast
            .refuse_beyond(&part, 0.5 * needed)
            .unwrap_err()
            .to_string();
        assert!(
            refusal.contains("clip.msh") && refusal.contains("part.contact"),
            "{refusal}"
        );
    }

    #[test]
    fn columns_are_fetched_where_they_fit_and_refused_where_not() {
        let mut spec = clip().spec;
        spec.refinements = 1;
        let mut part = load(&spec).unwrap();
        let forecast = Forecast::of(&part);
        assert!(!forecast.fetches_columns(&part));
        part.spec.columns = ColumnChoice::Auto;
        assert!(!forecast.fetches_columns(&part), "all of it fits");
        part.spec.columns = ColumnChoice::Near;
        assert!(forecast.fetches_columns(&part));
        // Room for some columns beside the factor, for all, for too few.
        let of_column = column_bytes(part.rows.len(), Scalar::F64);
        let room = |n: f64| forecast.factor_bytes + n * of_column / SHARE_OF_COLUMNS;
        let n_all = part.candidates.len();
        assert!(n_all > 300, "{n_all}");
        let some = forecast.columns_within(&part, room(300.5)).unwrap();
        assert_eq!(some, 300);
        assert_eq!(forecast.columns_within(&part, 1e12).unwrap(), n_all);
        for free in [room(200.0), 0.0] {
            let refusal = forecast
                .columns_within(&part, free)
                .unwrap_err()
                .to_string();
            assert!(
                refusal.contains("clip.msh") && refusal.contains("coarsen the mesh"),
                "{refusal}"
            );
        }
    }

    #[test]
    fn sizes_and_times_are_readable() {
        assert_eq!(bytes(999.0), "999 B");
        assert_eq!(bytes(1.5e9), "1.5 GB");
        assert_eq!(duration(0.0204), "20 ms");
        assert_eq!(duration(66.94), "66.9 s");
        assert_eq!(duration(600.0), "10 min");
    }
}
