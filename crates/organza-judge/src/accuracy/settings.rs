//! Turns knobs into the settings to draw: the stated setting, each step of each knob alone, and knobs together.

use super::{Request, Step, Sweep};

/// A position of every knob.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// The knob that is turned, and its position, in words.
    pub label: String,
    /// The knob that is turned alone; `None` for the scene's stated setting and for several knobs together.
    pub knob: Option<&'static str>,
    /// The picture to draw.
    pub request: Request,
}

/// All settings of a sweep.
pub(super) struct Settings {
    /// The first is the scene's own.
    pub(super) list: Vec<Setting>,
    /// For each knob: the setting of each step.
    pub(super) of_step: Vec<Vec<usize>>,
}

impl Settings {
    pub(super) fn new(sweep: &Sweep) -> Self {
        let base = Setting { label: sweep.base_label.clone(), knob: None, request: sweep.base.clone() };
        let mut settings = Self { list: vec![base], of_step: Vec::new() };
        for knob in &sweep.knobs {
            let add = |step: &Step| {
                let label = format!("{}: {}", knob.name, step.label);
                settings.add(label, Some(knob.name), sweep.turned(knob, step))
            };
            let of_step = knob.steps.iter().map(add).collect();
            settings.of_step.push(of_step);
        }
        settings
    }

    /// The place of a request, added if it is new.
    fn add(&mut self, label: String, knob: Option<&'static str>, request: Request) -> usize {
        let known = self.list.iter().position(|s| s.request == request);
        known.unwrap_or_else(|| {
            self.list.push(Setting { label, knob, request });
            self.list.len() - 1
        })
    }

    /// Adds the settings that turn several knobs together, those that `resolved` names.
    pub(super) fn join(&mut self, sweep: &Sweep, resolved: &[&str]) {
        (0..sweep.joint_levels).for_each(|level| self.add_joint(sweep, level, resolved));
    }

    fn add_joint(&mut self, sweep: &Sweep, level: usize, resolved: &[&str]) {
        let mut request = sweep.base.clone();
        let last = sweep.joint_levels.saturating_sub(1).max(1);
        for knob in sweep.knobs.iter().filter(|k| k.joint && !k.steps.is_empty() && resolved.contains(&k.name)) {
            let step = &knob.steps[(level * (knob.steps.len() - 1) + last / 2) / last];
            (knob.set)(&mut request, step.value);
        }
        self.add(format!("all together, {} of {}", level + 1, sweep.joint_levels), None, request);
    }
}
