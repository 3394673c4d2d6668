//! Settings that give way, and their values.

use crate::choose::{row, techniques};
use crate::scene::Scene;

/// Fewest splats, as a share of those that the scene has.
const LEAST_SHARE: f64 = 1.0 / 64.0;
/// Fewest sets of particles.
const LEAST_SETS: u32 = 2;
/// Samples along the side of a pixel that are tried below the scene's own. Between 6 and 8 a step saves too little.
const MOST_ANTIALIAS: u32 = 6;

/// Settings that may give way to a goal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rung {
    pub(super) antialias: u32,
    pub(super) splat_share: f64,
    /// Sets of particles.
    pub(super) sets: u32,
}

/// A setting of the scene that gave way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GivenUp {
    /// The key, such as `render.antialias`.
    pub key: &'static str,
    /// Its value in the scene, as it is written there.
    pub asked: String,
    /// The value that the picture was drawn with.
    pub taken: String,
}

impl Rung {
    pub(super) fn of_scene(scene: &Scene) -> Self {
        let render = &scene.render;
        Self { antialias: render.antialias, splat_share: render.splat_share, sets: render.particles.repeat_level }
    }

    pub(super) fn applied_to(self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        scene.render.antialias = self.antialias;
        scene.render.splat_share = self.splat_share;
        scene.render.particles.repeat_level = self.sets;
        scene
    }

    /// What differs from the scene's own settings.
    pub(super) fn given_up(self, asked: Self) -> Vec<GivenUp> {
        let number = organza_scene::short;
        let settings = [
            ("render.antialias", asked.antialias.to_string(), self.antialias.to_string()),
            ("render.splat_share", number(asked.splat_share), number(self.splat_share)),
            ("render.particles.repeat_level", asked.sets.to_string(), self.sets.to_string()),
        ];
        let gone = settings.into_iter().filter(|(_, asked, taken)| asked != taken);
        gone.map(|(key, asked, taken)| GivenUp { key, asked, taken }).collect()
    }
}

/// Whether a technique of the scene averages random sets.
pub(super) fn is_random(scene: &Scene) -> bool {
    techniques(scene).into_iter().any(|technique| row(technique).is_random)
}

/// Samples along the side of a pixel, from the scene's own down to one.
pub(super) fn antialias_values(asked: Rung) -> Vec<u32> {
    let fewer = 1..asked.antialias.min(MOST_ANTIALIAS + 1);
    std::iter::once(asked.antialias).chain(fewer.rev()).collect()
}

/// Every combination of values that give way: samples one by one, splats and sets by the root of two, so that no value halves the work at once. Where
/// nothing is made of splats, all that there are stay.
pub(super) fn rungs(scene: &Scene, has_splats: bool) -> Vec<Rung> {
    let asked = Rung::of_scene(scene);
    let mut shares = vec![asked.splat_share];
    let mut share = asked.splat_share;
    while has_splats && share > LEAST_SHARE {
        share = two_digits(share / std::f64::consts::SQRT_2).max(LEAST_SHARE);
        shares.push(share);
    }
    let mut levels = vec![asked.sets];
    let mut sets = asked.sets;
    while is_random(scene) && sets > LEAST_SETS {
        sets = (libm::round(f64::from(sets) / std::f64::consts::SQRT_2) as u32).clamp(LEAST_SETS, sets - 1);
        levels.push(sets);
    }
    let mut rungs = Vec::new();
    for antialias in antialias_values(asked) {
        for splat_share in &shares {
            for sets in &levels {
                rungs.push(Rung { antialias, splat_share: *splat_share, sets: *sets });
            }
        }
    }
    rungs
}

/// A share as a person writes it.
fn two_digits(share: f64) -> f64 {
    let digits = libm::exp2(libm::ceil(libm::log2(share))).recip();
    let unit = 100.0 * digits;
    libm::round(share * unit) / unit
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{LoadOptions, parse};

    fn scene(render: &str) -> Scene {
        let text = format!(
            "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nsize = [64, 48]\n\
             [[object]]\nname = 'fog'\nmedium_box = {{ min = [-1, -1, -1], max = [1, 1, 1], extinction = 1, spacing = 0.1 }}\n\
             [render]\n{render}\n"
        );
        parse("s.toml".as_ref(), text.as_bytes(), &LoadOptions::default()).unwrap()
    }

    #[test]
    fn each_setting_alone_gives_way_down_to_its_least_value_in_steps_below_two() {
        for render in
            ["antialias = 8", "antialias = 1", "technique = 'particles'", "splat_share = 0.01", "antialias = 3"]
        {
            let scene = scene(render);
            let asked = Rung::of_scene(&scene);
            let every = rungs(&scene, true);
            assert_eq!(every[0], asked);
            assert!(rungs(&scene, false).iter().all(|rung| rung.splat_share == asked.splat_share));
            let shares: Vec<f64> = every
                .iter()
                .filter(|r| r.antialias == asked.antialias && r.sets == asked.sets)
                .map(|r| r.splat_share)
                .collect();
            assert!(shares.windows(2).all(|pair| pair[1] < pair[0] && pair[1] > 0.6 * pair[0]), "{render}: {shares:?}");
            assert_eq!(shares.last(), Some(&LEAST_SHARE.min(asked.splat_share)), "{render}");
            let levels: Vec<u32> = every
                .iter()
                .filter(|r| r.antialias == asked.antialias && r.splat_share == asked.splat_share)
                .map(|r| r.sets)
                .collect();
            assert_eq!(levels.len() > 1, render.contains("particles"), "{render}");
            assert!(levels.windows(2).all(|pair| pair[1] < pair[0] && 5 * pair[1] >= 3 * pair[0]), "{levels:?}");
            assert!(every.iter().any(|rung| rung.antialias == 1), "{render}");
        }
    }

    #[test]
    fn what_was_given_up_is_named_with_both_values() {
        let asked = Rung { antialias: 4, splat_share: 1.0, sets: 100 };
        assert!(asked.given_up(asked).is_empty());
        let taken = Rung { splat_share: 0.25, ..asked };
        let expected = GivenUp { key: "render.splat_share", asked: "1".into(), taken: "0.25".into() };
        assert_eq!(taken.given_up(asked), [expected]);
    }

    #[test]
    fn shares_have_few_digits() {
        assert_eq!([0.6912, 0.5, 0.3536, 0.0312].map(two_digits), [0.69, 0.5, 0.355, 0.03125]);
    }
}
