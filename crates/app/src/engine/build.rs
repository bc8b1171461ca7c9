//! From a plan to an engine.

use std::sync::Arc;

use contact::minima::is_doubly_curved;
use glam::DVec3;

use super::ahead::Ahead;
use super::features::ToolFeatures;
use super::forces::Forces;
use super::held::Held;
use super::late::Late;
use super::law::Law;
use super::near::Near;
use super::places::Places;
use super::rows::Rows;
use super::sites::Sites;
use super::watch::Watch;
use super::{ContactIterations, ContactPart, ContactPlaces, Engine, Plan};

/// Near nodes that memory is reserved for, in rows of the LCP.
pub const NEAR_PER_ROW: usize = 8;

/// Distance beyond which a node is not watched any more, in distances at which nodes get a plane.
const WATCH_SLACK: f64 = 3.0;

/// Of the part's size, what the tool's distance may vary along an edge that lies along it: such an edge has no place that
/// is nearest. A fifth to four times as much gives the same forces.
const FLAT_SHARE: f64 = 2e-4;

impl Engine {
    /// Sizes all memory that steps will use.
    ///
    /// # Errors
    /// Rest positions that are not finite.
    pub fn new(plan: Plan) -> Result<Self, contact::Error> {
        let Plan {
            part,
            tool,
            coupling,
            grip,
            guide,
            rail,
            places,
            features,
            friction,
            mut settings,
        } = plan;
        // Where columns come one by one, those that were taken in are the engine's own reckoning.
        let part = part.view().map_or(part, Arc::new);
        let n = part.n_candidates();
        let surface = match &places {
            ContactPlaces::Nodes => None,
            ContactPlaces::Moving(surface) => Some(surface),
        };
        let n_own = surface.map_or(n, |surface| Sites::n_keys(surface, n));
        let n_features = features.as_ref().map_or(0, |(_, f)| f.points().len());
        let are_nodes = surface.is_none() && features.is_none();
        let n_keys = n_own + n_features;
        let max_contacts = settings.max_contacts.min(n_keys).max(1);
        let max_near = NEAR_PER_ROW.saturating_mul(max_contacts).min(n_keys);
        let max_near = max_near.max(max_contacts);
        settings.max_contacts = max_contacts;
        if let Some((surface, _)) = &features {
            settings.max_stride = settings.max_stride.min(ToolFeatures::max_stride(surface));
        }
        let near_distance = settings.near_distance;
        let clusters = part.clusters();
        let flat = FLAT_SHARE * extent(&part);
        let sites = surface.map(|surface| {
            let has_faces = is_doubly_curved(&tool);
            let rest = part.rest_positions();
            Sites::new(Arc::clone(surface), rest, clusters, flat, has_faces)
        });
        let features = features.map(|(surface, features)| {
            let keys = (n, n_own);
            ToolFeatures::new(surface, features, clusters, near_distance, keys, max_near)
        });
        // Under edges and facets there may be more than one equilibrium: the one next to where the part is, is meant.
        // A fixed number of passes starts from there too, as the paper's one pass does.
        let converges = settings.contact_iterations == ContactIterations::Converged;
        let goes_ahead = converges && features.is_none() && tool.is_round();
        let held = Held::by(coupling).at(grip);
        Ok(Self {
            reach_of_rotation: tool.characteristic_size().min(extent(&part)),
            held: match (guide, rail) {
                (Some(direction), _) => held.guided_along(direction),
                (None, Some(direction)) => held.on_rail(direction),
                (None, None) => held,
            },
            near: Near {
                watch: Watch::new(
                    &part,
                    // Distances of two looks may each be wrong.
                    near_distance + 2.0 * tool.error_bound(),
                    WATCH_SLACK * near_distance,
                )?,
                sites: sites.map(Box::new),
                features: features.map(Box::new),
            },
            places: Places::new(n_keys, max_near, are_nodes),
            rows: Rows::new(n_keys, max_near, max_contacts),
            law: Law::new(friction, n, n_keys, max_near, max_contacts),
            forces: Forces::new(n, n_keys, max_near),
            late: part.is_fetched().then(|| Late::new(max_contacts)),
            last_target: None,
            ahead: goes_ahead.then(Ahead::default),
            deviation: [0.0; 6],
            reference: DVec3::ZERO,
            settings,
            part,
            tool,
        })
    }
}

/// m, diagonal of the box round the candidates at rest.
fn extent(part: &ContactPart) -> f64 {
    let rest = part.rest_positions().iter();
    let (low, high) = rest.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), x| {
        (low.min(*x), high.max(*x))
    });
    (high - low).length()
}
