//! What does not give way at all, under a tool whose pose is imposed: no force can settle such a contact, so it is told
//! and left out.
//!
//! With a coupling the tool itself gives way, and a held node is a contact like any other.

use contact::{Contact, Place};

use super::rows::Bodies;

/// Of a block's norm, the compliance along a normal below which it is none: what round-off leaves in a direction that is
/// held.
const NO_COMPLIANCE: f64 = 1e-12;

/// Takes out the contacts along whose normals the part cannot give way; how deep the tool is in the deepest of them, m.
pub(super) fn leave_out(contacts: &mut Vec<Contact>, places: &[Place], bodies: &Bodies<'_>) -> f64 {
    let Bodies {
        part,
        held,
        reference,
        ..
    } = *bodies;
    let mut deepest = 0.0_f64;
    contacts.retain(|contact| {
        let place = &places[contact.place as usize];
        let largest = place.shares().iter().map(|s| part.largest_block(s.0));
        let largest = largest.fold(0.0, f64::max);
        let own = contact
            .normal
            .dot(place.block(place, part) * contact.normal);
        let gives_way =
            own > NO_COMPLIANCE * largest || held.yields_along(&contact.tool_row(reference));
        if !gives_way {
            deepest = deepest.max(-contact.gap);
        }
        gives_way
    });
    deepest
}
