//! What was read from files, shared by all objects and frames that are made from it: a file is read once.

use crate::Error;
use convert::read::{Loaded, Mended, Notes, ReadParams};
use convert::{RawPoints, SharedField};
use splat_core::{DAabb, Grid, Mesh, Progress, RadianceImage};
use std::cell::RefCell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What a file holds.
#[derive(Debug, Clone)]
pub enum FileData {
    /// Triangles.
    Mesh(Arc<Mesh>),
    /// Points without faces.
    Points(Arc<RawPoints>),
    /// A regular volume.
    Grid(Arc<Grid>),
    /// An image of radiance.
    Image(Arc<RadianceImage>),
}

/// The level set of scattered points, and its bounds.
pub(super) type Fitted = (SharedField, DAabb);

/// The files of a scene that were read, so that whoever looked at them before can hand them to [`crate::render_from`].
#[derive(Default)]
pub struct Files {
    /// By path and frame.
    read: RefCell<HashMap<(PathBuf, u64), (ReadParams, FileData)>>,
    /// What there is to say of them, one sentence each.
    notes: RefCell<Vec<String>>,
    /// Fits take longer than reading: with their tolerance and the bytes that they take.
    fitted: RefCell<Vec<(PathBuf, f64, u64, Fitted)>>,
    /// What was mended in them.
    mended: RefCell<Vec<String>>,
}

impl Files {
    /// Reads a file unless it was read with the same limits, and keeps what it holds.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Input`] or [`Error::TooLarge`] as its reader has them.
    pub fn read(&self, path: &Path, limits: &ReadParams, progress: &Progress) -> Result<FileData, Error> {
        if let Some(data) = self.known(path, limits) {
            return Ok(data);
        }
        let data = self.read_anew(path, limits, progress)?;
        self.read.borrow_mut().insert((real(path), limits.frame), (*limits, data.clone()));
        Ok(data)
    }

    /// The same without keeping it: for whoever keeps what is made from it.
    pub(super) fn read_once(&self, path: &Path, limits: &ReadParams, progress: &Progress) -> Result<FileData, Error> {
        self.known(path, limits).map_or_else(|| self.read_anew(path, limits, progress), Ok)
    }

    /// A level set of these points does not use the opacities that they bring.
    pub(super) fn note_level_set(&self, path: &Path) {
        let file = crate::printable(path);
        add(&self.notes, [format!("{file}: `level_set` does not use opacities: it has that of its object")]);
    }

    /// What the files hold that is not drawn, and what was made of them, one sentence each.
    pub(super) fn notes(&self) -> Vec<String> {
        self.notes.borrow().clone()
    }

    /// What was mended in the files, one sentence a kind of fault.
    pub fn mended(&self) -> Vec<String> {
        self.mended.borrow().clone()
    }

    fn read_anew(&self, path: &Path, limits: &ReadParams, progress: &Progress) -> Result<FileData, Error> {
        let read = convert::read::file(path, limits, Some(progress));
        let (data, noted) = read.map_err(|e| Error::from_read(path, &e))?;
        add(&self.mended, noted.mended.iter().map(Mended::to_string));
        add(&self.notes, sentences(path, &data, noted));
        match data {
            Loaded::Mesh(mesh) => Ok(FileData::Mesh(mesh.into())),
            Loaded::Points(points) => Ok(FileData::Points(points.into())),
            Loaded::Grid(grid) => Ok(FileData::Grid(grid.into())),
            Loaded::Image(image) => Ok(FileData::Image(image.into())),
            _ => Err(Error::Internal("a kind of file that scenes do not know".into())),
        }
    }

    fn known(&self, path: &Path, limits: &ReadParams) -> Option<FileData> {
        let read = self.read.borrow();
        read.get(&(real(path), limits.frame)).filter(|(with, _)| with == limits).map(|(_, data)| data.clone())
    }

    /// The level set of a file's points unless it was fitted with the same tolerance; `fit` also says how many bytes it takes.
    pub(super) fn fitted(
        &self,
        path: &Path,
        tolerance: f64,
        fit: impl FnOnce() -> Result<(Fitted, u64), Error>,
    ) -> Result<Fitted, Error> {
        let known =
            |(p, t, _, fitted): &(PathBuf, f64, u64, Fitted)| (p == path && *t == tolerance).then(|| fitted.clone());
        if let Some(fitted) = self.fitted.borrow().iter().find_map(known) {
            return Ok(fitted);
        }
        let (fitted, bytes) = fit()?;
        self.fitted.borrow_mut().push((path.to_owned(), tolerance, bytes, fitted.clone()));
        Ok(fitted)
    }

    /// Bytes that it holds.
    pub(crate) fn bytes(&self) -> u64 {
        let read: u64 = self.read.borrow().values().map(|(_, data)| data.bytes()).sum();
        read + self.fitted.borrow().iter().map(|(_, _, bytes, _)| bytes).sum::<u64>()
    }
}

/// A file under the one name that the system knows it by, whichever way it was named.
fn real(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

/// What a picture does not show of a file, and what its reader made of it.
fn sentences(path: &Path, data: &Loaded, Notes { mut unused, remarks, .. }: Notes) -> Vec<String> {
    let file = crate::printable(path);
    if let Loaded::Points(points) = data {
        // Read, but no key of a scene asks for them.
        let columns = [("value", points.value.is_empty()), ("classification", points.classification.is_empty())];
        unused.extend(columns.iter().filter(|(_, empty)| !empty).map(|(name, _)| (*name).to_owned()));
    }
    let mut all: Vec<String> = remarks.iter().map(|remark| format!("{file}: {remark}")).collect();
    if !unused.is_empty() {
        all.push(format!("{file}: columns not used: {}", unused.join(", ")));
    }
    all
}

/// Adds what is not said yet.
fn add(all: &RefCell<Vec<String>>, sentences: impl IntoIterator<Item = String>) {
    let mut all = all.borrow_mut();
    for sentence in sentences {
        if !all.contains(&sentence) {
            all.push(sentence);
        }
    }
}

impl FileData {
    fn bytes(&self) -> u64 {
        match self {
            Self::Mesh(mesh) => mesh.bytes(),
            Self::Points(points) => points.bytes(),
            Self::Grid(grid) => grid.bytes(),
            Self::Image(image) => image.bytes(),
        }
    }
}
