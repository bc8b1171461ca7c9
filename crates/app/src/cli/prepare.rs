//! `snapin prepare`.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::{CacheArgs, json_text, print};
use crate::plausibility;
use crate::prepare::budget::{bytes, duration};
use crate::prepare::{PreparedPart, prepare};
use crate::progress::Ui;
use crate::scene::Scene;
use crate::study::accuracy::resolved;
use crate::{Error, setup};

#[derive(Debug, Args)]
pub(super) struct PrepareArgs {
    /// Scene file.
    scene: PathBuf,
    /// Prepare anew even if a cached part is there.
    #[arg(long)]
    rebuild: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    cache: CacheArgs,
}

pub(super) fn run(args: &PrepareArgs, out: &mut dyn Write, ui: &Ui<'_>) -> Result<u8, Error> {
    let scene = Scene::load(&args.scene)?;
    let options = args.cache.options(args.rebuild)?;
    let (scene, picked) = resolved(scene, &options, ui)?;
    picked.iter().for_each(|line| ui.note(line));
    let prepared = prepare(&setup::part_spec(&scene)?, &options, ui)?;
    plausibility::tell(&plausibility::of_part(&scene, &prepared.loaded), ui);
    print(
        out,
        &if args.json {
            to_json(&prepared)
        } else {
            table(&prepared)
        },
    )?;
    Ok(0)
}

fn table(prepared: &PreparedPart) -> String {
    let loaded = &prepared.loaded;
    let mut text = format!(
        "{}\n  nodes                 {}\n  elements              {} of order {}\n  \
         surface nodes         {}\n  nodes that can touch  {}\n  compliance            {}\n",
        loaded.spec.mesh_path.display(),
        loaded.mesh.n_nodes(),
        loaded.mesh.n_elements(),
        loaded.mesh.order as usize,
        loaded.rows.len(),
        loaded.candidates.len(),
        bytes(prepared.compliance.bytes()),
    );
    for (stage, seconds) in &prepared.seconds {
        text += &format!("  {stage:<24}{}\n", duration(*seconds));
    }
    let checks = &prepared.checks;
    text += &format!(
        "  symmetry              {:.1e} of the largest entry\n  residual |K x - e|     {:.1e}\n  \
         positive definite     yes, smallest pivot {:.1e} of the largest\n",
        checks.symmetry_rel, checks.residual_rel, checks.smallest_pivot_rel
    );
    if let Some(file) = &prepared.cache_file {
        let how = if prepared.from_cache {
            "read from"
        } else {
            "kept in"
        };
        text += &format!("  {how} {}\n", file.display());
    }
    text
}

fn to_json(prepared: &PreparedPart) -> String {
    let loaded = &prepared.loaded;
    let seconds: serde_json::Map<_, _> = prepared
        .seconds
        .iter()
        .map(|(stage, s)| ((*stage).to_owned(), json!(s)))
        .collect();
    json_text(&json!({
        "mesh": loaded.spec.mesh_path,
        "nodes": loaded.mesh.n_nodes(),
        "elements": loaded.mesh.n_elements(),
        "order": loaded.mesh.order as usize,
        "surface_nodes": loaded.rows.len(),
        "candidates": loaded.candidates.len(),
        "compliance_bytes": prepared.compliance.bytes(),
        "from_cache": prepared.from_cache,
        "cache_file": prepared.cache_file,
        "seconds": seconds,
        "checks": {
            "symmetry_rel": prepared.checks.symmetry_rel,
            "residual_rel": prepared.checks.residual_rel,
            "smallest_pivot_rel": prepared.checks.smallest_pivot_rel,
        },
    }))
}
