//! `organza accuracy`: a technique of known order, the same one broken, one that does not converge, and the command.

mod random;

use organza::scene::{self, Scene};
use organza::{Error, Progress, RenderOptions};
use organza_judge::accuracy::{
    Absent, Facts, Frame, Knob, Options, Renderer, Report, Request, Step, Study, Sweep, Theory, Truth, Yardsticks,
    changes, least_seconds, lines, particles, points, random_study, sheets, study, surfels, verdict,
};
use organza_tests::organza;
use reference::metrics::Image;
use serde_json::Value;
use splat_core::Exceeded;
use std::fs;

const SIZE: [usize; 2] = [24, 16];
/// A scene without lights.
const FEW: Facts = Facts { slice_thickness: Some(0.1), has_maps: false, cells: None, bytes_per_splat: None };
/// One with all that a knob may need.
const ALL: Facts =
    Facts { slice_thickness: Some(0.1), has_maps: true, cells: Some(64), bytes_per_splat: Some([48.0, 15.7]) };
const OPTIONS: Options = Options { quick: true, finer: 0, seed: 1 };
const THOROUGH: Options = Options { quick: false, ..OPTIONS };

const SCENE: &str = r#"version = 1
[camera]
position = [0, 0.5, 4]
target = [0, 0, 0]
size = [24, 16]
[background]
color = [0.25, 0.5, 1.0]
[[light]]
kind = "point"
position = [2, 4, 1]
intensity = [20, 20, 20]
[[object]]
name = "fog"
medium_ball = { center = [0, 0.2, 0], radius = 0.8, extinction = 3, spacing = 0.2 }
[[object]]
name = "ground"
rectangle = { center = [0, -0.8, 0], u = [1.5, 0, 0], v = [0, 0, -1.5], spacing = 0.1 }
"#;

fn scene() -> Scene {
    scene::parse("s.toml".as_ref(), SCENE.as_bytes(), &Default::default()).unwrap()
}

/// Extinction along the ray of pixel k.
fn extinction(k: usize, x: f64) -> f64 {
    let slope = 0.5 + (k % SIZE[0]) as f64 / 12.0;
    0.3 + slope * x * x + 0.02 * (k / SIZE[0]) as f64 * x
}

/// e^−∫₀¹ extinction dx by `slabs` slabs, each sampled `offset` of its width behind its front. In the middle it is of second
/// order.
fn slab_image(slabs: f64, offset: f64, cut: f64) -> Image<reference::metrics::Linear> {
    let pixel = |k: usize| {
        let depth: f64 = (0..slabs as usize).map(|i| extinction(k, (i as f64 + offset) / slabs) / slabs).sum();
        // What is cut off at the far end is of first order.
        [(-depth).exp() + cut * (1.0 + 0.1 * (k % 5) as f64); 3]
    };
    Image::from_radiance(SIZE, (0..SIZE[0] * SIZE[1]).map(pixel).collect()).unwrap()
}

fn exact_image() -> Image<reference::metrics::Linear> {
    let integral = |k: usize| 0.3 + (0.5 + (k % SIZE[0]) as f64 / 12.0) / 3.0 + 0.01 * (k / SIZE[0]) as f64;
    Image::from_radiance(SIZE, (0..SIZE[0] * SIZE[1]).map(|k| [(-integral(k)).exp(); 3]).collect()).unwrap()
}

/// Two knobs in the places of other settings: slabs as `oversample`, the cut as `transmittance_cutoff`.
fn sweep() -> Sweep {
    let step = |size: f64, value: f64| Step { label: format!("{value}"), size: Some(size), value };
    let theory = |order| Some(Theory { low: order, high: order, why: "closed form" });
    let mut scene = scene();
    scene.render.points.transmittance_cutoff = 0.01;
    let slabs = |n: f64| step(1.0 / n, n);
    Sweep {
        technique: "slabs",
        base: Request { scene, oversample: 8, packed: false },
        base_label: "the scene's own".into(),
        knobs: vec![
            Knob {
                name: "slabs",
                size_meaning: "width",
                set: |request, value| request.oversample = value as u32,
                steps: [2.0, 4.0, 8.0, 16.0].map(slabs).to_vec(),
                ends: vec![slabs(256.0)],
                end_is_exact: false,
                theory: theory(2.0),
                scene_size: None,
                joint: true,
            },
            Knob {
                name: "cut",
                size_meaning: "cut",
                set: |request, value| request.scene.render.points.transmittance_cutoff = value,
                steps: [0.1, 0.03, 0.01].map(|t| step(t, t)).to_vec(),
                ends: vec![step(0.0, 0.0)],
                end_is_exact: true,
                theory: theory(1.0),
                scene_size: None,
                joint: true,
            },
        ],
        skipped: Vec::new(),
        joint_levels: 3,
    }
}

fn frame(image: Image<reference::metrics::Linear>, seconds: f64) -> Frame {
    Frame { image, seconds, convert_seconds: None, fragments: 1, bytes: 1 }
}

/// The technique with its samples `offset` behind the front of each slab; finer is slower.
fn run(offset: f64) -> Result<Study, Error> {
    let mut draw = |request: &Request| {
        let n = f64::from(request.oversample);
        let cut = request.scene.render.points.transmittance_cutoff;
        Ok(frame(slab_image(n, offset, cut), 1e-3 * n * (2.0 - cut)))
    };
    let standard_error = vec![[1e-7; 3]; SIZE[0] * SIZE[1]];
    let truth = Truth { method: "closed form".into(), image: exact_image(), standard_error, all_orders: None };
    study(&sweep(), Ok(truth), &OPTIONS, &Progress::new(), &mut draw)
}

fn order_of(study: &Study, knob: &str) -> (f64, f64) {
    let curve = study.curves.iter().find(|c| c.knob == knob).unwrap();
    let fit = curve.settled.fit.unwrap();
    (fit.order, fit.half_width.unwrap())
}

#[test]
fn a_technique_of_known_order_is_measured_as_such() {
    let study = run(0.5).unwrap();
    let slabs = order_of(&study, "slabs");
    let cut = order_of(&study, "cut");
    assert!((slabs.0 - 2.0).abs() < 0.05 && (cut.0 - 1.0).abs() < 1e-6, "{slabs:?} {cut:?}");
    assert!(study.curves.iter().all(|c| verdict(&study, c).contains("as theory says")));
    // The limit says how wrong it is: about (1/256)² of what one slab leaves.
    let stated_error = study.limit.own_error;
    let left = reference::metrics::compare(&study.limit.image, &exact_image()).unwrap().rmse;
    assert!(left < 1.5 * stated_error && stated_error < 3.0 * left, "{stated_error:e} {left:e}");
    let least = study.outcomes.iter().filter(|o| o.drawn).map(|o| o.from_limit.as_ref().unwrap().linear.rmse);
    assert!(least.fold(f64::INFINITY, f64::min) >= 10.0 * stated_error);
    assert!(study.frontier.len() >= 3);
}

#[test]
fn a_knob_whose_ends_are_too_large_is_held_with_the_reason() {
    let mut draw = |request: &Request| {
        let n = f64::from(request.oversample);
        let cut = request.scene.render.points.transmittance_cutoff;
        if cut == 0.0 {
            let what = "a picture without a cut".into();
            let hint = "raise it".into();
            return Err(Error::Limit(Exceeded { what, needed: 2, limit: Some(1), unit: "bytes", hint }));
        }
        Ok(frame(slab_image(n, 0.5, cut), 1e-3 * n * (2.0 - cut)))
    };
    let study = study(&sweep(), Err("a test".into()), &OPTIONS, &Progress::new(), &mut draw).unwrap();
    let [held] = &study.limit.held[..] else { panic!("{:?}", study.limit.held) };
    assert!(held.knob == "cut" && held.reason.contains("a picture without a cut needs 2"), "{held:?}");
    assert!(study.curves.iter().all(|c| c.knob == "slabs") && study.limit.parts.len() == 1);
}

#[test]
fn a_flipped_sign_shows_up_in_the_report() {
    let healthy = run(0.5).unwrap();
    let broken = run(-0.5).unwrap();
    let curve = broken.curves.iter().find(|c| c.knob == "slabs").unwrap();
    assert!(verdict(&broken, curve).contains("theory says otherwise"), "{}", verdict(&broken, curve));
    let (order, half_width) = order_of(&broken, "slabs");
    assert!(order + half_width < 1.9, "{order} {half_width}");
    // Against the truth every setting of the broken one is farther off.
    let of_truth = |s: &Study| s.outcomes[0].from_truth.as_ref().unwrap().linear.rmse;
    assert!(of_truth(&broken) > 2.0 * of_truth(&healthy), "{} {}", of_truth(&broken), of_truth(&healthy));
    let report = Report::new(&scene(), OPTIONS, vec![broken], Vec::new());
    assert!(report.html().unwrap().contains("theory says otherwise"));
}

#[test]
fn what_does_not_converge_is_refused_with_what_it_would_take() {
    let mut draw = |request: &Request| {
        let n = u64::from(request.oversample);
        let noise = |k: usize| [0.5 + 0.1 * splat_core::rng::unit(n, 0, k as u64, 0); 3];
        let image = Image::from_radiance(SIZE, (0..SIZE[0] * SIZE[1]).map(noise).collect()).unwrap();
        Ok(frame(image, 1e-3))
    };
    let error = study(&sweep(), Err("a test".into()), &OPTIONS, &Progress::new(), &mut draw).unwrap_err();
    assert_eq!(error.exit_code(), 5);
    assert!(error.to_string().contains("own error") && error.hint().contains("--finer"), "{error} {}", error.hint());
}

#[test]
fn a_study_that_is_interrupted_keeps_what_it_has() {
    // A study draws each setting once, the ends and the limit, and then repeats.
    let drawn_until = |last: usize| {
        let mut draws = 0;
        let mut draw = |request: &Request| {
            draws += 1;
            if draws > last {
                return Err(Error::Cancelled);
            }
            let n = f64::from(request.oversample);
            let cut = request.scene.render.points.transmittance_cutoff;
            Ok(frame(slab_image(n, 0.5, cut), 1e-3 * n * (2.0 - cut)))
        };
        let study = study(&sweep(), Err("a test".into()), &OPTIONS, &Progress::new(), &mut draw);
        (study, draws)
    };
    let (whole, draws) = drawn_until(usize::MAX);
    let whole = whole.unwrap();
    let repeats = whole.outcomes.iter().map(|o| o.timed.seconds.len()).sum::<usize>();
    let before_repeats = draws - repeats;
    assert!(matches!(drawn_until(before_repeats - 1).0, Err(Error::Cancelled)), "the limit is not known");
    for last in [before_repeats + 5, draws - 1] {
        let part = drawn_until(last).0.unwrap();
        assert_eq!((part.outcomes.len(), &part.limit), (whole.outcomes.len(), &whole.limit));
        assert_eq!(part.outcomes.iter().map(|o| o.timed.seconds.len()).sum::<usize>(), last - before_repeats);
        assert!(!part.frontier.is_empty());
        let timed = |setting: &usize| least_seconds(&part.outcomes[*setting]).is_some();
        assert!(part.frontier.iter().all(timed), "what was never timed is on no frontier");
    }
}

#[test]
fn a_setting_that_is_the_limit_leads_the_frontier() {
    // All but the cut is exact, and the base has no cut: what is slower and less exact comes after nothing.
    let mut exact = sweep();
    exact.base.scene.render.points.transmittance_cutoff = 0.0;
    exact.base.oversample = 256;
    exact.knobs.remove(0);
    exact.knobs[0].joint = false;
    exact.joint_levels = 0;
    let mut draw = |request: &Request| {
        let cut = request.scene.render.points.transmittance_cutoff;
        // The cut of .01 is a little slower than none.
        Ok(frame(slab_image(256.0, 0.5, cut), if cut == 0.01 { 1.2 } else { 1.0 - 5.0 * cut }))
    };
    let study = study(&exact, Err("a test".into()), &OPTIONS, &Progress::new(), &mut draw).unwrap();
    let labels: Vec<&str> = study.frontier.iter().map(|i| study.outcomes[*i].setting.label.as_str()).collect();
    assert_eq!(labels, ["the scene's own", "cut: 0.03", "cut: 0.1"]);
    let html = Report::new(&scene(), OPTIONS, vec![study], Vec::new()).html().unwrap();
    assert!(html.contains("none: the limit's picture"));
}

#[test]
fn what_was_not_measured_is_null() {
    let mut draw = |request: &Request| {
        let n = f64::from(request.oversample);
        let cut = request.scene.render.points.transmittance_cutoff;
        if n == 16.0 {
            let what = "the table".into();
            let hint = "".into();
            return Err(Error::Limit(Exceeded { what, needed: 9, limit: Some(1), unit: "bytes", hint }));
        }
        Ok(frame(slab_image(n, 0.5, cut), 1e-3 * n))
    };
    let study = study(&sweep(), Err("a test".into()), &OPTIONS, &Progress::new(), &mut draw).unwrap();
    let report = Report::new(&scene(), OPTIONS, vec![study], Vec::new());
    let document: Value = serde_json::from_str(&report.json()).unwrap();
    let settings = document["techniques"][0]["settings"].as_array().unwrap();
    let failed = settings.iter().find(|s| s["setting"] == "slabs: 16").unwrap();
    assert!(failed["seconds"].is_null() && failed["from_limit"].is_null() && failed["from_truth"].is_null());
    assert_eq!(failed["failure"], "the table needs 9 bytes, the limit is 1 bytes");
    let csv = report.csv();
    assert!(csv.lines().any(|l| l.contains(",\"slabs\",\"slabs: 16\",\"slabs\",false,false,,,")));
    // Every line says of which scene and by what: tables of several runs can be joined.
    assert!(csv.starts_with("scene,width_px,height_px,version,processor,threads,technique,"));
    assert!(csv.lines().skip(1).all(|l| l.starts_with("\"s.toml\",24,16,")), "{csv}");
    assert!(report.html().unwrap().contains("Not drawn: slabs: 16"));
    // Two repeats of everything else, and more of what the frontier hangs on.
    assert!(
        settings
            .iter()
            .filter(|s| s["failure"].is_null())
            .all(|s| s["seconds_of_repeats"].as_array().unwrap().len() >= 2)
    );
}

#[test]
fn techniques_share_one_frontier_and_what_is_absent_is_named() {
    let points = run(0.5).unwrap();
    let random = random::noisy(|seed, level| seed + 1000 * u64::from(level), 0.0);
    let report = Report::new(&scene(), OPTIONS, vec![points, random], Vec::new());
    let error = |[s, o]: &[usize; 2]| report.studies[*s].outcomes[*o].from_limit.as_ref().unwrap().linear.rmse;
    let seconds = |[s, o]: &[usize; 2]| least_seconds(&report.studies[*s].outcomes[*o]).unwrap();
    assert!(report.frontier.len() >= 3);
    let ordered = report.frontier.windows(2).all(|w| error(&w[0]) < error(&w[1]) && seconds(&w[0]) > seconds(&w[1]));
    assert!(ordered, "{:?}", report.frontier);
    let document: Value = serde_json::from_str(&report.json()).unwrap();
    assert_eq!(document["frontier"].as_array().unwrap().len(), report.frontier.len());
    let setting = &document["techniques"][1]["settings"][0];
    assert_eq!(setting["sampled"]["seeds"], 5);
    assert!(setting["sampled"]["rmse_from_truth"].is_null() && setting["from_truth"].is_null());
    assert!(document["techniques"][0]["settings"][0]["sampled"].is_null());
    let columns = |line: &str| line.matches(',').count();
    let csv = report.csv();
    let header = csv.lines().next().unwrap();
    assert!(csv.lines().filter(|l| !l.contains('×')).all(|l| columns(l) >= columns(header)));
    let html = report.html().unwrap();
    assert!(html.contains("All techniques") && html.contains("95 % interval"));
    let reason = || "it <b>cannot</b>".to_owned();
    let absent = vec![Absent { technique: "particles", reason: reason() }];
    let report = Report::new(&scene(), OPTIONS, vec![run(0.5).unwrap()], absent);
    let document: Value = serde_json::from_str(&report.json()).unwrap();
    assert_eq!(document["absent"][0]["reason"], reason());
    assert!(report.html().unwrap().contains("No technique particles: it &lt;b&gt;cannot&lt;/b&gt;."));
}

#[test]
fn the_command_writes_three_files_or_none() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("s.toml"), SCENE).unwrap();
    let run = |arguments: &[&str]| {
        let out = organza().args(arguments).current_dir(&folder).output().unwrap();
        (out.status.code().unwrap(), String::from_utf8_lossy(&out.stdout).into_owned(), out.stderr)
    };
    let (code, stdout, stderr) = run(&["accuracy", "s.toml", "--quick", "--out", "r", "--json"]);
    assert_eq!(code, 0, "{}", String::from_utf8_lossy(&stderr));
    let document: Value = serde_json::from_str(&stdout).unwrap();
    let written: Value = serde_json::from_slice(&fs::read(folder.path().join("r/accuracy.json")).unwrap()).unwrap();
    assert_eq!(document["report"], written);
    let technique = &written["techniques"][0];
    let curves: Vec<&str> =
        technique["curves"].as_array().unwrap().iter().map(|c| c["knob"].as_str().unwrap()).collect();
    assert!(curves.contains(&"slice thickness") && curves.contains(&"samples"), "{curves:?}");
    // Particles have one knob, five seeds, the same limit and the slope of independent sets.
    let particles = &written["techniques"][1];
    assert_eq!((&particles["technique"], &particles["limit"]), (&Value::from("particles"), &technique["limit"]));
    let order = particles["curves"][0]["order"].as_f64().unwrap();
    let half_width = particles["curves"][0]["order_half_width_95"].as_f64().unwrap();
    assert!((order - 0.5).abs() <= 0.03f64.max(half_width) && half_width < 0.2, "{order} ± {half_width}");
    let settings = particles["settings"].as_array().unwrap();
    assert!(
        settings.iter().all(|s| s["sampled"]["seeds"] == 5 && s["seconds_of_repeats"].as_array().unwrap().len() >= 5)
    );
    // Sheets have a limit of their own, and stand beside the others by physical truth alone.
    let sheets = &written["techniques"][2];
    assert_eq!(sheets["technique"], "sheets", "{}", written["absent"]);
    assert_ne!(sheets["limit"], technique["limit"]);
    assert!(sheets["curves"].as_array().unwrap().iter().any(|c| c["knob"] == "slab width"));
    // Surfels draw surfaces, and the only one here is opaque.
    let absent = written["absent"].as_array().unwrap();
    assert!(absent.iter().any(|a| a["technique"] == "surfels" && a["reason"].as_str().unwrap().contains("no surface")));
    let names = |frontier: &Value| -> Vec<String> {
        frontier.as_array().unwrap().iter().map(|f| f["technique"].as_str().unwrap().to_owned()).collect()
    };
    assert!(!names(&written["frontier"]).contains(&"sheets".to_owned()));
    assert!(!names(&written["frontier_by_truth"]).is_empty());
    let skipped = technique["skipped"].as_array().unwrap();
    assert!(skipped.iter().any(|s| s["knob"] == "footprint table size"));
    let html = fs::read_to_string(folder.path().join("r/accuracy.html")).unwrap();
    // The truth scatters once, and the report says what that leaves out: light goes between fog and ground.
    let orders = &technique["truth"]["all_orders"];
    let [one, all] = ["mean", "mean_of_all"].map(|key| orders[key].as_f64().unwrap());
    assert!(all > 1.03 * one && orders["rmse"].as_f64().unwrap() > 0.0, "{orders}");
    assert!(html.contains("from the truth of all orders it is"));
    let foreign = |text: &str| text.replace("http://www.w3.org/2000/svg", "").contains("http");
    assert!(!foreign(&html) && html.contains("data:image/png;base64,") && html.matches("<svg").count() >= 3);
    let mut names: Vec<_> = fs::read_dir(folder.path().join("r")).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["accuracy.csv", "accuracy.html", "accuracy.json"]);
    // Nothing is replaced, and nothing is made for a scene that cannot be read.
    assert_eq!(run(&["accuracy", "s.toml", "--quick", "--out", "r"]).0, 4);
    assert_eq!(run(&["accuracy", "none.toml", "--out", "new"]).0, 4);
    assert_eq!(run(&["accuracy", "s.toml", "--out", "new", "--set", "object.fog.visible=7"]).0, 2);
    assert!(!folder.path().join("new").exists());
}

#[test]
fn translucent_triangles_are_judged_by_sheets() {
    let folder = tempfile::tempdir().unwrap();
    let fog = SCENE.find("[[object]]").unwrap();
    let pane = "[[object]]\nname = 'pane'\nopacity = 0.4\n\
                rectangle = { center = [0, 0, 0], u = [0.8, 0, 0.3], v = [0, 0.6, 0], spacing = 0.2 }\n";
    let text = SCENE[..fog].replace("size = [24, 16]", "size = [12, 8]") + pane;
    fs::write(folder.path().join("s.toml"), text).unwrap();
    let arguments = ["accuracy", "s.toml", "--quick", "--out", "r"];
    let out = organza().args(arguments).current_dir(&folder).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let written: Value = serde_json::from_slice(&fs::read(folder.path().join("r/accuracy.json")).unwrap()).unwrap();
    let techniques = written["techniques"].as_array().unwrap();
    let sheets =
        techniques.iter().find(|t| t["technique"] == "sheets").unwrap_or_else(|| panic!("{}", written["absent"]));
    // No slab holds anything, so nothing is to be turned of slabs and kernels; the rest is.
    let skipped = sheets["skipped"].as_array().unwrap();
    let reason =
        |knob: &str| skipped.iter().find(|s| s["knob"] == knob).map(|s| s["reason"].as_str().unwrap().to_owned());
    assert!(reason("slab width").is_some_and(|reason| reason.contains("triangles")), "{skipped:?}");
    assert!(sheets["curves"].as_array().unwrap().iter().any(|curve| curve["knob"] == "samples"), "{sheets}");
}

#[test]
fn knobs_that_cannot_matter_are_left_alone() {
    let sweep = points(&scene(), &Facts::default(), &OPTIONS);
    let skipped: Vec<&str> = sweep.skipped.iter().map(|s| s.knob).collect();
    let expected = [
        "slice thickness",
        "order",
        "shadow table cells",
        "shadow table mapping",
        "absorbance cut",
        "transmittance cut",
        "packed splats",
        "accumulation",
        "footprint table size",
    ];
    assert_eq!(skipped, expected);
    let sweep = points(&scene(), &ALL, &THOROUGH);
    assert_eq!(sweep.skipped.len(), 1);
    assert_eq!(sweep.knobs.len(), 12);
}

#[test]
fn what_a_report_says_to_write_gives_the_scene_that_it_drew() {
    let ball = "implicit = { expression = \"x^2 + y^2 + z^2 - 0.25\", box = [[-1, -1, -1], [1, 1, 1]], spacing = 0.1 }";
    let volume =
        "[[object]]\nname = 'v'\nvolume = 'v.nii'\ntransfer = [{ value = 0, color = [1, 1, 1], extinction = 1 }]";
    let lamp = "[[light]]\nkind = 'sphere'\nposition = [0, 9, 0]\nradius = 1\nintensity = [1, 1, 1]";
    let text = format!("{SCENE}{lamp}\n{volume}\n[[object]]\nname = \"ball\"\n{ball}\nopacity = 0.5\n");
    let parsed = |set: &[String]| {
        let overrides = set.iter().map(|s| scene::Override::parse(s).unwrap()).collect();
        let options = scene::LoadOptions { overrides, ..Default::default() };
        scene::parse("s.toml".as_ref(), text.as_bytes(), &options).unwrap()
    };
    let half_vector = "render.sheets.slicing='half_vector'";
    let scattered = [half_vector, "render.sheets.scattering='forward_and_back'"];
    let algorithm = ["render.surfels.layers='algorithm2'", "render.surfels.grouping='hash'"];
    let coarse = ["render.points.slice_thickness=0.25", "render.shadow.cells=99"];
    let mut tried = 0;
    let mut told = 0;
    for overrides in [&[][..], &[half_vector], &scattered, &algorithm, &coarse] {
        let overrides: Vec<String> = overrides.iter().map(|s| (*s).to_owned()).collect();
        let written = parsed(&overrides);
        let sweeps = [
            points(&written, &ALL, &THOROUGH),
            particles(&written, &ALL, &THOROUGH).unwrap(),
            sheets(&written, Some(0.1), &ALL, &THOROUGH),
            surfels(&written, &ALL, &THOROUGH),
        ];
        for (sweep, knob) in sweeps.iter().flat_map(|sweep| sweep.knobs.iter().map(move |knob| (sweep, knob))) {
            for step in &knob.steps {
                let request = sweep.turned(knob, step);
                let changes = changes(&written, &request);
                let set: Vec<String> =
                    overrides.iter().cloned().chain(changes.iter().filter_map(|c| c.set())).collect();
                let at = format!("{} by {}, {}: {set:?}", knob.name, sweep.technique, step.label);
                let said = lines(&written, &request);
                let times = format!("every object times {:?}", step.value);
                assert!(!said.is_empty() || request.scene == written, "{at}");
                tried += 1;
                match knob.name {
                    "splat spacing" => assert!(step.value == 1.0 || said.contains(&times), "{at}"),
                    "footprint table size" => assert_eq!(said.contains("texels a side"), step.value > 0.0, "{at}"),
                    _ if changes.iter().any(|c| c.value.is_none()) => told += 1,
                    _ => {
                        let mut found = parsed(&set);
                        let mut expected = request.scene;
                        (found.sha256, expected.render.layers) = (expected.sha256.clone(), found.render.layers.clone());
                        // What is set is stated; a knob only turns it.
                        expected.render.stated = found.render.stated;
                        assert_eq!((found.render, found.objects), (expected.render, expected.objects), "{at}");
                    }
                }
            }
        }
    }
    assert!(tried > 300 && told < 20, "{tried} {told}");
}

#[test]
fn the_samplers_of_implicit_surfaces_are_knobs_of_particles() {
    let names = |sweep: &Sweep| sweep.knobs.iter().map(|k| k.name).collect::<Vec<_>>();
    // Media alone have none, but one of their own.
    let sweep = particles(&scene(), &FEW, &OPTIONS).unwrap();
    assert_eq!(names(&sweep), ["repeat level", "volume sampler"]);
    assert!(sweep.skipped.iter().any(|s| s.knob == "surface sampler" && s.reason.contains("implicit")));

    let ball = "implicit = { expression = \"x^2 + y^2 + z^2 - 0.25\", box = [[-1, -1, -1], [1, 1, 1]], spacing = 0.1 }";
    let text = format!("{SCENE}[[object]]\nname = \"ball\"\n{ball}\nopacity = 0.5\n");
    let with_ball = scene::parse("s.toml".as_ref(), text.as_bytes(), &Default::default()).unwrap();
    let quick = particles(&with_ball, &FEW, &OPTIONS).unwrap();
    assert_eq!(names(&quick), ["repeat level", "surface sampler", "volume sampler"]);
    let sweep = particles(&with_ball, &FEW, &THOROUGH).unwrap();
    assert_eq!(names(&sweep), ["repeat level", "surface sampler", "Brownian step", "volume sampler"]);
    let turned = |knob: &Knob| -> Vec<scene::SurfaceSampler> {
        knob.steps.iter().map(|s| sweep.turned(knob, s).scene.render.particles.surface_sampler).collect()
    };
    let paper = scene::SurfaceSampler::Brownian { step: 0.01 };
    assert_eq!(turned(&sweep.knobs[1]), [scene::SurfaceSampler::Lines, scene::SurfaceSampler::Triangles, paper]);
    assert_eq!(turned(&sweep.knobs[2]).last(), Some(&paper), "from coarse to fine");
    // What is kept from one setting for the next does not hide the difference.
    let options = RenderOptions::default();
    let progress = Progress::new();
    let mut renderer = Renderer::new(&options, &progress);
    let mut draw = |step: &Step| renderer.draw(&quick.turned(&quick.knobs[1], step)).unwrap().image;
    let images: Vec<_> = quick.knobs[1].steps.iter().map(&mut draw).collect();
    assert!(images[0] != images[1] && images[1] != images[2] && images[0] != images[2]);
}

/// What takes long and rarely fails where the others hold.
mod deep {
    use super::*;

    #[test]
    fn surfels_are_judged_by_a_limit_of_their_own_with_media_by_points_beside_them() {
        let folder = tempfile::tempdir().unwrap();
        let pane = "[[object]]\nname = 'pane'\nopacity = 0.4\n\
                    rectangle = { center = [0, 0, 1], u = [0.5, 0, 0.3], v = [0, 0.6, 0], spacing = 0.1 }\n";
        fs::write(folder.path().join("s.toml"), SCENE.to_owned() + pane).unwrap();
        let out =
            organza().args(["accuracy", "s.toml", "--quick", "--out", "r"]).current_dir(&folder).output().unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        let written: Value = serde_json::from_slice(&fs::read(folder.path().join("r/accuracy.json")).unwrap()).unwrap();
        let technique = |name: &str| {
            let techniques = written["techniques"].as_array().unwrap();
            techniques.iter().find(|t| t["technique"] == name).unwrap_or_else(|| panic!("{}", written["absent"]))
        };
        let surfels = technique("surfels");
        assert_ne!(surfels["limit"], technique("points")["limit"]);
        let settings = surfels["settings"].as_array().unwrap();
        for knob in ["disc scale", "gap"] {
            assert!(settings.iter().any(|s| s["knob"] == knob), "{knob}");
        }
    }
}
