//! `cargo xtask assets`: what lies under `assets/`, and where the larger inputs of the benchmarks come from.

mod dose;
mod lines;
mod meadow;
mod png;
mod sky;
mod solids;

use crate::repo::{Outcome, Repo};
use crate::tidy::{MAX_BYTES, credit_of, in_assets};

/// Inputs that are too large or not free to copy. Nothing here is needed by a test or by a scene.
const ELSEWHERE: &str = "\
Larger inputs, to be fetched by hand where a benchmark is to run on them:
  Stanford dragon, full size (dragon_vrip.ply, 437,645 vertices, the model of the paper's Table 1):
      https://graphics.stanford.edu/data/3Dscanrep/ — free to use with credit; not for sale; read the terms there.
  Engine block CT (256x256x128, 8 bit) and other volumes:
      https://klacansky.com/open-scivis-datasets/ — terms beside each volume.
  LiDAR tiles: https://www.usgs.gov/3d-elevation-program — public domain.
Pass them by path: `read` reads PLY, NIfTI, LAS and LAZ.";

/// Lists the assets; fails where the tidy rules of assets fail.
pub(crate) fn run(repo: &Repo) -> Outcome {
    let mut said = Vec::new();
    let mut missing = Vec::new();
    for (path, bytes) in in_assets(repo) {
        let credit = credit_of(repo, path).unwrap_or("no credit file");
        said.push(format!("{bytes:>9}  {path}  ({credit})"));
        if credit_of(repo, path).is_none() {
            missing.push(path);
        }
    }
    let total: u64 = in_assets(repo).map(|(_, bytes)| bytes).sum();
    said.push(format!("{total:>9}  of at most {MAX_BYTES} bytes in {} files\n\n{ELSEWHERE}", said.len()));
    let said = said.join("\n");
    if !missing.is_empty() || total > MAX_BYTES {
        return Err(format!("assets break a rule (cargo xtask tidy names it)\n{said}"));
    }
    Ok(said)
}

/// Writes the environment that is made by formula.
pub(crate) fn write_sky(repo: &Repo) -> Outcome {
    let path = repo.root.join("assets/environment/sky.hdr");
    let bytes = sky::hdr();
    std::fs::write(&path, &bytes).map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(format!("{} bytes in {}", bytes.len(), path.display()))
}

/// Writes the volume that is made by formula.
pub(crate) fn write_dose(repo: &Repo) -> Outcome {
    let path = repo.root.join("assets/dose/dose.nrrd");
    let bytes = dose::nrrd();
    std::fs::write(&path, &bytes).map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(format!("{} bytes in {}", bytes.len(), path.display()))
}

/// Writes the meshes that are made by tables.
pub(crate) fn write_solids(repo: &Repo) -> Outcome {
    let mut said = Vec::new();
    for (name, text) in solids::files() {
        let path = repo.root.join("assets/meshes").join(name);
        std::fs::write(&path, &text).map_err(|e| format!("{}: {e}", path.display()))?;
        said.push(format!("{} bytes in {}", text.len(), path.display()));
    }
    Ok(said.join("\n"))
}

/// Writes the points that are made by formula, and the pictures that they show.
pub(crate) fn write_points(repo: &Repo) -> Outcome {
    let mut said = Vec::new();
    for (name, bytes) in meadow::files().into_iter().chain([("points/lines.csv", lines::csv().into_bytes())]) {
        let path = repo.root.join("assets").join(name);
        std::fs::write(&path, &bytes).map_err(|e| format!("{}: {e}", path.display()))?;
        said.push(format!("{} bytes in {}", bytes.len(), path.display()));
    }
    Ok(said.join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn assets_are_listed_with_their_credit() {
        let bunny = ("assets/bunny/bunny.ply", "ply");
        let said = run(&Repo::in_memory(&[bunny, ("assets/bunny/ORIGIN.txt", "who")])).expect("credited");
        assert!(said.contains("3  assets/bunny/bunny.ply  (assets/bunny/ORIGIN.txt)"), "{said}");
        assert!(run(&Repo::in_memory(&[bunny])).is_err());
    }
}
