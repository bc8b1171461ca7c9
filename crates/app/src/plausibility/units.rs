//! Numbers that look like another unit: the modulus, the size of the part, the size of a tool mesh.

use contact::tool::Tool;
use fem::Mesh;
use glam::DVec3;
use glamx::DPose3;

use super::warning;
use crate::report::Warning;
use crate::scene::{Scene, ToolShape, Units};

/// Pa: softer are gels and foams, stiffer is nothing that is moulded, cast or rolled.
const MODULUS: std::ops::RangeInclusive<f64> = 1e6..=1e12;

/// m, longest side of the part's bounding box.
const SIZE: std::ops::RangeInclusive<f64> = 1e-4..=1.0;

/// A tool mesh so many times larger or smaller than the part is in another unit: m and mm are 1000 apart.
const TOOL_RATIO: f64 = 200.0;

/// A modulus that may be in another unit.
pub(super) fn modulus(scene: &Scene) -> Option<Warning> {
    let si = scene.part.material.young_modulus;
    if MODULUS.contains(&si) {
        return None;
    }
    let (unit, written) = match scene.units {
        Units::Si => ("Pa", si),
        Units::MmNMpa => ("MPa", si * 1e-6),
    };
    let (than, mend) = if si < *MODULUS.start() {
        ("softer than any rubber", too_small(scene.units, written))
    } else {
        (
            "stiffer than any metal or ceramic",
            too_large(scene.units, written),
        )
    };
    Some(warning(
        "modulus",
        si,
        format!("young_modulus is {written} {unit}, {than}{mend}"),
    ))
}

fn too_small(units: Units, written: f64) -> String {
    let in_si = |name: &str, factor: f64| {
        let value = written * factor;
        MODULUS
            .contains(&value)
            .then(|| format!("young_modulus = {value:e} if it was meant in {name}"))
    };
    match units {
        Units::Si => {
            let guesses: Vec<String> = [in_si("MPa", 1e6), in_si("GPa", 1e9)]
                .into_iter()
                .flatten()
                .collect();
            if guesses.is_empty() {
                return ": the scene's unit is Pa".to_owned();
            }
            format!(
                ": write {} (or units = \"mm-N-MPa\", with all lengths in mm)",
                guesses.join(", ")
            )
        }
        Units::MmNMpa => format!(
            ": in units = \"mm-N-MPa\" it is in MPa; write {:e} if it was meant in GPa",
            1e3 * written
        ),
    }
}

fn too_large(units: Units, written: f64) -> String {
    match units {
        Units::Si => format!(
            ": the scene's unit is Pa; {written:e} may have been turned into Pa twice, then write {:e}",
            1e-6 * written
        ),
        Units::MmNMpa => format!(
            ": in units = \"mm-N-MPa\" it is in MPa; write {:e} if it was meant in Pa",
            1e-6 * written
        ),
    }
}

/// A part that may be in another unit of length.
pub(super) fn size(scene: &Scene, mesh: &Mesh) -> Option<Warning> {
    let sides = sides(mesh);
    let longest = sides.max_element();
    if SIZE.contains(&longest) {
        return None;
    }
    let mend = match scene.units {
        Units::Si if longest > *SIZE.end() => {
            "; the mesh is read in m: if it is in mm, write units = \"mm-N-MPa\", with all numbers of the scene in mm, N \
             and MPa"
        }
        Units::Si => "; the mesh is read in m: check the unit that it was written in",
        Units::MmNMpa if longest < *SIZE.start() => {
            "; the mesh is read in mm: if it is in m, write units = \"SI\", with all numbers of the scene in m, N and Pa"
        }
        Units::MmNMpa => "; the mesh is read in mm: check the unit that it was written in",
    };
    let mm = 1e3 * sides;
    Some(warning(
        "size",
        longest,
        format!(
            "the part measures {} x {} x {} mm{mend}",
            short(mm.x),
            short(mm.y),
            short(mm.z)
        ),
    ))
}

/// A tool mesh that may be in another unit of length than the part.
pub(super) fn tool_size(scene: &Scene, mesh: &Mesh, tool: &Tool) -> Option<Warning> {
    let ToolShape::Mesh { file, .. } = &scene.tool.shape else {
        return None;
    };
    let (low, high) = tool.aabb(&DPose3::IDENTITY)?;
    let of_tool = (high - low).max_element();
    let of_part = sides(mesh).max_element();
    let ratio = of_tool / of_part;
    if (TOOL_RATIO.recip()..=TOOL_RATIO).contains(&ratio) {
        return None;
    }
    Some(warning(
        "tool-size",
        ratio,
        format!(
            "the tool of {} measures {} mm and the part {} mm: one of the two may be in another unit; tool.scale is the \
             factor for the tool's file",
            file.display(),
            short(1e3 * of_tool),
            short(1e3 * of_part),
        ),
    ))
}

/// m, of the bounding box.
fn sides(mesh: &Mesh) -> DVec3 {
    let points = || mesh.nodes.iter().map(|x| DVec3::from_array(*x));
    let low = points().fold(DVec3::INFINITY, DVec3::min);
    points().fold(DVec3::NEG_INFINITY, DVec3::max) - low
}

/// Three digits.
pub(super) fn short(x: f64) -> String {
    if x != 0.0 && !(1e-2..1e5).contains(&x.abs()) {
        return format!("{x:.2e}");
    }
    let digits = (2 - x.abs().max(1e-3).log10().floor() as i32).clamp(0, 4);
    format!("{x:.*}", digits as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    fn scene(units: &str, young_modulus: &str) -> Scene {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
        let text = std::fs::read_to_string(folder.join("clip.toml")).unwrap();
        let text = text
            .replace("\"SI\"", &format!("\"{units}\""))
            .replace("2.7e9", young_modulus);
        Scene::from_bytes(text.into_bytes(), &folder.join("clip.toml")).unwrap()
    }

    #[test]
    fn a_modulus_is_doubted_outside_1_mpa_to_1_tpa_only() {
        let id = |units, e| modulus(&scene(units, e)).map(|w| w.number.unwrap());
        for (units, e) in [
            ("SI", "1e6"),
            ("SI", "1e12"),
            ("mm-N-MPa", "1.0"),
            ("mm-N-MPa", "1e6"),
        ] {
            assert_eq!(id(units, e), None, "{units} {e}");
        }
        for (units, e) in [
            ("SI", "0.99e6"),
            ("SI", "1.01e12"),
            ("SI", "2700.0"),
            ("mm-N-MPa", "0.99"),
            ("mm-N-MPa", "2.7e9"),
        ] {
            assert!(id(units, e).is_some(), "{units} {e}");
        }
    }

    #[test]
    fn the_mend_is_the_number_in_the_right_unit() {
        let text = |units, e| modulus(&scene(units, e)).unwrap().text;
        assert!(text("SI", "2700.0").contains("young_modulus = 2.7e9 if it was meant in MPa"));
        assert!(!text("SI", "2700.0").contains("GPa"));
        assert!(text("SI", "2.7").contains("2.7e9 if it was meant in GPa"));
        assert!(text("mm-N-MPa", "2.7e9").contains("write 2.7e3 if it was meant in Pa"));
    }

    #[test]
    fn a_part_is_doubted_beyond_a_metre_and_under_a_tenth_of_a_millimetre() {
        let part = |length: f64| {
            Mesh::new(
                fem::Order::Linear,
                vec![
                    [0.0; 3],
                    [length, 0.0, 0.0],
                    [0.0, 0.5 * length, 0.0],
                    [0.0, 0.0, 0.2 * length],
                ],
                vec![1, 2, 3, 4],
                vec![0, 1, 2, 3],
                vec![1],
                vec![],
            )
        };
        let scene = scene("SI", "2.7e9");
        for fine in [1e-4, 0.02, 1.0] {
            assert_eq!(size(&scene, &part(fine)), None, "{fine}");
        }
        let large = size(&scene, &part(20.0)).unwrap();
        assert_eq!(large.number, Some(20.0));
        assert!(
            large.text.contains("20000 x 10000 x 4000 mm"),
            "{}",
            large.text
        );
        assert!(large.text.contains("mm-N-MPa"), "{}", large.text);
        assert!(size(&scene, &part(0.99e-4)).is_some());
    }

    #[test]
    fn lengths_have_three_digits() {
        assert_eq!(short(12.345), "12.3");
        assert_eq!(short(0.0123), "0.0123");
        assert_eq!(short(0.00001), "1.00e-5");
        assert_eq!(short(0.0), "0.0000");
    }
}
