//! Frames as one film, by the program ffmpeg: pixels go to it as they are drawn, and the file appears whole or not at all.

use crate::console;
use organza::output::Target;
use organza::{Error, printable};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::TempDir;

/// The program.
const PROGRAM: &str = "ffmpeg";
/// Bytes of what the program says of a failure that are repeated.
const MOST_SAID: usize = 300;

/// A kind of film, by its extension.
struct Kind {
    extension: &'static str,
    /// Options of the program that say how pictures are stored.
    stored: &'static [&'static str],
}

/// Colours as those of the displayed picture: the matrix is that of high definition, and sides are even, as the codecs need them.
const YUV: &str = "scale=out_color_matrix=bt709:out_range=tv,pad=ceil(iw/2)*2:ceil(ih/2)*2,format=yuv420p";

const KINDS: [Kind; 3] = [
    Kind {
        extension: "mp4",
        stored: &[
            "-vf",
            YUV,
            "-c:v",
            "libx264",
            "-crf",
            "18",
            "-colorspace",
            "bt709",
            "-color_primaries",
            "bt709",
            "-color_trc",
            "bt709",
            "-movflags",
            "+faststart",
        ],
    },
    Kind {
        extension: "webm",
        stored: &[
            "-vf",
            YUV,
            "-c:v",
            "libvpx-vp9",
            "-crf",
            "24",
            "-b:v",
            "0",
            "-colorspace",
            "bt709",
            "-color_primaries",
            "bt709",
            "-color_trc",
            "bt709",
        ],
    },
    // The best 256 colours of all frames.
    Kind { extension: "gif", stored: &["-vf", "split[a][b];[a]palettegen[p];[b][p]paletteuse", "-loop", "0"] },
];

fn kind(path: &Path) -> Option<&'static Kind> {
    let extension = path.extension()?;
    KINDS.iter().find(|kind| extension.eq_ignore_ascii_case(kind.extension))
}

/// Whether an output is a film, by its extension.
pub(super) fn is_film(path: &Path) -> bool {
    kind(path).is_some()
}

/// Refuses films where the program is not there.
pub(super) fn check_program(film: &Path) -> Result<(), Error> {
    let mut tried = Command::new(PROGRAM);
    tried.arg("-version").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    if tried.status().is_ok_and(|status| status.success()) {
        return Ok(());
    }
    let message = format!("{}: a film is written by the program {PROGRAM}, which is not on the PATH", printable(film));
    Err(Error::usage(message, "install it, or write numbered pictures: -o NAME.png"))
}

/// A film that is being written.
pub(super) struct Film {
    target: Target,
    /// Frames of a second.
    rate: u32,
    frames: u64,
    started: Option<Started>,
}

/// The program at work.
struct Started {
    size: [u32; 2],
    child: Child,
    /// Taken at the end, which tells the program of it.
    pixels: Option<ChildStdin>,
    /// Where the file and what the program says lie.
    folder: TempDir,
}

/// A film that was written.
pub(super) struct Written {
    pub(super) path: PathBuf,
    pub(super) frames: u64,
    pub(super) bytes: u64,
}

impl Film {
    /// A film without frames.
    pub(super) fn new(target: Target, rate: u32) -> Self {
        Self { target, rate, frames: 0, started: None }
    }

    /// Appends a picture, red, green and blue of each pixel.
    pub(super) fn add(&mut self, size: [u32; 2], pixels: &[u8]) -> Result<(), Error> {
        let path = self.target.path().to_owned();
        if self.started.is_none() {
            self.started = Some(Started::new(&path, size, self.rate)?);
        }
        let Some(started) = &mut self.started else { return Ok(()) };
        if started.size != size {
            let [width, height] = started.size;
            let [found, tall] = size;
            let message =
                format!("{}: frames of a film have one size: {width}x{height}, found {found}x{tall}", printable(&path));
            return Err(Error::usage(message, "let no track change `camera.size`, or write numbered pictures"));
        }
        let written = started.pixels.as_mut().map(|pipe| pipe.write_all(pixels));
        if written.is_some_and(|written| written.is_err()) {
            // The program has ended: its own words say why.
            let _ = started.child.wait();
            return Err(started.failure(&path));
        }
        self.frames += 1;
        Ok(())
    }

    /// Waits for the program and gives the file its name.
    pub(super) fn finish(mut self) -> Result<Option<Written>, Error> {
        let Some(mut started) = self.started.take() else { return Ok(None) };
        drop(started.pixels.take());
        let path = self.target.path().to_owned();
        let status = started.child.wait().map_err(|e| Error::io(&path, "cannot wait for ffmpeg", e))?;
        if !status.success() {
            return Err(started.failure(&path));
        }
        let made = started.folder.path().join(MADE);
        let bytes = std::fs::read(&made).map_err(|e| Error::io(&path, "cannot read what ffmpeg wrote", e))?;
        self.target.write(&bytes)?;
        Ok(Some(Written { path, frames: self.frames, bytes: bytes.len() as u64 }))
    }
}

/// Names in the folder of a film.
const MADE: &str = "film";
const SAID: &str = "said";

impl Started {
    fn new(path: &Path, size: [u32; 2], rate: u32) -> Result<Self, Error> {
        let fail = |e| Error::io(path, "cannot start ffmpeg", e);
        let kind = kind(path).ok_or_else(|| Error::Internal("a film without a kind".into()))?;
        let folder = tempfile::Builder::new().prefix(".organza-film-").tempdir().map_err(fail)?;
        let said = std::fs::File::create(folder.path().join(SAID)).map_err(fail)?;
        let mut command = Command::new(PROGRAM);
        command.args([
            "-nostdin",
            "-hide_banner",
            "-loglevel",
            "error",
            "-y",
            "-f",
            "rawvideo",
            "-pixel_format",
            "rgb24",
        ]);
        command.args([
            "-video_size",
            &format!("{}x{}", size[0], size[1]),
            "-framerate",
            &rate.to_string(),
            "-i",
            "pipe:0",
        ]);
        // No date and no version of the program: the same frames give the same bytes.
        command.args(kind.stored).args(["-fflags", "+bitexact", "-flags:v", "+bitexact", "-f", kind.extension]);
        command.arg(folder.path().join(MADE));
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(said);
        // An interrupt of the terminal is ours to pass on.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut at_work = at_work();
        let mut child = command.spawn().map_err(fail)?;
        at_work.push((child.id(), folder.path().to_owned()));
        drop(at_work);
        Ok(Self { size, pixels: child.stdin.take(), child, folder })
    }

    /// The error of a program that failed, with its own words.
    fn failure(&self, path: &Path) -> Error {
        let said = std::fs::read(self.folder.path().join(SAID)).unwrap_or_default();
        let said: String = String::from_utf8_lossy(&said).chars().take(MOST_SAID).collect();
        let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
        let message = format!("{}: ffmpeg failed: {said}", printable(path));
        Error::usage(message, "write another kind of film, .mp4, .webm or .gif, or numbered pictures: -o NAME.png")
    }
}

/// A film that is not finished is none.
impl Drop for Started {
    fn drop(&mut self) {
        let id = self.child.id();
        let _ = self.child.kill();
        let _ = self.child.wait();
        at_work().retain(|(other, _)| *other != id);
    }
}

/// Programs at work, with their folders.
static AT_WORK: Mutex<Vec<(u32, PathBuf)>> = Mutex::new(Vec::new());

fn at_work() -> MutexGuard<'static, Vec<(u32, PathBuf)>> {
    AT_WORK.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends the programs that are at work and removes what they have written: for a process that ends at once.
pub(crate) fn abandon() {
    let mut at_work = at_work();
    for (id, folder) in at_work.drain(..) {
        #[cfg(unix)]
        if let Ok(id) = i32::try_from(id) {
            let _ = nix::sys::signal::kill(nix::unistd::Pid::from_raw(id), nix::sys::signal::Signal::SIGKILL);
        }
        #[cfg(not(unix))]
        let _ = id;
        let _ = std::fs::remove_dir_all(&folder);
    }
    // Whoever would start another waits for the end.
    std::mem::forget(at_work);
}

/// Says which films were written.
pub(super) fn print(written: &[Written]) -> Result<(), Error> {
    written.iter().try_for_each(|film| {
        console::account(&format!("wrote {} ({} frames, {} bytes)\n", printable(&film.path), film.frames, film.bytes))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn films_are_told_by_their_extension() {
        assert!(is_film("a.mp4".as_ref()) && is_film("b.GIF".as_ref()) && is_film("c.webm".as_ref()));
        assert!(!is_film("a.png".as_ref()) && !is_film("mp4".as_ref()));
    }
}
