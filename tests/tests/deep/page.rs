//! The page of `organza view` in Chromium: `cargo xtask browser`.

use super::chromium::Page;
use crate::view::{FOG, View};
use organza_tests::{Place, SMALL_SCENE};
use std::time::{Duration, Instant};

/// A whole picture of what the page has asked for last.
const WHOLE: &str =
    "!isSending && waiting.length === 0 && shown.is_whole && generation === shown.generation && at('coarse').hidden";
/// The bits of the picture on the page.
const PICTURE: &str = "canvas.toDataURL()";

/// A scene with a volume whose values rise along x.
fn volume(place: &Place) -> String {
    let mut file =
        b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 8 8 8\nencoding: raw\nspacings: 0.2 0.2 0.2\n\n".to_vec();
    file.extend((0..512).map(|n| (n % 8 * 30) as u8));
    place.write("ramp.nrrd", file);
    let transfer = "[{ value = 0, color = [1, 0.5, 0.2], extinction = 0 }, { value = 210, color = [0.2, 0.5, 1], extinction = 3 }]";
    format!("{SMALL_SCENE}[[object]]\nname = \"ramp\"\nvolume = \"ramp.nrrd\"\ntransfer = {transfer}\n")
}

fn opened(view: &View) -> Page {
    let mut page = Page::open(&view.url(), 1280, 720);
    page.wait_for(WHOLE);
    page
}

#[track_caller]
fn ends_well(page: &Page, view: View) {
    assert!(page.faults.is_empty(), "{:?}", page.faults);
    assert_eq!(view.interrupted().0, Some(0));
}

#[test]
fn a_drag_turns_an_effect_goes_and_comes_back_and_the_file_is_that_of_render() {
    let place = Place::new(&(SMALL_SCENE.to_owned() + FOG));
    let view = View::start(&place, &["s.toml"]);
    let mut page = opened(&view);
    let first = page.value(PICTURE);
    let saved = "fetch(`save/picture.png?client=${client}`).then((answer) => answer.arrayBuffer()).then((bytes) => [...new Uint8Array(bytes)])";
    let bytes: Vec<u8> = serde_json::from_value(page.value(saved)).unwrap();
    place.expect(0, &["render", "s.toml", "-o", "render.png"], "");
    assert!(bytes == place.bytes("render.png"));
    page.mouse("mousePressed", 300.0, 300.0);
    for step in 1..=8 {
        page.mouse("mouseMoved", 300.0 + 10.0 * f64::from(step), 300.0);
    }
    page.mouse("mouseReleased", 380.0, 300.0);
    page.wait_for("Math.abs(shown.viewpoint.azimuth) > 5");
    page.wait_for(WHOLE);
    let turned = page.value(PICTURE);
    assert_ne!(turned, first);
    let switch = |way: &str| format!("rows.effects.get('object.fog').inputs.{way}.click()");
    page.value(&switch("off"));
    page.wait_for("!shown.objects.find((object) => object.name === 'fog').visible");
    page.wait_for(WHOLE);
    assert_ne!(page.value(PICTURE), turned);
    page.value(&switch("auto"));
    page.wait_for("shown.objects.find((object) => object.name === 'fog').visible");
    page.wait_for(WHOLE);
    assert_eq!(page.value(PICTURE), turned);
    page.press("r");
    page.wait_for("Math.abs(shown.viewpoint.azimuth) < 1");
    page.wait_for(WHOLE);
    assert_eq!(page.value(PICTURE), first);
    ends_well(&page, view);
}

#[test]
fn a_cut_is_added_dragged_in_the_picture_and_removed() {
    let place = Place::new(&(SMALL_SCENE.to_owned() + FOG));
    let view = View::start(&place, &["s.toml"]);
    let mut page = opened(&view);
    let first = page.value(PICTURE);
    page.value("at('cuts-panel').open = true, at('add-cut').click()");
    page.wait_for("shown.cuts.length === 1");
    page.wait_for(WHOLE);
    assert_ne!(page.value(PICTURE), first);
    let before = page.value("shown.cuts[0].point[2]").as_f64().unwrap();
    let handle = page.value("(() => { const box = at('plane-handle').getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]; })()");
    let (x, y) = (handle[0].as_f64().unwrap(), handle[1].as_f64().unwrap());
    page.mouse("mousePressed", x, y);
    page.mouse("mouseMoved", x, y - 20.0);
    page.mouse("mouseMoved", x, y - 40.0);
    page.mouse("mouseReleased", x, y - 40.0);
    // A plane across the view goes away from the eye as its handle is dragged upwards.
    page.wait_for(&format!("shown.cuts[0].point[2] < {before} - 0.05"));
    assert_eq!(page.value("Math.abs(shown.viewpoint.azimuth) < 0.5"), true, "the scene stays");
    page.value("cutRows[0].item.querySelectorAll('button')[1].click()");
    page.wait_for("shown.cuts.length === 0");
    page.wait_for(WHOLE);
    assert_eq!(page.value(PICTURE), first);
    ends_well(&page, view);
}

#[test]
fn a_cut_of_one_object_goes_through_that_object_alone() {
    let small = "[[object]]\nname = \"bead\"\nmedium_box = { min = [0.5, 0.5, 0.5], max = [0.7, 0.7, 0.7], extinction = 9, spacing = 0.05 }\n";
    let place = Place::new(&(SMALL_SCENE.to_owned() + FOG + small));
    let view = View::start(&place, &["s.toml"]);
    let mut page = opened(&view);
    page.wait_for("shown.objects.every((object) => object.bounds)");
    page.value("at('cuts-panel').open = true, at('add-cut').click()");
    page.wait_for("shown.cuts.length === 1");
    let span = "Number(cutRows[0].slider.max) - Number(cutRows[0].slider.min)";
    let of_everything = page.value(span).as_f64().unwrap();
    page.value("(({ object }) => { object.value = 'bead'; object.dispatchEvent(new Event('change')); })(cutRows[0])");
    page.wait_for("shown.cuts[0].object === 'bead'");
    let of_bead = page.value(span).as_f64().unwrap();
    assert!(of_everything > 1.5 && (0.15..0.3).contains(&of_bead), "{of_everything} and {of_bead}");
    // The plane goes to it, and its outline is as large as it is.
    assert_eq!(page.value("shown.cuts[0].point[2] > 0.45 && shown.cuts[0].point[2] < 0.75"), true);
    let height = page.value("at('plane-outline').getBBox().height / pictureHeight()").as_f64().unwrap();
    assert!(height > 0.0 && height < 0.2, "{height}");
    ends_well(&page, view);
}

#[test]
fn changes_are_taken_back_one_by_one_and_the_view_stays() {
    let place = Place::new(&(SMALL_SCENE.to_owned() + FOG));
    let view = View::start(&place, &["s.toml"]);
    let mut page = opened(&view);
    page.press("1");
    page.wait_for("Math.abs(shown.viewpoint.elevation) < 1e-6");
    page.wait_for(WHOLE);
    let first = page.value(PICTURE);
    assert_eq!(page.value("at('undo').disabled && at('redo').disabled"), true);
    let exposure = |stops: &str| {
        format!(
            "(({{ exposure }}) => {{ exposure.value = {stops}; for (const kind of ['input', 'change']) exposure.dispatchEvent(new Event(kind, {{ bubbles: true }})); }})({{ exposure: at('exposure') }})"
        )
    };
    for stops in ["0.5", "1"] {
        page.value(&exposure(stops));
        page.wait_for(&format!("shown.exposure === {stops} && !isChanging"));
    }
    page.wait_for(WHOLE);
    let second = page.value(PICTURE);
    page.value("rows.effects.get('shadow.0').inputs.off.click()");
    page.wait_for("!rows.lights.get('0').shadow.checked");
    page.wait_for(WHOLE);
    page.value("rows.lights.get('0').shadow.click()");
    page.wait_for("rows.lights.get('0').shadow.checked && shown.effects.every((effect) => effect.switch === 'auto')");
    // The tick, the switch, and both exposures.
    page.value("at('undo').click()");
    page.wait_for("!rows.lights.get('0').shadow.checked");
    page.value("at('undo').click()");
    page.wait_for("rows.lights.get('0').shadow.checked");
    page.wait_for(WHOLE);
    assert_eq!(page.value(PICTURE), second);
    page.value("at('undo').click()");
    page.wait_for("shown.exposure === 0.5");
    page.value("at('restore').click()");
    page.wait_for("shown.exposure === 0 && shown.can_undo");
    page.wait_for(WHOLE);
    assert_eq!(page.value(PICTURE), first);
    page.value("at('undo').click()");
    page.wait_for("shown.exposure === 0.5 && shown.can_redo");
    ends_well(&page, view);
}

#[test]
fn a_number_that_is_refused_gives_way_to_the_last_good_one() {
    let place = Place::new(SMALL_SCENE);
    let scene = volume(&place);
    place.write("s.toml", scene);
    let view = View::start(&place, &["s.toml"]);
    let mut page = opened(&view);
    page.value("at('cuts-panel').open = true, at('add-cut').click()");
    page.wait_for("shown.cuts.length === 1");
    page.wait_for(WHOLE);
    for (field, typed, said) in [
        ("at('width')", "", "Width in pixels: expected a number from 1 to 65536, found no number"),
        ("at('height')", "-4", "Height in pixels: expected a number from 1 to 65536, found -4"),
        ("at('height')", "60000", "× 60000: the longer side of the image"),
        ("rows.lights.get('0').elevation", "91", "expected a number from -90 to 90, found 91"),
        ("cutRows[0].number", "1e30", "found 1e30"),
        ("rows.objects.get('ramp').curve.extinction.input", "-1", "Extinction: expected a number from 0"),
        ("rows.objects.get('ramp').curve.value.input", "", "Value: expected a number"),
        ("rows.objects.get('ramp').curve.value.input", "500", "to 210, found 500"),
    ] {
        let before = page.value(&format!("{field}.value"));
        page.value(&format!("{field}.focus(), {field}.value = '{typed}', {field}.dispatchEvent(new Event('change'))"));
        page.wait_for(&format!("!at('trouble').hidden && at('trouble').textContent.includes('{said}')"));
        page.wait_for(&format!("{field}.value === '{}'", before.as_str().unwrap()));
        page.value("add({ do: 'exposure', stops: shown.exposure })");
        page.wait_for("at('trouble').hidden");
        page.wait_for(WHOLE);
    }
    ends_well(&page, view);
}

#[test]
fn a_difference_is_shown_beside_the_picture_that_it_belongs_to() {
    let place = Place::new(&(SMALL_SCENE.to_owned() + FOG));
    let view = View::start(&place, &["s.toml"]);
    let mut page = opened(&view);
    page.value("at('compare-panel').open = true, at('keep').click()");
    page.wait_for("shown.kept");
    page.value("add({ do: 'exposure', stops: 1 })");
    page.wait_for("/RMSE 0[.]/.test(at('compare-text').textContent)");
    page.value("at('difference').click()");
    page.wait_for("keptCanvas.dataset.what === 'difference' && !keptCanvas.hidden && differing === pairOf(generation)");
    // Whenever the picture on the page is another one, the difference is hidden, and the page says so.
    page.value(
        "(globalThis.wrong = 0, globalThis.hidden = 0, globalThis.watching = setInterval(() => { \
           if (!keptCanvas.hidden && differing !== pairOf(generation)) globalThis.wrong += 1; \
           if (keptCanvas.hidden && !at('difference-text').hidden) globalThis.hidden += 1; }, 1), 0)",
    );
    for stops in 2..6 {
        page.value(&format!("add({{ do: 'exposure', stops: {stops} }})"));
        page.wait_for(WHOLE);
        page.wait_for("!keptCanvas.hidden && differing === pairOf(generation)");
    }
    assert_eq!(page.value("[globalThis.wrong, globalThis.hidden > 0]"), serde_json::json!([0, true]));
    ends_well(&page, view);
}

#[test]
fn two_pictures_are_shown_side_by_side() {
    let place = Place::new(&(SMALL_SCENE.to_owned() + FOG));
    let view = View::start(&place, &["s.toml"]);
    let mut page = opened(&view);
    page.value("at('compare-panel').open = true, at('keep').click()");
    page.wait_for("shown.kept && !at('divider').hidden");
    page.value("at('beside').click()");
    let side = "((canvas) => { const box = canvas.getBoundingClientRect(); return [box.left / stage.clientWidth, box.width / stage.clientWidth]; })";
    let half = |page: &mut Page, id: &str| -> Vec<f64> {
        serde_json::from_value(page.value(&format!("{side}(at('{id}'))"))).unwrap()
    };
    assert_eq!((half(&mut page, "picture"), half(&mut page, "kept")), (vec![0.0, 0.5], vec![0.5, 0.5]));
    assert_eq!(
        page.value("at('divider').hidden && at('divide').disabled && keptCanvas.style.clipPath === 'none'"),
        true
    );
    // What the view turns around is in the middle of the left half, for the pointer, the cursor and planes.
    let middle = page.value("onStage(shown.viewpoint.centre)[0] / stage.clientWidth").as_f64().unwrap();
    assert!((middle - 0.25).abs() < 1e-6, "{middle}");
    assert_eq!(page.value("pictureBelow({ x: 0.25 * stage.clientWidth, y: 0.5 * stage.clientHeight }).right"), 0.5);
    assert_eq!(
        page.value("pictureBelow({ x: 0.75 * stage.clientWidth, y: 0.5 * stage.clientHeight })"),
        serde_json::Value::Null
    );
    page.press("v");
    assert_eq!(page.value("parseFloat(at('crosshair').style.left) / stage.clientWidth"), 0.25);
    page.press("v");
    page.value("at('let-go').click()");
    page.wait_for("!shown.kept && !stage.classList.contains('beside')");
    assert_eq!(half(&mut page, "picture"), [0.0, 1.0]);
    ends_well(&page, view);
}

#[test]
fn a_knot_is_moved_by_keys_and_pictures_are_compared() {
    let place = Place::new(SMALL_SCENE);
    let scene = volume(&place);
    place.write("s.toml", scene);
    let view = View::start(&place, &["s.toml"]);
    let mut page = opened(&view);
    let first = page.value(PICTURE);
    page.value("at('compare-panel').open = true, at('keep').click()");
    page.wait_for("shown.kept");
    page.value("rows.objects.get('ramp').curve.canvas.focus()");
    page.press("PageUp");
    for _ in 0..5 {
        page.press("ArrowDown");
    }
    page.wait_for("shown.objects.find((object) => object.name === 'ramp').curve.knots[1].extinction < 2.9");
    page.wait_for(WHOLE);
    assert_ne!(page.value(PICTURE), first);
    page.wait_for(
        "/RMSE/.test(at('compare-text').textContent) && !/RMSE 0\\b(?!\\.)/.test(at('compare-text').textContent)",
    );
    page.value("rows.objects.get('ramp').curve.take(null)");
    page.wait_for(WHOLE);
    page.wait_for(&format!("{PICTURE} === {first}"));
    ends_well(&page, view);
}

#[test]
fn points_are_coloured_by_a_column_and_drawn_by_another_technique() {
    let place = Place::new(SMALL_SCENE);
    place.write(
        "cloud.csv",
        (0..400).fold("x,y,z,heat\n".to_owned(), |text, n| {
            text + &format!("{},{},{},{}\n", n % 20, n / 20, 0.1 * f64::from(n % 7), n % 20)
        }),
    );
    let view = View::start(&place, &["cloud.csv", "--size", "160x120"]);
    let mut page = opened(&view);
    let first = page.value(PICTURE);
    page.wait_for("rows.objects.get('cloud').column.options.length > 2");
    let offered =
        page.value("[...rows.objects.get('cloud').map.options].map((option) => option.value).filter(Boolean)");
    assert_eq!(offered, serde_json::json!(organza::scene::color_map_names().collect::<Vec<_>>()));
    let choose = |what: &str, value: &str| {
        format!(
            "(({what}) => {{ {what}.value = '{value}'; {what}.dispatchEvent(new Event('change')); }})(rows.objects.get('cloud').{what})"
        )
    };
    page.value(&choose("column", "heat"));
    page.wait_for("shown.objects[0].color_by === 'heat' && !at('legends').hidden");
    page.wait_for(WHOLE);
    let heat = page.value(PICTURE);
    assert_ne!(heat, first);
    page.value(&choose("map", "turbo"));
    page.wait_for("shown.objects[0].map === 'turbo'");
    page.wait_for(WHOLE);
    assert_ne!(page.value(PICTURE), heat);
    page.value(&choose("technique", "particles"));
    page.wait_for("shown.objects[0].technique === 'particles' && shown.picture.technique.includes('particles')");
    page.wait_for(WHOLE);
    page.value(&choose("technique", ""));
    page.value(&choose("column", ""));
    page.wait_for("shown.objects[0].color_by === null && shown.objects[0].technique === null");
    page.wait_for(WHOLE);
    assert_eq!(page.value(PICTURE), first);
    ends_well(&page, view);
}

#[test]
fn positions_of_accuracy_come_with_their_times_and_change_the_picture() {
    let place = Place::new(&(SMALL_SCENE.to_owned() + FOG));
    let view = View::start(&place, &["s.toml"]);
    let mut page = opened(&view);
    page.value("at('accuracy-panel').open = true");
    page.wait_for("shown.accuracy && !shown.accuracy.is_predicting && shown.accuracy.rungs.length > 2");
    assert_eq!(page.value("shown.accuracy.rungs.some((rung) => rung.predicted_ms > 0)"), true);
    assert_eq!(page.value("/predicted/.test(at('accuracy-text').textContent)"), true);
    page.value("at('accuracy').value = at('accuracy').max, at('accuracy').dispatchEvent(new Event('change'))");
    page.wait_for("shown.accuracy.step > 0 && shown.accuracy.set.length > 0");
    page.wait_for(WHOLE);
    page.wait_for("shown.accuracy.rungs.at(-1).measured_ms > 0 && shown.accuracy.rungs.at(-1).is_reference");
    page.value("at('accuracy-reset').click()");
    page.wait_for("shown.accuracy.step === 0");
    ends_well(&page, view);
}

#[test]
fn a_broken_scene_is_told_and_a_mended_one_is_drawn() {
    let place = Place::new(SMALL_SCENE);
    let view = View::start(&place, &["s.toml", "--watch"]);
    let mut page = opened(&view);
    let first = page.value(PICTURE);
    place.write("s.toml", format!("{SMALL_SCENE}opacty = 2\n"));
    page.wait_for("!at('trouble').hidden && at('trouble').textContent.includes('opacty')");
    assert_eq!(page.value(PICTURE), first, "the last picture stays");
    place.write("s.toml", format!("{SMALL_SCENE}{FOG}"));
    page.wait_for("shown.objects.length > 1 && at('trouble').hidden");
    page.wait_for(WHOLE);
    assert_ne!(page.value(PICTURE), first);
    ends_well(&page, view);
}

#[test]
fn a_file_that_changes_under_a_cut_that_leaves_nothing_leaves_the_page_alive() {
    let place = Place::new(&(SMALL_SCENE.to_owned() + FOG));
    let cuts = r#"[{"do": "cuts", "cuts": [{"object": null, "normal": [0, 0, 1], "point": [0, 0, -1000]}]}]"#;
    place.write("events.json", cuts);
    let view = View::start(&place, &["s.toml", "--watch", "--play", "events.json"]);
    let mut page = opened(&view);
    let nothing = page.value(PICTURE);
    page.value("at('cuts-panel').open = true");
    place.write("s.toml", format!("{SMALL_SCENE}{FOG}# again\n"));
    page.wait_for("shown.generation > 1");
    page.wait_for(WHOLE);
    page.call("Page.reload", serde_json::json!({}));
    page.wait_for(WHOLE);
    assert_eq!(page.value("isOpen && !at('width').disabled && at('width').value > 0"), true);
    page.value("at('cuts-panel').open = true, cutRows[0].item.querySelectorAll('button')[1].click()");
    page.wait_for("shown.cuts.length === 0");
    page.wait_for(WHOLE);
    assert_ne!(page.value(PICTURE), nothing);
    ends_well(&page, view);
}

#[test]
fn the_page_fits_a_screen_and_a_phone_and_is_used_by_keys() {
    let place = Place::new(&(SMALL_SCENE.to_owned() + FOG));
    let view = View::start(&place, &["s.toml"]);
    let mut page = opened(&view);
    for (width, height) in [(1280, 720), (390, 844), (200, 600)] {
        // A phone would make its page wider than its screen instead.
        let size = serde_json::json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        page.call("Emulation.setDeviceMetricsOverride", size);
        page.value("for (const panel of document.querySelectorAll('details')) panel.open = true");
        assert_eq!(page.value(&format!("document.documentElement.scrollWidth <= {width}")), true, "{width}");
        // What can be used has a name.
        let nameless = "[...document.querySelectorAll('button, input, select')].filter((control) => control.offsetParent \
                        && !control.labels?.length && !control.getAttribute('aria-label') && !control.textContent.trim()).map((control) => control.outerHTML)";
        assert_eq!(page.value(nameless), serde_json::json!([]), "{width}");
    }
    page.value("stage.focus()");
    page.press("ArrowRight");
    page.wait_for("Math.abs(shown.viewpoint.azimuth) > 2");
    page.press("h");
    page.wait_for("at('keys').open");
    ends_well(&page, view);
}

#[test]
fn a_view_ends_after_its_page_was_closed_while_it_draws() {
    let place = Place::new(&(SMALL_SCENE.to_owned() + FOG));
    let mut view = View::start(&place, &["s.toml", "--size", "4000x3000"]);
    let mut page = Page::open(&view.url(), 1280, 720);
    page.wait_for("shown && shown.drawing");
    page.call("Page.navigate", serde_json::json!({ "url": "about:blank" }));
    let end = Instant::now() + Duration::from_secs(40);
    while view.child.try_wait().unwrap().is_none() {
        assert!(Instant::now() < end, "it goes on");
        std::thread::sleep(Duration::from_millis(100));
    }
}

#[test]
fn axes_and_a_scale_bar_are_over_the_picture_and_the_axes_are_looked_along() {
    let place = Place::new(&(SMALL_SCENE.to_owned() + FOG));
    let view = View::start(&place, &["s.toml"]);
    let mut page = opened(&view);
    let saved = "fetch(`save/picture.png?client=${client}`).then((answer) => answer.arrayBuffer()).then((bytes) => bytes.byteLength)";
    let bytes = page.value(saved);
    for (end, eye) in [
        ("+x", "[1, 0, 0]"),
        ("−x", "[-1, 0, 0]"),
        ("+y", "[0, 1, 0]"),
        ("−y", "[0, -1, 0]"),
        ("+z", "[0, 0, 1]"),
        ("−z", "[0, 0, -1]"),
    ] {
        page.value(&format!("at('axes').querySelector('[aria-label=\"Look from {end}\"] circle').dispatchEvent(new MouseEvent('click', {{ bubbles: true }}))"));
        page.wait_for(&format!("{eye}.every((number, k) => Math.abs(number - towardsEye()[k]) < 1e-6)"));
    }
    page.press("9");
    page.wait_for("towardsEye().every((number) => Math.abs(number - Math.sqrt(1 / 3)) < 1e-6)");
    // As long as it says, at the depth of the centre.
    let length = "parseFloat(at('scale-text').textContent)";
    let pixels = "at('scale-bar').getBoundingClientRect().width";
    assert_eq!(
        page.value(&format!("Math.abs({pixels} / pictureHeight() * shown.viewpoint.height / {length} - 1) < 0.02")),
        true
    );
    assert_eq!(page.value("at('scale-text').textContent.endsWith('at the centre')"), true);
    for (key, shown) in [("x", "getComputedStyle(at('axes')).display"), ("b", "getComputedStyle(at('scale')).display")]
    {
        page.press(key);
        assert_eq!(page.value(shown), "none");
        page.press(key);
        assert_ne!(page.value(shown), "none");
    }
    // What is saved has neither.
    page.press("r");
    page.wait_for("Math.abs(shown.viewpoint.azimuth) < 1");
    page.wait_for(WHOLE);
    assert_eq!(page.value(saved), bytes);
    ends_well(&page, view);
}

#[test]
fn a_file_that_is_dropped_is_opened_and_what_is_none_is_refused() {
    let place = Place::new(&(SMALL_SCENE.to_owned() + FOG));
    let view = View::start(&place, &["s.toml"]);
    let mut page = opened(&view);
    let drop = |name: &str, text: &str| {
        format!(
            "(() => {{ const dataTransfer = new DataTransfer(); dataTransfer.items.add(new File(['{text}'], '{name}')); \
             for (const kind of ['dragover', 'drop']) stage.dispatchEvent(new DragEvent(kind, {{ dataTransfer, bubbles: true, cancelable: true }})); }})()"
        )
    };
    page.value(&drop("corner.csv", "x,y,z\\n0,0,zero\\n"));
    page.wait_for("at('trouble').textContent.startsWith('corner.csv:2:') && at('opening').hidden");
    page.wait_for(WHOLE);
    // The browser itself reports the refusal of a request.
    page.faults.clear();
    page.value(&drop("corner.csv", "x,y,z\\n0,0,0\\n1,0,0\\n0,1,0\\n"));
    page.wait_for("shown.title === 'corner.csv' && at('title').textContent === 'corner.csv'");
    page.wait_for(WHOLE);
    assert_eq!(page.value("shown.objects.map((object) => object.name)"), serde_json::json!(["corner"]));
    ends_well(&page, view);
}
