//! `cargo xtask vulkan`: every module through `spirv-val`, every kernel and recording on lavapipe under validation.
//!
//! Lavapipe is Mesa's Vulkan on the processor: it needs no GPU, so that every machine can run the tests. It says nothing
//! about speed. What is missing is installed where that is possible (root, apt), printed where it is not.

use crate::ci::{DEEP, DRIVER, FEATURES};
use crate::debian;
use crate::repo::{Outcome, Repo};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Where drivers and layers announce themselves.
const ROOTS: [&str; 4] = ["/usr/share/vulkan", "/usr/local/share/vulkan", "/etc/vulkan", "/usr/local/etc/vulkan"];

/// Debian's and Ubuntu's names of what is needed.
const PACKAGES: [&str; 4] = ["libvulkan1", "mesa-vulkan-drivers", "vulkan-validationlayers", "spirv-tools"];

/// Benchmarks have no tests, and peers that take minutes to compile.
pub(crate) const TESTS: &str = "test --workspace --exclude organza-benches";

/// What the conformance tests run with.
#[derive(Debug, PartialEq)]
struct Parts {
    /// The file that announces lavapipe.
    driver: PathBuf,
    /// The file that announces the validation layer.
    layer: PathBuf,
    /// The checker of modules.
    spirv_val: PathBuf,
}

/// Bits of a vector that lavapipe is told to compute with, and so 4 and 16 threads of a subgroup; by itself it takes 8.
const VECTORS: [&str; 2] = ["128", "512"];

/// The tests of what works across the threads of a subgroup.
const ACROSS: [&str; 2] = ["kernels::", "order::"];

/// The executor and the validation that all tests run with.
const WITH_TESTS: [&str; 2] = ["ash", "synchronization"];

/// Finds or installs the parts, then checks modules and runs the conformance tests by every executor under every validation.
pub(crate) fn run(repo: &Repo) -> Outcome {
    let parts = match parts()? {
        Ok(parts) => parts,
        Err(missing) => return debian::without("vulkan", &PACKAGES, &missing),
    };
    let modules = check_modules(repo, &parts.spirv_val)?;
    for by in [WITH_TESTS, ["wgpu", "synchronization"], ["ash", "gpu-assisted"]] {
        conformance(repo, &parts.driver, by, None)?;
    }
    for vector in VECTORS {
        conformance(repo, &parts.driver, WITH_TESTS, Some(vector))?;
    }
    Ok(format!("vulkan: {modules} modules valid, recordings conform on lavapipe without a message"))
}

/// All tests; those of conformance by the first executor, where the parts can be had.
pub(crate) fn tests(repo: &Repo) -> Outcome {
    let (line, said, parts) = match parts()? {
        Ok(parts) => (format!("{TESTS} --features {FEATURES},{DRIVER}"), "tests: all".to_owned(), Some(parts)),
        Err(missing) => {
            (format!("{TESTS} --features {FEATURES}"), debian::without("conformance tests", &PACKAGES, &missing)?, None)
        }
    };
    // Clippy has compiled the examples, which no test runs.
    for targets in [format!("--tests -- --skip {DEEP}"), "--doc".to_owned()] {
        let on = parts.as_ref().map(|parts| (parts.driver.as_path(), WITH_TESTS));
        cargo_test(repo, &format!("{line} {targets}"), on, None)?;
    }
    Ok(said)
}

/// The modules that are committed, checked by `spirv-val`.
pub(crate) fn modules(repo: &Repo) -> Outcome {
    match parts()? {
        Ok(parts) => Ok(format!("vulkan: {} modules valid", check_modules(repo, &parts.spirv_val)?)),
        Err(missing) => debian::without("vulkan", &PACKAGES, &missing),
    }
}

/// The parts, installed where that is possible, or the names of what is missing.
fn parts() -> Result<Result<Parts, String>, String> {
    let folders = debian::folders();
    let look = || find(&ROOTS.map(PathBuf::from), &folders);
    let found = match look() {
        Err(missing) if debian::install(&folders, &PACKAGES, &missing) => Ok(look()?),
        found => found,
    };
    if let Ok(parts) = &found {
        println!("lavapipe: {}\nvalidation: {}", parts.driver.display(), parts.layer.display());
    }
    Ok(found)
}

/// The parts, or the names of what is missing.
fn find(roots: &[PathBuf], folders: &[PathBuf]) -> Result<Parts, String> {
    let announced = |folder: &str, name: &str| {
        let files = roots.iter().filter_map(|root| std::fs::read_dir(root.join(folder)).ok()).flatten().flatten();
        let mut fits: Vec<PathBuf> = files
            .map(|f| f.path())
            .filter(|p| p.file_name().is_some_and(|n| n.to_string_lossy().contains(name)))
            .collect();
        fits.sort();
        fits.into_iter().next()
    };
    let driver = announced("icd.d", "lvp_icd");
    let layer = announced("explicit_layer.d", "VkLayer_khronos_validation");
    let spirv_val = debian::on_path(folders, "spirv-val");
    match (driver, layer, spirv_val) {
        (Some(driver), Some(layer), Some(spirv_val)) => Ok(Parts { driver, layer, spirv_val }),
        (driver, layer, spirv_val) => {
            let missing = [
                driver.is_none().then_some("lavapipe"),
                layer.is_none().then_some("the validation layer"),
                spirv_val.is_none().then_some("spirv-val"),
            ];
            Err(missing.into_iter().flatten().collect::<Vec<_>>().join(", "))
        }
    }
}

fn check_modules(repo: &Repo, spirv_val: &Path) -> Result<usize, String> {
    let modules: Vec<&str> = repo.files.iter().map(|f| f.path.as_str()).filter(|p| p.ends_with(".spv")).collect();
    for module in &modules {
        let ran = Command::new(spirv_val).args(["--target-env", "vulkan1.1"]).arg(repo.root.join(module)).output();
        let ran = ran.map_err(|e| format!("spirv-val: {e}"))?;
        if !ran.status.success() {
            return Err(format!("{module}: {}", String::from_utf8_lossy(&ran.stderr)));
        }
    }
    if modules.is_empty() { Err("no modules under shaders/spirv".to_owned()) } else { Ok(modules.len()) }
}

/// Runs all conformance tests by an executor under a validation; with vectors of so many bits those of subgroups alone.
fn conformance(repo: &Repo, driver: &Path, by: [&str; 2], vector: Option<&str>) -> Result<(), String> {
    let mut line = format!("{TESTS} --features {FEATURES},{DRIVER} --test conformance");
    if vector.is_some() {
        line.push_str(&format!(" -- {}", ACROSS.join(" ")));
    }
    cargo_test(repo, &line, Some((driver, by)), vector)
}

/// Runs cargo with these words; on a driver, by an executor under a validation.
fn cargo_test(repo: &Repo, line: &str, on: Option<(&Path, [&str; 2])>, vector: Option<&str>) -> Result<(), String> {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(program);
    command.args(line.split(' ')).current_dir(&repo.root).envs(vector.map(|bits| ("LP_NATIVE_VECTOR_WIDTH", bits)));
    let mut by = String::new();
    if let Some((driver, [executor, validation])) = on {
        let bits = vector.unwrap_or("native");
        by = format!(" (gpu-{executor}, {validation} validation, vectors of {bits} bits)");
        // Two names for the one variable: loaders before 1.3.207 know the second alone.
        command.env("VK_DRIVER_FILES", driver).env("VK_ICD_FILENAMES", driver);
        if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
            command.env("XDG_RUNTIME_DIR", std::env::temp_dir());
        }
        command
            .env("ORGANZA_EXECUTOR", executor)
            .env("ORGANZA_ADAPTER", "llvmpipe")
            .env("ORGANZA_VALIDATION", validation);
    }
    println!("$ cargo {line}{by}");
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("`cargo {line}`{by}: {status}")),
        Err(e) => Err(format!("`cargo {line}` did not start: {e}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_named() {
        let missing = find(&["no/such/root".into()], &["no/such/folder".into()]);
        assert_eq!(missing, Err("lavapipe, the validation layer, spirv-val".to_owned()));
    }

    #[test]
    fn parts_are_found_where_they_announce_themselves() {
        let root = std::env::temp_dir().join(format!("organza-vulkan-{}", std::process::id()));
        let write = |path: &str| {
            let file = root.join(path);
            std::fs::create_dir_all(file.parent().expect("invariant: below the root")).expect("a folder");
            std::fs::write(file, "").expect("a file");
        };
        ["icd.d/intel_icd.json", "icd.d/lvp_icd.x86_64.json", "explicit_layer.d/VkLayer_khronos_validation.json"]
            .into_iter()
            .for_each(write);
        let roots = [root.clone()];
        assert_eq!(find(&roots, &roots), Err("spirv-val".to_owned()));
        write("spirv-val");
        let parts = find(&roots, &roots).expect("all there");
        assert_eq!(parts.driver, root.join("icd.d/lvp_icd.x86_64.json"));
        std::fs::remove_dir_all(&root).expect("made above");
    }
}
