//! Pictures of the deformed part, drawn by the processor alone: no display, no graphics card.
//!
//! Parallel projection, depth buffer, one light at the eye's shoulder, each pixel the mean of
//! 2 x 2 samples. The shape is to scale, never exaggerated.

mod camera;
mod canvas;
pub(crate) mod colour;
pub(crate) mod overlay;
mod paint;
mod section;
pub(crate) mod surface;
pub(crate) mod viewpoint;

use glam::DVec3;

use self::camera::Camera;
use self::canvas::Canvas;
use self::overlay::{ColourBar, Overlay};
use self::paint::Painter;
use self::section::Cut;
use self::surface::Surface;
use super::data::{Frame, PartDrawing, Run};
use super::digits::RunScale;
use super::plot::short;

/// Width and height of a picture, pixels.
pub const SIZE: (usize, usize) = (1280, 960);

/// Samples per pixel along each axis.
const SAMPLES: usize = 2;

/// Where the part goes in the picture, pixels: left, top, right, bottom.
const STAGE: [f64; 4] = [70.0, 120.0, 1090.0, 870.0];

/// Length of the longest arrow, pixels.
const ARROW: f64 = 120.0;

/// Share of the surface nodes whose stress lies within the colour scale. The few beyond it sit at
/// contact points and clamped edges, where the exact solution has no bound.
const STRESS_SHARE: f64 = 0.995;

/// What the colours show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Length of the displacement, mm.
    Displacement,
    /// Von Mises stress, MPa.
    VonMises,
    /// Largest principal strain by size, %.
    Strain,
}

impl Quantity {
    /// In captions.
    pub fn name(self) -> &'static str {
        match self {
            Self::Displacement => "displacement",
            Self::VonMises => "von Mises stress",
            Self::Strain => "principal strain",
        }
    }
}

/// What all pictures of a run share, so that they can be compared and played one after another:
/// camera, colour scales, scale of the arrows.
#[derive(Clone, Debug)]
pub struct Scene {
    title: String,
    scale: RunScale,
    camera: Camera,
    /// Where part and tool are cut open.
    cut: Option<Cut>,
    /// Top of the colour scale, m.
    displacement_top: f64,
    /// Top of the colour scale, Pa.
    stress_top: f64,
    /// Top of the colour scale, 1: the largest of the free skin; contacts and inner edges may lie beyond it.
    strain_top: f64,
    /// Largest contact force of all frames, N.
    force_max: f64,
    /// Surface nodes, sorted.
    surface_nodes: Vec<u32>,
}

impl Scene {
    /// Fits camera and scales to all frames of the run.
    pub fn of(run: &Run) -> Self {
        let mut surface_nodes: Vec<u32> = run.part.triangles.iter().flatten().copied().collect();
        surface_nodes.sort_unstable();
        surface_nodes.dedup();
        let part = &run.part;
        let mut points: Vec<DVec3> = surface_nodes
            .iter()
            .map(|&node| part.nodes[node as usize])
            .collect();
        let (mut displacement_top, mut stress_top, mut force_max) = (0f64, 0f64, 0f64);
        for frame in &run.frames {
            let moved = surface_nodes.iter().map(|&node| {
                let node = node as usize;
                part.nodes[node] + frame.displacement[node]
            });
            points.extend(moved.filter(|p| p.is_finite()));
            let lengths = surface_nodes
                .iter()
                .map(|&n| frame.displacement[n as usize].length());
            displacement_top = finite(lengths).fold(displacement_top, f64::max);
            if !frame.von_mises.is_empty() {
                let stresses = surface_nodes.iter().map(|&n| frame.von_mises[n as usize]);
                stress_top = stress_top.max(quantile(finite(stresses).collect(), STRESS_SHARE));
            }
            force_max =
                finite(frame.contacts.iter().map(|c| c.force.length())).fold(force_max, f64::max);
        }
        // The tool as far as it is near the part: a long pin may leave the picture.
        let (low, high) = bounds(&points);
        let reach = 0.45 * (high - low).length();
        let corners = run
            .frames
            .iter()
            .flat_map(|frame| frame.tool.iter().flatten());
        let near: Vec<DVec3> = corners
            .filter(|p| p.is_finite())
            .map(|p| p.clamp(low - DVec3::splat(reach), high + DVec3::splat(reach)))
            .collect();
        points.extend(near);
        let viewpoint = viewpoint::choose(&run.part, &run.frames, &run.viewing, &points);
        Self {
            title: run.title.clone(),
            scale: RunScale::of(run),
            camera: Camera::fit(&viewpoint.view, &points, STAGE.map(|v| v * SAMPLES as f64)),
            cut: viewpoint.cut,
            displacement_top,
            stress_top,
            strain_top: run.strain.value(),
            force_max,
            surface_nodes,
        }
    }

    /// One frame as the bytes of a PNG file.
    ///
    /// # Errors
    /// What the encoder says.
    pub fn png(
        &self,
        part: &PartDrawing,
        frame: &Frame,
        quantity: Quantity,
    ) -> Result<Vec<u8>, String> {
        encode(&self.pixels(part, frame, quantity)?, SIZE)
    }

    /// The picture, three bytes per pixel, rows from the top.
    fn pixels(
        &self,
        part: &PartDrawing,
        frame: &Frame,
        quantity: Quantity,
    ) -> Result<Vec<u8>, String> {
        let (width, height) = (SIZE.0 * SAMPLES, SIZE.1 * SAMPLES);
        let (unit, factor, top, values): (_, _, _, Vec<f64>) = match quantity {
            Quantity::Displacement => {
                let lengths = frame
                    .displacement
                    .iter()
                    .map(|u| u.length() * 1e3)
                    .collect();
                ("mm", 1e3, self.displacement_top, lengths)
            }
            Quantity::VonMises => {
                let stress = frame.von_mises.iter().map(|s| s / 1e6).collect();
                ("MPa", 1e-6, self.stress_top, stress)
            }
            Quantity::Strain => {
                let strain = frame.strain.iter().map(|e| 100.0 * e).collect();
                ("%", 100.0, self.strain_top, strain)
            }
        };
        let bar = ColourBar::new(quantity.name(), unit, top * factor);

        let mut canvas = Canvas::new(width, height);
        let nodes: Vec<DVec3> = part
            .nodes
            .iter()
            .zip(&frame.displacement)
            .map(|(&p, &u)| p + u)
            .collect();
        let body = Surface::new(nodes, part.triangles.clone());
        let shades: Vec<f32> = values.iter().map(|&v| (v / bar.top) as f32).collect();
        let painter = Painter {
            camera: &self.camera,
            cut: self.cut.as_ref(),
        };
        painter.part(&mut canvas.solid, &body, part, &shades);
        painter.tool(&mut canvas.glass, &Surface::welded(&frame.tool));
        canvas.lay_glass_over_solid();
        if self.force_max > 0.0 {
            let per_newton =
                ARROW * SAMPLES as f64 / self.camera.pixels_per_metre() / self.force_max;
            painter.arrows(&mut canvas.solid, &frame.contacts, per_newton);
        }

        let mut picture = Overlay::new(canvas.bytes(), SIZE, SAMPLES);
        let moment = format!(
            "{}    travel {} mm    force {} N    step {}",
            frame.label,
            self.scale.travel_mm(frame),
            self.scale.force_n(frame),
            frame.step,
        );
        picture.text(&self.title, (40, 22), 37);
        picture.text(&moment, (40, 72), 27);
        let largest =
            finite(self.surface_nodes.iter().map(|&n| values[n as usize])).fold(0.0, f64::max);
        picture.colour_bar(&bar, largest);
        picture.axes(|axis| self.camera.on_picture(axis));
        picture.scale_bar(self.camera.pixels_per_metre() / SAMPLES as f64);
        picture.text(&self.legend(frame, quantity, &painter), (350, 908), 25);
        Ok(averaged(&picture.finish()?, SIZE, SAMPLES))
    }
}

impl Scene {
    /// The line below the picture: how the shape is drawn, and what the arrows are.
    fn legend(&self, frame: &Frame, quantity: Quantity, painter: &Painter<'_>) -> String {
        let shape = match self.cut {
            Some(_) if quantity == Quantity::Strain => "cut open, skin's strain",
            Some(_) => "to scale, cut open",
            None => "to scale",
        };
        if frame.contacts.is_empty() {
            return format!("{shape}; no contact");
        }
        let lengths = frame.contacts.iter().map(|c| c.force.length());
        let resultant = frame.contacts.iter().map(|c| c.force).sum::<DVec3>();
        let drawn = frame.contacts.iter().filter(|c| painter.has(c)).count();
        let of_all = match frame.contacts.len() {
            all if all == drawn => String::new(),
            all => format!(" of {all}"),
        };
        let sticking = match frame.contacts.iter().filter(|c| c.sticks).count() {
            0 => String::new(),
            n => format!(" ({n} sticking, green)"),
        };
        format!(
            "{shape}; {drawn}{of_all} forces on the part{sticking}, largest {} N, resultant {} N",
            short(finite(lengths).fold(0.0, f64::max)),
            short(resultant.length()),
        )
    }
}

fn finite(values: impl Iterator<Item = f64>) -> impl Iterator<Item = f64> {
    values.filter(|v| v.is_finite())
}

/// Value that the given share does not exceed; 0 of nothing.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let rank = (values.len() as f64 * share).ceil() as usize;
    values.get(rank.max(1) - 1).copied().unwrap_or(0.0)
}

pub(crate) fn bounds(points: &[DVec3]) -> (DVec3, DVec3) {
    let first = points.first().copied().unwrap_or_default();
    points
        .iter()
        .fold((first, first), |(low, high), &p| (low.min(p), high.max(p)))
}

/// Mean of the `samples` x `samples` samples of each pixel of a picture of this size.
fn averaged(bytes: &[u8], (width, height): (usize, usize), samples: usize) -> Vec<u8> {
    let mut pixels = Vec::with_capacity(3 * width * height);
    let n = (samples * samples) as u32;
    for row in 0..height {
        for column in 0..width {
            let mut sum = [n / 2; 3];
            for y in row * samples..(row + 1) * samples {
                let from = 3 * (y * width + column) * samples;
                for sample in bytes[from..from + 3 * samples].chunks_exact(3) {
                    for (s, &b) in sum.iter_mut().zip(sample) {
                        *s += u32::from(b);
                    }
                }
            }
            pixels.extend(sum.map(|s| (s / n) as u8));
        }
    }
    pixels
}

/// A picture of this size, three bytes per pixel, as the bytes of a PNG file.
///
/// # Errors
/// What the encoder says.
pub(crate) fn encode(pixels: &[u8], size: (usize, usize)) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size.0 as u32, size.1 as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    let mut writer = encoder.write_header().map_err(|e| e.to_string())?;
    writer.write_image_data(pixels).map_err(|e| e.to_string())?;
    writer.finish().map_err(|e| e.to_string())?;
    Ok(bytes)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panic")]
mod tests {
    use super::super::sample;
    use super::*;

    #[test]
    fn a_picture_shows_the_part_in_its_colours() {
        let run = sample::run();
        let scene = Scene::of(&run);
        let pixels = scene
            .pixels(&run.part, &run.frames[1], Quantity::Displacement)
            .unwrap();
        assert_eq!(pixels.len(), SIZE.0 * SIZE.1 * 3);
        let stage = (STAGE[1] as usize..STAGE[3] as usize)
            .flat_map(|y| (STAGE[0] as usize..STAGE[2] as usize).map(move |x| (x, y)));
        let coloured = stage
            .filter(|&(x, y)| {
                let p = &pixels[3 * (y * SIZE.0 + x)..][..3];
                p.iter().max().unwrap() - p.iter().min().unwrap() > 40
            })
            .count();
        assert!(coloured > 50_000, "{coloured}");
    }

    /// The ring of the sample closed by a way along its axis and a camera that sees nothing: cut open, the inside is in the part's
    /// colours and the pin's is hatched.
    #[test]
    fn a_cut_picture_shows_the_inside() {
        let run = sample::run();
        let mut scene = Scene::of(&run);
        let whole = scene
            .pixels(&run.part, &run.frames[1], Quantity::VonMises)
            .unwrap();
        scene.cut = Some(Cut {
            point: DVec3::ZERO,
            normal: -run.viewing.view.direction.reject_from(DVec3::Y).normalize(),
            slack: 1e-5,
        });
        let cut = scene
            .pixels(&run.part, &run.frames[1], Quantity::VonMises)
            .unwrap();
        let n_changed = whole.iter().zip(&cut).filter(|(a, b)| a != b).count();
        assert!(n_changed > 100_000, "{n_changed}");
        let painter = Painter {
            camera: &scene.camera,
            cut: scene.cut.as_ref(),
        };
        let legend = scene.legend(&run.frames[1], Quantity::VonMises, &painter);
        assert!(legend.starts_with("to scale, cut open; "), "{legend}");
        assert!(legend.contains(" of "), "{legend}");
    }

    #[test]
    fn a_png_reads_back() {
        let run = sample::run();
        let scene = Scene::of(&run);
        let bytes = scene
            .png(&run.part, &run.frames[0], Quantity::VonMises)
            .unwrap();
        let decoder = png::Decoder::new(std::io::Cursor::new(bytes));
        let info = decoder.read_info().unwrap();
        assert_eq!((info.info().width, info.info().height), (1280, 960));
    }

    #[test]
    fn nothing_to_draw_is_an_empty_stage() {
        let mut run = sample::run();
        run.part = PartDrawing::default();
        run.frames = vec![Frame::default()];
        let scene = Scene::of(&run);
        scene
            .png(&run.part, &run.frames[0], Quantity::Displacement)
            .unwrap();
    }

    #[test]
    fn pixels_are_the_mean_of_their_samples() {
        let bytes: Vec<u8> = (0..4u8)
            .flat_map(|row| (0..4u8).flat_map(move |c| [row, c * 10, 7]))
            .collect();
        let pixels = averaged(&bytes, (2, 2), 2);
        assert_eq!(pixels, [1, 5, 7, 1, 25, 7, 3, 5, 7, 3, 25, 7]);
    }

    #[test]
    fn quantiles() {
        assert_eq!(quantile((1..=1000).map(f64::from).collect(), 0.995), 995.0);
        assert_eq!(quantile(vec![3.0], 0.995), 3.0);
        assert_eq!(quantile(vec![], 0.995), 0.0);
    }
}
