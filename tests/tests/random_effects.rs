//! Scenes by chance: whatever their plans leave out, forced on, changes no displayed pixel by more than the tolerance.

use crate::light_effects::{displayed, largest_change, loaded, render};
use organza::scene::{LoadOptions, Override, Scene, parse};
use splat_core::rng;
use std::ops::Range;
use std::path::Path;

/// By how much a displayed value differs where splats are rounded about another origin.
const ROUNDING: f64 = 1e-5;

/// Cells of a light's map that err by next to nothing in pictures as small as these.
const FINE_CELLS: u32 = 512;

/// Numbers by chance, the same for the same seed.
struct Chance {
    seed: u64,
    drawn: u64,
}

impl Chance {
    fn number(&mut self, low: f64, high: f64) -> f64 {
        self.drawn += 1;
        low + (high - low) * rng::unit(self.seed, 2, self.drawn, 0)
    }

    fn one_of<'a>(&mut self, choices: &[&'a str]) -> &'a str {
        choices[(self.number(0.0, choices.len() as f64) as usize).min(choices.len() - 1)]
    }

    /// A power of ten: from next to nothing to much.
    fn power(&mut self, low: f64, high: f64) -> f64 {
        10f64.powf(self.number(low, high))
    }

    fn place(&mut self, reach: f64) -> String {
        let mut along = |low: f64, high: f64| self.number(low, high);
        format!("[{}, {}, {}]", along(-reach, reach), along(-0.4, reach), along(-reach, reach))
    }

    fn light(&mut self, name: usize) -> String {
        let strength = self.power(-5.0, 1.5);
        let intensity = format!("intensity = [{strength}, {strength}, {}]", 0.5 * strength);
        let place = self.place(3.0);
        let key = format!("[[light]]\nname = 'l{name}'\n");
        key + &match self.one_of(&["point", "sphere", "directional"]) {
            "point" => format!("kind = 'point'\nposition = {place}\n{intensity}\n"),
            "sphere" => format!("kind = 'sphere'\nposition = {place}\nradius = 0.2\nsamples = 3\n{intensity}\n"),
            _ => {
                let slant = self.number(-1.0, 1.0);
                format!(
                    "kind = 'directional'\ndirection = [{slant}, -1, -0.4]\nirradiance = [{strength}, {strength}, {strength}]\n"
                )
            }
        }
    }

    fn object(&mut self, name: usize) -> String {
        let center = self.place(2.0);
        let size = self.number(0.1, 0.6);
        let faint = self.power(-6.0, 0.3);
        let color = self.power(-4.0, 0.0);
        let key = format!("[[object]]\nname = 'o{name}'\ncolor = [{color}, {color}, {color}]\n");
        key + &match self.one_of(&["ball", "pane", "volume", "glass"]) {
            "ball" => format!(
                "material = 'tinted'\nmedium_ball = {{ center = {center}, radius = {size}, extinction = {}, spacing = {} }}\n",
                faint / size,
                0.3 * size
            ),
            "pane" => format!(
                "opacity = {}\nrectangle = {{ center = {center}, u = [{size}, 0, 0], v = [0, 0.2, -{size}], spacing = {} }}\n",
                faint.min(1.0),
                0.3 * size
            ),
            "volume" => format!(
                "material = 'phong'\ntransform = {{ translate = {center} }}\n\
                 density = {{ expression = '1 - x^2 - y^2', box = [[-0.4, -0.4, -0.4], [0.4, 0.4, 0.4]], spacing = 0.12, extinction = {faint} }}\n"
            ),
            _ => format!(
                "material = 'm{name}'\nopacity = 0.1\ntechnique = 'surfels'\ntransform = {{ translate = {center} }}\n\
                 implicit = {{ expression = 'x^2 + y^2 + z^2 - 0.1', box = [[-0.4, -0.4, -0.4], [0.4, 0.4, 0.4]], spacing = 0.12 }}\n\
                 [material.m{name}]\nabsorption_inside = [{faint}, {}, {faint}]\n",
                0.5 * faint
            ),
        }
    }

    fn scene(&mut self) -> String {
        let exposure = self.one_of(&["0", "0", "-4", "6"]);
        let tolerance = self.one_of(&["0.00392156862745098", "0.000977517106549365", "0.0625"]);
        let technique = self.one_of(&["points", "points", "surfels", "reference"]);
        let mut text = "version = 1\n[camera]\nposition = [0, 1, 4]\ntarget = [0, 0, 0]\nsize = [24, 24]\n[background]\n\
                        color = [0.1, 0.15, 0.3]\n[material.tinted]\nextinction_rgb = [0.5, 1, 1.5]\n[material.phong]\nshading = 'phong'\n\
                        [[object]]\nname = 'ground'\ntechnique = 'points'\n\
                        rectangle = { center = [0, -0.6, 0], u = [2, 0, 0], v = [0, 0, -2], spacing = 0.1 }\n"
            .to_owned();
        (0..1 + self.number(0.0, 3.0) as usize).for_each(|name| text += &self.light(name));
        (0..1 + self.number(0.0, 3.0) as usize).for_each(|name| text += &self.object(name));
        // Discs alone are drawn by surfels.
        let technique = if text.contains("medium_ball") || text.contains("density") { "points" } else { technique };
        text + &format!(
            "[render]\nantialias = 1\ndepth_ranges = 2\nexposure = {exposure}\ntolerance = {tolerance}\ntechnique = '{technique}'\n"
        )
    }
}

/// The scene with these effects on; `None` where it has no cause of one.
fn with_effects(text: &str, names: &[&str]) -> Option<Scene> {
    let on = |name: &&str| Override::of_effect(&format!("{name}=on")).ok();
    let overrides = names.iter().map(on).collect::<Option<Vec<_>>>()?;
    parse(Path::new("s.toml"), text.as_bytes(), &LoadOptions { overrides, ..LoadOptions::default() }).ok()
}

/// Forces on what each plan leaves out, alone and all together.
#[track_caller]
fn nothing_that_is_left_out_is_seen(seeds: Range<u64>) {
    let mut left_out = 0;
    let mut moved_cells = 0;
    for seed in seeds.clone() {
        let text = Chance { seed, drawn: 0 }.scene();
        let scene = loaded(&text, &[]);
        let tolerance = scene.render.tolerance;
        let planned = render(&scene);
        let off = planned.plan.effects.iter().filter(|effect| !effect.called_for && !effect.is_absent);
        let names: Vec<&str> = off.clone().map(|effect| effect.name.as_str()).collect();
        let spent: f64 = off.map(|effect| effect.bound.number().unwrap()).sum();
        assert!(spent <= tolerance, "seed {seed}: bounds of {spent} are left out of {tolerance}\n{text}");
        let can_be_on: Vec<&str> =
            names.iter().copied().filter(|name| with_effects(&text, &[name]).is_some()).collect();
        left_out += can_be_on.len();
        let alone = can_be_on.iter().map(std::slice::from_ref);
        let all_sets = alone.chain((can_be_on.len() > 1).then_some(&can_be_on[..]));
        for names in all_sets {
            let on = render(&with_effects(&text, names).unwrap());
            let mut change = largest_change(&displayed(&planned, &scene), &displayed(&on, &scene));
            if change > tolerance + ROUNDING {
                // A caster more moves the cells of a light's map, whose error is an estimate and in no bound.
                moved_cells += 1;
                let fine = |scene: &Scene| {
                    let mut scene = scene.clone();
                    scene.render.shadow.cells = Some(FINE_CELLS);
                    displayed(&render(&scene), &scene)
                };
                change = largest_change(&fine(&scene), &fine(&with_effects(&text, names).unwrap()));
            }
            assert!(change <= tolerance + ROUNDING, "seed {seed}, {names:?}: {change} beyond {tolerance}\n{text}");
        }
    }
    println!("{left_out} effects were left out in scenes {seeds:?}; in {moved_cells} pictures maps err by more");
    assert!(moved_cells as u64 <= (seeds.end - seeds.start) / 200, "maps err by more in {moved_cells} pictures");
    assert!(left_out as u64 > (seeds.end - seeds.start) / 4, "{left_out} left out");
}

#[test]
fn nothing_that_plans_of_scenes_by_chance_leave_out_is_seen() {
    nothing_that_is_left_out_is_seen(0..16);
}

/// What takes long and rarely fails where the others hold.
mod deep {
    #[test]
    fn nothing_that_plans_of_a_thousand_scenes_by_chance_leave_out_is_seen() {
        super::nothing_that_is_left_out_is_seen(16..1016);
    }
}
