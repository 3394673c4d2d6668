//! What a user may wish of a first scene.

use crate::paraview::Sampled;
use convert::ColorMap;
use organza::Error;
use organza::scene::{DEFAULT_FILL, DEFAULT_SIZE, LabelFile, LabelTable, Recipe, UpAxis, read_label_table};
use splat_core::MemoryAccount;
use std::path::{Path, PathBuf};

/// How a volume is to look.
#[derive(Debug, Clone, PartialEq)]
pub struct Preset(pub(crate) Look);

/// The looks that there are.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Look {
    /// A computed tomogram in Hounsfield units: bones in a film of what is soft.
    Tomogram,
    /// Bones of a computed tomogram, without what is soft.
    CtBone,
    /// Its outer surface, as a body is seen.
    CtSkin,
    /// Tissue of a magnetic resonance image.
    Mri,
    /// White droplets that scatter light.
    Cloud,
    /// The surface of each label.
    Labels,
    /// The colours of a map over the body of the values.
    Map(ColorMap),
    /// The same of a computed field: thin and without light, so that colours stand for values and its middle is seen.
    Field(ColorMap),
    /// Colours, and opacities where there are some, of a preset of ParaView.
    Sampled(Sampled),
}

/// The looks that have a name and are no colour map.
const NAMED: [(&str, Look); 5] = [
    ("ct-bone", Look::CtBone),
    ("ct-skin", Look::CtSkin),
    ("mri", Look::Mri),
    ("cloud", Look::Cloud),
    ("labels", Look::Labels),
];

impl Preset {
    /// A preset by its name, or from a JSON file of ParaView by its path.
    ///
    /// # Errors
    /// [`Error::Usage`] for a name that there is not, [`Error::Io`] and [`Error::Input`] for a file.
    pub fn named(name: &str) -> Result<Self, Error> {
        let look = NAMED.iter().find(|(known, _)| *known == name).map(|(_, look)| look.clone());
        if let Some(look) = look.or_else(|| ColorMap::named(name).map(Look::Map)) {
            return Ok(Self(look));
        }
        if Path::new(name).extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
            return Sampled::read(Path::new(name)).map(|sampled| Self(Look::Sampled(sampled)));
        }
        let message = format!("--preset {}: there is no such preset", organza::shown(name));
        let names: Vec<&str> = NAMED.iter().map(|(name, _)| *name).chain(ColorMap::names()).collect();
        Err(Error::usage(message, format!("there are {}, or the path of a .json preset of ParaView", names.join(", "))))
    }
}

/// A material by its name.
///
/// # Errors
/// [`Error::Usage`] for a name that there is not.
pub fn material_named(name: &str) -> Result<&'static Recipe, Error> {
    Recipe::named(name).ok_or_else(|| {
        let names: Vec<&str> = Recipe::list().iter().map(|recipe| recipe.name).collect();
        let message = format!("--material {}: there is no such material", organza::shown(name));
        let near = organza::scene::nearest_name(name, &names).map(|near| format!("did you mean `{near}`? "));
        Error::usage(message, format!("{}there are {}", near.unwrap_or_default(), names.join(", ")))
    })
}

impl Preset {
    /// The colour map, if it is one.
    pub(crate) fn map(&self) -> Option<ColorMap> {
        if let Look::Map(map) = self.0 { Some(map) } else { None }
    }

    /// Whether matter scatters light as droplets do.
    pub(crate) fn is_cloud(&self) -> bool {
        self.0 == Look::Cloud
    }

    /// Whether whole numbers are labels, whatever they look like.
    pub(crate) fn is_labels(&self) -> bool {
        self.0 == Look::Labels
    }
}

/// A table of labels with its file.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedTable {
    /// The file, as it was named.
    pub path: PathBuf,
    /// Its labels.
    pub table: LabelTable,
    /// How the file was understood where that is not plain, one sentence without a full stop each.
    pub remarks: Vec<String>,
}

impl NamedTable {
    /// Reads a table.
    ///
    /// # Errors
    /// As [`read_label_table`].
    pub fn read(path: &Path, memory: &MemoryAccount) -> Result<Self, Error> {
        let LabelFile { labels, remarks } = read_label_table(path, memory)?;
        Ok(Self { path: path.to_owned(), table: labels, remarks })
    }
}

/// What a user may say of a first scene; the rest follows from the data.
#[derive(Debug, Clone, PartialEq)]
pub struct Wish {
    /// Where the eye is, degrees about +Y from +Z towards +X.
    pub azimuth: Option<f64>,
    /// Degrees above the horizon.
    pub elevation: Option<f64>,
    /// Share of the picture that is filled, in (0, 1].
    pub fill: f64,
    /// Frames of a turntable, all of which the picture is to be filled in and nothing cut off; `None` for a still.
    pub turntable: Option<u32>,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// How volumes look, and the colour map of points.
    pub preset: Option<Preset>,
    /// The material of all surfaces, and of points and volumes that are a medium, instead of what data is drawn as by itself.
    pub material: Option<&'static Recipe>,
    /// The column that points take their colours from; without it one is chosen where their file has no colours.
    pub color_by: Option<String>,
    /// The numbers at the two ends of its map, rising; `None` leaves that to the column.
    pub color_range: Option<[f64; 2]>,
    /// Whether numbers lie along its map by their logarithms.
    pub is_logarithmic: bool,
    /// The table of the labels of volumes that have such.
    pub labels: Option<NamedTable>,
    /// Which axis of the data points up; `None` leaves that to the format of each file.
    pub up: Option<UpAxis>,
    /// Whether everything stands on a ground.
    pub ground: bool,
}

impl Wish {
    /// Whether cells are wanted as a volume and not as the surface around them: by a look of volumes, a table of labels, or a material of media.
    pub(crate) fn shows_inside(&self) -> bool {
        let is_look = |preset: &Preset| preset.map().is_none() && !preset.is_labels();
        let is_of_media = |material: &&Recipe| !material.is_of_surfaces();
        self.preset.as_ref().is_some_and(is_look)
            || self.labels.is_some()
            || self.material.as_ref().is_some_and(is_of_media)
    }
}

impl Default for Wish {
    fn default() -> Self {
        Self {
            azimuth: None,
            elevation: None,
            fill: DEFAULT_FILL,
            turntable: None,
            size: DEFAULT_SIZE,
            preset: None,
            material: None,
            color_by: None,
            color_range: None,
            is_logarithmic: false,
            labels: None,
            up: None,
            ground: false,
        }
    }
}
