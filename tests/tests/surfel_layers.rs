//! The ways in which the technique `surfels` tells layers apart, as keys of a scene.

use organza::scene::{LoadOptions, Scene, parse};
use organza::{Progress, Render, RenderOptions, Sequence, explain, render};
use organza_judge::orders::{Comparison, Options, OrdersReport, compare};
use organza_tests::{draw, organza, parallel_view, window};

fn scene(text: &str, frame: Option<u32>) -> Scene {
    parse("s.toml".as_ref(), text.as_bytes(), &LoadOptions { frame, ..LoadOptions::default() }).unwrap()
}

fn panes(layers: &str) -> String {
    let pane = |k: u32| {
        format!(
            "[[object]]\nname = 'pane {k}'\nopacity = 0.5\n\
             rectangle = {{ center = [0, 0, {}], u = [2, 0, 2], v = [0, 3, 0], spacing = 0.06 }}\n",
            0.5 * f64::from(k) - 0.75
        )
    };
    let panes: String = (0..4).map(pane).collect();
    format!("{}{panes}[render.surfels]\ntransmittance_cutoff = 0\n{layers}", parallel_view(2.0, 24))
}

#[test]
fn as_many_panes_are_peeled_as_the_scene_says() {
    for (layers, seen) in
        [("'gaps'", 4), ("'peeled'\npeeled_layers = 1", 1), ("'peeled'\npeeled_layers = 3", 3), ("'peeled'", 4)]
    {
        let alpha = draw(&panes(&format!("layers = {layers}\n")), &["--technique", "surfels"]).opacity();
        let exact = 1.0 - 0.5f64.powi(seen);
        let off = window(&alpha, 24, 4..20, 4..20).iter().map(|a| (a - exact).abs()).fold(0.0, f64::max);
        assert!(off < 1e-6, "{layers}: {off:e}");
    }
}

/// Where every group covers the surface and hardly overlaps itself, its image is that of the surface.
#[test]
fn groups_that_cover_panes_let_through_what_these_do() {
    let off = |keys: &str| {
        let text = panes(&format!("layers = 'algorithm1'\ngroups = 9\n{keys}\n"));
        let alpha = draw(&text, &["--technique", "surfels"]).opacity();
        let seen = window(&alpha, 24, 4..20, 4..20);
        (seen.iter().map(|a| (a - 0.9375).powi(2)).sum::<f64>() / seen.len() as f64).sqrt()
    };
    let partial = off("coverage = 'partial'");
    for (keys, share) in
        [("", 1.0), ("coverage = 'enlarged'", 0.25), ("coverage = 'bound'", 0.1), ("grouping = 'hash'", 0.25)]
    {
        println!("{keys}: RMS off {:.4}, partial {partial:.4}", off(keys));
        assert!(off(keys) < share * partial, "{keys}: {} of {partial}", off(keys));
    }
}

/// Four balls within one another, of opacity 0.2, lit from a side.
fn balls(keys: &str) -> String {
    let ball = |k: u32| {
        let r = 1.0 - 0.2 * f64::from(k);
        format!(
            "[[object]]\nname = 'ball {k}'\nopacity = 0.2\nimplicit = {{ expression = 'x^2 + y^2 + z^2 - {}', \
             box = [[-1.1, -1.1, -1.1], [1.1, 1.1, 1.1]], spacing = 0.09 }}\n",
            r * r
        )
    };
    let balls: String = (0..4).map(ball).collect();
    format!(
        "version = 1\n[camera]\nposition = [0, 0.3, 4]\ntarget = [0, 0, 0]\nsize = [48, 36]\n[ambient]\ncolor = [0.2, 0.2, 0.2]\n\
         [[light]]\nkind = 'directional'\ndirection = [-0.6, -0.6, -0.5]\nirradiance = [2.4, 2.0, 1.6]\nshadow = false\n\
         {balls}[render]\nantialias = 1\n[render.surfels]\n{keys}"
    )
}

fn compared(keys: &str) -> Comparison {
    compare(&scene(&balls(keys), None), &Options::default(), &RenderOptions::default(), &Progress::new()).unwrap()
}

/// Section 6.3 of the paper: ε of Algorithm 1, Algorithm 2 and the three nearest layers is 4.71, 3.42 and 5.82.
#[test]
fn orders_has_the_papers_errors_of_layers() {
    let comparison = compared("layers = 'algorithm1'\ngroups = 4\n");
    let report = OrdersReport::new(&scene(&balls(""), None), comparison).unwrap();
    let document: serde_json::Value = serde_json::from_str(&report.json()).unwrap();
    let rows = document["orderings"].as_array().unwrap();
    let epsilon = |name: &str| {
        let row = rows.iter().find(|r| r["ordering"] == name).unwrap_or_else(|| panic!("no {name}"));
        assert_eq!(row["of_layers"], true);
        row["epsilon_8_bit"].as_f64().unwrap()
    };
    let gaps = epsilon("layers by gaps");
    let [first, second] = [1, 2].map(|k| epsilon(&format!("layers by Algorithm {k}, 4 groups")));
    let [three, eight] = [3, 8].map(|k| epsilon(&format!("the {k} nearest layers")));
    println!(
        "ε: gaps {gaps:.4}, Algorithm 1 {first:.2}, Algorithm 2 {second:.2}, 3 layers {three:.2}, 8 layers {eight:.4}"
    );
    assert!(second < first && first < three && gaps.max(eight) < second, "{gaps} {first} {second} {three} {eight}");
    // A step of 8 bits in one of a hundred pixels.
    assert!(gaps < 0.01 && eight < 0.01, "{gaps} {eight}");
    assert!(report.csv().lines().next().unwrap().ends_with("epsilon_8_bit,of_layers"));
}

#[test]
fn what_has_no_layers_is_said() {
    let few = balls("").replace("[48, 36]", "[8, 6]").replace("spacing = 0.09", "spacing = 0.3");
    let with = |more: &str| {
        let scene = scene(&(few.clone() + more), None);
        compare(&scene, &Options::default(), &RenderOptions::default(), &Progress::new())
    };
    let fog =
        "[[object]]\nname = 'fog'\nmedium_ball = { center = [0, 0, 0], radius = 0.3, extinction = 1, spacing = 0.1 }\n";
    assert_eq!(with(fog).unwrap().layers.unwrap_err(), "`fog` is a medium");
    let glass = "[material.g]\nior = 1.5\n[[object]]\nname = 'g'\nmaterial = 'g'\n\
                 rectangle = { center = [0, 0, 2], u = [0.2, 0, 0], v = [0, 0.2, 0], spacing = 0.1 }\n";
    assert!(with(glass).unwrap().layers.unwrap_err().contains("`g` bounds matter"));
}

#[test]
fn keys_of_groups_are_refused_where_they_mean_nothing_or_are_out_of_range() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |keys: &str, expected: &str| {
        std::fs::write(
            folder.path().join("s.toml"),
            format!("version = 1\n[render.surfels]\n{keys}\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nsize = [4, 4]\n"),
        )
        .unwrap();
        let out = organza().args(["explain", "s.toml"]).current_dir(&folder).output().unwrap();
        let said = String::from_utf8(out.stderr).unwrap();
        assert_eq!(out.status.code(), Some(3), "{keys}: {said}");
        assert!(said.contains(expected), "{keys}: {said}");
    };
    let one = "layers = 'algorithm1'\n";
    refused("layers = 'algorithm3'", "s.toml:3:10:");
    refused("peeled_layers = 3", "s.toml:3:17: `peeled_layers` belongs to layers = \"peeled\"");
    refused("groups = 3", "s.toml:3:10: `groups` belongs to layers = \"algorithm1\" or \"algorithm2\"");
    refused(
        "layers = 'peeled'\npeeled_layers = 0",
        "s.toml:4:17: `peeled_layers`: expected a whole number from 1 to 1024",
    );
    refused(&format!("{one}groups = 0"), "s.toml:4:10: `groups`: expected a whole number from 1 to 256, found 0");
    refused(&format!("{one}groups = 257"), "`groups`: expected a whole number from 1 to 256, found 257");
    refused(&format!("{one}overlap_factor = 0.5"), "`overlap_factor` belongs to grouping = \"mgc\"");
    refused(&format!("{one}grouping = 'mgc'\noverlap_factor = 0"), "s.toml:5:18: `overlap_factor`: expected a number");
    refused(&format!("{one}grouping = 'mgc'\noverlap_factor = 1.5"), "`overlap_factor`: expected a number");
    refused(&format!("{one}collisions = 'keep'"), "`collisions` belongs to grouping = \"hash\"");
    refused(
        &format!("{one}grouping = 'hash'\ncollisions = 'near'"),
        "s.toml:5:14: `collisions`: \"near\" needs `near_distance`",
    );
    refused(&format!("{one}near_distance = 1"), "`near_distance` belongs to collisions = \"near\"");
    refused(&format!("{one}depth_steps = 1.5"), "s.toml:4:15: `depth_steps`: expected \"auto\" or a whole number");
    refused(&format!("{one}depth_steps = 0"), "`depth_steps`: expected \"auto\" or a whole number from 1");
    refused(&format!("{one}coverage = 'some'"), "s.toml:4:12:");
}

#[test]
fn glass_is_drawn_by_gaps_and_by_the_algorithms() {
    let text = format!(
        "{}[background]\ncolor = [0.5, 0.5, 0.5]\n[material.glass]\nior = 1.5\n[[object]]\nname = 'ball'\nmaterial = 'glass'\nimplicit = {{ expression = 'x^2 + y^2 + z^2 - 0.25', \
         box = [[-0.6, -0.6, -0.6], [0.6, 0.6, 0.6]], spacing = 0.1 }}\n",
        parallel_view(1.6, 16)
    );
    let planned = |keys: &str| {
        explain(&scene(&(text.clone() + keys), None), &RenderOptions::default(), &Progress::new()).unwrap()
    };
    let by = planned("[render.surfels]\nlayers = 'algorithm2'\n");
    assert!(!by.warnings.iter().any(|w| w.contains("leaves out")), "{:?}", by.warnings);
    let effect =
        |e: &organza::Explanation, name: &str| e.plan.effects.iter().find(|e| e.name == name).cloned().unwrap();
    assert!(effect(&by, "bending.ball").called_for);
    assert!(effect(&by, "layers of surfaces").reason.contains("4 groups by weighted colouring"));
    assert!(by.plan.passes.iter().any(|p| p.name == "group"));
    let gaps = planned("");
    assert!(effect(&gaps, "bending.ball").called_for && !gaps.warnings.iter().any(|w| w.contains("bounds")));
    assert!(effect(&gaps, "layers of surfaces").reason.contains("gaps in depth"));
    assert!(gaps.plan.passes.iter().all(|p| p.name != "group"));
    // Coloured glass in a light with shadows: its absorption casts none, which a note says.
    const LAMP: &str = "[[light]]\nkind = 'point'\nposition = [2, 2, 2]\nintensity = [9, 9, 9]\n";
    let told = |text: String| {
        let explained = explain(&scene(&text, None), &RenderOptions::default(), &Progress::new()).unwrap();
        explained
            .notes
            .iter()
            .any(|note| note.contains("'ball' absorbs light inside, but its shadow is that of its `opacity`"))
    };
    let colored = text.replace("ior = 1.5\n", "ior = 1.5\nabsorption_inside = [0.1, 0.5, 1]\n");
    assert!(told(colored.clone() + LAMP));
    assert!(!told(colored) && !told(text.clone() + LAMP));
    assert!(by.memory > gaps.memory, "groups are counted");
}

/// Discs that were grouped anew in a frame.
fn grouped_anew(render: &Render) -> u64 {
    render.cost.stages.iter().find(|s| s.name == "group").unwrap().items_out
}

#[test]
fn groups_are_made_once_for_what_moves_and_anew_for_what_changes_its_shape() {
    let track = |set: &str, values: [&str; 3]| {
        let keys: String =
            values.iter().enumerate().map(|(k, v)| format!("{{ frame = {k}, value = {v} }}, ")).collect();
        format!("[[animation.track]]\nset = '{set}'\nkeys = [{keys}]\n")
    };
    let base = |keys: &str| {
        balls(&format!("layers = 'algorithm1'\n{keys}")).replace("[render]\n", "[render]\ntechnique = 'surfels'\n")
    };
    let moves = track("object.ball 0.transform.rotate", ["[0, 0, 0]", "[0, 40, 10]", "[0, 80, 20]"])
        + &track("object.ball 1.transform.translate", ["[0, 0, 0]", "[0.3, 0, 0]", "[0.3, 0.2, 0.1]"])
        + &track("object.ball 2.opacity", ["0.2", "0.3", "0.4"])
        + &track("camera.position", ["[0, 0.3, 4]", "[1, 0.3, 4]", "[1, 1, 4]"]);
    let shapes = moves.clone() + &track("object.ball 3.implicit.spacing", ["0.09", "0.1", "0.12"]);
    let anew = |text: &str| {
        let frames = [0, 1, 2].map(|k| scene(text, Some(k)));
        let mut sequence = Sequence::new(&frames);
        frames
            .each_ref()
            .map(|f| grouped_anew(&sequence.render(f, &RenderOptions::default(), &Progress::new()).unwrap()))
    };
    let kept = anew(&format!("{}[animation]\nframes = 3\n{moves}", base("")));
    assert!(kept[0] > 500 && kept[1..] == [0, 0], "{kept:?}");
    let changed = anew(&format!("{}[animation]\nframes = 3\n{shapes}", base("")));
    assert!(changed[1] > 30 && changed[2] > 30 && 2 * changed[1] < changed[0], "{changed:?}");
    // Opaque discs keep theirs as well.
    let solid = balls("opaque = 'one_pass'\n").replace("[render]\n", "[render]\ntechnique = 'surfels'\n");
    let solid = solid.replace("opacity = 0.2", "opacity = 1");
    let kept_too = anew(&format!("{solid}[animation]\nframes = 3\n{moves}"));
    assert!(kept_too[0] > 300 && kept_too[1..] == [0, 0], "{kept_too:?}");
    let changed_too = anew(&format!("{solid}[animation]\nframes = 3\n{shapes}"));
    assert_eq!(changed_too[1..], changed[1..], "of the ball whose discs come closer");
    // Groups by what is near the eye are of one view.
    let near = anew(&format!(
        "{}[animation]\nframes = 3\n{moves}",
        base("grouping = 'hash'\ncollisions = 'near'\nnear_distance = 3\n")
    ));
    assert!(near.iter().all(|n| *n == kept[0]), "{near:?} {kept:?}");
}

#[test]
fn threads_change_no_bit_of_any_mode() {
    let text = balls("").replace("[render]\n", "[render]\ntechnique = 'surfels'\n");
    let modes = ["layers='algorithm1'", "layers='algorithm2'", "layers='peeled'"];
    for mode in modes {
        let set = format!("render.surfels.{mode}");
        let [one, three] = ["1", "3"].map(|n| draw(&text, &["--threads", n, "--set", &set]));
        for channel in ["R", "G", "B", "A"] {
            assert_eq!(one.channel(channel), three.channel(channel), "{mode}, {channel}");
        }
    }
}

#[test]
fn a_still_frame_is_drawn_as_in_the_animation() {
    let text = balls("layers = 'algorithm2'\n").replace("[render]\n", "[render]\ntechnique = 'surfels'\n");
    let still = render(&scene(&text, None), &RenderOptions::default(), &Progress::new()).unwrap();
    let mut sequence = Sequence::new(&[scene(&text, None)]);
    let first = sequence.render(&scene(&text, None), &RenderOptions::default(), &Progress::new()).unwrap();
    let second = sequence.render(&scene(&text, None), &RenderOptions::default(), &Progress::new()).unwrap();
    assert_eq!(grouped_anew(&second), 0);
    assert_eq!(still.layers, first.layers);
    assert_eq!(still.layers, second.layers);
}
