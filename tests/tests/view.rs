//! `organza view` as a process: one line with an address, pictures with the bytes of `organza render`, an end on request.

use organza_tests::{Place, SMALL_SCENE, organza};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

pub(crate) const FOG: &str = "[[object]]\nname = \"fog\" # thin\nmedium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 1.5, spacing = 0.25 }\n\
                   [[object]]\nname = \"pane\"\nrectangle = { center = [0, 0, 0.5], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.1 }\n";

/// A view that is running.
pub(crate) struct View {
    pub(crate) child: Child,
    address: String,
    token: String,
}

impl View {
    pub(crate) fn start(place: &Place, arguments: &[&str]) -> Self {
        let mut command = organza();
        // What it leaves there is seen by the test.
        command.env("TMPDIR", place.folder()).current_dir(place.folder()).arg("view").args(arguments).arg("--no-open");
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
        let rest = line.trim().strip_prefix("http://").unwrap_or_else(|| panic!("an address, not {line:?}"));
        let (address, token) = rest.trim_end_matches('/').split_once('/').unwrap();
        Self { address: address.to_owned(), token: token.to_owned(), child }
    }

    /// The address of its page.
    pub(crate) fn url(&self) -> String {
        format!("http://{}/{}/", self.address, self.token)
    }

    /// The status and the body of an answer.
    fn get(&self, path: &str) -> (u16, Vec<u8>) {
        self.ask(&format!("GET /{}/{path}", self.token), "", "")
    }

    /// Sends JSON.
    fn post(&self, path: &str, body: &str) {
        let headers = format!("Content-Type: application/json\r\nContent-Length: {}\r\n", body.len());
        let (status, answer) = self.ask(&format!("POST /{}/{path}?client=a", self.token), &headers, body);
        assert_eq!(status, 200, "{}", String::from_utf8_lossy(&answer));
    }

    fn ask(&self, line: &str, headers: &str, body: &str) -> (u16, Vec<u8>) {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        let request = format!("{line} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n{headers}\r\n{body}", self.address);
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let end = answer.windows(4).position(|bytes| bytes == b"\r\n\r\n").unwrap();
        let status = std::str::from_utf8(&answer[9..12]).unwrap().parse().unwrap();
        (status, answer.split_off(end + 4))
    }

    /// A file to save, once the whole picture is drawn.
    fn saved(&self, what: &str) -> Vec<u8> {
        let end = Instant::now() + Duration::from_secs(60);
        loop {
            let (status, body) = self.get(&format!("save/{what}?client=a"));
            match status {
                200 => return body,
                503 if Instant::now() < end => std::thread::sleep(Duration::from_millis(20)),
                _ => panic!("{what}: {status} {}", String::from_utf8_lossy(&body)),
            }
        }
    }

    /// Interrupts it; its exit code and what it said.
    pub(crate) fn interrupted(mut self) -> (Option<i32>, String) {
        Command::new("kill").args(["-INT", &self.child.id().to_string()]).status().unwrap();
        let start = Instant::now();
        let status = self.child.wait().unwrap();
        assert!(start.elapsed() < Duration::from_secs(1), "{:?}", start.elapsed());
        let mut told = String::new();
        self.child.stderr.take().unwrap().read_to_string(&mut told).unwrap();
        (status.code(), told)
    }
}

#[test]
fn saved_files_are_those_of_render_with_the_same_changes() {
    let place = Place::new(&format!("{SMALL_SCENE}{FOG}"));
    let played = "[{\"do\": \"show\", \"object\": \"fog\", \"visible\": true},\n{\"do\": \"opacity\", \"object\": \"pane\", \"opacity\": 0.5},\n\
                  {\"do\": \"exposure\", \"stops\": 1.5}, {\"do\": \"effect\", \"name\": \"shadow.0\", \"switch\": \"off\"}]";
    place.write("events.json", played);
    let view = View::start(&place, &["s.toml", "--size", "30x20", "--play", "events.json", "--record", "again.json"]);
    for (file, name) in [("picture.png", "view.png"), ("picture.exr", "view.exr"), ("scene", "view.toml")] {
        place.write(name, view.saved(file));
    }
    assert_eq!(view.interrupted(), (Some(0), String::new()));
    let set = ["object.fog.visible=true", "object.pane.opacity=0.5", "render.exposure=1.5"];
    let set = set.iter().flat_map(|set| ["--set", set]);
    let outputs = ["-o", "render.png", "-o", "render.exr", "--effect", "shadow.0=off"];
    let arguments: Vec<&str> = ["render", "s.toml", "--size", "30x20"].into_iter().chain(set).chain(outputs).collect();
    place.expect(0, &arguments, "");
    assert!(place.bytes("view.png") == place.bytes("render.png"));
    assert!(place.bytes("view.exr") == place.bytes("render.exr"));
    // The scene that was saved is the same picture, and keeps its comments.
    place.expect(0, &["render", "view.toml", "-o", "saved.png"], "");
    assert_eq!(place.pixels("saved.png"), place.pixels("render.png"));
    assert!(String::from_utf8(place.bytes("view.toml")).unwrap().contains("# thin"));
    // What was done is recorded, and is played again to the same picture.
    let again = View::start(&place, &["s.toml", "--size", "30x20", "--play", "again.json"]);
    assert!(again.saved("picture.png") == place.bytes("render.png"));
    assert_eq!(again.interrupted().0, Some(0));
}

#[test]
fn a_cut_is_that_of_render_and_is_saved() {
    let place = Place::new(&(SMALL_SCENE.to_owned() + FOG));
    let view = View::start(&place, &["s.toml"]);
    view.post(
        "events",
        r#"[{"do": "cuts", "cuts": [{"object": "fog", "normal": [0, 0, 2], "point": [7, 7, 0.125]}]},
            {"do": "color", "object": "pane", "color": [0.25, 0.5, 1]}]"#,
    );
    place.write("view.png", view.saved("picture.png"));
    let cut = "object.fog.clip=[{ normal = [0, 0, 2], point = [7, 7, 0.125] }]";
    let color = "object.pane.color=[0.25, 0.5, 1]";
    place.expect(0, &["render", "s.toml", "-o", "cut.png", "--set", cut, "--set", color], "");
    assert_eq!(place.pixels("view.png"), place.pixels("cut.png"));
    place.expect(0, &["render", "s.toml", "-o", "whole.png", "--set", color], "");
    assert_ne!(place.pixels("view.png"), place.pixels("whole.png"));
    let scene = String::from_utf8(view.saved("scene")).unwrap();
    assert!(scene.contains("clip = [{ normal = [0.0, 0.0, 2.0], point = [7.0, 7.0, 0.125] }]"), "{scene}");
    assert_eq!(view.interrupted().0, Some(0));
}

#[test]
fn a_saved_scene_opens_from_where_the_browser_put_it() {
    let place = Place::new(SMALL_SCENE);
    place.write("corner.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n");
    let view = View::start(&place, &["corner.xyz", "--size", "40x30"]);
    place.write("view.png", view.saved("picture.png"));
    let text = view.saved("scene");
    assert_eq!(view.interrupted().0, Some(0));
    let downloads = tempfile::tempdir().unwrap();
    let folder = downloads.path().join("home/someone/downloads");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("corner.toml"), text).unwrap();
    let scene = folder.join("corner.toml");
    place.expect(0, &["render", scene.to_str().unwrap(), "-o", "again.png"], "");
    assert_eq!(place.pixels("again.png"), place.pixels("view.png"));
}

#[test]
fn a_view_that_is_killed_leaves_a_recording_that_plays() {
    let place = Place::new(&format!("{SMALL_SCENE}{FOG}"));
    let mut view = View::start(&place, &["s.toml", "--record", "events.json"]);
    for exposure in [1.0, 2.0] {
        view.post("events", &format!("[{{\"do\": \"exposure\", \"stops\": {exposure}}}]"));
    }
    view.child.kill().unwrap();
    view.child.wait().unwrap();
    let told = "[\n{\"do\":\"exposure\",\"stops\":1.0},\n{\"do\":\"exposure\",\"stops\":2.0}\n]\n";
    assert_eq!(String::from_utf8(place.bytes("events.json")).unwrap(), told);
    let again = View::start(&place, &["s.toml", "--play", "events.json"]);
    let (_, state) = again.get("state?client=a");
    assert!(String::from_utf8(state).unwrap().contains("\"exposure\":2.0"));
    assert_eq!(again.interrupted().0, Some(0));
}

#[test]
fn a_scene_that_changes_is_seen_as_it_is_now() {
    let place = Place::new(&format!("{SMALL_SCENE}{FOG}"));
    let view = View::start(&place, &["s.toml", "--watch"]);
    let before = view.saved("picture.png");
    let wait_for = |text: &str| {
        let end = Instant::now() + Duration::from_secs(30);
        while !String::from_utf8(view.get("state?client=a&after=0").1).unwrap().contains(text) {
            assert!(Instant::now() < end, "{text}");
            std::thread::sleep(Duration::from_millis(50));
        }
    };
    place.write("s.toml", format!("{SMALL_SCENE}{FOG}nonsense = 1\n"));
    wait_for("nonsense");
    assert!(view.saved("picture.png") == before);
    place.write("s.toml", format!("{SMALL_SCENE}{}", FOG.replace("1.5", "15")));
    wait_for("\"failure\":null");
    assert!(view.saved("picture.png") != before);
    assert_eq!(view.interrupted().0, Some(0));
}

#[test]
fn a_data_file_that_breaks_has_the_name_that_it_was_given() {
    let elsewhere = tempfile::tempdir().unwrap();
    let data = elsewhere.path().canonicalize().unwrap().join("corner.xyz");
    std::fs::write(&data, "0 0 0\n1 0 0\n0 1 0\n0 0 1\n").unwrap();
    let place = Place::new(SMALL_SCENE);
    let given = data.to_str().unwrap();
    let view = View::start(&place, &[given, "--watch"]);
    view.saved("picture.png");
    std::fs::write(&data, "0 0 0\n1 0 zero\n").unwrap();
    let end = Instant::now() + Duration::from_secs(30);
    let failure = loop {
        let state: serde_json::Value = serde_json::from_slice(&view.get("state?client=a&after=0").1).unwrap();
        if let Some(message) = state["failure"]["message"].as_str() {
            break message.to_owned();
        }
        assert!(Instant::now() < end, "{state}");
        std::thread::sleep(Duration::from_millis(50));
    };
    assert!(failure.starts_with(&format!("{given}:2:")), "{failure}");
    assert_eq!(view.interrupted().0, Some(0));
}

#[test]
fn a_file_that_a_page_hands_over_is_opened_within_the_limits_of_the_command() {
    let place = Place::new(SMALL_SCENE);
    let points = "x,y,z\n0,0,0\n1,0,0\n0,1,0\n0,0,1\n";
    place.write("corner.csv", points);
    let before = place.made();
    let hand_over = |view: &View, name: &str, body: &str| {
        let headers = format!("Content-Type: application/octet-stream\r\nContent-Length: {}\r\n", body.len());
        let (status, answer) = view.ask(&format!("POST /{}/open?client=a&name={name}", view.token), &headers, body);
        (status, String::from_utf8(answer).unwrap())
    };
    let view = View::start(&place, &["s.toml", "--size", "40x30", "--max-memory", "300000000"]);
    let (status, refused) = hand_over(&view, "other.toml", SMALL_SCENE);
    assert!(status == 422 && refused.contains("other.toml: expected a data file, found a scene"), "{refused}");
    let (status, refused) = hand_over(&view, "other.docx", "what is this");
    assert!(status == 422 && refused.contains("other.docx"), "{refused}");
    let headers = "Content-Type: application/octet-stream\r\nContent-Length: 300000001\r\n";
    let line = format!("POST /{}/open?client=a&name=large.csv", view.token);
    let (status, refused) = view.ask(&line, headers, "");
    assert!(status == 413 && String::from_utf8_lossy(&refused).contains("--max-memory"), "{status}");
    let (status, opened) = hand_over(&view, "corner.csv", points);
    assert!(status == 200 && opened.contains("\"title\":\"corner.csv\""), "{opened}");
    let picture = view.saved("picture.png");
    let scene = view.saved("scene");
    let (code, told) = view.interrupted();
    assert_eq!(code, Some(0), "{told}");
    assert_eq!(place.made(), before, "nothing is left");
    place.write("view.png", picture);
    place.expect(0, &["render", "corner.csv", "--size", "40x30", "-o", "render.png"], "");
    assert_eq!(place.pixels("view.png"), place.pixels("render.png"));
    place.write("saved.toml", scene);
    place.expect(0, &["render", "saved.toml", "-o", "saved.png"], "");
    assert_eq!(place.pixels("saved.png"), place.pixels("render.png"));
    // A recording is of one scene.
    let view = View::start(&place, &["s.toml", "--record", "events.json"]);
    let (status, refused) = hand_over(&view, "corner.csv", points);
    assert!(status == 409 && refused.contains("--record"), "{refused}");
    assert_eq!(view.interrupted().0, Some(0));
}

#[test]
fn data_files_are_seen_as_render_draws_them() {
    let place = Place::new(SMALL_SCENE);
    place.write("corner.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n");
    let options = ["corner.xyz", "--azimuth", "70", "--size", "40x30", "--ground"];
    let view = View::start(&place, &options);
    place.write("view.png", view.saved("picture.png"));
    let (_, state) = view.get("state?client=a");
    assert!(String::from_utf8(state).unwrap().contains("\"title\":\"corner.xyz\""));
    assert_eq!(view.interrupted().0, Some(0));
    let arguments: Vec<&str> = ["render"].into_iter().chain(options).chain(["-o", "render.png"]).collect();
    place.expect(0, &arguments, "");
    assert!(place.bytes("view.png") == place.bytes("render.png"));
}

#[test]
fn an_interrupt_ends_it_within_a_second_while_it_draws() {
    let long = "[render]\ntechnique = \"particles\"\n[render.particles]\nrepeat_level = 100000\n";
    let place = Place::new(&format!("{SMALL_SCENE}{FOG}{long}"));
    let view = View::start(&place, &["s.toml", "--size", "320x240", "--record", "events.json"]);
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(view.interrupted().0, Some(0));
    assert_eq!(place.bytes("events.json"), b"[\n]\n");
}

#[test]
fn what_cannot_be_viewed_is_refused_before_an_address_is_printed() {
    let place = Place::new(&format!("{SMALL_SCENE}{FOG}"));
    place.write("events.json", "[{\"do\": \"opacity\", \"object\": \"fog\", \"opacity\": 0.5}]");
    place.write("fly.json", "[{\"do\": \"fly\"}]");
    place.write("lacking.toml", format!("{SMALL_SCENE}[[object]]\nname = \"a\"\nmesh = \"none.ply\"\n"));
    for (code, arguments, said) in [
        (
            3,
            &["s.toml", "--play", "events.json"][..],
            "error: events.json:1: event 1 (`opacity`): opacity of object fog: ",
        ),
        (3, &["s.toml", "--play", "fly.json"], "fly.json: unknown variant"),
        (4, &["s.toml", "--play", "none.json"], "cannot read the events"),
        (4, &["s.toml", "--record", "fly.json"], "fly.json"),
        (4, &["none.toml"], "none.toml"),
        (4, &["lacking.toml"], "none.ply: cannot read: no such file"),
        (2, &["s.toml", "--listen", "example.org"], "expected `localhost` or a numeric address"),
        (2, &["s.toml", "--backend", "ash"], "--backend ash is for `organza render`"),
        (2, &["s.toml", "--force"], "--record"),
    ] {
        let arguments: Vec<&str> = ["view", "--no-open"].into_iter().chain(arguments.iter().copied()).collect();
        let out = place.expect(code, &arguments, said);
        assert!(out.stdout.is_empty(), "{arguments:?}");
    }
    assert_eq!(place.made(), ["events.json", "fly.json", "lacking.toml"]);
}

#[test]
fn a_recording_of_another_scene_is_played_as_far_as_it_fits() {
    let place = Place::new(&format!("{SMALL_SCENE}{FOG}"));
    let shadow = "{\"do\": \"light_shadow\", \"light\": \"renamed\", \"shadow\": false}";
    place.write("events.json", format!("[{shadow}, {{\"do\": \"exposure\", \"stops\": 1.5}}]"));
    let view = View::start(&place, &["s.toml", "--play", "events.json"]);
    let (_, state) = view.get("state?client=a");
    assert!(String::from_utf8(state).unwrap().contains("\"exposure\":1.5"));
    let (code, told) = view.interrupted();
    assert!(
        code == Some(0)
            && told.contains("events.json:1: event 1 (`light_shadow`): expected the name of a light, found `renamed`"),
        "{told}"
    );
}

#[test]
fn an_address_that_others_reach_is_warned_of() {
    let place = Place::new(&format!("{SMALL_SCENE}{FOG}"));
    let view = View::start(&place, &["s.toml", "--listen", "0.0.0.0"]);
    // It is one at which the view answers, and none that stands for all of them.
    assert!(!view.address.starts_with("0.0.0.0") && view.get("").0 == 200, "{}", view.address);
    let (code, told) = view.interrupted();
    assert!(code == Some(0) && told.contains("warning: --listen 0.0.0.0"), "{told}");
}
