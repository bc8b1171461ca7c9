//! Results to files: tables, plots, pictures, shapes, and one page that tells it all.
//!
//! [`write_all`] turns a [`Run`] into the result folder. Each kind of file has its module; none of
//! them knows where the numbers came from.

pub mod csv;
pub mod curve;
pub mod data;
mod error;
pub mod html;
pub mod mcap_file;
pub mod origin;
pub mod part_curve;
pub mod plot;
pub mod render;
pub mod strain;
pub mod summary;
pub mod vtu;
pub mod work_precision;
pub mod z_width;

mod digits;
mod font;
#[cfg(test)]
mod sample;

use std::path::{Path, PathBuf};

pub use curve::Curve;
pub use data::{
    CellKind, ContactForce, DriveRow, Driven, Effect, Facts, Frame, FrictionFacts, Handbook,
    HandbookRow, MultiplyFacts, MultiplyRace, N_STAGES, Outputs, PaperStage, PartDrawing, Phase,
    RateFacts, Run, STAGE_NAMES, StepRow, TwoRateFacts, View, Viewing, Warning,
    coefficient_in_words,
};
pub use error::ReportError;
pub use origin::{InputFile, Origin};
pub use part_curve::{
    Doubts, LimitFact, LimitState, Limits, Outcome, PartCurve, StrainUse, Verdict,
};
pub use strain::{PeakKind, StrainFacts, StrainPeak};

/// Writes the whole result folder of `run` into the existing directory `dir`.
///
/// Files: `report.html`, `curve.csv`, `force-travel.svg`, `summary.json`; with a hand `force-travel.csv`,
/// `timing.csv`, `step-time.svg` and `session.mcap`; and below `frames` for each frame `NN-label.png` (displacement),
/// `NN-label-stress.png` and `NN-label.vtu`, with `NN-label-strain.png` at the largest strain; the larger ones as [`Outputs`] asks. Returns the
/// paths of what was written, in the order of writing. The same run gives the same bytes.
///
/// # Errors
/// The first file that cannot be made, with its path and the cause.
pub fn write_all(dir: &Path, run: &Run) -> Result<Vec<PathBuf>, ReportError> {
    run_is_consistent(run)?;
    let mut written = Vec::new();
    let curve = Curve::of(&run.rows);

    if let Some(driven) = &run.driven {
        let text = csv::curve(&driven.rows);
        write_file(&mut written, &dir.join("curve.csv"), text.as_bytes())?;
    }
    let is_felt = !run.rows.is_empty();
    if is_felt {
        let text = csv::force_travel(&run.rows);
        write_file(&mut written, &dir.join("force-travel.csv"), text.as_bytes())?;
        let text = csv::timing(&run.rows);
        write_file(&mut written, &dir.join("timing.csv"), text.as_bytes())?;
    }
    let summary = summary::json(run, &curve);
    write_file(&mut written, &dir.join("summary.json"), summary.as_bytes())?;

    let force_path = dir.join("force-travel.svg");
    let series = plot::force::curves(run);
    let mark = plot::force::peak(run, &curve);
    let force_svg = plot_formats(&force_path, |format| {
        plot::force_travel(&series, mark.as_ref(), format)
    })?;
    write_file(&mut written, &force_path, force_svg.wide.as_bytes())?;
    let time_path = dir.join("step-time.svg");
    let mut time_svg = html::Plot::default();
    if is_felt {
        time_svg = plot_formats(&time_path, |format| plot::step_time(&run.rows, format))?;
        write_file(&mut written, &time_path, time_svg.wide.as_bytes())?;
    }

    let frames_dir = dir.join("frames");
    if !run.frames.is_empty() && (run.outputs.png || run.outputs.vtu) {
        std::fs::create_dir_all(&frames_dir).map_err(|source| ReportError::Io {
            path: frames_dir.clone(),
            source,
        })?;
    }
    let mut pictures = Vec::new();
    if run.outputs.png {
        pictures = write_pictures(&mut written, &frames_dir, run)?;
    }
    if run.outputs.vtu {
        for (idx, frame) in run.frames.iter().enumerate() {
            let path = frames_dir.join(format!("{}.vtu", frame_stem(idx, frame)));
            let bytes =
                vtu::frame(&run.part, frame).map_err(|cause| ReportError::shape(&path, cause))?;
            write_file(&mut written, &path, &bytes)?;
        }
    }
    if run.outputs.mcap && is_felt {
        let path = dir.join("session.mcap");
        let bytes = mcap_file::session(run).map_err(|e| ReportError::recording(&path, e))?;
        write_file(&mut written, &path, &bytes)?;
    }

    let page = html::page(
        run,
        &curve,
        &html::Drawings {
            force_svg,
            time_svg,
            pictures,
        },
    );
    write_file(&mut written, &dir.join("report.html"), page.as_bytes())?;
    Ok(written)
}

/// A plot in all its formats; `path` is that of the wide one, for errors.
fn plot_formats(
    path: &Path,
    draw: impl Fn(plot::Format) -> Result<String, Box<dyn std::error::Error>>,
) -> Result<html::Plot, ReportError> {
    let draw = |format| draw(format).map_err(|e| ReportError::plot(path, e));
    Ok(html::Plot {
        wide: draw(plot::Format::Wide)?,
        narrow: draw(plot::Format::Narrow)?,
    })
}

/// Name of a frame's files without their ending: its number, then its label in plain letters.
pub fn frame_stem(idx: usize, frame: &Frame) -> String {
    let mut stem = format!("{:02}", idx + 1);
    for word in frame
        .label
        .split(|c: char| !c.is_ascii_alphanumeric())
        .filter(|w| !w.is_empty())
    {
        stem.push('-');
        stem.push_str(&word.to_ascii_lowercase());
    }
    stem
}

/// Draws every frame by displacement and by stress, that of the largest strain by strain too, on scales common to the run.
fn write_pictures(
    written: &mut Vec<PathBuf>,
    dir: &Path,
    run: &Run,
) -> Result<Vec<html::Picture>, ReportError> {
    let scene = render::Scene::of(run);
    let mut pictures = Vec::new();
    for (idx, frame) in run.frames.iter().enumerate() {
        let stem = frame_stem(idx, frame);
        let mut draw = |quantity, name: String| {
            let path = dir.join(&name);
            let png = scene
                .png(&run.part, frame, quantity)
                .map_err(|cause| ReportError::picture(&path, cause))?;
            write_file(written, &path, &png)?;
            pictures.push(html::Picture {
                frame: idx,
                quantity,
                file: format!("frames/{name}"),
                png,
            });
            Ok(())
        };
        draw(render::Quantity::Displacement, format!("{stem}.png"))?;
        if !frame.von_mises.is_empty() {
            draw(render::Quantity::VonMises, format!("{stem}-stress.png"))?;
        }
        if !frame.strain.is_empty() {
            draw(render::Quantity::Strain, format!("{stem}-strain.png"))?;
        }
    }
    Ok(pictures)
}

fn write_file(written: &mut Vec<PathBuf>, path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    std::fs::write(path, bytes).map_err(|source| ReportError::Io {
        path: path.to_path_buf(),
        source,
    })?;
    written.push(path.to_path_buf());
    Ok(())
}

/// Refuses indices and lengths that would end in a panic further down.
fn run_is_consistent(run: &Run) -> Result<(), ReportError> {
    let n_nodes = run.part.nodes.len();
    let bad = |what: String| Err(ReportError::Inconsistent { what });
    let indices = run
        .part
        .triangles
        .iter()
        .flatten()
        .chain(run.part.edges.iter().flatten())
        .chain(&run.part.cells);
    if let Some(node) = indices.copied().find(|&node| node as usize >= n_nodes) {
        return bad(format!(
            "the drawing of the part names node {node} of {n_nodes}"
        ));
    }
    if !run
        .part
        .cells
        .len()
        .is_multiple_of(run.part.cell_kind.nodes_per_cell())
    {
        return bad(format!(
            "{} cell nodes are no whole number of cells",
            run.part.cells.len()
        ));
    }
    for frame in &run.frames {
        let (u, s) = (frame.displacement.len(), frame.von_mises.len());
        let e = frame.strain.len();
        if u != n_nodes || (s != n_nodes && s != 0) || (e != n_nodes && e != 0) {
            return bad(format!(
                "frame {:?} has {u} displacements, {s} stresses and {e} strains for {n_nodes} nodes",
                frame.label
            ));
        }
        if let Some(contact) = frame.contacts.iter().find(|c| c.node as usize >= n_nodes) {
            let node = contact.node;
            return bad(format!(
                "frame {:?} has a contact at node {node}",
                frame.label
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panic")]
mod tests {
    use super::*;

    #[test]
    fn the_folder_is_complete() {
        let dir = tempfile::tempdir().unwrap();
        let run = sample::run();
        let mut written = write_all(dir.path(), &run).unwrap();
        let mut files: Vec<String> = Vec::new();
        for folder in [dir.path().to_path_buf(), dir.path().join("frames")] {
            for entry in std::fs::read_dir(folder).unwrap() {
                let entry = entry.unwrap();
                if entry.file_type().unwrap().is_file() {
                    assert!(entry.metadata().unwrap().len() > 0);
                    files.push(entry.file_name().into_string().unwrap());
                }
            }
        }
        files.sort();
        written.sort_by_key(|path| path.file_name().map(ToOwned::to_owned));
        assert!(written.iter().all(|path| path.is_file()));
        let names = written.iter().map(|path| path.file_name().unwrap());
        assert!(names.eq(files.iter().map(std::ffi::OsStr::new)));
        assert_eq!(
            files,
            [
                "01-first-contact-stress.png",
                "01-first-contact.png",
                "01-first-contact.vtu",
                "02-peak-stress.png",
                "02-peak.png",
                "02-peak.vtu",
                "curve.csv",
                "force-travel.csv",
                "force-travel.svg",
                "report.html",
                "session.mcap",
                "step-time.svg",
                "summary.json",
                "timing.csv",
            ]
        );
    }

    #[test]
    fn an_empty_run_still_makes_a_report() {
        let dir = tempfile::tempdir().unwrap();
        let mut run = sample::run();
        run.rows.clear();
        run.frames.clear();
        write_all(dir.path(), &run).unwrap();
        assert!(dir.path().join("report.html").exists());
    }

    #[test]
    fn numbers_that_are_not_finite_do_no_harm() {
        let dir = tempfile::tempdir().unwrap();
        let mut run = sample::run();
        run.rows[3].force_n = f64::NAN;
        run.rows[4].certificate = f64::INFINITY;
        run.frames[0].displacement[0].x = f64::NAN;
        run.frames[1].von_mises[2] = f64::INFINITY;
        write_all(dir.path(), &run).unwrap();
    }

    #[test]
    fn the_same_run_gives_the_same_bytes() {
        let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
        let [first, second] = folders
            .each_ref()
            .map(|dir| write_all(dir.path(), &sample::run()).unwrap());
        assert_eq!(first.len(), second.len());
        for (a, b) in first.iter().zip(&second) {
            assert_eq!(a.file_name(), b.file_name());
            assert!(
                std::fs::read(a).unwrap() == std::fs::read(b).unwrap(),
                "{}",
                a.display()
            );
        }
    }

    /// A device that is always full stands in for a full disk.
    #[test]
    #[cfg(target_os = "linux")]
    fn a_full_disk_is_an_error_that_names_the_file() {
        for name in ["force-travel.csv", "session.mcap", "report.html"] {
            let dir = tempfile::tempdir().unwrap();
            std::os::unix::fs::symlink("/dev/full", dir.path().join(name)).unwrap();
            let error = write_all(dir.path(), &sample::run())
                .unwrap_err()
                .to_string();
            assert!(error.contains(name), "{error}");
            assert!(error.contains("No space left"), "{error}");
        }
    }

    #[test]
    fn a_missing_folder_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let error = write_all(&dir.path().join("gone"), &sample::run())
            .unwrap_err()
            .to_string();
        assert!(error.contains("gone"), "{error}");
        assert!(error.contains("curve.csv"), "{error}");
    }

    #[test]
    fn a_wrong_index_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let mut run = sample::run();
        run.part.triangles.push([0, 1, 9_999]);
        let error = write_all(dir.path(), &run).unwrap_err().to_string();
        assert_eq!(
            error,
            format!(
                "the drawing of the part names node 9999 of {}",
                run.part.nodes.len()
            )
        );
    }
}
