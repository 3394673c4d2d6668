//! Loading a scene: splats are counted before they are made, limits hold for the scene as a whole, interrupts are heard.

use organza::scene::{LoadOptions, Scene, parse};
use organza::{Context, Error, Files, Loaded, Progress, RenderOptions, explain};
use splat_core::Exceeded;
use std::path::Path;

const SCENE: &str = "version = 1\n\
    [camera]\nposition = [0, 0, 9]\ntarget = [0, 0, 0]\nsize = [8, 8]\n\
    [[object]]\nname = 'wall'\nrectangle = { center = [0, 0, -1], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.05 }\n\
    [[object]]\nname = 'fog'\nmedium_box = { min = [-1, -1, 0], max = [1, 1, 1], extinction = 2, spacing = 0.1 }\n\
    [[object]]\nname = 'drop'\nmedium_ball = { center = [0, 0, 0], radius = 1, extinction = 2, spacing = 0.1 }\n\
    [[object]]\nname = 'wave'\nimplicit = { expression = 'y - 0.1*sin(5*x)', box = [[-1, -1, -1], [1, 1, 1]], spacing = 0.05 }\n\
    [[object]]\nname = 'mist'\ndensity = { expression = 'x', box = [[-1, -1, -1], [1, 1, 1]], spacing = 0.1, extinction = 1 }\n";

fn scene(more: &str) -> Scene {
    parse(Path::new("s.toml"), format!("{SCENE}{more}").as_bytes(), &LoadOptions::default()).unwrap()
}

/// Nothing was read before.
fn load(scene: &Scene, options: &RenderOptions, progress: &Progress) -> Result<Loaded, Error> {
    organza::load(scene, Context { files: &Files::default(), options, progress })
}

#[test]
fn explain_counts_the_splats_of_every_object_before_they_are_made() {
    let explanation = explain(&scene(""), &RenderOptions::default(), &Progress::new()).unwrap();
    let splats = &explanation.splats;
    let names: Vec<&str> = splats.iter().map(|s| s.object.as_str()).collect();
    assert_eq!(names, ["wall", "fog", "drop", "wave", "mist"]);
    for s in splats {
        assert!(!s.exact || s.predicted == s.made, "{s:?}");
        assert!((s.predicted as f64 / s.made as f64 - 1.0).abs() < 0.3, "{s:?}");
    }
    assert_eq!(splats.iter().map(|s| s.exact).collect::<Vec<_>>(), [true, true, false, false, false]);
    assert_eq!((splats[0].made, splats[1].made), (1600, 4000));
}

#[test]
fn the_limit_of_splats_holds_for_the_scene_and_before_any_conversion() {
    let most = |n: u64| scene(&format!("[render]\nmax_points = {n}\n"));
    let made: u64 =
        load(&scene(""), &RenderOptions::default(), &Progress::new()).unwrap().splats.iter().map(|s| s.made).sum();
    load(&most(made), &RenderOptions::default(), &Progress::new()).unwrap();
    let progress = Progress::new();
    let error = load(&most(5599), &RenderOptions::default(), &progress).unwrap_err();
    assert!(matches!(error, Error::Limit(Exceeded { needed: 5600, limit: Some(5599), .. })), "{error}");
    assert!(error.to_string().contains("before conversion, most of them 'fog' with 4000"), "{error}");
    // Objects were counted, nothing was converted: only their own units are announced.
    assert_eq!(progress.read().total, 5);
    // One splat less than all of them: an estimate lets it pass, the conversion does not.
    let error = load(&most(made - 1), &RenderOptions::default(), &Progress::new()).unwrap_err();
    assert_eq!(error.exit_code(), 5, "{error}");
    let options = RenderOptions { max_memory: 256 * 5599, ..RenderOptions::default() };
    assert!(matches!(
        load(&scene(""), &options, &Progress::new()),
        Err(Error::Limit(Exceeded { limit: Some(5599), .. }))
    ));
}

#[test]
fn an_interrupt_stops_loading() {
    let progress = Progress::new();
    progress.cancel();
    assert!(matches!(load(&scene(""), &RenderOptions::default(), &progress), Err(Error::Cancelled)));
    // In the middle of a conversion of some million splats.
    let long = scene(
        "[[object]]\nname = 'long'\ndensity = { expression = '1', box = [[0, 0, 0], [1, 1, 1]], spacing = 0.006, extinction = 1 }\n",
    );
    let progress = Progress::new();
    let result = std::thread::scope(|scope| {
        scope.spawn(|| {
            while progress.read().done < 100_000 {
                std::thread::yield_now();
            }
            progress.cancel();
        });
        load(&long, &RenderOptions::default(), &progress)
    });
    assert!(matches!(result, Err(Error::Cancelled)));
}

#[test]
fn an_expression_that_nothing_bounds_is_refused_by_its_operations_before_the_work() {
    // A long sum whose bounds say nothing, for every term has any sign.
    let terms: Vec<String> = (1..60).map(|k| format!("sin({k}*x)*cos({k}*y)*sin({k}*z)")).collect();
    let implicit = |resolution: u32, expression: &str| {
        scene(&format!(
            "[[object]]\nname = 'long'\nimplicit = {{ expression = '{expression}', box = [[-1, -1, -1], [1, 1, 1]], \
             resolution = {resolution} }}\n"
        ))
    };
    let explain = |s: &Scene| organza::explain(s, &RenderOptions::default(), &Progress::new());
    let error = explain(&implicit(800, &terms.join(" + "))).unwrap_err();
    assert_eq!(error.exit_code(), 5, "{error}");
    let words = "the expression of object 'long'";
    assert!(error.to_string().contains(words) && error.hint().contains("larger spacing"), "{error} {}", error.hint());
    // The same lattice with a bound, and a coarser one with a shorter sum that has none, are no work.
    explain(&implicit(800, "x^2 + y^2 + z^2 - 0.001")).unwrap();
    explain(&implicit(40, &terms[..4].join(" + "))).unwrap();
}
