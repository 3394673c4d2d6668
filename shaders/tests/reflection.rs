//! The table of kernels and the shared structs against the modules themselves, and the modules against their sources.

use sha2::{Digest, Sha256};
use splat_shaders::reflect::{Module, module};
use splat_shaders::{Access, Kernel, Program, SubgroupOps, kernels, layouts, programs};
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

fn both(program: &Program) -> [Module; 2] {
    program.words().map(|words| module(&words).unwrap_or_else(|| panic!("{} is no SPIR-V", program.name)))
}

#[test]
fn every_program_is_what_its_modules_say() {
    for program in programs::ALL {
        let [vertex, fragment] = both(program);
        let name = program.name;
        for module in [&vertex, &fragment] {
            assert_eq!(module.version, (1, 3), "{name}");
            // Each sees some of the buffers, and writes none.
            assert!(module.buffers.keys().all(|(set, binding)| *set == 0 && *binding < program.bindings), "{name}");
            assert!(module.buffers.values().all(|read_only| *read_only), "{name}: who draws writes no buffer");
            assert!([0, program.push_bytes as usize].contains(&(4 * module.push_members)), "{name}: push constants");
        }
        let seen: BTreeSet<_> = vertex.buffers.keys().chain(fragment.buffers.keys()).map(|(_, b)| *b).collect();
        assert_eq!(seen, (0..program.bindings).collect(), "{name}: every buffer is seen by one of both");
        assert!(program.push_bytes <= 128 && program.bindings <= 8, "{name}: every device takes as much");
        let outputs: Vec<_> = (0..).zip(program.outputs.iter().copied()).collect();
        assert_eq!(fragment.outputs.into_iter().collect::<Vec<_>>(), outputs, "{name}: outputs");
        assert_eq!(vertex.outputs, fragment.taken, "{name}: what one hands on the other takes");
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
    let kernels = kernels::ALL.iter().map(|kernel| (kernel.name, reflected(kernel)));
    let programs = programs::ALL.iter().flat_map(|program| both(program).map(|module| (program.name, module)));
    for (user, module) in kernels.chain(programs) {
        for found in module.structs {
            let Some((name, fields, _)) = layouts::all().into_iter().find(|(name, ..)| *name == found.name) else {
                continue;
            };
            let declared: Vec<_> = fields.iter().map(|f| (f.name.to_owned(), f.offset as u32)).collect();
            assert_eq!(found.members, declared, "{name} in {user}");
            seen.insert(name);
        }
    }
    let all: BTreeSet<_> = layouts::all().iter().map(|(name, ..)| *name).collect();
    assert_eq!(seen, all, "every struct is used by a kernel");
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
    let kernels = kernels::ALL.iter().map(|k| [format!("glsl/{}.comp", k.name), format!("spirv/{}.spv", k.name)]);
    let stage = |name: &str, stage: &str| [format!("glsl/{name}.{stage}"), format!("spirv/{name}.{stage}.spv")];
    let programs = programs::ALL.iter().flat_map(|p| [stage(p.name, "vert"), stage(p.name, "frag")]);
    for path in kernels.chain(programs).flatten() {
        assert!(listed.iter().any(|(p, _)| *p == path), "{path} is not in the manifest");
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
