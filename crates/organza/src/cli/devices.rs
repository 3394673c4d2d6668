//! `organza devices`.

use super::args::DevicesArguments;
use super::console;
use organza::{Adapter, AdapterKind, Error, escape_controls};
use serde_json::json;

/// Lists the devices that `--backend ash` can use.
pub(super) fn run(arguments: &DevicesArguments) -> Result<(), Error> {
    let devices = organza::devices()?;
    console::out(&if arguments.json { document(&devices) } else { text(&devices) })
}

fn kind(adapter: &Adapter) -> &'static str {
    match adapter.kind {
        AdapterKind::Discrete => "discrete GPU",
        AdapterKind::Integrated => "integrated GPU",
        AdapterKind::Virtual => "virtual GPU",
        AdapterKind::Software => "software",
        AdapterKind::Other => "other",
    }
}

fn text(devices: &[Adapter]) -> String {
    if devices.is_empty() {
        return "no GPU: no Vulkan driver was found; the processor computes\n".to_owned();
    }
    let line = |adapter: &Adapter| {
        let use_ = if adapter.kind.is_gpu() { "" } else { ", used only with --device" };
        let mib = adapter.memory_bytes >> 20;
        let Adapter { name, driver, .. } = adapter;
        let line = format!("{name}: {}, {mib} MiB, {driver}{use_}", kind(adapter));
        format!("{}\n", escape_controls(&line))
    };
    devices.iter().map(line).collect()
}

fn document(devices: &[Adapter]) -> String {
    let each = devices.iter().map(|adapter| {
        json!({
            "name": adapter.name,
            "kind": kind(adapter),
            "gpu": adapter.kind.is_gpu(),
            "driver": adapter.driver,
            "memory_bytes": adapter.memory_bytes,
            "binding_bytes": adapter.binding_bytes,
            "subgroup": adapter.subgroup,
        })
    });
    format!("{:#}\n", json!({ "devices": each.collect::<serde_json::Value>() }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_software_driver_is_named_as_one() {
        let adapter = |name: &str, kind| Adapter {
            name: name.to_owned(),
            driver: "Vulkan 1.3.0".to_owned(),
            kind,
            memory_bytes: 2 << 30,
            binding_bytes: 1 << 27,
            subgroup: 8,
        };
        let both = [adapter("X", AdapterKind::Discrete), adapter("llvm", AdapterKind::Software)];
        let expected = "X: discrete GPU, 2048 MiB, Vulkan 1.3.0\n\
                        llvm: software, 2048 MiB, Vulkan 1.3.0, used only with --device\n";
        assert_eq!(text(&both), expected);
        assert!(text(&[]).starts_with("no GPU"));
        let parsed: serde_json::Value = serde_json::from_str(&document(&both)).expect("JSON");
        assert_eq!((&parsed["devices"][0]["gpu"], &parsed["devices"][1]["gpu"]), (&json!(true), &json!(false)));
    }
}
