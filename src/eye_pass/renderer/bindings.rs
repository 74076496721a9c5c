//! Bind groups and their layouts.

use bytemuck::Pod;

use crate::gpu::{Gpu, cleared};

/// Type of a binding, with the stages that it is visible to.
pub(super) type Binding = (wgpu::ShaderStages, wgpu::BindingType);

pub(super) const fn uniform(stages: wgpu::ShaderStages) -> Binding {
    let buffer = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    (stages, buffer)
}

pub(super) const fn texture(filterable: bool, view_dimension: wgpu::TextureViewDimension) -> Binding {
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable },
        view_dimension,
        multisampled: false,
    };
    (wgpu::ShaderStages::FRAGMENT, texture)
}

/// A buffer that fragment shaders read.
pub(super) const fn storage() -> Binding {
    let buffer = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Storage { read_only: true },
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    (wgpu::ShaderStages::FRAGMENT, buffer)
}

/// A layout whose bindings are numbered in order.
pub(super) fn bind_group_layout(gpu: &Gpu, label: &str, bindings: &[Binding]) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = (0..)
        .zip(bindings)
        .map(|(binding, (visibility, ty))| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: *visibility,
            ty: *ty,
            count: None,
        })
        .collect();
    gpu.device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(label),
            entries: &entries,
        })
}

pub(super) fn pipeline_layout(gpu: &Gpu, groups: &[&wgpu::BindGroupLayout]) -> wgpu::PipelineLayout {
    let bind_group_layouts: Vec<_> = groups.iter().map(|layout| Some(*layout)).collect();
    gpu.device
        .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &bind_group_layouts,
            immediate_size: 0,
        })
}

/// Binds resources in the order of their layout.
pub(super) fn bind_group<const N: usize>(
    gpu: &Gpu,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    resources: [wgpu::BindingResource<'_>; N],
) -> wgpu::BindGroup {
    let entries: Vec<_> = (0..)
        .zip(resources)
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(label),
        layout,
        entries: &entries,
    })
}

/// A full-screen pipeline with the fragment stage `entry_point`. The module must include `shared/cover`.
pub(super) fn cover_pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    layout: &wgpu::BindGroupLayout,
    entry_point: &str,
    constants: &[(&str, f64)],
    target: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    // `cover` makes one triangle over the whole target from the vertex index, which needs no buffers and no depth.
    gpu.device
        .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(entry_point),
            layout: Some(&pipeline_layout(gpu, &[layout])),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some("cover"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(entry_point),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants,
                    ..Default::default()
                },
                targets: &[Some(target.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
}

/// Draws over the whole of a target with a pipeline of [`cover_pipeline`].
pub(super) fn cover(
    encoder: &mut wgpu::CommandEncoder,
    target: &wgpu::TextureView,
    (pipeline, bind_group): (&wgpu::RenderPipeline, &wgpu::BindGroup),
    timestamp_writes: Option<wgpu::RenderPassTimestampWrites<'_>>,
) {
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(cleared(target, wgpu::Color::BLACK))],
        timestamp_writes,
        ..Default::default()
    });
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, bind_group, &[]);
    pass.draw(0..3, 0..1);
}

/// A buffer that shaders read, with a copy of its contents on the CPU.
#[derive(Debug)]
pub(super) struct Storage {
    label: &'static str,
    buffer: wgpu::Buffer,
    written: Vec<u8>,
}

/// Minimum size of a buffer, even without contents [bytes].
const MIN_BYTES: u64 = 256;

impl Storage {
    pub(super) fn new(gpu: &Gpu, label: &'static str) -> Self {
        Self {
            label,
            buffer: buffer(gpu, label, MIN_BYTES),
            written: Vec::new(),
        }
    }

    /// Replaces the contents; uploads them if they differ. Returns the number of bytes uploaded.
    pub(super) fn write<T: Pod>(&mut self, gpu: &Gpu, items: &[T]) -> usize {
        let bytes: &[u8] = bytemuck::cast_slice(items);
        if bytes == self.written {
            return 0;
        }
        if bytes.len() as u64 > self.buffer.size() {
            self.buffer = buffer(gpu, self.label, (bytes.len() as u64).next_power_of_two());
        }
        gpu.queue.write_buffer(&self.buffer, 0, bytes);
        self.written = bytes.to_vec();
        bytes.len()
    }

    /// Overwrites existing items from index `first` on.
    pub(super) fn write_at<T: Pod>(&mut self, gpu: &Gpu, first: usize, items: &[T]) {
        let bytes: &[u8] = bytemuck::cast_slice(items);
        let offset = first * size_of::<T>();
        let written = &mut self.written[offset..offset + bytes.len()];
        if bytes != written {
            written.copy_from_slice(bytes);
            gpu.queue.write_buffer(&self.buffer, offset as u64, bytes);
        }
    }

    /// What it holds.
    pub(super) fn bytes(&self) -> &[u8] {
        &self.written
    }

    /// Vertex attributes are read from it, too.
    pub(super) fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    pub(super) fn binding(&self) -> wgpu::BindingResource<'_> {
        self.buffer.as_entire_binding()
    }
}

fn buffer(gpu: &Gpu, label: &str, size: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
