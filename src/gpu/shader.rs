//! Assembles WGSL modules from files by name.

/// A WGSL file, embedded in the program.
#[derive(Clone, Copy, Debug)]
pub struct ShaderFile {
    /// Path below `shaders/` without extension, as in `shared/srgb`.
    pub name: &'static str,
    pub text: &'static str,
}

/// A shader module, concatenated from files.
#[derive(Clone, Copy, Debug)]
pub struct Program {
    /// Label in messages and frame captures.
    pub name: &'static str,
    /// In this order.
    pub sources: &'static [ShaderFile],
}

/// Embeds a file of `shaders/`, given its name.
macro_rules! shader_source {
    ($name:literal) => {
        $crate::gpu::shader::ShaderFile {
            name: $name,
            text: include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/shaders/", $name, ".wgsl")),
        }
    };
}
pub(crate) use shader_source;

impl Program {
    /// The whole WGSL source; a comment with its name precedes each file.
    pub fn wgsl(&self) -> String {
        let parts = self.sources.iter();
        parts
            .map(|source| format!("// {}\n{}\n", source.name, source.text))
            .collect()
    }

    /// Compiles it on a device, whose error callback reports errors.
    pub(crate) fn module(&self, device: &wgpu::Device) -> wgpu::ShaderModule {
        device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(self.name),
            source: wgpu::ShaderSource::Wgsl(self.wgsl().into()),
        })
    }
}
