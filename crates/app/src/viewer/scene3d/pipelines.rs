//! How each kind of thing is drawn.

use super::super::skin::{Line, Vertex};
use super::target::{COLOUR, DEPTH, Samples};

/// One for each kind, and what they are given.
pub(super) struct Pipelines {
    pub(super) view_layout: wgpu::BindGroupLayout,
    pub(super) frame_layout: wgpu::BindGroupLayout,
    pub(super) part: wgpu::RenderPipeline,
    pub(super) solid: wgpu::RenderPipeline,
    pub(super) hidden: wgpu::RenderPipeline,
    pub(super) glass_back: wgpu::RenderPipeline,
    pub(super) glass_front: wgpu::RenderPipeline,
    pub(super) line: wgpu::RenderPipeline,
}

/// What sets a kind apart.
struct Kind {
    name: &'static str,
    vertex: &'static str,
    fragment: &'static str,
    /// What is nearer than this is drawn, and is then what hides.
    hides: bool,
    compare: wgpu::CompareFunction,
    cull: Option<wgpu::Face>,
}

impl Pipelines {
    pub(super) fn new(device: &wgpu::Device, samples: Samples) -> Self {
        let shader = device.create_shader_module(wgpu::include_wgsl!("../scene3d.wgsl"));
        let view_layout = layout(
            device,
            &[
                (wgpu::ShaderStages::VERTEX_FRAGMENT, UNIFORM),
                (wgpu::ShaderStages::FRAGMENT, TEXTURE),
            ],
        );
        let frame_layout = layout(device, &[(wgpu::ShaderStages::VERTEX, UNIFORM)]);
        let all = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&view_layout), Some(&frame_layout)],
            immediate_size: 0,
        });
        let lit = |name, fragment| Kind {
            name,
            vertex: "vertex_lit",
            fragment,
            hides: true,
            compare: wgpu::CompareFunction::Less,
            cull: None,
        };
        let glass = |name, cull| Kind {
            hides: false,
            cull: Some(cull),
            ..lit(name, "fragment_glass")
        };
        let make = |kind: Kind| kind.pipeline(device, &all, &shader, samples);
        Self {
            part: make(lit("part", "fragment_part")),
            solid: make(lit("forces", "fragment_solid")),
            hidden: make(Kind {
                hides: false,
                compare: wgpu::CompareFunction::Greater,
                cull: Some(wgpu::Face::Back),
                ..lit("hidden forces", "fragment_hidden")
            }),
            glass_back: make(glass("inside of the tool", wgpu::Face::Front)),
            glass_front: make(glass("tool", wgpu::Face::Back)),
            line: make(Kind {
                vertex: "vertex_line",
                hides: false,
                ..lit("lines", "fragment_line")
            }),
            view_layout,
            frame_layout,
        }
    }
}

impl Kind {
    fn pipeline(
        &self,
        device: &wgpu::Device,
        layout: &wgpu::PipelineLayout,
        shader: &wgpu::ShaderModule,
        samples: Samples,
    ) -> wgpu::RenderPipeline {
        let vertices = if self.vertex == "vertex_line" {
            wgpu::VertexBufferLayout {
                array_stride: size_of::<Line>() as u64,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x4, 3 => Float32],
            }
        } else {
            wgpu::VertexBufferLayout {
                array_stride: size_of::<Vertex>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x4],
            }
        };
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.name),
            layout: Some(layout),
            vertex: wgpu::VertexState {
                module: shader,
                entry_point: Some(self.vertex),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[Some(vertices)],
            },
            primitive: wgpu::PrimitiveState {
                cull_mode: self.cull,
                ..wgpu::PrimitiveState::default()
            },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(self.hides),
                depth_compare: Some(self.compare),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState {
                count: samples.count(),
                ..wgpu::MultisampleState::default()
            },
            fragment: Some(wgpu::FragmentState {
                module: shader,
                entry_point: Some(self.fragment),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format: COLOUR,
                    blend: (!self.hides).then_some(wgpu::BlendState::ALPHA_BLENDING),
                    write_mask: wgpu::ColorWrites::ALL,
                })],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

const UNIFORM: wgpu::BindingType = wgpu::BindingType::Buffer {
    ty: wgpu::BufferBindingType::Uniform,
    has_dynamic_offset: false,
    min_binding_size: None,
};

const TEXTURE: wgpu::BindingType = wgpu::BindingType::Texture {
    sample_type: wgpu::TextureSampleType::Float { filterable: false },
    view_dimension: wgpu::TextureViewDimension::D2,
    multisampled: false,
};

fn layout(
    device: &wgpu::Device,
    bindings: &[(wgpu::ShaderStages, wgpu::BindingType)],
) -> wgpu::BindGroupLayout {
    let entries: Vec<wgpu::BindGroupLayoutEntry> = bindings
        .iter()
        .zip(0..)
        .map(|(&(visibility, ty), binding)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty,
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &entries,
    })
}
