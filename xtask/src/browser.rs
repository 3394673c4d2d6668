//! `cargo xtask browser`: the page of `organza view` in Chromium, without a window.

use crate::ci::{DRIVER, FEATURES, cargo, split};
use crate::debian;
use crate::repo::{Outcome, Repo};
use crate::vulkan::TESTS;

/// The program that the tests begin, and Debian's name of its package.
const CHROMIUM: &str = "chromium";

/// In the names of its tests.
pub(crate) const PAGE: &str = "deep::page";

/// Runs the tests of the page where Chromium is, or can be installed.
pub(crate) fn run(repo: &Repo) -> Outcome {
    let folders = debian::folders();
    let is_there = || debian::on_path(&folders, CHROMIUM).is_some();
    if !is_there() {
        debian::install(&folders, &[CHROMIUM], CHROMIUM);
    }
    if !is_there() {
        return debian::without("browser", &[CHROMIUM], CHROMIUM);
    }
    cargo(&split(&format!("{TESTS} --features {FEATURES},{DRIVER} --test end-to-end -- {PAGE}")), &[], repo)?;
    Ok("browser: the page works in Chromium".to_owned())
}
