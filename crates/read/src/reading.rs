//! What goes along while a file is read: its parameters, who may stop it, and what was mended in it.

use super::ReadParams;
#[cfg(feature = "textures")]
use super::meshes::paint::Painting;
use crate::error::{Place, ReadError};
use crate::points::extras::LONGEST_NAME;
use splat_core::text::escaped;
use splat_core::{Association, Progress};
use std::fmt;

/// Most names that are said not to be used: each new one is held against all others, and a file may have millions.
const MOST_NAMES: usize = 512;

/// A fault of a file that does not stop the rest of it from being drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fix {
    /// A face of four corners crosses itself: it is its two triangles.
    CrossingQuad,
    /// A larger face crosses itself: it is what its edges go around.
    CrossingPolygon,
    /// A face crosses itself and has too many corners to find what its edges go around: it is left out.
    CrossingLarge,
    /// A face has fewer than three corners: it is left out.
    TooFewCorners,
    /// Faces name normals, and the file has none: they are computed.
    MissingNormals,
    /// A part of a mesh is wound inside out, or its normals point inwards: it is turned.
    InsideOut,
    /// A few bytes follow the last facet of a binary STL: they are read over.
    TrailingBytes,
    /// The faces of a polyhedron do not close: what lies between them and its middle is drawn.
    OpenPolyhedron,
    /// No point of a polyhedron sees all of its faces: what lies between them and its middle is drawn, which reaches beyond it.
    HiddenFaces,
}

/// All faults of one kind that were mended in a file. Prints as one line: `FILE:LINE: 2 faces …`.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Mended {
    /// The file's name, escaped.
    pub file: String,
    /// What was wrong, and what became of it.
    pub fix: Fix,
    /// How often.
    pub count: u64,
    /// Where the first of them is.
    pub place: Place,
    /// The number of the first face, of polyhedra the cell, as the file's format counts; `None` for what is no fault of a face.
    pub face: Option<u64>,
}

impl fmt::Display for Mended {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, fix, count, place, face } = self;
        write!(f, "{file}{place}: {count} ")?;
        let by = |one: &'static str, many: &'static str| if *count == 1 { one } else { many };
        f.write_str(match fix {
            Fix::CrossingQuad => by(
                "face of four corners crosses itself and is drawn as two triangles",
                "faces of four corners cross themselves and are drawn as two triangles each",
            ),
            Fix::CrossingPolygon => by(
                "face crosses itself and is filled where its edges go around",
                "faces cross themselves and are filled where their edges go around",
            ),
            Fix::CrossingLarge => by(
                "face crosses itself, has too many corners to be mended, and is left out",
                "faces cross themselves, have too many corners to be mended, and are left out",
            ),
            Fix::TooFewCorners => {
                by("face of fewer than three corners is left out", "faces of fewer than three corners are left out")
            }
            Fix::MissingNormals => by(
                "corner names a normal, of which the file has none: normals are computed",
                "corners name normals, of which the file has none: normals are computed",
            ),
            Fix::InsideOut => by("part is inside out and is turned", "parts are inside out and are turned"),
            Fix::TrailingBytes => {
                by("byte after the last facet is read over", "bytes after the last facet are read over")
            }
            Fix::OpenPolyhedron => by(
                "polyhedron has faces that do not close and is drawn as what lies between them and its middle",
                "polyhedra have faces that do not close and are drawn as what lies between them and their middles",
            ),
            Fix::HiddenFaces => by(
                "polyhedron has faces that no point inside sees all of and is drawn larger than it is",
                "polyhedra have faces that no point inside sees all of and are drawn larger than they are",
            ),
        })?;
        let face_or_cell = match fix {
            Fix::OpenPolyhedron | Fix::HiddenFaces => "cell",
            _ => "face",
        };
        match face {
            Some(face) if *count > 1 => write!(f, " (the first is {face_or_cell} {face})"),
            Some(face) => write!(f, " ({face_or_cell} {face})"),
            None => Ok(()),
        }
    }
}

/// A column of points or of a mesh that has no meaning of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedColumn {
    /// Its name in the file, by which [`super::ReadParams::columns`] asks for it.
    pub name: String,
    /// Its least and greatest finite number, where they were looked at.
    pub range: Option<[f64; 2]>,
    /// What its numbers belong to, of a mesh; `None` for one of points.
    pub association: Option<Association>,
}

/// What a reader has to say of a file beside its data.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Notes {
    /// The reader that read it, by the name of its format.
    pub format: String,
    /// Columns, fields and statements of the file that are not used, as the file names them.
    pub unused: Vec<String>,
    /// Columns of points or of a mesh that have no meaning of their own, kept or not.
    pub columns: Vec<NamedColumn>,
    /// The unit of its lengths, such as `mm`, where the file or its format states one.
    pub unit: Option<String>,
    /// What was made of the data that its user should know, one sentence without a full stop each.
    pub remarks: Vec<String>,
    /// Data that a picture will show changed, one sentence without a full stop each: more than a remark.
    pub warnings: Vec<String>,
    /// Repairs of the file, an entry for each kind of fault.
    pub mended: Vec<Mended>,
    /// The value of a volume outside of the cells that it was sampled from; `None` where its voxels are those of the file.
    pub value_outside: Option<f64>,
    /// The column of a mesh that a VTK file shows: that of its active attribute, or the first field of cells that enclose a volume. `None` where the
    /// mesh has colours, and of other files.
    pub shown_column: Option<String>,
}

impl Notes {
    /// Warnings about pictures of the data, one sentence each; `file` is the file's name.
    pub fn picture_warnings<'n>(&'n self, file: &'n str) -> impl Iterator<Item = String> + 'n {
        self.mended.iter().map(Mended::to_string).chain(self.warnings.iter().map(move |said| format!("{file}: {said}")))
    }

    /// All of it but what was mended, one sentence each, for a file of this name that was read; `unused` are columns that were read and
    /// nobody asks for.
    pub fn sentences<'u>(&self, file: &str, unused: impl IntoIterator<Item = &'u str>) -> Vec<String> {
        let unused = unused.into_iter().map(|name| -> &str { name });
        let unused: Vec<&str> = self.unused.iter().map(String::as_str).chain(unused).collect();
        let unused = (!unused.is_empty()).then(|| format!("{file}: not used: {}", unused.join(", ")));
        self.remarks.iter().map(|remark| format!("{file}: {remark}")).chain(unused).collect()
    }

    /// Adds a remark, once.
    pub(crate) fn remark(&mut self, remark: impl Into<String>) {
        let remark = remark.into();
        if !self.remarks.contains(&remark) {
            self.remarks.push(remark);
        }
    }

    /// Adds names that are not used, each once, with what would steer a terminal escaped; of very many the first.
    pub(crate) fn not_used<'a>(&mut self, names: impl IntoIterator<Item = &'a [u8]>) {
        for name in names {
            if self.unused.len() > MOST_NAMES {
                return;
            }
            let name = escaped(name, LONGEST_NAME);
            if !self.unused.contains(&name) {
                let is_full = self.unused.len() == MOST_NAMES;
                self.unused.push(if is_full { "further ones".to_owned() } else { name });
            }
        }
    }
}

/// A file that is being read.
pub(crate) struct Reading<'a> {
    pub(crate) params: &'a ReadParams,
    progress: Option<&'a Progress>,
    pub(crate) notes: Notes,
    /// Colours of the mesh that is read, with [`Textures::Kept`].
    #[cfg(feature = "textures")]
    pub(crate) painting: Option<Painting>,
}

/// What becomes of the textures of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Textures {
    /// Triangles are divided until colours of vertices show the textures.
    #[default]
    Divided,
    /// They are kept beside the mesh, see [`super::Loaded::Painted`]. Triangles are divided where opacities vary alone.
    Kept,
    /// Sizes of images are read and no texel. Colours and opacities are those without textures.
    Undecoded,
}

impl<'a> Reading<'a> {
    pub(crate) fn new(params: &'a ReadParams, progress: Option<&'a Progress>) -> Self {
        Self {
            params,
            progress,
            notes: Notes::default(),
            #[cfg(feature = "textures")]
            painting: None,
        }
    }

    /// The same file with other parameters; takes the notes, which are to be given back.
    #[cfg(any(feature = "vti", feature = "tiff", feature = "png"))]
    pub(crate) fn within<'p>(&mut self, params: &'p ReadParams) -> Reading<'p>
    where
        'a: 'p,
    {
        Reading { notes: std::mem::take(&mut self.notes), ..Reading::new(params, self.progress) }
    }

    /// Counts a fault that is mended; with [`ReadParams::strict`] it is the error that it stands for.
    pub(crate) fn mend(
        &mut self,
        fix: Fix,
        place: Place,
        face: Option<u64>,
        error: impl FnOnce() -> ReadError,
    ) -> Result<(), ReadError> {
        if self.params.strict {
            return Err(error());
        }
        match self.notes.mended.iter_mut().find(|m| m.fix == fix) {
            Some(known) => known.count += 1,
            None => self.notes.mended.push(Mended { file: String::new(), fix, count: 1, place, face }),
        }
        Ok(())
    }

    /// What there is to say of the file of this name.
    pub(crate) fn finish(mut self, file: &str) -> Notes {
        self.notes.mended.iter_mut().for_each(|m| file.clone_into(&mut m.file));
        self.notes
    }

    /// Looks whether the reader is to stop.
    pub(crate) fn go_on(&self) -> Result<(), ReadError> {
        if self.progress.is_some_and(Progress::is_cancelled) { Err(ReadError::cancelled()) } else { Ok(()) }
    }
}
