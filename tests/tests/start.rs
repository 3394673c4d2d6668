//! docs/start.md: every command of the page runs, and does what the page says.

use organza_tests::Place;
use std::fmt::Write;
use std::path::Path;

/// Pictures are small here, and the volume is.
const SIZE: &str = "48x27";

fn repository() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// The commands of a page: lines of its blocks in `sh`, as a shell would part them.
fn commands(page: &str) -> Vec<Vec<String>> {
    let blocks = page.split("```sh\n").skip(1).map(|rest| rest.split("```").next().unwrap());
    blocks.flat_map(str::lines).map(words).collect()
}

/// Words between blanks; quotes hold some together.
fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut word = String::new();
    let mut quoted = false;
    for c in line.chars() {
        match c {
            '\'' => quoted = !quoted,
            ' ' if !quoted => words.push(std::mem::take(&mut word)),
            c => word.push(c),
        }
    }
    words.push(word);
    words
}

/// A head of a few voxels: a ball of tissue in air.
fn small_volume() -> String {
    let n = 16;
    let mut text = format!(
        "NRRD0004\ntype: float\ndimension: 3\nspace: right-anterior-superior\nsizes: {n} {n} {n}\n\
         space directions: (12,0,0) (0,12,0) (0,0,12)\nspace origin: (-90,-90,-90)\nencoding: ascii\n\n"
    );
    for i in 0..n * n * n {
        let distance = [i % n, i / n % n, i / n / n].map(|c| (c as f64 - 7.5).powi(2)).iter().sum::<f64>().sqrt();
        writeln!(text, "{}", (200.0 - 25.0 * distance).max(0.0).round()).unwrap();
    }
    text
}

#[test]
fn every_command_of_the_page_runs_and_writes_what_it_names() {
    let page = std::fs::read_to_string(repository().join("docs/start.md")).unwrap();
    let place = Place::new("");
    for folder in ["assets/stanford-dragon", "assets/mni152", "assets/autzen"] {
        std::fs::create_dir_all(place.path(folder)).unwrap();
    }
    for file in ["assets/stanford-dragon/dragon_res4.ply.gz", "assets/autzen/autzen_trim.laz"] {
        std::fs::copy(repository().join(file), place.path(file)).unwrap();
    }
    // The content tells the format.
    place.write("assets/mni152/mni152_t1.nii.gz", small_volume());
    let commands = commands(&page);
    assert!(commands.len() > 15, "{commands:?}");
    for command in &commands {
        assert_eq!(command[0], "organza", "{command:?}");
        let mut arguments: Vec<&str> = command[1..].iter().map(String::as_str).collect();
        if ["render", "init"].contains(&arguments[0]) {
            arguments.extend(["--size", SIZE]);
        }
        place.expect(0, &arguments, "");
        let outputs = command.windows(2).filter(|pair| ["-o", "--cost"].contains(&pair[0].as_str()));
        for output in outputs.map(|pair| pair[1].as_str()).filter(|_| !command.contains(&"--turntable".to_owned())) {
            assert!(place.path(output).is_file(), "{command:?}");
        }
    }
    for k in 0..4 {
        assert!(place.path(&format!("around.{k:04}.png")).is_file());
    }
}
