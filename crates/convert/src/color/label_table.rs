//! Tables of labels: each whole number of a volume of labels has a name, a colour and an opacity.

use super::distinct::distinct;
use std::collections::BTreeMap;

/// The largest label: beyond it single precision leaves numbers out.
pub const LARGEST_LABEL: u32 = 1 << 24;

/// The look of one label.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    /// Its name; empty where it has none.
    pub name: String,
    /// Linear Rec.709; `None` for the colour that its number has without a table.
    pub color: Option<[f32; 3]>,
    /// Opacity of one crossing, in \[0, 1\]; a label with 0 is hidden, as if its voxels had none.
    pub opacity: f32,
}

/// Labels by their numbers. A number that it lacks is opaque, in a colour that tells it from others.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LabelTable {
    labels: BTreeMap<u32, Label>,
}

impl Default for Label {
    /// Opaque, without a name, in the colour of its number.
    fn default() -> Self {
        Self { name: String::new(), color: None, opacity: 1.0 }
    }
}

impl FromIterator<(u32, Label)> for LabelTable {
    /// Of several labels with one number the last counts.
    fn from_iter<I: IntoIterator<Item = (u32, Label)>>(labels: I) -> Self {
        Self { labels: labels.into_iter().collect() }
    }
}

impl LabelTable {
    /// The look of a number, which is rounded; `None` for one that the table lacks.
    ///
    /// ```
    /// use convert::{Label, LabelTable};
    /// let liver = Label { name: "liver".into(), ..Label::default() };
    /// let table = LabelTable::from_iter([(3, liver)]);
    /// assert_eq!(table.get(3.0).map(|label| label.name.as_str()), Some("liver"));
    /// assert_eq!(table.get(4.0), None);
    /// ```
    pub fn get(&self, number: f64) -> Option<&Label> {
        let number = number.round();
        let is_label = (0.0..=f64::from(LARGEST_LABEL)).contains(&number);
        is_label.then(|| self.labels.get(&(number as u32))).flatten()
    }

    /// All labels, by rising number.
    pub fn labels(&self) -> impl Iterator<Item = (u32, &Label)> {
        self.labels.iter().map(|(number, label)| (*number, label))
    }

    /// The name of a number, where it has one.
    pub fn name(&self, number: f64) -> Option<&str> {
        self.get(number).map(|label| label.name.as_str()).filter(|name| !name.is_empty())
    }

    /// Linear Rec.709 of a number.
    pub fn color(&self, number: f64) -> [f32; 3] {
        self.get(number).and_then(|label| label.color).unwrap_or_else(|| distinct(number))
    }

    /// Opacity of one crossing of the surface of a number, in \[0, 1\].
    pub fn opacity(&self, number: f64) -> f32 {
        self.get(number).map_or(1.0, |label| label.opacity)
    }

    /// Whether some label is hidden or translucent.
    pub fn has_opacities(&self) -> bool {
        self.labels.values().any(|label| label.opacity < 1.0)
    }

    /// The table with the labels of another one in the place of its own.
    #[must_use]
    pub fn with(mut self, others: Self) -> Self {
        self.labels.extend(others.labels);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_without_a_row_are_opaque_in_their_own_colour_and_later_rows_count() {
        let row = |name: &str, opacity| Label { name: name.into(), color: Some([0.5; 3]), opacity };
        let first = LabelTable::from_iter([(3, row("liver", 0.25)), (4, row("", 0.0))]);
        assert_eq!((first.color(3.0), first.opacity(3.0), first.opacity(4.0)), ([0.5; 3], 0.25, 0.0));
        assert_eq!((first.color(5.0), first.opacity(5.0)), (distinct(5.0), 1.0));
        assert_eq!([3.0, 4.0, 5.0, -3.0, f64::NAN].map(|n| first.name(n)), [Some("liver"), None, None, None, None]);
        assert!(first.has_opacities());
        let both = first.with(LabelTable::from_iter([(3, row("spleen", 1.0)), (4, Label::default())]));
        assert_eq!((both.name(3.0), both.has_opacities(), both.labels().count()), (Some("spleen"), false, 2));
    }
}
