//! A picture of a moment without a display, on whatever adapter there is.

use super::exhibit::Exhibit;
use super::scene3d::{Samples, Target};
use crate::Error;
use crate::report::plot::short;
use crate::report::render::overlay::Overlay;
use crate::report::render::{SIZE, encode};
use crate::shape::Shape;

/// An adapter with a device of the viewer's own.
pub(crate) struct Adapter {
    /// For people: name and way to it.
    pub(crate) name: String,
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
}

impl Adapter {
    /// The first that can draw.
    ///
    /// # Errors
    /// Where there is none, with the mend.
    pub(crate) fn first() -> Result<Self, Error> {
        let none = |why: String| {
            Error::Input(format!(
                "no graphics adapter to draw with ({why}); install a driver, or Mesa's software one (Debian: apt install \
                 libvulkan1 mesa-vulkan-drivers)"
            ))
        };
        let instance =
            wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let asked = wgpu::RequestAdapterOptions::default();
        let adapter = pollster::block_on(instance.request_adapter(&asked));
        let adapter = adapter.map_err(|e| none(e.to_string()))?;
        let wish = wgpu::DeviceDescriptor {
            label: Some("snapin picture"),
            memory_hints: wgpu::MemoryHints::MemoryUsage,
            ..wgpu::DeviceDescriptor::default()
        };
        let opened = pollster::block_on(adapter.request_device(&wish));
        let (device, queue) = opened.map_err(|e| none(e.to_string()))?;
        let info = adapter.get_info();
        Ok(Self {
            name: format!("{} ({:?})", info.name, info.backend),
            device,
            queue,
        })
    }
}

/// The end of the exhibit's way as the bytes of a PNG file.
///
/// # Errors
/// Those of the multiply, what the adapter or the encoder says.
pub(crate) fn of_end(
    exhibit: &Exhibit,
    shape: &mut Shape,
    adapter: &Adapter,
) -> Result<Vec<u8>, Error> {
    let failed = |why: String| Error::Input(format!("{}: {why}", adapter.name));
    let (width, height) = SIZE;
    let last = &exhibit.rehearsal.last;
    let moving = exhibit.place(last, shape)?;
    let camera = exhibit.camera(width as f64 / height as f64);
    let mut scene = exhibit.scene3d(&adapter.device, &adapter.queue, Samples::Four);
    let target = Target::new(
        &adapter.device,
        [width as u32, height as u32],
        Samples::Four,
    );
    scene.draw(&adapter.device, &adapter.queue, &moving, &camera, &target);
    let pixels = target
        .read(&adapter.device, &adapter.queue)
        .map_err(failed)?;

    let mut picture = Overlay::new(pixels, SIZE, 1);
    picture.text(&exhibit.title, (40, 22), 37);
    let moment = format!(
        "travel {:.3} mm    force {:.3} N    {} contacts",
        1e3 * last.travel,
        last.resistance,
        last.report.contacts,
    );
    picture.text(&moment, (40, 72), 27);
    let largest = crate::shape::largest(shape.update(&last.contacts)?);
    picture.colour_bar(&exhibit.bar, 1e3 * largest);
    picture.axes(|axis| camera.on_picture(axis));
    picture.scale_bar(camera.pixels_per_metre(height as f64));
    let legend = format!(
        "to scale; grid of {} mm; arrows: forces on the part, blue where they stick",
        short(1e3 * exhibit.ground_step)
    );
    picture.text(&legend, (350, 908), 25);
    let pixels = picture.finish().map_err(failed)?;
    encode(&pixels, SIZE).map_err(failed)
}
