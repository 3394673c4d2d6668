//! `organza devices`.

use super::args::DevicesArguments;
use super::console;
use organza::device::{self, Adapter, AdapterKind, ListedDevice};
use organza::{Error, escape_controls};
use serde_json::json;

/// Lists the devices that `--backend` can use.
pub(super) fn run(arguments: &DevicesArguments) -> Result<(), Error> {
    let devices = device::devices()?;
    console::out(&if arguments.json { document(&devices) } else { text(&devices) })
}

/// What stands behind an adapter, for people.
pub(super) fn kind(adapter: &Adapter) -> &'static str {
    match adapter.kind {
        AdapterKind::Discrete => "discrete GPU",
        AdapterKind::Integrated => "integrated GPU",
        AdapterKind::Virtual => "virtual GPU",
        AdapterKind::Software => "software",
        AdapterKind::Other => "other",
    }
}

fn text(devices: &[ListedDevice]) -> String {
    if devices.is_empty() {
        return "no GPU: no Vulkan driver was found; the processor computes\n".to_owned();
    }
    let line = |device: &ListedDevice| {
        let ListedDevice { backend, adapter } = device;
        let use_ = if adapter.kind.is_gpu() { "" } else { ", used only with --device" };
        let memory = match adapter.memory_bytes >> 20 {
            0 => String::new(),
            mib => format!("{mib} MiB, "),
        };
        let line = format!("{backend}: {}: {}, {memory}{}{use_}", adapter.name, kind(adapter), adapter.driver);
        format!("{}\n", escape_controls(&line))
    };
    devices.iter().map(line).collect()
}

fn document(devices: &[ListedDevice]) -> String {
    let each = devices.iter().map(|ListedDevice { backend, adapter }| {
        json!({
            "backend": backend,
            "name": adapter.name,
            "kind": kind(adapter),
            "gpu": adapter.kind.is_gpu(),
            "driver": adapter.driver,
            // What a backend does not say is null.
            "memory_bytes": Some(adapter.memory_bytes).filter(|bytes| *bytes > 0),
            "binding_bytes": adapter.binding_bytes,
            "subgroup": Some(adapter.subgroup).filter(|threads| *threads > 0),
        })
    });
    format!("{:#}\n", json!({ "devices": each.collect::<serde_json::Value>() }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_software_driver_is_named_as_one() {
        let listed = |backend, name: &str, kind, memory_bytes| {
            let name = name.to_owned();
            let driver = "Vulkan 1.3.0".to_owned();
            let adapter = Adapter {
                name,
                driver,
                kind,
                memory_bytes,
                binding_bytes: 1 << 27,
                subgroup: 8,
                wide_atomics: true,
                subgroup_ops: Default::default(),
            };
            ListedDevice { backend, adapter }
        };
        let both =
            [listed("ash", "X", AdapterKind::Discrete, 2 << 30), listed("wgpu", "llvm", AdapterKind::Software, 0)];
        let expected = "ash: X: discrete GPU, 2048 MiB, Vulkan 1.3.0\n\
                        wgpu: llvm: software, Vulkan 1.3.0, used only with --device\n";
        assert_eq!(text(&both), expected);
        assert!(text(&[]).starts_with("no GPU"));
        let parsed: serde_json::Value = serde_json::from_str(&document(&both)).expect("JSON");
        assert_eq!((&parsed["devices"][0]["gpu"], &parsed["devices"][1]["gpu"]), (&json!(true), &json!(false)));
        assert_eq!(parsed["devices"][1]["memory_bytes"], serde_json::Value::Null);
    }
}
