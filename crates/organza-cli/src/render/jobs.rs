//! The pictures that `organza render` is asked for, checked before the first is drawn. Of a frame nothing is kept but what
//! others need of it: an animation may have a million.

use super::film;
use crate::args::{Backend, Frames, RenderArguments};
use crate::given::{Given, given};
use crate::session::{
    Flag, check_sets, goal_keys, goal_overrides, goal_remarks, overrides, parse_changed, parse_scene, render_options,
    unused_goal,
};
use organza::output::{self, Format, Target, Targets};
use organza::scene::{FoundCamera, Goal, Scene};
use organza::{Context, Error, Files, Progress, Render, RenderOptions, Sequence, WithinGoal, printable};
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Least digits of a frame's number in a file name.
const DIGITS: usize = 4;

/// Frames of a second of a film for which nothing else is asked.
const DEFAULT_FPS: u32 = 25;

/// All pictures of a run.
pub(super) struct Jobs<'a> {
    arguments: &'a RenderArguments,
    /// The scene, read or made once: what was checked is what is drawn.
    given: Given,
    /// The scene as it is written.
    still: Scene,
    /// What it says itself of a goal, without the options of one.
    stated_goal: Goal,
    outputs: Vec<PathBuf>,
    /// Films of all frames.
    films: Vec<PathBuf>,
    /// First and last frame.
    frames: Option<[u32; 2]>,
}

/// Where one picture goes.
pub(super) struct Places {
    pub(super) outputs: Vec<Target>,
    pub(super) cost: Option<Target>,
    pub(super) checkpoint: Option<Target>,
}

impl<'a> Jobs<'a> {
    /// Reads the scene, or makes one of data files, which are among the files then.
    pub(super) fn new(arguments: &'a RenderArguments) -> Result<(Self, Files), Error> {
        let (films, outputs): (Vec<_>, Vec<_>) = outputs(arguments)?.into_iter().partition(|path| film::is_film(path));
        let is_numbered = arguments.frames.is_some() || arguments.turntable.is_some();
        // Data takes long to read: an output that is in the way is told before.
        for output in outputs.iter().filter(|_| !is_numbered) {
            Target::new(output, arguments.force)?;
        }
        for path in &films {
            film::check_program(path)?;
            Target::new(path, arguments.force)?;
        }
        let (given, files) = given(&arguments.scene, arguments.turntable)?;
        let still = parsed(arguments, &given, None)?;
        if arguments.legend && !still.objects.iter().any(|object| object.visible && object.has_scale()) {
            let message = "--legend: no colours of this picture stand for numbers";
            let hint = "give points or a mesh a `color_by` (data files: --color-by COLUMN), a volume is coloured by its `transfer`; or leave it out";
            return Err(Error::usage(message, hint));
        }
        let stated_goal = parse_scene(&arguments.scene, &given, None, arguments.turntable)?.render.goal;
        let asked = arguments.frames.or(arguments.turntable.map(|_| Frames::All));
        let frames = asked.map(|frames| range(frames, &still)).transpose()?;
        Ok((Self { arguments, given, still, stated_goal, outputs, films, frames }, files))
    }

    /// The scene as it is written.
    pub(super) fn still(&self) -> &Scene {
        &self.still
    }

    /// What the picture is to keep to; nothing where frames are drawn, a checkpoint is kept, or a device helps.
    pub(super) fn goal(&self) -> Goal {
        if self.why_no_goal().is_some() { Goal::default() } else { self.still.render.goal }
    }

    /// What is good to know of the goal: keys that have no part in what is drawn, and those that options overrule.
    pub(super) fn goal_sentences(&self) -> Vec<String> {
        match self.why_no_goal() {
            Some(place) => unused_goal(&self.stated_goal, place),
            None => goal_remarks(&self.arguments.goal, &self.stated_goal),
        }
    }

    fn why_no_goal(&self) -> Option<&'static str> {
        if !self.is_still() {
            Some("frames")
        } else if self.arguments.checkpoint.is_some() {
            Some("a picture with a --checkpoint")
        } else if self.arguments.scene.backend != Backend::Cpu {
            Some("a picture that a --backend draws")
        } else {
            None
        }
    }

    /// Options that take the scene's own goal out, so that settings that were found for it stay.
    pub(super) fn without_goal(&self) -> impl Iterator<Item = String> {
        goal_keys(&self.stated_goal).into_iter().map(|key| format!("--set render.{key}=none"))
    }

    /// The scene's file, or the data files that one was made of.
    pub(super) fn inputs(&self) -> &[PathBuf] {
        &self.arguments.scene.inputs
    }

    /// The frames, or `None` alone for the scene as it is written.
    pub(super) fn frames(&self) -> impl Iterator<Item = Option<u32>> + use<> {
        let still = self.frames.is_none().then_some(None);
        still.into_iter().chain(self.frames.into_iter().flat_map(|[first, last]| first..=last).map(Some))
    }

    /// Whether it is one picture without a number.
    pub(super) fn is_still(&self) -> bool {
        self.frames.is_none()
    }

    /// Checks scenes and outputs of all frames; gives what draws them, from the files that were read.
    pub(super) fn check(&self, files: Files) -> Result<Drawing, Error> {
        let mut targets = Targets::default();
        if self.is_still() {
            targets.add_inputs(&self.still.files());
            self.places(None, |path, replace| targets.add(path, replace))?;
            return Ok(Drawing::Still(files.into()));
        }
        let mut sequence = Sequence::of_files(files);
        for frame in self.frames() {
            let (scene, _) = self.scene(frame, Some(&sequence))?;
            targets.add_inputs(&scene.files());
            sequence.add(&scene);
        }
        for frame in self.frames() {
            self.places(frame, |path, replace| targets.add(path, replace))?;
        }
        for path in &self.films {
            targets.add(path, self.arguments.force)?;
        }
        Ok(Drawing::Frames(Box::new(sequence)))
    }

    /// The films, without frames yet.
    pub(super) fn films(&self) -> Result<Vec<film::Film>, Error> {
        let film = |path: &PathBuf| {
            Ok(film::Film::new(Target::new(path, self.arguments.force)?, self.arguments.fps.unwrap_or(DEFAULT_FPS)))
        };
        self.films.iter().map(film).collect()
    }

    /// What a picture tells of its scene: the text, and in TOML the options that have changed it as comments.
    pub(super) fn told(&self, frame: Option<u32>) -> Result<String, Error> {
        let mut text = String::from_utf8_lossy(&self.given.bytes).into_owned();
        if self.has_comments() {
            let changes = overrides(&self.arguments.scene, self.given.is_made)?;
            let changes = changes.iter().map(|change| change.flag().to_owned());
            let turntable = self.arguments.turntable.map(|count| format!("--turntable {count}"));
            let frame = frame.map(|frame| format!("--frames={frame}"));
            changes.chain(turntable).chain(frame).for_each(|option| text += &format!("\n# {option}"));
        }
        Ok(text)
    }

    /// Whether the scene's text may have comments: JSON has none.
    pub(super) fn has_comments(&self) -> bool {
        self.given.file.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("json"))
    }

    /// The scene at a frame, and the camera that was placed for it from the files of a sequence.
    pub(super) fn scene(
        &self,
        frame: Option<u32>,
        sequence: Option<&Sequence>,
    ) -> Result<(Cow<'_, Scene>, Option<FoundCamera>), Error> {
        let scene = match frame {
            Some(_) => parsed(self.arguments, &self.given, frame)?,
            None => return Ok((Cow::Borrowed(&self.still), None)),
        };
        let Some(sequence) = sequence else { return Ok((Cow::Owned(scene), None)) };
        let options = render_options(&self.arguments.scene);
        let context = Context { files: sequence.files(), options: &options, progress: &Progress::new() };
        let (fitted, found) = organza::fitted(&scene, context)?;
        Ok((Cow::Owned(fitted.into_owned()), found))
    }

    /// Where the picture of a frame goes, each place made by `target` of a path and whether a file there may be replaced.
    pub(super) fn places(
        &self,
        frame: Option<u32>,
        mut target: impl FnMut(&Path, bool) -> Result<Target, output::Error>,
    ) -> Result<Places, Error> {
        let last = self.frames.map_or(0, |[_, last]| last);
        let name = |path: &PathBuf| frame.map_or(path.clone(), |frame| numbered(path, frame, digits(last)));
        let RenderArguments { cost, checkpoint, force, .. } = self.arguments;
        Ok(Places {
            outputs: self.outputs.iter().map(|path| target(&name(path), *force)).collect::<Result<_, _>>()?,
            cost: cost.as_ref().map(|path| target(&name(path), *force)).transpose()?,
            // One that is there is gone on from; the library refuses a file that is something else.
            checkpoint: checkpoint.as_ref().map(|path| target(&name(path), true)).transpose()?,
        })
    }
}

/// The scene with the options of the command line, and with the layer that files without a background are made with.
fn parsed(arguments: &RenderArguments, given: &Given, frame: Option<u32>) -> Result<Scene, Error> {
    let goal = goal_overrides(&arguments.goal)?;
    check_sets(&[overrides(&arguments.scene, given.is_made)?, goal.clone()].concat())?;
    let mut scene = parse_changed(&arguments.scene, given, frame, arguments.turntable, goal)?;
    let has_all = !arguments.transparent || scene.render.layers.add("background");
    has_all.then_some(scene).ok_or_else(|| Error::Internal("there is no layer of the background".into()))
}

/// What draws the pictures of a run.
pub(super) enum Drawing {
    /// One picture, from files of which some were read.
    Still(Box<Files>),
    /// Frames, of which each takes from the others what it can.
    Frames(Box<Sequence>),
}

impl Drawing {
    /// Draws one picture that keeps to a goal.
    pub(super) fn render_within(
        &mut self,
        scene: &Scene,
        goal: &Goal,
        options: &RenderOptions,
        progress: &Progress,
    ) -> Result<WithinGoal, Error> {
        match self {
            Self::Still(files) => organza::render_within(scene, goal, options, progress, std::mem::take(&mut **files)),
            Self::Frames(_) => Err(Error::Internal("frames have no goal".into())),
        }
    }

    /// What frames take from each other.
    pub(super) fn sequence(&self) -> Option<&Sequence> {
        match self {
            Self::Still(_) => None,
            Self::Frames(sequence) => Some(sequence),
        }
    }

    /// Draws one picture.
    pub(super) fn render(
        &mut self,
        scene: &Scene,
        options: &RenderOptions,
        progress: &Progress,
    ) -> Result<Render, Error> {
        match self {
            Self::Still(files) => organza::render_from(scene, options, progress, std::mem::take(&mut **files)),
            Self::Frames(sequence) => sequence.render(scene, options, progress),
        }
    }
}

fn range(frames: Frames, still: &Scene) -> Result<[u32; 2], Error> {
    let Some(count) = still.frames else {
        let message = format!("--frames: {} has no animation", printable(&still.file));
        return Err(Error::usage(message, "add the table [animation], see docs/scene.md"));
    };
    let [first, last] = match frames {
        Frames::All => [0, count - 1],
        Frames::Range(first, last) => [first, last],
    };
    if last >= count {
        let message = format!("--frames={first}-{last}: the frames of this scene are 0 to {}", count - 1);
        return Err(Error::usage(message, ""));
    }
    Ok([first, last])
}

fn digits(last: u32) -> usize {
    DIGITS.max(last.to_string().len())
}

/// `picture.exr` → `picture.0007.exr`.
fn numbered(path: &Path, frame: u32, digits: usize) -> PathBuf {
    let number = format!("{frame:0digits$}");
    match path.extension() {
        Some(extension) => path.with_extension(number).with_added_extension(extension),
        None => path.with_added_extension(number),
    }
}

/// The outputs, none twice; if none was named the scene's name with `.png`, or `.exr` where that alone holds what is asked for.
fn outputs(arguments: &RenderArguments) -> Result<Vec<PathBuf>, Error> {
    let mut outputs = arguments.output.clone();
    if outputs.is_empty() {
        let name = arguments.scene.inputs.first().and_then(|path| path.file_name()).unwrap_or("picture".as_ref());
        let name = Path::new(name);
        let name = if name.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz")) {
            name.with_extension("")
        } else {
            name.to_owned()
        };
        let extension = if arguments.scene.layers.is_some() || arguments.half { "exr" } else { "png" };
        outputs.push(Path::new(name.file_stem().unwrap_or("picture".as_ref())).with_added_extension(extension));
    }
    let of_png = [Flag { name: "--deep", is_given: arguments.deep }];
    refuse_options_of(&[Format::Png], &of_png, &outputs)?;
    let of_displayed = [Flag { name: "--legend", is_given: arguments.legend }];
    refuse_options_of(&[Format::Png, Format::Jpeg, Format::WebP], &of_displayed, &outputs)?;
    let of_opacity = [Flag { name: "--transparent", is_given: arguments.transparent }];
    refuse_options_of(&[Format::Png, Format::Exr, Format::WebP], &of_opacity, &outputs)?;
    let of_exr = [
        Flag { name: "--layers", is_given: arguments.scene.layers.is_some() },
        Flag { name: "--half", is_given: arguments.half },
    ];
    refuse_options_of(&[Format::Exr], &of_exr, &outputs)?;
    let film = outputs.iter().find(|path| film::is_film(path));
    if let Some(film) = film
        && arguments.frames.is_none()
        && arguments.turntable.is_none()
    {
        let message = format!("{}: a film has frames, and one picture is asked for", printable(film));
        return Err(Error::usage(message, "add --turntable N, or --frames for a scene with an animation"));
    }
    if let (Some(film), true) = (film, arguments.transparent) {
        let message = format!("{}: a film has no opacity", printable(film));
        return Err(Error::usage(message, "leave --transparent out, or write numbered PNG files"));
    }
    if film.is_none() && arguments.fps.is_some() {
        return Err(Error::usage("--fps is for films, and no output is one", "add -o NAME.mp4"));
    }
    for (i, path) in outputs.iter().enumerate() {
        if !film::is_film(path) {
            Format::of_path(path)?;
        }
        let others = [&arguments.cost, &arguments.checkpoint];
        if outputs[..i].contains(path) || others.iter().any(|other| other.as_ref() == Some(path)) {
            return Err(Error::usage(format!("{}: this output is named twice", printable(path)), ""));
        }
    }
    Ok(outputs)
}

/// Refuses options of some formats where no output has one of these: they would change nothing.
fn refuse_options_of(formats: &[Format], options: &[Flag], outputs: &[PathBuf]) -> Result<(), Error> {
    // Frames of a film are displayed pictures, as those of a JPEG file are.
    let format_of = |path: &PathBuf| if film::is_film(path) { Ok(Format::Jpeg) } else { Format::of_path(path) };
    let has_format = |path: &PathBuf| format_of(path).is_ok_and(|found| formats.contains(&found));
    let given = options.iter().find(|option| option.is_given).filter(|_| !outputs.iter().any(has_format));
    let Some(Flag { name, .. }) = given else { return Ok(()) };
    let name_of = |format: &Format| match format {
        Format::Png => "PNG",
        Format::Exr => "EXR",
        Format::Jpeg => "JPEG",
        Format::WebP => "WebP",
    };
    let kinds: Vec<&str> = formats.iter().map(name_of).collect();
    let kinds_text = match kinds.split_last() {
        Some((last, [])) => (*last).to_owned(),
        Some((last, before)) => format!("{} and {last}", before.join(", ")),
        None => String::new(),
    };
    let hint = format!("add -o NAME.{}", kinds[0].to_ascii_lowercase());
    Err(Error::usage(format!("{name} is for {kinds_text} files, and no output is one"), hint))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_a_number_before_the_extension() {
        assert_eq!(numbered("a/b.exr".as_ref(), 7, 4), Path::new("a/b.0007.exr"));
        assert_eq!(numbered("a.b.png".as_ref(), 12345, 5), Path::new("a.b.12345.png"));
        assert_eq!(numbered("sums".as_ref(), 0, 4), Path::new("sums.0000"));
    }
}
