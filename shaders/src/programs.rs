//! The programs that draw: for each the words of its two modules, what it reads and what it gives. `tests/reflection.rs`
//! holds this table against the modules themselves.

use crate::kernels::words;

/// A vertex and a fragment shader of this package; nobody else makes one, so executors may trust their words.
#[derive(Debug, PartialEq)]
#[non_exhaustive]
pub struct Program {
    /// Its files' name without the extensions.
    pub name: &'static str,
    /// SPIR-V 1.3, little endian: places triangles.
    pub vertex: &'static [u8],
    /// The same: what they give to pixels.
    pub fragment: &'static [u8],
    /// Storage buffers of set 0, binding 0 onwards; both modules see them, neither writes.
    pub bindings: u32,
    /// Size of the push constants of both, bytes.
    pub push_bytes: u32,
    /// How many numbers each output has.
    pub outputs: &'static [u32],
}

impl Program {
    /// The words of both modules.
    pub fn words(&self) -> [Vec<u32>; 2] {
        [self.vertex, self.fragment].map(words)
    }
}

macro_rules! programs {
    ($($(#[$about:meta])* $constant:ident = $file:literal [$bindings:literal] -> [$($numbers:literal),*] $(push $push:literal)?;)*) => {
        $(
            $(#[$about])*
            pub static $constant: Program = Program {
                name: $file,
                vertex: include_bytes!(concat!("../spirv/", $file, ".vert.spv")),
                fragment: include_bytes!(concat!("../spirv/", $file, ".frag.spv")),
                bindings: $bindings,
                push_bytes: 0 $(+ $push)?,
                outputs: &[$($numbers),*],
            };
        )*

        /// Every program.
        pub static ALL: &[&Program] = &[$(&$constant),*];
    };
}

programs! {
    /// A rectangle of pixels a splat, in order: view, order, splats, values, tables, opaque depths → premultiplied
    /// channels and opacity; optical depth. Push: plane, three channels.
    SPLAT_DRAW = "splat_draw" [6] -> [4, 1] push 16;
}
