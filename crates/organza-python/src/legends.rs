//! Legends of a picture as dictionaries of Python, from which another process makes the same ones.

use crate::errors::refused;
use convert::{Classified, ColorMap, ColorScale, Label, LabelTable, MapScale, PointColors, ScaleNumbers};
use pyo3::prelude::*;
use splat_core::{TransferFunction, TransferPoint};
use std::sync::Arc;

/// The column that the argument `values` of points and meshes becomes.
const VALUES: &str = "value";
/// The column of the surfaces of labels.
const LABEL: &str = "label";
/// Names of the colours of whole numbers, beside those of maps.
const CLASSES: &str = "classes";
const DISTINCT: &str = "distinct";

/// The number, the name, the colour and the opacity of a label.
type LabelRow = (u32, String, Option<[f32; 3]>, f32);

/// A [`ColorScale`]. Its colours are those of a map by its name, of labels, or of a transfer function.
#[derive(FromPyObject, IntoPyObject)]
pub(crate) struct Legend {
    #[pyo3(item)]
    object: String,
    #[pyo3(item)]
    column: Option<String>,
    /// The numbers at the ends of a bar.
    #[pyo3(item)]
    range: Option<[f64; 2]>,
    /// Whole numbers, where there is no bar.
    #[pyo3(item)]
    each: Vec<f64>,
    #[pyo3(item)]
    gap: Option<[f32; 3]>,
    #[pyo3(item)]
    map: Option<String>,
    #[pyo3(item)]
    is_logarithmic: bool,
    #[pyo3(item)]
    labels: Option<Vec<LabelRow>>,
    /// Values with their colours.
    #[pyo3(item)]
    transfer: Vec<(f32, [f32; 3])>,
}

impl Legend {
    pub(crate) fn new(scale: &ColorScale) -> Self {
        let (range, each) = match &scale.numbers {
            ScaleNumbers::Range(range) => (Some(*range), Vec::new()),
            ScaleNumbers::Each(numbers) => (None, numbers.clone()),
        };
        let mut legend = Self {
            object: scale.object.clone(),
            column: scale.column.clone(),
            range,
            each,
            gap: scale.gap,
            map: None,
            is_logarithmic: scale.spacing() == MapScale::Logarithmic,
            labels: None,
            transfer: Vec::new(),
        };
        match &scale.colors {
            PointColors::Map { map, .. } => legend.map = Some(map.name().to_owned()),
            PointColors::Classes => legend.map = Some(CLASSES.to_owned()),
            PointColors::Distinct => legend.map = Some(DISTINCT.to_owned()),
            PointColors::Labels(table) => {
                let row = |(number, label): (u32, &Label)| (number, label.name.clone(), label.color, label.opacity);
                legend.labels = Some(table.labels().map(row).collect());
            }
            PointColors::Transfer(transfer, _) => {
                legend.transfer = transfer.points().iter().map(|point| (point.value, point.color)).collect();
            }
        }
        legend
    }

    /// The scale that it was made of; extinctions of a transfer function are no part of a legend.
    pub(crate) fn scale(self) -> PyResult<ColorScale> {
        let colors = match (self.map.as_deref(), self.labels) {
            (Some(CLASSES), _) => PointColors::Classes,
            (Some(DISTINCT), _) => PointColors::Distinct,
            (Some(name), _) => {
                let known = || refused("the legend", "a map that there is", &format!("'{name}'"));
                let scale = if self.is_logarithmic { MapScale::Logarithmic } else { MapScale::Linear };
                PointColors::Map { map: ColorMap::named(name).ok_or_else(known)?, range: self.range, scale }
            }
            (None, Some(rows)) => {
                let label = |(number, name, color, opacity): LabelRow| (number, Label { name, color, opacity });
                PointColors::Labels(Arc::new(rows.into_iter().map(label).collect::<LabelTable>()))
            }
            (None, None) => {
                let point = |(value, color): (f32, [f32; 3])| TransferPoint { value, color, extinction: 0.0 };
                let transfer = TransferFunction::new(self.transfer.into_iter().map(point).collect());
                let wrong = |error| refused("the legend", "a transfer function", &format!("{error}"));
                PointColors::Transfer(transfer.map_err(wrong)?, Classified::No)
            }
        };
        let numbers = self.range.map_or(ScaleNumbers::Each(self.each), ScaleNumbers::Range);
        Ok(ColorScale { object: self.object, column: self.column, colors, numbers, gap: self.gap })
    }
}

/// A scale with the name that a user gave: the columns of `values` and of labels have none, and their object has one.
pub(crate) fn named(scale: ColorScale) -> ColorScale {
    let is_of_labels = matches!(scale.colors, PointColors::Distinct | PointColors::Labels(_));
    let column = scale.column.filter(|column| column != VALUES && !(is_of_labels && column == LABEL));
    ColorScale { column, ..scale }
}
