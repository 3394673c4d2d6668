//! The sums of a render on disk, so that a render that was stopped goes on in the same bits.
//!
//! The file's tag is a hash of everything that its sums depend on. These are the version of the program; the checked scene without its count of sets,
//! error and exposure; the views that kept sets serve; the treatment of invalid input; and the bytes of every file that the scene reads. The count of
//! sets may therefore be raised later.

use super::Kept;
use crate::output::Target;
use crate::scene::{Goal, RenderSettings, Scene};
use crate::{Error, RenderOptions, printable};
use pbsr::Ensemble;
use sha2::{Digest, Sha256};
use splat_core::{Exceeded, MemoryAccount, Reservation};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Least time between two writes.
const INTERVAL: Duration = Duration::from_secs(2);
/// Time between two writes, in times that the last one took: writing costs no more than a hundredth.
const PATIENCE: u32 = 100;

/// Where sums are kept, and those that were found there.
#[derive(Debug)]
pub(crate) struct Checkpoint {
    target: Target,
    tag: [u8; 32],
    found: Option<Ensemble>,
    written: Instant,
    pause: Duration,
}

impl Checkpoint {
    /// Reads the file if there is one.
    pub(crate) fn open(
        path: &Path,
        scene: &Scene,
        options: &RenderOptions,
        kept: Option<&Kept>,
        memory: &MemoryAccount,
    ) -> Result<Self, Error> {
        // One that is there is replaced by what goes on from it.
        let target = Target::new(path, true)?;
        let tag = tag(scene, options, kept)?;
        let found = read(path, memory)?.map(|(bytes, _held)| Ensemble::from_bytes(&bytes, &tag));
        let found = found.transpose().map_err(|e| foreign(path, &e))?;
        Ok(Self { target, tag, found, written: Instant::now(), pause: INTERVAL })
    }

    /// The sums that were found, once; those of an image of another size or other channels than `empty` are refused. The tag says as
    /// much, but a file that is made up may have the right one.
    pub(super) fn take(&mut self, empty: &Ensemble) -> Result<Option<Ensemble>, Error> {
        let found = self.found.take();
        if found.as_ref().is_some_and(|found| found.size() != empty.size() || found.params() != empty.params()) {
            let error = pbsr::Error::Checkpoint("of an image of another size or other channels".to_owned());
            return Err(foreign(self.target.path(), &error));
        }
        Ok(found)
    }

    /// Writes the sums if the last writing was long enough ago.
    pub(super) fn write_if_due(&mut self, ensemble: &Ensemble) -> Result<(), Error> {
        if self.written.elapsed() < self.pause { Ok(()) } else { self.write(ensemble) }
    }

    /// Writes the sums, whole or not at all.
    pub(super) fn write(&mut self, ensemble: &Ensemble) -> Result<(), Error> {
        let start = Instant::now();
        self.target.write(&ensemble.to_bytes(&self.tag))?;
        self.written = Instant::now();
        self.pause = INTERVAL.max(PATIENCE * start.elapsed());
        Ok(())
    }
}

/// The bytes of the file, for which and for whose sums memory is taken; `None` where there is none.
fn read(path: &Path, memory: &MemoryAccount) -> Result<Option<(Vec<u8>, Reservation)>, Error> {
    let fail = |e| Error::io(path, "cannot read the checkpoint", e);
    let length = match std::fs::metadata(path) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        // A pipe or a device could block or never end.
        Ok(meta) if !meta.is_file() => return Err(fail(io::Error::other("not a regular file"))),
        meta => meta.map_err(fail)?.len(),
    };
    let what = format!("the checkpoint {}", printable(path));
    let held = memory.take(&what, length.saturating_mul(2)).map_err(Error::Limit)?;
    let mut bytes = Vec::new();
    let none_left = |_| {
        let hint = "name another --checkpoint, or use a smaller image".into();
        Error::Limit(Exceeded { what: what.clone().into(), needed: length, limit: None, unit: "bytes", hint })
    };
    bytes.try_reserve_exact(length as usize).map_err(none_left)?;
    File::open(path).and_then(|file| file.take(length).read_to_end(&mut bytes)).map_err(fail)?;
    Ok(Some((bytes, held)))
}

fn foreign(path: &Path, error: &pbsr::Error) -> Error {
    let hint = "name another --checkpoint, or remove this file to begin anew";
    Error::input(printable(path), error.to_string(), hint)
}

fn tag(scene: &Scene, options: &RenderOptions, kept: Option<&Kept>) -> Result<[u8; 32], Error> {
    let mut same = scene.clone();
    (same.file, same.sha256) = (PathBuf::new(), String::new());
    let RenderSettings { particles, exposure, .. } = &mut same.render;
    (particles.repeat_level, particles.target_error, *exposure) = (0, None, 0.0);
    same.render.goal = Goal::default();
    same.technique_keys.clear();
    let mut hasher = Sha256::new();
    hasher.update(env!("CARGO_PKG_VERSION"));
    // Every number is written so that it reads back the same.
    hasher.update(format!("{same:?} {} {}", options.drop_invalid, options.merge_duplicates));
    // Particles that serve many frames are as fine as the finest needs them.
    hasher.update(kept.map(Kept::views).unwrap_or_default());
    hasher.update(scene.digest_of_data()?);
    Ok(hasher.finalize().into())
}
