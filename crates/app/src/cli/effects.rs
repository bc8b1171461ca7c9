//! `snapin effects`.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;

use super::{CacheArgs, json_text, print};
use crate::output::Staging;
use crate::prepare::prepare;
use crate::progress::Ui;
use crate::scene::Scene;
use crate::study::accuracy::resolved;
use crate::study::effects;
use crate::{Error, setup};

#[derive(Debug, Args)]
pub(super) struct EffectsArgs {
    /// Scene file.
    scene: PathBuf,
    /// Folder for the result (default: out/, the scene's name and -effects).
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print effects.json instead of the table.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    cache: CacheArgs,
}

pub(super) fn run(args: &EffectsArgs, out: &mut dyn Write, ui: &Ui<'_>) -> Result<u8, Error> {
    let scene = Scene::load(&args.scene)?;
    let target = args.out.clone().unwrap_or_else(|| {
        let stem = args.scene.file_stem().unwrap_or("scene".as_ref());
        PathBuf::from("out").join(format!("{}-effects", stem.to_string_lossy()))
    });
    let staging = Staging::new(&target)?;
    let options = args.cache.options(false)?;
    let (scene, picked) = resolved(scene, &options, ui)?;
    picked.iter().for_each(|line| ui.note(line));
    let (tool, remarks) = setup::tool(&scene)?;
    remarks.iter().for_each(|line| ui.note(line));
    let prepared = prepare(&setup::part_spec(&scene)?, &options, ui)?;
    let progress = ui.progress();
    let study = effects::run(&scene, &prepared, &tool, &progress)?;
    drop(progress);
    ui.end_status();
    let json = json_text(&serde_json::to_value(&study).unwrap_or_default());
    for (name, text) in [
        ("effects.csv", study.csv()),
        ("effects.json", json.clone()),
        ("force-travel.svg", study.plot()?),
    ] {
        let path = staging.path().join(name);
        std::fs::write(&path, text).map_err(Error::io(&path, "write"))?;
    }
    staging.commit()?;
    let told = if args.json {
        json
    } else {
        format!(
            "{}\n{}  result: {}\n",
            scene.title,
            study.table(),
            target.display()
        )
    };
    print(out, &told)?;
    Ok(0)
}
