//! A window's device multiplies and draws: the displacement goes from the multiply to the vertices without leaving it.
//!
//! One triangle covers the left half of a picture of 64 x 64 pixels and 2 m. Under a force of 1 N its three nodes move
//! by 1 m: to the right it covers all of the picture, to the left nothing of it. Nothing but the picture is read back. Done on each adapter that is found; without one, the test says so and sees that there is nothing to draw
//! with.

#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use gpu::{Adapters, Connection, Gpu, GpuSettings, Layout};

const SIDE: u32 = 64;

const SHADER: &str = "
@vertex
fn place(@location(0) rest: vec3<f32>, @location(1) displacement: vec3<f32>) -> @builtin(position) vec4<f32> {
    return vec4<f32>(rest + displacement, 1.0);
}

@fragment
fn white() -> @location(0) vec4<f32> {
    return vec4<f32>(1.0);
}
";

/// What a window has.
struct Window {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::RenderPipeline,
    rest: wgpu::Buffer,
}

impl Window {
    fn new(adapter: &wgpu::Adapter) -> Self {
        let asked = wgpu::DeviceDescriptor {
            required_limits: wgpu::Limits::downlevel_defaults(),
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&asked)).unwrap();
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let of_nodes = |shader_location| wgpu::VertexBufferLayout {
            array_stride: 12,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: match shader_location {
                0 => &wgpu::vertex_attr_array![0 => Float32x3],
                _ => &wgpu::vertex_attr_array![1 => Float32x3],
            },
        };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("place"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[Some(of_nodes(0)), Some(of_nodes(1))],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("white"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(wgpu::TextureFormat::Rgba8Unorm.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        // Larger than the left half above and below, cut off by the picture; its right edge is the middle.
        let rest: [f32; 9] = [0.0, -9.0, 0.5, 0.0, 9.0, 0.5, -9.0, 0.0, 0.5];
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: 36,
            usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        queue.write_buffer(&buffer, 0, bytemuck::cast_slice(&rest));
        Self {
            device,
            queue,
            pipeline,
            rest: buffer,
        }
    }

    /// Which columns of pixels are white, in the middle row.
    fn draw(&self, displacement: &wgpu::Buffer) -> Vec<bool> {
        let size = wgpu::Extent3d {
            width: SIDE,
            height: SIDE,
            depth_or_array_layers: 1,
        };
        let picture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = picture.create_view(&wgpu::TextureViewDescriptor::default());
        let pixels = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(4 * SIDE * SIDE),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let described = wgpu::CommandEncoderDescriptor::default();
        let mut encoder = self.device.create_command_encoder(&described);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_vertex_buffer(0, self.rest.slice(..));
        pass.set_vertex_buffer(1, displacement.slice(0..36));
        pass.draw(0..3, 0..1);
        drop(pass);
        encoder.copy_texture_to_buffer(
            picture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &pixels,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(4 * SIDE),
                    rows_per_image: None,
                },
            },
            size,
        );
        self.queue.submit([encoder.finish()]);
        pixels.map_async(wgpu::MapMode::Read, .., |mapped| mapped.unwrap());
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .unwrap();
        let row = (4 * SIDE * SIDE / 2) as usize;
        let range = pixels.get_mapped_range(..).unwrap();
        range[row..row + 4 * SIDE as usize]
            .chunks_exact(4)
            .map(|pixel| pixel[0] == 255)
            .collect()
    }
}

#[test]
fn displaced_surface_is_drawn_from_the_result_without_a_copy() {
    let asked = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    let backends = asked.backends;
    let instance = wgpu::Instance::new(asked);
    let adapters = pollster::block_on(instance.enumerate_adapters(backends));
    if adapters.is_empty() {
        eprintln!("no adapter");
        assert!(Adapters::find().best(true).is_err());
    }
    // Row k moves by 1 m along x for each newton along x.
    let layout = Layout::new(3, 1).unwrap();
    let mut blocks = vec![0.0; layout.n_scalars()];
    for row in 0..3 {
        blocks[Layout::block_offset(3, row, 0)] = 1.0;
    }
    for adapter in adapters {
        let name = adapter.get_info().name;
        eprintln!("on {name}");
        let window = Window::new(&adapter);
        let connection =
            Connection::shared(window.device.clone(), window.queue.clone(), name, true);
        let mut gpu =
            Gpu::on_device(connection, layout, &[&blocks], GpuSettings::default()).unwrap();

        gpu.multiply_on_device(&[], &[]).unwrap();
        let at_rest = window.draw(gpu.displacement_buffer());
        gpu.multiply_on_device(&[0], &[1.0, 0.0, 0.0]).unwrap();
        let displaced = window.draw(gpu.displacement_buffer());
        for pixel in 0..SIDE as usize {
            let is_left = pixel < SIDE as usize / 2;
            assert_eq!(at_rest[pixel], is_left, "pixel {pixel} at rest");
            assert!(
                displaced[pixel],
                "pixel {pixel}: the triangle's edge is at the picture's now"
            );
        }
        // Back to the left by two: out of the picture.
        gpu.multiply_on_device(&[0], &[-1.0, 0.0, 0.0]).unwrap();
        assert!(
            window
                .draw(gpu.displacement_buffer())
                .iter()
                .all(|white| !white)
        );
    }
}
