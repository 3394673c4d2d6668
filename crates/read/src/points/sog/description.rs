//! `meta.json` of SOG: how many Gaussians there are, the names of the images, and what their bytes stand for.

use crate::error::{Place, ReadError};
use crate::points::gaussians::{self, sigmoid};
use serde::Deserialize;
use splat_core::text::escaped;

const HINT: &str = "the file is damaged, or was written wrongly: write it anew, such as with SplatTransform";

/// The error of a description that does not fit the format.
pub(super) fn wrong(expected: String, found: String) -> ReadError {
    ReadError::input(Place::File, expected, found, HINT)
}

/// Numbers that the bytes of an image stand for.
pub(super) struct Tables {
    /// One table, or one for each channel.
    channels: Vec<[f64; 256]>,
    /// Bounds of the logit of an opacity; in version 2 the byte is the opacity itself.
    logits: Option<[f64; 2]>,
}

impl Tables {
    /// The number that a byte of a channel stands for.
    pub(super) fn number(&self, channel: usize, byte: u8) -> f64 {
        self.channels[channel.min(self.channels.len() - 1)][usize::from(byte)]
    }

    /// The opacity that a byte stands for.
    pub(super) fn opacity(&self, byte: u8) -> f64 {
        let share = f64::from(byte) / 255.0;
        self.logits.map_or(share, |[low, high]| sigmoid(low + (high - low) * share))
    }
}

/// Harmonics beside the constant.
pub(super) struct PaletteFacts {
    /// The image of the palette, and that of the row of each Gaussian.
    pub(super) files: [String; 2],
    pub(super) tables: Tables,
    /// Rows of the palette; `None` in version 1.
    pub(super) count: Option<usize>,
    /// Degree of the harmonics; `None` in version 1.
    pub(super) bands: Option<u64>,
}

/// All that the description states.
pub(super) struct Description {
    pub(super) count: usize,
    pub(super) mins: [f64; 3],
    pub(super) maxs: [f64; 3],
    /// Images of the low and the high bytes of places.
    pub(super) means: [String; 2],
    pub(super) scales: String,
    pub(super) scale_tables: Tables,
    pub(super) quaternions: String,
    pub(super) colors: String,
    pub(super) color_tables: Tables,
    pub(super) palette: Option<PaletteFacts>,
    /// Whether the Gaussians are discs, whose third deviation is nothing.
    pub(super) is_flat: bool,
    is_antialiased: bool,
    model: Option<String>,
}

#[derive(Deserialize)]
struct Raw {
    version: Option<u64>,
    count: Option<usize>,
    #[serde(default)]
    antialias: bool,
    model: Option<String>,
    means: RawMeans,
    scales: RawCoded,
    quats: RawFiles,
    sh0: RawCoded,
    #[serde(rename = "shN")]
    sh_n: Option<RawPalette>,
}

#[derive(Deserialize)]
struct RawMeans {
    shape: Option<Vec<usize>>,
    mins: [f64; 3],
    maxs: [f64; 3],
    files: [String; 2],
}

#[derive(Deserialize)]
struct RawCoded {
    codebook: Option<Vec<Option<f64>>>,
    mins: Option<Vec<f64>>,
    maxs: Option<Vec<f64>>,
    files: [String; 1],
}

#[derive(Deserialize)]
struct RawFiles {
    files: [String; 1],
}

#[derive(Deserialize)]
struct RawPalette {
    count: Option<usize>,
    bands: Option<u64>,
    codebook: Option<Vec<Option<f64>>>,
    mins: Option<f64>,
    maxs: Option<f64>,
    files: [String; 2],
}

impl Description {
    pub(super) fn parse(content: &[u8]) -> Result<Self, ReadError> {
        let raw: Raw = serde_json::from_slice(content).map_err(|e| {
            wrong("meta.json of SOG with `means`, `scales`, `quats` and `sh0`".to_owned(), e.to_string())
        })?;
        let is_coded = match raw.version {
            None | Some(1) => false,
            Some(2) => true,
            Some(other) => return Err(wrong("version 1 or 2 in meta.json".to_owned(), other.to_string())),
        };
        let RawMeans { shape, mins, maxs, files: means } = raw.means;
        let stated = if is_coded { raw.count } else { shape.and_then(|shape| shape.first().copied()) };
        let count = stated.filter(|count| *count > 0).ok_or_else(|| {
            let expected =
                if is_coded { "a `count` of Gaussians" } else { "the count of Gaussians first in `means.shape`" };
            wrong(format!("{expected} in meta.json, at least 1"), stated.map_or("none".to_owned(), |n| n.to_string()))
        })?;
        let mut color_tables = tables("sh0", &raw.sh0, is_coded)?;
        if !is_coded {
            color_tables.logits =
                Some([bound("sh0", "mins", &raw.sh0.mins, 3)?, bound("sh0", "maxs", &raw.sh0.maxs, 3)?]);
        }
        let scale_tables = tables("scales", &raw.scales, is_coded)?;
        let [scales] = raw.scales.files;
        let [quaternions] = raw.quats.files;
        let [colors] = raw.sh0.files;
        let palette =
            raw.sh_n.filter(|palette| palette.bands != Some(0)).map(|palette| facts(palette, is_coded)).transpose()?;
        Ok(Self {
            count,
            mins,
            maxs,
            means,
            scales,
            scale_tables,
            quaternions,
            colors,
            color_tables,
            palette,
            is_flat: raw.model.as_deref() == Some("2dgs"),
            is_antialiased: raw.antialias || raw.model.as_deref() == Some("antialiased"),
            model: raw.model.filter(|model| !["default", "antialiased", "2dgs"].contains(&model.as_str())),
        })
    }

    /// Sentences about the parts of the description that the picture does not follow.
    pub(super) fn remarks(&self) -> Vec<String> {
        let model = self.model.as_ref().map(|model| {
            let shown = escaped(model.as_bytes(), 40);
            format!("its Gaussians are of the model '{shown}', which is not known, and are drawn as others")
        });
        self.is_antialiased.then(|| gaussians::ANTIALIASED.to_owned()).into_iter().chain(model).collect()
    }
}

fn facts(palette: RawPalette, is_coded: bool) -> Result<PaletteFacts, ReadError> {
    let channels = if is_coded {
        vec![codebook("shN", &palette.codebook)?]
    } else {
        let mins = palette.mins.ok_or_else(|| wrong("`shN.mins` in meta.json".to_owned(), "none".to_owned()))?;
        let maxs = palette.maxs.ok_or_else(|| wrong("`shN.maxs` in meta.json".to_owned(), "none".to_owned()))?;
        vec![even(mins, maxs)]
    };
    let tables = Tables { channels, logits: None };
    // Version 1 states neither: the width of the image tells the degree.
    let count = palette.count.filter(|_| is_coded);
    let bands = palette.bands.filter(|_| is_coded);
    Ok(PaletteFacts { files: palette.files, tables, count, bands })
}

fn tables(name: &str, coded: &RawCoded, is_coded: bool) -> Result<Tables, ReadError> {
    if is_coded {
        return Ok(Tables { channels: vec![codebook(name, &coded.codebook)?], logits: None });
    }
    let channel = |k: usize| Ok(even(bound(name, "mins", &coded.mins, k)?, bound(name, "maxs", &coded.maxs, k)?));
    Ok(Tables { channels: (0..3).map(channel).collect::<Result<_, ReadError>>()?, logits: None })
}

/// Even steps between two numbers.
fn even(low: f64, high: f64) -> [f64; 256] {
    std::array::from_fn(|byte| low + (high - low) * byte as f64 / 255.0)
}

fn bound(name: &str, end: &str, bounds: &Option<Vec<f64>>, k: usize) -> Result<f64, ReadError> {
    let found = bounds.as_ref().map_or(0, Vec::len);
    bounds
        .as_ref()
        .and_then(|bounds| bounds.get(k))
        .copied()
        .ok_or_else(|| wrong(format!("at least {} numbers in `{name}.{end}` of meta.json", k + 1), found.to_string()))
}

/// A table of 256 numbers. Some writers left its first number out, which lies one mean step below the second.
fn codebook(name: &str, numbers: &Option<Vec<Option<f64>>>) -> Result<[f64; 256], ReadError> {
    let expected = || format!("256 numbers in `{name}.codebook` of meta.json");
    let found = || numbers.as_ref().map_or("none".to_owned(), |numbers| numbers.len().to_string());
    let numbers: &[Option<f64>; 256] =
        numbers.as_deref().and_then(|n| n.try_into().ok()).ok_or_else(|| wrong(expected(), found()))?;
    let mut table = [0.0; 256];
    for (k, (entry, number)) in table.iter_mut().zip(numbers).enumerate().skip(1) {
        *entry = number.ok_or_else(|| wrong(expected(), format!("null as number {k}")))?;
    }
    table[0] = numbers[0].unwrap_or(table[1] + (table[1] - table[255]) / 255.0);
    Ok(table)
}
