//! What the scene is drawn into: colour with four samples per pixel, depth, and the picture that comes of it.

use super::BACKGROUND;

pub(super) const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Bytes of a row in a buffer are a multiple of this.
const ROW: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;

/// Samples per pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::viewer) enum Samples {
    /// Edges have steps; for a processor that plays an adapter, which has less to do so.
    One,
    /// Smooth edges; what every adapter has.
    Four,
}

impl Samples {
    pub(super) fn count(self) -> u32 {
        match self {
            Self::One => 1,
            Self::Four => 4,
        }
    }
}

/// A picture on the adapter.
pub(in crate::viewer) struct Target {
    samples: wgpu::TextureView,
    depth: wgpu::TextureView,
    picture: wgpu::Texture,
    view: wgpu::TextureView,
    has_samples: bool,
}

impl Target {
    /// Of a size in pixels, each at least 1.
    pub(in crate::viewer) fn new(device: &wgpu::Device, size: [u32; 2], samples: Samples) -> Self {
        let n_samples = samples.count();
        let texture = |name, format, sample_count, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(name),
                size: wgpu::Extent3d {
                    width: size[0].max(1),
                    height: size[1].max(1),
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        };
        let view =
            |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        let attached = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let picture = texture(
            "picture",
            COLOUR,
            1,
            attached | wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC,
        );
        Self {
            samples: view(&texture("samples", COLOUR, n_samples, attached)),
            depth: view(&texture("depth", DEPTH, n_samples, attached)),
            view: view(&picture),
            picture,
            has_samples: n_samples > 1,
        }
    }

    /// Width and height, pixels.
    pub(in crate::viewer) fn size(&self) -> [u32; 2] {
        [self.picture.width(), self.picture.height()]
    }

    /// The picture.
    pub(in crate::viewer) fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// A pass that begins with the background.
    pub(super) fn begin<'e>(&self, encoder: &'e mut wgpu::CommandEncoder) -> wgpu::RenderPass<'e> {
        let [r, g, b] = BACKGROUND;
        let (view, resolve_target, store) = if self.has_samples {
            (&self.samples, Some(&self.view), wgpu::StoreOp::Discard)
        } else {
            (&self.view, None, wgpu::StoreOp::Store)
        };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("scene"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 1.0 }),
                    store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        })
    }

    /// The picture back from the adapter, three bytes per pixel, rows from the top. Waits for it.
    ///
    /// # Errors
    /// What the adapter says.
    pub(in crate::viewer) fn read(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
    ) -> Result<Vec<u8>, String> {
        let [width, height] = self.size();
        let row = (4 * width).next_multiple_of(ROW);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: u64::from(row) * u64::from(height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_texture_to_buffer(
            self.picture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
                    rows_per_image: None,
                },
            },
            self.picture.size(),
        );
        queue.submit([encoder.finish()]);
        buffer.map_async(wgpu::MapMode::Read, .., |_| {});
        device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|e| e.to_string())?;
        let bytes = buffer.get_mapped_range(..).map_err(|e| e.to_string())?;
        let rows = bytes.chunks_exact(row as usize);
        let pixels = rows.flat_map(|row| row[..4 * width as usize].chunks_exact(4));
        Ok(pixels.flat_map(|p| [p[0], p[1], p[2]]).collect())
    }
}
