//! Structs that Rust and WGSL share: one declaration gives the bytes and the offsets, which tests compare with the
//! shader's.

/// Position of a field in a shared struct.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FieldLayout {
    /// Name on both sides.
    pub name: &'static str,
    /// Offset from the start of the struct [bytes].
    pub offset: usize,
}

/// Memory layout of a struct that a shader reads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StructLayout {
    /// Name on both sides.
    pub name: &'static str,
    /// Size including padding [bytes].
    pub size: usize,
    /// In order of declaration.
    pub fields: Vec<FieldLayout>,
}

/// Declares a struct that is copied to shaders byte by byte, and its layout for the tests.
macro_rules! shader_struct {
    ($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $type:ty,)* }) => {
        $(#[$doc])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        pub(crate) struct $name {
            $($(#[$field_doc])* pub(crate) $field: $type,)*
        }

        impl $name {
            /// Offsets of its fields.
            #[allow(dead_code, reason = "tests compare every struct with the shaders'")]
            pub(crate) fn layout() -> $crate::gpu::layout::StructLayout {
                $crate::gpu::layout::StructLayout {
                    name: stringify!($name),
                    size: size_of::<Self>(),
                    fields: vec![$($crate::gpu::layout::FieldLayout {
                        name: stringify!($field),
                        offset: std::mem::offset_of!($name, $field),
                    },)*],
                }
            }
        }
    };
}
pub(crate) use shader_struct;
