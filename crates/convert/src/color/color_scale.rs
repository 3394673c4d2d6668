//! The meaning of a picture's colours: numbers of a column of points, or values of a volume.

use crate::{ColorBy, Colored, MapScale, PointColors, class_name};
use splat_core::TransferFunction;

/// The meaning of an object's colours, for a legend beside its picture.
#[derive(Debug, Clone, PartialEq)]
pub struct ColorScale {
    /// Name of the object.
    pub object: String,
    /// The column that its points take their colours from; `None` for the values of a volume.
    pub column: Option<String>,
    /// The colours of numbers.
    pub colors: PointColors,
    /// The numbers that have colours.
    pub numbers: ScaleNumbers,
    /// The colour of what has no number, linear Rec.709, where something has none.
    pub gap: Option<[f32; 3]>,
}

/// The numbers of a [`ColorScale`].
#[derive(Debug, Clone, PartialEq)]
pub enum ScaleNumbers {
    /// All from one to another, which are the same where a column has one number alone.
    Range([f64; 2]),
    /// These whole ones, rising.
    Each(Vec<f64>),
}

impl ColorScale {
    /// The scale of points; those without a number have the colour `plain`. `None` where no point has a number.
    pub fn of_points(object: &str, by: &ColorBy, colored: &Colored, plain: [f32; 3]) -> Option<Self> {
        let numbers = match (&by.colors, colored.range) {
            (PointColors::Map { .. }, range) => ScaleNumbers::Range(range.filter(|_| colored.has_numbers())?),
            (PointColors::Transfer(transfer, _), _) => ScaleNumbers::Range(ends(transfer)),
            (PointColors::Classes | PointColors::Distinct | PointColors::Labels(_), _) => {
                ScaleNumbers::Each(colored.present.clone())
            }
        };
        let is_empty = matches!(&numbers, ScaleNumbers::Each(present) if present.is_empty());
        let object = object.to_owned();
        let colors = by.colors.clone();
        let gap = (colored.gaps > 0).then_some(plain);
        (!is_empty).then(|| Self { object, column: Some(by.column.clone()), colors, numbers, gap })
    }

    /// The scale of a volume or of a plane through one. If the transfer function has extinctions, it spans the visible values
    /// alone.
    ///
    /// ```
    /// use convert::{ColorScale, ScaleNumbers};
    /// use splat_core::{TransferFunction, TransferPoint};
    /// let point = |value, extinction| TransferPoint { value, color: [1.0; 3], extinction };
    /// let transfer = TransferFunction::new(vec![point(-1000.0, 0.0), point(20.0, 0.0), point(300.0, 2.0)]).unwrap();
    /// assert_eq!(ColorScale::of_values("head", &transfer).numbers, ScaleNumbers::Range([20.0, 300.0]));
    /// ```
    pub fn of_values(object: &str, transfer: &TransferFunction) -> Self {
        let points = transfer.points();
        let shows = |value: f32| transfer.at(value).extinction > 0.0;
        let first = points.iter().position(|p| shows(p.value)).unwrap_or(0);
        let last = points.iter().rposition(|p| shows(p.value)).unwrap_or(points.len() - 1);
        let [low, high] =
            [first.saturating_sub(1), (last + 1).min(points.len() - 1)].map(|i| f64::from(points[i].value));
        let object = object.to_owned();
        let colors = PointColors::Transfer(transfer.clone(), crate::Classified::No);
        Self { object, column: None, colors, numbers: ScaleNumbers::Range([low, high]), gap: None }
    }

    /// Linear Rec.709 of a number.
    pub fn color(&self, number: f64) -> [f32; 3] {
        let range = match self.numbers {
            ScaleNumbers::Range(range) => range,
            ScaleNumbers::Each(_) => [0.0; 2],
        };
        self.colors.at(number, range)
    }

    /// The scale of numbers along its bar.
    pub fn spacing(&self) -> MapScale {
        match self.colors {
            PointColors::Map { scale, .. } => scale,
            _ => MapScale::Linear,
        }
    }

    /// The meaning of a whole number, such as `ground` for the class 2 of LAS, and the name of a label.
    pub fn meaning(&self, number: f64) -> Option<&str> {
        match &self.colors {
            PointColors::Classes if (0.0..=255.0).contains(&number) => class_name(number as u8),
            PointColors::Labels(table) => table.name(number),
            _ => None,
        }
    }
}

/// The first and the last value that a transfer function has a control point at.
fn ends(transfer: &TransferFunction) -> [f64; 2] {
    let points = transfer.points();
    [points[0], points[points.len() - 1]].map(|point| f64::from(point.value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ColorMap, Label, LabelTable, SplatParams, colored};
    use splat_core::glam::{DVec3, Vec3};
    use splat_core::{RawPoints, TransferPoint};
    use std::sync::Arc;

    fn survey_scale(heights: &[f32], colors: PointColors) -> Option<ColorScale> {
        let position = heights.iter().map(|y| Vec3::Y * *y).collect();
        let by = ColorBy { column: "height".into(), colors };
        let points = RawPoints { position, ..RawPoints::default() };
        let found = colored(&points, &by, DVec3::Y, &SplatParams::default()).expect("a column that is there");
        ColorScale::of_points("survey", &by, &found, [0.5; 3])
    }

    #[test]
    fn a_map_is_told_from_end_to_end_in_the_colours_of_the_points() {
        let scale =
            survey_scale(&[2.0, 4.0, 10.0], PointColors::map_over(ColorMap::TURBO, [2.0, 10.0])).expect("a scale");
        assert_eq!(scale.numbers, ScaleNumbers::Range([2.0, 10.0]));
        assert_eq!([2.0, 4.0, 11.0].map(|n| scale.color(n)), [0.0, 0.25, 1.0].map(|place| ColorMap::TURBO.at(place)));
        assert_eq!(survey_scale(&[f32::NAN], PointColors::map(ColorMap::TURBO)), None);
    }

    #[test]
    fn classes_are_those_that_occur_with_their_meanings() {
        let scale = survey_scale(&[6.0, 2.0, 6.2, 70.0, 2.0], PointColors::Classes).expect("a scale");
        assert_eq!(scale.numbers, ScaleNumbers::Each(vec![2.0, 6.0, 70.0]));
        assert_eq!([2.0, 6.0, 70.0].map(|n| scale.meaning(n)), [Some("ground"), Some("building"), None]);
        assert_eq!(survey_scale(&[2.0], PointColors::Distinct).expect("a scale").meaning(2.0), None);
        let liver = Label { name: "liver".into(), color: Some([0.25, 0.0, 0.0]), opacity: 1.0 };
        let labels = PointColors::Labels(Arc::new(LabelTable::from_iter([(2, liver)])));
        let scale = survey_scale(&[2.0, 6.0], labels).expect("a scale");
        assert_eq!((scale.meaning(2.0), scale.color(2.0), scale.meaning(6.0)), (Some("liver"), [0.25, 0.0, 0.0], None));
    }

    #[test]
    fn of_a_transfer_function_the_part_that_shows_is_told_and_all_where_nothing_tells() {
        let numbers = |extinctions: &[f32]| {
            let point = |(i, e): (usize, &f32)| TransferPoint { value: i as f32, color: [1.0; 3], extinction: *e };
            let transfer = TransferFunction::new(extinctions.iter().enumerate().map(point).collect()).expect("rising");
            ColorScale::of_values("head", &transfer).numbers
        };
        assert_eq!(numbers(&[0.0, 0.0, 1.0, 0.0, 0.0]), ScaleNumbers::Range([1.0, 3.0]));
        assert_eq!(numbers(&[1.0, 0.0, 0.0]), ScaleNumbers::Range([0.0, 1.0]));
        assert_eq!(numbers(&[0.0, 0.0, 0.0]), ScaleNumbers::Range([0.0, 2.0]));
    }
}
