//! Assembles WGSL modules from files by name.

/// One WGSL file, built into the program.
#[derive(Clone, Copy, Debug)]
pub struct ShaderFile {
    /// Its path below `shaders/` without the ending: `shared/srgb`.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
}

/// A shader module: the files it is put together from, in order.
#[derive(Clone, Copy, Debug)]
pub struct Program {
    /// For messages and captures.
    pub name: &'static str,
    /// What it consists of.
    pub sources: &'static [ShaderFile],
}

/// A file of `shaders/` by its name.
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
    /// The whole WGSL text; each part starts with a comment that names its file.
    pub fn wgsl(&self) -> String {
        let parts = self.sources.iter();
        parts
            .map(|source| format!("// {}\n{}\n", source.name, source.text))
            .collect()
    }

    /// Compiles it on a device. Faults surface through the device's error callback.
    pub(crate) fn module(&self, device: &wgpu::Device) -> wgpu::ShaderModule {
        device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(self.name),
            source: wgpu::ShaderSource::Wgsl(self.wgsl().into()),
        })
    }
}
