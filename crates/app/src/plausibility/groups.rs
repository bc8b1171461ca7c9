//! Groups of the mesh: one name for two, and volumes in none.

use super::warning;
use crate::prepare::LoadedPart;
use crate::report::Warning;

/// A group that the scene names and of which the mesh has several: all of them are used.
pub(super) fn same_name(loaded: &LoadedPart) -> Option<Warning> {
    let spec = &loaded.spec;
    let named = spec.fixed.iter().map(|(group, _)| group);
    named.chain(&spec.contact).find_map(|group| {
        let mut shared = loaded.mesh.shared_names.iter();
        let (_, n) = shared.find(|(name, _)| *name == group.name)?;
        Some(warning(
            "group-names",
            *n as f64,
            format!(
                "{}: the mesh has {n} groups named {:?}, which are taken as one; if you mean one of them, give each a \
                 name of its own",
                group.place, group.name
            ),
        ))
    })
}

/// Volumes of the model that the mesh file names but holds no elements of.
pub(super) fn left_out(loaded: &LoadedPart) -> Option<Warning> {
    let volumes = &loaded.mesh.left_out_volumes;
    let tags: Vec<String> = volumes.iter().map(i32::to_string).collect();
    let what = match tags.len() {
        0 => return None,
        1 => format!("volume {} of the model is", tags[0]),
        _ => format!("volumes {} of the model are", tags.join(", ")),
    };
    Some(warning(
        "volumes-left-out",
        volumes.len() as f64,
        format!(
            "{}: {what} in no physical group, so that Gmsh saved no elements of it, and the part is computed without; \
             if it belongs to the part, put it into a physical volume and mesh the model again",
            loaded.spec.mesh_path.display()
        ),
    ))
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
        loaded.mesh.shared_names.push(("contact".to_owned(), 2));
        let told = same_name(&loaded).unwrap();
        assert_eq!(told.number, Some(2.0));
        assert!(told.text.contains("clip.toml:17"), "{}", told.text);
    }

    #[test]
    fn volumes_that_the_file_left_out_are_told() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
        let scene = Scene::load(&folder.join("clip.toml")).unwrap();
        let mut loaded = prepare::load(&setup::part_spec(&scene).unwrap()).unwrap();
        assert_eq!(left_out(&loaded), None);
        loaded.mesh.left_out_volumes = vec![2, 5];
        let told = left_out(&loaded).unwrap();
        assert!(told.text.contains("volumes 2, 5") && told.text.contains("clip.msh"));
    }
}
