//! The table of kernels and the shared structs against the modules themselves, and the modules against their sources.

use sha2::{Digest, Sha256};
use splat_shaders::reflect::{Module, module};
use splat_shaders::{Access, Kernel, SubgroupOps, kernels, layouts};
use std::collections::BTreeSet;
use std::path::Path;

fn reflected(kernel: &Kernel) -> Module {
    module(&kernel.words()).unwrap_or_else(|| panic!("{} is no SPIR-V", kernel.name))
}

#[test]
fn every_kernel_is_what_its_module_says() {
    for kernel in kernels::ALL {
        let module = reflected(kernel);
        assert_eq!(module.version, (1, 3), "{}", kernel.name);
        assert_eq!(module.local_size, [256, 1, 1], "{}", kernel.name);
        // Dense, in set 0: one interface renumbers bindings, and agrees only then.
        let places: Vec<_> = module.buffers.keys().copied().collect();
        let dense: Vec<_> = (0..kernel.bindings.len() as u32).map(|b| (0, b)).collect();
        assert_eq!(places, dense, "{}", kernel.name);
        let read_only: Vec<_> = module.buffers.values().copied().collect();
        let declared: Vec<_> = kernel.bindings.iter().map(|a| *a == Access::Read).collect();
        assert_eq!(read_only, declared, "{}: who writes what", kernel.name);
        assert_eq!(4 * module.push_members, kernel.push_bytes as usize, "{}: push constants", kernel.name);
        assert!(kernel.push_bytes <= 128, "{}: every device takes 128 bytes", kernel.name);
    }
}

#[test]
fn every_kernel_says_what_it_does_across_subgroups() {
    // GroupNonUniform: of any kind, votes, sums, ballots, shuffles, and what nothing here declares.
    let [any, vote, sums, ballot, shuffle, others] = [61, 62, 63, 64, 65, 66];
    for kernel in kernels::ALL {
        let asked = reflected(kernel).capabilities;
        let has = |capability| asked.contains(&capability);
        let ops = SubgroupOps { ballot: has(ballot), shuffle: has(shuffle), arithmetic: has(sums) };
        assert_eq!(kernel.subgroup_ops, ops, "{}", kernel.name);
        assert!(!has(vote) && (others..=68).all(|other| !has(other)), "{}", kernel.name);
        assert!(!has(any) || ops != SubgroupOps::NONE, "{}", kernel.name);
    }
}

#[test]
fn structs_lie_alike_on_both_sides() {
    let mut seen = BTreeSet::new();
    for kernel in kernels::ALL {
        for found in reflected(kernel).structs {
            let Some((name, fields, _)) = layouts::structs().into_iter().find(|(name, ..)| *name == found.name) else {
                continue;
            };
            let declared: Vec<_> = fields.iter().map(|f| (f.name.to_owned(), f.offset as u32)).collect();
            assert_eq!(found.members, declared, "{name} in {}", kernel.name);
            seen.insert(name);
        }
    }
    let names: BTreeSet<_> = layouts::structs().iter().map(|(name, ..)| *name).collect();
    assert_eq!(seen, names, "every struct is used by a kernel");
}

#[test]
fn committed_files_are_those_of_the_manifest() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let manifest = std::fs::read_to_string(folder.join("manifest.toml")).unwrap();
    let listed: Vec<(&str, &str)> =
        manifest.lines().filter_map(|line| line.strip_prefix('"')?.strip_suffix('"')?.split_once("\" = \"")).collect();
    for (path, hash) in &listed {
        let found: String =
            Sha256::digest(std::fs::read(folder.join(path)).unwrap()).iter().map(|b| format!("{b:02x}")).collect();
        assert_eq!(found, *hash, "{path}: run `cargo xtask shaders`");
    }
    for kernel in kernels::ALL {
        for path in [format!("glsl/{}.comp", kernel.name), format!("spirv/{}.spv", kernel.name)] {
            assert!(listed.iter().any(|(p, _)| *p == path), "{path} is not in the manifest");
        }
    }
    let structs = std::fs::read_to_string(folder.join("glsl/include/layouts.glsl")).unwrap();
    assert_eq!(structs, layouts::glsl());
}

#[test]
fn what_is_no_module_is_refused() {
    assert_eq!(module(&[]), None);
    assert_eq!(module(&[1, 2, 3, 4, 5]), None);
    let words = kernels::ALL[0].words();
    for cut in 0..words.len() {
        // Cut anywhere, it is read or refused, never worse.
        let _ = module(&words[..cut]);
    }
}
