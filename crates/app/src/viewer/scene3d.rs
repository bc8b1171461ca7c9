//! The 3-D scene on a graphics adapter: drawn into a target of its own, for the window and for pictures alike.

mod pipelines;
mod target;

use bytemuck::{Pod, Zeroable};
use glamx::DPose3;
use wgpu::util::DeviceExt;

use super::camera::Camera;
use super::skin::{Line, Vertex};
use crate::report::render::colour;
use pipelines::Pipelines;
pub(super) use target::{Samples, Target};

/// Behind everything.
pub(super) const BACKGROUND: [f64; 3] = [0.965, 0.97, 0.975];

/// Share of the light that shade keeps.
const SHADE: f32 = 0.58;

/// Of the depth, how far lines stand before their surface.
const LINE_LIFT: f32 = 4e-4;

/// What the shader knows of the camera.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct View {
    view_projection: [[f32; 4]; 4],
    to_light: [f32; 4],
    into: [f32; 4],
    frame: [f32; 4],
}

/// What does not change: topology of the part, tool, ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct Still<'a> {
    /// Of the part, in its vertices.
    pub(super) triangles: &'a [[u32; 3]],
    pub(super) n_vertices: usize,
    pub(super) tool: &'a [Vertex],
    pub(super) tool_lines: &'a [Line],
    pub(super) ground: &'a [Line],
}

/// What changes from picture to picture.
#[derive(Clone, Debug)]
pub(super) struct Moving {
    /// Of the part, in its own frame.
    pub(super) vertices: Vec<Vertex>,
    pub(super) lines: Vec<Line>,
    /// In the part's frame.
    pub(super) arrows: Vec<Vertex>,
    pub(super) pose_world_part: DPose3,
    pub(super) pose_world_tool: DPose3,
}

impl Default for Moving {
    fn default() -> Self {
        Self {
            vertices: Vec::new(),
            lines: Vec::new(),
            arrows: Vec::new(),
            pose_world_part: DPose3::IDENTITY,
            pose_world_tool: DPose3::IDENTITY,
        }
    }
}

/// A body's frame on the adapter.
struct Frame {
    buffer: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// Vertices on the adapter that are written anew for each picture; grows, and never shrinks.
struct Stream {
    name: &'static str,
    buffer: wgpu::Buffer,
    len: u32,
}

/// The scene.
pub(super) struct Scene3d {
    pipelines: Pipelines,
    view: wgpu::Buffer,
    view_group: wgpu::BindGroup,
    world: Frame,
    part: Frame,
    tool: Frame,
    part_indices: (wgpu::Buffer, u32),
    part_vertices: Stream,
    part_lines: Stream,
    arrows: Stream,
    tool_vertices: Stream,
    tool_lines: Stream,
    ground: Stream,
    /// m, before and behind the middle of the picture.
    reach: f64,
}

impl Scene3d {
    /// `reach`: m, how far the scene goes from the middle of the picture at most. `samples`: as those of its targets.
    pub(super) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        still: &Still<'_>,
        reach: f64,
        samples: Samples,
    ) -> Self {
        let pipelines = Pipelines::new(device, samples);
        let view = uniform::<View>(device, "camera");
        let colours = colour_scale(device, queue);
        let view_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("camera"),
            layout: &pipelines.view_layout,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: view.as_entire_binding(),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::TextureView(&colours),
                },
            ],
        });
        let frame = |name| Frame::new(device, queue, &pipelines.frame_layout, name);
        let indices = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("triangles of the part"),
            contents: bytemuck::cast_slice(still.triangles),
            usage: wgpu::BufferUsages::INDEX,
        });
        let stream = |name, n: usize| Stream::new(device, name, n);
        let mut scene = Self {
            view,
            view_group,
            world: frame("world"),
            part: frame("part"),
            tool: frame("tool"),
            part_indices: (indices, 3 * still.triangles.len() as u32),
            part_vertices: stream("part", still.n_vertices * size_of::<Vertex>()),
            part_lines: stream("edges of the part", 0),
            arrows: stream("forces", 0),
            tool_vertices: stream("tool", 0),
            tool_lines: stream("edges of the tool", 0),
            ground: stream("ground", 0),
            pipelines,
            reach,
        };
        scene.tool_vertices.write(device, queue, still.tool);
        scene.tool_lines.write(device, queue, still.tool_lines);
        scene.ground.write(device, queue, still.ground);
        scene
    }

    /// Draws a moment into a target.
    pub(super) fn draw(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        moving: &Moving,
        camera: &Camera,
        target: &Target,
    ) {
        let [width, height] = target.size();
        let aspect = f64::from(width) / f64::from(height);
        let [light, into] = [camera.to_light(), camera.into()].map(|v| v.as_vec3());
        let view = View {
            view_projection: camera.view_projection(aspect, self.reach),
            to_light: light.extend(SHADE).to_array(),
            into: into.extend(0.0).to_array(),
            frame: [width as f32, height as f32, LINE_LIFT, 0.0],
        };
        queue.write_buffer(&self.view, 0, bytemuck::bytes_of(&view));
        self.part.write(queue, &moving.pose_world_part);
        self.tool.write(queue, &moving.pose_world_tool);
        self.part_vertices.write(device, queue, &moving.vertices);
        self.part_lines.write(device, queue, &moving.lines);
        self.arrows.write(device, queue, &moving.arrows);

        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = target.begin(&mut encoder);
            pass.set_bind_group(0, &self.view_group, &[]);
            self.record(&mut pass);
        }
        queue.submit([encoder.finish()]);
    }

    fn record(&self, pass: &mut wgpu::RenderPass<'_>) {
        let pipelines = &self.pipelines;
        self.ground.lines(pass, &pipelines.line, &self.world);

        pass.set_pipeline(&pipelines.part);
        pass.set_bind_group(1, &self.part.group, &[]);
        pass.set_vertex_buffer(0, self.part_vertices.buffer.slice(..));
        pass.set_index_buffer(self.part_indices.0.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.part_indices.1, 0, 0..1);
        self.part_lines.lines(pass, &pipelines.line, &self.part);

        self.arrows.triangles(pass, &pipelines.solid, &self.part);
        // First its inside, then its outside.
        for glass in [&pipelines.glass_back, &pipelines.glass_front] {
            self.tool_vertices.triangles(pass, glass, &self.tool);
        }
        self.tool_lines.lines(pass, &pipelines.line, &self.tool);
        // A force that is hidden is still a force.
        self.arrows.triangles(pass, &pipelines.hidden, &self.part);
    }
}

impl Frame {
    fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        layout: &wgpu::BindGroupLayout,
        name: &str,
    ) -> Self {
        let buffer = uniform::<[[f32; 4]; 4]>(device, name);
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(name),
            layout,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: buffer.as_entire_binding(),
            }],
        });
        let frame = Self { buffer, group };
        frame.write(queue, &DPose3::IDENTITY);
        frame
    }

    fn write(&self, queue: &wgpu::Queue, pose: &DPose3) {
        let axis = |v: glam::DVec3| (pose.rotation * v).as_vec3().extend(0.0).to_array();
        let columns = [
            axis(glam::DVec3::X),
            axis(glam::DVec3::Y),
            axis(glam::DVec3::Z),
            pose.translation.as_vec3().extend(1.0).to_array(),
        ];
        queue.write_buffer(&self.buffer, 0, bytemuck::bytes_of(&columns));
    }
}

impl Stream {
    /// With room for so many bytes.
    fn new(device: &wgpu::Device, name: &'static str, n_bytes: usize) -> Self {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(name),
            size: (n_bytes as u64).max(256).next_multiple_of(4),
            usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self {
            name,
            buffer,
            len: 0,
        }
    }

    fn write<T: Pod>(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, items: &[T]) {
        let bytes: &[u8] = bytemuck::cast_slice(items);
        if bytes.len() as u64 > self.buffer.size() {
            *self = Self::new(device, self.name, 2 * bytes.len());
        }
        self.len = items.len() as u32;
        if !bytes.is_empty() {
            queue.write_buffer(&self.buffer, 0, bytes);
        }
    }

    fn triangles(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        frame: &Frame,
    ) {
        self.bind(pass, pipeline, frame);
        pass.draw(0..self.len, 0..1);
    }

    fn lines(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        frame: &Frame,
    ) {
        self.bind(pass, pipeline, frame);
        pass.draw(0..6, 0..self.len);
    }

    fn bind(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        frame: &Frame,
    ) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(1, &frame.group, &[]);
        pass.set_vertex_buffer(0, self.buffer.slice(..));
    }
}

fn uniform<T>(device: &wgpu::Device, name: &str) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(name),
        size: size_of::<T>() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// The report's colour scale as a texture.
fn colour_scale(device: &wgpu::Device, queue: &wgpu::Queue) -> wgpu::TextureView {
    let bytes: Vec<u8> = colour::map()
        .iter()
        .flat_map(|[r, g, b]| [*r, *g, *b, 1.0].map(|c| (255.0 * c).round() as u8))
        .collect();
    let descriptor = wgpu::TextureDescriptor {
        label: Some("colour scale"),
        size: wgpu::Extent3d {
            width: 256,
            height: 1,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    };
    device
        .create_texture_with_data(
            queue,
            &descriptor,
            wgpu::util::TextureDataOrder::LayerMajor,
            &bytes,
        )
        .create_view(&wgpu::TextureViewDescriptor::default())
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::arrows::{Force, arrows_into};
    use super::super::picture::Adapter;
    use super::super::skin::Skin;
    use super::*;
    use crate::report::{PartDrawing, View as Look};

    /// Pixels of the size.
    const SIZE: [u32; 2] = [240, 160];

    /// A tetrahedron of 10 mm with its first corner in the origin.
    fn part() -> PartDrawing {
        PartDrawing {
            nodes: [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]
                .map(|x| 0.01 * x)
                .to_vec(),
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            ..PartDrawing::default()
        }
    }

    fn drawn(adapter: &Adapter, displacement: &[f64]) -> (Camera, Vec<u8>) {
        let part = part();
        let skin = Skin::new(&part, &[0, 1, 2, 3]);
        let mut moving = Moving::default();
        skin.vertices_into(displacement, 0.01, &mut moving.vertices);
        let force = Force {
            point: DVec3::new(0.01, 0.0, 0.0),
            force: DVec3::NEG_X,
            sticks: false,
        };
        arrows_into(&[force], 0.004, 0.02, &mut moving.arrows);
        let still = Still {
            triangles: &skin.triangles,
            n_vertices: skin.n_vertices(),
            tool: &[],
            tool_lines: &[],
            ground: &[],
        };
        let (device, queue) = (&adapter.device, &adapter.queue);
        let look = Look {
            direction: DVec3::new(-0.3, -0.2, -1.0),
            up: DVec3::Y,
        };
        let camera = Camera::fit(&look, &part.nodes, 1.5);
        let target = Target::new(device, SIZE, Samples::Four);
        let mut scene = Scene3d::new(device, queue, &still, 0.1, Samples::Four);
        scene.draw(device, queue, &moving, &camera, &target);
        (camera, target.read(device, queue).unwrap())
    }

    fn colour_at(pixels: &[u8], camera: &Camera, point: DVec3) -> [u8; 3] {
        let size = SIZE.map(f64::from);
        let [x, y] = camera.pixel(point, size).map(|v| v as usize);
        let at = 3 * (y * SIZE[0] as usize + x);
        [pixels[at], pixels[at + 1], pixels[at + 2]]
    }

    #[test]
    fn the_part_is_where_the_camera_says_and_moves_with_its_displacement() {
        let adapter = match Adapter::first() {
            Ok(adapter) => adapter,
            Err(e) => return eprintln!("skipped: {e}"),
        };
        let background = BACKGROUND.map(|c| (255.0 * c).round() as u8);
        let (camera, rest) = drawn(&adapter, &[0.0; 12]);
        let inside = DVec3::splat(0.01 / 3.0);
        let below = DVec3::new(0.002, -0.0015, 0.0);
        let far = |a: [u8; 3], b: [u8; 3]| (0..3).any(|i| a[i].abs_diff(b[i]) > 8);
        assert!(far(colour_at(&rest, &camera, inside), background));
        assert!(!far(colour_at(&rest, &camera, below), background));
        // The arrow's shaft, and not the part's scale.
        let [r, g, b] = colour_at(&rest, &camera, DVec3::new(0.0125, 0.0, 0.0));
        assert!(r > 2 * g && r > b, "{r} {g} {b}");

        // All of it goes down by 3 mm.
        let (camera, moved) = drawn(&adapter, &[0.0, -0.003, 0.0].repeat(4));
        assert!(far(colour_at(&moved, &camera, below), background));
        assert!(far(
            colour_at(&moved, &camera, inside - 0.003 * DVec3::Y),
            colour_at(&rest, &camera, inside)
        ));
    }
}
