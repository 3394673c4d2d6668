//! Colours points by one of their columns: by a map, by whole numbers, or by a transfer function. A transfer function may classify them too,
//! by their opacity or their extinction.

use super::distinct::distinct;
use crate::common::columns::CHUNK;
use crate::{ColorMap, ConvertError, LabelTable, SplatParams};
use rayon::prelude::*;
use splat_core::glam::DVec3;
use splat_core::srgb::linear_from_hex;
use splat_core::{RawPoints, TransferFunction};
use std::sync::Arc;

/// Shares of a column's numbers that its map spans where no range is stated: a few strays do not make all else one colour.
const SHARES: [f64; 2] = [0.01, 0.99];

/// Most whole numbers that are told of a column.
const MOST_PRESENT: usize = 64;

/// Classes of points in LAS 1.4 (ASPRS), with their colours as 0xRRGGBB.
const CLASSES: [(&str, u32); 19] = [
    ("created, never classified", 0xa8a8a8),
    ("unclassified", 0x8f8f94),
    ("ground", 0xa67c52),
    ("low vegetation", 0xb7d36b),
    ("medium vegetation", 0x74b74e),
    ("high vegetation", 0x2f7d35),
    ("building", 0xd9533f),
    ("low noise", 0xff2bd6),
    ("reserved", 0xe3c65b),
    ("water", 0x3f82d0),
    ("rail", 0x7a57a8),
    ("road surface", 0x55565c),
    ("reserved", 0xcfa3c2),
    ("wire guard", 0xf2e255),
    ("wire conductor", 0xffc400),
    ("transmission tower", 0x2fbfbf),
    ("wire connector", 0xff8f2e),
    ("bridge deck", 0x8d93ad),
    ("high noise", 0xff2f8f),
];

/// The mapping from numbers to colours.
#[derive(Debug, Clone, PartialEq)]
pub enum PointColors {
    /// A colour map over a range of numbers.
    Map {
        /// The map.
        map: ColorMap,
        /// The numbers at its ends, rising. Without one these are the 1st and the 99th percentile of the column; of a map that diverges from a
        /// middle, and of numbers with both signs, as far from 0 as the farther of these.
        range: Option<[f64; 2]>,
        /// How numbers lie along it.
        scale: MapScale,
    },
    /// Whole numbers as classes of LAS, each in a colour of its own.
    Classes,
    /// Whole numbers, in 256 colours that are told apart.
    Distinct,
    /// Whole numbers by a table, those that it lacks as [`PointColors::Distinct`].
    Labels(Arc<LabelTable>),
    /// By control points, whose extinctions stand for that.
    Transfer(TransferFunction, Classified),
}

/// The scale of numbers along a colour map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MapScale {
    /// As they are.
    #[default]
    Linear,
    /// By their logarithms. What is not above 0 has no colour of the map.
    Logarithmic,
}

/// The meaning of the extinctions in a transfer function that colours points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Classified {
    /// Nothing: they are not used.
    #[default]
    No,
    /// Opacity of one crossing, in \[0, 1\], by which that of a surface is multiplied.
    Opacity,
    /// What the extinction of points that are a medium is multiplied by, ≥ 0.
    Extinction,
}

/// A column that points or meshes take their colours from.
#[derive(Debug, Clone, PartialEq)]
pub struct ColorBy {
    /// Its name, see [`RawPoints::column`] and [`splat_core::Mesh::column`].
    pub column: String,
    /// The colours of its numbers.
    pub colors: PointColors,
}

/// The appearance of points by a column.
#[derive(Debug, Clone, PartialEq)]
pub struct Colored {
    /// Linear Rec.709, one a point.
    pub color: Vec<[f32; 3]>,
    /// The numbers of the column, of which gaps are not finite.
    pub numbers: Vec<f64>,
    /// The classification of each point by a transfer function; empty for one that only colours.
    pub classified: Vec<f32>,
    /// The numbers at the ends of a colour map.
    pub range: Option<[f64; 2]>,
    /// Points whose number is a gap, see [`splat_core::Column`]; they have the colour of `splat`, and are neither made transparent nor absorb.
    pub gaps: u64,
    /// Of [`PointColors::Classes`], [`PointColors::Distinct`] and [`PointColors::Labels`] the whole numbers that occur, rising, the least 64 of them.
    pub present: Vec<f64>,
}

impl Colored {
    /// Whether some point has a number.
    pub(crate) fn has_numbers(&self) -> bool {
        self.gaps < self.color.len() as u64
    }
}

impl PointColors {
    /// A map of numbers as they are, from its 1st to its 99th percentile.
    pub fn map(map: ColorMap) -> Self {
        Self::Map { map, range: None, scale: MapScale::Linear }
    }

    /// A map of numbers as they are, from one to another.
    pub fn map_over(map: ColorMap, range: [f64; 2]) -> Self {
        Self::Map { map, range: Some(range), scale: MapScale::Linear }
    }

    /// Whether numbers are whole, each with a colour of its own and nothing between two.
    pub(crate) fn are_whole(&self) -> bool {
        matches!(self, Self::Classes | Self::Distinct | Self::Labels(_))
    }

    /// Whether a number has a colour: it is finite, and has a logarithm where that is asked for.
    pub(crate) fn shows(&self, number: f64) -> bool {
        let is_logarithmic = matches!(self, Self::Map { scale: MapScale::Logarithmic, .. });
        number.is_finite() && (number > 0.0 || !is_logarithmic)
    }

    /// The colour of a number that has one, linear Rec.709; `range` are the numbers at the ends of a map.
    pub(crate) fn at(&self, number: f64, range: [f64; 2]) -> [f32; 3] {
        match self {
            Self::Map { map, scale, .. } => map.at(scale.place(number, range)),
            Self::Classes => class_color(number),
            Self::Distinct => distinct(number),
            Self::Labels(table) => table.color(number),
            Self::Transfer(transfer, _) => transfer.at(number as f32).color,
        }
    }
}

impl MapScale {
    /// The place of a number in a range, from 0 to 1 within; the middle of a range without a width.
    ///
    /// ```
    /// use convert::MapScale;
    /// assert!((MapScale::Logarithmic.place(10.0, [1.0, 1000.0]) - 1.0 / 3.0).abs() < 1e-12);
    /// ```
    pub fn place(self, number: f64, range: [f64; 2]) -> f64 {
        let [low, high] = range;
        if high <= low {
            return 0.5;
        }
        match self {
            Self::Linear => (number - low) / (high - low),
            Self::Logarithmic => libm::log(number / low) / libm::log(high / low),
        }
    }

    /// The number at a place of a range: the inverse of [`MapScale::place`].
    pub fn number(self, place: f64, range: [f64; 2]) -> f64 {
        let [low, high] = range;
        match self {
            Self::Linear => low + (high - low) * place,
            Self::Logarithmic => low * libm::pow(high / low, place),
        }
    }
}

/// The name that LAS 1.4 gives a class; `None` for those that it leaves to users.
pub fn class_name(class: u8) -> Option<&'static str> {
    CLASSES.get(usize::from(class)).map(|(name, _)| *name)
}

/// The colours of points by a column; `up` is where `height` grows. Of `splat` the name and the colour are used.
///
/// ```
/// use convert::{ColorBy, ColorMap, PointColors, SplatParams, colored};
/// use splat_core::RawPoints;
/// use splat_core::glam::{DVec3, Vec3};
/// let points = RawPoints { position: vec![Vec3::ZERO, Vec3::Z * 0.5, Vec3::Z], ..RawPoints::default() };
/// let by = ColorBy { column: "z".into(), colors: PointColors::map_over(ColorMap::VIRIDIS, [0.0, 1.0]) };
/// let colored = colored(&points, &by, DVec3::Z, &SplatParams::default()).unwrap();
/// assert_eq!(colored.color[1], ColorMap::VIRIDIS.at(0.5));
/// ```
///
/// # Errors
/// [`ConvertError::Parameter`] for a column that the points have not.
pub fn colored(points: &RawPoints, by: &ColorBy, up: DVec3, splat: &SplatParams) -> Result<Colored, ConvertError> {
    let Some(numbers) = points.column(&by.column, up) else {
        return Err(splat.bad("color_by", &by.column, "a column of its points"));
    };
    Ok(colored_numbers(numbers, by, splat))
}

/// The colours of numbers.
pub(crate) fn colored_numbers(numbers: Vec<f64>, by: &ColorBy, splat: &SplatParams) -> Colored {
    let range = match &by.colors {
        PointColors::Map { map, range, .. } => Some(range.unwrap_or_else(|| spread(&numbers, by, *map))),
        _ => None,
    };
    let color = |number: &f64| {
        if by.colors.shows(*number) { by.colors.at(*number, range.unwrap_or_default()) } else { splat.color }
    };
    let classified = |number: &f64| match &by.colors {
        PointColors::Transfer(transfer, _) if number.is_finite() => transfer.at(*number as f32).extinction,
        PointColors::Transfer(_, Classified::Opacity) => 1.0,
        _ => 0.0,
    };
    let classifies = matches!(by.colors, PointColors::Transfer(_, Classified::Opacity | Classified::Extinction));
    let classified = if classifies { numbers.par_iter().map(classified).collect() } else { Vec::new() };
    let gaps = numbers.iter().filter(|n| !by.colors.shows(**n)).count() as u64;
    let present = if by.colors.are_whole() { present(&numbers) } else { Vec::new() };
    let color = numbers.par_iter().map(color).collect();
    Colored { color, numbers, classified, range, gaps, present }
}

/// The least whole numbers that occur, rising.
fn present(numbers: &[f64]) -> Vec<f64> {
    let least = |mut values: Vec<f64>| {
        values.sort_unstable_by(f64::total_cmp);
        values.dedup();
        values.truncate(MOST_PRESENT);
        values
    };
    // −0 is 0.
    let of_chunk = |chunk: &[f64]| least(chunk.iter().filter(|n| n.is_finite()).map(|n| n.round() + 0.0).collect());
    let of_chunks = numbers.par_chunks(CHUNK).map(of_chunk);
    of_chunks.reduce(Vec::new, |first, second| least([first, second].concat()))
}

/// The numbers below which the first and all but the last hundredth of a column lie; gaps do not count. Where both are one number, the least and the
/// greatest of all: a few flags among many zeros are what such a column is shown for.
fn spread(numbers: &[f64], by: &ColorBy, map: ColorMap) -> [f64; 2] {
    let mut shown: Vec<f64> = numbers.iter().copied().filter(|n| by.colors.shows(*n)).collect();
    if shown.is_empty() {
        return [0.0; 2];
    }
    let mut ends = SHARES.map(|share| {
        let rank = ((shown.len() - 1) as f64 * share).round() as usize;
        *shown.select_nth_unstable_by(rank, f64::total_cmp).1
    });
    if ends[0] == ends[1] {
        ends = shown.iter().fold(ends, |[low, high], number| [low.min(*number), high.max(*number)]);
    }
    let [low, high] = ends;
    let end = high.max(-low);
    if map.is_diverging() && low < 0.0 && high > 0.0 { [-end, end] } else { [low, high] }
}

/// The colour of a class; those that LAS leaves to users have [`distinct`] ones.
fn class_color(number: f64) -> [f32; 3] {
    let class = number.round();
    let known = (class >= 0.0).then(|| CLASSES.get(class as usize)).flatten();
    known.map_or_else(|| distinct(number), |(_, rgb)| linear_from_hex(*rgb))
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::Vec3;
    use splat_core::{Column, TransferPoint};

    fn points(values: Vec<f64>) -> RawPoints {
        let columns = vec![Column { name: "it".into(), values }];
        RawPoints { position: vec![Vec3::ZERO; columns[0].values.len()], columns, ..RawPoints::default() }
    }

    #[test]
    fn a_map_spans_all_numbers_where_its_percentiles_are_one() {
        let by = ColorBy { column: "it".into(), colors: PointColors::Classes };
        let ends = |values: &[f64]| spread(values, &by, ColorMap::named("viridis").unwrap());
        let flags: Vec<f64> = (0..500).map(|i| if i % 200 == 7 { 3.0 } else { 0.0 }).collect();
        assert_eq!(ends(&flags), [0.0, 3.0]);
        assert_eq!(ends(&[2.0; 9]), [2.0; 2]);
        // Strays do not count where the others differ.
        let strays: Vec<f64> = (0..1000).map(|i| if i == 500 { 1e9 } else { f64::from(i) }).collect();
        assert_eq!(ends(&strays), [10.0, 990.0]);
    }

    fn colored_column(values: Vec<f64>, colors: PointColors) -> Colored {
        let by = ColorBy { column: "it".into(), colors };
        colored(&points(values), &by, DVec3::Y, &SplatParams { color: [0.5, 0.25, 0.125], ..SplatParams::default() })
            .expect("a column that is there")
    }

    #[test]
    fn whole_numbers_near_each_other_have_unlike_colours() {
        let numbers: Vec<f64> = (-12..60).map(f64::from).collect();
        let color = colored_column(numbers.clone(), PointColors::Distinct).color;
        for i in 0..numbers.len() {
            for k in i + 1..numbers.len().min(i + 24) {
                let apart = (0..3).map(|c| (color[i][c] - color[k][c]).abs()).fold(0.0, f32::max);
                assert!(apart > 0.02, "{} and {}: {:?}", numbers[i], numbers[k], color[i]);
            }
        }
        assert_eq!(color[12], linear_from_hex(super::super::distinct::FIRST[0]));
    }

    #[test]
    fn a_ramp_has_the_map_s_own_colours_at_its_ends_and_in_its_middle() {
        let map = ColorMap::VIRIDIS;
        let of_range = colored_column(vec![-3.0, -2.0, 0.0, 2.0, 9.0], PointColors::map_over(map, [-2.0, 2.0]));
        assert_eq!(of_range.color, [0.0, 0.0, 0.5, 1.0, 1.0].map(|place| map.at(place)));
        let of_data = colored_column((0..=100).map(f64::from).collect(), PointColors::map(map));
        assert_eq!(of_data.range, Some([1.0, 99.0]));
        assert_eq!([of_data.color[0], of_data.color[50], of_data.color[100]], [map.at(0.0), map.at(0.5), map.at(1.0)]);
    }

    #[test]
    fn a_logarithmic_map_has_powers_at_equal_places_and_leaves_out_what_has_none() {
        let map = ColorMap::VIRIDIS;
        let colors = PointColors::Map { map, range: Some([1e-2, 1e2]), scale: MapScale::Logarithmic };
        let found = colored_column(vec![1e-2, 1e-1, 1.0, 1e2, 0.0, -5.0], colors);
        for (color, place) in found.color.iter().zip([0.0, 0.25, 0.5, 1.0]) {
            let expected = map.at(place);
            assert!((0..3).all(|c| (color[c] - expected[c]).abs() < 1e-6), "{color:?} for {expected:?}");
        }
        assert_eq!((found.gaps, &found.color[4..]), (2, &[[0.5, 0.25, 0.125]; 2][..]));
        // Percentiles are those of the numbers that show.
        let colors = PointColors::Map { map, range: None, scale: MapScale::Logarithmic };
        assert_eq!(colored_column(vec![-1.0, 0.0, 1.0, 10.0], colors).range, Some([1.0, 10.0]));
        for place in [0.0, 0.3, 1.0] {
            let scale = MapScale::Logarithmic;
            assert!((scale.place(scale.number(place, [2.0, 5.0]), [2.0, 5.0]) - place).abs() < 1e-12);
        }
    }

    #[test]
    fn a_diverging_map_has_nothing_in_its_middle() {
        let map = ColorMap::named("coolwarm").expect("a map");
        assert_eq!(colored_column(vec![-1.0, 0.0, 3.0], PointColors::map(map)).range, Some([-3.0, 3.0]));
        assert_eq!(colored_column(vec![1.0, 2.0, 3.0], PointColors::map(map)).range, Some([1.0, 3.0]));
    }

    #[test]
    fn neither_the_order_nor_a_shift_nor_a_scale_changes_a_colour() {
        let numbers: Vec<f64> = (0..999).map(|i| f64::from(i * 37 % 999)).collect();
        let colors = || PointColors::map(ColorMap::TURBO);
        let once = colored_column(numbers.clone(), colors()).color;
        let mut back = colored_column(numbers.iter().rev().copied().collect(), colors()).color;
        back.reverse();
        assert_eq!(once, back);
        assert_eq!(once, colored_column(numbers.iter().map(|n| 1024.0 * n + 1e7).collect(), colors()).color);
    }

    #[test]
    fn a_column_of_one_number_has_the_middle_and_gaps_have_the_object_s_colour() {
        let found = colored_column(vec![4.0, f64::NAN, 4.0, f64::INFINITY], PointColors::map(ColorMap::TURBO));
        let middle = ColorMap::TURBO.at(0.5);
        let object_color = [0.5, 0.25, 0.125];
        assert_eq!((found.color, found.gaps), (vec![middle, object_color, middle, object_color], 2));
        assert_eq!(colored_column(vec![f64::NAN], PointColors::map(ColorMap::TURBO)).color, [object_color]);
    }

    #[test]
    fn classes_have_colours_of_their_own_and_others_those_of_whole_numbers() {
        let found = colored_column(vec![2.0, 6.0, 64.0, 76.0, 255.0, -1.0, 2.2], PointColors::Classes).color;
        assert_eq!(found[0], linear_from_hex(0xa67c52));
        assert!(found[0] != found[1] && found[2] != found[3] && found[6] == found[0]);
        assert_eq!([class_name(2), class_name(6), class_name(64)], [Some("ground"), Some("building"), None]);
        let whole = colored_column(vec![64.0, 255.0, -1.0, 1e300], PointColors::Distinct).color;
        assert_eq!([found[2], found[4], found[5]], [whole[0], whole[1], whole[2]]);
    }

    #[test]
    fn a_transfer_function_gives_its_colours() {
        let point = |value, red| TransferPoint { value, color: [red, 0.0, 1.0], extinction: 0.0 };
        let transfer = TransferFunction::new(vec![point(0.0, 0.0), point(4.0, 1.0)]).expect("rising values");
        let found = colored_column(vec![1.0, 9.0], PointColors::Transfer(transfer, Classified::No));
        assert_eq!((found.color, found.classified), (vec![[0.25, 0.0, 1.0], [1.0, 0.0, 1.0]], Vec::new()));
    }

    #[test]
    fn a_transfer_function_classifies_and_gaps_stay_what_they_are() {
        let point = |value, extinction| TransferPoint { value, color: [1.0; 3], extinction };
        let transfer = TransferFunction::new(vec![point(0.0, 0.0), point(4.0, 1.0)]).expect("rising values");
        let classified =
            |by| colored_column(vec![-1.0, 1.0, f64::NAN, 9.0], PointColors::Transfer(transfer.clone(), by)).classified;
        assert_eq!(classified(Classified::Opacity), [0.0, 0.25, 1.0, 1.0]);
        assert_eq!(classified(Classified::Extinction), [0.0, 0.25, 0.0, 1.0]);
    }

    #[test]
    fn a_column_that_is_not_there_is_refused_by_name() {
        let by = ColorBy { column: "heat".into(), colors: PointColors::Distinct };
        let error = colored(&points(vec![1.0]), &by, DVec3::Y, &SplatParams::default()).expect_err("no such column");
        assert!(error.to_string().contains("heat"), "{error}");
    }
}
