//! What preparing a part will take, told before it is begun.

use crate::Error;
use crate::machine::Machine;

use super::LoadedPart;

/// Expected memory and time of preparing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Bytes of the stored compliance: 72 per pair of candidate and surface node.
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
        let n = 3.0 * loaded.mesh.n_nodes() as f64;
        let columns = 3.0 * loaded.candidates.len() as f64;
        let factor_entries = 5.0 * n.powf(1.35);
        Self {
            compliance_bytes: 72.0 * loaded.candidates.len() as f64 * loaded.rows.len() as f64,
            factor_bytes: 8.0 * factor_entries + 12.0 * 90.0 * n,
            seconds: 4e-9 * n.powf(1.9) + 6.5e-11 * columns * factor_entries + 4e-6 * n,
        }
    }

    /// The forecast in one line.
    pub fn line(&self, loaded: &LoadedPart) -> String {
        format!(
            "preparing {}: {} nodes, {} elements, {} nodes can touch, {} on the surface; \
             expects {} of memory and about {}",
            loaded.spec.mesh_path.display(),
            loaded.mesh.n_nodes(),
            loaded.mesh.n_elements(),
            loaded.candidates.len(),
            loaded.rows.len(),
            bytes(self.compliance_bytes + self.factor_bytes),
            duration(self.seconds),
        )
    }

    /// # Errors
    /// If the part needs more memory than the machine has to give, with what to change.
    pub fn refuse_what_cannot_fit(&self, loaded: &LoadedPart) -> Result<(), Error> {
        self.refuse_beyond(loaded, Machine::read().available_memory as f64)
    }

    fn refuse_beyond(&self, loaded: &LoadedPart, available: f64) -> Result<(), Error> {
        let needed = self.compliance_bytes + self.factor_bytes;
        if needed <= available {
            return Ok(());
        }
        let mend = if self.compliance_bytes > self.factor_bytes {
            format!(
                "name a smaller region in part.contact ({} nodes can touch now) or coarsen the mesh",
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
            mesh_path: std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("../../scenes/clip.msh"),
            length_scale: 1.0,
            order: Some(2),
            refinements: 0,
            bubbles: None,
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
        assert_eq!(forecast.compliance_bytes, 72.0 * pairs);
        let needed = forecast.compliance_bytes + forecast.factor_bytes;
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
    fn sizes_and_times_are_readable() {
        assert_eq!(bytes(999.0), "999 B");
        assert_eq!(bytes(1.5e9), "1.5 GB");
        assert_eq!(duration(0.0204), "20 ms");
        assert_eq!(duration(66.94), "66.9 s");
        assert_eq!(duration(600.0), "10 min");
    }
}
