//! One name for two groups of the mesh.

use super::warning;
use crate::prepare::LoadedPart;
use crate::report::Warning;

/// A group that the scene names and of which the mesh has two: only one of them is used.
pub(super) fn same_name(loaded: &LoadedPart) -> Option<Warning> {
    let spec = &loaded.spec;
    let named = spec.fixed.iter().map(|(group, _)| group);
    named.chain(&spec.contact).find_map(|group| {
        let used = loaded.mesh.group(&group.name)?;
        let alike = loaded
            .mesh
            .groups
            .iter()
            .filter(|g| g.name == group.name && g.dimension == used.dimension);
        let n = alike.count();
        (n > 1).then(|| {
            warning(
                "group-names",
                n as f64,
                format!(
                    "{}: the mesh has {n} groups named {:?} and only the first of them is used; give each a name of its \
                     own and list both in the scene",
                    group.place, group.name
                ),
            )
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::{prepare, setup};

    #[test]
    fn two_groups_of_one_name_are_told_and_groups_of_two_names_are_not() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
        let scene = Scene::load(&folder.join("clip.toml")).unwrap();
        let mut loaded = prepare::load(&setup::part_spec(&scene).unwrap()).unwrap();
        assert_eq!(same_name(&loaded), None);
        let again = loaded.mesh.group("contact").unwrap().clone();
        loaded.mesh.groups.push(again);
        let told = same_name(&loaded).unwrap();
        assert_eq!(told.number, Some(2.0));
        assert!(told.text.contains("clip.toml:17"), "{}", told.text);
    }
}
