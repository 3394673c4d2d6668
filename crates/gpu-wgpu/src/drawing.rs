//! Draws: programs as wgpu compiles them, images, and the passes that blend into them.

use splat_shaders::{Blend, Corners, Draw, Format, Image, Program, Target};

/// Memory of an image, and how draws see it.
pub(crate) struct Texture {
    raw: wgpu::Texture,
    view: wgpu::TextureView,
    of: Image,
}

impl Texture {
    pub(crate) fn new(device: &wgpu::Device, of: &Image) -> Self {
        let raw = device.create_texture(&wgpu::TextureDescriptor {
            label: Some(of.name),
            size: extent(of),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: format(of.format),
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = raw.create_view(&wgpu::TextureViewDescriptor::default());
        Self { raw, view, of: of.clone() }
    }

    /// Copies its rows, as far apart as recordings say.
    pub(crate) fn copy(&self, encoder: &mut wgpu::CommandEncoder, buffer: &wgpu::Buffer) {
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: u32::try_from(self.of.row_bytes()).ok(),
            rows_per_image: None,
        };
        let to = wgpu::TexelCopyBufferInfo { buffer, layout };
        encoder.copy_texture_to_buffer(self.raw.as_image_copy(), to, extent(&self.of));
    }
}

fn extent(of: &Image) -> wgpu::Extent3d {
    wgpu::Extent3d { width: of.size[0], height: of.size[1], depth_or_array_layers: 1 }
}

fn format(format: Format) -> wgpu::TextureFormat {
    match format {
        Format::R32F => wgpu::TextureFormat::R32Float,
        Format::Rgba32F => wgpu::TextureFormat::Rgba32Float,
        Format::R16F => wgpu::TextureFormat::R16Float,
        Format::Rgba16F => wgpu::TextureFormat::Rgba16Float,
    }
}

fn blended(blend: Blend) -> wgpu::BlendState {
    use wgpu::BlendFactor as Factor;
    let add =
        |src_factor, dst_factor| wgpu::BlendComponent { src_factor, dst_factor, operation: wgpu::BlendOperation::Add };
    let [color, alpha] = match blend {
        Blend::Add => [add(Factor::One, Factor::One); 2],
        Blend::Over => [add(Factor::One, Factor::OneMinusSrcAlpha); 2],
        Blend::Under => [add(Factor::DstAlpha, Factor::One), add(Factor::Zero, Factor::OneMinusSrcAlpha)],
    };
    wgpu::BlendState { color, alpha }
}

/// The program for images of these formats, blended so.
pub(crate) fn compile(device: &wgpu::Device, program: &Program, targets: &[(Format, Blend)]) -> wgpu::RenderPipeline {
    let label = Some(program.name);
    let entry = |binding| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let entries: Vec<_> = (0..program.bindings).map(entry).collect();
    let group = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label, entries: &entries });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label,
        bind_group_layouts: &[Some(&group)],
        immediate_size: program.push_bytes,
    });
    let module = |words: Vec<u32>| {
        let source = wgpu::ShaderSource::SpirV(words.into());
        device.create_shader_module(wgpu::ShaderModuleDescriptor { label, source })
    };
    let [vertex, fragment] = program.words().map(module);
    let target = |&(of, blend): &(Format, Blend)| {
        let (format, write_mask) = (format(of), wgpu::ColorWrites::ALL);
        Some(wgpu::ColorTargetState { format, blend: Some(blended(blend)), write_mask })
    };
    let targets: Vec<_> = targets.iter().map(target).collect();
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label,
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &vertex,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..wgpu::PrimitiveState::default()
        },
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &fragment,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// A draw with its program and buffers bound.
pub(crate) struct BoundDraw {
    pub(crate) draw: Draw,
    pub(crate) pipeline: wgpu::RenderPipeline,
    pub(crate) group: wgpu::BindGroup,
}

impl BoundDraw {
    /// One pass of this draw alone.
    pub(crate) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        textures: &[Texture],
        buffers: &[wgpu::Buffer],
        timestamp_writes: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) {
        let attachment = |target: &Target| {
            let load = target.clear.map_or(wgpu::LoadOp::Load, |c| {
                let [r, g, b, a] = c.map(f64::from);
                wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a })
            });
            Some(wgpu::RenderPassColorAttachment {
                view: &textures[target.image.index()].view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
            })
        };
        let attachments: Vec<_> = self.draw.targets.iter().map(attachment).collect();
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(self.draw.program.name),
            color_attachments: &attachments,
            timestamp_writes,
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        if !self.draw.push.is_empty() {
            pass.set_immediates(0, &self.draw.push);
        }
        match self.draw.corners {
            Corners::Direct([corners, strips]) => pass.draw(0..corners, 0..strips),
            Corners::Indirect { buffer, offset } => pass.draw_indirect(&buffers[buffer.index()], offset),
        }
    }
}
