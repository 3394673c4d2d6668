//! `organza view`.

use super::args::{FirstArguments, ViewArguments};
use super::console::bar::with_bar;
use super::console::{self, signals};
use super::given::{given, is_scene, wish, write_first};
use super::session::{overrides, parse_scene, processor_only, render_options, unused_goal, without_effect};
use organza::output::{Target, Targets};
use organza::scene::{LoadOptions, Scene, SceneObject};
use organza::{Error, Files, InMemory, Progress, RenderOptions, printable};
use organza_survey::Wish;
use organza_view::{
    Ended, EventFile, GivenFile, MOST_EVENTS, Opened, Opener, Opening, Recording, Server, Session, Watch,
};
use serde_json::json;
use splat_core::MemoryAccount;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::Arc;

/// Serves a page of the scene until it is closed or the command is interrupted. Whatever can be refused is refused before any work.
pub(super) fn run(arguments: &ViewArguments) -> Result<(), Error> {
    processor_only(&arguments.scene)?;
    arguments.record.as_ref().map(|path| Target::new(path, arguments.force)).transpose()?;
    let played = arguments.play.as_ref().map(|path| EventFile::read(path)).transpose()?.unwrap_or_default();
    let address = arguments.listen.unwrap_or(SocketAddr::from((Ipv4Addr::LOCALHOST, 0)));
    let options = render_options(&arguments.scene);
    let first = wish(&FirstArguments::default(), arguments.scene.common.size, None)?;
    let opener = Opener::new(options.max_memory, move |file| open_handed_over(file, &first, &options));
    let server = Server::bind(address)?.opening(opener);
    let Opened { session, left_out } = with_bar(|progress| open(arguments, &played, progress))?;
    left_out_events(&left_out).iter().for_each(|sentence| console::warn(sentence));
    // Whoever reads the address may interrupt at once.
    let ending = Arc::new(Progress::new());
    signals::stops(&ending);
    if !address.ip().is_loopback() {
        console::warn(&format!(
            "--listen {}: whoever can read along on the way to this machine sees the page and its address, as nothing is encrypted; a tunnel of ssh \
             to 127.0.0.1 is",
            address.ip()
        ));
    }
    if let Some(path) = &arguments.record {
        let mut recording = Recording::begin(path, arguments.force)?;
        recording.add(played.events());
        session.record(recording);
    }
    let session = Arc::new(session);
    let watch = arguments.watch.then(|| Watch::begin(&session)).transpose()?;
    tell(&server.url(), arguments)?;
    let ended = server.run(&session, &ending);
    drop(watch);
    session.close();
    if session.end_recording()? {
        console::warn(&format!("--record: the recording ends at {MOST_EVENTS} events"));
    }
    if ended? == Ended::PagesClosed {
        console::remark("the page is closed, and the view with it");
    }
    Ok(())
}

/// Most events that are named one by one where the scene does not have what they name.
const MOST_NAMED: usize = 5;

/// What is said of recorded events that are left out.
fn left_out_events(left_out: &[String]) -> Vec<String> {
    let mut sentences: Vec<String> =
        left_out.iter().take(MOST_NAMED).map(|sentence| format!("{sentence}; the event is left out")).collect();
    if left_out.len() > MOST_NAMED {
        sentences.push(format!("--play: {} more events are left out", left_out.len() - MOST_NAMED));
    }
    sentences
}

/// Refuses a scene whose data are not there, before anybody opens a page of it.
fn check_files(scene: &Scene) -> Result<(), Error> {
    let data = scene.objects.iter().filter(|object| object.visible).flat_map(SceneObject::paths);
    let missing = data.chain(scene.images()).find(|path| !path.exists());
    let error = || std::io::Error::new(std::io::ErrorKind::NotFound, "no such file");
    missing.map_or(Ok(()), |path| Err(Error::io(path, "cannot read", error())))
}

/// Reads the scene, or makes one of data files, and begins to draw it.
fn open(arguments: &ViewArguments, played: &EventFile, progress: &Progress) -> Result<Opened, Error> {
    let scene_arguments = &arguments.scene;
    let (given, files) = given(scene_arguments, None)?;
    let scene = parse_scene(scene_arguments, &given, None, None)?;
    check_files(&scene)?;
    unused_goal(&scene.render.goal, "`organza view`").iter().for_each(|sentence| console::warn(sentence));
    without_effect(scene_arguments, &scene).iter().for_each(|sentence| console::warn(sentence));
    for path in arguments.record.iter() {
        let mut targets = Targets::default();
        targets.add_inputs(&scene.files());
        targets.add(path, arguments.force)?;
    }
    let options = render_options(scene_arguments);
    let load = LoadOptions {
        allow_path: scene_arguments.allow_path,
        sandbox: scene_arguments.sandbox,
        memory: MemoryAccount::new(options.max_memory),
        overrides: overrides(scene_arguments, given.is_made)?,
        frame: None,
        turntable: None,
        in_memory: InMemory::default(),
    };
    let names =
        scene_arguments.inputs.iter().map(|path| printable(path.file_name().unwrap_or(path.as_os_str()).as_ref()));
    let title = names.collect::<Vec<_>>().join(", ");
    let input = |path: &PathBuf| GivenFile { path: path.clone(), name: printable(path) };
    let inputs = scene_arguments.inputs.iter().map(input).collect();
    let is_fleeting = false;
    let opening = Opening { title, inputs, is_fleeting, file: given.file, text: given.bytes, load, options, files };
    Session::open_playing(opening, played, progress)
}

/// Opens a data file that a page hands over, in a first scene of this size without other wishes: those on the command line are for other data.
fn open_handed_over(given: GivenFile, wish: &Wish, options: &RenderOptions) -> Result<Session, Error> {
    if is_scene(&given.path) {
        let hint = "it names other files, which a page does not hand over: start `organza view` with it";
        return Err(Error::input(given.name, "expected a data file, found a scene", hint));
    }
    let files = Files::default();
    let file = given.path.with_extension("toml");
    let written = write_first(std::slice::from_ref(&given.path), &file, wish, &files, options)?;
    let load = LoadOptions { sandbox: true, memory: MemoryAccount::new(options.max_memory), ..LoadOptions::default() };
    let opening = Opening {
        title: given.name.clone(),
        inputs: vec![given],
        is_fleeting: true,
        file,
        text: written.text.into_bytes(),
        load,
        options: options.clone(),
        files,
    };
    Session::open(opening, &Progress::new())
}

/// Prints where the page is, and opens it.
fn tell(url: &str, arguments: &ViewArguments) -> Result<(), Error> {
    if arguments.scene.common.json {
        console::out(&format!("{}\n", json!({ "url": url })))?;
    } else {
        console::out(&format!("{url}\n"))?;
    }
    if !arguments.no_open && !opened(url) {
        console::remark("no browser could be opened: open the address above in one; Ctrl-C ends the view");
    }
    Ok(())
}

/// Hands an address to the browser of the desktop; false where there is none.
fn opened(url: &str) -> bool {
    let (program, before): (&str, &[&str]) = if cfg!(target_os = "macos") {
        ("open", &[])
    } else if cfg!(windows) {
        ("rundll32", &["url.dll,FileProtocolHandler"])
    } else {
        // Without a desktop a browser of the terminal would take its place.
        if std::env::var_os("DISPLAY").is_none() && std::env::var_os("WAYLAND_DISPLAY").is_none() {
            return false;
        }
        ("xdg-open", &[])
    };
    let mut command = Command::new(program);
    command.args(before).arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().is_ok()
}
