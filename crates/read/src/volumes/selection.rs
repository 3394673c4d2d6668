//! Which of a file's numbers are the volume: one frame of a series, and one number for each voxel.

use super::voxels::Kind;
use crate::error::{Place, ReadError};
use crate::{Notes, ReadParams};

/// Bytes of a name that are shown, and by which it is asked for.
#[cfg(any(feature = "vti", feature = "vtk", feature = "tiff"))]
const LONGEST_NAME: usize = 40;

/// Weights of red, green and blue in the luma of ITU-R BT.709.
const LUMA: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// What of a voxel's numbers, which lie side by side, is its value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Value {
    /// One of them, counted from 0.
    Number(u64),
    /// The luma of the first three, as they are stored: of one grey it is the number that stands for it.
    Luma,
    /// The length of the vector that so many of them are.
    Magnitude(u64),
}

impl Value {
    /// The value of a voxel with these numbers.
    pub(crate) fn evaluate(self, number: impl Fn(usize) -> f64) -> f64 {
        match self {
            Self::Number(i) => number(i as usize),
            Self::Luma => LUMA.iter().enumerate().map(|(i, weight)| weight * number(i)).sum(),
            Self::Magnitude(numbers) => (0..numbers as usize).map(|i| number(i) * number(i)).sum::<f64>().sqrt(),
        }
    }
}

/// Most numbers of a tuple whose length is drawn, or one of which: those of a tensor.
#[cfg(any(feature = "vti", feature = "vtk"))]
const MOST_NUMBERS: u64 = 9;

/// The array that is read.
#[cfg(any(feature = "vti", feature = "vtk"))]
pub(crate) struct Chosen {
    /// Its rank among those that could be.
    pub(crate) rank: usize,
    /// The part of a vector that is the value; `None` for one number a tuple, and for colours.
    pub(crate) value: Option<Value>,
}

/// VTK's name of the array that marks copies and hidden cells, and is no field.
#[cfg(any(feature = "vti", feature = "vtk"))]
pub(crate) const GHOSTS: &str = "vtkGhostType";

/// An array of a file, as far as choosing one needs it.
#[cfg(any(feature = "vti", feature = "vtk"))]
pub(crate) struct Candidate {
    /// Its name, with control characters escaped.
    pub(crate) name: String,
    /// Numbers of a tuple, and their type.
    pub(crate) numbers: u64,
    pub(crate) kind: Option<Kind>,
    /// Whether the file says that it is the one to show: the active scalars, or the active vectors.
    pub(crate) is_named: bool,
    /// Whether it belongs to the cells.
    pub(crate) is_of_cells: bool,
}

/// What stands before the name of an array of the cells, and of one of the points, where both have it.
#[cfg(any(feature = "vti", feature = "vtk"))]
const OF_CELLS: &str = "cell:";
#[cfg(any(feature = "vti", feature = "vtk"))]
const OF_POINTS: &str = "point:";

#[cfg(any(feature = "vti", feature = "vtk"))]
impl Candidate {
    /// Whether it is a field of numbers, or of colours.
    fn is_field(&self) -> bool {
        let is_color = matches!(self.numbers, 3 | 4) && matches!(self.kind, Some(Kind::U8 | Kind::U16));
        self.numbers == 1 || is_color
    }

    /// Whether it is a vector, of which the length or one number can be read.
    fn is_vector(&self) -> bool {
        !self.is_field() && (2..=MOST_NUMBERS).contains(&self.numbers)
    }

    /// The name by which it is asked for where nothing else is said; arrays of cells that have the name of one of points are told by what they belong to.
    fn offered_name(&self, all: &[Self]) -> String {
        let is_shared = self.is_of_cells && all.iter().any(|other| !other.is_of_cells && other.name == self.name);
        let owner = if is_shared { OF_CELLS } else { "" };
        let part = if self.is_vector() { ":magnitude" } else { "" };
        format!("{owner}{}{part}", self.name)
    }

    /// Whether its numbers tell points, cells or pieces apart, or which of them are valid, by its name: `vtkOriginalPointIds`, `GlobalNodeId`,
    /// `cell_ids`, `GLOBAL_IDS_POINTS`.
    fn is_bookkeeping(&self) -> bool {
        const ENDINGS: [&str; 8] = ["Id", "Ids", "ID", "IDs", "_id", "_ids", "_ID", "_IDS"];
        let name = self.name.as_str();
        let is_of_vtk = name.starts_with("vtk") || name.starts_with("GLOBAL_IDS_") || name.starts_with("PEDIGREE_IDS_");
        is_of_vtk || ENDINGS.iter().any(|ending| name.ends_with(ending)) || ["id", "ids"].contains(&name)
    }

    /// The name of the column of a mesh that shows it; `None` of colours.
    fn column_name(&self, all: &[Self]) -> Option<String> {
        if self.numbers > 1 && self.is_field() {
            return None;
        }
        let name = self.offered_name(all);
        Some(name.strip_prefix(OF_CELLS).map_or(name.clone(), |name| format!("face:{name}")))
    }

    /// The length of the vectors, if it has such.
    fn magnitude(&self) -> Option<Value> {
        self.is_vector().then_some(Value::Magnitude(self.numbers))
    }

    /// The value that a name asks for: that of the array of this name, with or without what it belongs to, or of a vector the part behind a colon.
    fn value_named(&self, name: &str) -> Option<Option<Value>> {
        let owner = if self.is_of_cells { OF_CELLS } else { OF_POINTS };
        let name = name.strip_prefix(owner).unwrap_or(name);
        if self.name == name {
            return Some(self.magnitude());
        }
        let part = name.strip_prefix(self.name.as_str())?.strip_prefix(':').filter(|_| self.is_vector())?;
        if part == "magnitude" {
            return Some(self.magnitude());
        }
        let axis = ["x", "y", "z", "w"].iter().position(|axis| *axis == part).filter(|_| self.numbers <= 4);
        let number = axis.map(|axis| axis as u64).or_else(|| part.parse().ok()).filter(|i| *i < self.numbers)?;
        Some(Some(Value::Number(number)))
    }
}

/// The rank of the array that is shown where nobody names one: the active scalars of the file, else its active vectors, else the first array of one
/// number a tuple, or of colours, else the first vector. Arrays of numbers of points and cells come behind all others. `None` without arrays.
#[cfg(any(feature = "vti", feature = "vtk"))]
fn usual(all: &[Candidate]) -> Option<usize> {
    let position = |fits: &dyn Fn(&Candidate) -> bool| all.iter().position(fits);
    let tells = |array: &Candidate| !array.is_bookkeeping();
    position(&|array| tells(array) && array.is_named && !array.is_vector())
        .or_else(|| position(&|array| tells(array) && array.is_named))
        .or_else(|| position(&|array| tells(array) && array.is_field()))
        .or_else(|| position(&|array| tells(array) && array.is_vector()))
        .or_else(|| position(&|array| array.is_named && !array.is_vector()))
        .or_else(|| position(&Candidate::is_field))
        .or_else(|| position(&Candidate::is_vector))
        .or(if all.is_empty() { None } else { Some(0) })
}

/// The name of the column of a mesh that is shown where nobody names one: as of a volume where the mesh is the surface of bodies, else the active
/// attribute of the file alone.
#[cfg(any(feature = "vti", feature = "vtk"))]
pub(crate) fn shown_column(all: &[Candidate], has_bodies: bool) -> Option<String> {
    let shown = &all[usual(all)?];
    if has_bodies || shown.is_named && !shown.is_bookkeeping() { shown.column_name(all) } else { None }
}

/// The array that is the field: the one that `params` name, else the one that the file does, else the first of one number a tuple, or of
/// colours, else the length of the first vector. Says what else could be chosen. `None` without arrays.
#[cfg(any(feature = "vti", feature = "vtk"))]
pub(crate) fn chosen_array(
    all: &[Candidate],
    place: Place,
    params: &ReadParams,
    notes: &mut Notes,
) -> Result<Option<Chosen>, ReadError> {
    let names = |but: usize| {
        let others = || all.iter().enumerate().filter(|(rank, _)| *rank != but).map(|(_, array)| array);
        let fields = others().filter(|array| array.is_field());
        let vectors = others().filter(|array| array.is_vector());
        fields.chain(vectors).map(|array| array.offered_name(all)).collect::<Vec<_>>().join(", ")
    };
    if let Some(name) = &params.array {
        let name = splat_core::text::escaped(name.as_bytes(), LONGEST_NAME);
        let named = |(rank, array): (usize, &Candidate)| array.value_named(&name).map(|value| Chosen { rank, value });
        // A whole name comes before a part of a vector.
        let exact = all.iter().enumerate().filter(|(_, array)| array.name == name).find_map(named);
        let found = exact.or_else(|| all.iter().enumerate().find_map(named));
        if let Some(array) = found.as_ref().map(|found| &all[found.rank]).filter(|array| array.is_vector()) {
            let bare = [OF_CELLS, OF_POINTS].iter().find_map(|owner| name.strip_prefix(owner)).unwrap_or(&name);
            if array.name == bare {
                notes.remark(length_is_drawn(&name));
            }
        }
        return found.map(Some).ok_or_else(|| {
            let expected = format!("an array among {}", names(all.len()));
            ReadError::input(
                place,
                expected,
                format!("'{name}'"),
                "choose one of these, or of a vector U its U:magnitude, U:x, U:y or U:z; `organza info` names all arrays",
            )
        });
    }
    let Some(rank) = usual(all) else { return Ok(None) };
    let shown = all[rank].offered_name(all);
    let others = names(rank);
    if !others.is_empty() {
        notes.remark(format!("the array {shown} is drawn; `array` of a scene or --color-by chooses another: {others}"));
    } else if all[rank].is_vector() {
        let name = &all[rank].name;
        notes.remark(format!("{shown} is drawn, the length of the vectors; --color-by {name}:0 chooses one number"));
    }
    Ok(Some(Chosen { rank, value: all[rank].magnitude() }))
}

/// The channel of a stack of pictures that is read, of so many: the one that `params` name, else the first. Reports what else could be chosen. `names` are
/// those that the file gives them, if it names each.
#[cfg(feature = "tiff")]
pub(crate) fn channel_of(
    channels: u64,
    names: &[String],
    params: &ReadParams,
    notes: &mut Notes,
) -> Result<u64, ReadError> {
    const NAME: &str = "channel";
    let names = if names.len() as u64 == channels { names } else { &[] };
    let shown = |rank: usize| {
        let name = names.get(rank).filter(|name| !name.is_empty());
        let name = name.map_or_else(String::new, |name| {
            format!(" ({})", splat_core::text::escaped(name.as_bytes(), LONGEST_NAME))
        });
        format!("{NAME}{}{name}", rank + 1)
    };
    if names.iter().any(|name| !name.is_empty()) {
        return named_channel(names, &shown, params, notes);
    }
    let Some(name) = &params.array else {
        if channels > 1 {
            let others = match channels {
                2 => format!("{NAME}2"),
                _ => format!("another, {NAME}2 to {NAME}{channels}"),
            };
            notes.remark(format!("{NAME}1 of {channels} is drawn; `array` of a scene or --color-by chooses {others}"));
        }
        return Ok(0);
    };
    let number = name.strip_prefix(NAME).and_then(|number| number.parse::<u64>().ok());
    number.filter(|number| (1..=channels).contains(number)).map(|number| number - 1).ok_or_else(|| {
        let expected = match channels {
            1 => format!("{NAME}1, the only one"),
            _ => format!("a channel from {NAME}1 to {NAME}{channels}"),
        };
        let found = format!("'{}'", splat_core::text::escaped(name.as_bytes(), LONGEST_NAME));
        ReadError::input(Place::File, expected, found, "choose one of these, or leave out `array`")
    })
}

/// One of the channels that a file names: by its name, or as `channelN`.
#[cfg(feature = "tiff")]
fn named_channel(
    names: &[String],
    shown: &dyn Fn(usize) -> String,
    params: &ReadParams,
    notes: &mut Notes,
) -> Result<u64, ReadError> {
    /// Channels up to which each is named.
    const NAMED: usize = 16;
    let listed = |but: Option<usize>| {
        let shown: Vec<String> = (0..names.len()).filter(|rank| Some(*rank) != but).take(NAMED).map(shown).collect();
        let more = names.len() - usize::from(but.is_some()) - shown.len();
        shown.join(", ") + &if more > 0 { format!(" and {more} more") } else { String::new() }
    };
    let Some(asked) = &params.array else {
        if names.len() == 1 {
            return Ok(0);
        }
        let count = names.len();
        notes.remark(format!(
            "{} of {count} is drawn; `array` of a scene or --color-by chooses another by its name: {}",
            shown(0),
            listed(Some(0))
        ));
        return Ok(0);
    };
    let by_number = asked.strip_prefix("channel").and_then(|number| number.parse::<usize>().ok());
    let by_number = by_number.filter(|number| (1..=names.len()).contains(number)).map(|number| number - 1);
    let rank = by_number.or_else(|| names.iter().position(|name| name == asked));
    rank.map(|rank| rank as u64).ok_or_else(|| {
        let found = format!("'{}'", splat_core::text::escaped(asked.as_bytes(), LONGEST_NAME));
        let expected = format!("a channel among {}", listed(None));
        ReadError::input(Place::File, expected, found, "choose one of these, or leave out `array`")
    })
}

/// The remark that a vector is drawn by its length because it is asked for by its name alone.
pub(crate) fn length_is_drawn(name: &str) -> String {
    format!(
        "{name} is a vector: its length is drawn, {name}:magnitude; {name}:x, {name}:y … or {name}:0 … choose one number"
    )
}

/// The part of the stored numbers that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Selection {
    /// Volumes that lie one behind the other.
    pub(crate) frames: u64,
    /// Which of them, from 0.
    pub(crate) frame: u64,
    /// Numbers of a voxel.
    pub(crate) numbers: u64,
    pub(crate) value: Value,
}

impl Selection {
    /// The frame that `params` ask for, of so many volumes one behind the other; 1 where the format has no series. Says which, if there
    /// are several.
    pub(crate) fn of_frames(
        frames: u64,
        place: Place,
        params: &ReadParams,
        notes: &mut Notes,
    ) -> Result<Self, ReadError> {
        let frame = params.frame;
        if frame >= frames {
            let expected = match frames {
                1 => "`frame` 0, as the file has one volume".to_owned(),
                _ => format!("a `frame` from 0 to {}, as the file has {frames} volumes", frames.saturating_sub(1)),
            };
            return Err(ReadError::input(place, expected, format!("`frame` {frame}"), "choose another `frame`"));
        }
        if frames > 1 {
            notes.remarks.push(format!("frame {frame} of {frames}; `frame` chooses another"));
        }
        Ok(Self { frames, frame, numbers: 1, value: Value::Number(0) })
    }

    /// The same frame where the voxels have the numbers of all frames side by side.
    pub(crate) fn mingled(self) -> Self {
        Self { frames: 1, frame: 0, numbers: self.frames, value: Value::Number(self.frame) }
    }

    /// The same with so many numbers a voxel, of which `value` is read.
    #[cfg(any(feature = "vti", feature = "vtk"))]
    pub(crate) fn with_value(self, numbers: u64, value: Value) -> Self {
        Self { numbers, value, ..self }
    }

    /// The same with `numbers` a voxel, which is a colour if they are three or four and `declared` to be one, or unsigned
    /// integers of 8 or 16 bits; other vectors are refused.
    pub(crate) fn with_numbers(
        self,
        numbers: u64,
        kind: Kind,
        declared: bool,
        place: Place,
        notes: &mut Notes,
    ) -> Result<Self, ReadError> {
        if numbers == 1 {
            return Ok(self);
        }
        let stands_for_color = declared || matches!(kind, Kind::U8 | Kind::U16);
        if !(matches!(numbers, 3 | 4) && stands_for_color) {
            let expected = "one number a voxel, or a colour: three or four unsigned integers of 8 or 16 bits";
            let found = format!("{numbers} numbers of {} bytes a voxel", kind.size());
            let hint = "write one component, or the length of the vectors, as an array or a volume of its own";
            return Err(ReadError::input(place, expected, found, hint));
        }
        let alpha = if numbers == 4 { "; alpha is not used" } else { "" };
        let luma = "colours: read is their luma, 0.2126 R + 0.7152 G + 0.0722 B of the numbers as they are stored";
        notes.remark(format!("{luma}{alpha}"));
        Ok(Self { numbers, value: Value::Luma, ..self })
    }
}
