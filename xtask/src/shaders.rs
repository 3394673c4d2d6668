//! `cargo xtask shaders`: `shaders/glsl/*.comp` → `shaders/spirv/*.spv`, and the manifest that says from what and by what.

#[cfg(feature = "glslang")]
mod compile;

use crate::repo::{Outcome, Repo};
use std::path::Path;
use std::process::Command;

/// Folder of the package `splat-shaders`.
#[cfg(feature = "glslang")]
const FOLDER: &str = "shaders";

/// Compiles every kernel; `check` compares with what is committed and writes nothing.
#[cfg(feature = "glslang")]
pub(crate) fn run(repo: &Repo, check: bool) -> Outcome {
    compile::run(&repo.root, check)
}

/// The compiler is built only for this command: the same command again, with it.
#[cfg(not(feature = "glslang"))]
pub(crate) fn run(repo: &Repo, check: bool) -> Outcome {
    let mut words = vec!["run", "--quiet", "--package", "xtask", "--features", "glslang", "--", "shaders"];
    words.extend(check.then_some("--check"));
    let said = cargo(&repo.root, &words)?;
    Ok(said.trim_end().to_owned())
}

/// What cargo prints; its warnings go to the terminal.
pub(crate) fn cargo(root: &Path, words: &[&str]) -> Outcome {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let ran = Command::new(program).args(words).current_dir(root).stderr(std::process::Stdio::inherit()).output();
    let line = words.join(" ");
    let output = ran.map_err(|e| format!("`cargo {line}` did not start: {e}"))?;
    if !output.status.success() {
        return Err(format!("`cargo {line}`: {}", output.status));
    }
    String::from_utf8(output.stdout).map_err(|e| format!("`cargo {line}`: {e}"))
}
