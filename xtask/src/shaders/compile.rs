//! The compiler's side: expands includes, compiles, writes or compares.

use super::{FOLDER, cargo};
use crate::repo::Outcome;
use glslang::{
    Compiler, CompilerOptions, Shader, ShaderInput, ShaderSource, ShaderStage, SpirvVersion, Target, VulkanVersion,
};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Vulkan 1.1: SPIR-V 1.3, the newest that naga reads whole.
const FLAGS: &str = "--target-env vulkan1.1 --target-env spirv1.3";

/// Files by their path under `shaders/`.
type Files = BTreeMap<String, Vec<u8>>;

pub(super) fn run(root: &Path, check: bool) -> Outcome {
    let folder = root.join(FOLDER);
    let kernels = names(&folder.join("glsl"), ".comp")?;
    if !check {
        // The crate that prints the structs holds the modules too: a kernel that has none yet must not stop it.
        let absent = kernels.iter().map(|k| folder.join(format!("spirv/{k}.spv"))).filter(|p| !p.exists());
        absent.into_iter().try_for_each(|p| fs::write(&p, []).map_err(|e| format!("{}: {e}", p.display())))?;
    }
    let mut made = Files::new();
    let structs = cargo(root, &["run", "--quiet", "--package", "organza-splat-shaders", "--example", "layouts"])?;
    made.insert("glsl/include/layouts.glsl".to_owned(), structs.into_bytes());
    let mut sources = Files::new();
    for include in names(&folder.join("glsl/include"), ".glsl")? {
        let path = format!("glsl/include/{include}.glsl");
        let text = made.get(&path).cloned().map_or_else(|| read(&folder, &path), Ok)?;
        sources.insert(path, text);
    }
    sources.insert("glsl/include/layouts.glsl".to_owned(), made["glsl/include/layouts.glsl"].clone());
    for kernel in &kernels {
        let path = format!("glsl/{kernel}.comp");
        let text = read(&folder, &path)?;
        let words = compile(&path, &expand(&path, &text, &sources)?)?;
        made.insert(format!("spirv/{kernel}.spv"), words.iter().flat_map(|w| w.to_le_bytes()).collect());
        sources.insert(path, text);
    }
    made.insert("manifest.toml".to_owned(), manifest(root, &sources, &made)?.into_bytes());
    if check { compare(&folder, &made, &kernels) } else { write(&folder, &made, &kernels) }
}

/// Names of the files of a folder that end so, without the ending, in order.
fn names(folder: &Path, ending: &str) -> Result<Vec<String>, String> {
    let entries = fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let file_names = entries.filter_map(|e| Some(e.ok()?.file_name().to_string_lossy().into_owned()));
    let mut found: Vec<String> = file_names.filter_map(|n| Some(n.strip_suffix(ending)?.to_owned())).collect();
    found.sort();
    Ok(found)
}

fn read(folder: &Path, path: &str) -> Result<Vec<u8>, String> {
    fs::read(folder.join(path)).map_err(|e| format!("{FOLDER}/{path}: {e}"))
}

/// Puts the includes in, and theirs; `#line` keeps the compiler's line numbers right.
fn expand(path: &str, text: &[u8], sources: &Files) -> Outcome {
    let text = std::str::from_utf8(text).map_err(|e| format!("{FOLDER}/{path}: {e}"))?;
    let mut whole = String::new();
    for (at, line) in text.lines().enumerate() {
        let included = line.strip_prefix("#include \"").and_then(|rest| rest.strip_suffix('"'));
        match included {
            None => whole.push_str(line),
            Some(name) => {
                let from = format!("glsl/include/{name}");
                let wrong = || format!("{FOLDER}/{path}:{}: no file {from}", at + 1);
                let text = sources.get(&from).ok_or_else(wrong)?;
                whole.push_str("#line 1\n");
                whole.push_str(&expand(&from, text, sources)?);
                whole.push_str(&format!("#line {}", at + 2));
            }
        }
        whole.push('\n');
    }
    Ok(whole)
}

fn compile(path: &str, text: &str) -> Result<Vec<u32>, String> {
    let failed = |why: String| format!("{FOLDER}/{path}: {why}");
    let compiler = Compiler::acquire().ok_or_else(|| failed("no compiler".to_owned()))?;
    let target = Target::Vulkan { version: VulkanVersion::Vulkan1_1, spirv_version: SpirvVersion::SPIRV1_3 };
    let options = CompilerOptions { target, ..CompilerOptions::default() };
    let source = ShaderSource::from(text);
    let input = ShaderInput::new(&source, ShaderStage::Compute, &options, None::<&[(&str, Option<&str>)]>, None);
    let input = input.map_err(|e| failed(e.to_string()))?;
    let shader = Shader::new(compiler, input).parse().map_err(|e| failed(e.to_string()))?;
    shader.compile().map_err(|e| failed(e.to_string()))
}

fn manifest(root: &Path, sources: &Files, made: &Files) -> Outcome {
    let lock = fs::read_to_string(root.join("Cargo.lock")).map_err(|e| format!("Cargo.lock: {e}"))?;
    let version = lock.split("name = \"glslang-sys\"\nversion = \"").nth(1).and_then(|rest| rest.split('"').next());
    let version = version.ok_or("Cargo.lock: no glslang-sys")?;
    let mut text = format!(
        "# Written by `cargo xtask shaders`: what the modules were compiled from, and by what; SHA-256 of every file.\n\n\
         compiler = \"glslang-sys {version}\"\nflags = \"{FLAGS}\"\n\n[files]\n"
    );
    let modules = made.iter().filter(|(path, _)| path.ends_with(".spv"));
    for (path, bytes) in sources.iter().chain(modules) {
        let hash: String = Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect();
        text.push_str(&format!("\"{path}\" = \"{hash}\"\n"));
    }
    Ok(text)
}

/// Modules without a kernel.
fn orphans(folder: &Path, kernels: &[String]) -> Result<Vec<String>, String> {
    let modules = names(&folder.join("spirv"), ".spv")?;
    Ok(modules.into_iter().filter(|m| !kernels.contains(m)).map(|m| format!("spirv/{m}.spv")).collect())
}

fn compare(folder: &Path, made: &Files, kernels: &[String]) -> Outcome {
    let mut stale: Vec<String> = made
        .iter()
        .filter(|(path, bytes)| fs::read(folder.join(path)).ok().as_ref() != Some(bytes))
        .map(|(p, _)| p.clone())
        .collect();
    stale.extend(orphans(folder, kernels)?);
    if stale.is_empty() {
        return Ok(format!("shaders: {} kernels compile to what is committed", kernels.len()));
    }
    Err(format!("stale, run `cargo xtask shaders`: {}", stale.join(", ")))
}

fn write(folder: &Path, made: &Files, kernels: &[String]) -> Outcome {
    for (path, bytes) in made {
        let full = folder.join(path);
        // Untouched files keep their time, so that cargo rebuilds nothing for them.
        if fs::read(&full).ok().as_ref() != Some(bytes) {
            fs::write(&full, bytes).map_err(|e| format!("{}: {e}", full.display()))?;
        }
    }
    for path in orphans(folder, kernels)? {
        fs::remove_file(folder.join(&path)).map_err(|e| format!("{path}: {e}"))?;
    }
    Ok(format!("shaders: {} kernels written", kernels.len()))
}
