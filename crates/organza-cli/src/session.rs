//! What all commands on a scene do first: options become overrides, the scene is loaded, the threads start.

use super::args::{Backend, CommonArguments, GoalArguments, SceneArguments};
use super::console;
use super::given::{Given, camera_overrides, given};
use super::memory;
use organza::device::{Choice, Device, DeviceChoice};
use organza::scene::{self, Goal, LoadOptions, Override, Scene, Source, Technique, short};
use organza::{Cache, Context, Error, Files, InMemory, Progress, RenderOptions, printable, shown};
use splat_core::MemoryAccount;
use std::path::Path;
use std::sync::Arc;

/// The scene, or a first scene of data files, with the options of the command line and a camera that has its place.
pub(super) fn load_scene(command: &str, arguments: &SceneArguments) -> Result<Scene, Error> {
    let (given, files) = given(arguments, None)?;
    let scene = parse_scene(arguments, &given, None, None)?;
    let place = format!("`organza {command}`");
    unused_goal(&scene.render.goal, &place).iter().for_each(|sentence| console::warn(sentence));
    let context = Context { files: &files, options: &render_options(arguments), progress: &Progress::new() };
    Ok(organza::fitted(&scene, context)?.0.into_owned())
}

/// The scene with the options of the command line, as it is written, at a frame of its animation, or at one of a turntable.
pub(super) fn parse_scene(
    arguments: &SceneArguments,
    given: &Given,
    frame: Option<u32>,
    turntable: Option<u32>,
) -> Result<Scene, Error> {
    parse_changed(arguments, given, frame, turntable, Vec::new())
}

/// The same with these effects switched, each `NAME=on` or `NAME=off`, behind all other options, and a camera that has its place.
pub(super) fn parse_switched(
    arguments: &SceneArguments,
    given: &Given,
    files: &Files,
    effects: &[String],
) -> Result<Scene, Error> {
    let changes = effects.iter().map(|effect| Override::of_effect(effect)).collect::<Result<Vec<_>, _>>()?;
    let scene = parse_changed(arguments, given, None, None, changes)?;
    let context = Context { files, options: &render_options(arguments), progress: &Progress::new() };
    Ok(organza::fitted(&scene, context)?.0.into_owned())
}

/// The scene with these changes behind all other options.
pub(super) fn parse_changed(
    arguments: &SceneArguments,
    given: &Given,
    frame: Option<u32>,
    turntable: Option<u32>,
    changes: Vec<Override>,
) -> Result<Scene, Error> {
    let overrides = [overrides(arguments, given.is_made)?, changes].concat();
    let SceneArguments { allow_path, sandbox, .. } = *arguments;
    let memory = MemoryAccount::new(reading_options(&arguments.common).max_memory);
    let options =
        LoadOptions { allow_path, sandbox, memory, overrides, frame, turntable, in_memory: InMemory::default() };
    let scene = scene::parse(&given.file, &given.bytes, &options)?;
    if arguments.merge_duplicates && !scene.objects.iter().any(|object| matches!(object.source, Source::Points(_))) {
        let message = "--merge-duplicates is for `points`, and no object is made of such";
        return Err(Error::usage(message, "leave it out"));
    }
    Ok(scene)
}

/// Options that change nothing of a scene, which would pass silently otherwise.
pub(super) fn without_effect(arguments: &SceneArguments, scene: &Scene) -> Vec<String> {
    let techniques = scene.objects.iter().filter(|object| object.visible).filter_map(|object| object.technique);
    let has_particles = techniques.chain([scene.render.technique]).any(|technique| technique == Technique::Particles);
    let has_points = scene.objects.iter().any(|object| object.visible && object.source.is_of_points());
    let options = [
        Flag { name: "--target-error", is_given: arguments.target_error.is_some() },
        Flag { name: "--repeat-level", is_given: arguments.repeat_level.is_some() },
        Flag { name: "--seed", is_given: arguments.seed.is_some() },
    ];
    let mut sentences: Vec<String> = options
        .iter()
        .filter(|option| option.is_given && !has_particles)
        .map(|option| {
            format!(
                "{} changes nothing: no object is drawn by the technique `particles`; add --technique particles",
                option.name
            )
        })
        .collect();
    if arguments.common.drop_invalid && !has_points {
        sentences.push("--drop-invalid changes nothing: no object is made of points; leave it out".to_owned());
    }
    sentences
}

/// Keys of a goal where a picture does not keep to it, or is none.
pub(super) fn unused_goal(goal: &Goal, place: &str) -> Vec<String> {
    let keys = goal_keys(goal);
    let sentence =
        |key: &str| format!("render.{key} has no part in {place}: one picture by `organza render` keeps to it");
    keys.into_iter().map(sentence).collect()
}

/// The keys of a goal that limit something.
pub(super) fn goal_keys(goal: &Goal) -> Vec<&'static str> {
    let is_set = [goal.budget_ms.is_some(), goal.max_rmse.is_some(), goal.max_flip.is_some()];
    Goal::KEYS.into_iter().zip(is_set).filter(|(_, is_set)| *is_set).map(|(key, _)| key).collect()
}

/// Options of a goal as changes of the scene's keys.
pub(super) fn goal_overrides(arguments: &GoalArguments) -> Result<Vec<Override>, Error> {
    let GoalArguments { budget, max_rmse, max_flip } = *arguments;
    let mut changes = Vec::new();
    if let Some(ms) = budget {
        changes.push(Override::from_option(format!("--budget {ms}"), "render.budget_ms", &ms.to_string())?);
    }
    if let Some(error) = max_rmse {
        let flag = format!("--max-rmse {}", short(error));
        changes.push(Override::from_option(flag, "render.max_rmse", &format!("{error:?}"))?);
    }
    if let Some(error) = max_flip {
        let flag = format!("--max-flip {}", short(error));
        changes.push(Override::from_option(flag, "render.max_flip", &format!("{error:?}"))?);
    }
    Ok(changes)
}

/// Options that win over other values of the scene's keys.
pub(super) fn goal_remarks(arguments: &GoalArguments, stated: &Goal) -> Vec<String> {
    let GoalArguments { budget, max_rmse, max_flip } = *arguments;
    let mut remarks = Vec::new();
    if let (Some(taken), Some(stated)) = (budget, stated.budget_ms)
        && taken != stated
    {
        remarks.push(format!("--budget {taken} is taken, the scene has render.budget_ms = {stated}"));
    }
    let mut remark = |option: &str, key: &str, taken: Option<f64>, stated: Option<f64>| {
        if let (Some(taken), Some(stated)) = (taken, stated)
            && taken != stated
        {
            remarks.push(format!("{option} {} is taken, the scene has render.{key} = {}", short(taken), short(stated)));
        }
    };
    remark("--max-rmse", "max_rmse", max_rmse, stated.max_rmse);
    remark("--max-flip", "max_flip", max_flip, stated.max_flip);
    remarks
}

/// Refuses an effect that is switched both on and off.
fn check_switches(effects: &[String]) -> Result<(), Error> {
    for (rank, effect) in effects.iter().enumerate() {
        let Some((name, switch)) = effect.rsplit_once('=') else { continue };
        let contrary =
            |before: &&String| before.rsplit_once('=').is_some_and(|(other, before)| other == name && before != switch);
        if let Some(before) = effects[..rank].iter().find(contrary) {
            let message = format!("--effect {} and --effect {}: one of them can hold", shown(before), shown(effect));
            return Err(Error::usage(message, "leave one out"));
        }
    }
    Ok(())
}

/// An option of the command line.
pub(super) struct Flag {
    /// As the user writes it.
    pub(super) name: &'static str,
    pub(super) is_given: bool,
}

/// Refuses options of a picture where a command draws by every technique, with the layers that it needs.
pub(super) fn refuse_technique_and_layers(command: &str, arguments: &SceneArguments) -> Result<(), Error> {
    let options = [
        Flag { name: "--technique", is_given: arguments.technique.is_some() },
        Flag { name: "--layers", is_given: arguments.layers.is_some() },
    ];
    let given = options.iter().find(|option| option.is_given);
    given.map_or(Ok(()), |option| {
        Err(Error::usage(format!("{} changes nothing that `organza {command}` does", option.name), "leave it out"))
    })
}

/// What reading may take and how it treats doubtful input.
pub(super) fn reading_options(arguments: &CommonArguments) -> RenderOptions {
    RenderOptions {
        max_memory: arguments.max_memory.unwrap_or_else(memory::default_limit),
        drop_invalid: arguments.drop_invalid,
        strict: arguments.strict,
        ..RenderOptions::default()
    }
}

/// The same of a render by the processor.
pub(super) fn render_options(arguments: &SceneArguments) -> RenderOptions {
    RenderOptions {
        merge_duplicates: arguments.merge_duplicates,
        cache: arguments.cache.as_ref().map(|folder| Arc::new(Cache::new(folder, arguments.cache_size))),
        device_composites: arguments.device_composites,
        ..reading_options(&arguments.common)
    }
}

/// Opens the device that was asked for.
pub(super) fn open_device(arguments: &SceneArguments) -> Result<Option<Arc<Device>>, Error> {
    Ok(device(arguments).as_ref().map(Device::open).transpose()?.map(Arc::new))
}

/// Starts the threads that all stages share.
pub(super) fn start_threads(threads: u64) -> Result<(), Error> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads as usize).build_global();
    pool.map_err(|e| Error::usage(format!("--threads {threads}: {e}"), "use fewer threads"))
}

/// A folder for outputs, made if it is not there; an empty one that was made is gone again when the work fails.
pub(super) fn in_folder<T>(folder: &Path, work: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
    let made = !folder.exists();
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "cannot make this folder", e))?;
    let out = work();
    if made && out.is_err() {
        // A folder that holds something stays.
        let _ = std::fs::remove_dir(folder);
    }
    out
}

/// The device that was asked for.
fn device(arguments: &SceneArguments) -> Option<DeviceChoice> {
    let name = arguments.device.clone();
    let choice = || name.clone().map_or(Choice::Gpu, Choice::Named);
    match arguments.backend {
        Backend::Cpu => None,
        Backend::Auto => Some(DeviceChoice::auto(name)),
        Backend::Ash => Some(DeviceChoice::ash(choice())),
        Backend::Wgpu => Some(DeviceChoice::wgpu(choice())),
    }
}

/// Refuses options of a GPU where none is asked for.
pub(super) fn check_backend(arguments: &SceneArguments) -> Result<(), Error> {
    match (arguments.backend, &arguments.device) {
        (Backend::Cpu, Some(_)) => {
            Err(Error::usage("--device names a GPU, and the processor was asked for", "add --backend auto"))
        }
        (Backend::Cpu, None) if arguments.device_composites => {
            Err(Error::usage("--device-composites is for a GPU, and the processor was asked for", "add --backend auto"))
        }
        _ => Ok(()),
    }
}

/// For the commands that measure what the processor does.
pub(super) fn processor_only(arguments: &SceneArguments) -> Result<(), Error> {
    match device(arguments) {
        Some(_) => {
            let name = arguments.backend.name();
            Err(Error::usage(format!("--backend {name} is for `organza render`"), "use --backend cpu"))
        }
        None => Ok(()),
    }
}

/// `--set` in order, then options that stand for a value of the scene, then effects. A scene that was made of data files has the camera's options already,
/// unless a `--set` replaces its camera.
pub(super) fn overrides(a: &SceneArguments, is_made: bool) -> Result<Vec<Override>, Error> {
    let sets = a.set.iter().map(|text| Override::parse(text)).collect::<Result<Vec<_>, _>>()?;
    let has_camera = is_made && !sets.iter().any(|set| *set.path() == ["camera"]);
    let mut options: Vec<(String, &str, String)> = Vec::new();
    if let Some(name) = &a.technique {
        options.push((format!("--technique {name}"), "render.technique", quote(name)));
    }
    if let Some([w, h]) = a.common.size.filter(|_| !has_camera) {
        options.push((format!("--size {w}x{h}"), "camera.size", format!("[{w}, {h}]")));
    }
    if let Some(seed) = a.seed {
        options.push((format!("--seed {seed}"), "render.seed", seed.to_string()));
    }
    if let Some(tolerance) = a.tolerance {
        options.push((format!("--tolerance {}", short(tolerance)), "render.tolerance", format!("{tolerance:?}")));
    }
    if let Some(error) = a.target_error {
        options.push((
            format!("--target-error {}", short(error)),
            "render.particles.target_error",
            format!("{error:?}"),
        ));
    }
    if let Some(levels) = a.repeat_level {
        options.push((format!("--repeat-level {levels}"), "render.particles.repeat_level", levels.to_string()));
    }
    if let Some(exposure) = a.exposure {
        options.push((format!("--exposure {}", short(exposure)), "render.exposure", format!("{exposure:?}")));
    }
    if let Some([red, green, blue]) = a.background {
        let color = format!("{{ color = [{red:?}, {green:?}, {blue:?}] }}");
        options.push(("--background".to_owned(), "background", color));
    }
    if let Some(layers) = &a.layers {
        let list = layers.iter().map(|l| quote(l)).collect::<Vec<_>>().join(", ");
        options.push((format!("--layers {}", layers.join(",")), "render.layers", format!("[{list}]")));
    }
    let options = options.into_iter().map(|(flag, path, value)| Override::from_option(flag, path, &value));
    check_switches(&a.effect)?;
    let of_camera = if has_camera { Vec::new() } else { camera_overrides(&a.first)? };
    let effects = a.effect.iter().map(|text| Override::of_effect(text));
    let mut changes = sets;
    for change in of_camera.into_iter().map(Ok).chain(options).chain(effects) {
        changes.push(change?);
    }
    check_sets(&changes)?;
    Ok(changes)
}

/// Refuses a `--set` whose value another option takes the place of, rather than drop one of both.
pub(super) fn check_sets(changes: &[Override]) -> Result<(), Error> {
    let is_set = |change: &&Override| change.flag().starts_with("--set ");
    let options = || changes.iter().filter(|change| !is_set(change));
    for set in changes.iter().filter(is_set) {
        if let Some(option) = options().find(|option| set.is_lost_by(option)) {
            let key = option.path().join(".");
            let message = format!("{} and {}: `{key}` has two values", shown(set.flag()), shown(option.flag()));
            return Err(Error::usage(message, "leave one of both out; options take the place of what --set states"));
        }
    }
    Ok(())
}

/// A text as TOML, which takes JSON's quotes and escapes.
fn quote(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// A path as text for a JSON document.
pub(super) fn path_text(path: &Path) -> String {
    path.to_str().map_or_else(|| printable(path), str::to_owned)
}
