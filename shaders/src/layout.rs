//! Structs that both sides read: declared once in Rust, their GLSL is written from that.

/// A field of a shared struct.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// Its name on both sides.
    pub name: &'static str,
    /// Its type in GLSL.
    pub glsl: &'static str,
    /// Where it begins in the struct, bytes.
    pub offset: usize,
}

/// A struct whose GLSL is written from its declaration in Rust.
pub trait Layout: bytemuck::Pod {
    /// Name on both sides.
    const NAME: &'static str;
    /// Its fields in order.
    fn fields() -> Vec<Field>;

    /// The declaration in GLSL.
    fn glsl() -> String {
        let lines: String = Self::fields().iter().map(|f| format!("    {} {};\n", f.glsl, f.name)).collect();
        format!("struct {} {{\n{lines}}};\n", Self::NAME)
    }
}

/// A type that both sides have.
pub trait GlslType {
    /// Its name in GLSL.
    const NAME: &'static str;
}

macro_rules! glsl_types {
    ($($rust:ty => $glsl:literal),*) => { $(impl GlslType for $rust { const NAME: &'static str = $glsl; })* };
}
glsl_types!(u32 => "uint", f32 => "float", [f32; 2] => "vec2", [f32; 4] => "vec4", [u32; 2] => "uvec2", [u32; 4] => "uvec4");

/// Declares structs and implements [`Layout`] for each.
macro_rules! layouts {
    ($($(#[$about:meta])* pub struct $name:ident { $($(#[$field_about:meta])* pub $field:ident: $type:ty,)* })*) => {
        $(
            $(#[$about])*
            #[repr(C)]
            #[derive(Debug, Clone, Copy, PartialEq, Default, bytemuck::Pod, bytemuck::Zeroable)]
            pub struct $name { $($(#[$field_about])* pub $field: $type,)* }

            impl $crate::Layout for $name {
                const NAME: &'static str = stringify!($name);

                fn fields() -> Vec<$crate::Field> {
                    vec![$($crate::Field {
                        name: stringify!($field),
                        glsl: <$type as $crate::GlslType>::NAME,
                        offset: std::mem::offset_of!($name, $field),
                    }),*]
                }
            }
        )*

        /// Name, fields and size in bytes of every shared struct.
        pub fn structs() -> Vec<(&'static str, Vec<$crate::Field>, usize)> {
            use $crate::Layout;
            vec![$((<$name>::NAME, <$name>::fields(), size_of::<$name>())),*]
        }

        /// The text of `glsl/include/layouts.glsl`.
        pub fn glsl() -> String {
            use $crate::Layout;
            let structs = [$(<$name>::glsl()),*].join("\n");
            let most = format!("#define MOST_CHANNELS {}u", $crate::layouts::MOST_CHANNELS);
            format!("// Written by `cargo xtask shaders` from src/layouts.rs.\n\n{most}\n\n{structs}")
        }
    };
}
pub(crate) use layouts;
