//! Prints the shared structs in GLSL; `cargo xtask shaders` keeps what it says in `glsl/include/layouts.glsl`.

fn main() {
    print!("{}", splat_shaders::layouts::glsl());
}
