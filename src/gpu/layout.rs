//! Structs that Rust and WGSL share: one declaration gives the bytes and the offsets, which tests compare with the
//! shader's.

/// Where one field of a shared struct lies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FieldLayout {
    /// Its name on both sides.
    pub name: &'static str,
    /// Bytes from the struct's start.
    pub offset: usize,
}

/// How Rust lays out a struct that a shader reads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StructLayout {
    /// Its name on both sides.
    pub name: &'static str,
    /// Bytes, padding included.
    pub size: usize,
    /// In order.
    pub fields: Vec<FieldLayout>,
}

/// Declares a struct that is handed to shaders byte by byte, with its layout for the tests.
macro_rules! shader_struct {
    ($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $type:ty,)* }) => {
        $(#[$doc])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        pub(crate) struct $name {
            $($(#[$field_doc])* pub(crate) $field: $type,)*
        }

        impl $name {
            /// Where its fields lie.
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
