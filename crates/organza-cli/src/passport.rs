//! `organza passport`.

use super::args::PassportArguments;
use super::console;
use super::devices::kind;
use organza::device::{AdapterKind, Checked, Passport, passport};
use organza::{Error, escape_controls};
use serde_json::{Value, json};
use std::fmt::Write;

/// Said of the timings of a driver that plays a GPU.
const NO_GPU: &str = "software, so its times are the processor's and none of a GPU";

/// Prints the matrix, and gives the exit code: 6 where a device does not conform.
pub(super) fn run(arguments: &PassportArguments) -> Result<u8, Error> {
    let name = arguments.device.as_deref().unwrap_or_default();
    let passports = passport(name)?;
    if let (Some(name), true) = (&arguments.device, passports.is_empty()) {
        let message = format!("--device {}: there is no such device", organza::shown(name));
        return Err(Error::Gpu { message, hint: "`organza devices` lists what there is".into() });
    }
    console::out(&if arguments.json { document(&passports) } else { text(&passports) })?;
    Ok(if passports.iter().all(Passport::valid) { 0 } else { 6 })
}

fn text(passports: &[Passport]) -> String {
    if passports.is_empty() {
        return "no GPU: no Vulkan driver was found; the processor computes\n".to_owned();
    }
    let mut text = String::new();
    for Passport { backend, adapter, missing, recordings } in passports {
        let about = if adapter.kind == AdapterKind::Software { NO_GPU } else { kind(adapter) };
        let head = format!("{backend}: {}, {}: {about}", adapter.name, adapter.driver);
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{}", escape_controls(&head));
        recordings.iter().for_each(|r| text += &checked_text(r));
        if !missing.is_empty() {
            let _ = writeln!(text, "  missing: {}", missing.join(", "));
        }
    }
    text
}

fn checked_text(checked: &Checked) -> String {
    let Checked { recording, items, outcome, passes } = checked;
    let mut text = match outcome {
        Err(why) => format!("  {recording}: did not run: {}\n", escape_controls(why)),
        Ok(a) => {
            let verdict = if a.within { "conforms" } else { "DIFFERS" };
            let share = 100.0 * a.equal_share;
            format!(
                "  {recording}, {items} in: {verdict}; {share:.3} % equal bits, difference {:.3e} in the mean, {:.3e} at most ({})\n",
                a.mean, a.max, a.unit
            )
        }
    };
    for pass in passes {
        let _ = writeln!(text, "    {:<18} {:>3} x {:>10.3} ms", pass.kernel, pass.dispatches, pass.nanoseconds * 1e-6);
    }
    text
}

fn document(passports: &[Passport]) -> String {
    let each = passports.iter().map(|p| {
        json!({
            "backend": p.backend,
            "name": p.adapter.name,
            "kind": kind(&p.adapter),
            "gpu": p.adapter.kind.is_gpu(),
            "driver": p.adapter.driver,
            "valid": p.valid(),
            "missing": p.missing,
            "recordings": p.recordings.iter().map(checked_json).collect::<Value>(),
        })
    });
    format!("{:#}\n", json!({ "passports": each.collect::<Value>() }))
}

fn checked_json(checked: &Checked) -> Value {
    let passes = checked
        .passes
        .iter()
        .map(|pass| json!({ "kernel": pass.kernel, "dispatches": pass.dispatches, "nanoseconds": pass.nanoseconds }));
    let agreement = checked.outcome.as_ref().ok();
    json!({
        "recording": checked.recording,
        "items": checked.items,
        "within": agreement.is_some_and(|a| a.within),
        // What was not measured is null.
        "failure": checked.outcome.as_ref().err(),
        "equal_share": agreement.map(|a| a.equal_share),
        "mean_difference": agreement.map(|a| a.mean),
        "max_difference": agreement.map(|a| a.max),
        "unit": agreement.map(|a| a.unit),
        "passes": passes.collect::<Value>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use organza::device::{Adapter, Agreement, KernelTime};

    fn one(kind: AdapterKind, outcome: Result<Agreement, String>) -> Passport {
        let name = "X".to_owned();
        let driver = "Vulkan 1.3.0".to_owned();
        let adapter = Adapter {
            name,
            driver,
            kind,
            memory_bytes: 0,
            binding_bytes: 1 << 27,
            subgroup: 8,
            wide_atomics: true,
            subgroup_ops: Default::default(),
        };
        let passes = vec![KernelTime { kernel: "hbsort_scatter", dispatches: 4, nanoseconds: 2.5e6 }];
        let checked = Checked { recording: "order", items: 9, outcome, passes };
        Passport { backend: "ash", adapter, missing: vec!["timestamps"], recordings: vec![checked] }
    }

    fn agreement(within: bool) -> Agreement {
        Agreement { within, equal_share: 1.0, mean: 0.0, max: 0.0, unit: "places" }
    }

    #[test]
    fn times_of_a_software_driver_are_labelled() {
        let expected = "ash: X, Vulkan 1.3.0: software, so its times are the processor's and none of a GPU\n\
                        \x20 order, 9 in: conforms; 100.000 % equal bits, difference 0.000e0 in the mean, 0.000e0 at most (places)\n\
                        \x20   hbsort_scatter       4 x      2.500 ms\n\
                        \x20 missing: timestamps\n";
        assert_eq!(text(&[one(AdapterKind::Software, Ok(agreement(true)))]), expected);
        assert!(!text(&[one(AdapterKind::Discrete, Ok(agreement(true)))]).contains("software"));
        assert!(text(&[]).starts_with("no GPU"));
    }

    #[test]
    fn what_differs_or_fails_is_no_valid_passport() {
        let outcomes = [Ok(agreement(true)), Ok(agreement(false)), Err("lost".to_owned())];
        let [good, bad, failed] = outcomes.map(|outcome| one(AdapterKind::Discrete, outcome));
        assert!(good.valid() && !bad.valid() && !failed.valid());
        assert!(text(&[bad]).contains("DIFFERS") && text(std::slice::from_ref(&failed)).contains("did not run: lost"));
        let parsed: Value = serde_json::from_str(&document(&[failed])).expect("JSON");
        let recording = &parsed["passports"][0]["recordings"][0];
        assert_eq!((&recording["failure"], &recording["mean_difference"]), (&json!("lost"), &Value::Null));
    }
}
