//! The files of a report.

mod frontier;
pub(super) mod html;
mod joint;
pub(super) mod pictures;
mod tables;

use super::frontier::frontier;
use super::study::{candidates, candidates_by_truth};
use super::{Options, Study};
use organza::output::{Target, Targets};
use organza::scene::Scene;
use organza::{Error, printable};
use std::path::{Path, PathBuf};

/// The machine that computed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Machine {
    /// Name of the processor, if the system reports it.
    pub cpu: Option<String>,
    /// Operating system and architecture.
    pub system: String,
    /// Threads that the stages share.
    pub threads: usize,
}

impl Machine {
    /// Describes this machine and the threads of the current pool.
    pub fn this() -> Self {
        let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let model = info.lines().find_map(|l| l.strip_prefix("model name")?.split_once(':').map(|(_, name)| name));
        Self {
            cpu: model.map(|name| organza::escape_controls(name.trim()).into_owned()),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            threads: rayon::current_num_threads(),
        }
    }
}

/// The contents of an accuracy report.
#[derive(Debug, Clone)]
pub struct Report {
    /// The scene as it was written, but for the size of the picture.
    pub scene: Scene,
    /// The options that bounded its work.
    pub options: Options,
    /// What computed.
    pub machine: Machine,
    /// The studies, one for each technique.
    pub studies: Vec<Study>,
    /// Techniques that were left out.
    pub absent: Vec<Absent>,
    /// The frontier over all techniques that share the first one's limit, from the most accurate to the fastest: study, setting.
    pub frontier: Vec<[usize; 2]>,
    /// The frontier over all techniques by physical truth; empty for a scene without a truth.
    pub frontier_by_truth: Vec<[usize; 2]>,
}

/// A technique that cannot show the scene, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Absent {
    /// Its name.
    pub technique: &'static str,
    /// Why.
    pub reason: String,
}

/// Columns of a table that all of its lines share, with their units in their names.
pub(crate) const SHARED_COLUMNS: &str = "scene,width_px,height_px,version,processor,threads";

impl Machine {
    /// The cells of [`SHARED_COLUMNS`].
    pub(crate) fn shared_cells(&self, scene: &str, size: [usize; 2]) -> String {
        let processor = quoted(self.cpu.as_deref().unwrap_or(&self.system));
        let [width, height] = size;
        format!("{},{width},{height},{},{processor},{}", quoted(scene), env!("CARGO_PKG_VERSION"), self.threads)
    }
}

/// A cell of text.
pub(crate) fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

impl Report {
    /// A report of studies of a scene on this machine.
    pub fn new(scene: &Scene, options: Options, studies: Vec<Study>, absent: Vec<Absent>) -> Self {
        let places = |chosen: &[(usize, &Study)]| -> Vec<[usize; 2]> {
            chosen.iter().flat_map(|(s, study)| (0..study.outcomes.len()).map(move |o| [*s, o])).collect()
        };
        let numbered: Vec<(usize, &Study)> = studies.iter().enumerate().collect();
        let alike: Vec<_> = numbered.iter().copied().filter(|(_, s)| s.shares_limit_with(&studies[0])).collect();
        let by_limit = frontier(&candidates(alike.iter().flat_map(|(_, s)| &s.outcomes)));
        let by_truth = frontier(&candidates_by_truth(numbered.iter().flat_map(|(_, s)| &s.outcomes)));
        Self {
            frontier: by_limit.into_iter().map(|k| places(&alike)[k]).collect(),
            frontier_by_truth: by_truth.into_iter().map(|k| places(&numbered)[k]).collect(),
            absent,
            scene: scene.clone(),
            options,
            machine: Machine::this(),
            studies,
        }
    }

    /// Name of the scene's file.
    pub(super) fn scene_name(&self) -> String {
        printable(Path::new(self.scene.file.file_name().unwrap_or_default()))
    }

    /// The report as a JSON document.
    pub fn json(&self) -> String {
        format!("{:#}\n", tables::json(self))
    }

    /// The report as a table with one line a setting.
    pub fn csv(&self) -> String {
        tables::csv(self)
    }

    /// The report as a page that needs no other file.
    ///
    /// # Errors
    /// [`Error::Internal`] if a picture cannot be encoded.
    pub fn html(&self) -> Result<String, Error> {
        html::page(self)
    }

    /// Checks before any work that the files of [`write()`] can be written to a folder; none may be one of the `inputs`.
    ///
    /// # Errors
    /// As [`Targets::add`].
    pub fn check(folder: &Path, force: bool, inputs: &[PathBuf]) -> Result<[Target; 3], Error> {
        let mut targets = Targets::default();
        targets.add_inputs(inputs);
        let mut add = |name: &str| targets.add(&folder.join(name), force);
        Ok([add("accuracy.json")?, add("accuracy.csv")?, add("accuracy.html")?])
    }
}

/// Writes `accuracy.json`, `accuracy.csv` and `accuracy.html`; each appears whole or not at all, and none before all three
/// are made.
///
/// # Errors
/// As [`Target::write`], and [`Error::Internal`] if a picture cannot be encoded.
pub fn write(report: &Report, targets: &[Target; 3]) -> Result<(), Error> {
    let contents = [report.json(), report.csv(), report.html()?];
    Ok(targets.iter().zip(contents).try_for_each(|(target, text)| target.write(text.as_bytes()))?)
}
