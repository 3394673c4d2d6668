//! Cache of the files' data, shared by all objects and frames: a file is read once.

use super::previews::Converted;
use crate::scene::{ExtractSource, Scene, SourceData, Stop};
use crate::{Error, RenderOptions};
use convert::ColorScale;
use field::SharedField;
use read::{Loaded, Notes, ReadParams};
use splat_core::{DAabb, Grid, MemoryAccount, Mesh, Progress, RawPoints, Reservation};
use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Weak};
use std::time::Instant;

/// What was read of a file, what there is to say of it, and the memory that it takes as long as anybody has it from here.
type Read = (SourceData, Notes, Arc<Reservation>);

/// The level set of scattered points, and its bounds.
pub(super) type Fitted = (SharedField, DAabb);

/// A volume of fewer voxels, and its memory.
#[derive(Clone)]
pub(super) struct Blocks {
    pub(super) grid: Arc<Grid>,
    /// It is given back with the volume.
    pub(super) _held: Arc<Reservation>,
}

/// The volume and the choices that [`Blocks`] are made of.
#[derive(Clone)]
struct MadeOfGrid {
    whole: Weak<Grid>,
    /// The value that stands for none, in bits.
    nodata: Option<u32>,
    block: usize,
}

/// What was made, beside what it was made of.
type Made<K, V> = RefCell<Vec<(K, V)>>;

/// The files of a scene that were read, so that whoever looked at them before can hand them to [`crate::render_from`]. A clone
/// shares what was read so far, and its memory.
#[derive(Clone)]
pub struct Files {
    /// Memory that files take, while they are read and as long as they are kept.
    memory: MemoryAccount,
    /// By path and frame.
    read: RefCell<HashMap<(PathBuf, u64), (ReadParams, Read)>>,
    /// Data that a program has in memory, beside what drawing takes of it.
    taken: RefCell<Vec<(SourceData, Read)>>,
    /// Seconds that reading took since a cost record took them.
    seconds: Cell<f64>,
    /// What there is to say of them, one sentence each.
    notes: RefCell<Vec<String>>,
    /// Fits take longer than reading: by path and tolerance, with the bytes that they take.
    pub(super) fitted: Made<(PathBuf, f64), (Fitted, u64)>,
    /// Until when objects are free on their way in a scene that begins so.
    pub(crate) stopped: Made<(Stop, Arc<Scene>), f64>,
    /// What lights see of parts of the scene.
    pub(crate) seen: Made<(ExtractSource, Scene), Arc<RawPoints>>,
    /// Volumes of which blocks are taken as one voxel, beside what they were made of.
    blocks: RefCell<Vec<(MadeOfGrid, Blocks)>>,
    /// Whether they are read for previews, each of which converts what has changed since the one before.
    are_for_previews: Cell<bool>,
    /// Splats of the last preview.
    converted: RefCell<Option<Arc<Converted>>>,
    /// Most bytes that parts of the scene took while lights looked at them.
    pub(crate) most: Cell<u64>,
    /// Repairs of the files, and warnings about them.
    mended: RefCell<Vec<String>>,
    /// What the colours of the objects that were read last stand for.
    pub(super) scales: RefCell<Vec<ColorScale>>,
}

impl Default for Files {
    /// None yet. How much memory they may take is said with each that is read.
    fn default() -> Self {
        Self {
            memory: MemoryAccount::new(u64::MAX),
            read: RefCell::default(),
            taken: RefCell::default(),
            seconds: Cell::default(),
            notes: RefCell::default(),
            fitted: RefCell::default(),
            stopped: RefCell::default(),
            seen: RefCell::default(),
            blocks: RefCell::default(),
            are_for_previews: Cell::default(),
            converted: RefCell::default(),
            most: Cell::default(),
            mended: RefCell::default(),
            scales: RefCell::default(),
        }
    }
}

impl Files {
    /// The account that all files draw on together, with what a render may take as its limit; for whoever keeps something beside them.
    pub fn memory(&self, options: &RenderOptions) -> MemoryAccount {
        self.memory.up_to(options.max_memory)
    }

    /// Reads a file unless it was read with the same limits, and keeps what it holds.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Input`] or [`Error::TooLarge`] of its reader. A file is also too large if it takes more memory than
    /// `limits` leave beside the cached files.
    pub fn read(&self, path: &Path, limits: &ReadParams, progress: &Progress) -> Result<SourceData, Error> {
        let read = self.known_or_read(path, limits, progress)?;
        self.read.borrow_mut().insert((real(path), limits.frame), (limits.clone(), read.clone()));
        Ok(read.0)
    }

    /// The data of a source of a scene: what a program has in memory under that name, or [`Files::read`] of a file.
    ///
    /// # Errors
    /// As [`Files::read`].
    pub fn data(
        &self,
        scene: &Scene,
        source: &Path,
        limits: &ReadParams,
        progress: &Progress,
    ) -> Result<SourceData, Error> {
        match scene.in_memory.get(source) {
            Some(data) => self.taken(source, data, limits).map(|read| read.0),
            None => self.read(source, limits, progress),
        }
    }

    /// The data of a source of a scene where they are at hand, of a series those of one frame: nothing is read.
    pub fn kept(&self, scene: &Scene, source: &Path, frame: u64) -> Option<SourceData> {
        if let Some(data) = scene.in_memory.get(source) {
            return Some(data.clone());
        }
        self.read.borrow().get(&(real(source), frame)).map(|(_, read)| read.0.clone())
    }

    /// The names of numbers that points or a mesh can be coloured by, where they are at hand; none of other data. Nothing is read.
    pub fn columns(&self, scene: &Scene, source: &Path, frame: u64) -> Vec<String> {
        let read = self.read.borrow();
        let of_file = read.get(&(real(source), frame)).map(|(_, (data, notes, _))| (data, notes.columns.as_slice()));
        let in_memory = scene.in_memory.get(source).map(|data| (data, &[][..]));
        let Some((data, of_notes)) = in_memory.or(of_file) else { return Vec::new() };
        let of_data: Vec<&str> = match data {
            SourceData::Points(points) if points.gaussians.is_empty() => points.column_names().collect(),
            SourceData::Mesh(mesh) | SourceData::Painted(mesh, _) => mesh.column_names().collect(),
            _ => return Vec::new(),
        };
        // Of those that the file has beside these, no scene has asked for all.
        let others = of_notes.iter().map(|column| column.name.as_str()).filter(|name| !of_data.contains(name));
        others.chain(of_data.iter().copied()).map(str::to_owned).collect()
    }

    /// The value of a volume that was read outside of the cells that it was sampled from; `None` where its voxels are those of the file, and of what was
    /// not read.
    pub fn value_outside(&self, path: &Path) -> Option<f64> {
        let read = self.read.borrow();
        let of_first_frame = read.get(&(real(path), 0));
        of_first_frame.and_then(|(_, (_, notes, _))| notes.value_outside)
    }

    /// The column of a mesh that its file shows, see [`read::Notes::shown_column`]; `None` of what was not read.
    pub fn shown_column(&self, path: &Path) -> Option<String> {
        let read = self.read.borrow();
        let of_first_frame = read.get(&(real(path), 0));
        of_first_frame.and_then(|(_, (_, notes, _))| notes.shown_column.clone())
    }

    /// The names of the columns that a file has and that have no meaning of their own; none of what was not read.
    pub fn named_columns(&self, path: &Path) -> Vec<String> {
        let read = self.read.borrow();
        let of_first_frame = read.get(&(real(path), 0));
        let names = |notes: &Notes| notes.columns.iter().map(|column| column.name.clone()).collect();
        of_first_frame.map(|(_, (_, notes, _))| names(notes)).unwrap_or_default()
    }

    /// The same without keeping a file: for whoever keeps what is made from it.
    pub(super) fn data_once(
        &self,
        scene: &Scene,
        source: &Path,
        limits: &ReadParams,
        progress: &Progress,
    ) -> Result<(SourceData, Arc<Reservation>), Error> {
        let read = match scene.in_memory.get(source) {
            Some(data) => self.taken(source, data, limits),
            None => self.known_or_read(source, limits, progress),
        };
        read.map(|read| (read.0, read.2))
    }

    /// Data of a program as drawing takes it, with what there is to say of it. A mesh is copied once, as its faces are turned outwards and parted at
    /// creases; all else is taken where it lies.
    fn taken(&self, source: &Path, data: &SourceData, limits: &ReadParams) -> Result<Read, Error> {
        let name = crate::printable(source);
        if limits.frame > 0 || limits.array.is_some() || limits.voxel_size.is_some() {
            let message = "expected no `frame`, no `array` and no `voxel_size`: data in memory is one, and has its own";
            return Err(Error::input(name, message, "leave them out, or hand over what they name"));
        }
        let from_read = |e: read::ReadError| Error::from_read(source, &e);
        let notes = match data {
            SourceData::Points(points) => read::points_in_memory(&name, points, limits).map_err(from_read)?,
            SourceData::Grid(grid) => read::grid_in_memory(&name, grid, limits).map_err(from_read)?,
            SourceData::Mesh(mesh) | SourceData::Painted(mesh, _) => {
                read::mesh_columns_in_memory(&name, mesh, limits).map_err(from_read)?
            }
            SourceData::Image(_) => Notes::default(),
        };
        let known = self.taken.borrow().iter().find(|(known, _)| known.is_same(data)).map(|(_, read)| read.clone());
        let (taken, made, held) = match known {
            Some(known) => known,
            None => {
                let read = self.made_of(source, data, limits)?;
                self.taken.borrow_mut().push((data.clone(), read.clone()));
                read
            }
        };
        add(&self.mended, made.picture_warnings(&name));
        let points = if let SourceData::Points(points) = data { Some(points) } else { None };
        let unused = points.into_iter().flat_map(|points| points.not_asked_for(&limits.columns));
        add(&self.notes, notes.sentences(&name, unused));
        Ok((taken, notes, held))
    }

    /// What drawing takes of data of a program, with its memory.
    fn made_of(&self, source: &Path, data: &SourceData, limits: &ReadParams) -> Result<Read, Error> {
        let name = crate::printable(source);
        let memory = self.memory.up_to(limits.memory.limit());
        let (SourceData::Mesh(mesh) | SourceData::Painted(mesh, _)) = data else {
            let held = memory.take(&name, data.bytes()).map_err(Error::Limit)?;
            return Ok((data.clone(), Notes::default(), held.into()));
        };
        let mut held = memory.take(&name, 2 * mesh.bytes()).map_err(Error::Limit)?;
        let params = ReadParams { memory: memory.clone(), ..limits.clone() };
        let turned = read::mesh_in_memory(&name, Mesh::clone(mesh), &params);
        let (mut mesh, notes) = turned.map_err(|e| Error::from_read(source, &e))?;
        let _parted = memory.take(&name, splat_core::crease_bytes(&mesh)).map_err(Error::Limit)?;
        splat_core::part_at_creases(&mut mesh);
        held.set(&name, data.bytes() + mesh.bytes()).map_err(Error::Limit)?;
        let made = match data {
            SourceData::Painted(_, painting) => SourceData::Painted(mesh.into(), painting.clone()),
            _ => SourceData::Mesh(mesh.into()),
        };
        Ok((made, notes, held.into()))
    }

    /// Drops the notes about files, for callers that inspected the files before a scene uses them.
    pub fn forget_notes(&self) {
        self.notes.borrow_mut().clear();
    }

    /// Adds a note about a file, beside those of its reader.
    pub(crate) fn note(&self, path: &Path, said: impl IntoIterator<Item = impl std::fmt::Display>) {
        add(&self.notes, said.into_iter().map(|said| format!("{}: {said}", crate::printable(path))));
    }

    /// Adds a warning about a file, beside the repairs that its reader reports.
    pub(super) fn warn(&self, path: &Path, said: impl IntoIterator<Item = impl std::fmt::Display>) {
        add(&self.mended, said.into_iter().map(|said| format!("{}: {said}", crate::printable(path))));
    }

    /// Data of the files that is not drawn, and conversions of the data, one sentence each.
    pub fn notes(&self) -> Vec<String> {
        self.notes.borrow().clone()
    }

    /// Repairs of the files, and data that a picture shows changed, one sentence each.
    pub fn mended(&self) -> Vec<String> {
        self.mended.borrow().clone()
    }

    fn known_or_read(&self, path: &Path, limits: &ReadParams, progress: &Progress) -> Result<Read, Error> {
        let known = self.read.borrow().get(&(real(path), limits.frame)).filter(|k| k.0.serves(limits)).cloned();
        let read = known.map_or_else(|| self.read_anew(path, limits, progress), |(_, read)| Ok(read))?;
        let points = if let SourceData::Points(points) = &read.0 { Some(points) } else { None };
        let unused = points.into_iter().flat_map(|points| points.not_asked_for(&limits.columns));
        add(&self.notes, read.1.sentences(&crate::printable(path), unused));
        Ok(read)
    }

    fn read_anew(&self, path: &Path, limits: &ReadParams, progress: &Progress) -> Result<Read, Error> {
        let memory = self.memory.up_to(limits.memory.limit());
        let params = ReadParams { memory: memory.clone(), ..limits.clone() };
        let begun = Instant::now();
        let read = read::file(path, &params, Some(progress));
        self.seconds.set(self.seconds.get() + begun.elapsed().as_secs_f64());
        let (data, notes) = read.map_err(|e| Error::from_read(path, &e))?;
        let what = crate::printable(path);
        let mut held = memory.take(&what, data.bytes()).map_err(Error::Limit)?;
        add(&self.mended, notes.picture_warnings(&crate::printable(path)));
        let data = match data {
            Loaded::Mesh(mut mesh) => {
                let _parted = memory.take(&what, splat_core::crease_bytes(&mesh)).map_err(Error::Limit)?;
                splat_core::part_at_creases(&mut mesh);
                SourceData::Mesh(mesh.into())
            }
            // It has normals, and so no creases to be parted at.
            Loaded::Painted(mesh, painting) => SourceData::Painted(mesh.into(), painting.into()),
            Loaded::Points(points) => SourceData::Points(points.into()),
            Loaded::Grid(grid) => SourceData::Grid(grid.into()),
            Loaded::Image(image) => SourceData::Image(image.into()),
            _ => return Err(Error::Internal("a kind of file that scenes do not know".into())),
        };
        held.set(&what, data.bytes()).map_err(Error::Limit)?;
        Ok((data, notes, held.into()))
    }

    /// A volume of which blocks are taken as one voxel, or makes it. Of volumes that nobody has any more those that were made are dropped.
    pub(super) fn blocks(
        &self,
        whole: &Arc<Grid>,
        nodata: Option<f32>,
        block: usize,
        make: impl FnOnce() -> Result<Blocks, Error>,
    ) -> Result<Arc<Grid>, Error> {
        let nodata = nodata.map(f32::to_bits);
        self.blocks.borrow_mut().retain(|(made_of, _)| made_of.whole.strong_count() > 0);
        let is_same = |made: &MadeOfGrid| {
            made.whole.as_ptr() == Arc::as_ptr(whole) && made.nodata == nodata && made.block == block
        };
        if let Some((_, known)) = self.blocks.borrow().iter().find(|(made_of, _)| is_same(made_of)) {
            return Ok(known.grid.clone());
        }
        let made = make()?;
        self.blocks.borrow_mut().push((MadeOfGrid { whole: Arc::downgrade(whole), nodata, block }, made.clone()));
        Ok(made.grid)
    }

    /// The same files for previews or not; nothing is converted for previews yet.
    pub(crate) fn for_previews(self, are_previews: bool) -> Self {
        self.are_for_previews.set(are_previews);
        self.converted.take();
        self
    }

    /// Takes the splats of the last preview.
    pub(super) fn take_converted(&self) -> Option<Arc<Converted>> {
        self.converted.take()
    }

    /// Keeps the splats of a preview, where there are previews.
    pub(super) fn keep_converted(&self, converted: impl FnOnce() -> Converted) {
        if self.are_for_previews.get() {
            self.converted.replace(Some(converted().into()));
        }
    }

    /// Seconds that reading took since this was asked last.
    pub(super) fn take_seconds(&self) -> f64 {
        self.seconds.take()
    }

    /// None any more, on the same account.
    pub(crate) fn emptied(&self) -> Self {
        Self { memory: self.memory.clone(), ..Self::default() }.for_previews(self.are_for_previews.get())
    }

    /// Most bytes that files and images took at a time, while they were read too.
    pub(crate) fn peak(&self) -> u64 {
        self.memory.peak()
    }

    /// Bytes that it holds.
    pub(crate) fn bytes(&self) -> u64 {
        let read: u64 = self.read.borrow().values().map(|(_, read)| read.0.bytes()).sum();
        let seen: u64 = self.seen.borrow().iter().map(|(_, points)| points.bytes()).sum();
        let blocks: u64 = self.blocks.borrow().iter().map(|(_, made)| made.grid.bytes()).sum();
        let converted = self.converted.borrow().as_ref().map_or(0, |converted| converted.cloud.bytes());
        read + seen + blocks + converted + self.fitted.borrow().iter().map(|(_, (_, bytes))| bytes).sum::<u64>()
    }
}

/// What was made of this already, or makes it.
pub(crate) fn once<K: PartialEq, V: Clone>(
    made: &Made<K, V>,
    key: K,
    make: impl FnOnce() -> Result<V, Error>,
) -> Result<V, Error> {
    if let Some((_, known)) = made.borrow().iter().find(|(known, _)| *known == key) {
        return Ok(known.clone());
    }
    let value = make()?;
    made.borrow_mut().push((key, value.clone()));
    Ok(value)
}

/// A file under the one name that the system knows it by, whichever way it was named.
fn real(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

/// Adds what is not said yet.
fn add(noted: &RefCell<Vec<String>>, sentences: impl IntoIterator<Item = String>) {
    let mut noted = noted.borrow_mut();
    for sentence in sentences {
        if !noted.contains(&sentence) {
            noted.push(sentence);
        }
    }
}
