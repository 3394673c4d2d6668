//! `organza info`.

mod text;

use super::args::InfoArguments;
use super::given::is_scene;
use super::{console, memory};
use organza::Error;
use organza::scene::{self, LoadOptions};
use organza_survey::documents::{facts_json, scene_json};
use organza_survey::{NamedTable, facts};
use splat_core::MemoryAccount;
use std::path::PathBuf;

/// Describes a scene or a data file.
pub(super) fn run(arguments: &InfoArguments) -> Result<(), Error> {
    if is_scene(&arguments.file) {
        if arguments.labels.is_some() {
            let hint = "leave it out: `labels` of an object names the table";
            return Err(Error::usage("--labels is for data files, and a scene is given", hint));
        }
        let InfoArguments { allow_path, sandbox, .. } = *arguments;
        let memory = MemoryAccount::new(memory::default_limit());
        let options = LoadOptions { allow_path, sandbox, memory, ..LoadOptions::default() };
        let document = scene_json(&scene::load(&arguments.file, &options)?);
        return console::out(&if arguments.json { format!("{document:#}\n") } else { text::lines(&document) });
    }
    let read_table = |path: &PathBuf| NamedTable::read(path, &MemoryAccount::new(memory::default_limit()));
    let labels = arguments.labels.as_ref().map(read_table).transpose()?;
    let facts = facts(&arguments.file, labels.as_ref(), memory::default_limit(), arguments.strict)?;
    facts.mended.iter().chain(&facts.warnings).for_each(|line| console::warn(line));
    if arguments.json {
        return console::out(&format!("{:#}\n", facts_json(&facts)));
    }
    console::out(&text::of_facts(&arguments.file, &facts))
}
