//! The tasks of the repository: `cargo xtask help` lists them.

mod assets;
mod browser;
mod ci;
mod debian;
mod deny;
mod effects;
mod fuzz;
mod mutants;
mod papers;
mod python;
mod quick;
mod repo;
mod shaders;
mod source;
mod tidy;
mod toml_lines;
mod vulkan;

use repo::Repo;
use std::process::ExitCode;

const HELP: &str = "\
usage: cargo xtask COMMAND

  ci               everything that must hold before a merge, step by step; stops at the first failure
  deep             what takes minutes and rarely breaks: kernels compiled anew, GPU work under every validation, every scene drawn
  quick            format, rules, clippy, and the tests of the crates that changed since main
  deny             licences and sources of all dependencies, by cargo-deny
  fuzz [--seconds N] [--record] [TARGET…]
                   all kinds of bytes as files, scenes and formulas, by cargo-fuzz on nightly; --record writes docs/robustness.md
  mutants [--shard K/N] [CRATE…]
                   plants every hundredth fault that cargo-mutants knows in the stages, and says which no test sees
  tidy             the rules that the compiler does not know: heads, sizes, dependency direction, assets
  papers           writes docs/papers.md from docs/papers/*.toml
  papers --times   takes what benchmarks of `cargo bench` measured last into docs/papers/*-times.csv, then writes the page
  papers --check   fails where docs/papers.md is stale or names code or a test that does not exist
  effects          draws every scene with each of its effects and without it, and writes docs/effects.csv and docs/effects.md
  python           builds the Python package in target/python, installs and tests it there, and leaves its wheel in target/wheels
  assets           lists the files under assets/, their credit files, and where the larger inputs come from
  assets sky       writes assets/environment/sky.hdr, an environment by formula
  assets dose      writes assets/dose/dose.nrrd, the dose of three beams by formula
  assets points    writes assets/points/lines.csv, lines of a scan by formula
  assets solids    writes assets/meshes/*.off, a mushroom, a dart and an aeroplane by tables
  shaders          compiles shaders/glsl to shaders/spirv and writes the manifest; builds glslang first (C++, minutes)
  shaders --check  fails where the committed modules are not what their sources compile to
  vulkan           runs every kernel and recording on Mesa's lavapipe under validation; installs it as root with apt
  browser          the page of `organza view` in Chromium; installs it as root with apt
  help             this text
";

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let outcome = match words.as_slice() {
        ["ci"] => Repo::open().and_then(|repo| ci::run(&repo)),
        ["deep"] => Repo::open().and_then(|repo| ci::deep(&repo)),
        ["quick"] => Repo::open().and_then(|repo| quick::run(&repo)),
        ["deny"] => Repo::open().and_then(|repo| deny::run(&repo)),
        ["fuzz", rest @ ..] => Repo::open().and_then(|repo| fuzz::run(&repo, rest)),
        ["mutants", rest @ ..] => Repo::open().and_then(|repo| mutants::run(&repo, rest)),
        ["tidy"] => Repo::open().and_then(|repo| tidy::run(&repo)),
        ["papers"] => Repo::open().and_then(|repo| papers::write(&repo)),
        ["papers", "--times"] => Repo::open().and_then(|repo| {
            let said = papers::refresh(&repo)?;
            Ok(format!("{said}\n{}", papers::write(&Repo::open()?)?))
        }),
        ["papers", "--check"] => Repo::open().and_then(|repo| papers::check(&repo)),
        ["effects"] => Repo::open().and_then(|repo| effects::run(&repo)),
        ["python"] => Repo::open().and_then(|repo| python::run(&repo)),
        ["assets"] => Repo::open().and_then(|repo| assets::run(&repo)),
        ["assets", "sky"] => Repo::open().and_then(|repo| assets::write_sky(&repo)),
        ["assets", "dose"] => Repo::open().and_then(|repo| assets::write_dose(&repo)),
        ["assets", "points"] => Repo::open().and_then(|repo| assets::write_points(&repo)),
        ["assets", "solids"] => Repo::open().and_then(|repo| assets::write_solids(&repo)),
        ["shaders"] => Repo::open().and_then(|repo| shaders::run(&repo, false)),
        ["shaders", "--check"] => Repo::open().and_then(|repo| shaders::run(&repo, true)),
        ["browser"] => Repo::open().and_then(|repo| browser::run(&repo)),
        ["vulkan"] => Repo::open().and_then(|repo| vulkan::run(&repo)),
        [] | ["help" | "--help" | "-h"] => {
            print!("{HELP}");
            return ExitCode::SUCCESS;
        }
        _ => {
            eprintln!("error: no such command: {}\n\n{HELP}", words.join(" "));
            return ExitCode::from(2);
        }
    };
    match outcome {
        Ok(said) => {
            println!("{said}");
            ExitCode::SUCCESS
        }
        Err(why) => {
            eprintln!("error: {why}");
            ExitCode::FAILURE
        }
    }
}
