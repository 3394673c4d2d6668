//! `organza orders`.

use super::args::OrdersArguments;
use super::console;
use super::console::bar::with_bar;
use super::session::{in_folder, load_scene, path_text, processor_only, refuse_technique_and_layers, render_options};
use organza::{Error, printable};
use organza_judge::accuracy;
use organza_judge::orders::{self, OrdersReport};
use serde_json::json;

/// Draws by every ordering and writes the comparison. Whatever can be refused is refused before any work. One that is interrupted after
/// the truth is known is written as far as it goes.
pub(super) fn run(arguments: &OrdersArguments) -> Result<(), Error> {
    processor_only(&arguments.scene)?;
    refuse_technique_and_layers("orders", &arguments.scene)?;
    let mut scene = load_scene("orders", &arguments.scene)?;
    let effort = orders::Options { quick: arguments.quick };
    if arguments.scene.common.size.is_none() {
        accuracy::shrink(&mut scene, effort.longest_side());
    }
    in_folder(&arguments.out, || {
        let targets = OrdersReport::check(&arguments.out, arguments.force, &scene.files())?;
        let options = render_options(&arguments.scene);
        let comparison = with_bar(|progress| orders::compare(&scene, &effort, &options, progress))?;
        let is_whole = comparison.interrupted.is_none();
        let report = OrdersReport::new(&scene, comparison)?;
        orders::write(&report, &targets)?;
        if arguments.scene.common.json {
            let files: Vec<String> = targets.iter().map(|f| path_text(f.path())).collect();
            let report: serde_json::Value = serde_json::from_str(&report.json()).unwrap_or_default();
            console::out(&format!("{:#}\n", json!({ "outputs": files, "report": report })))?;
        } else {
            let mut text = report.text();
            targets.iter().for_each(|f| text += &format!("wrote {}\n", printable(f.path())));
            console::out(&text)?;
        }
        if is_whole { Ok(()) } else { Err(Error::Cancelled) }
    })
}
