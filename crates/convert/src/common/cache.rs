//! Cache of earlier conversions, in a folder: never required, and validated before use.
//!
//! A file is named after the SHA-256 of all inputs of its content, and holds the SHA-256 of the content itself. An entry of
//! another length, another key or a wrong checksum is made again. Files appear whole, under their name, or not at all. If all together
//! exceed the limit, the least recently used files are deleted first. Other files in the folder are not touched.

use bytemuck::Pod;
use sha2::{Digest, Sha256};
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

/// What a file begins with; after it stand the key, the hash of the content, and the content.
const MAGIC: [u8; 16] = *b"organza cache 1\n";

/// Raised with whatever changes what a conversion finds out from the same input.
const REVISION: u32 = 2;

/// End of the names of its files.
const EXTENSION: &str = "organza-cache";

/// Bytes before the content.
const HEAD: usize = MAGIC.len() + 32 + 32;

/// A folder of results of conversions, which later ones of the same input read; see [`crate::SplatParams::cache`].
#[derive(Debug)]
pub struct Cache {
    folder: PathBuf,
    max_bytes: u64,
    said: Mutex<Vec<String>>,
}

/// Two are the same that keep the same in the same folder.
impl PartialEq for Cache {
    fn eq(&self, other: &Self) -> bool {
        (&self.folder, self.max_bytes) == (&other.folder, other.max_bytes)
    }
}

/// All that a result is made from.
#[derive(Clone)]
pub(crate) struct Key(Sha256);

impl Key {
    /// Of a kind of results.
    pub(crate) fn new(kind: &str) -> Self {
        let key = Self(Sha256::new());
        let machine = if cfg!(target_endian = "big") { "big" } else { "little" };
        key.with(kind.as_bytes()).with(env!("CARGO_PKG_VERSION").as_bytes()).with(machine.as_bytes()).with(&[REVISION])
    }

    /// And of these numbers.
    pub(crate) fn with<T: Pod>(mut self, numbers: &[T]) -> Self {
        self.0.update((size_of_val(numbers) as u64).to_le_bytes());
        self.0.update(bytemuck::cast_slice::<T, u8>(numbers));
        self
    }
}

impl Cache {
    /// Of a folder, which is made where it is not there, and whose files may have so many bytes together.
    pub fn new(folder: impl Into<PathBuf>, max_bytes: u64) -> Self {
        Self { folder: folder.into(), max_bytes, said: Mutex::default() }
    }

    /// Reports of the entries that were read and stored, and of failures, one sentence each; a single sentence if the
    /// cache was not used.
    pub fn said(&self) -> Vec<String> {
        let said = self.sentences().clone();
        if said.is_empty() {
            return vec!["the cache is not used: it keeps normals and areas of raw points alone".to_owned()];
        }
        said
    }

    /// Returns the `count` cached values of `key`. On a miss, where the file holds another number of them, or one that is not valid, calls
    /// `make` and stores its result. `what` is the label in messages.
    pub(crate) fn get<T: Pod, E>(
        &self,
        what: &str,
        key: Key,
        count: usize,
        is_valid: fn(&T) -> bool,
        make: impl FnOnce() -> Result<Vec<T>, E>,
    ) -> Result<Vec<T>, E> {
        let key: [u8; 32] = key.0.finalize().into();
        let file = self
            .folder
            .join(key[..16].iter().map(|b| format!("{b:02x}")).collect::<String>())
            .with_extension(EXTENSION);
        let broken = match read(&file, &key, count) {
            // Its hash holds for what is made up, too.
            Ok(Some(numbers)) if !numbers.iter().all(is_valid) => Some("holds what no points have".to_owned()),
            Ok(Some(numbers)) => {
                self.say(format!("{what} were read from {}", shown(&file)));
                return Ok(numbers);
            }
            Ok(None) => None,
            Err(e) => Some(e.to_string()),
        };
        if let Some(broken) = broken {
            self.say(format!("{}: {broken}; {what} are found anew", shown(&file)));
        }
        let made = make()?;
        match self.keep(&file, &key, bytemuck::cast_slice(&made)) {
            Ok(true) => self.say(format!("{what} are kept in {}", shown(&file))),
            Ok(false) => self.say(format!("{what} are more than a cache of {} bytes keeps", self.max_bytes)),
            Err(e) => self.say(format!("{}: {what} cannot be kept here: {e}", shown(&self.folder))),
        }
        Ok(made)
    }

    /// Writes a file, and removes others until all are within the limit; false where it alone is not.
    fn keep(&self, file: &Path, key: &[u8; 32], content: &[u8]) -> io::Result<bool> {
        let bytes = (HEAD + content.len()) as u64;
        if bytes > self.max_bytes {
            return Ok(false);
        }
        fs::create_dir_all(&self.folder)?;
        self.make_room(file, bytes)?;
        // What a run leaves that is killed here is counted, and goes, as the others.
        let mut new = tempfile::Builder::new().suffix(&format!(".{EXTENSION}")).tempfile_in(&self.folder)?;
        for part in [&MAGIC[..], key, Sha256::digest(content).as_slice(), content] {
            new.write_all(part)?;
        }
        new.persist(file)?;
        Ok(true)
    }

    /// Removes files, those first that were not used for longest, until `needed` bytes are free beside `replaced`.
    fn make_room(&self, replaced: &Path, needed: u64) -> io::Result<()> {
        let mut others: Vec<(SystemTime, PathBuf, u64)> = Vec::new();
        for entry in fs::read_dir(&self.folder)? {
            let path = entry?.path();
            if path.extension().is_some_and(|e| e == EXTENSION) && path != replaced {
                let data = fs::metadata(&path)?;
                others.push((data.modified()?, path, data.len()));
            }
        }
        others.sort();
        let mut used: u64 = others.iter().map(|(_, _, bytes)| bytes).sum();
        for (_, path, bytes) in others {
            if used + needed <= self.max_bytes {
                break;
            }
            fs::remove_file(path)?;
            used -= bytes;
        }
        Ok(())
    }

    fn say(&self, sentence: String) {
        self.sentences().push(sentence);
    }

    fn sentences(&self) -> MutexGuard<'_, Vec<String>> {
        self.said.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The `count` numbers of a file; `None` where there is none.
fn read<T: Pod>(file: &Path, key: &[u8; 32], count: usize) -> io::Result<Option<Vec<T>>> {
    let refused = |why: &str| io::Error::new(io::ErrorKind::InvalidData, why.to_owned());
    let length = match fs::metadata(file) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        // Asked before opening: opening a pipe waits for its writer.
        Ok(meta) if !meta.is_file() => return Err(refused("is no regular file")),
        meta => meta?.len(),
    };
    let damaged = || refused("is damaged");
    // As many as the caller makes room for, whatever the file has.
    if length != HEAD as u64 + size_of::<T>() as u64 * count as u64 {
        return Err(damaged());
    }
    let mut opened = File::open(file)?;
    let mut head = [0; HEAD];
    let mut numbers = bytemuck::try_zeroed_vec::<T>(count).map_err(|()| damaged())?;
    opened.read_exact(&mut head)?;
    opened.read_exact(bytemuck::cast_slice_mut(&mut numbers))?;
    let (magic, rest) = head.split_at(MAGIC.len());
    let (stored_key, hash) = rest.split_at(32);
    if magic != MAGIC || stored_key != key || hash != Sha256::digest(bytemuck::cast_slice::<T, u8>(&numbers)).as_slice()
    {
        return Err(damaged());
    }
    // When it was used last; where that cannot be written, it goes sooner.
    let _ = File::options().append(true).open(file).and_then(|f| f.set_modified(SystemTime::now()));
    Ok(Some(numbers))
}

fn shown(path: &Path) -> String {
    splat_core::text::escaped_path(path)
}
